"""Locating the critical point: against closed forms, and never in place of a failure."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice, pairwise
from math import sqrt

import numpy as np
import pytest

from oracles import lee_frame
from oracles.branches import check_branch
from oracles.lee_frame import LeeFrame
from oracles.toys import NONE, Toy, Truss
from stripfold.solve import continuation, critical
from stripfold.solve.continuation import StepOptions
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Point, Problem

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
