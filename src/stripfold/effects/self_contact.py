"""Layers that meet above the floor: a frictionless penalty between nodes and segments of the mid-surface.

The energy is ``stiffness/2 * sum of w <r - d>^2`` over nodes and segments, ``d`` their distance, ``r`` how far apart
they have to be, ``w`` the length of strip a node stands for, ``<x>`` zero where x is negative.  Over a time step its
force is a discrete derivative (Gonzalez, 1996) in the products of the difference vectors: its work is the gain of that
energy exactly, and off the rim of the floor it changes neither momentum nor the moment of momentum.
Source: ``docs/effects.md``.  Lengths in L*, forces per width in rho_a g L*.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from stripfold.arrays import Array, Index
from stripfold.effects.proximity import Found, Pairs, rim, rim_slope
from stripfold.errors import NewtonError
from stripfold.models.model import Model
from stripfold.models.state_cache import StateCache

Values = NDArray[Any]
"""Real, or complex with a derivative as its imaginary part."""

STIFFNESS = 100.0
"""Penalty times h^2: a layer that arrives at the speed v goes in by v h / 10, v in sqrt(g L*)."""
TINY = 1e-10
"""A change of a squared length, L*^2, too small to divide by: there the derivative itself is taken."""
TURN = 1e-30
"""Imaginary step of a derivative."""


@dataclass(frozen=True, eq=False)
class SelfContact:
    """Real self-contact of a strip; make it with :meth:`of`.

    Attributes
    ----------
    model
        The strip it acts on.
    pairs
        What may meet.
    stiffness
        Of the penalty, rho_a g per L* of penetration.
    weight
        The length of strip that a node stands for, L*, shape (columns,).
    """

    model: Model = field(repr=False)
    pairs: Pairs = field(repr=False)
    stiffness: float
    weight: Array = field(repr=False)
    _clear: list[tuple[Array, Found, float]] = field(default_factory=list, repr=False)
    """A state, what was found in it, and how far from it no contact is possible: a bound, not a state of the strip."""
    spent: list[float] = field(default_factory=list, repr=False)
    """What each look at a state and each force took, s."""

    @classmethod
    def of(cls, model: Model, thickness: float, stiffness: float = STIFFNESS) -> SelfContact:
        """On a strip of a thickness h, L*, the penalty being ``stiffness`` / h^2."""
        weight = np.gradient(model.s)
        weight[[0, -1]] *= 0.5
        return cls(model, Pairs.of(model.s, thickness), stiffness / thickness**2, weight)

    def found(self, q: Array) -> Found | None:
        """All distances in a state; None, at next to no cost, where nothing can have come near since the last time."""
        began = perf_counter()
        found = self._looked(q)
        self.spent.append(perf_counter() - began)
        return found

    @cached_property
    def _looked(self) -> StateCache[Found | None]:
        return StateCache(self._look)

    def _look(self, q: Array) -> Found | None:
        if self._clear:
            at, then, free_move = self._clear[0]
            # The cheaper question first.
            if then.still_lies(q[self.model.middle[:, 1]]) and self.model.largest_move(at, q) < free_move:
                return None
        found = self.pairs.measure(self.model.mid_surface(q))
        self._clear[:] = [(q.copy(), found, found.free_move)]
        return found

    def gap(self, q: Array) -> float:
        """The smallest gap, L*: negative in contact, infinite where none can be."""
        found = self.found(q)
        return np.inf if found is None else found.gap

    def energy(self, q: Array) -> float:
        """Of the penalty.

        Raises
        ------
        NewtonError
            Layers have gone through each other: the step that led here was too long.
        """
        found = self.found(q)
        if found is None:
            return 0.0
        if found.crossed:
            raise NewtonError("guard: layers went through each other", advice="take a smaller step")
        deep = np.where(self.pairs.far, np.maximum(found.reach - found.distance, 0.0), 0.0)
        return 0.5 * self.stiffness * float(self.weight @ np.sum(deep**2, axis=1))

    def over_step(self, q0: Array, q1: Array) -> tuple[Array, sparse.csc_matrix] | None:
        """What is added to the residual over a step, shape (n,), and its derivative by ``q1``; None for nothing."""
        return self._force(q0, q1, frozen=True)

    def at(self, q: Array) -> tuple[Array, sparse.csc_matrix] | None:
        """What is added to the residual in a state, the energy's derivative, and its own; None for nothing."""
        return self._force(q, q, frozen=False)

    def _force(self, q0: Array, q1: Array, frozen: bool) -> tuple[Array, sparse.csc_matrix] | None:
        near = self._near(q0, q1)
        if near is None:
            return None
        began = perf_counter()
        done = self._assembled(near, q0, q1, frozen)
        self.spent.append(perf_counter() - began)
        return done

    def _near(self, q0: Array, q1: Array) -> tuple[Index, Index] | None:
        """Nodes and segments that are in contact at one of two states, or would be with the reach of the other."""
        end = self.found(q1)
        begin = end if q0 is q1 else self.found(q0)
        if begin is None and end is None:
            return None
        # One state clear and the other not: both are needed for a pair.
        measured = [f or self.pairs.measure(self.model.mid_surface(q)) for f, q in ((begin, q0), (end, q1))]
        distance = np.minimum(*(f.distance for f in measured))
        reach = np.maximum(*(f.reach for f in measured))
        node, segment = np.nonzero(self.pairs.far & (distance < reach))
        return (node, segment) if len(node) else None

    def _assembled(
        self, near: tuple[Index, Index], q0: Array, q1: Array, frozen: bool
    ) -> tuple[Array, sparse.csc_matrix]:
        node, segment = near
        columns = np.stack([node, segment, segment + 1], axis=1)
        unknowns = self.model.middle[columns].reshape(-1, 6)
        x0, x1 = (self.model.mid_surface(q)[columns].reshape(-1, 6) for q in (q0, q1))
        factor = (self.stiffness * self.weight[node])[:, None]
        h, n = self.pairs.thickness, self.model.size
        local = factor * pair_force(x0, x1, h)
        matrices = np.empty((len(node), 6, 6))
        for k in range(6):
            turned = x1.astype(complex)
            turned[:, k] += 1j * TURN
            matrices[:, :, k] = factor * (pair_force(x0 if frozen else turned, turned, h).imag / TURN)
        force = np.bincount(unknowns.ravel(), local.ravel(), minlength=n).astype(float)
        rows, columns = np.repeat(unknowns, 6, axis=1), np.tile(unknowns, (1, 6))
        return force, sparse.csc_matrix((matrices.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n))


def pair_energy(x: Values, thickness: float) -> Values:
    """``<r - d>^2 / 2`` of a node and the two ends of a segment, positions of shape (pairs, 6): x, z of each."""
    return _energy(_squared(_products(x))[0], _reach(x, thickness)[0])


def pair_force(x0: Values, x1: Values, thickness: float) -> Values:
    """Its discrete derivative over a step, shape (pairs, 6); with both states the same, its derivative."""
    p0, p1 = _products(x0), _products(x1)
    # The squared distance by the products of the difference vectors, which are quadratic: their own discrete derivative
    # is that halfway.
    mean, moved = 0.5 * (p0 + p1), p1 - p0
    (u0, _), (u1, _), (_, share) = _squared(p0), _squared(p1), _squared(mean)
    by_product = np.stack([np.ones_like(share), -2.0 * share, share**2], axis=1)
    length = np.sum(moved**2, axis=1)
    lacking = (u1 - u0) - np.sum(by_product * moved, axis=1)
    by_product = by_product + _quotient(lacking, length, 0.0 * lacking, TINY**2)[:, None] * moved
    (r0, low0), (r1, low1) = _reach(x0, thickness), _reach(x1, thickness)
    root, reach = np.sqrt(0.5 * (u0 + u1)), 0.5 * (r0 + r1)
    deep = np.where((reach - root).real > 0.0, reach - root, 0.0)
    by_distance = _quotient(
        0.5 * (_energy(u1, r0) + _energy(u1, r1) - _energy(u0, r0) - _energy(u0, r1)),
        u1 - u0,
        -0.5 * deep / np.where(root.real > 0.0, root, 1.0),
        TINY,
    )
    by_reach = _quotient(
        0.5 * (_energy(u0, r1) + _energy(u1, r1) - _energy(u0, r0) - _energy(u1, r0)), r1 - r0, deep, TINY
    )
    middle = 0.5 * (x0 + x1)
    a, b = middle[:, :2] - middle[:, 2:4], middle[:, 4:] - middle[:, 2:4]
    by_a = 2.0 * by_product[:, :1] * a + by_product[:, 1:2] * b
    by_b = by_product[:, 1:2] * a + 2.0 * by_product[:, 2:] * b
    force = by_distance[:, None] * np.concatenate([by_a, -by_a - by_b, by_b], axis=1)
    # The reach: the thickness times the two rims.
    rim0, rim1 = rim(low0, thickness), rim(low1, thickness)
    slope = _quotient(rim1 - rim0, low1 - low0, rim_slope(0.5 * (low0 + low1), thickness), TINY)
    by_low = thickness * by_reach[:, None] * slope * 0.5 * (rim0 + rim1)[:, ::-1]
    force[:, 1] += by_low[:, 0]
    force[:, 3] += 0.5 * by_low[:, 1]
    force[:, 5] += 0.5 * by_low[:, 1]
    return force


def _products(x: Values) -> Values:
    """a.a, a.b and b.b: a from the segment's first end to the node, b to its second end."""
    a, b = x[:, :2] - x[:, 2:4], x[:, 4:] - x[:, 2:4]
    return np.stack([np.sum(a * a, axis=1), np.sum(a * b, axis=1), np.sum(b * b, axis=1)], axis=1)


def _squared(p: Values) -> tuple[Values, Values]:
    """The squared distance of node and segment, and where along the segment its foot is, 0 to 1."""
    share = p[:, 1] / p[:, 2]
    share = np.where(share.real < 0.0, 0.0, np.where(share.real > 1.0, 1.0, share))
    return p[:, 0] - 2.0 * share * p[:, 1] + share**2 * p[:, 2], share


def _reach(x: Values, thickness: float) -> tuple[Values, Values]:
    """How far apart they have to be, and the heights of node and of the segment's middle, shape (pairs, 2)."""
    low = np.stack([x[:, 1], 0.5 * (x[:, 3] + x[:, 5])], axis=1)
    return thickness * np.prod(rim(low, thickness), axis=1), low


def _energy(squared: Values, reach: Values) -> Values:
    deep = reach - np.sqrt(squared)
    return 0.5 * np.where(deep.real > 0.0, deep, 0.0) ** 2


def _quotient(difference: Values, change: Values, instead: Values, least: float) -> Values:
    """``difference / change``, and ``instead`` where nothing changed."""
    moved = np.abs(change.real) > least
    return np.where(moved, difference / np.where(moved, change, 1.0), instead)
