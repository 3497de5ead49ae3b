"""Self-contact above the floor: forces, conservation, tangents, detection of crossing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stripfold.base.arrays import Array
from stripfold.base.errors import NewtonError
from stripfold.solve import dynamics
from stripfold.solve.drive import Moving
from stripfold.solve.dynamics import TimeOptions
from stripfold.solve.linear import Sparse
from stripfold.solve.schemes import Damping, EnergyMomentum
from stripfold.strip import proximity
from stripfold.strip.problem import AlongX, StripProblem
from stripfold.strip.proximity import Pairs
from stripfold.strip.rod import Rod
from stripfold.strip.self_contact import SelfContact, pair_energy, pair_force

H = 0.1


def steps(height: float) -> tuple[Array, Array]:
    """Random pairs of a node and a segment close to each other, in two states, shape (300, 6)."""
    random = np.random.default_rng(1)
    x = np.zeros((300, 6))
    x[:, 0], x[:, 4] = random.uniform(-0.1, 0.3, 300), 0.2
    x[:, 1::2] = height + random.uniform(-0.02, 0.02, (300, 3))
    x[:, 1] += random.uniform(-0.06, 0.06, 300)
    return x, x + random.normal(0.0, 0.02, x.shape)


def hairpin(gap: float) -> tuple[Rod, Array]:
    """A strip above the floor bent to a hairpin with this distance of its legs, nodes of one opposite segments."""
    model = Rod.of(6.0, H, elements=40)
    radius = gap / 2.0
    s = model.s - 2.93
    turn = np.clip(s / radius, -np.pi / 2.0, np.pi / 2.0)
    straight = s - radius * turn
    position = np.stack([np.abs(straight) * -1.0 + radius * np.cos(turn), 2.0 + radius * np.sin(turn)], axis=1)
    return model, model.unknowns_of(position, turn + np.pi / 2.0)


@pytest.mark.parametrize("height", [1.0, 1.5 * H])
def test_work_over_a_step_is_the_gain_of_energy(height: float) -> None:
    x0, x1 = steps(height)
    work = np.sum(pair_force(x0, x1, H) * (x1 - x0), axis=1)
    gain = pair_energy(x1, H) - pair_energy(x0, H)
    assert np.abs(gain).max() > 1e-4
    np.testing.assert_allclose(work, gain, atol=1e-15)


def test_momentum_and_angular_momentum_are_conserved() -> None:
    x0, x1 = steps(1.0)
    force, middle = pair_force(x0, x1, H), 0.5 * (x0 + x1)
    assert np.abs(force).max() > 0.01
    for axis in range(2):
        assert np.abs(force[:, axis::2].sum(axis=1)).max() < 1e-15
    moment = np.sum(middle[:, ::2] * force[:, 1::2] - middle[:, 1::2] * force[:, ::2], axis=1)
    assert np.abs(moment).max() < 1e-15


@pytest.mark.parametrize("height", [1.0, 1.5 * H])
def test_force_is_the_gradient_of_the_energy(height: float) -> None:
    x, _ = steps(height)
    force, e = pair_force(x, x, H), 1e-6
    for k, turn in enumerate(e * np.eye(6)):
        slope = (pair_energy(x + turn, H) - pair_energy(x - turn, H)) / (2.0 * e)
        np.testing.assert_allclose(force[:, k], slope, atol=1e-8)


@pytest.mark.parametrize("over_step", [True, False])
def test_tangents(over_step: bool) -> None:
    model, q = hairpin(0.8 * H)
    contact = SelfContact.of(model, H)
    random = np.random.default_rng(2)
    q0, turn = q + 1e-3 * random.normal(size=q.shape), random.normal(size=q.shape)

    def force(q1: Array) -> tuple[Array, object]:
        done = contact.over_step(q0 if over_step else q1, q1)
        assert done is not None
        return done

    e = 1e-6
    slope = (force(q + e * turn)[0] - force(q - e * turn)[0]) / (2.0 * e)
    tangent = force(q)[1] @ turn  # type: ignore[operator]
    assert np.abs(slope).max() > 1.0
    np.testing.assert_allclose(tangent, slope, atol=1e-4 * np.abs(slope).max())


@pytest.mark.parametrize("raise_by", [0.0, H])
def test_work_on_a_strip_is_the_gain_of_energy(raise_by: float) -> None:
    """Also where the strip rises from the floor, where no distance is required."""
    model, q = hairpin(0.8 * H)
    contact = SelfContact.of(model, H)
    assert contact.weight.sum() == pytest.approx(6.0)
    q[model.middle[:, 1]] -= 2.0 - 1.3 * H if raise_by else 0.0
    q1 = q + 1e-3 * np.random.default_rng(5).normal(size=q.shape)
    q1[model.middle[:, 1]] += raise_by
    done = contact.over_step(q, q1)
    assert done is not None
    gain = contact.energy(q1) - contact.energy(q)
    assert abs(gain) > 1e-4
    assert done[0] @ (q1 - q) == pytest.approx(gain, abs=1e-14)


def test_gap_contact_crossing_and_layers_on_the_floor() -> None:
    model, apart = hairpin(2.0 * H)
    contact = SelfContact.of(model, H)
    assert contact.gap(apart) == pytest.approx(H, rel=1e-6)
    assert contact.energy(apart) == 0.0
    assert contact.over_step(apart, apart) is None
    near = hairpin(0.8 * H)[1]
    assert contact.gap(near) == pytest.approx(-0.2 * H, rel=1e-6)
    assert contact.energy(near) > 0.0
    # The upper leg rotated through the lower one.
    middle = model.mid_surface(apart)
    middle[middle[:, 1] > 2.0, 1] -= 3.0 * H * (2.0 - middle[middle[:, 1] > 2.0, 0]) / 4.0
    crossed = model.unknowns_of(middle, np.zeros(len(middle)))
    assert contact.gap(crossed) == -H
    with pytest.raises(NewtonError, match="through each other"):
        contact.energy(crossed)
    # The same legs on the floor: its contact replaces theirs.
    lying = near.copy()
    lying[model.middle[:, 1]] -= 2.0 - 0.5 * H
    assert SelfContact.of(model, H).gap(lying) > 0.0
    assert SelfContact.of(model, H).over_step(lying, lying) is None


def test_no_contact_within_the_safe_displacement() -> None:
    """The bound that saves searches holds for all displacements in which the parts on the floor stay there."""
    random = np.random.default_rng(3)
    model, q = hairpin(1.4 * H)
    pairs = Pairs.of(model.s, H)
    for height in (2.0, 0.6 * H, 1.2 * H, 2.5 * H):
        position = model.mid_surface(q) + np.array([0.0, height - 2.0])
        found = pairs.measure(position)
        assert found.stays_on_floor(position[:, 1])
        clear = 0
        for _ in range(60):
            angle = random.uniform(0.0, 2.0 * np.pi, len(position))
            move = 0.999 * min(found.safe_displacement, 0.4) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
            # Parts on the floor rise little.
            lies = position[:, 1] <= 0.5 * H
            move[lies] *= 0.2
            clear += found.stays_on_floor(position[:, 1] + move[:, 1])
            assert pairs.measure(position + move).gap >= 0.0 or not found.stays_on_floor(position[:, 1] + move[:, 1])
        assert clear > 5
    # A leg on the floor that rises by more than its thickness may reach the other: then the bound does not apply.
    position = model.mid_surface(q).copy()
    position[:, 1] -= position[:, 1].min()
    found = pairs.measure(position)
    risen = position + np.array([0.0, 1.5 * H])
    assert not found.stays_on_floor(risen[:, 1])


def test_required_distance_starts_above_the_floor() -> None:
    z, e = np.linspace(0.0, 3.0 * H, 50), 1e-7
    assert np.all(proximity.smooth_step(z[z <= H], H) == 0.0)
    np.testing.assert_allclose(proximity.smooth_step(z[z >= 2.0 * H], H), 1.0)
    slope = (proximity.smooth_step(z + e, H) - proximity.smooth_step(z - e, H)) / (2.0 * e)
    np.testing.assert_allclose(proximity.smooth_step_slope(z, H), slope, atol=1e-4)


def test_colliding_legs_do_not_cross() -> None:
    """In motion: energy is conserved and no crossing; without contact they cross."""
    model, q = hairpin(2.0 * H)
    v = np.zeros(model.size)
    # The legs move towards each other, their ends are held.
    leg = np.sin(np.pi * np.clip(model.s / 2.9, 0.0, 2.0)) ** 2
    v[model.middle[:, 1]] = np.where(model.s < 2.93, leg, -leg) * 1.5
    held = replace(StripProblem(model, AlongX(0.0)), self_contact=SelfContact.of(model, H))
    crossed = {}
    for problem in (held, replace(held, self_contact=None)):
        at = q[problem.prescribed]
        pinned = _Pinned(problem, at)
        first = dynamics.start(pinned, q, v, 0.0, np.zeros(0, dtype=np.intp))
        options = TimeOptions(first=0.01, tolerance=1e-4)
        moments = []
        for moment in dynamics.march(pinned, first, Moving(0.0, 0.0), Damping(), EnergyMomentum(0.0), options):
            moments.append(moment)
            if moment.t > 0.25:
                break
        monitor = SelfContact.of(model, H)
        crossed[problem is held] = min(monitor.gap(m.q) for m in moments) <= -H
        if problem is held:
            assert min(monitor.gap(m.q) for m in moments) < 0.0
            assert abs(moments[-1].energy.closing) < 1e-7
            assert moments[-1].energy.total == pytest.approx(moments[0].energy.total, rel=1e-6)
    assert crossed == {True: False, False: True}


class _Pinned:
    """A problem whose prescribed unknowns are constant."""

    def __init__(self, problem: StripProblem, at: Array) -> None:
        self.problem, self.at = problem, at

    def __getattr__(self, name: str) -> object:
        return getattr(self.problem, name)

    def prescribed_values(self, lam: float) -> Array:
        return self.at

    def prescribed_rates(self, lam: float) -> Array:
        return np.zeros(len(self.at))

    def accepted(self, q: Array) -> _Pinned:
        return self


def test_sparse_matrix_agrees_with_band_matrix() -> None:
    model, q = hairpin(2.0 * H)
    band = model.force_and_tangent(q)[1] + model.mass.scaled(-3.0)
    both = Sparse(band.to_sparse())
    fixed, x = np.array([0, 1, 7]), np.random.default_rng(4).normal(size=model.size)
    np.testing.assert_allclose(both @ x, band @ x)
    np.testing.assert_allclose(both.with_fixed(fixed) @ x, band.with_fixed(fixed) @ x)
    np.testing.assert_allclose(abs(both) @ x, abs(band) @ x)
    kept = both.with_fixed(fixed)
    np.testing.assert_allclose(kept @ kept.factor()(x), x, atol=1e-6)
    assert kept.negatives() == band.with_fixed(fixed).negatives() > 0
