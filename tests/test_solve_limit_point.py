"""Limit points solved for directly: closed forms, quadratic convergence, and the check by a state on either side."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from oracles.lee_frame import LeeFrame
from oracles.toys import NONE, Toy, Truss
from stripfold.base.errors import NewtonError, SolveError
from stripfold.solve import continuation, critical
from stripfold.solve.continuation import StepOptions
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Problem, Tangent

TIGHT = NewtonOptions(force_tolerance=1e-12, largest_step=0.5)
STEPS = StepOptions(newton=TIGHT)
RISE = 0.3
TRUSS = Truss(1.0, RISE)
TOP = RISE / sqrt(3.0) - RISE
"""Displacement of the apex at the limit load."""
DOWN = Tangent(np.array([0.0, -1.0]), 0.0)


def solve(q: float, lam: float, tolerance: float = 1e-10, towards: Tangent = DOWN) -> critical.LimitPoint:
    """The truss's limit point from an apex displacement."""
    return critical.limit_point(TRUSS.problem(), np.array([0.0, q]), lam, towards, NONE, TIGHT, tolerance=tolerance)


@pytest.mark.parametrize(("q", "share"), [(0.5 * TOP, 0.8), (0.9 * TOP, 1.0), (1.2 * TOP, 1.1), (0.5 * TOP, 0.0)])
def test_limit_load_from_a_state_that_is_no_equilibrium(q: float, share: float):
    """Truth: ``oracles.toys.Truss``."""
    found = solve(q, share * TRUSS.limit_load)
    assert found.state.lam == pytest.approx(TRUSS.limit_load, rel=1e-12)
    assert found.state.q == pytest.approx([0.0, TOP], abs=1e-9)
    assert found.tangent.q == pytest.approx([0.0, -1.0], abs=1e-8)
    # The load's second derivative by the height: -6 EA w / L^3.
    assert found.bend.lam == pytest.approx(-6.0 * TRUSS.stiffness * RISE / sqrt(3.0) / TRUSS.bar**3, rel=1e-5)
    q, lam = found.beside(1e-3)
    assert lam == pytest.approx(TRUSS.load(RISE + q[1]), abs=1e-7)


def test_quadratic():
    """The number of digits of the slope doubles with each iteration, and that of the unbalanced force."""
    found = solve(0.75 * TOP, 0.95 * TRUSS.limit_load)
    slopes = np.abs(found.slopes)
    print("slopes", slopes, "forces", np.array(found.state.residuals))
    near = slopes[slopes < 0.3]
    near = near[near > 1e-9]
    assert len(near) >= 3
    assert np.log(near[-1]) / np.log(near[-2]) > 1.7
    assert len(slopes) <= 8


def test_lee_frame():
    """The same as by bracketing, from a state far from it: 19 elements in large displacements."""
    options = StepOptions(first=1.0, largest=8.0, smallest=1e-4, kink=0.05, newton=NewtonOptions(largest_step=30.0))
    frame: Problem = LeeFrame(10)
    before = continuation.start(frame, np.zeros(frame.size), 0.0, NONE, 1.0, options)
    for after in continuation.follow(frame, before, options):
        if critical.is_past(after, before):
            break
        before = after
    event = replace(critical.LIMIT, tolerance=1e-5)
    bracketed = continuation.locate(frame, continuation.Crossing(event, before, after), options)
    found = critical.near(frame, before, 1e-8, options)
    assert found.lam == pytest.approx(bracketed.before.lam, abs=1e-7)
    assert found.agree
    assert found.width <= 1e-8


class TestCheck:
    """A limit point is the critical point only where a stable branch loses its stability with lambda below."""

    def test_it_is(self):
        found = critical.checked(TRUSS.problem(), solve(0.8 * TOP, 1.0), 1e-8, STEPS)
        assert found.agree
        assert found.before.arc < 0.0 < found.after.arc
        assert found.lower <= TRUSS.limit_load + 1e-12 <= found.upper + 2e-12
        assert found.width <= 1e-8

    def test_a_minimum_is_refused(self):
        """The truss's lower limit point, at w = -b / sqrt(3)."""
        lower = solve(-RISE / sqrt(3.0) - RISE + 0.01, -TRUSS.limit_load)
        assert lower.state.lam == pytest.approx(-TRUSS.limit_load, rel=1e-10)
        with pytest.raises(SolveError, match="no maximum"):
            critical.checked(TRUSS.problem(), lower, 1e-8, STEPS)

    def test_behind_a_bifurcation(self):
        """The steep truss has swayed to a side before its limit load: neither side is stable."""
        steep = Truss(1.0, 2.0, stiffness=3.0)
        q = np.array([0.0, 2.0 / sqrt(3.0) - 2.0 + 0.01])
        found = critical.limit_point(steep.problem(), q, steep.limit_load, DOWN, NONE, TIGHT)
        assert found.state.lam == pytest.approx(steep.limit_load, rel=1e-9)
        with pytest.raises(SolveError, match="does not lose its stability"):
            critical.checked(steep.problem(), found, 1e-6, STEPS)


def test_there_is_none():
    """A branch on which lambda always rises: an error with the history, no point."""
    rising = Toy(1, lambda q, lam: (q**3 + q - lam, np.diag(3.0 * q**2 + 1.0), -np.ones(1)))
    with pytest.raises(NewtonError) as error:
        critical.limit_point(rising, np.array([0.2]), 0.2, Tangent(np.ones(1), 0.0), NONE, TIGHT)
    assert error.value.residuals
