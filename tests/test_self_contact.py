"""Self-contact above the floor: forces, conservation, tangents, detection of crossing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stripfold.base.arrays import Array
from stripfold.solve import dynamics
from stripfold.solve.dynamics import Moving, TimeOptions
from stripfold.solve.schemes import Damping, EnergyMomentum
from stripfold.strip.problem import AlongX, StripProblem
from stripfold.strip.rod import Rod
from stripfold.strip.self_contact import Pairs, SelfContact, pair_energy, pair_force, smooth_step

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


def crumpled(random: np.random.Generator) -> tuple[Array, Array]:
    """Arc lengths of the nodes of a polygon above the floor that may cross itself, and their places, shape (n, 2)."""
    sides, turns = random.uniform(0.02, 0.1, 80), np.cumsum(random.normal(0.0, 0.3, 80))
    steps = sides[:, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    places = np.cumsum(np.vstack([[0.0, 0.5], steps]), axis=0)
    return np.append(0.0, np.cumsum(sides)), np.abs(places)


def everywhere(places: Array, thickness: float) -> tuple[Array, Array]:
    """Actual and required distances of all nodes and segments, shape (n, n - 1)."""
    (x, z), (along, up) = places.T, np.diff(places, axis=0).T
    a, b = x[:, None] - x[:-1], z[:, None] - z[:-1]
    foot = np.clip((a * along + b * up) / (along**2 + up**2), 0.0, 1.0)
    steps = [smooth_step(heights, thickness) for heights in (z, 0.5 * (z[1:] + z[:-1]))]
    return np.hypot(a - foot * along, b - foot * up), thickness * np.multiply.outer(*steps)


def test_the_search_finds_what_a_look_at_all_pairs_does() -> None:
    random, found = np.random.default_rng(4), 0
    for _ in range(40):
        s, places = crumpled(random)
        moved = np.abs(places + random.normal(0.0, 0.01, places.shape))
        pairs, arc = Pairs.of(s, H), np.abs(s[:, None] - s)
        separate = np.minimum(arc[:, :-1], arc[:, 1:]) > 0.5
        (near, asked), (near_then, asked_then) = everywhere(places, H), everywhere(moved, H)
        expected = np.nonzero(separate & (np.minimum(near, near_then) < np.maximum(asked, asked_then)))
        at, then = pairs.measure(places), pairs.measure(moved)
        np.testing.assert_array_equal(pairs.in_contact(at, then), expected)
        found += len(expected[0])
        if not at.crossed:
            gap = np.min((near - asked)[separate & (asked > 0.0)], initial=np.inf)
            assert at.gap == pytest.approx(gap, abs=1e-12)
    assert found > 100


def test_a_node_on_a_segment_has_an_energy() -> None:
    """Its squared distance may be rounded to less than 0."""
    random = np.random.default_rng(3)
    a, b = random.uniform(0.3, 1.0, (2, 2000, 2))
    x = np.concatenate([a + random.uniform(size=(2000, 1)) * (b - a), a, b], axis=1)
    np.testing.assert_allclose(pair_energy(x, H), 0.5 * H**2, rtol=1e-5)


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
