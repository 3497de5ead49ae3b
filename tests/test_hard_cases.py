"""The hard cases, one test each on coarse meshes, and what judges them."""

from __future__ import annotations

from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from stripfold.ask import critical
from stripfold.ask.inputs import Scene
from stripfold.ask.prediction import ElasticaPrediction
from stripfold.base.arrays import Array
from stripfold.base.errors import CrushedError, InvalidInputError, NewtonError, StripfoldError
from stripfold.base.material import Material
from stripfold.files import store
from stripfold.strip.moving_contact import MovingContact
from studies.hard_cases import run as hard_cases
from studies.hard_cases.case import Case, Finding, judge, refined

ROOT = Path(__file__).parents[1]
COARSE = 1.0
"""Refinement of these tests, the stored run's."""

SLOW = (
    "touch limit",
    "long, ",
    "thick, ",
    "thick rod",
    "thin, ",
    "mesh",
    "steps of",
    "eta_b = ",
    "z = 0.",
)
"""Seconds each; like the others they are in what the rule `hard_cases` stores, which is checked below."""


def marks(name: str) -> list[pytest.MarkDecorator]:
    return [pytest.mark.slow] if any(part in name for part in SLOW) and name != "z = 0" else []


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=marks(case.name)) for case in hard_cases.CASES],
    ids=lambda case: case.name,
)
def test_case(case: Case) -> None:
    """The expected outcome, and no other."""
    row = judge(case, COARSE)
    assert not row["failed"], row


def judged(found: Finding | Exception | None, error: type[StripfoldError] | None = None) -> dict:
    def solve(_: float) -> Finding | None:
        if isinstance(found, Exception):
            raise found
        return found

    return judge(Case("theme", "name", "judged", solve, error), 1.0)


@pytest.mark.parametrize(
    ("found", "error", "outcome", "failed"),
    [
        # Three times the estimate and the error of the reference are allowed, and no more.
        (Finding(1.0, 1.1, 0.03, 0.011), None, "value", False),
        (Finding(1.0, 1.1, 0.03, 0.009), None, "value", True),
        (Finding(nan, 1.0, 1.0), None, "wrong branch", True),
        (Finding(1.0, nan, 1.0), None, "value", True),
        (Finding(1.0, 1.0, nan), None, "value", True),
        # A right value is no right outcome where an error is expected, nor the other way round.
        (Finding(1.0, 1.0, 0.0), NewtonError, "value", True),
        (NewtonError("no"), None, "NewtonError", True),
        (NewtonError("no"), NewtonError, "NewtonError", False),
        (CrushedError("no"), NewtonError, "CrushedError", False),
        (NewtonError("no"), InvalidInputError, "NewtonError", True),
        (RuntimeError("exactly singular"), NewtonError, "RuntimeError", True),
        (None, NewtonError, "no error", True),
    ],
)
def test_one_outcome_is_right(
    found: Finding | Exception | None, error: type[StripfoldError] | None, outcome: str, failed: bool
) -> None:
    row = judged(found, error)
    assert (row["outcome"], row["failed"]) == (outcome, failed)


def test_the_error_is_estimated_from_the_mesh_half_as_fine() -> None:
    found = refined(lambda refinement: 1.0 + refinement**2, 0.1, 1.0, 0.5)
    assert found == pytest.approx((1.01, 1.0, 0.03, 0.5))
    assert found.allowed == pytest.approx(0.59)


def test_no_strip_costs_far_more_than_the_median(monkeypatch: pytest.MonkeyPatch) -> None:
    """By unknowns times iterations.  Once one of 298 took 18 times as long as the median, near lift-off or low.

    And a gripper at 50 to 57 L* a minute, to end in an error.
    """
    costs: list[int] = []
    linearise = MovingContact.linearise

    def counted(problem: MovingContact, q: Array, *given: Any) -> Any:
        costs[-1] += q.size
        return linearise(problem, q, *given)

    monkeypatch.setattr(MovingContact, "linearise", counted)
    random, heights = np.random.default_rng(20261124), [*np.geomspace(0.7, 20.0, 30), 50.0, 57.0]
    for height, extra in zip(heights, random.permuted(np.geomspace(0.05, 9.0, 32)), strict=True):
        eta_b, eta_m = 10.0 ** random.uniform(2.8, 4.6), 10.0 ** random.uniform(-5.0, -2.5)
        unit, prediction = Material(eta_b).gravity_length, ElasticaPrediction.at(height)
        length = unit * (prediction.last.length + extra)
        costs.append(0)
        scene = Scene(length=length, height=unit * height, eta_b=eta_b, eta_m=eta_m, model="solid")
        critical.find(scene, prediction=prediction)
    assert max(costs) < 0.5 * 18.0 * np.median(costs)


def test_storing(tmp_path: Path) -> None:
    rows = [judged(Finding(1.0, 1.1, 0.05)), judged(NewtonError("no"), NewtonError), judged(None)]
    data = hard_cases.dataset(rows, 1.0)
    np.testing.assert_array_equal(data["failed"], [0.0, 0.0, 1.0])
    store.write(data, tmp_path / "hard.nc", title="hard cases")
    xr.testing.assert_equal(store.read(tmp_path / "hard.nc").drop_attrs(), data.drop_attrs())
    table = hard_cases.markdown(data).splitlines()
    assert table[2].startswith("| theme | name | judged | 1 | 1.0e-01 | 1.5e-01 | ")
    assert [line.split(" | ")[-1] for line in table[2:]] == ["yes |", "yes |", "no |"]


def test_the_registry() -> None:
    """Names of their own, and every theme that was asked for."""
    names = [case.name for case in hard_cases.CASES]
    assert len(set(names)) == len(names) >= 25
    assert {case.theme for case in hard_cases.CASES} == {
        "very thin",
        "thick",
        "eta_b over eight decades",
        "coarse and very fine meshes",
        "distorted meshes",
        "very large and very small steps",
        "starts from bad guesses",
        "exact symmetry",
        "neighbourhood of a critical point",
        "cusp",
        "grazing contact",
        "lift-off of the whole strip",
        "long strips",
        "taut strip",
        "gripper at the floor",
        "near-inverted elements",
        "nearly singular K",
        "repeated eigenvalues",
    }


def test_the_stored_run_has_these_cases() -> None:
    data = store.read(ROOT / "results" / "studies" / "hard_cases.nc")
    assert not data["name"].values[data["failed"].values != 0.0].tolist()
    assert data["name"].values.tolist() == [case.name for case in hard_cases.CASES]
