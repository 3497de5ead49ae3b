"""Threads inside BLAS, and the public test images."""

import os
from pathlib import Path

import pytest

# The solvers' systems are small: threads inside BLAS only wait for each other.  Before numpy is imported.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

ROOT = Path(__file__).parents[1]
IMAGES = Path(os.environ.get("STRIPFOLD_IMAGES", ROOT.parent / "shared" / "data"))


@pytest.fixture(scope="session")
def images() -> Path:
    """The folder of the public test images."""
    if not IMAGES.is_dir():
        pytest.skip(f"the public test images are not in {IMAGES}; STRIPFOLD_IMAGES says where they are")
    return IMAGES
