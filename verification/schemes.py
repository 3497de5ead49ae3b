"""The comparison that chooses the time integrator.

Three measures, each for every scheme: the order on a linear oscillator and on a smooth swing of the strip, with fixed
steps; the Newton iterations for a given accuracy there; and the fall to the first touch with floor and adaptive steps,
where the balance of energy shows the gain or loss of a scheme.  A scheme that fails has nan and says why.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter

import numpy as np
import xarray as xr

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import SolveError
from stripfold.follow.contact import touches
from stripfold.follow.contact_set import on_nodes
from stripfold.follow.statics import StripModel, solve_height
from stripfold.follow.track import Track
from stripfold.solve import dynamics
from stripfold.solve.drive import Moving
from stripfold.solve.dynamics import TimeEvent, TimeOptions, TimeState
from stripfold.solve.linear import Band, BandPattern
from stripfold.solve.problem import Point
from stripfold.solve.schemes import Damping, DynamicProblem, EnergyMomentum, Scheme
from stripfold.strip.problem import StripProblem
from verification.common import attempted, blank, dataset
from verification.integrators import Bathe, GeneralisedAlpha, WithoutMemory
from verification.modes import HeldStrip
from verification.numbers import Facts, Number

UNITS = {"s": "swing_seconds touch_seconds"}

DEFAULT = "energy-momentum"
CONSERVING = "energy-momentum, r = 0"
SCHEMES: dict[str, Scheme] = {
    DEFAULT: EnergyMomentum(),
    CONSERVING: EnergyMomentum(0.0),
    "generalised-alpha, radius 1": GeneralisedAlpha(1.0),
    "generalised-alpha, radius 0.8": GeneralisedAlpha(0.8),
    "generalised-alpha, radius 0.5": GeneralisedAlpha(0.5),
    "Bathe": Bathe(),
}
SWING = 0.05
"""Velocity with which the swing begins, as a factor on the mode of unit mass norm.

Its square stretches the strip, in a vibration far faster than the steps; a larger velocity would make this vibration
the dominant error at fine steps.
"""
PUSH = 1e-2
"""The same of the fall: enough to pass the spurious limit points of the contact, a hundredth of the energy released."""
FINER = 8
"""The reference of the swing has steps this many times shorter than the shortest."""
LOOSE = TimeOptions(largest_gain=np.inf)
"""Without a limit on energy gain, so that schemes that gain energy show it."""
LATEST = 200.0
"""A strip that has not touched by then, sqrt(L*/g), has failed to fall."""
OF_FALL = ("touch_time", "touch_steps", "touch_iterations", "touch_seconds", "released", "lost_share")
OF_ENERGY = ("drift", "numerical_share", "contact_share")
"""Results of the fall; the latter from the scheme's own balance of energy, of energy-momentum only."""


@dataclass(frozen=True)
class Oscillator(WithoutMemory):
    """``q'' + q = 0``: a mass of one on a linear spring, as the schemes see a problem."""

    size: int = 1

    @property
    def prescribed(self) -> Index:
        return np.zeros(0, dtype=np.intp)

    @property
    def metric(self) -> Array:
        return np.zeros(1)  # measures steps that are capped: these are not

    @property
    def mass(self) -> Band:
        return BandPattern.of(np.zeros((1, 1), dtype=np.intp), 1).assemble(np.ones((1, 1, 1)))

    def residual(self, q: Array, lam: float) -> Array:
        return q

    def linearise(self, q: Array, lam: float, predicted_stress: None = None) -> tuple[Array, Band, Array]:
        return q, self.mass, np.zeros(1)

    def predict_stress(self, q: Array, dq: Array) -> None:
        return None

    def admissibility(self, q: Array) -> str:
        return ""

    def force_over_step(self, q0: Array, q1: Array, kappa: float, predicted_stress: None = None) -> tuple[Array, Band]:
        return 0.5 * (q0 + q1) + kappa * (q1 - q0), self.mass.scaled(0.5 + kappa)

    def strain_distance(self, q0: Array, q1: Array) -> float:
        return float((q1 - q0) @ (q1 - q0))

    def energies(self, q: Array) -> tuple[float, float]:
        return 0.5 * float(q @ q), 0.0

    def prescribed_values(self, lam: float) -> Array:
        return np.zeros(0)

    prescribed_rates = prescribed_values


def oscillator_error(scheme: Scheme, dt: float, until: float) -> float:
    """Distance from ``q = cos t, v = -sin t`` at the end."""
    problem = Oscillator()
    state = dynamics.start(problem, np.ones(1), np.zeros(1), 0.0, problem.bounded)
    end = _steps(problem, state, dt, until, scheme)[-1]
    return float(np.hypot(end.q[0] - np.cos(end.t), end.v[0] + np.sin(end.t)))


def swing_start(run: Track) -> tuple[HeldStrip, TimeState]:
    """A swing of the strip that is smooth in time: no contact changes, nothing starts with a jerk.

    It begins at the last, unstable equilibrium past the critical point, with a velocity along the mode that is
    unstable there; the lying part stays held and there is no other floor.
    """
    at = run.beyond[-1]
    problem, point = at.problem.on_mesh(at.point)
    held = np.concatenate([problem.prescribed, point.active])
    strip = HeldStrip(problem.model, held, point.q[held], np.zeros(len(held)))
    return strip, dynamics.start(strip, point.q, SWING * _falling(problem, point), 0.0, strip.bounded)


def _falling(problem: StripProblem, point: Point) -> Array:
    """The mode with the sign in which the branch goes on."""
    return point.mode * np.sign(point.mode @ (problem.mass @ point.tangent.q))


def _steps(problem: DynamicProblem, first: TimeState, dt: float, until: float, scheme: Scheme) -> list[TimeState]:
    """The motion with fixed steps and a gripper at rest."""
    states = [first]
    for _ in range(round(until / dt)):
        states.append(dynamics.step(problem, states[-1], dt, Moving(first.lam, 0.0), Damping(), scheme, LOOSE))
    return states


def fall_to_touch(run: Track, refinement: float, scheme: Scheme) -> list[TimeState]:
    """The fall from the critical state to the first touch: with the floor, adaptive steps and a gripper at rest."""
    if run.critical is None:
        raise SolveError(f"no critical state to fall from: {run.end.reason}")
    problem, last = on_nodes(run.last, refinement, stable=True)
    first = dynamics.start(problem, last.q, PUSH * _falling(problem, last), last.lam, last.active)
    until = (TimeEvent(lambda state: touches(problem.model, state)), TimeEvent(lambda state: state.t > LATEST))
    states = list(dynamics.march(problem, first, Moving(last.lam, 0.0), scheme=scheme, options=LOOSE, until=until))
    if not touches(problem.model, states[-1]):
        raise SolveError(f"no touch by t = {LATEST:g}")
    return states


def observed_order(steps: Sequence[float], error: Array) -> float:
    """Slope of log(error) over log(step); nan where a step failed or there is one only."""
    if len(steps) < 2 or not np.isfinite(error).all():
        return float("nan")
    return float(np.polyfit(np.log(np.asarray(steps)), np.log(error), 1)[0])


def run(
    length_star: float = 12.0,
    thickness: float = 0.0594,
    height: float = 5.0,
    refinement: float = 1.0,
    oscillator_steps: Sequence[float] = (0.1, 0.05, 0.025),
    oscillator_until: float = 10.0,
    swing_steps: Sequence[float] = (0.4, 0.2, 0.1),
    swing_until: float = 12.0,
) -> xr.Dataset:
    """Order, drift and cost of every scheme.

    ``length_star``, ``thickness``, ``height``: L*.  ``refinement``: factor on the element lengths.
    ``oscillator_steps``, ``oscillator_until``: steps, coarse to fine, and duration; the oscillator's frequency is one.
    ``swing_steps``, ``swing_until``: steps, coarse to fine, and duration of the strip's swing, sqrt(L*/g).
    """
    static = solve_height(StripModel(length_star, thickness), height, refinement, past=1.0)
    falls = {name: blank(len(SCHEMES)) for name in (*OF_FALL, *OF_ENERGY)}
    oscillator = blank(len(SCHEMES), len(oscillator_steps))
    swing, change, iterations, seconds = (blank(len(SCHEMES), len(swing_steps)) for _ in range(4))
    failures = [""] * len(SCHEMES)
    strip, first = swing_start(static)
    truth = _steps(strip, first, swing_steps[-1] / FINER, swing_until, SCHEMES[CONSERVING])[-1].q
    for i, scheme in enumerate(SCHEMES.values()):
        oscillator[i] = [oscillator_error(scheme, dt, oscillator_until) for dt in oscillator_steps]
        for j, dt in enumerate(swing_steps):
            begin = perf_counter()
            states, message = attempted(partial(_steps, strip, first, dt, swing_until, scheme))
            if states is None:
                failures[i] += f"swing, step {dt:g}: {message}; "
                continue
            seconds[i, j], iterations[i, j] = perf_counter() - begin, sum(m.iterations for m in states)
            swing[i, j] = np.sqrt(strip.metric @ (states[-1].q - truth) ** 2)
            most = max(m.energy.kinetic for m in states)
            change[i, j] = (states[-1].energy.total - first.energy.total) / most
        fall, message = attempted(partial(_fall, static, refinement, scheme))
        for name, value in (fall or {}).items():
            falls[name][i] = value
        failures[i] += message and f"fall: {message}; "
    orders = (
        [observed_order(steps, error) for error in errors]
        for steps, errors in ((oscillator_steps, oscillator), (swing_steps, swing))
    )
    both = ("scheme", "swing_step")
    return dataset(
        {
            "scheme": ("scheme", list(SCHEMES)),
            "oscillator_step": ("oscillator_step", oscillator_steps),
            "swing_step": ("swing_step", swing_steps),
            "oscillator_error": (("scheme", "oscillator_step"), oscillator),
            "oscillator_order": ("scheme", next(orders)),
            "swing_error": (both, swing),
            "swing_energy": (both, change),
            "swing_order": ("scheme", next(orders)),
            "swing_iterations": (both, iterations),
            "swing_seconds": (both, seconds),
            **{name: ("scheme", values) for name, values in falls.items()},
            "failure": ("scheme", failures),
        },
        {"length_star": length_star, "thickness": thickness, "height_star": height, "refinement": refinement}
        | {"oscillator_until": oscillator_until, "swing_until": swing_until},
        units=UNITS,
    )


def _fall(static: Track, refinement: float, scheme: Scheme) -> dict[str, float]:
    """The fall to the touch: cost and energy."""
    begin = perf_counter()
    states = fall_to_touch(static, refinement, scheme)
    seconds = perf_counter() - begin
    start, end = states[0].energy, states[-1].energy
    released = start.elastic + start.gravity - end.elastic - end.gravity
    made = end.total - start.total
    if not released > 0.0 or made > released:
        raise SolveError(f"made an energy of {made:.2g} by t = {states[-1].t:.1f}")
    found = (states[-1].t, len(states) - 1, sum(m.iterations for m in states), seconds, released, -made / released)
    out = dict(zip(OF_FALL, map(float, found), strict=True))
    if isinstance(scheme, EnergyMomentum):
        balance = (end.closing, end.numerical, end.contact)
        out |= {name: energy / released for name, energy in zip(OF_ENERGY, balance, strict=True)}
    return out


def facts(d: xr.Dataset) -> Facts:
    chosen, conserving, steps = d.sel(scheme=DEFAULT), d.sel(scheme=CONSERVING), d.swing_step.values
    oscillator, swing = float(chosen.oscillator_order), float(chosen.swing_order)
    return {
        "oscillator": oscillator,
        "swing": swing,
        "order": min(oscillator, swing),
        "steps": f"{steps[0]:g} to {steps[-1]:g}",
        "drift": np.abs(conserving.drift),
        "contact": conserving.contact_share,
        "numerical": chosen.numerical_share,
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("dynamics_order", "order", "1", "> 1.9 for both",
            "observed order of the time integrator, the smaller of {oscillator:.3f} on a linear oscillator and "
            "{swing:.3f} on a swing of the strip (steps of {steps} sqrt(L*/g))",
            lambda f: f.oscillator > 1.9 and f.swing > 1.9, digits=4),
        Number("dynamics_energy_drift", "drift", "1", "< 1e-4",
            "energy error of the undamped fall up to the touch over the potential energy released, scheme without "
            "dissipation, the loss at impacts ({contact:.1%}) allowed for; the default dissipation takes "
            "{numerical:.1%}"),
    ),
}
# fmt: on
