"""The compiled code against its NumPy reference and against LAPACK."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import stripfold
from oracles.kernels import RodReference, SolidReference
from stripfold import kernels
from stripfold.solve.linear import Band
from stripfold.strip.model import Model
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid

ENDS = np.array([0.0, 0.2, 0.5, 0.6, 1.0, 1.3, 1.7, 2.0])
MODELS = {
    "rod": lambda: Rod.of(2.0, 0.1, elements=ENDS),
    "solid": lambda: Solid.of(2.0, 0.1, nu=0.3, elements=ENDS),
}


def close(found: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-13 * np.abs(expected).max())


@pytest.fixture(params=MODELS)
def both(request: pytest.FixtureRequest) -> tuple[Model, RodReference | SolidReference, list[np.ndarray]]:
    """A strip, its reference, and three of its states."""
    model = MODELS[request.param]()
    rng = np.random.default_rng(4)
    states = [0.1 * rng.standard_normal(model.size) for _ in range(3)]
    return model, RodReference(model) if isinstance(model, Rod) else SolidReference(model), states


@pytest.mark.parametrize("with_stress", [False, True])
def test_force_and_tangent(both, with_stress):
    model, reference, (q0, q1, dq) = both
    stress = reference.predict_stress(q0, dq) if with_stress else None
    force, tangent = model.force_and_tangent(q1, stress)
    expected = reference.force_and_tangent(q1, stress)
    close(force, expected[0])
    close(tangent.flat, expected[1].flat)
    close(model.internal_force(q1), expected[0])


@pytest.mark.parametrize("with_stress", [False, True])
@pytest.mark.parametrize("kappa", [0.0, 0.7])
def test_force_over_a_step(both, kappa, with_stress):
    model, reference, (q0, q1, dq) = both
    stress = reference.predict_stress(q0, dq) if with_stress else None
    force, tangent = model.force_over_step(q0, q1, kappa, stress)
    expected = reference.force_over_step(q0, q1, kappa, stress)
    close(force, expected[0])
    close(tangent.flat, expected[1].flat)


def test_stress_energy_and_distance(both):
    model, reference, (q0, q1, dq) = both
    stress = model.predict_stress(q0, dq)
    close(stress, reference.predict_stress(q0, dq))
    assert model.energy(q0) == pytest.approx(reference.energy(q0), rel=1e-13)
    assert model.strain_distance(q0, q1) == pytest.approx(reference.strain_distance(q0, q1), rel=1e-13)


def with_growth(model: Model, growth: np.ndarray) -> Model:
    """The strip with its elements longer by these shares."""
    return model.with_lengths(model.lengths * (1.0 + growth))


def reference_of(model: Model) -> RodReference | SolidReference:
    return RodReference(model) if isinstance(model, Rod) else SolidReference(model)


@pytest.mark.parametrize("with_stress", [False, True])
@pytest.mark.parametrize("thickness", [1e-3, 1e-2, 0.06])
@pytest.mark.parametrize("name", MODELS)
def test_derivatives_by_lengths(name, thickness, with_stress):
    """Against differences over strips with longer elements, the stress changed by what the strain's is."""
    model = replace(MODELS[name](), thickness=thickness) if name == "rod" else None
    model = model or Solid.of(2.0, thickness, nu=0.3, elements=ENDS)
    rng = np.random.default_rng(6)
    q, dq, zero = 0.1 * rng.standard_normal(model.size), 0.1 * rng.standard_normal(model.size), np.zeros(model.size)
    growth = rng.standard_normal((2, len(ENDS) - 1))
    here = reference_of(model)
    stress = here.predict_stress(q, dq) if with_stress else None
    force, tangent, columns = model.force_and_derivatives(q, growth, stress)
    expected = model.force_and_tangent(q, stress)
    np.testing.assert_array_equal(force, expected[0])
    np.testing.assert_array_equal(tangent.flat, expected[1].flat)
    step = 1e-4
    for column, by in zip(columns.T, growth, strict=True):
        forces = []
        for sign in (1.0, -1.0):
            there = reference_of(with_growth(model, sign * step * by))
            more = 0.0 if stress is None else stress - here.predict_stress(q, zero)
            if isinstance(model, Rod):
                # The weights of the membrane strains are proportional to the length.
                more = more * np.where(np.arange(9) < 3, 1.0 + sign * step * by[:, None], 1.0)
            forces.append(there.force_of(q, there.predict_stress(q, zero) + more))
        difference = (forces[0] - forces[1]) / (2.0 * step)
        np.testing.assert_allclose(column, difference, rtol=0.0, atol=1e-6 * np.abs(difference).max())


@pytest.mark.parametrize("name", MODELS)
def test_stress_predicted_in_longer_elements(name):
    """Its error is the square of the step, in the unknowns and in the lengths."""
    model = MODELS[name]()
    rng = np.random.default_rng(7)
    q, dq, growth = 0.1 * rng.standard_normal(model.size), rng.standard_normal(model.size), rng.standard_normal(7)
    apart = []
    for step in (1e-3, 5e-4):
        predicted = model.predict_stress(q, step * dq, step * growth)
        there = reference_of(with_growth(model, step * growth))
        true = there.predict_stress(q + step * dq, np.zeros(model.size))
        # Of each strain, or each component in each point: the membrane's stress is much the largest.
        apart.append(np.abs(predicted - true).reshape(len(true), -1).max(axis=0))
    assert apart[0] / apart[1] == pytest.approx(4.0, rel=0.05)


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


@pytest.mark.slow
def test_the_cache_is_used_until_any_kernel_changes(copied):
    # Processes that compile at once do not disturb each other.
    with ThreadPoolExecutor() as pool:
        assert len(list(pool.map(compile_in, 2 * [copied]))) == 2
    assert compile_in(copied) == (2, "")
    with (copied / "stripfold" / "kernels" / "compiler.py").open("a") as file:
        file.write("# changed\n")
    hits, said = compile_in(copied)
    assert hits == 0
    assert said.count("compiling, once") == 1


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


def swap(files: list[Path]) -> None:
    """Give the files of each kind to the other kernel."""
    for suffix in {path.suffix for path in files}:
        first, second = (path for path in files if path.suffix == suffix)
        content = first.read_bytes()
        first.write_bytes(second.read_bytes())
        second.write_bytes(content)


@pytest.mark.parametrize(
    "damage",
    [
        pytest.param(each(lambda content: content[: len(content) // 2]), id="halved"),
        pytest.param(
            each(lambda content: content[:-99] + b"\0" + content[-98:]), id="one byte", marks=pytest.mark.slow
        ),
        pytest.param(swap, id="swapped", marks=pytest.mark.slow),
        pytest.param(replace_by_folders, id="folders", marks=pytest.mark.slow),
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


@pytest.mark.slow
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
