"""Meshes whose element ends move with the ends of the contact with the floor.

Contact with the floor is a list of intervals and points of the strip; their ends are the contact coordinates, which
part the strip into free and lying parts.  Every element is a fixed share of its part, so that a contact coordinate is
always an element's end.
Lengths in L*, distances along the strip from the grasped end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from stripfold.base.arrays import Array, ByFields, Index, Mask
from stripfold.strip.model import Model

DRIFT, LYING_DRIFT = 1.25, 2.0
"""Ratio of the elements' lengths to those planned at which a mesh is planned anew, off the floor and on it."""


ONE = np.ones(1)
Topology = tuple[bool, ...]
"""Which parts of a strip lie, from the grasped end on: between two free ones the strip touches in a point."""
LYING, POINT = (False, True), (False, False, True)
"""A strip with one lift-off; and one whose sag touches in a point as well."""
INTERVAL, FOLDED = (False, True, False, True), (True, False, True)
"""A strip with an upper layer that lies; and one whose upper layer lies from the grasped end on."""


@dataclass(frozen=True)
class Sizes:
    """Element lengths.

    ``free``, ``lying``: longest elements off the floor and on it, L*.  ``at_contact``, ``at_end``: shortest ones at the
    contact coordinates and at the grasped end, L*; inf for none.  ``laid``: length of the last part that lies which may
    have been lifted, and laid down bent, L*: beyond, elements grow as they may.  ``growth``: ratio of neighbouring
    elements away from a contact.  ``least``: smallest number of elements of a part.
    """

    free: float
    lying: float
    at_contact: float = np.inf
    laid: float = np.inf
    growth: float = 1.5
    least: int = 8
    at_end: float = np.inf

    def scaled(self, factor: float) -> Sizes:
        """All lengths of elements times a factor."""
        return Sizes(
            factor * self.free,
            factor * self.lying,
            factor * self.at_contact,
            self.laid,
            self.growth**factor,
            max(round(self.least / factor), 3),
            factor * self.at_end,
        )

    def shares(self, length: float, on_floor: bool, contacts: tuple[bool, bool]) -> Array:
        """Lengths of the elements of a part, as shares of it; ``contacts``: which of its ends are at a contact.

        The first part is the one that has none on its left.
        """
        longest = self.lying if on_floor else self.free
        if not on_floor or self.at_contact < longest:
            longest = min(longest, length / self.least)
        shortest = (self.at_contact if contacts[0] else self.at_end, self.at_contact if contacts[1] else np.inf)
        sides = [[min(size, longest)] for size in shortest]
        grows = on_floor and contacts == (True, False) and self.laid < length
        if grows:
            # From the contact on to the held end.
            sides[1].clear()
        while (covered := sum(map(sum, sides))) < length:
            side = min(filter(None, sides), key=lambda side: side[-1])
            side.append(min(self.growth * side[-1], np.inf if grows and covered > self.laid else longest))
        lengths = np.array(sides[0] + sides[1][::-1])
        return lengths / lengths.sum()


@dataclass(frozen=True, eq=False)
class ContactMesh(ByFields):
    """Meshes of a strip for all values of its contact coordinates; make it with :meth:`of`.

    ``topology``: which parts lie.  ``planned``: the contact coordinates for which the elements have the planned sizes.
    ``shares``: for each part the lengths of its elements as shares of it.  ``model``: the strip with ``planned``.
    """

    length: float
    topology: Topology
    planned: Array
    sizes: Sizes
    make: Callable[[Array], Model] = field(repr=False)
    shares: tuple[Array, ...] = field(repr=False)
    model: Model = field(repr=False)

    @classmethod
    def of(
        cls, length: float, topology: Topology, contact: Array, sizes: Sizes, make: Callable[[Array], Model]
    ) -> ContactMesh:
        """Plan elements for contact coordinates near ``contact``; ``make`` is the strip with given ends of elements."""
        parts = np.diff(np.concatenate([[0.0], contact, [length]]))
        last = len(parts) - 1
        shares = tuple(sizes.shares(float(part), topology[i], (i > 0, i < last)) for i, part in enumerate(parts))
        return cls(length, topology, contact, sizes, make, shares, make(_ends(parts, shares)))

    def replanned(self, contact: Array, topology: Topology | None = None) -> ContactMesh:
        """The same strip with elements planned for other contact coordinates."""
        return ContactMesh.of(self.length, topology or self.topology, contact, self.sizes, self.make)

    def at(self, contact: Array) -> Model:
        """The strip with this contact."""
        return self.model.with_lengths(self.parts(contact)[self._part] * self._shares)

    def parts(self, contact: Array) -> Array:
        """Lengths of the parts, L*."""
        return np.asarray(contact @ self._sides + self._last)

    def growth(self, contact: Array) -> Array:
        """Derivatives of the logarithm of each element's length by the coordinates, (n_coordinates, n_elements)."""
        return np.take(self._sides / self.parts(contact), self._part, axis=1)

    def weight(self, contact: Array) -> tuple[Array, Array]:
        """Weight of what is off the floor, which carries that of what lies, and its derivatives by the coordinates.

        Shapes (n,) and (n, n_coordinates).
        """
        half = (np.concatenate([ONE, contact]) @ self._weights).reshape(len(contact) + 1, -1)
        return half[0] + contact @ half[1:], 2.0 * half[1:].T

    def _ratio(self, contact: Array) -> Array:
        """Lengths of the parts over those planned."""
        return self.parts(contact) / self.parts(self.planned)

    @cached_property
    def _weights(self) -> Array:
        """The weight as a quadratic form of one and the coordinates, shape (1 + n_coordinates, (1 + n_coordinates) n).

        The weight of a part grows with its length, the moments on the rod's slopes with the square of it: their
        derivative by the logarithm of the length is twice as large.
        """
        model, is_free = self.model, ~np.array(self.topology)[:, None]
        parts = np.where(is_free & (self._part == np.arange(len(self.shares))[:, None]), 1.0, 0.0)
        weight, rate = (np.stack([get(part) for part in parts]) for get in (model.weighted, model.weighted_rate))
        ratio = np.vstack([self._last, self._sides]) / self.parts(self.planned)
        linear = np.einsum("ap,b,pn->abn", ratio, np.eye(len(ratio))[0], 2.0 * weight - rate)
        form = np.einsum("ap,bp,pn->abn", ratio, ratio, rate - weight) + 0.5 * (linear + linear.transpose(1, 0, 2))
        return np.asarray(form.reshape(len(ratio), -1))

    def drifted(self, contact: Array) -> bool:
        """Whether the elements are no longer as long as planned."""
        ratio = self._ratio(contact)
        allowed = np.where(self.topology, LYING_DRIFT, DRIFT)
        return bool(np.any(ratio > allowed) or np.any(ratio * allowed < 1.0))

    @cached_property
    def _part(self) -> Index:
        """The part of each element, shape (n_elements,)."""
        return np.repeat(np.arange(len(self.shares)), [len(share) for share in self.shares])

    @cached_property
    def _shares(self) -> Array:
        """Length of each element as a share of its part, shape (n_elements,)."""
        return np.concatenate(self.shares)

    @cached_property
    def _sides(self) -> Array:
        """Derivatives of the parts' lengths by the contact coordinates, shape (n_coordinates, n_parts)."""
        count = len(self.planned)
        return np.eye(count, count + 1) - np.eye(count, count + 1, 1)

    @cached_property
    def _last(self) -> Array:
        """Lengths of the parts where all contact coordinates are zero."""
        return np.append(np.zeros(len(self.planned)), self.length)

    @cached_property
    def points(self) -> Mask:
        """Which contact coordinates are points between two free parts."""
        lies = np.array(self.topology)
        return np.asarray(~lies[:-1] & ~lies[1:])

    @cached_property
    def elements_at(self) -> Index:
        """Numbers of the element ends at the contact coordinates."""
        return np.cumsum([len(share) for share in self.shares])[:-1]

    @cached_property
    def on_floor(self) -> Mask:
        """Whether each element lies, shape (n_elements,)."""
        return np.concatenate([np.full(len(s), on) for s, on in zip(self.shares, self.topology, strict=True)])


def _ends(parts: Array, shares: tuple[Array, ...]) -> Array:
    """Ends of the elements, given the lengths of the parts and their shares of these."""
    return np.append(0.0, np.cumsum(np.concatenate([part * share for part, share in zip(parts, shares, strict=True)])))
