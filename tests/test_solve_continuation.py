"""Following a branch: folds of load and of displacement, tangents, inertia, guards against jumping, events on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from math import inf, sqrt
from typing import ClassVar

import numpy as np
import pytest

from oracles.lee_frame import LeeFrame
from oracles.toys import NONE, Toy, Truss, branches, breaking, check_branch
from stripfold.base.errors import ContinuationError, NewtonError
from stripfold.solve import continuation
from stripfold.solve.continuation import Crossing, Event, StepOptions
from stripfold.solve.critical import LIMIT
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Point, Problem, Tangent, inner

STEPS = StepOptions(first=0.02, largest=0.05)
FRAME = StepOptions(first=1.0, largest=8.0, smallest=1e-4, kink=0.05, newton=NewtonOptions(largest_step=30.0))


def points_until(problem: Problem, options: StepOptions, until: Callable[[Point], bool], n: int = 600) -> list[Point]:
    """Accepted points from rest, lambda rising, until ``until(point)``."""
    first = continuation.start(problem, np.zeros(problem.size), 0.0, NONE, 1.0, options)
    points = []
    for point in islice(continuation.follow(problem, first, options), n):
        points.append(point)
        if until(point):
            check_branch(problem, points, tolerance=options.newton.force_tolerance * 1e2)
            return points
    raise AssertionError("the end was not reached")


def test_a_branch_without_an_end_is_given_up() -> None:
    problem = Truss(1.0, 0.3).problem()
    options = replace(STEPS, max_attempts=5)
    first = continuation.start(problem, np.zeros(problem.size), 0.0, NONE, 1.0, options)
    branch = continuation.follow(problem, first, options)
    assert len(list(islice(branch, 6))) == 6
    with pytest.raises(ContinuationError, match="in 5 steps"):
        next(branch)


class TestTruss:
    """Truth: the symmetric path of von Mises' truss, lambda(w) = EA w (b^2 - w^2) / L^3."""

    def test_the_whole_snap(self):
        """From rest through both limit points to the mirrored shape; every point on the path, inertia right."""
        truss = Truss(1.0, 0.3)
        points = points_until(truss.problem(), STEPS, lambda p: p.lam > truss.limit_load)
        fold = truss.b / sqrt(3.0)
        for p in points:
            w = truss.b + p.q[1]
            assert p.q[0] == 0.0
            assert p.lam == pytest.approx(float(truss.load(w)), abs=1e-7)
            assert p.negatives == int(-fold < w < fold)
            assert (p.eigenvalues[0] < 0.0) == (-fold < w < fold)
            assert np.sign(p.tangent.lam) == (-1.0 if -fold < w < fold else 1.0)
        assert truss.b + points[-1].q[1] < -1.1 * truss.b
        loads = np.array([p.lam for p in points])
        assert loads.min() == pytest.approx(-truss.limit_load, rel=0.02)

    def test_tangent_and_arc(self):
        """Truth: dlambda/dw of the closed form, unit length; the arc length is the sum of the steps asked for."""
        truss = Truss(1.0, 0.3)
        problem = truss.problem()
        for p in points_until(problem, STEPS, lambda p: p.arc > 1.0):
            w = truss.b + p.q[1]
            slope = truss.stiffness * (truss.b**2 - 3.0 * w**2) / truss.bar**3
            assert p.tangent.lam / p.tangent.q[1] == pytest.approx(slope, rel=1e-6, abs=1e-6)
            assert inner(problem.metric, p.tangent, p.tangent) == pytest.approx(1.0, abs=1e-12)
            assert p.tangent.q[1] < 0.0

    def test_backwards(self):
        """``start`` with sign -1 follows falling lambda: the apex is pulled up."""
        truss = Truss(1.0, 0.3)
        problem = truss.problem()
        first = continuation.start(problem, np.zeros(2), 0.0, NONE, -1.0, STEPS)
        assert first.tangent.lam < 0.0
        second = continuation.step(problem, first, 0.02, STEPS)
        assert second.lam < 0.0
        assert truss.b + second.q[1] > truss.b

    def test_symmetry_is_kept_and_the_pitchfork_seen(self):
        """A steep truss sways before it snaps: on the exactly symmetric path only the inertia tells.

        Truth: at w^2 = b^2 - 2 a^2 the sideways stiffness vanishes, lambda still rising; the snap comes later.
        """
        truss = Truss(1.0, 2.0, stiffness=3.0)
        fork, fold = truss.pitchfork, truss.b / sqrt(3.0)
        assert fork is not None
        assert fork > fold
        points = points_until(truss.problem(), STEPS, lambda p: truss.b + p.q[1] < 0.5 * fold)
        for p in points:
            w = truss.b + p.q[1]
            assert p.q[0] == 0.0
            assert p.negatives == int(w < fork) + int(w < fold)
            assert (p.tangent.lam > 0.0) == (w > fold)
            if fold < w < fork:
                assert abs(p.mode[0]) == pytest.approx(1.0, abs=1e-12)
        assert sum(fold < truss.b + p.q[1] < fork for p in points) > 3


class TestLeeFrame:
    """Truth: the load and the displacement of the frame both turn back, twice each (Lee, Manuel and Rossow, 1968)."""

    def test_the_whole_path(self):
        """Load up to 18.6 EI / L^2, down to -9.5, up again; the loaded point goes back in between."""
        frame = LeeFrame(10)
        points = points_until(frame, FRAME, lambda p: p.lam > 2.5)
        rising = np.array([p.tangent.lam for p in points]) > 0.0
        sinking = np.array([p.tangent.q[frame.loaded] for p in points]) < 0.0
        assert np.count_nonzero(np.diff(rising.astype(int))) == 2
        assert np.count_nonzero(np.diff(sinking.astype(int))) == 2
        # Between the load limits, and only there, one eigenvalue is negative.
        np.testing.assert_array_equal([p.negatives for p in points], (~rising).astype(int))
        loads = 10.0 * np.array([p.lam for p in points])
        print(f"{len(points)} points, loads from {loads.min():.2f} to {max(loads[~rising]):.2f}")
        assert loads[~rising].max() == pytest.approx(18.6, abs=0.3)
        assert loads.min() == pytest.approx(-9.5, abs=0.5)
        down = -np.array([p.q[frame.loaded] for p in points])
        back = np.flatnonzero(~sinking)
        assert down[back].max() == pytest.approx(61.0, abs=1.0)
        assert down[back].min() == pytest.approx(51.0, abs=1.0)
        for p in points:
            force = frame.residual(p.q, p.lam)
            assert np.abs(np.delete(force, frame.prescribed)).max() < 2e-7


class TestGuards:
    """Two branches near each other: a step that is too long lands on the wrong one, and must be refused.

    Truth: branches in closed form.  Branch A runs level and turns down at lambda = 1; B begins where A would go on.
    """

    @staticmethod
    def turning(lam: float) -> float:
        """Branch A: 0 before lambda = 1, of slope -2 after it, with a smooth corner of width 0.05."""
        return -2.0 * 0.05 * float(np.logaddexp(0.0, (lam - 1.0) / 0.05))

    CASES: ClassVar = {
        "too far from its prediction": ([lambda t: 0.4], {"max_correction": np.inf}),
        "turns by a cosine": ([lambda t: 0.05 + 0.8 * (t - 1.9)], {"min_cosine": -1.0}),
    }

    @pytest.mark.parametrize("guard", CASES)
    def test_a_jump_is_refused(self, guard):
        """The step raises; without the guard it lands on B; marching halves the step and stays on A."""
        (far,), off = self.CASES[guard]
        problem = branches([[self.turning, lambda t: 0.5 * (self.turning(t) + far(t)), far]])
        options = StepOptions(first=1.0, largest=1.0, newton=NewtonOptions(largest_step=np.inf))
        start = continuation.start(problem, np.zeros(1), 0.9, NONE, 1.0, options)
        # On the level part of A, pointing along it.
        start = replace(start, tangent=Tangent(np.zeros(1), 1.0))
        with pytest.raises(NewtonError, match=guard):
            continuation.step(problem, start, 1.0, options)
        landed = continuation.step(problem, start, 1.0, replace(options, **off))
        assert landed.q[0] == pytest.approx(far(landed.lam), abs=1e-8)
        assert landed.negatives == start.negatives
        points = []
        for p in continuation.follow(problem, start, options):
            points.append(p)
            if p.lam > 2.5:
                break
        assert all(p.q[0] == pytest.approx(self.turning(p.lam), abs=1e-6) for p in points)

    def test_inertia(self):
        """A jump along a straight line, without any turn: only the number of negative eigenvalues tells."""
        paths = [self.turning, lambda t: 0.05]
        problem = branches([paths, paths])
        options = StepOptions(first=1.0, largest=1.0, newton=NewtonOptions(largest_step=np.inf))
        start = continuation.start(problem, np.zeros(2), 0.7, NONE, 1.0, options)
        start = replace(start, tangent=Tangent(np.zeros(2), 1.0))
        assert start.negatives == 2
        with pytest.raises(NewtonError, match="several eigenvalues"):
            continuation.step(problem, start, 1.0, options)
        landed = continuation.step(problem, start, 1.0, replace(options, max_inertia_change=2))
        assert landed.negatives == 0
        assert landed.q == pytest.approx([0.05, 0.05], abs=1e-8)

    def test_an_unfolded_pitchfork_has_no_critical_point(self):
        """Truth: (q^2 - lam) q = eps has a stable branch for all lam; a long step lands on the unstable one near q = 0.

        Neither the tangent's turn nor the distance from the prediction tells; the bracket of the change of stability
        does: it narrows to a gap between two branches.
        """
        eps = 1e-3

        def function(q: np.ndarray, lam: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            return q * (q**2 - lam) - eps, np.diag(3.0 * q**2 - lam), -q

        problem, options = Toy(1, function), StepOptions(first=0.5, largest=0.5)
        first = continuation.start(problem, np.zeros(1), -0.6, NONE, 1.0, options)
        second = continuation.step(problem, first, 0.5, options)
        assert continuation.step(problem, second, 0.5, options).negatives == 1
        points = []
        for item in continuation.follow(problem, first, options, [replace(LIMIT, tolerance=1e-6)]):
            assert isinstance(item, Point)
            points.append(item)
            if item.lam > 1.0:
                break
        assert {p.negatives for p in points} == {0}
        assert points[-1].q[0] > 1.0


class TestStepControl:
    """What ``follow`` does with its steps."""

    def test_the_end_of_a_branch_is_an_error(self):
        """Newton fails beyond lambda = 0.3 for no physical reason: every point before it is given, then the error.

        No point given is past a fold: the end of what can be computed is not one.
        """
        truss = Truss(1.0, 0.3)
        assert truss.limit_load > 0.4
        problem = breaking(truss.problem(), 0.3)
        points = []
        first = continuation.start(problem, np.zeros(2), 0.0, NONE, 1.0, STEPS)
        with pytest.raises(ContinuationError, match="could not be followed") as caught:
            points.extend(islice(continuation.follow(problem, first, STEPS), 300))
        assert points[-1].lam == pytest.approx(0.3, abs=1e-5)
        assert caught.value.parameter == points[-1].lam
        assert caught.value.step < STEPS.smallest
        assert caught.value.residuals
        assert isinstance(caught.value.__cause__, NewtonError)
        assert all(p.negatives == 0 and p.tangent.lam > 0.0 and p.eigenvalues[0] > 0.0 for p in points)


TRUSS = Truss(1.0, 0.3)
TIGHT = StepOptions(first=0.02, largest=0.05, newton=NewtonOptions(force_tolerance=1e-12))
LONG = StepOptions(first=0.2, largest=0.2, min_cosine=-1.0, max_correction=np.inf)


def sinks(depth: float, tolerance: float = 1e-6) -> Event:
    """The event that the loaded point is this far down."""
    return Event(f"depth {depth}", lambda point, _: point.q[1] < -depth, tolerance)


def followed(events: Sequence[Event], options: StepOptions = TIGHT, depth: float = 0.7) -> list[Point | Crossing]:
    problem = TRUSS.problem()
    out: list[Point | Crossing] = []
    first = continuation.start(problem, np.zeros(2), 0.0, NONE, 1.0, options)
    for item in continuation.follow(problem, first, options, events):
        out.append(item)
        if isinstance(item, Point) and item.q[1] < -depth:
            break
    check_branch(problem, [item for item in out if isinstance(item, Point)])
    return out


def test_each_is_found_once_where_it_is() -> None:
    """Truth: the depth given; the first limit point of the truss at a depth of b - b / sqrt(3), at its limit load."""
    limit = replace(LIMIT, tolerance=1e-5)
    deep = sinks(0.5)
    crossings = [item for item in followed([deep, limit]) if isinstance(item, Crossing)]
    assert [crossing.event for crossing in crossings] == [limit, deep]
    at_limit, at_depth = crossings
    assert at_limit.before.lam == pytest.approx(TRUSS.limit_load, abs=1e-8)
    assert -at_limit.before.q[1] == pytest.approx(TRUSS.b * (1.0 - 1.0 / sqrt(3.0)), abs=1e-4)
    assert at_depth.after.q[1] < -0.5 <= at_depth.before.q[1]
    assert at_depth.after.arc - at_depth.before.arc <= 1e-6
    assert at_depth.evaluations <= 16


@pytest.mark.parametrize(
    ("value", "most"),
    [
        pytest.param(lambda point: point.q[1] + 0.5, 5, id="smooth"),
        pytest.param(lambda point: 1e3 if point.q[1] > -0.5 else -1e-3, 40, id="jumps"),
        pytest.param(lambda point: np.inf if point.q[1] > -0.5 else -1e-3, 16, id="infinite before it"),
    ],
)
def test_a_value_leads_to_it(value: Callable[[Point], float], most: int) -> None:
    (crossing,) = (item for item in followed([replace(sinks(0.5), value=value)]) if isinstance(item, Crossing))
    assert crossing.after.q[1] < -0.5 <= crossing.before.q[1]
    assert crossing.after.arc - crossing.before.arc <= 1e-6
    assert crossing.evaluations <= most


def test_the_order_is_that_of_the_branch() -> None:
    """Two in one long step, asked for in the other order; each comes before the point at the step's end."""
    found = followed([sinks(0.01), sinks(0.005), sinks(0.02)], LONG, depth=0.03)
    names = [item.event.name for item in found if isinstance(item, Crossing)]
    assert names == ["depth 0.005", "depth 0.01", "depth 0.02"]
    arcs = [item.arc if isinstance(item, Point) else item.before.arc for item in found]
    assert all(a <= b for a, b in pairwise(arcs))
    assert isinstance(found[1], Crossing)
    assert isinstance(found[2], Crossing)


def test_what_is_not_located_is_reported_with_its_step() -> None:
    found = followed([sinks(0.1, tolerance=inf)], depth=0.2)
    at = next(i for i, item in enumerate(found) if isinstance(item, Crossing))
    crossing = found[at]
    assert isinstance(crossing, Crossing)
    assert (crossing.before, crossing.after) == (found[at - 1], found[at + 1])
    assert crossing.evaluations == 0
