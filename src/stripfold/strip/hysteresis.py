"""Rate-independent bending friction (docs/physics.md, section 8).

The friction moment of Kawabata's bending test, by a Jenkins-Prandtl element: a spring in series with a slider.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.strip.effect import Directors, ElementMoments, Reaction
from stripfold.strip.model import Model

if TYPE_CHECKING:
    from stripfold.kernels.bending import Springs

STICK_TOLERANCE = 1e-9
"""Relative excess over kappa_y that still counts as sticking: rounding must not decide the tangent of a state that slid
and was committed, with the spring at its limit."""
ABOUT_TO_SLIDE = 1e-3
"""Relative distance from kappa_y within which an element is about to slide."""
YIELD_CURVATURE = 0.05
"""kappa_y, 1/L*: the change of curvature after which the element slides.

Two per cent of the largest curvature of the critical state at z = 3 L* (2.69/L*): small compared with the curvatures of
folding, and large enough for the spring not to be far stiffer than the strip itself.
"""
CELL = 0.005
"""Length of the fixed cells that keep kappa_p where elements move, L*."""


@dataclass(frozen=True, eq=False)
class Hysteresis(ElementMoments):
    """A moment ``m = M_0 / kappa_y * clip(kappa - kappa_p, -kappa_y, kappa_y)`` in each element; see :meth:`of`.

    Attributes
    ----------
    moment
        M_0, the largest friction moment, rho_a g L*^2: half of Kawabata's 2HB.
    yield_curvature
        kappa_y, 1/L*.
    slip
        kappa_p, 1/L*, shape (n_elements,): the curvature at which each spring is slack, as committed.
    dissipated
        Energy dissipated in all committed steps, rho_a g L*^2 per width.
    cells
        Of friction that has been on other elements: ends of fixed cells along the strip, L*, and the integral of
        kappa_p up to them, shape (n_cells + 1,).
    sticks_up_to
        Share of kappa_y up to which the tangent is that of sticking.
    held
        Curvature of the springs, 1/L*, shape (n_elements,), where it does not depend on the state; None where it does.
    """

    model: Model = field(repr=False)
    moment: float
    yield_curvature: float
    slip: Array = field(repr=False)
    dissipated: float
    directors: Directors = field(repr=False)
    cells: tuple[Array, Array] | None = field(default=None, repr=False)
    sticks_up_to: float = 1.0 + STICK_TOLERANCE
    held: Array | None = field(default=None, repr=False)

    @classmethod
    def of(
        cls, model: Model, moment: float, *, yield_curvature: float = YIELD_CURVATURE, slack: Array | None = None
    ) -> Self:
        """Friction with no moment in the flat state, or in the state ``slack``, shape (n,).

        The smaller ``yield_curvature``, the closer to dry friction, and the shorter the steps have to be: Newton's
        method converges for changes of two or three yield curvatures per step.

        Raises InvalidInputError: ``moment`` negative, ``yield_curvature`` not positive, or either not finite.
        """
        if not 0.0 <= moment < np.inf:
            raise InvalidInputError("moment", moment, "a finite number >= 0 (rho_a g L*^2)")
        if not 0.0 < yield_curvature < np.inf:
            raise InvalidInputError("yield_curvature", yield_curvature, "a finite number > 0 (1/L*)")
        directors = model.directors
        flat = cls(model, moment, yield_curvature, np.zeros(len(directors.length)), 0.0, directors)
        return flat if slack is None else replace(flat, slip=flat.curvature(slack))

    @property
    def stiffness(self) -> float:
        """Stiffness of the spring, M_0 / kappa_y, in units of the bending stiffness rho_a g L*^3."""
        return self.moment / self.yield_curvature

    def moments(self, q: Array) -> Array:
        """The friction moment m at each element's section, rho_a g L*^2, shape (n_elements,)."""
        return self.stiffness * self._spring(self.curvature(q))

    def _spring(self, curvature: Array) -> Array:
        """Curvature of the springs."""
        if self.held is not None:
            return self.held
        return np.clip(curvature - self.slip, -self.yield_curvature, self.yield_curvature)

    def _moment(self, curvature: Array) -> tuple[Array, Array]:
        if self.held is not None:
            return self.stiffness * self.held, np.zeros_like(curvature)
        # With the spring's stiffness where it sticks, without where it slides.
        sticks = np.abs(curvature - self.slip) <= self.yield_curvature * self.sticks_up_to
        return self.stiffness * self._spring(curvature), np.where(sticks, self.stiffness, 0.0)

    def about_to_slide(self) -> Self:
        """The same friction with the tangent of sliding where an element is within a thousandth of its limit."""
        return replace(self, sticks_up_to=1.0 - ABOUT_TO_SLIDE)

    def _rate(self, curvature: Array, growth: Array) -> Array:
        if self.held is not None:
            return np.zeros_like(growth)
        return (self.slip - curvature) * growth - self._carried(growth)

    def _carried(self, growth: Array) -> Array:
        """kappa_p that the ends of the elements take in as they move, per length: shape (k, n_elements).

        Together with the change of the elements' lengths it is the derivative of ``slip``.
        """
        ends, (cells, integral) = self.model.ends, self._in_cells
        size = np.diff(ends)
        moves = np.concatenate([np.zeros((len(growth), 1)), np.cumsum(growth * size, axis=1)], axis=1)
        cell = np.clip(np.searchsorted(cells, ends, side="right") - 1, 0, len(cells) - 2)
        at_ends = (integral[cell + 1] - integral[cell]) / (cells[cell + 1] - cells[cell])
        return np.asarray(np.diff(moves * at_ends, axis=1) / size)

    @property
    def springs(self) -> Springs:
        """The springs, for a compiled time step."""
        d, limit = self.directors, self.yield_curvature
        limits = np.array([self.stiffness, limit, limit * self.sticks_up_to])
        return kernels.bending.Springs(d.unknowns, d.factor, d.straight, d.length, self.slip, limits)

    def stored(self, q: Array) -> float:
        """Elastic energy of the springs, rho_a g L*^2 per width."""
        spring = self._spring(self.curvature(q))
        return 0.5 * self.stiffness * float(self.directors.length @ spring**2)

    def dissipation(self, q: Array) -> float:
        """Energy dissipated by a step to ``q``; exact unless an element turns back within the step."""
        return self._dissipation(self._slip_at(q))

    def _dissipation(self, slip: Array) -> float:
        return self.moment * float(self.directors.length @ np.abs(slip - self.slip))

    def _slip_at(self, q: Array) -> Array:
        curvature = self.curvature(q)
        return curvature - self._spring(curvature)

    def on(self, before: Model, model: Model) -> Self:
        """The same friction on other elements of the same strip.

        kappa_p is then kept in fixed cells as well, so that it does not spread when elements move back and forth.
        """
        size = np.diff(model.ends)
        # Where there are as many elements only their lengths differ.
        alike = len(model.ends) == len(before.ends)
        directors = replace(self.directors, length=size) if alike else model.directors
        if self.held is not None:
            return replace(self, model=model, directors=directors)
        cells, integral = self._in_cells
        within = np.diff(np.interp(model.ends, cells, integral))
        if alike:
            # What the cells do not resolve stays in its element: a state is the same on the elements it was found on.
            within += self._unresolved
        return replace(self, model=model, slip=within / size, directors=directors, cells=(cells, integral))

    def carried_over(self, q: Array, model: Model) -> Self:
        """The friction in a state ``q`` on other elements: its moments, held until they are :meth:`let_go`.

        Curvatures on other elements differ from those in ``q``, by more than kappa_y where it is small.  With kappa_p
        kept springs would stick and slide in turn; with the moments kept the state stays in equilibrium.
        """
        spring = integrals(self.model.ends, self._spring(self.curvature(q)), model.ends)
        averaged = np.diff(spring) / np.diff(model.ends)
        held = np.clip(averaged, -self.yield_curvature, self.yield_curvature)
        lost = self.dissipated + self.dissipation(q)
        return replace(self, model=model, directors=model.directors, cells=None, held=held, dissipated=lost)

    def let_go(self, q: Array) -> Self:
        """The friction with the moments held, in a state ``q``."""
        return self if self.held is None else replace(self, held=None, slip=self.curvature(q) - self.held)

    @cached_property
    def _in_cells(self) -> tuple[Array, Array]:
        """``cells``, made where there are none."""
        if self.cells is not None:
            return self.cells
        cells = np.linspace(0.0, self.model.length, int(np.ceil(self.model.length / CELL)) + 1)
        return cells, integrals(self.model.ends, self.slip, cells)

    @cached_property
    def _unresolved(self) -> Array:
        """Integrals of kappa_p over the elements less those in the cells, shape (n_elements,)."""
        ends = self.model.ends
        return self.slip * np.diff(ends) - np.diff(np.interp(ends, *self._in_cells))

    def committed(self, q: Array, reaction: Reaction) -> Self:
        """The friction after an accepted step to ``q``: every element then counts as sticking."""
        slip, cells = self._slip_at(q), self.cells
        if cells is not None:
            # Only the change is interpolated: where nothing slides nothing changes.
            ends, integral = cells
            cells = ends, integral + integrals(self.model.ends, slip - self.slip, ends)
        return replace(self, slip=slip, dissipated=self.dissipated + self._dissipation(slip), cells=cells)


def integrals(ends: Array, values: Array, at: Array) -> Array:
    """Integrals up to the places ``at`` of a function with the averages ``values`` over elements, shape (len(at),).

    In each element between two ``ends`` the function is the parabola of that average whose values at its ends are
    interpolated between the middles of neighbours: third order.
    """
    size = np.diff(ends)
    at_ends = np.concatenate(
        [values[:1], (size[1:] * values[:-1] + size[:-1] * values[1:]) / (size[1:] + size[:-1]), values[-1:]]
    )
    integral = np.append(0.0, np.cumsum(size * values))
    e = np.clip(np.searchsorted(ends, at, side="right") - 1, 0, len(size) - 1)
    t = (at - ends[e]) / size[e]
    left, right = at_ends[e], at_ends[e + 1]
    inside = t * (left + t * (3.0 * values[e] - 2.0 * left - right + t * (left + right - 2.0 * values[e])))
    return np.asarray(integral[e] + size[e] * inside)
