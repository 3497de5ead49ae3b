"""Internal friction: derivatives, objectivity, the moment-curvature loop, history."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from oracles.held_solid import arc
from stripfold.base.errors import InvalidInputError
from stripfold.strip.effects import Hysteresis, Pull
from stripfold.strip.hysteresis import integrals
from stripfold.strip.problem import AlongX, Lift, StripProblem
from stripfold.strip.rod import Rod
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


class TestPull:
    def test_of_a_shift(self):
        """All points displaced by (0.3, -0.4): the force is k_f times 0.5 times the length (mass one)."""
        model = strip()
        pull = Pull(model, 2.0, np.zeros(model.size))
        q = np.zeros(model.size)
        q[model.middle] = 0.3, -0.4
        force = pull.force(q)[model.middle].sum(axis=0)
        np.testing.assert_allclose(force, np.array([0.6, -0.8]) * LENGTH, rtol=1e-13)
        assert pull.pulling_force(q) == pytest.approx(1.0 * LENGTH, rel=1e-13)

    def test_pulling_force_bounds_the_resultant(self):
        model = strip()
        pull = Pull(model, 2.0, np.zeros(model.size))
        q = np.zeros(model.size)
        q[model.middle] = np.random.default_rng(0).standard_normal(model.middle.shape)
        resultant = np.linalg.norm(pull.force(q)[model.middle].sum(axis=0))
        assert 0.0 < resultant < pull.pulling_force(q)
        # One half displaced forwards, the other backwards: no resultant, the bound of a uniform displacement.
        q[model.middle[:, 0]], q[model.middle[:, 1]] = np.sign(model.s - model.s.mean()), 0.0
        assert pull.pulling_force(q) == pytest.approx(2.0 * LENGTH, rel=0.1)


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

    def test_turns_beyond_half_a_circle(self):
        """An arc has its curvature in each element, also over two and a half turns."""
        model = Solid.of(LENGTH, THICKNESS, elements=40)
        for curvature in (0.4, -0.9, 5.0 * np.pi / LENGTH):
            found = friction(model).curvature(bent(model, curvature))
            np.testing.assert_allclose(found, curvature, rtol=1e-12)


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

    def test_turning_back(self):
        """From M_0 the moment falls with the stiffness of the spring to -M_0 after 2 kappa_y."""
        model = strip()
        effect = friction(model).committed(bent(model, 0.8), np.zeros_like)
        for back, wanted in ((0.0, 1.0), (0.5, 0.5), (1.0, 0.0), (1.5, -0.5), (2.0, -1.0), (3.0, -1.0)):
            assert end_moment(effect, 0.8 - back * YIELD) == pytest.approx(wanted * MOMENT, abs=1e-8)

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


class TestOnOtherElements:
    """Elements that move along the strip while it is bent."""

    @staticmethod
    def bent_by(model: Solid | Rod, curvature: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Unknowns of a strip of this curvature, a function of the distance from the grasped end."""
        s = np.linspace(0.0, LENGTH, 4001)
        angle = cumulative_simpson(curvature(s), x=s, initial=0.0)
        x, z = (cumulative_simpson(f(angle), x=s, initial=0.0) for f in (np.cos, np.sin))
        at = [np.interp(model.s, s, values) for values in (x - LENGTH / 2.0, z, angle)]
        return model.unknowns_of(np.stack(at[:2], axis=1), at[2])

    @pytest.mark.parametrize("kind", ["rod", "solid"])
    def test_a_cycle_of_bending(self, kind: str):
        """4 M_0 (K - kappa_y) per length for the local K, with the elements moving to and fro all the time."""
        ends = np.linspace(0.0, LENGTH, 61)

        def moved(by: float) -> np.ndarray:
            return ends + by * np.sin(np.pi * ends / LENGTH)

        def strip_with(ends: np.ndarray) -> Solid | Rod:
            if kind == "rod":
                return Rod.of(LENGTH, THICKNESS, elements=ends)
            return Solid.of(LENGTH, THICKNESS, elements=ends)

        def largest(s: np.ndarray) -> np.ndarray:
            return 0.5 + 0.2 * np.sin(2.0 * np.pi * s / LENGTH)

        begin = strip_with(ends)
        effect, lost = Hysteresis.of(begin, MOMENT, yield_curvature=0.05), []
        quarter = np.linspace(0.0, 1.0, 21)[1:]
        shares = np.concatenate([quarter, 1.0 - quarter, -quarter, quarter - 1.0, quarter])
        for i, share in enumerate(shares):
            model = begin.with_ends(moved(0.4 * np.sin(0.3 * i)))
            effect = effect.on(effect.model, model)
            effect = effect.committed(self.bent_by(model, lambda s, share=share: share * largest(s)), np.zeros_like)
            lost.append(effect.dissipated)
        area = 4.0 * MOMENT * (0.5 - 0.05) * LENGTH
        print(lost[-1] - lost[19], area)
        assert lost[-1] - lost[19] == pytest.approx(area, rel=0.01)

    def test_on_the_elements_it_is_on_it_is_the_same(self):
        """Although the ends of the elements lie within cells, and next to them nothing jumps."""
        way = np.sin(np.pi * BOUNDARIES / LENGTH)
        model, near = (strip().with_ends(BOUNDARIES + by * way) for by in (0.1, 0.1 + 1e-7))
        effect = replace(friction(model), slip=np.random.default_rng(3).standard_normal(len(BOUNDARIES) - 1))
        np.testing.assert_allclose(effect.on(model, model).slip, effect.slip, atol=1e-13)
        np.testing.assert_allclose(effect.on(model, near).slip, effect.slip, atol=1e-5)

    def test_elements_that_come_back(self):
        """A state that does not change keeps its kappa_p, however often the elements move."""
        model = strip()
        effect = Hysteresis.of(model, MOMENT, yield_curvature=YIELD).on(model, model)
        effect = effect.committed(self.bent_by(model, lambda s: np.where(s < 3.0, 1.0, 0.2)), np.zeros_like)
        first = effect.on(model, model).slip
        for i in range(200):
            other = model.with_ends(BOUNDARIES + 0.2 * np.sin(i) * np.sin(np.pi * BOUNDARIES / LENGTH))
            effect = effect.on(effect.model, other)
        np.testing.assert_allclose(effect.on(effect.model, model).slip, first, atol=1e-12)

    @pytest.mark.parametrize("kind", ["rod", "solid"])
    def test_moments_are_carried_over(self, kind: str):
        """To elements planned anew the moments, although curvatures there differ by kappa_y and more."""

        def strip_with(elements: int) -> Solid | Rod:
            if kind == "rod":
                return Rod.of(LENGTH, THICKNESS, elements=elements)
            return Solid.of(LENGTH, THICKNESS, elements=elements)

        begin, other = strip_with(60), strip_with(47)
        effect = Hysteresis.of(begin, MOMENT, yield_curvature=1e-3)
        # All slides in one direction; then a part of it back.
        effect = effect.committed(self.bent_by(begin, lambda s: 0.5 + 0.2 * np.sin(s)), np.zeros_like)
        q, to = (self.bent_by(model, lambda s: 0.5 + 0.2 * np.sin(s) - 3e-4 * s) for model in (begin, other))
        new = effect.carried_over(q, other).let_go(to)
        # Where the friction was of one sign it is the same moment, as a function of the place.
        middle, moments = (
            [0.5 * (model.ends[1:] + model.ends[:-1]) for model in (begin, other)],
            [each.moments(state) for each, state in ((effect, q), (new, to))],
        )
        expected = np.interp(middle[1], middle[0], moments[0])
        np.testing.assert_allclose(moments[1], expected, atol=0.02 * MOMENT)
        assert np.abs(moments[1]).max() <= MOMENT * (1.0 + 1e-9)
        # kappa_p alone would not do.
        kept = effect.on(begin, other).moments(to)
        assert np.abs(kept - expected).max() > 0.03 * MOMENT
        assert new.dissipated == pytest.approx(effect.committed(q, np.zeros_like).dissipated, rel=1e-12)

    def test_integrals(self):
        """Exact for averages of a parabola away from the ends; the whole integral is kept."""
        ends, new = BOUNDARIES, np.array([0.0, 0.9, 1.3, 2.2, 4.0, 4.4, 6.0])

        def averages(ends: np.ndarray, values: np.ndarray, new: np.ndarray) -> np.ndarray:
            return np.diff(integrals(ends, values, new)) / np.diff(new)

        def of(at: np.ndarray, power: int) -> np.ndarray:
            return np.diff(at ** (power + 1)) / (power + 1) / np.diff(at)

        np.testing.assert_allclose(averages(ends, of(ends, 0), new), of(new, 0), atol=1e-14)
        np.testing.assert_allclose(averages(ends, of(ends, 1), new)[1:-1], of(new, 1)[1:-1], atol=1e-13)
        values = np.random.default_rng(1).standard_normal(len(ends) - 1)
        found = averages(ends, values, new)
        np.testing.assert_allclose(np.diff(new) @ found, np.diff(ends) @ values, atol=1e-13)
        np.testing.assert_allclose(averages(ends, values, ends), values, atol=1e-13)


class TestHistory:
    def test_trial_states_do_not_change_it(self):
        """Only ``committed`` changes the history, and returns a new effect."""
        model = strip()
        q, trial = bent(model, 0.1), bent(model, 2.0)
        held = q.copy()
        for effect in (friction(model), Pull(model, 0.5, held)):
            before = effect.force(q)
            effect.force(trial)
            effect.force_and_tangent(trial)
            after = effect.committed(trial, np.zeros_like)
            np.testing.assert_array_equal(effect.force(q), before)
            assert np.abs(after.force(q) - before).max() > 1e-3
        # The effect keeps a copy of the state.
        pull = Pull(model, 0.5, np.zeros(model.size)).committed(held, np.zeros_like)
        held += 1.0
        assert not pull.force(q).any()

    def test_tangent_just_after_sliding(self):
        """A state that slid is committed as sticking in all elements: rounding does not decide."""
        model = strip()
        q = bent(model, np.pi / 4.0)
        effect = friction(model).committed(q, np.zeros_like)
        direction = rate(model, np.pi / 4.0)
        stiffness = direction @ (effect.force_and_tangent(q)[1] @ direction)
        # The second derivative along the arcs includes that of the curve itself.
        e = 1e-3
        second = (bent(model, np.pi / 4.0 + e) - 2.0 * q + bent(model, np.pi / 4.0 - e)) / e**2
        along_arcs = stiffness + effect.force(q) @ second
        assert along_arcs == pytest.approx(MOMENT / YIELD * LENGTH, rel=1e-5)

    def test_tangent_of_elements_about_to_slide(self):
        """At the limit the spring's stiffness is gone, the force the same; away from it nothing changes."""
        model = strip()
        q = bent(model, np.pi / 4.0)
        direction = rate(model, np.pi / 4.0)
        for effect, lost in (
            (friction(model).committed(q, np.zeros_like), 1.0),
            (Hysteresis.of(model, MOMENT, slack=q), 0.0),
        ):
            sliding = effect.about_to_slide()
            np.testing.assert_array_equal(sliding.force(q), effect.force(q))
            before, after = (direction @ (e.force_and_tangent(q)[1] @ direction) for e in (effect, sliding))
            assert before - after == pytest.approx(lost * MOMENT / YIELD * LENGTH, rel=1e-5, abs=1e-12)

    def test_problem_accepts(self):
        """All effects are committed; a problem without effects is returned unchanged."""
        model = strip()
        q = crooked(model)
        plain = StripProblem(model, AlongX(1.0))
        assert plain.accepted(q) is plain
        rubbed = StripProblem(model, AlongX(1.0), (friction(model), Pull(model, 0.5, np.zeros(model.size))))
        after = rubbed.accepted(q)
        assert after.motion == rubbed.motion
        assert after.model is model
        assert [type(effect) for effect in after.effects] == [Hysteresis, Pull]
        assert not after.effects[1].force(q).any()
        assert rubbed.effects[1].force(q).any()
        assert after.effects[0].dissipated > 0.0 == rubbed.effects[0].dissipated


class TestProblem:
    def test_adds_the_effects(self):
        """Residual and tangent are sums over the model and the effects."""
        model = strip()
        q = crooked(model)
        effects = (friction(model), Pull(model, 0.5, np.zeros(model.size)))
        plain, rubbed = StripProblem(model, AlongX(1.0)), StripProblem(model, AlongX(1.0), effects)
        more = sum(effect.force(q) for effect in effects)
        size = np.abs(plain.residual(q, 0.0)).max()
        np.testing.assert_allclose(rubbed.residual(q, 0.0), plain.residual(q, 0.0) + more, atol=1e-14 * size)
        r, k, load = rubbed.linearise(q, 0.0)
        np.testing.assert_array_equal(r, rubbed.residual(q, 0.0))
        wanted = plain.linearise(q, 0.0)[1].flat + sum(effect.force_and_tangent(q)[1].flat for effect in effects)
        np.testing.assert_allclose(k.flat, wanted, atol=1e-14 * np.abs(wanted).max())
        assert not load.any()

    def test_without_effects_residual_and_tangent_are_those_of_the_model(self):
        """Identical, not only to rounding."""
        model = strip()
        q = crooked(model)
        problem = StripProblem(model, AlongX(1.0))
        force, tangent = model.force_and_tangent(q)
        r, k, _ = problem.linearise(q, 0.0)
        np.testing.assert_array_equal(r, force + model.weight)
        np.testing.assert_array_equal(k.flat, tangent.flat)
        np.testing.assert_array_equal(problem.residual(q, 0.0), model.internal_force(q) + model.weight)

    def test_motion_in_time_refuses_step_dependent_effects(self):
        model = strip()
        q = np.zeros(model.size)
        problem = StripProblem(model, Lift(), (Pull(model, 0.0, q),))
        with pytest.raises(ValueError, match="depend on the step size"):
            problem.force_over_step(q, q, 0.0)

    @pytest.mark.parametrize(
        ("name", "make"),
        [
            ("k_f", lambda m: Pull(m, -1.0, np.zeros(m.size))),
            ("k_f", lambda m: Pull(m, np.nan, np.zeros(m.size))),
            ("moment", lambda m: Hysteresis.of(m, -0.1)),
            ("yield_curvature", lambda m: Hysteresis.of(m, 0.1, yield_curvature=0.0)),
        ],
    )
    def test_refuses(self, name, make):
        with pytest.raises(InvalidInputError, match=name):
            make(strip())
