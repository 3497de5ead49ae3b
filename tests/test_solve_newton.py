"""Newton's method with bounds: rate, complementarity, prescribed unknowns, and honest failure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from oracles.held_solid import arc, clamped
from oracles.lee_frame import LeeFrame
from oracles.toys import NONE, Toy, Truss, breaking, complementary, linear
from stripfold.base.arrays import Array, Index
from stripfold.base.errors import NewtonError
from stripfold.solve import newton
from stripfold.solve.newton import Constraint, NewtonOptions
from stripfold.solve.problem import Equilibrium, Problem
from stripfold.strip.solid import Solid

FREE = NewtonOptions(largest_step=np.inf)
TIGHT = NewtonOptions(largest_step=np.inf, force_tolerance=1e-10)


def orders(history: tuple[float, ...]) -> np.ndarray:
    """Observed orders ``log(r2 / r1) / log(r1 / r0)`` of a residual history, its rounding left out."""
    r = np.array([value for value in history if value > 1e-13 * max(history)])
    logs = np.diff(np.log(r))
    return logs[1:] / logs[:-1]


class Recorded:
    """A problem that keeps the states it is asked about."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.visited: list[Array] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self.problem, name)

    def linearise(self, q: Array, lam: float, predicted_stress: Any = None) -> tuple[Array, Any, Array]:
        self.visited.append(q.copy())
        return self.problem.linearise(q, lam, predicted_stress)


class TestRate:
    """The residual history shows the quadratic convergence of Newton's method."""

    def test_truss(self):
        """Truth: the symmetric path of von Mises' truss in closed form."""
        truss = Truss(1.0, 0.4)
        height = 0.33
        lam = float(truss.load(height))
        state = newton.solve(truss.problem(), np.zeros(2), lam, NONE, options=FREE)
        print(state.residuals, orders(state.residuals))
        assert state.q == pytest.approx([0.0, height - 0.4], abs=1e-9)
        assert state.lam == lam
        assert orders(state.residuals)[-1] == pytest.approx(2.0, abs=0.15)
        assert len(state.residuals) < 9

    @staticmethod
    def first_steps(problem: Problem, exact: Array, lam: float, direction: Array, sizes: Array) -> Array:
        """Errors after one and two iterations, from guesses off by ``sizes`` times a direction."""
        errors = []
        for size in sizes:
            spy = Recorded(problem)
            start = exact + size * direction
            tight = NewtonOptions(largest_step=np.inf, force_tolerance=0.0, max_iterations=3)
            with pytest.raises(NewtonError):
                newton.solve(spy, start, lam, NONE, options=tight)
            errors.append([np.linalg.norm(q - exact) for q in spy.visited[1:3]])
        return np.array(errors)

    def test_frame(self):
        """63 unknowns of Lee's frame: an error of size t leaves one of t^2, and that one of t^4."""
        frame = LeeFrame(10)
        exact = newton.solve(frame, np.zeros(frame.size), 0.6, NONE, options=TIGHT).q
        direction = np.random.default_rng(1).standard_normal(frame.size)
        direction[frame.prescribed] = 0.0
        sizes = 0.003 * 2.0 ** -np.arange(4)
        errors = self.first_steps(frame, exact, 0.6, direction, sizes)
        slopes = np.log2(errors[:-1] / errors[1:])
        print("errors", errors, "slopes", slopes)
        assert slopes[-1] == pytest.approx([2.0, 4.0], abs=0.2)
        assert np.all(errors[-1] < [1e-3, 1e-6])

    def test_solid(self):
        """The strip: with the stress predicted from step to step the tangent is exact in the limit, so is the rate."""
        model = Solid.of(2.0, 0.2, elements=6)
        problem = clamped(model, np.zeros(model.size), 0)
        exact = problem.solve(np.zeros(model.size), force_tolerance=1e-12).q
        direction = arc(model, 1.0)
        direction[problem.prescribed] = 0.0
        errors = self.first_steps(problem, exact, 1.0, direction, 0.001 * 2.0 ** -np.arange(4))
        slopes = np.log2(errors[:-1] / errors[1:])
        print("errors", errors, "slopes", slopes)
        assert slopes[-1] == pytest.approx([2.0, 4.0], abs=0.3)
        assert np.all(errors[-1] < [1e-3, 1e-6])


class TestOracles:
    """The problems that serve as truth are what they say: Taylor tests and closed forms."""

    @pytest.mark.parametrize("problem", [Truss(1.0, 2.0).problem(), LeeFrame(5)], ids=["truss", "frame"])
    def test_tangents(self, problem):
        rng = np.random.default_rng(3)
        q, dq = 0.3 * rng.standard_normal((2, problem.size))
        r, k, rate = problem.linearise(q, 0.7)
        steps = 2.0 ** -np.arange(7, 12)
        remainder = [np.abs(problem.residual(q + t * dq, 0.7 + t) - r - t * (k @ dq + rate)).max() for t in steps]
        slopes = np.log2(np.divide(remainder[:-1], remainder[1:]))
        print(slopes)
        assert slopes[-1] == pytest.approx(2.0, abs=0.05)


class TestBounds:
    """Truth: the linear complementarity problem solved by trying every set of contacts."""

    @staticmethod
    def check(
        k: Array, f: Array, bounded: Index, lower: Array, start: Array, active: Index, options: NewtonOptions = FREE
    ) -> tuple[Equilibrium, Index]:
        """Solve, and compare with the answer; also gives the contacts of the latter."""
        exact, held = complementary(k, f, bounded, lower)
        state = newton.solve(linear(k, f, bounded, lower), start, 0.0, active, options=options)
        gap, force = state.q[bounded] - lower, (k @ state.q - f)[bounded]
        on = np.isin(bounded, state.active)
        assert np.all(gap >= -1e-12)
        assert np.abs(gap[on]).max(initial=0.0) <= (0.0 if not lower.any() else 1e-15)
        assert np.all(force[on] >= -1e-8)
        assert np.abs(force[~on]).max(initial=0.0) <= 1e-8
        np.testing.assert_allclose(state.q, exact, atol=1e-8)
        return state, held

    @pytest.mark.parametrize("stiffness", [0.2, 1.0, 5.0, 40.0])
    @pytest.mark.parametrize("all_active", [False, True])
    def test_a_hanging_chain_over_a_floor(self, stiffness, all_active):
        """Nine weights on springs between two supports at height one: as stiff as it is, few or many touch."""
        n = 9
        k = stiffness * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
        f = np.full(n, -0.15)
        f[[0, -1]] += stiffness
        bounded = np.arange(n)
        start = bounded if all_active else NONE
        state, held = self.check(k, f, bounded, np.zeros(n), np.ones(n), start)
        np.testing.assert_array_equal(np.sort(state.active), held)
        print(f"touching {len(held)}, iterations {len(state.residuals) - 1}")

    @pytest.mark.parametrize("seed", range(40))
    def test_random(self, seed):
        """Random stiffness, loads, bounds and starts; a part of the unknowns bounded, at heights of their own."""
        rng = np.random.default_rng(seed)
        n = 10
        half = rng.standard_normal((n, n))
        bounded = np.sort(rng.choice(n, 7, replace=False))
        start = rng.choice(bounded, rng.integers(0, 8), replace=False)
        self.check(
            half @ half.T + 0.1 * np.eye(n), 3.0 * rng.standard_normal(n), bounded, rng.standard_normal(7),
            rng.standard_normal(n), start, NewtonOptions(largest_step=np.inf, max_iterations=40),
        )  # fmt: skip

    def test_a_beam_on_the_floor(self):
        """Bending couples neighbours with both signs, unlike a chain: 200 random loads and starts."""
        rng = np.random.default_rng(0)
        n, floor = 12, np.arange(3, 11)
        chain = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
        longest = 0
        for _ in range(200):
            start = floor[rng.random(len(floor)) < 0.5]
            state, _ = self.check(
                chain @ chain, rng.standard_normal(n), floor, np.zeros(len(floor)), rng.standard_normal(n), start
            )
            longest = max(longest, len(state.residuals) - 1)
        print("most iterations", longest)
        assert longest <= 15

    def test_prescribed_and_bounded_together(self):
        """The chain's end is lifted: prescribed exactly, the floor carries what is left of the weight."""
        n, stiffness = 8, 1.0
        k = stiffness * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
        k[0, 0] = k[-1, -1] = stiffness
        f = np.full(n, -0.1)
        lifted, bounded = np.array([0]), np.arange(1, n)
        problem = Toy(n, lambda q, lam: (k @ q - f, k, np.zeros(n)), lifted, bounded, np.zeros(n - 1))
        for lam in (0.05, 0.8, 2.5):
            state = newton.solve(problem, np.zeros(n), lam, bounded)
            rest = np.arange(1, n)
            exact, held = complementary(k[1:, 1:], f[1:] - k[1:, 0] * lam, np.arange(n - 1), np.zeros(n - 1))
            assert state.q[0] == lam
            np.testing.assert_allclose(state.q[1:], exact, atol=1e-9)
            np.testing.assert_array_equal(np.sort(state.active), rest[held])
            # Balance: what the hand and the floor carry is the weight.
            assert (k @ state.q - f).sum() == pytest.approx(-f.sum(), abs=1e-9)


class TestConstraint:
    """The point of the branch that is asked for."""

    def test_a_plane(self):
        """Truth: displacement control, lambda from the closed form; exactly on the plane, past the limit load too."""
        truss = Truss(1.0, 0.4)
        for height in (0.3, 0.2, 0.05, -0.1):
            plane = Constraint(np.array([0.0, 1.0]), 0.0, np.array([0.0, height - 0.4]), 0.0)
            state = newton.solve(truss.problem(), np.array([0.0, -0.05]), 0.3, NONE, plane)
            assert state.q == pytest.approx([0.0, height - 0.4], abs=1e-12)
            assert state.lam == pytest.approx(float(truss.load(height)), abs=1e-9)


class TestFailure:
    """A failure is an error with its history; never a state."""

    def test_no_equilibrium(self):
        """Truth: q^2 + 1 = 0 has no solution."""
        problem = Toy(1, lambda q, lam: (q**2 + 1.0, 2.0 * np.diag(q), np.zeros(1)))
        with pytest.raises(NewtonError, match="did not converge in 25") as caught:
            newton.solve(problem, np.array([0.7]), 0.25, NONE)
        assert len(caught.value.residuals) == 25
        assert min(caught.value.residuals) >= 1.0
        assert caught.value.parameter == 0.25
        assert caught.value.advice

    def test_beyond_the_limit_load(self):
        """Truth: the shallow truss stands at no load near 1.5 times its limit without having snapped through."""
        truss = Truss(1.0, 0.4)
        few = NewtonOptions(max_iterations=6, largest_step=0.02)
        with pytest.raises(NewtonError) as caught:
            newton.solve(truss.problem(), np.zeros(2), 1.5 * truss.limit_load, NONE, options=few)
        assert len(caught.value.residuals) == 6

    def test_not_a_number(self):
        truss = breaking(Truss(1.0, 0.4).problem(), 0.2)
        with pytest.raises(NewtonError, match="not finite") as caught:
            newton.solve(truss, np.zeros(2), 0.3, NONE)
        assert len(caught.value.residuals) == 1

    def test_a_singular_tangent(self):
        problem = Toy(2, lambda q, lam: (np.ones(2), np.diag([1.0, 0.0]), np.zeros(2)))
        with pytest.raises(NewtonError, match="singular") as caught:
            newton.solve(problem, np.zeros(2), 0.0, NONE)
        assert caught.value.residuals == (1.0,)

    def test_a_small_step_is_not_convergence(self):
        """A tangent ten decades too stiff makes steps of 1e-10; the force stays unbalanced, and that counts."""
        problem = Toy(1, lambda q, lam: (q - 1.0, np.array([[1e10]]), np.zeros(1)))
        with pytest.raises(NewtonError) as caught:
            newton.solve(problem, np.zeros(1), 0.0, NONE)
        assert caught.value.residuals[-1] == pytest.approx(1.0, abs=1e-6)
