"""Small vibrations of a clamped strip: frequencies of the motion in time against the beam's.

A strip clamped at one end, without gravity and hanging under it, is struck along each of its lowest modes; the
frequency is read from the zero crossings of the motion.  The reference is an inextensible Euler-Bernoulli beam,
``w'''' - (T w')' = omega^2 w`` with the tension ``T = l - s`` of the part below, solved by Ritz's method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg
import xarray as xr
from numpy.polynomial import Polynomial, legendre

from stripfold.base.arrays import Array, Index
from stripfold.solve import dynamics, newton
from stripfold.solve.drive import Moving
from stripfold.solve.linear import Band
from stripfold.solve.schemes import Damping, EnergyMomentum
from stripfold.strip.model import Model
from stripfold.strip.solid import Solid
from verification.common import NO_RESULT, attempted, dataset
from verification.integrators import WithoutMemory
from verification.numbers import Facts, Number

STRIKE = 1e-4
"""Largest velocity of the strip's free end after the strike, over its frequency, in lengths of the strip: small."""
TERMS = 16
"""Polynomials of the beam's solution: its three lowest frequencies have then converged to ten digits."""


@dataclass(frozen=True)
class HeldStrip(WithoutMemory):
    """A strip without a floor: some unknowns are held, and move with lambda.

    ``prescribed``, ``values``, ``direction``: held unknowns, what they are at lambda = 0, and their change per lambda;
    shape (m,).  ``gravity``: factor on the weight.
    """

    model: Model
    prescribed: Index
    values: Array
    direction: Array
    gravity: float = 1.0

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

    def strain_distance(self, q0: Array, q1: Array) -> float:
        return self.model.strain_distance(q0, q1)

    def energies(self, q: Array) -> tuple[float, float]:
        return self.model.energy(q), self.gravity * float(self.model.weight @ q)

    def prescribed_values(self, lam: float) -> Array:
        return self.values + lam * self.direction

    def prescribed_rates(self, lam: float) -> Array:
        return self.direction


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
    shapes = [
        Polynomial([0.0, 0.0, 1.0]) * legendre.Legendre.basis(i, [0.0, 1.0]).convert(kind=Polynomial)
        for i in range(TERMS)
    ]
    value, slope, curvature = (
        np.array([shape.deriv(m)(x) if m else shape(x) for shape in shapes]) / length**m for m in range(3)
    )
    stiffness = (w * curvature) @ curvature.T + (w * gravity * length * (1.0 - x) * slope) @ slope.T
    squares = scipy.linalg.eigh(stiffness, (w * value) @ value.T, eigvals_only=True)
    return np.asarray(np.sqrt(squares[:count]))


def solid_modes(problem: HeldStrip, q: Array, count: int) -> tuple[Array, Array]:
    """The lowest angular frequencies of (K, M) at ``q``, shape (count,), and their modes of unit mass norm."""
    stiffness, mass = problem.linearise(q, 0.0)[1].to_sparse(), problem.mass.to_sparse()
    free = np.setdiff1d(np.arange(problem.size), problem.prescribed)
    squares, vectors = scipy.linalg.eigh(
        stiffness[np.ix_(free, free)].toarray(), mass[np.ix_(free, free)].toarray(), subset_by_index=[0, count - 1]
    )
    modes = np.zeros((count, problem.size))
    modes[:, free] = vectors.T
    return np.asarray(np.sqrt(squares)), modes


def crossing_frequency(t: Array, x: Array) -> float:
    """Angular frequency of a signal about zero: a straight line through the times of its zero crossings."""
    at = np.flatnonzero(x[:-1] * x[1:] < 0.0)
    crossings = t[at] - x[at] * (t[at + 1] - t[at]) / (x[at + 1] - x[at])
    return float(np.pi / np.polyfit(np.arange(len(crossings)), crossings, 1)[0])


def struck(problem: HeldStrip, q: Array, mode: Array, frequency: float, periods: int, steps: int) -> float:
    """Angular frequency of the motion in time after a strike along ``mode``, with ``steps`` per period of it."""
    tip = float(np.abs(mode[problem.model.middle[-1]]).max())
    v = STRIKE * problem.model.length * frequency / tip * mode
    moment = dynamics.start(problem, q, v, 0.0, problem.bounded)
    dt = 2.0 * np.pi / frequency / steps
    row = problem.mass @ mode
    t, x = [0.0], [0.0]
    for _ in range(periods * steps):
        moment = dynamics.step(
            problem, moment, dt, Moving(0.0, 0.0), Damping(), EnergyMomentum(), dynamics.TimeOptions()
        )
        t.append(moment.t)
        x.append(float(row @ (moment.q - q)))
    return crossing_frequency(np.array(t), np.array(x))


def run(
    length_star: float = 3.0,
    thickness: float = 0.02,
    elements: int = 24,
    modes: int = 2,
    periods: int = 3,
    steps: Sequence[int] = (25, 50, 100),
) -> xr.Dataset:
    """Frequencies of the clamped strip, without gravity and hanging.

    ``length_star``, ``thickness``: L*; ``elements``: along the strip, all of one length; ``modes``: how many, from the
    lowest; ``periods``: observed, of each mode; ``steps``: time steps per period, coarse to fine.
    """
    gravity = np.array([0.0, 1.0])
    truth, linear = np.empty((2, modes)), np.empty((2, modes))
    motion = np.full((2, modes, len(steps)), np.nan)
    messages = np.full(motion.shape, "", dtype=object)
    for i, g in enumerate(gravity):
        truth[i] = beam_frequencies(length_star, float(g), modes)
        problem, rest = hanging(length_star, thickness, elements, float(g))
        linear[i], shapes = solid_modes(problem, rest, modes)
        for j, shape in enumerate(shapes):
            for k, n in enumerate(steps):
                at = partial(struck, problem, rest, shape, float(linear[i, j]), periods, n)
                found, messages[i, j, k] = attempted(at)
                motion[i, j, k] = np.nan if found is None else found
    both, all_three = ("gravity", "mode"), ("gravity", "mode", "steps")
    return dataset(
        {
            "gravity": ("gravity", gravity),
            "mode": ("mode", np.arange(1, modes + 1)),
            "steps": ("steps", steps),
            "beam": (both, truth),
            "solid": (both, linear),
            "motion": (all_three, motion),
            "solid_error": (both, np.abs(linear / truth - 1.0)),
            NO_RESULT: (all_three, messages),
            "motion_error": (all_three, np.abs(motion / truth[..., None] - 1.0)),
        },
        {"length_star": length_star, "thickness": thickness, "elements": elements, "periods": periods},
    )


def facts(d: xr.Dataset) -> Facts:
    return {"error": d.motion_error.isel(steps=-1).max(), "steps": d.steps[-1], "linear": d.solid_error.max()}


# fmt: off
NUMBERS = {
    facts: (
        Number("modes_error", "error", "1", "< 0.002",
            "largest relative error of the frequency of the motion, {d.sizes[mode]} modes of a clamped strip of "
            "{d.attrs[length_star]:g} L* without gravity and hanging; {steps} steps per period, "
            "{d.attrs[elements]} elements; (K, M) alone: {linear:.1e}"),
    ),
}
# fmt: on
