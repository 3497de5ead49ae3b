"""What decides that a result is redone, beside Snakemake's own triggers: a parameter of every rule."""

import sys
from functools import cache
from hashlib import sha256
from importlib.metadata import distributions
from importlib.resources import files
from pathlib import Path


@cache
def digest() -> str:
    """Digest all files of the installed package, code and data, and the versions that are really installed."""
    package = Path(str(files("stripfold")))
    found = sha256(sys.version.encode())
    for path in sorted(path for path in package.rglob("*") if path.is_file() and "__pycache__" not in path.parts):
        found.update(f"{path.relative_to(package)}\n".encode() + path.read_bytes())
    # The version of the project itself names the commit, which pages and tests change too.
    versions = {f"{one.name}=={one.version}" for one in distributions() if one.name != "stripfold"}
    return sha256(found.digest() + "\n".join(sorted(versions)).encode()).hexdigest()[:16]
