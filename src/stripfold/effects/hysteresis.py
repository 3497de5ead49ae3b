"""Rate-independent bending friction (docs/physics.md, section 8).

The friction moment of Kawabata's bending test, by a Jenkins-Prandtl element: a spring in series with a slider.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.models.directors import Directors
from stripfold.models.model import Model
from stripfold.solve.linear import Band

YIELD_CURVATURE = 0.05
"""kappa_y, 1/L*: the change of curvature after which the element slides.

Two per cent of the largest curvature of the critical state at z = 3 L* (2.69/L*): small compared with the curvatures of
folding, and large enough for the spring not to be far stiffer than the strip itself.
"""
CELL = 0.02
"""Length of the fixed cells that keep kappa_p where elements move, L*."""
STICK_TOLERANCE = 1e-9
"""Relative excess over kappa_y that still counts as sticking: rounding must not decide the tangent of a state that slid
and was committed, with the spring at its limit."""


@dataclass(frozen=True, eq=False)
class Hysteresis:
    """A moment ``m = M_0 / kappa_y * clip(kappa - kappa_p, -kappa_y, kappa_y)`` in each element; see :meth:`of`.

    Attributes
    ----------
    model
        The strip.
    moment
        M_0, the largest friction moment, rho_a g L*^2: half of Kawabata's 2HB.
    yield_curvature
        kappa_y, 1/L*.
    slip
        kappa_p, 1/L*, shape (n_elements,): the curvature at which each spring is slack, as committed.
    dissipated
        Energy dissipated in all committed steps, rho_a g L*^2 per width.
    directors
        The geometry of the elements.
    cells
        Of friction that has been on other elements: ends of fixed cells along the strip, L*, and kappa_p in them,
        shape (n_cells, across).
    """

    model: Model = field(repr=False)
    moment: float
    yield_curvature: float
    slip: Array = field(repr=False)
    dissipated: float
    directors: Directors = field(repr=False)
    cells: tuple[Array, Array] | None = field(default=None, repr=False)

    @classmethod
    def of(
        cls, model: Model, moment: float, *, yield_curvature: float = YIELD_CURVATURE, slack: Array | None = None
    ) -> Self:
        """Friction with no moment in the flat state, or in the state ``slack``, shape (n,).

        The smaller ``yield_curvature``, the closer to dry friction, and the shorter the steps have to be: Newton's
        method converges for changes of two or three yield curvatures per step.

        Raises
        ------
        InvalidInputError
            ``moment`` negative, ``yield_curvature`` not positive, or either not finite.
        """
        if not 0.0 <= moment < np.inf:
            raise InvalidInputError("moment", moment, "a finite number >= 0 (rho_a g L*^2)")
        if not 0.0 < yield_curvature < np.inf:
            raise InvalidInputError("yield_curvature", yield_curvature, "a finite number > 0 (1/L*)")
        directors = model.directors
        flat = cls(model, moment, yield_curvature, np.zeros(len(directors.length)), 0.0, directors)
        return flat if slack is None else replace(flat, slip=flat.curvature(slack))

    @property
    def step_dependent(self) -> bool:
        """False."""
        return False

    @property
    def stiffness(self) -> float:
        """Stiffness of the spring, M_0 / kappa_y, in units of the bending stiffness rho_a g L*^3."""
        return self.moment / self.yield_curvature

    @property
    def _fraction(self) -> float:
        """Share of an element in its section's friction: one half with two elements across."""
        return 1.0 / self.directors.across

    def curvature(self, q: Array) -> Array:
        """Mean curvature of each element (rotation of the sections per reference length), 1/L*, (n_elements,)."""
        return self.directors.turn(self.directors.at(q)) / self.directors.length

    def moments(self, q: Array) -> Array:
        """The friction moment m at each element's section, rho_a g L*^2, shape (n_elements,)."""
        return self.stiffness * self._spring(self.curvature(q))

    def _spring(self, curvature: Array) -> Array:
        """Curvature of the springs."""
        return np.clip(curvature - self.slip, -self.yield_curvature, self.yield_curvature)

    def force(self, q: Array) -> Array:
        """``sum over elements of m * length * d kappa / dq``, shape (n,)."""
        gradient = self.directors.gradient(self.directors.at(q))
        return self._scatter(self._fraction * self.moments(q)[:, None] * gradient)

    def force_and_tangent(self, q: Array) -> tuple[Array, Band]:
        """The force and its derivative: with the spring's stiffness where it sticks, without where it slides."""
        directors, curvature = self.directors, self.curvature(q)
        d = directors.at(q)
        moment = self._fraction * self.stiffness * self._spring(curvature)
        sticks = np.abs(curvature - self.slip) <= self.yield_curvature * (1.0 + STICK_TOLERANCE)
        modulus = self._fraction * self.stiffness * sticks / directors.length
        gradient = directors.gradient(d)
        of_ends = modulus[:, None, None] * (gradient[:, :, None] * gradient[:, None, :])
        of_ends += moment[:, None, None] * directors.hessian(d)
        local = directors.local
        matrices = np.zeros((len(curvature), directors.n_local, directors.n_local))
        matrices[:, local[:, None], local] = of_ends
        return self._scatter(moment[:, None] * gradient), self.model.pattern.assemble(matrices)

    def _scatter(self, of_ends: Array) -> Array:
        return np.bincount(self.directors.unknowns.ravel(), of_ends.ravel(), minlength=self.model.size).astype(float)

    def stored(self, q: Array) -> float:
        """Elastic energy of the springs, rho_a g L*^2 per width."""
        spring = self._spring(self.curvature(q))
        return 0.5 * self._fraction * self.stiffness * float(self.directors.length @ spring**2)

    def dissipation(self, q: Array) -> float:
        """Energy dissipated by a step to ``q``; exact unless an element turns back within the step."""
        change = self._slip_at(q) - self.slip
        return self._fraction * self.moment * float(self.directors.length @ np.abs(change))

    def _slip_at(self, q: Array) -> Array:
        curvature = self.curvature(q)
        return curvature - self._spring(curvature)

    def on(self, before: Model, model: Model) -> Self:
        """The same friction on other elements of the same strip.

        kappa_p is then kept in fixed cells as well, so that it does not spread when elements move back and forth.
        """
        if self.cells is None:
            cells = np.linspace(0.0, before.length, int(np.ceil(before.length / CELL)) + 1)
            slip = averages(before.ends, self._across(self.slip), cells)
        else:
            cells, slip = self.cells
        integral = np.concatenate([np.zeros((1, slip.shape[1])), np.cumsum(np.diff(cells)[:, None] * slip, axis=0)])
        at_ends = np.stack([np.interp(model.ends, cells, column) for column in integral.T], axis=1)
        size = np.diff(model.ends)[:, None]
        averaged = (np.diff(at_ends, axis=0) / size).ravel()
        if len(model.ends) == len(before.ends):
            # As many elements: only their lengths differ.
            directors = replace(self.directors, length=np.repeat(size, self.directors.across))
        else:
            directors = model.directors
        return replace(self, model=model, slip=averaged, directors=directors, cells=(cells, slip))

    def _across(self, values: Array) -> Array:
        """Values of the elements, shape (along, across): elements across the strip are neighbours in the numbering."""
        return values.reshape(-1, self.directors.across)

    def committed(self, q: Array) -> Self:
        """The friction after an accepted step to ``q``: every element then counts as sticking."""
        slip, cells = self._slip_at(q), self.cells
        if cells is not None:
            # Only the change is interpolated: where nothing slides nothing changes.
            ends, in_cells = cells
            cells = ends, in_cells + averages(self.model.ends, self._across(slip - self.slip), ends)
        return replace(self, slip=slip, dissipated=self.dissipated + self.dissipation(q), cells=cells)


def averages(ends: Array, values: Array, new: Array) -> Array:
    """Averages over the elements between the ends ``new`` of a function with the averages ``values``, shape (n, k).

    In each element the function is the parabola of that average whose values at its ends are interpolated between the
    middles of neighbours: third order, and conservative.
    """
    size = np.diff(ends)[:, None]
    at_ends = np.concatenate(
        [values[:1], (size[1:] * values[:-1] + size[:-1] * values[1:]) / (size[1:] + size[:-1]), values[-1:]]
    )
    integral = np.concatenate([np.zeros_like(values[:1]), np.cumsum(size * values, axis=0)])
    e = np.clip(np.searchsorted(ends, new, side="right") - 1, 0, len(size) - 1)
    t = (new - ends[e])[:, None] / size[e]
    left, right = at_ends[e], at_ends[e + 1]
    inside = t * (left + t * (3.0 * values[e] - 2.0 * left - right + t * (left + right - 2.0 * values[e])))
    return np.asarray(np.diff(integral[e] + size[e] * inside, axis=0) / np.diff(new)[:, None])
