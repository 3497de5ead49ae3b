"""The compiled code against its NumPy reference and against LAPACK."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import stripfold
from stripfold import kernels
from stripfold.solve.linear import Band


def close(found: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-13 * np.abs(expected).max())


def banded(n: int, width: int, shift: float) -> np.ndarray:
    """A matrix of random entries within the band, plus a multiple of the identity."""
    rng = np.random.default_rng(2)
    i, j = np.indices((n, n))
    return np.where(abs(i - j) <= width, rng.standard_normal((n, n)), 0.0) + shift * np.eye(n)


def stored(a: np.ndarray, width: int) -> np.ndarray:
    """The storage of the kernels."""
    n = len(a)
    band = Band.zeros(n, width)
    for j in range(n):
        for i in range(max(0, j - width), min(n, j + width + 1)):
            band.columns[j, width + i - j] = a[i, j]
    return band.flat


@pytest.mark.parametrize("w", [1, 7, 8, 17])
def test_band_matrix(w):
    """Widths below, at and above the number of entries in one instruction."""
    n = 50
    a, x = banded(n, w, 40.0), np.random.default_rng(3).standard_normal(n)
    a[7, 7 + w] = a[7 + w, 7] = 0.0  # the profile is narrower than the band
    band = stored(a, w)
    close(kernels.band.product(band, w, x), a @ x)
    close(kernels.band.rounding(band, w, x), np.abs(a) @ x)
    held = np.zeros(n, bool)
    held[[0, 5, 49]] = True
    kernels.band.hold(band, w, held)
    kept = np.abs(np.diag(a))[held]
    a[held] = a[:, held] = 0.0
    a[held, held] = kept
    close(kernels.band.product(band, w, x), a @ x)
    reach = np.empty(n, np.int64)
    assert kernels.band.factorise(band, w, reach)
    close(kernels.band.substitute(band, w, reach, x), np.linalg.solve(a, x))


def test_a_matrix_that_needs_pivots_is_refused():
    """Leading blocks that are singular, or nearly so; the matrices are regular."""
    for corner in (0.0, 1e-9, np.nan):
        a = np.array([[corner, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 3.0]])
        assert not kernels.band.factorise(stored(a, 1), 1, np.empty(3, np.int64))
        if corner == corner:
            solve = Band(stored(a, 1), 1).factor()
            close(solve(np.arange(3.0)), np.linalg.solve(a, np.arange(3.0)))


KERNEL = """
import logging, numba
logging.basicConfig(level=logging.INFO)
from stripfold.kernels.compiler import compiled
@compiled(numba.float64(numba.float64))
def double(x):
    return 2.0 * x
@compiled(numba.float64(numba.float64))
def triple(x):
    return 3.0 * x
assert (double(1.0), triple(1.0)) == (2.0, 3.0)
print(sum(sum(kernel.stats.cache_hits.values()) for kernel in (double, triple)))
"""


def compile_in(folder: Path, **environment: str) -> tuple[int, str]:
    """Import the kernels of the package in ``folder`` in a process of its own, which minds rights even as root.

    How many of the two come from a cache, and what is logged.
    """
    settings = {**os.environ, "PYTHONPATH": str(folder), **environment}
    settings.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, "-c", "import stripfold.kernels.double"]
    rights = partial(ctypes.CDLL(None).prctl, 24, 1)  # PR_CAPBSET_DROP, CAP_DAC_OVERRIDE
    done = subprocess.run(command, env=settings, capture_output=True, text=True, check=True, preexec_fn=rights)
    return int(done.stdout), done.stderr


def copy_package(folder: Path) -> Path:
    """A package of nothing but the compiler's settings and two small kernels."""
    source, target = Path(stripfold.__file__).parent / "kernels", folder / "site" / "stripfold" / "kernels"
    target.mkdir(parents=True)
    (target.parent / "__init__.py").touch()
    for name in ("__init__.py", "compiler.py"):
        (target / name).write_text((source / name).read_text())
    (target / "double.py").write_text(KERNEL)
    return folder / "site"


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    return copy_package(tmp_path)


def kept(folder: Path) -> list[Path]:
    """The files of the cache: all but Python's own."""
    return [path for path in folder.rglob("*") if path.is_file() and path.suffix not in (".py", ".pyc")]


@pytest.fixture(scope="module")
def compiled_package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = copy_package(tmp_path_factory.mktemp("compiled"))
    compile_in(folder)
    return folder


def replace_by_folders(files: list[Path]) -> None:
    for path in files:
        path.unlink()
        path.mkdir()


def each(change: Callable[[bytes], bytes]) -> Callable[[list[Path]], None]:
    return lambda files: [path.write_bytes(change(path.read_bytes())) for path in files]


@pytest.mark.parametrize(
    "damage",
    [
        pytest.param(each(lambda content: content[:-99] + b"\0" + content[-98:]), id="one byte"),
        pytest.param(replace_by_folders, id="folders"),
    ],
)
def test_a_damaged_cache_costs_nothing_but_time(compiled_package, tmp_path, damage):
    package, home = tmp_path / "site", {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    shutil.copytree(compiled_package, package)
    damage(kept(package))
    hits, said = compile_in(package, **home)  # it asserts what the kernels return
    assert hits == 0
    assert "cannot be kept" not in said
    assert compile_in(package, **home) == (2, "")


def test_a_package_that_cannot_be_written_to_loads_its_own_or_uses_the_users_cache(copied, tmp_path):
    package, nowhere = copied / "stripfold" / "kernels" / "__pycache__", {"XDG_CACHE_HOME": os.devnull}
    package.mkdir()
    package.chmod(0o555)
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    assert [compile_in(copied, **home)[0] for _ in range(2)] == [0, 2]
    assert not kept(copied)
    hits, said = compile_in(copied, **nowhere)
    assert hits == 0
    assert said.count("cannot be kept") == 1
    package.chmod(0o755)
    compile_in(copied)
    package.chmod(0o555)
    assert compile_in(copied, **nowhere) == (2, "")
