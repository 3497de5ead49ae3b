"""The solvers' systems are small: threads inside BLAS only wait for each other.  Before numpy is imported."""

import os
from pathlib import Path

import pytest

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

ROOT = Path(__file__).resolve().parents[1]
IMAGES = Path(os.environ.get("STRIPFOLD_IMAGES", ROOT.parent / "shared" / "data"))


@pytest.fixture(scope="session")
def images() -> Path:
    """The folder of public test images, which the project does not carry."""
    if not IMAGES.is_dir():
        pytest.skip(f"the public test images are not at {IMAGES}; STRIPFOLD_IMAGES says where they are")
    return IMAGES
