"""Critical points: located and solved for directly, against closed forms, and never in place of a failure."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice, pairwise
from math import sqrt

import numpy as np
import pytest

from oracles import lee_frame
from oracles.lee_frame import LeeFrame
from oracles.toys import NONE, Toy, Truss, check_branch
from stripfold.base.errors import NewtonError, SolveError
from stripfold.solve import continuation, critical
from stripfold.solve.continuation import StepOptions
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Point, Problem, Tangent

# An error of the force is one of lambda: tight, so that 1e-8 of the limit load can be asked for.
STEPS = StepOptions(first=0.02, largest=0.05, newton=NewtonOptions(force_tolerance=1e-12))
FRAME = StepOptions(first=1.0, largest=8.0, smallest=1e-4, kink=0.05, newton=NewtonOptions(largest_step=30.0))


def bracket(problem: Problem, options: StepOptions) -> tuple[Point, Point]:
    """The last accepted point before and the first past the critical point."""
    first = continuation.start(problem, np.zeros(problem.size), 0.0, NONE, 1.0, options)
    for before, after in islice(pairwise(continuation.follow(problem, first, options)), 300):
        check_branch(problem, [before, after], tolerance=options.newton.force_tolerance * 1e2)
        if critical.is_past(after, before):
            return before, after
    raise AssertionError("not reached")


class TestLimitLoad:
    """Truth: the limit load of von Mises' truss, 2 EA b^3 / (3 sqrt(3) L^3), at w = b / sqrt(3)."""

    @pytest.mark.parametrize("rise", [0.1, 0.3, 1.0])
    def test_to_a_hundred_millionth(self, rise):
        truss = Truss(1.0, rise)
        problem = truss.problem()
        found = critical.locate(problem, *bracket(problem, STEPS), 1e-9, STEPS)
        print(f"error {found.lam - truss.limit_load:.1e}, bracket {found.upper - found.lower:.1e}")
        assert found.lam == pytest.approx(truss.limit_load, abs=1e-8)
        assert found.lower - 1e-12 <= truss.limit_load <= found.upper + 1e-12
        assert found.upper - found.lower <= 1e-9
        assert found.lower <= found.lam <= found.upper
        assert found.evaluations <= 20

    def test_all_detectors_agree_there(self):
        """Tangent, inertia and eigenvalue change between two points at the same load and the same height."""
        truss = Truss(1.0, 0.3)
        problem = truss.problem()
        found = critical.locate(problem, *bracket(problem, STEPS), 1e-10, STEPS)
        before, after = found.before, found.after
        assert found.agree
        assert (before.negatives, after.negatives) == (0, 1)
        assert before.tangent.lam > 0.0 >= after.tangent.lam
        assert before.eigenvalues[0] > 0.0 > after.eigenvalues[0]
        assert found.eigenvalue_lam == pytest.approx(truss.limit_load, abs=1e-9)
        for point in (before, after):
            assert truss.b + point.q[1] == pytest.approx(truss.b / sqrt(3.0), abs=1e-4)

    @pytest.mark.parametrize(("problem", "options"), [(Truss(1.0, 0.3).problem(), STEPS), (LeeFrame(10), FRAME)])
    def test_the_critical_mode_is_the_branch_direction(self, problem, options):
        """Truth: at a fold the tangent of the branch is the null vector of the tangent matrix."""
        found = critical.locate(problem, *bracket(problem, options), 1e-9, options)
        nearer = min(found.before, found.after, key=lambda p: abs(p.tangent.lam))
        direction = nearer.tangent.q / np.linalg.norm(nearer.tangent.q)
        mode = found.mode / np.linalg.norm(found.mode)
        cosine = abs(float(mode @ direction))
        print(f"1 - cosine = {1.0 - cosine:.1e}")
        assert cosine > 1.0 - 1e-6
        k = problem.linearise(nearer.q, nearer.lam)[1].with_fixed(problem.prescribed)
        # The force it needs is small against that of another direction.
        assert np.linalg.norm(k @ mode) < 1e-4 * np.abs(k.a).max()
        assert found.mode @ (problem.mass @ found.mode) == pytest.approx(1.0, abs=1e-6)

    def test_lee_frame(self):
        """Truth: 18.5567 EI / L^2 by shooting on the extensible elastica (published: 18.55), and order 2 in the size.

        The frame's elements are of second order; extrapolated, they meet the shooting, another method altogether.
        """
        loads = []
        for per_leg in (5, 10, 20):
            frame = LeeFrame(per_leg)
            found = critical.locate(frame, *bracket(frame, FRAME), 1e-8, FRAME)
            assert found.agree
            loads.append(found.lam)
        force, height = frame.residual(found.before.q, found.lam), 120.0 + found.before.q[frame.loaded]
        guess = np.array([np.pi / 2.0 + found.before.q[2], -force[0], -force[1], found.lam])
        truth = lee_frame.limit_load(height, guess)
        errors = np.array(loads) - truth
        rates = np.log2(errors[:-1] / errors[1:])
        print(f"truth {truth:.9f}, errors {errors}, rates {rates}")
        assert 10.0 * truth == pytest.approx(18.5567, abs=1e-4)
        assert rates == pytest.approx(2.0, abs=0.1)
        assert errors[-1] < 3e-3
        assert (4.0 * loads[2] - loads[1]) / 3.0 == pytest.approx(truth, abs=5e-5)


class TestOtherCritical:
    """Critical points that are not folds, and brackets that hold none."""

    def test_a_pitchfork_disagrees(self):
        """Truth: the steep truss sways at w^2 = b^2 - 2 a^2: inertia and eigenvalue change, the tangent does not."""
        truss = Truss(1.0, 2.0, stiffness=3.0)
        assert truss.pitchfork is not None
        problem = truss.problem()
        found = critical.locate(problem, *bracket(problem, STEPS), 1e-8, STEPS)
        exact = float(truss.load(truss.pitchfork))
        print(f"error {found.lam - exact:.1e}")
        assert not found.agree
        assert found.before.tangent.lam > 0.0
        assert found.after.tangent.lam > 0.0
        assert (found.before.negatives, found.after.negatives) == (0, 1)
        assert found.before.lam <= exact <= found.after.lam
        assert found.lam == pytest.approx(exact, abs=1e-7)
        assert found.eigenvalue_lam == pytest.approx(exact, abs=1e-10)
        assert abs(found.mode[0]) == pytest.approx(1.0, abs=1e-12)

    def test_a_maximum_and_a_minimum_in_one_step(self):
        """Truth: lambda = x^3 - 0.01 x has both within 0.15; a step across them sees lambda, not its slope, fall."""
        shallow = Toy(1, lambda q, lam: (q**3 - 0.01 * q - lam, np.diag(3.0 * q**2 - 0.01), -np.ones(1)))
        long = replace(STEPS, min_cosine=-1.0, max_correction=np.inf)
        point = continuation.start(shallow, np.array([-0.0667]), -(0.0667**3) + 0.000667, NONE, 1.0, long)
        after = continuation.step(shallow, point, 0.15, long)
        assert after.lam < point.lam
        assert after.tangent.lam > 0.0
        assert after.negatives == 0
        assert not critical.is_past(after)
        assert critical.is_past(after, point)
        found = critical.locate(shallow, point, after, 1e-10, long)
        top = 0.01 / 3.0
        assert found.lam == pytest.approx(2.0 * top * sqrt(top), abs=1e-9)


TIGHT = NewtonOptions(force_tolerance=1e-12, largest_step=0.5)
TIGHT_STEPS = StepOptions(newton=TIGHT)
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
        found = critical.checked(TRUSS.problem(), solve(0.8 * TOP, 1.0), 1e-8, TIGHT_STEPS)
        assert found.agree
        assert found.before.arc < 0.0 < found.after.arc
        assert found.lower <= TRUSS.limit_load + 1e-12 <= found.upper + 2e-12
        assert found.width <= 1e-8

    def test_a_minimum_is_refused(self):
        """The truss's lower limit point, at w = -b / sqrt(3)."""
        lower = solve(-RISE / sqrt(3.0) - RISE + 0.01, -TRUSS.limit_load)
        assert lower.state.lam == pytest.approx(-TRUSS.limit_load, rel=1e-10)
        with pytest.raises(SolveError, match="no maximum"):
            critical.checked(TRUSS.problem(), lower, 1e-8, TIGHT_STEPS)

    def test_behind_a_bifurcation(self):
        """The steep truss has swayed to a side before its limit load: neither side is stable."""
        steep = Truss(1.0, 2.0, stiffness=3.0)
        q = np.array([0.0, 2.0 / sqrt(3.0) - 2.0 + 0.01])
        found = critical.limit_point(steep.problem(), q, steep.limit_load, DOWN, NONE, TIGHT)
        assert found.state.lam == pytest.approx(steep.limit_load, rel=1e-9)
        with pytest.raises(SolveError, match="does not lose its stability"):
            critical.checked(steep.problem(), found, 1e-6, TIGHT_STEPS)


def test_there_is_none():
    """A branch on which lambda always rises: an error with the history, no point."""
    rising = Toy(1, lambda q, lam: (q**3 + q - lam, np.diag(3.0 * q**2 + 1.0), -np.ones(1)))
    with pytest.raises(NewtonError) as error:
        critical.limit_point(rising, np.array([0.2]), 0.2, Tangent(np.ones(1), 0.0), NONE, TIGHT)
    assert error.value.residuals
