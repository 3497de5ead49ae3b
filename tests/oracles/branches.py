"""What every branch must be, whatever it is of: the check of the branches that the tests make."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from stripfold.solve.problem import Point, Problem, inner


def check_branch(problem: Problem, points: Sequence[Point], tolerance: float = 1e-6) -> None:
    """Equilibria with unit tangents that go on in one direction; stability changes where lambda or a mode turns."""
    for point in points:
        force = problem.residual(point.q, point.lam)
        free = np.setdiff1d(np.arange(problem.size), problem.prescribed)
        free = np.setdiff1d(free, problem.bounded)  # the floor may push there
        assert np.abs(force[free]).max(initial=0.0) < tolerance
        assert inner(problem.metric, point.tangent, point.tangent) == pytest.approx(1.0, abs=1e-9)
        assert point.negatives >= 0
    for before, after in pairwise(points):
        assert after.arc > before.arc
        assert inner(problem.metric, before.tangent, after.tangent) > 0.0, "it turned round"
        if after.negatives != before.negatives and not len(problem.bounded):
            near = min(np.abs(point.eigenvalues).min() for point in (before, after))
            far = max(np.abs(point.eigenvalues).max() for point in (before, after))
            assert near < 0.5 * far or before.tangent.lam * after.tangent.lam < 0.0
