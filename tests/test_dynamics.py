"""Motion in time: order, energy, contact, damping, adaptive steps and failures."""

from __future__ import annotations

from itertools import pairwise, takewhile

import numpy as np
import pytest

from oracles.motions import HeldStrip
from oracles.moving import NONE, Pendulum
from stripfold.follow.contact import touches
from stripfold.follow.fall import ReleaseState, to_critical_point
from stripfold.follow.statics import StripModel
from stripfold.solve import dynamics
from stripfold.solve.dynamics import Moving, Nudge, TimeOptions, TimeState
from stripfold.solve.schemes import Damping, EnergyMomentum, Scheme
from stripfold.strip.solid import Solid

CONSERVING = EnergyMomentum(0.0)
STILL = Moving(0.0, 0.0)
Q0, V0 = np.array([0.1, 0.0]), np.array([0.0, 0.7])


def fixed(
    problem: object,
    first: TimeState,
    dt: float,
    steps: int,
    scheme: Scheme = CONSERVING,
    damping: Damping | None = None,
) -> list[TimeState]:
    """Steps of one length with a gripper at rest."""
    moments = [first]
    for _ in range(steps):
        moments.append(dynamics.step(problem, moments[-1], dt, STILL, damping or Damping(), scheme, TimeOptions()))
    return moments


def begin(problem: Pendulum, q: np.ndarray = Q0, v: np.ndarray = V0) -> TimeState:
    return dynamics.start(problem, q, v, 0.0, NONE)


def balance(moments: list[TimeState]) -> np.ndarray:
    """What the recorded energies lack at each moment, work and losses counted."""
    e = [m.energy for m in moments]
    return np.array([x.total - x.work + x.lost for x in e]) - e[0].total


@pytest.mark.parametrize("scheme", [CONSERVING, EnergyMomentum()], ids=repr)
def test_order_two_on_a_nonlinear_motion(scheme: Scheme) -> None:
    problem = Pendulum()
    q, v = problem.truth(Q0, V0, 2.0)
    first, steps = begin(problem), np.array([100, 200, 400])
    options = TimeOptions(largest_gain=np.inf)
    error = []
    for n in steps:
        moment = first
        for _ in range(n):
            moment = dynamics.step(problem, moment, 2.0 / n, STILL, Damping(), scheme, options)
        error.append(np.hypot(np.linalg.norm(moment.q - q), np.linalg.norm(moment.v - v)))
    order = -np.diff(np.log(error)) / np.log(2.0)
    print(f"observed orders {order}, errors {error}")
    assert np.all(np.abs(order - 2.0) < 0.15)
    assert error[-1] < 2e-3


def test_energy_and_angular_momentum_are_kept_however_long_the_step() -> None:
    problem = Pendulum(gravity=0.0)
    moments = fixed(problem, begin(problem), 0.3, 200)
    stretch = np.array([problem.strain(m.q) for m in moments])
    assert np.ptp(stretch) > 0.1, "the motion has to be nonlinear"
    momentum = np.array([np.linalg.det([problem.place(m.q), m.v]) for m in moments])
    assert np.abs(momentum - momentum[0]).max() < 1e-7
    assert np.abs(balance(moments)).max() < 1e-7
    assert moments[-1].energy.lost == 0.0


@pytest.fixture(scope="module")
def cantilever() -> tuple[HeldStrip, np.ndarray]:
    """A strip that is clamped horizontally and begins to fall, straight."""
    model = Solid.of(3.0, 0.05, elements=10)
    clamp = model.unknowns[0].ravel()
    return HeldStrip(model, clamp, np.zeros(len(clamp)), np.zeros(len(clamp))), np.zeros(model.size)


def test_strips_large_swing_keeps_its_energy(cantilever: tuple[HeldStrip, np.ndarray]) -> None:
    problem, q = cantilever
    first = dynamics.start(problem, q, q, 0.0, NONE)
    moments = fixed(problem, first, 0.05, 120)
    tip = np.array([m.q[problem.model.middle[-1, 1]] for m in moments])
    assert tip.min() < -1.5, "the swing has to be a large one"
    assert np.abs(balance(moments)).max() < 1e-8
    assert max(m.energy.kinetic for m in moments) > 0.3


def test_dissipation_takes_little_never_gives_and_is_recorded(cantilever: tuple[HeldStrip, np.ndarray]) -> None:
    problem, q = cantilever
    moments = fixed(problem, dynamics.start(problem, q, q, 0.0, NONE), 0.05, 120, EnergyMomentum())
    taken = np.array([m.energy.numerical for m in moments])
    assert np.all(np.diff(taken) >= 0.0)
    assert 1e-4 < taken[-1] < 0.15
    assert np.abs(balance(moments)).max() < 1e-8
    # Flicker that is faster than the step dies out, without dissipation it stays.
    rough = np.zeros(problem.size)
    rough[problem.model.middle[1:, 0]] = 0.02 * (-1.0) ** np.arange(len(problem.model.s) - 1)
    start = dynamics.start(problem, q, rough, 0.0, NONE)
    kinetic = [
        fixed(problem, start, 0.2, 30, scheme)[-1].energy.kinetic
        - fixed(problem, moments[0], 0.2, 30, scheme)[-1].energy.kinetic
        for scheme in (EnergyMomentum(), CONSERVING)
    ]
    assert abs(kinetic[0]) < 0.2 * abs(kinetic[1])


@pytest.mark.parametrize("kappa", [0.0, 0.7])
def test_force_over_a_step(kappa: float) -> None:
    """Its derivative by differences, and its work: the gain of energy and ``kappa`` times the strain distance."""
    model = Solid.of(2.0, 0.1, nu=0.3, elements=6)
    rng = np.random.default_rng(3)
    q0, q1, direction = (0.05 * rng.standard_normal(model.size) for _ in range(3))
    force, tangent = model.force_over_step(q0, q1, kappa)
    h = 1e-5
    ahead, behind = (model.force_over_step(q0, q1 + s * h * direction, kappa)[0] for s in (1.0, -1.0))
    difference = (ahead - behind) / (2.0 * h)
    assert np.abs(tangent @ direction - difference).max() < 1e-8 * np.abs(difference).max()
    work = float(force @ (q1 - q0))
    expected = model.energy(q1) - model.energy(q0) + kappa * model.strain_distance(q0, q1)
    assert work == pytest.approx(expected, rel=1e-11)
    assert model.strain_distance(q0, q1) > 0.0


@pytest.mark.parametrize("scheme", [CONSERVING, EnergyMomentum()], ids=repr)
def test_dropped_mass_lands_and_stays(scheme: Scheme) -> None:
    problem = Pendulum(stiffness=0.0, floor=-0.5)
    first = begin(problem, np.zeros(2), np.array([0.3, 0.0]))
    moments = fixed(problem, first, 0.07, 30, scheme)
    height = np.array([m.q[1] for m in moments])
    assert height.min() == pytest.approx(-0.5, abs=1e-12)
    assert height[-1] == pytest.approx(-0.5, abs=1e-12)
    assert np.all(np.diff([m.energy.total for m in moments]) <= 1e-12)
    landed = next(m for m in moments if len(m.active))
    assert landed.v[1] == pytest.approx(0.0, abs=1e-12)
    # All of the fall's energy is lost to the floor; sliding is free.
    end = moments[-1].energy
    assert end.contact + end.numerical == pytest.approx(0.5, abs=1e-9)
    assert end.contact > 0.4
    assert moments[-1].v[0] == pytest.approx(0.3, abs=0.01)
    assert np.abs(balance(moments)).max() < 1e-9


def test_fallen_strip_neither_penetrates_nor_gains() -> None:
    run = to_critical_point(StripModel(10.0, 0.06), 3.0, 2.0)
    release = ReleaseState.at(run.last, 2.0)
    problem, last = release.problem, release.point
    v = 0.05 * release.mode * np.sign(release.mode @ (problem.mass @ last.tangent.q))
    first = dynamics.start(problem, last.q, v, last.lam, last.state.active)
    march = dynamics.march(problem, first, Moving(last.lam, 0.0))
    moments = list(takewhile(lambda m: m.t < 20.0, march))
    assert any(touches(problem.model, m) for m in moments)
    gap = np.array([m.q[problem.bounded] - problem.lower for m in moments])
    assert gap.min() >= -1e-12
    energy = np.array([m.energy.total for m in moments])
    assert np.diff(energy).max() < 1e-9
    for name in ("contact", "numerical"):
        lost = np.array([getattr(m.energy, name) for m in moments])
        assert np.diff(lost).min() > -1e-9, name
        assert lost[-1] > 1e-6, name
    assert np.abs(balance(moments)).max() < 1e-7
    assert moments[-1].energy.work == pytest.approx(0.0, abs=1e-12)


def test_moved_end_does_work() -> None:
    """The mass's height is prescribed: what the mover does is what the bar, the mass and gravity gain."""
    problem = Pendulum(moved=np.array([1]))
    drive = Nudge(0.0, 0.4, 1.0)
    moments = [dynamics.start(problem, np.zeros(2), np.zeros(2), 0.0, NONE)]
    for _ in range(20):
        moments.append(dynamics.step(problem, moments[-1], 0.1, drive, Damping(), CONSERVING, TimeOptions()))
        assert moments[-1].q[1] == pytest.approx(drive.lam(moments[-1].t), abs=1e-12)
        assert moments[-1].v[1] == pytest.approx(drive.rate(moments[-1].t), abs=1e-12)
    assert moments[-1].energy.gravity == pytest.approx(0.4)
    assert moments[-1].energy.work > 0.4
    assert np.abs(balance(moments)).max() < 1e-7


@pytest.mark.parametrize(
    ("damping", "name", "other"),
    [(Damping(air=0.4), "air", "viscous"), (Damping(stiffness=0.004), "viscous", "air")],
)
def test_damping_loses_what_is_recorded_at_the_right_rate(damping: Damping, name: str, other: str) -> None:
    """Small vibrations along the bar, of frequency sqrt(stiffness): the amplitude falls as exp(-rate t)."""
    problem = Pendulum(gravity=0.0)
    moments = fixed(problem, begin(problem, np.zeros(2), np.array([1e-3, 0.0])), 0.01, 500, damping=damping)
    end = moments[-1].energy
    assert np.abs(balance(moments)).max() < 1e-9
    assert getattr(end, other) == 0.0
    assert getattr(end, name) > 0.5 * moments[0].energy.total
    rate = 0.5 * (damping.air + damping.stiffness * problem.stiffness)
    assert np.log(moments[0].energy.total / end.total) / (2.0 * rate * moments[-1].t) == pytest.approx(1.0, abs=0.05)


def test_steps_follow_the_tolerance() -> None:
    problem = Pendulum()
    counts, errors = [], []
    for tolerance in (1e-4, 1e-6):
        march = dynamics.march(problem, begin(problem), STILL, options=TimeOptions(tolerance=tolerance, largest=1.0))
        moments = list(takewhile(lambda m: m.t < 6.0, march))
        q, _ = problem.truth(Q0, V0, moments[-1].t)
        counts.append(len(moments))
        errors.append(np.linalg.norm(moments[-1].q - q))
        assert all(m.dt > 0.0 for m in moments[1:])
        assert len({m.dt for m in moments}) > 5
        for before, after in pairwise(moments[1:]):
            assert dynamics.error_of(problem, before, after) <= tolerance
            assert after.dt <= 1.5 * before.dt + 1e-12
    # Third order per step: a hundredth of the tolerance takes 4.6 times the steps.
    assert 3.5 < counts[1] / counts[0] < 6.0
    assert errors[1] < 0.15 * errors[0]
