"""Time integration against what is known: its order, the energy of a fall, and frequencies of small vibrations.

Orders are observed with fixed steps, on a vibration and on a smooth swing of the strip.  The fall goes from the
critical state to the first touch, undamped.  The vibrations are those of a strip clamped at one end, without gravity
and hanging under it, struck along each of its lowest modes; their reference is an inextensible Euler-Bernoulli beam,
``w'''' - (T w')' = omega^2 w`` with the tension ``T = l - s`` of the part below, solved by Ritz's method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy.linalg
import xarray as xr
from numpy.polynomial import Polynomial, legendre

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import SolveError
from stripfold.follow.contact import touches
from stripfold.follow.contact_set import on_nodes
from stripfold.follow.statics import StripModel, solve_height
from stripfold.solve import dynamics, newton
from stripfold.solve.dynamics import Moving, TimeEvent, TimeOptions, TimeState
from stripfold.solve.linear import Band
from stripfold.solve.problem import FixedUnknowns, Point
from stripfold.solve.schemes import Damping, DynamicProblem, EnergyMomentum
from stripfold.strip.model import Model
from stripfold.strip.problem import StripProblem
from stripfold.strip.solid import Solid
from verification.common import dataset
from verification.numbers import Facts, Number

DEFAULT, CONSERVING = EnergyMomentum(), EnergyMomentum(0.0)
SWING = 0.05
"""Velocity with which the swing begins, as a factor on the mode of unit mass norm.

Its square stretches the strip, in a vibration far faster than the steps: with a larger one that is the largest error.
"""
PUSH = 1e-2
"""The same of the fall: enough to pass the spurious limit points of the contact, a hundredth of the energy released."""
FINER = 8
"""The reference of the swing has steps this many times shorter than the shortest."""
STRIKE = 1e-4
"""Largest velocity of the strip's free end after the strike, over its frequency, in lengths of the strip: small."""
TERMS = 16
"""Polynomials of the beam's solution: its three lowest frequencies have then converged to ten digits."""


@dataclass(frozen=True)
class HeldStrip(FixedUnknowns):
    """A strip without a floor: some unknowns are held, and move with lambda.

    ``prescribed``, ``values``, ``direction``: held unknowns, what they are at lambda = 0, and their change per lambda;
    shape (m,).  ``gravity``: factor on the weight.
    """

    model: Model
    prescribed: Index
    values: Array
    direction: Array
    gravity: float = 1.0
    bounded = np.zeros(0, dtype=np.intp)
    lower = np.zeros(0)

    @property
    def size(self) -> int:
        return self.model.size

    @property
    def metric(self) -> Array:
        """Mean square of the mid-surface displacement."""
        metric = np.zeros(self.size)
        metric[self.model.middle] = (np.gradient(self.model.s) / self.model.length)[:, None]
        return metric

    @property
    def mass(self) -> Band:
        return self.model.mass

    def residual(self, q: Array, lam: float) -> Array:
        return self.model.internal_force(q) + self.gravity * self.model.weight

    def linearise(self, q: Array, lam: float, predicted_stress: Array | None = None) -> tuple[Array, Band, Array]:
        force, tangent = self.model.force_and_tangent(q, predicted_stress)
        return force + self.gravity * self.model.weight, tangent, np.zeros(self.size)

    def predict_stress(self, q: Array, dq: Array) -> Array:
        return self.model.predict_stress(q, dq)

    def admissibility(self, q: Array) -> str:
        return self.model.admissibility(q)

    def force_over_step(
        self, q0: Array, q1: Array, kappa: float, predicted_stress: Array | None = None
    ) -> tuple[Array, Band]:
        force, tangent = self.model.force_over_step(q0, q1, kappa, predicted_stress)
        return force + self.gravity * self.model.weight, tangent

    def elements_over_step(self, q0: Array, q1: Array) -> None:
        """None: its steps are not compiled."""

    def strain_distance(self, q0: Array, q1: Array) -> float:
        return self.model.strain_distance(q0, q1)

    def energies(self, q: Array) -> tuple[float, float]:
        return self.model.energy(q), self.gravity * float(self.model.weight @ q)

    def friction_work(self, q0: Array, q1: Array) -> float:
        return 0.0

    def accepted(self, q: Array) -> Self:
        return self

    def prescribed_values(self, lam: float) -> Array:
        return self.values + lam * self.direction

    def prescribed_rates(self, lam: float) -> Array:
        return self.direction


def falling(problem: StripProblem, point: Point) -> Array:
    """The unstable mode of a point, with the sign in which the branch goes on."""
    return point.mode * np.sign(point.mode @ (problem.mass @ point.tangent.q))


def stepped(
    problem: DynamicProblem, first: TimeState, dt: float, count: int, scheme: EnergyMomentum = DEFAULT
) -> list[TimeState]:
    """The motion with fixed steps and a gripper at rest."""
    states = [first]
    for _ in range(count):
        drive = Moving(first.lam, 0.0)
        states.append(dynamics.step(problem, states[-1], dt, drive, Damping(), scheme, TimeOptions()))
    return states


def hanging(length: float, thickness: float, elements: int, gravity: float) -> tuple[HeldStrip, Array]:
    """A strip that hangs from a clamp at its first column, and its unknowns at rest, shape (n,); lengths in L*."""
    model = Solid.of(length, thickness, elements=elements)
    straight = np.stack([np.zeros_like(model.s), -model.s], axis=1)
    q = model.unknowns_of(straight, np.full(len(model.s), -np.pi / 2.0))
    clamp = model.unknowns[0].ravel()
    problem = HeldStrip(model, clamp, q[clamp], np.zeros(len(clamp)), gravity)
    return problem, newton.solve(problem, q, 0.0, problem.bounded).q


def beam_frequencies(length: float, gravity: float, count: int) -> Array:
    """The lowest angular frequencies of the hanging inextensible beam, shape (count,).

    Ritz's method with ``x^2 P_i(2 x - 1)``, ``x = s / length``, integrated exactly; bending stiffness and mass are one.
    """
    x, w = legendre.leggauss(2 * TERMS)
    x, w = 0.5 * (x + 1.0), 0.5 * w * length
    square = Polynomial([0.0, 0.0, 1.0])
    shapes = [square * legendre.Legendre.basis(i, [0.0, 1.0]).convert(kind=Polynomial) for i in range(TERMS)]
    value, slope, curvature = (np.array([shape.deriv(m)(x) for shape in shapes]) / length**m for m in range(3))
    stiffness = (w * curvature) @ curvature.T + (w * gravity * length * (1.0 - x) * slope) @ slope.T
    return np.asarray(np.sqrt(scipy.linalg.eigh(stiffness, (w * value) @ value.T, eigvals_only=True)[:count]))


def solid_modes(problem: HeldStrip, q: Array, count: int) -> tuple[Array, Array]:
    """The lowest angular frequencies of (K, M) at ``q``, shape (count,), and their modes of unit mass norm."""
    free = np.setdiff1d(np.arange(problem.size), problem.prescribed)
    both = [of.to_sparse()[np.ix_(free, free)].toarray() for of in (problem.linearise(q, 0.0)[1], problem.mass)]
    squares, vectors = scipy.linalg.eigh(*both, subset_by_index=[0, count - 1])
    modes = np.zeros((count, problem.size))
    modes[:, free] = vectors.T
    return np.asarray(np.sqrt(squares)), modes


def struck(problem: HeldStrip, q: Array, mode: Array, frequency: float, periods: int, steps: int) -> float:
    """Angular frequency after a strike along ``mode``: a straight line through the times of zero crossings."""
    tip = float(np.abs(mode[problem.model.middle[-1]]).max())
    v = STRIKE * problem.model.length * frequency / tip * mode
    first = dynamics.start(problem, q, v, 0.0, problem.bounded)
    states = stepped(problem, first, 2.0 * np.pi / frequency / steps, periods * steps)
    t, x = np.array([(state.t, (problem.mass @ mode) @ (state.q - q)) for state in states]).T
    at = np.flatnonzero(x[:-1] * x[1:] < 0.0)
    crossings = t[at] - x[at] * (t[at + 1] - t[at]) / (x[at + 1] - x[at])
    return float(np.pi / np.polyfit(np.arange(len(crossings)), crossings, 1)[0])


def observed_order(steps: Array, error: Array) -> float:
    """Slope of log(error) over log(step)."""
    return float(np.polyfit(np.log(steps), np.log(error), 1)[0])


def run(
    length_star: float = 12.0,
    thickness: float = 0.0594,
    height: float = 5.0,
    refinement: float = 1.0,
    swing_steps: Sequence[float] = (0.4, 0.2),
    swing_until: float = 12.0,
    clamped: tuple[float, float, int] = (3.0, 0.02, 24),
    modes: int = 2,
    periods: int = 2,
    steps: Sequence[int] = (25, 100),
) -> xr.Dataset:
    """Swing, fall and vibrations.

    ``swing_steps``: coarse to fine, sqrt(L*/g).  ``clamped``: length and thickness, L*, and elements of the strip that
    vibrates; ``modes``: how many, from the lowest; ``steps``: time steps per period, coarse to fine.
    """
    static = solve_height(StripModel(length_star, thickness), height, refinement, past=1.0)
    if static.critical is None:
        raise SolveError(f"no critical state to fall from: {static.end.reason}")

    # It begins at the last, unstable equilibrium; the lying part stays held: no contact changes.
    problem, point = static.beyond[-1].problem.on_mesh(static.beyond[-1].point)
    held = np.concatenate([problem.prescribed, point.active])
    strip = HeldStrip(problem.model, held, point.q[held], np.zeros(len(held)))
    first = dynamics.start(strip, point.q, SWING * falling(problem, point), 0.0, strip.bounded)
    finest = swing_steps[-1] / FINER
    truth = stepped(strip, first, finest, round(swing_until / finest), CONSERVING)[-1].q
    ends = [stepped(strip, first, dt, round(swing_until / dt))[-1].q for dt in swing_steps]
    swing_error = [np.sqrt(strip.metric @ (end - truth) ** 2) for end in ends]

    problem, point = on_nodes(static.last, refinement, stable=True)
    first = dynamics.start(problem, point.q, PUSH * falling(problem, point), point.lam, point.active)
    touch = TimeEvent(lambda state: touches(problem.model, state))
    balance = []
    for scheme in (DEFAULT, CONSERVING):
        drive = Moving(point.lam, 0.0)
        *_, last = dynamics.march(problem, first, drive, scheme=scheme, until=[touch])
        released = first.energy.elastic + first.energy.gravity - last.energy.elastic - last.energy.gravity
        balance.append([e / released for e in (last.energy.closing, last.energy.numerical, last.energy.contact)])

    length, thick, elements = clamped
    gravity = np.array([0.0, 1.0])
    beam, solid, motion = np.empty((2, modes)), np.empty((2, modes)), np.empty((2, modes, len(steps)))
    for i, g in enumerate(gravity):
        beam[i] = beam_frequencies(length, float(g), modes)
        strip, rest = hanging(length, thick, elements, float(g))
        solid[i], shapes = solid_modes(strip, rest, modes)
        for j, shape in enumerate(shapes):
            motion[i, j] = [struck(strip, rest, shape, float(solid[i, j]), periods, n) for n in steps]
    return dataset(
        {
            "swing_step": ("swing_step", swing_steps),
            "swing_error": ("swing_step", swing_error),
            "balance": (("scheme", "part"), balance),
            "scheme": ("scheme", ["default", "conserving"]),
            "part": ("part", ["closing", "numerical", "contact"]),
            "gravity": ("gravity", gravity),
            "steps": ("steps", steps),
            "beam": (("gravity", "mode"), beam),
            "solid": (("gravity", "mode"), solid),
            "motion": (("gravity", "mode", "steps"), motion),
        },
        {"length_star": length_star, "thickness": thickness, "height_star": height, "refinement": refinement}
        | {"swing_until": swing_until, "beam_length": length, "beam_elements": elements},
    )


def facts(d: xr.Dataset) -> Facts:
    """Orders, the energy of a fall relative to what it releases, and errors of frequencies."""
    off = np.abs(d.motion / d.solid - 1.0).values.reshape(-1, d.sizes["steps"])
    vibration = min(observed_order(1.0 / d.steps.values, one) for one in off)
    swing = observed_order(d.swing_step.values, d.swing_error.values)
    return {
        "vibration": vibration,
        "swing": swing,
        "order": min(vibration, swing),
        "swing_steps": f"{d.swing_step.values[0]:g} to {d.swing_step.values[-1]:g}",
        "drift": np.abs(d.balance.sel(scheme="conserving", part="closing")),
        "contact": d.balance.sel(scheme="conserving", part="contact"),
        "numerical": d.balance.sel(scheme="default", part="numerical"),
        "error": np.abs(d.motion.isel(steps=-1) / d.beam - 1.0).max(),
        "linear": np.abs(d.solid / d.beam - 1.0).max(),
        "coarse": d.steps[0],
        "steps": d.steps[-1],
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("dynamics_order", "order", "1", "> 1.9",
            "observed order of the time integrator, the smaller of {vibration:.3f} in the frequency of the vibrations "
            "below (from {coarse} steps per period on) and {swing:.3f} on a swing of the strip (steps of {swing_steps} "
            "sqrt(L*/g))", digits=4),
        Number("dynamics_energy_drift", "drift", "1", "< 1e-4",
            "energy error of the undamped fall up to the touch over the potential energy released, scheme without "
            "dissipation, the loss at impacts ({contact:.1%}) allowed for; the default dissipation takes "
            "{numerical:.1%}", spread=1.0),
        Number("modes_error", "error", "1", "< 0.002",
            "largest relative error of the frequency of the motion, {d.sizes[mode]} modes of a clamped strip of "
            "{d.attrs[beam_length]:g} L* without gravity and hanging; {steps} steps per period, "
            "{d.attrs[beam_elements]} elements; (K, M) alone: {linear:.1e}"),
    ),
}
# fmt: on
