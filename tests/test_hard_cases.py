"""The hard cases, one test each on coarse meshes, and what judges them."""

from __future__ import annotations

from math import nan
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from stripfold import store
from stripfold.errors import CrushedError, InvalidInputError, NewtonError
from studies.hard_cases import run as hard_cases
from studies.hard_cases.case import Case, Finding, judge, shown

ROOT = Path(__file__).parents[1]
COARSE = 2.0
"""Refinement of these tests, the stored run's."""

SLOW = {
    "just above the touch limit",
    "just below the touch limit",
    "long, high",
    "thick, h = 0.2 L*",
    "thick rod, h = 0.2 L*",
    "thin, h / L = 1e-5",
    "very fine mesh",
    "steps of 0.05 L*",
}
"""Seconds each; like the others they are in what the rule `hard_cases` stores, which is checked below."""


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=[pytest.mark.slow] * (case.name in SLOW)) for case in hard_cases.CASES],
    ids=lambda case: case.name,
)
def test_case(case: Case) -> None:
    """Right, or refused with the right error."""
    row = judge(case, COARSE)
    print(shown(row))
    assert not row["failed"], shown(row)


class TestJudge:
    @staticmethod
    def of(found: Finding | Exception | None, *errors: type) -> dict:
        def solve(_: float) -> Finding | None:
            if isinstance(found, Exception):
                raise found
            return found

        return judge(Case("name", "theme", "judged", solve, errors), 1.0)

    def test_values(self) -> None:
        """Within what is allowed or not; no number is never within."""
        assert self.of(Finding(1.0, 1.1, 0.11))["failed"] is False
        assert self.of(Finding(1.0, 1.1, 0.09))["failed"] is True
        for value, reference, allowed in ((nan, 1.0, 1.0), (1.0, nan, 1.0), (1.0, 1.0, nan)):
            assert self.of(Finding(value, reference, allowed))["failed"] is True

    def test_errors(self) -> None:
        """Of a type that is right, of another, without a type of its own, and one that should have come."""
        error = NewtonError("no", residuals=[1.0, 0.1, 0.01])
        row = self.of(error, NewtonError)
        assert (row["failed"], row["outcome"], row["message"], row["iterations"]) == (False, "NewtonError", "no", 2)
        assert self.of(CrushedError("no"), NewtonError)["failed"] is False
        assert self.of(error, InvalidInputError)["failed"] is True
        assert self.of(error)["failed"] is True
        assert self.of(RuntimeError("exactly singular"), NewtonError)["failed"] is True
        row = self.of(None, NewtonError)
        assert (row["failed"], row["outcome"]) == (True, "no error")

    def test_what_is_stored(self, tmp_path: Path) -> None:
        rows = [self.of(Finding(1.0, 1.1, 0.2, 7)), self.of(NewtonError("no"), NewtonError), self.of(None)]
        data = hard_cases.dataset(rows, 1.0)
        np.testing.assert_array_equal(data["failed"], [0.0, 0.0, 1.0])
        store.write(data, tmp_path / "hard.nc", title="hard cases")
        xr.testing.assert_equal(store.read(tmp_path / "hard.nc").drop_attrs(), data.drop_attrs())
        table = hard_cases.markdown(data).splitlines()
        assert table[2].startswith("| theme | name | judged | 1 | 1.0e-01 | 2.0e-01 | 7 | ")
        assert [line.split(" | ")[-1] for line in table[2:]] == ["yes |", "yes |", "no |"]


def test_the_registry() -> None:
    """Names of their own, and every theme that was asked for."""
    names = [case.name for case in hard_cases.CASES]
    assert len(set(names)) == len(names) >= 25
    assert set(names) > SLOW
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
    assert not data["failed"].values.any()
    assert data["name"].values.tolist() == [case.name for case in hard_cases.CASES]
