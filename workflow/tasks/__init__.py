"""The paper's runs as the workflow calls them: configuration in, datasets out."""
