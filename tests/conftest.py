"""The solvers' systems are small: threads inside BLAS only wait for each other.  Before numpy is imported."""

import os
from pathlib import Path

import pytest

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

ROOT = Path(__file__).parents[1]
IMAGES = Path(os.environ.get("STRIPFOLD_IMAGES", ROOT.parent / "shared" / "data"))


@pytest.fixture(scope="session")
def images() -> Path:
    """Folder of the public test images, of which the project carries no copy."""
    if not IMAGES.is_dir():
        pytest.skip(f"no public test images in {IMAGES}: set STRIPFOLD_IMAGES to their folder")
    return IMAGES
