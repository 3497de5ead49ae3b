"""Forces on a strip besides its linear elasticity, weight and floor: bending laws and internal friction.

The bend of an element is the angle between the sections at its two ends.  The director of a section is a vector that
turns with it.  In the solid it is the vector across the section per thickness, D = (-sin phi, cos phi) times the
stretch, which is (0, 1) plus the difference of two relative unknowns (:mod:`.solid`).  In the rod it is the tangent,
(1, 0) plus the slopes.  No length of the strip is subtracted from another, so the rounding error of an angle is that of
numbers of order one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Index
from stripfold.base.errors import InvalidInputError
from stripfold.solve.linear import Band
from stripfold.strip.model import NONE, Model

if TYPE_CHECKING:
    from stripfold.kernels.bending import Springs

Reaction = Callable[[Array], Array]
"""The floor's forces on the strip in a state, rho_a g L*; both of shape (n,)."""


class Effect(ABC):
    """A force that depends on the last accepted state.

    Effects are frozen: evaluation at a trial state does not change them, and :meth:`committed` returns a new one.
    Lengths in L*, forces per width in rho_a g L*.
    """

    model: Model
    step_dependent: ClassVar[bool] = False
    """Whether the force depends on the step size; such a force is not defined for a motion in time."""

    @abstractmethod
    def add(
        self, q: Array, force: Array, tangent: Band | None = None, growth: Array = NONE, columns: Array = NONE
    ) -> None:
        """Add the contribution to the residual, minus the force on the strip, and its derivatives.

        ``force``: shape (n,).  ``tangent``: in the model's band; None for the force alone.  ``growth``: derivatives of
        the logarithm of each element's length by k parameters, shape (k, n_elements); ``columns``, shape (k, n): what
        the force's derivatives by them are added to.  The unknowns stay, and so does the memory's place on the strip.
        """

    def force(self, q: Array) -> Array:
        """The contribution alone, shape (n,)."""
        force = np.zeros(self.model.size)
        self.add(q, force)
        return force

    def force_and_tangent(self, q: Array) -> tuple[Array, Band]:
        """The same and its derivative, in the model's band."""
        force, tangent = np.zeros(self.model.size), Band.zeros(self.model.size, self.model.pattern.width)
        self.add(q, force, tangent)
        return force, tangent

    @abstractmethod
    def committed(self, q: Array, reaction: Reaction) -> Self:
        """The effect after an accepted step to ``q``."""

    def on(self, before: Model, model: Model) -> Self:
        """The effect with its memory, on ``before``, on other elements of the same strip."""
        raise NotImplementedError(f"{type(self).__name__} stays on its elements")

    def carried_over(self, q: Array, model: Model) -> Self:
        """The effect in a state ``q`` on other elements, where its moments, if any, are held until :meth:`let_go`."""
        return self.on(self.model, model)

    def about_to_slide(self) -> Self:
        """The effect with the tangent of sliding where an element is about to slide."""
        return self

    def let_go(self, q: Array | None = None) -> Self:
        """The effect after a state was found with held moments: it resists what has moved since it was carried over.

        With the state ``q`` it does not, and its moments there are those that were held.
        """
        return self


@dataclass(frozen=True, eq=False)
class Directors:
    """The directors at both ends of each element; made once per mesh.

    ``unknowns``: shape (n_elements, 2 ends, n_points, 2 components): the unknowns of an element's directors, left end
    first.  The points are the corner nodes from bottom to top in the solid, the slope in the rod.  ``factor``: shape
    (n_elements, 2 ends, n_points): derivative of the director by them.  ``straight``: shape (2,): the director where
    all unknowns are zero.  ``length``: shape (n_elements,): reference length, L*.
    """

    unknowns: Index
    factor: Array
    straight: Array
    length: Array

    def turn(self, q: Array) -> Array:
        """Angle from the left to the right director of each element, rad, in (-pi, pi], shape (n_elements,)."""
        turns = kernels.bending.turns(self.unknowns, self.factor, self.straight, np.ascontiguousarray(q))
        return np.asarray(turns)


class ElementMoments(Effect):
    """A moment in each element that depends on its mean curvature: bending laws and bending friction."""

    directors: Directors

    def curvature(self, q: Array) -> Array:
        """Mean curvature of each element (rotation of the sections per reference length), 1/L*, (n_elements,)."""
        return self.directors.turn(q) / self.directors.length

    @abstractmethod
    def _moment(self, curvature: Array) -> tuple[Array, Array]:
        """The section's moment in each element and its derivative, shape (n_elements,) each."""

    @abstractmethod
    def _rate(self, curvature: Array, growth: Array) -> Array:
        """Derivative of the curvature that the moment depends on by k parameters, ``growth`` that of the lengths.

        Shape (k, n_elements): see :meth:`.Effect.add`.
        """

    def add(
        self, q: Array, force: Array, tangent: Band | None = None, growth: Array = NONE, columns: Array = NONE
    ) -> None:
        """Add ``sum over elements of moment * length * d kappa / dq``, and its derivatives."""
        d, curvature = self.directors, self.curvature(q)
        moment, modulus = self._moment(curvature)
        rate = modulus * self._rate(curvature, growth) if len(growth) else NONE
        kernels.bending.assemble(
            d.unknowns, d.factor, d.straight, d.length, np.ascontiguousarray(q), moment, modulus, rate,
            force, NONE if tangent is None else tangent.columns, self.model.pattern.width, columns,
        )  # fmt: skip


MOVE = 1e-6
"""Of the difference by which the last state is differentiated along the strip, L*."""


@dataclass(frozen=True, eq=False)
class Pull(Effect):
    """The paper's internal friction: adds ``k_f M (q - q_prev)`` to the residual, M the mass matrix of the model.

    Its effect on a branch depends on the step size (docs/physics.md, section 8).

    ``model``: the strip.  ``k_f``: force per displacement and mass, g/L*; >= 0.  ``q_prev``: the last accepted state,
    shape (model.size,).  ``before``: of a pull on other elements than those of that state: theirs, and its unknowns on
    them.  Raises InvalidInputError: ``k_f`` negative or not finite.
    """

    model: Model = field(repr=False)
    k_f: float
    q_prev: Array = field(repr=False)
    before: tuple[Model, Array] | None = field(default=None, repr=False)
    step_dependent: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.k_f < np.inf:
            raise InvalidInputError("k_f", self.k_f, "a finite number >= 0 (g/L*)")

    def add(
        self, q: Array, force: Array, tangent: Band | None = None, growth: Array = NONE, columns: Array = NONE
    ) -> None:
        """Add ``k_f M (q - q_prev)``, and its derivatives."""
        model, mass = self.model, self.model.mass
        force += self.k_f * (mass @ (q - self.q_prev))
        if tangent is not None:
            tangent.add(mass, self.k_f)
        if not len(growth):
            return
        before, q_prev = self.before or (model, self.q_prev)
        unknowns, stretched = model.element_unknowns, model.mass_rate(q - self.q_prev)
        for share, column in zip(growth, columns, strict=True):
            moves = np.append(0.0, np.cumsum(share * model.lengths))
            change = MOVE * np.interp(model.s, model.ends, moves)
            ahead, back = before.resampled(q_prev, np.append(model.s + change, model.s - change)).reshape(2, -1)
            by_length = np.bincount(unknowns.ravel(), (share[:, None] * stretched).ravel(), model.size)
            column += self.k_f * (by_length - mass @ ((ahead - back) / (2.0 * MOVE)))

    def on(self, before: Model, model: Model) -> Self:
        source = self.before or (before, self.q_prev)
        return replace(self, model=model, q_prev=source[0].resampled(source[1], model.s), before=source)

    def committed(self, q: Array, reaction: Reaction) -> Self:
        """The pull towards ``q``."""
        return replace(self, q_prev=q.copy(), before=None)

    def pulling_force(self, q: Array) -> float:
        """``integral of k_f |u - u_prev| ds`` over the mid-surface, rho_a g L*: an upper bound of the resultant."""
        middle = self.model.middle
        displacement = np.linalg.norm((q - self.q_prev)[middle], axis=1)
        # The weights of the mid-surface nodes are the integrals of their shape functions, as in the mass matrix: the
        # bound is exact.
        return self.k_f * float(self.model.weight[middle[:, 1]] @ displacement)


class MomentCurvature:
    """A law m(kappa), odd and monotone: a table interpolated by monotone cubics, straight on beyond its last interval.

    ``curvature``, ``moment``: shape (n,), n >= 2: 1/L* and rho_a g L*^2, positive and increasing; no moment without
    curvature is implied.  Raises InvalidInputError: numbers that are not finite, positive and increasing.
    """

    def __init__(self, curvature: Array, moment: Array) -> None:
        from scipy.interpolate import PchipInterpolator

        for name, values in (("curvature", curvature), ("moment", moment)):
            at = np.concatenate([[0.0], values])
            if len(curvature) < 2 or not np.all(np.isfinite(at)) or np.any(np.diff(at) <= 0.0):
                raise InvalidInputError(name, values, "at least two finite numbers, positive and increasing")
        self.rows = curvature, moment
        # One interval more on the straight line through the last one: its slope is that beyond the table.
        kappa, m = (np.append(values, 2.0 * values[-1] - values[-2]) for values in (curvature, moment))
        kappa, m = (np.concatenate([-values[::-1], [0.0], values]) for values in (kappa, m))
        self.end = float(kappa[-1])
        self._moment = PchipInterpolator(kappa, m)
        self._slope = self._moment.derivative()
        self._integral = self._moment.antiderivative()
        self._last = float(self._slope(self.end))

    def partly(self, share: float) -> MomentCurvature:
        """The law of which a share is this one's, and the rest that of a linear strip, m = kappa."""
        kappa, moment = self.rows
        return MomentCurvature(kappa, (1.0 - share) * kappa + share * moment)

    def moment(self, kappa: Array) -> Array:
        """m, shape as ``kappa``."""
        inside = np.clip(kappa, -self.end, self.end)
        return np.asarray(self._moment(inside) + self._last * (kappa - inside))

    def tangent(self, kappa: Array) -> Array:
        """dm/dkappa, positive."""
        return np.asarray(self._slope(np.clip(kappa, -self.end, self.end)))

    def energy(self, kappa: Array) -> Array:
        """Integral of m from 0."""
        inside = np.clip(kappa, -self.end, self.end)
        beyond = kappa - inside
        at_end = self._integral(inside) - self._integral(0.0)
        return np.asarray(at_end + beyond * (self._moment(inside) + 0.5 * self._last * beyond))


def split_loop(curvature: Array, loading: Array, unloading: Array) -> tuple[MomentCurvature, float]:
    """The law and the friction moment M_0 of :class:`.Hysteresis` that together have a measured loop.

    The law is the mean of the moments of bending and unbending at the same curvatures, shape (n,) each, M_0 half of
    their difference, averaged over the curvature: friction that does not depend on it.

    Raises InvalidInputError: the mean is no law, or unbending takes more moment than bending.
    """
    width = float(np.trapezoid(loading - unloading, curvature) / (curvature[-1] - curvature[0]))
    if width < 0.0:
        raise InvalidInputError("unloading", "more than loading", "moments below those of loading, on average")
    return MomentCurvature(curvature, 0.5 * (loading + unloading)), 0.5 * width


@dataclass(frozen=True, eq=False)
class BendingLaw(ElementMoments):
    """A moment ``m(kappa) - kappa`` in each element, without memory, beside the strip's own stiffness of one.

    In the solid the moment acts between sections, whose stress stays linear over the thickness.  The stretch of a bent
    section is that of the linear strip: for strips so thin that (h kappa)^2 is small beside dm/dkappa.  For statics: a
    motion in time would count its work as friction's.  Source: docs/physics.md, section 11.
    """

    model: Model = field(repr=False)
    law: MomentCurvature
    directors: Directors = field(repr=False)

    @classmethod
    def of(cls, model: Model, law: MomentCurvature) -> Self:
        """The law on a strip."""
        return cls(model, law, model.directors)

    def moments(self, q: Array) -> Array:
        """The strip's moment m(kappa) in each element, rho_a g L*^2, shape (n_elements,)."""
        return self.law.moment(self.curvature(q))

    def stored(self, q: Array) -> float:
        """What the law adds to the elastic energy, rho_a g L*^2 per width; may be negative."""
        kappa = self.curvature(q)
        return float(self.directors.length @ (self.law.energy(kappa) - 0.5 * kappa**2))

    def _moment(self, curvature: Array) -> tuple[Array, Array]:
        return self.law.moment(curvature) - curvature, self.law.tangent(curvature) - 1.0

    def _rate(self, curvature: Array, growth: Array) -> Array:
        return -curvature * growth

    def on(self, before: Model, model: Model) -> Self:
        return self.of(model, self.law)

    def committed(self, q: Array, reaction: Reaction) -> Self:
        return self


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
STIFFEST = 4.0
"""Largest stiffness of friction that sticks, in units of the bending stiffness: with a much larger one the elements,
each of which sticks or slides, decide whether a strip of real cloth, M_0 from 0.2 to 1.3, is followed."""
CELL = 0.005
"""Length of the fixed cells that keep kappa_p where elements move, L*."""


@dataclass(frozen=True, eq=False)
class Hysteresis(ElementMoments):
    """A moment ``m = M_0 / kappa_y * clip(kappa - kappa_p, -kappa_y, kappa_y)`` in each element; see :meth:`of`.

    The friction moment of Kawabata's bending test, by a Jenkins-Prandtl element: a spring in series with a slider
    (docs/physics.md, section 8).

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
        Curvatures of the springs and of the elements as they were carried over, 1/L*, shape (n_elements,) each, where
        the moments do not depend on the state; None where they do.
    """

    model: Model = field(repr=False)
    moment: float
    yield_curvature: float
    slip: Array = field(repr=False)
    dissipated: float
    directors: Directors = field(repr=False)
    cells: tuple[Array, Array] | None = field(default=None, repr=False)
    sticks_up_to: float = 1.0 + STICK_TOLERANCE
    held: tuple[Array, Array] | None = field(default=None, repr=False)

    @classmethod
    def of(
        cls, model: Model, moment: float, *, yield_curvature: float | None = None, slack: Array | None = None
    ) -> Self:
        """Friction with no moment in the flat state, or in the state ``slack``, shape (n,).

        ``yield_curvature``: by default :data:`YIELD_CURVATURE`, or more where the spring would be stiffer than
        :data:`STIFFEST`.

        The smaller ``yield_curvature``, the closer to dry friction, and the shorter the steps have to be: Newton's
        method converges for changes of two or three yield curvatures per step.

        Raises InvalidInputError: ``moment`` negative, ``yield_curvature`` not positive, or either not finite.
        """
        if not 0.0 <= moment < np.inf:
            raise InvalidInputError("moment", moment, "a finite number >= 0 (rho_a g L*^2)")
        if yield_curvature is None:
            yield_curvature = max(YIELD_CURVATURE, moment / STIFFEST)
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
            return self.held[0]
        return np.clip(curvature - self.slip, -self.yield_curvature, self.yield_curvature)

    def _moment(self, curvature: Array) -> tuple[Array, Array]:
        if self.held is not None:
            return self.stiffness * self.held[0], np.zeros_like(curvature)
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
        ends, size, (cells, integral) = self.model.ends, self.model.lengths, self._in_cells
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
        size = model.lengths
        # Where there are as many elements only their lengths differ.
        alike = len(model.lengths) == len(before.lengths)
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
        kept springs would stick and slide in turn; with the moments kept the state is found.
        """
        held = self._spring(self.curvature(q)), self.curvature(q)
        springs, curvature = (np.diff(integrals(self.model.ends, of, model.ends)) / model.lengths for of in held)
        springs = np.clip(springs, -self.yield_curvature, self.yield_curvature)
        lost = self.dissipated + self.dissipation(q)
        return replace(
            self, model=model, directors=model.directors, cells=None, held=(springs, curvature), dissipated=lost
        )

    def let_go(self, q: Array | None = None) -> Self:
        """The friction with the moments held no more."""
        if self.held is None:
            return self
        springs, curvature = self.held
        return replace(self, held=None, slip=(curvature if q is None else self.curvature(q)) - springs)

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
        return self.slip * self.model.lengths - np.diff(np.interp(self.model.ends, *self._in_cells))

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
