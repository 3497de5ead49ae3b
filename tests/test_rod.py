"""The rod: derivatives, rigid motions, zero modes, bending, frequencies, and the steps of a motion in time.

Lengths in L*, forces in the weight of a length L*.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from oracles.motions import HeldStrip
from stripfold import elastica
from stripfold.solve import newton
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid

LENGTH, THICKNESS = 6.0, 0.1
BOUNDARIES = np.array([0.0, 0.6, 1.0, 1.9, 2.5, 3.3, 4.2, 4.8, 5.5, 6.0])


def rod(thickness: float = THICKNESS) -> Rod:
    return Rod.of(LENGTH, thickness, elements=BOUNDARIES)


def arc(model: Rod | Solid, curvature: float, stretch: float = 1.0) -> np.ndarray:
    """A circular arc; ``curvature`` per reference length, drawn out by ``stretch``."""
    turn = curvature * model.s
    place = stretch * np.stack([np.sin(turn), 1.0 - np.cos(turn)], axis=1) / curvature
    place[:, 0] -= model.length / 2.0
    q = model.unknowns_of(place, turn)
    if isinstance(model, Rod):
        q.reshape(-1, 4)[:, 2:] = stretch * np.stack([np.cos(turn), np.sin(turn)], axis=1) - [1.0, 0.0]
    return q


def crooked(model: Rod, size: float = 0.1, seed: int = 1) -> np.ndarray:
    """An arc of 230 degrees, disturbed: bent and stretched everywhere."""
    return arc(model, np.radians(230.0) / LENGTH) + size * np.random.default_rng(seed).standard_normal(model.size)


def rigid(model: Rod, degrees: float) -> np.ndarray:
    a = np.radians(degrees)
    x = model.s - model.length / 2.0
    place = np.stack([np.cos(a) * x + 0.3, np.sin(a) * x - 1.2], axis=1)
    return model.unknowns_of(place, np.full(len(x), a))


def clamped(model: Rod, q: np.ndarray, gravity: float = 1.0) -> HeldStrip:
    """The grasped end held, place and slope, where ``q`` has it."""
    held = np.arange(4)
    return HeldStrip(model, held, q[held], np.zeros(4), gravity)


class TestDerivatives:
    def test_force_and_tangent(self):
        """Both by central differences, column by column; the tangent is symmetric."""
        model = rod()
        q = crooked(model)
        force, tangent = model.force_and_tangent(q)
        np.testing.assert_array_equal(force, model.internal_force(q))
        e = 1e-5
        steps = e * np.eye(model.size)
        by_energy = np.array([model.energy(q + v) - model.energy(q - v) for v in steps]) / (2.0 * e)
        by_force = np.stack([model.internal_force(q + v) - model.internal_force(q - v) for v in steps], 1) / (2.0 * e)
        dense = tangent.to_sparse().toarray()
        assert np.abs(by_energy - force).max() < 1e-8 * np.abs(force).max()
        assert np.abs(by_force - dense).max() < 1e-8 * np.abs(dense).max()
        assert np.abs(dense - dense.T).max() < 1e-14 * np.abs(dense).max()

    @pytest.mark.parametrize("kappa", [0.0, 0.7])
    def test_force_over_a_step(self, kappa):
        """Its derivative by differences, and its work: the gain of energy and ``kappa`` times the strain distance."""
        model = rod()
        q0, q1, direction = crooked(model), crooked(model, seed=2), crooked(model, seed=3)
        force, tangent = model.force_over_step(q0, q1, kappa)
        e = 1e-6
        ahead, behind = (model.force_over_step(q0, q1 + sign * e * direction, kappa)[0] for sign in (1.0, -1.0))
        difference = (ahead - behind) / (2.0 * e)
        assert np.abs(tangent @ direction - difference).max() < 1e-8 * np.abs(difference).max()
        distance = model.strain_distance(q0, q1)
        gain = model.energy(q1) - model.energy(q0)
        assert distance > 1.0
        assert float(force @ (q1 - q0)) == pytest.approx(gain + kappa * distance, rel=1e-11)


def turned(model, q, degrees):
    """A state turned as a whole about the origin."""
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    vectors = q.reshape(-1, 2, 2).copy()
    vectors[:, 0, 0] += model.s
    vectors[:, 1, 0] += 1.0
    after = vectors @ turn.T
    after[:, 0, 0] -= model.s
    after[:, 1, 0] -= 1.0
    return after.ravel()


class TestViscosity:
    def test_a_bent_strip_that_turns_loses_nothing(self):
        model = rod()
        q0 = crooked(model)
        q1 = turned(model, q0, 25.0)
        scale = np.sum(model.stiffness * model.strain(q0) ** 2)
        assert model.strain_distance(q0, q1) < 1e-12 * scale
        free, viscous = (model.force_over_step(q0, q1, kappa)[0] for kappa in (0.0, 3.0))
        assert np.abs(viscous - free).max() < 1e-10 * np.abs(free).max()

    def test_a_strip_that_bends_loses_what_its_stiffness_says(self):
        """From one circle to another: the change of curvature squared times the length."""
        model, curvature = rod(), (0.2, 0.5)
        q0, q1 = (arc(model, value) for value in curvature)
        change = curvature[1] - curvature[0]
        assert model.strain_distance(q0, q1) == pytest.approx(change**2 * model.length, rel=1e-3)


class TestStrains:
    @pytest.mark.parametrize("degrees", [0.0, 37.0, 90.0, 180.0, -135.0])
    def test_a_rigid_motion_has_none(self, degrees):
        assert np.abs(rod().strain(rigid(rod(), degrees))).max() < 1e-13

    def test_turned_as_a_whole_nothing_changes(self):
        """Strains of a bent and stretched state, before and after a turn by 140 degrees."""
        model = rod()
        q = crooked(model)
        before, after = (model.strain(state).copy() for state in (q, turned(model, q, 140.0)))
        np.testing.assert_allclose(after[:, :5], before[:, :5], atol=1e-12)
        # The components of r'' turn with it; their square does not change.
        for strain in (before, after):
            strain[:, 5:7] = np.hypot(strain[:, 5:7], strain[:, 7:])
        np.testing.assert_allclose(after[:, 5:7], before[:, 5:7], atol=1e-12)

    def test_only_three_motions_are_free(self):
        """No other mode without stiffness: with Gauss's two points for the membrane there was one more."""
        for q in (np.zeros(rod().size), rigid(rod(), 110.0)):
            values = np.linalg.eigvalsh(rod().force_and_tangent(q)[1].to_sparse().toarray())
            assert np.abs(values[:3]).max() < 1e-10 * values[-1]
            assert values[3] > 1e-6 * values[-1]

    def test_bending_does_not_lock(self):
        """Truth: the energy of an arc that both ends are held for, on elements of a tenth of a turn, however thin."""
        curvature, errors = 2.0, []
        for thickness in (1e-2, 1e-3, 1e-4):
            model = Rod.of(LENGTH, thickness, elements=20)
            q = arc(model, curvature)
            held = np.concatenate([np.arange(4), np.arange(model.size - 4, model.size)])
            problem = HeldStrip(model, held, q[held], np.zeros(8), 0.0)
            q = newton.solve(problem, q, 0.0, problem.bounded).q
            errors.append(model.energy(q) / (0.5 * curvature**2 * LENGTH) - 1.0)
        print("errors", errors)
        assert np.abs(errors).max() < 2e-3

    def test_weight_and_mass(self):
        model = rod()
        assert model.weight @ rigid(model, 0.0) == pytest.approx(-1.2 * LENGTH, rel=1e-13)
        v = np.zeros(model.size).reshape(-1, 4)
        v[:, 0], v[:, 2] = model.s**2, 2.0 * model.s  # a cubic has every parabola
        assert v.ravel() @ (model.mass @ v.ravel()) == pytest.approx(LENGTH**5 / 5.0, rel=1e-13)


class TestBeam:
    def test_frequencies_of_a_cantilever(self):
        """Truth: beta l = 1.875104, 4.694091, 7.854757 (Euler and Bernoulli); the error falls with the fourth power."""
        truth = np.array([1.875104068711961, 4.694091132974174, 7.854757438237612]) ** 2
        errors = []
        for n in (6, 12):
            model = Rod.of(1.0, 1e-2, elements=n)
            stiffness = model.force_and_tangent(np.zeros(model.size))[1].to_sparse().toarray()[4:, 4:]
            mass = model.mass.to_sparse().toarray()[4:, 4:]
            errors.append(np.sqrt(eigh(stiffness, mass, eigvals_only=True)[:3]) / truth - 1.0)
        print("errors", errors)
        assert np.abs(errors[1]).max() < 1.5e-4
        assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.2)

    def test_cantilever_under_its_weight(self):
        """Truth: the elastica of Peirce's test; the error falls as h^2 to that of the mesh."""
        length = 2.000350
        errors = []
        for thickness in (0.1, 0.05, 0.025):
            model = Rod.of(length, thickness, elements=40)
            flat = np.zeros(model.size)
            problem = clamped(model, flat)
            q = newton.solve(problem, flat, 0.0, problem.bounded, options=newton.NewtonOptions(max_iterations=60)).q
            x = model.mid_surface(q)
            truth = elastica.cantilever(length).at(model.s)
            errors.append(np.hypot(x[:, 0] + length / 2.0 - truth.x, x[:, 1] - truth.z).max())
        print("errors", errors)
        assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(2.0, abs=0.05)
        assert errors[-1] < 3e-4
