"""Internal friction: derivatives, objectivity, the moment-curvature loop, history."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from oracles.held_solid import arc
from stripfold.strip.effects import Hysteresis, Pull
from stripfold.strip.solid import Solid

LENGTH, THICKNESS = 6.0, 0.1
BOUNDARIES = np.array([0.0, 0.6, 1.0, 1.9, 2.5, 3.3, 4.2, 4.8, 5.5, 6.0])
MOMENT, YIELD = 0.3, 0.2


def strip() -> Solid:
    return Solid.of(LENGTH, THICKNESS, elements=BOUNDARIES)


def friction(model: Solid) -> Hysteresis:
    return Hysteresis.of(model, MOMENT, yield_curvature=YIELD)


def bent(model: Solid, curvature: float) -> np.ndarray:
    return arc(model, curvature * LENGTH) if curvature else np.zeros(model.size)


def rate(model: Solid, curvature: float) -> np.ndarray:
    """``d bent / d curvature``: the power of a force on it is the end moment times the strip's length."""
    e = 1e-5
    return (bent(model, curvature + e) - bent(model, curvature - e)) / (2.0 * e)


def end_moment(effect: Hysteresis, curvature: float) -> float:
    model = effect.model
    return float(effect.force(bent(model, curvature)) @ rate(model, curvature)) / LENGTH


def crooked(model: Solid) -> np.ndarray:
    """An arc of 230 degrees, disturbed: sections neither normal nor of unit length."""
    q = bent(model, np.radians(230.0) / LENGTH)
    return q + 0.05 * np.random.default_rng(1).standard_normal(model.size)


def partly_slid(model: Solid) -> tuple[Hysteresis, np.ndarray]:
    """A friction with a history, and a state in which some elements stick and some slide, none near the limit."""
    q = crooked(model)
    effect = friction(model)
    n = len(effect.slip)
    beyond = np.array([-3.0, -0.4, 0.3, 2.0])[np.arange(n) % 4] * YIELD
    return replace(effect, slip=effect.curvature(q) - beyond), q


class TestDerivatives:
    def test_force_is_the_derivative_of_the_stored_energy_where_it_sticks(self):
        model = strip()
        q = crooked(model)
        effect = Hysteresis.of(model, 50.0, yield_curvature=100.0)  # never slides
        direction, e = np.random.default_rng(2).standard_normal(model.size), 1e-5
        slope = (effect.stored(q + e * direction) - effect.stored(q - e * direction)) / (2.0 * e)
        assert effect.force(q) @ direction == pytest.approx(slope, rel=1e-6)
        assert effect.dissipation(q) == 0.0

    def test_tangent_where_some_stick_and_some_slide(self):
        """Central differences, column by column; symmetry."""
        model = strip()
        effect, q = partly_slid(model)
        force, tangent = effect.force_and_tangent(q)
        assert 0.2 < np.mean(np.abs(effect.moments(q)) < MOMENT * (1.0 - 1e-12)) < 0.8
        np.testing.assert_array_equal(force, effect.force(q))
        dense = tangent.to_sparse().toarray()
        e = 1e-6
        differences = np.stack(
            [(effect.force(q + e * v) - effect.force(q - e * v)) / (2.0 * e) for v in np.eye(model.size)], axis=1
        )
        size = np.abs(dense).max()
        assert np.abs(dense - differences).max() < 1e-8 * size
        assert np.abs(dense - dense.T).max() < 1e-14 * size

    def test_pull(self):
        """Zero at the previous state, linear, with the tangent ``k_f M``."""
        model = strip()
        here, there = crooked(model), bent(model, 0.3)
        pull = Pull(model, 0.7, here)
        assert not pull.force(here).any()
        force, tangent = pull.force_and_tangent(there)
        np.testing.assert_array_equal(force, pull.force(there))
        np.testing.assert_array_equal(tangent.flat, 0.7 * model.mass.flat)
        np.testing.assert_allclose(force, tangent @ (there - here), atol=1e-15)


class TestObjectivity:
    @pytest.mark.parametrize("degrees", [37.0, 90.0, 180.0, -135.0])
    def test_rigid_motion_causes_no_force(self, degrees):
        """No bending, so no force and no dissipation."""
        model = strip()
        angle = np.radians(degrees)
        along = np.outer(model.s, [np.cos(angle), np.sin(angle)])
        q = model.unknowns_of(along + np.array([0.4, -2.0]), np.full(len(model.s), angle))
        effect = friction(model)
        assert np.abs(effect.curvature(q)).max() < 1e-14
        assert np.abs(effect.force(q)).max() < 1e-13
        assert effect.committed(q, np.zeros_like).dissipated == 0.0

    def test_rotating_a_bent_strip_rotates_its_forces(self):
        """f(R q) = R f(q), with equal moments; sticking and sliding, sections of any shape."""
        model = strip()
        effect, q = partly_slid(model)
        a = np.radians(200.0)
        turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
        offset = np.linspace(-0.5, 0.5, model.unknowns.shape[1])
        section = np.stack([0.0 * offset, offset], axis=1)
        section[len(offset) // 2] = 0.0
        turned = q.copy()
        # The unknowns of a section are relative to its middle node: rotate positions.
        turned[model.unknowns] = (q[model.unknowns] + section) @ turn.T - section
        np.testing.assert_allclose(effect.moments(turned), effect.moments(q), atol=1e-13)
        wanted = np.zeros(model.size)
        wanted[model.unknowns] = effect.force(q)[model.unknowns] @ turn.T
        np.testing.assert_allclose(effect.force(turned), wanted, atol=1e-12)


class TestBending:
    """A strip bent to arcs of one curvature, the same in all elements."""

    @pytest.mark.parametrize("curvature", [0.1, 0.2, 0.7, -0.15, -0.9])
    def test_end_moment(self, curvature):
        """Stiffness times curvature up to M_0."""
        effect = friction(strip())
        wanted = np.clip(MOMENT / YIELD * curvature, -MOMENT, MOMENT)
        assert effect.stiffness == pytest.approx(1.5)
        assert end_moment(effect, curvature) == pytest.approx(wanted, rel=1e-8)
        np.testing.assert_allclose(effect.moments(bent(effect.model, curvature)), wanted, rtol=1e-12)

    def test_loop(self):
        """A loop between -K and K dissipates 4 M_0 (K - kappa_y) per length, and takes the same work.

        The work of a step is by the trapezoidal rule, exact because the steps meet the corners of the loop.
        """
        largest, step = 0.8, 0.1
        quarter = np.arange(step, largest + step / 2.0, step)
        there_and_back = np.concatenate([quarter[-2::-1], [0.0], -quarter, -quarter[-2::-1], [0.0], quarter])
        effect = friction(strip())
        model = effect.model

        def through(effect: Hysteresis, curvatures: np.ndarray, before: float) -> tuple[Hysteresis, float]:
            work, moment = 0.0, end_moment(effect, before)
            for curvature in curvatures:
                next_moment = end_moment(effect, curvature)
                work += 0.5 * (moment + next_moment) * (curvature - before) * LENGTH
                effect = effect.committed(bent(model, curvature), np.zeros_like)
                before, moment = curvature, next_moment
            return effect, work

        loaded, first_work = through(effect, quarter, 0.0)
        top = bent(model, largest)
        # First bending: M_0 kappa_y / 2 is stored in the springs, the rest of the work is dissipated.
        assert loaded.dissipated == pytest.approx(MOMENT * (largest - YIELD) * LENGTH, rel=1e-10)
        assert loaded.stored(top) == pytest.approx(0.5 * MOMENT * YIELD * LENGTH, rel=1e-10)
        assert first_work == pytest.approx(loaded.stored(top) + loaded.dissipated, rel=1e-7)
        round_trip, work = through(loaded, there_and_back, largest)
        area = 4.0 * MOMENT * (largest - YIELD) * LENGTH
        assert round_trip.dissipated - loaded.dissipated == pytest.approx(area, rel=1e-10)
        assert work == pytest.approx(area, rel=1e-7)

    @pytest.mark.parametrize("curvature", [0.15, 0.9])
    def test_one_step_or_ten(self, curvature):
        """Monotonic bending does not depend on the steps: force, energies and history to rounding."""
        model = strip()
        one = friction(model).committed(bent(model, curvature), np.zeros_like)
        ten = friction(model)
        for part in curvature * np.arange(1, 11) / 10.0:
            ten = ten.committed(bent(model, part), np.zeros_like)
        q = bent(model, curvature - 0.1)
        np.testing.assert_allclose(ten.slip, one.slip, atol=1e-13)
        np.testing.assert_allclose(ten.force(q), one.force(q), atol=1e-13)
        assert ten.dissipated == pytest.approx(one.dissipated, abs=1e-13)

    def test_slack_when_bent(self):
        """Friction that starts in a bent state has no moment there."""
        model = strip()
        q = bent(model, 0.6)
        effect = Hysteresis.of(model, MOMENT, yield_curvature=YIELD, slack=q)
        assert not effect.force(q).any()
        assert end_moment(effect, 0.6 + 0.5 * YIELD) == pytest.approx(0.5 * MOMENT, rel=1e-8)
