"""The stability boundary: against critical points found one by one, and beyond where the elastica is a start."""

from __future__ import annotations

import pytest

from stripfold.ask.prediction import ElasticaPrediction, from_near_the_end, snap
from stripfold.ask.stability_boundary import stability_boundary
from stripfold.base.errors import SolveError
from stripfold.follow.statics import StripModel, solve_height

LENGTH = 14.0


@pytest.mark.parametrize("kind", ["rod", "solid"])
def test_over_the_height(kind: str):
    """Truth: each critical point by itself, the branch followed to it."""
    strip, heights = StripModel(LENGTH, 0.05, kind=kind), [1.7, 2.0, 2.5, 3.0, 4.0]
    for height, run in zip(heights, stability_boundary((strip, z) for z in heights), strict=True):
        alone = from_near_the_end(strip, ElasticaPrediction.at(height))
        assert alone.critical is not None
        assert run.critical is not None
        assert run.critical.agree
        assert run.critical.lower <= run.lam <= run.critical.upper
        # The elements are planned for other lift-offs.
        assert run.lam == pytest.approx(alone.lam, rel=4e-5)
        assert run.free_length == pytest.approx(alone.free_length, abs=2e-3)


def test_over_the_thickness():
    """To a strip too thick for the elastica's critical state to be a start."""
    strips = [StripModel(LENGTH, 0.01 * h, kind="rod") for h in range(20, 31, 2)]
    runs = list(stability_boundary((strip, 3.0) for strip in strips))
    with pytest.raises(SolveError):
        snap(strips[-1], ElasticaPrediction.at(3.0))
    assert runs[-1].lam == pytest.approx(solve_height(strips[-1], 3.0).lam, rel=1e-4)


def test_its_end():
    """Below the touch limit the sag touches first."""
    boundary = stability_boundary((StripModel(LENGTH, 0.02, kind="rod"), z) for z in (1.65, 1.6, 1.5))
    assert next(boundary).lam > next(boundary).lam
    with pytest.raises(SolveError):
        next(boundary)
