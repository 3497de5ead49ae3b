"""The comparison that chooses the time integrator.

Three measures, each for every scheme: the order on a linear oscillator and on a smooth swing of the strip, with fixed
steps; what Newton iterations an accuracy costs there; and the fall to the first touch with floor and adaptive steps,
where the balance of energy shows what a scheme makes or takes.  A scheme that fails has nan and says why.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
import xarray as xr

from stripfold.analysis.static import StripModel, XRun, solve_height, touches
from stripfold.arrays import Array, Index
from stripfold.errors import SolveError
from stripfold.solve import dynamics
from stripfold.solve.dynamics import Moving, TimeOptions, TimeState
from stripfold.solve.linear import Band, BandPattern
from stripfold.solve.schemes import (
    Bathe,
    Damping,
    DynamicProblem,
    EnergyMomentum,
    GeneralisedAlpha,
    Scheme,
    WithoutMemory,
)
from studies.modes import HeldStrip

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

Its square stretches the strip, in a vibration far faster than the steps: with more, that and not the swing is what is
left of the error at fine steps.
"""
PUSH = 1e-2
"""The same of the fall: more than a tooth of the contact holds back, a hundredth of the energy released."""
FINER = 8
"""The truth of the swing is from steps this many times shorter than the shortest."""
LOOSE = TimeOptions(largest_gain=np.inf)
"""Schemes that make energy are to be seen making it."""
LATEST = 200.0
"""A strip that has not touched by then, sqrt(L*/g), has failed to fall."""
_TOUCH = {
    "touch_time": {"units": "1", "long_name": "time of the touch / sqrt(L*/g)"},
    "touch_steps": {"units": "1", "long_name": "time steps up to the touch"},
    "touch_iterations": {"units": "1", "long_name": "Newton iterations up to the touch"},
    "touch_seconds": {"units": "s", "long_name": "wall time up to the touch"},
    "released": {"units": "1", "long_name": "potential energy released up to the touch / (rho_a g L*^2)"},
    "lost_share": {"units": "1", "long_name": "energy lost, to whatever, as a share of that released"},
    "drift": {
        "units": "1",
        "long_name": "gap in the balance of energy as a share of that released; energy-momentum only",
    },
    "numerical_share": {"units": "1", "long_name": "energy taken by the scheme, as a share of that released; the same"},
    "contact_share": {"units": "1", "long_name": "energy lost in impacts, as a share of that released; the same"},
}


@dataclass(frozen=True)
class Oscillator(WithoutMemory):
    """``q'' + q = 0``: a mass of one on a linear spring, as the schemes see a problem."""

    size: int = 1

    @property
    def prescribed(self) -> Index:
        return np.zeros(0, dtype=np.intp)

    bounded = prescribed

    @property
    def lower(self) -> Array:
        return np.zeros(0)

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


def swing_start(run: XRun) -> tuple[HeldStrip, TimeState]:
    """A swing of the strip that is smooth in time: no contact changes, nothing starts with a jerk.

    It begins at the last, unstable equilibrium past the critical point, with a velocity along the mode that is
    unstable there; what lies stays held and there is no other floor.
    """
    problem, point = run.problem, run.points[-1]
    held = np.concatenate([problem.prescribed, point.state.active])
    strip = HeldStrip(problem.model, held, point.q[held], np.zeros(len(held)))
    return strip, dynamics.start(strip, point.q, SWING * _falling(run, point.mode), 0.0, strip.bounded)


def _falling(run: XRun, mode: Array) -> Array:
    """The mode with the sign in which the branch goes on."""
    return mode * np.sign(mode @ (run.problem.mass @ run.last.tangent.q))


def _steps(problem: DynamicProblem, first: TimeState, dt: float, until: float, scheme: Scheme) -> list[TimeState]:
    """The motion with fixed steps and a gripper at rest."""
    states = [first]
    for _ in range(round(until / dt)):
        states.append(dynamics.step(problem, states[-1], dt, Moving(first.lam, 0.0), Damping(), scheme, LOOSE))
    return states


def fall_to_touch(run: XRun, scheme: Scheme) -> list[TimeState]:
    """The fall from the critical state to the first touch: with the floor, adaptive steps and a gripper at rest."""
    problem, last = run.problem, run.last
    if run.critical is None:
        raise SolveError(f"no critical state to fall from: {run.end.reason}")
    v = PUSH * _falling(run, run.critical.mode)
    first = dynamics.start(problem, last.q, v, last.lam, last.state.active)
    states: list[TimeState] = []
    for state in dynamics.march(problem, first, Moving(last.lam, 0.0), scheme=scheme, options=LOOSE):
        states.append(state)
        if touches(problem.model, state):
            break
        if state.t > LATEST:
            raise SolveError(f"no touch by t = {LATEST:g}")
    return states


def observed_order(steps: Sequence[float], error: Array) -> float:
    """Slope of log(error) over log(step); nan where a step failed or there is one only."""
    if len(steps) < 2 or not np.isfinite(error).all():
        return float("nan")
    return float(np.polyfit(np.log(np.asarray(steps)), np.log(error), 1)[0])


def run(
    length_star: float,
    thickness: float,
    height: float,
    refinement: float,
    oscillator_steps: Sequence[float],
    oscillator_until: float,
    swing_steps: Sequence[float],
    swing_until: float,
) -> xr.Dataset:
    """Order, drift and cost of every scheme.

    Parameters
    ----------
    length_star, thickness, height
        L*.
    refinement
        Of the planned mesh.
    oscillator_steps, oscillator_until
        Steps, coarse to fine, and duration; the oscillator's frequency is one.
    swing_steps, swing_until
        Steps, coarse to fine, and duration of the strip's swing, sqrt(L*/g).
    """
    static = solve_height(StripModel(length_star, thickness), height, refinement)
    table = {name: np.full(len(SCHEMES), np.nan) for name in _TOUCH}
    oscillator = np.full((len(SCHEMES), len(oscillator_steps)), np.nan)
    swing, change, iterations, seconds = (np.full((len(SCHEMES), len(swing_steps)), np.nan) for _ in range(4))
    failures = [""] * len(SCHEMES)
    strip, first = swing_start(static)
    truth = _steps(strip, first, swing_steps[-1] / FINER, swing_until, SCHEMES[CONSERVING])[-1].q
    for i, scheme in enumerate(SCHEMES.values()):
        oscillator[i] = [oscillator_error(scheme, dt, oscillator_until) for dt in oscillator_steps]
        for j, dt in enumerate(swing_steps):
            try:
                begin = perf_counter()
                states = _steps(strip, first, dt, swing_until, scheme)
            except SolveError as error:
                failures[i] += f"swing, step {dt:g}: {error}; "
                continue
            seconds[i, j], iterations[i, j] = perf_counter() - begin, sum(m.iterations for m in states)
            swing[i, j] = np.sqrt(strip.metric @ (states[-1].q - truth) ** 2)
            most = max(m.energy.kinetic for m in states)
            change[i, j] = (states[-1].energy.total - first.energy.total) / most
        try:
            begin = perf_counter()
            states = fall_to_touch(static, scheme)
        except SolveError as error:
            failures[i] += f"fall: {error}; "
            continue
        start, end = states[0].energy, states[-1].energy
        released = start.elastic + start.gravity - end.elastic - end.gravity
        made = end.total - start.total
        if not released > 0.0 or made > released:
            failures[i] += f"fall: made an energy of {made:.2g} by t = {states[-1].t:.1f}; "
            continue
        table["touch_seconds"][i] = perf_counter() - begin
        table["touch_time"][i], table["touch_steps"][i] = states[-1].t, len(states) - 1
        table["touch_iterations"][i] = sum(m.iterations for m in states)
        table["released"][i], table["lost_share"][i] = released, -made / released
        if isinstance(scheme, EnergyMomentum):  # only this one knows what it does to the energy in a contact
            table["drift"][i], table["numerical_share"][i] = end.closing / released, end.numerical / released
            table["contact_share"][i] = end.contact / released
    one = {"units": "1"}
    step_dims = ("scheme", "swing_step")
    return xr.Dataset(
        {
            "oscillator_error": (
                ("scheme", "oscillator_step"),
                oscillator,
                {**one, "long_name": "error of displacement and velocity of the oscillator at the end"},
            ),
            "oscillator_order": (
                "scheme",
                [observed_order(oscillator_steps, error) for error in oscillator],
                {**one, "long_name": "observed order on the oscillator"},
            ),
            "swing_error": (step_dims, swing, {**one, "long_name": "rms displacement error of the swing / L*"}),
            "swing_energy": (
                step_dims,
                change,
                {**one, "long_name": "energy made in the swing as a share of its largest kinetic energy"},
            ),
            "swing_order": (
                "scheme",
                [observed_order(swing_steps, error) for error in swing],
                {**one, "long_name": "observed order on the strip's swing"},
            ),
            "swing_iterations": (step_dims, iterations, {**one, "long_name": "Newton iterations of the swing"}),
            "swing_seconds": (step_dims, seconds, {"units": "s", "long_name": "wall time of the swing"}),
            **{name: ("scheme", table[name], attrs) for name, attrs in _TOUCH.items()},
            "failure": ("scheme", failures, {**one, "long_name": "what failed, and how; empty where nothing did"}),
        },
        coords={
            "scheme": ("scheme", list(SCHEMES), {**one, "long_name": "time integration scheme"}),
            "oscillator_step": ("oscillator_step", list(oscillator_steps), {**one, "long_name": "step * frequency"}),
            "swing_step": ("swing_step", list(swing_steps), {**one, "long_name": "step / sqrt(L*/g)"}),
        },
        attrs={
            "length_star": length_star,
            "thickness": thickness,
            "height_star": height,
            "refinement": refinement,
            "oscillator_until": oscillator_until,
            "swing_until": swing_until,
        },
    )
