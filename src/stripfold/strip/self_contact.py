"""Self-contact above the floor: a frictionless penalty between nodes and segments of the mid-surface.

A pair is a node of the mid-surface and a segment between two neighbouring nodes, far apart along the strip.  Where one
of them lies within h of the floor, the floor stands in for contact of the layers.
The energy is ``stiffness/2 * sum of w <r - d>^2`` over nodes and segments, d their distance, r the required distance,
w the length of strip of a node, ``<x>`` the positive part. Over a time step the force is a discrete derivative
(Gonzalez, 1996) in the products of the difference vectors: its work is exactly the gain of that energy, and away from
the floor it conserves momentum and angular momentum.
Source: docs/effects.md. Lengths in L*, forces per width in rho_a g L*.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from stripfold import kernels
from stripfold.base.arrays import Array, Index, Mask
from stripfold.base.errors import NewtonError
from stripfold.strip.model import Model

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

Values = NDArray[Any]
"""Real, or complex with a derivative as the imaginary part."""
ForceAndTangent: TypeAlias = "tuple[Array, csc_matrix]"

MIN_ARC_DISTANCE = 0.5
"""Arc length, L*, from which two places can be in contact. A strip bent to a circle that short has 12 times the moment
per length of its weight; folds have a quarter of it."""
MAX_GAP_RATE = 5.0
"""Largest decrease of a gap per displacement of all nodes: the two ends of the distance, and two smooth steps of slope
3/2 in the required distance."""
BESIDE_FLOOR = 0.25
"""Height, over h, up to which a place is beside the floor."""
STIFFNESS = 100.0
"""Penalty times h^2: a layer that arrives at the speed v, in sqrt(g L*), penetrates by v h / 10."""
KEPT = 3
"""Number of states whose distances are kept."""
MIN_CHANGE = 1e-10
"""Change of a squared length, L*^2, below which a difference quotient is replaced by the derivative."""
COMPLEX_STEP = 1e-30
"""Imaginary step of a derivative that is exact to rounding."""


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of a node and a segment that can be in contact; made once per mesh.

    ``thickness``: h, L*: the required distance of layers.  ``before``, ``after``: shape (columns,): the segments before
    the one and from the other on are far away from a node along the strip.
    """

    thickness: float
    before: Index
    after: Index

    @classmethod
    def of(cls, s: Array, thickness: float) -> Pairs:
        """For nodes at the arc lengths ``s``, shape (columns,)."""
        reach = max(MIN_ARC_DISTANCE, 5.0 * thickness)
        before = np.maximum(np.searchsorted(s, s - reach) - 1, 0)
        return cls(thickness, before, np.searchsorted(s, s + reach, side="right"))

    def separate(self, node: Index, segment: Index) -> Mask:
        """Whether nodes and segments are far apart along the strip."""
        return np.asarray((segment < self.before[node]) | (segment >= self.after[node]))

    def measure(self, position: Array) -> Distances:
        """Distances in a state with the mid-surface ``position``, shape (columns, 2)."""
        return Distances(self, *np.ascontiguousarray(position.T))

    def in_contact(self, one: Distances, other: Distances) -> tuple[Index, Index]:
        """Nodes and segments in contact in one of two states, or with the required distance of the other."""
        found = kernels.contact.in_contact(
            one.place, one.height, other.place, other.height, self.before, self.after, self.thickness
        )
        return found[0], found[1]


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances in one state: ``place`` and ``height`` of the nodes, L*, shape (columns,)."""

    pairs: Pairs
    place: Array
    height: Array

    @cached_property
    def _middle(self) -> Array:
        return 0.5 * (self.height[:-1] + self.height[1:])

    @cached_property
    def _floor(self) -> tuple[Index, Index]:
        """Nodes and segments beside the floor: the required distance is zero."""
        low = BESIDE_FLOOR * self.pairs.thickness
        return np.flatnonzero(self.height <= low), np.flatnonzero(self._middle <= low)

    @cached_property
    def _clearance(self) -> tuple[float, float]:
        of = self.pairs
        gap, safe = kernels.contact.clearance(
            self.place, self.height, of.before, of.after, of.thickness, BESIDE_FLOOR * of.thickness, MAX_GAP_RATE
        )
        return float(gap), float(safe)

    @cached_property
    def crossed(self) -> bool:
        """Whether layers have passed through each other."""
        aloft = np.flatnonzero(self._middle > 2.0 * self.pairs.thickness)
        ends = np.stack([aloft, aloft + 1])[..., None]
        along, up = (np.diff(values)[aloft] for values in (self.place, self.height))
        # Of which side of each segment the ends of the others are: where two cross, on different sides of each other.
        side = along * (self.height[ends] - self.height[aloft]) - up * (self.place[ends] - self.place[aloft])
        parted = side[0] * side[1] < 0.0
        one, other = np.nonzero(parted & parted.T)
        node, segment = aloft[one], aloft[other]
        return bool(np.any(self.pairs.separate(node, segment) & self.pairs.separate(node + 1, segment)))

    @property
    def gap(self) -> float:
        """The smallest difference of distance and required distance, L*: negative in contact, -h after crossing."""
        return -self.pairs.thickness if self.crossed else self._clearance[0]

    @cached_property
    def safe_displacement(self) -> float:
        """Displacement of all nodes, L*, up to which no contact is possible while :meth:`stays_on_floor` holds."""
        return 0.0 if self.crossed else max(self._clearance[1], 0.0)

    def stays_on_floor(self, height: Array) -> bool:
        """Whether all parts on the floor are within h of it with the nodes at these heights, L*, shape (columns,)."""
        nodes, segments = self._floor
        middle = 0.5 * (height[segments] + height[segments + 1])
        return bool(max(height[nodes].max(initial=0.0), middle.max(initial=0.0)) <= self.pairs.thickness)


def smooth_step(height: Array, thickness: float) -> Array:
    """Factor of the required distance at a height: 0 up to h, 1 from 2 h, cubic between."""
    t = _step_parameter(height, thickness)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def smooth_step_slope(height: Array, thickness: float) -> Array:
    """Its derivative with respect to the height, 1/L*."""
    t = _step_parameter(height, thickness)
    return np.asarray(6.0 * t * (1.0 - t) / thickness)


def _step_parameter(height: Array, thickness: float) -> Array:
    # By `where` rather than `clip`, for complex numbers whose imaginary part is a derivative.
    t = height / thickness - 1.0
    return np.where(t.real < 0.0, 0.0, np.where(t.real > 1.0, 1.0, t))


@dataclass(frozen=True, eq=False)
class SelfContact:
    """Self-contact of a strip; make it with :meth:`of`.

    ``pairs``: pairs that can be in contact.  ``stiffness``: of the penalty, rho_a g per L* of penetration.  ``weight``:
    length of strip of each node, L*, shape (columns,).  ``spent``: computing time of each search and each force, s.
    """

    model: Model = field(repr=False)
    pairs: Pairs = field(repr=False)
    stiffness: float
    weight: Array = field(repr=False)
    spent: list[float] = field(default_factory=list, repr=False)
    _known: list[tuple[Array, Distances | None]] = field(default_factory=list, repr=False)
    """The last states asked for."""
    _last: list[tuple[Array, Distances]] = field(default_factory=list, repr=False)
    """The state searched last, and its distances."""

    @classmethod
    def of(cls, model: Model, thickness: float) -> SelfContact:
        """For layers of the thickness h, L*."""
        weight = np.gradient(model.s)
        weight[[0, -1]] *= 0.5
        return cls(model, Pairs.of(model.s, thickness), STIFFNESS / thickness**2, weight)

    def distances(self, q: Array) -> Distances | None:
        """Distances in a state; None, at the cost of a norm, if there can be no contact."""
        began = perf_counter()
        # A step asks for its two ends, and for a guess of the second in between.
        found = next((entry for entry in self._known if np.array_equal(entry[0], q)), None)
        if found is None:
            found = q.copy(), self._search(q)
            self._known.append(found)
            del self._known[:-KEPT]
        self.spent.append(perf_counter() - began)
        return found[1]

    def _search(self, q: Array) -> Distances | None:
        if any(self._is_clear(q, *last) for last in self._last):
            return None
        found = self.pairs.measure(self.model.mid_surface(q))
        self._last[:] = [(q.copy(), found)]
        return found

    def _is_clear(self, q: Array, state: Array, found: Distances) -> bool:
        """Whether a state is too near another one, with these distances, for any contact on the way between them."""
        on_floor = found.stays_on_floor(q[self.model.middle[:, 1]])
        return on_floor and self.model.largest_move(state, q) < found.safe_displacement

    def gap(self, q: Array) -> float:
        """The smallest gap, L*: negative in contact, infinite if there can be none."""
        found = self.distances(q)
        return np.inf if found is None else found.gap

    def energy(self, q: Array) -> float:
        """Energy of the penalty.

        Raises NewtonError: layers have passed through each other: the step was too long.
        """
        found = self.distances(q)
        if found is None:
            return 0.0
        if found.crossed:
            raise NewtonError("guard: layers went through each other", advice="take a smaller step")
        node, segment = self.pairs.in_contact(found, found)
        stored = pair_energy(self._positions(q, node, segment), self.pairs.thickness)
        return self.stiffness * float(self.weight[node] @ stored)

    def over_step(self, q0: Array, q1: Array) -> ForceAndTangent | None:
        """Contribution to the residual over a step, shape (n,), and its derivative by ``q1``; None without contact.

        Of a state, where both ends are the same array, gradient and Hessian of the energy.
        """
        pairs = self._pairs_in_contact(q0, q1)
        if pairs is None:
            return None
        began = perf_counter()
        node, segment = pairs
        columns = np.stack([node, segment, segment + 1], axis=1)
        unknowns = self.model.middle[columns].reshape(-1, 6)
        x0, x1 = (self._positions(q, node, segment) for q in (q0, q1))
        factor = (self.stiffness * self.weight[node])[:, None]
        h, n = self.pairs.thickness, self.model.size
        local = factor * pair_force(x0, x1, h)
        matrices = np.empty((len(node), 6, 6))
        for k in range(6):
            x = x1.astype(complex)
            x[:, k] += 1j * COMPLEX_STEP
            matrices[:, :, k] = factor * (pair_force(x if q0 is q1 else x0, x, h).imag / COMPLEX_STEP)
        force = np.bincount(unknowns.ravel(), local.ravel(), minlength=n).astype(float)
        rows, columns = np.repeat(unknowns, 6, axis=1), np.tile(unknowns, (1, 6))
        from scipy.sparse import csc_matrix

        tangent = csc_matrix((matrices.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n))
        self.spent.append(perf_counter() - began)
        return force, tangent

    def _pairs_in_contact(self, q0: Array, q1: Array) -> tuple[Index, Index] | None:
        """Nodes and segments in contact in one of two states, or with the required distance of the other."""
        end = self.distances(q1)
        begin = end if q0 is q1 else self.distances(q0)
        if begin is None and end is None:
            return None
        if (end and self._is_clear(q0, q1, end)) or (begin and self._is_clear(q1, q0, begin)):
            return None
        both = [f or self.pairs.measure(self.model.mid_surface(q)) for f, q in ((begin, q0), (end, q1))]
        node, segment = self.pairs.in_contact(*both)
        return (node, segment) if len(node) else None

    def _positions(self, q: Array, node: Index, segment: Index) -> Array:
        """Positions of nodes and of both ends of segments, shape (pairs, 6)."""
        return self.model.mid_surface(q)[np.stack([node, segment, segment + 1], axis=1)].reshape(-1, 6)


def pair_energy(x: Values, thickness: float) -> Values:
    """``<r - d>^2 / 2`` of a node and the two ends of a segment, positions x, z of each: shape (pairs, 6)."""
    return _energy(_squared_distance(_products(x))[0], _required(x, thickness)[0])


def pair_force(x0: Values, x1: Values, thickness: float) -> Values:
    """Discrete derivative of :func:`pair_energy` over a step, shape (pairs, 6); for equal states its derivative."""
    p0, p1 = _products(x0), _products(x1)
    # The chain rule for discrete derivatives: energy by squared distance u and required distance r, u by the products
    # p of the difference vectors, p by the positions. The products are quadratic: theirs is that at the midpoint.
    mean, change = 0.5 * (p0 + p1), p1 - p0
    (u0, _), (u1, _), (_, foot) = _squared_distance(p0), _squared_distance(p1), _squared_distance(mean)
    u_by_p = np.stack([np.ones_like(foot), -2.0 * foot, foot**2], axis=1)
    remainder = (u1 - u0) - np.sum(u_by_p * change, axis=1)
    correction = _difference_quotient(remainder, np.sum(change**2, axis=1), 0.0 * remainder, MIN_CHANGE**2)
    u_by_p = u_by_p + correction[:, None] * change
    (r0, height0), (r1, height1) = _required(x0, thickness), _required(x1, thickness)
    e00, e01, e10, e11 = (_energy(u, r) for u in (u0, u1) for r in (r0, r1))
    root = np.sqrt(0.5 * (u0 + u1))
    penetration = _positive_part(0.5 * (r0 + r1) - root)
    slope = -0.5 * penetration / np.where(root.real > 0.0, root, 1.0)
    e_by_u = _difference_quotient(0.5 * (e10 + e11 - e00 - e01), u1 - u0, slope, MIN_CHANGE)
    e_by_r = _difference_quotient(0.5 * (e01 + e11 - e00 - e10), r1 - r0, penetration, MIN_CHANGE)
    midpoint = 0.5 * (x0 + x1)
    a, b = midpoint[:, :2] - midpoint[:, 2:4], midpoint[:, 4:] - midpoint[:, 2:4]
    by_a = 2.0 * u_by_p[:, :1] * a + u_by_p[:, 1:2] * b
    by_b = u_by_p[:, 1:2] * a + 2.0 * u_by_p[:, 2:] * b
    force = e_by_u[:, None] * np.concatenate([by_a, -by_a - by_b, by_b], axis=1)
    # The required distance: h times the smooth steps of both heights.
    step0, step1 = smooth_step(height0, thickness), smooth_step(height1, thickness)
    slope = smooth_step_slope(0.5 * (height0 + height1), thickness)
    step_by_height = _difference_quotient(step1 - step0, height1 - height0, slope, MIN_CHANGE)
    by_height = thickness * e_by_r[:, None] * step_by_height * 0.5 * (step0 + step1)[:, ::-1]
    force[:, 1] += by_height[:, 0]
    force[:, 3] += 0.5 * by_height[:, 1]
    force[:, 5] += 0.5 * by_height[:, 1]
    return force


def _products(x: Values) -> Values:
    """a.a, a.b and b.b: a from the segment's first end to the node, b to its second end."""
    a, b = x[:, :2] - x[:, 2:4], x[:, 4:] - x[:, 2:4]
    return np.stack([np.sum(a * a, axis=1), np.sum(a * b, axis=1), np.sum(b * b, axis=1)], axis=1)


def _squared_distance(p: Values) -> tuple[Values, Values]:
    """The squared distance of node and segment, and the position of its foot along the segment, 0 to 1."""
    foot = p[:, 1] / p[:, 2]
    foot = np.where(foot.real < 0.0, 0.0, np.where(foot.real > 1.0, 1.0, foot))
    squared = p[:, 0] - 2.0 * foot * p[:, 1] + foot**2 * p[:, 2]
    # Of a node on the segment it may be rounded to less than 0.
    return np.where(squared.real > 0.0, squared, 0.0), foot


def _required(x: Values, thickness: float) -> tuple[Values, Values]:
    """The required distance, and the heights of the node and of the segment's middle, shape (pairs, 2)."""
    height = np.stack([x[:, 1], 0.5 * (x[:, 3] + x[:, 5])], axis=1)
    return thickness * np.prod(smooth_step(height, thickness), axis=1), height


def _energy(squared: Values, required: Values) -> Values:
    return 0.5 * _positive_part(required - np.sqrt(squared)) ** 2


def _positive_part(x: Values) -> Values:
    return np.where(x.real > 0.0, x, 0.0)


def _difference_quotient(difference: Values, change: Values, derivative: Values, least: float) -> Values:
    """``difference / change``, or the derivative where the change is too small."""
    large = np.abs(change.real) > least
    return np.where(large, difference / np.where(large, change, 1.0), derivative)
