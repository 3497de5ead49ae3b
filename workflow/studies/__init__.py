"""Benchmarks, verification studies and comparisons: they read the package; nothing in the package reads them."""
