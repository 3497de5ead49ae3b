"""Meshes whose element ends move with the ends of the contact with the floor.

Contact with the floor is a set of intervals of the strip; their ends are the contact coordinates.  Every element is a
fixed share of the free or lying part that it belongs to, so that a contact coordinate is always an element's end.
Lengths in L*, distances along the strip from the grasped end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from stripfold.arrays import Array, Index
from stripfold.models.model import Model
from stripfold.models.rod import Rod
from stripfold.models.solid import Solid

DRIFT = 1.6
"""Ratio of the elements' lengths to those planned at which a mesh is made anew."""


class Topology(Enum):
    """Where a strip lies, part by part from the grasped end: on the floor or not.

    ``LYING`` has one contact coordinate, the lift-off; ``POINT`` a point of the sag that touches as well; ``INTERVAL``
    the two ends of an upper layer that lies; ``FOLDED`` the end of an upper layer that lies from the grasped end on.
    """

    LYING = (False, True)
    POINT = (False, False, True)
    INTERVAL = (False, True, False, True)
    FOLDED = (True, False, True)

    @property
    def coordinates(self) -> int:
        """Number of contact coordinates."""
        return len(self.value) - 1


@dataclass(frozen=True)
class Sizes:
    """Element lengths.

    Attributes
    ----------
    free, lying
        Longest elements off the floor and on it, L*.
    at_contact
        Shortest elements, at the contact coordinates, L*; inf for none.
    growth
        Ratio of neighbouring elements away from there.
    least
        Smallest number of elements of a free part.
    """

    free: float
    lying: float
    at_contact: float = np.inf
    growth: float = 1.5
    least: int = 8

    def scaled(self, factor: float) -> Sizes:
        """All lengths times a factor."""
        growth = 1.0 + (self.growth - 1.0) * factor
        return Sizes(
            factor * self.free, factor * self.lying, factor * self.at_contact, growth, round(self.least / factor)
        )

    def shares(self, length: float, on_floor: bool, contacts: tuple[bool, bool]) -> Array:
        """Ends of the elements of a part, as shares of it from 0 to 1; ``contacts``: which ends are at a contact."""
        longest = self.lying if on_floor else min(self.free, length / self.least)
        shortest = min(self.at_contact, longest)
        left, right = (shortest if at_contact else longest for at_contact in contacts)
        front, back = [left], [right]
        while sum(front) + sum(back) < length:
            side = front if front[-1] <= back[-1] else back
            side.append(min(self.growth * side[-1], longest))
        lengths = np.array(front + back[::-1])
        return np.concatenate([[0.0], np.cumsum(lengths)]) / lengths.sum()


@dataclass(frozen=True, eq=False)
class ContactMesh:
    """Meshes of a strip for all values of its contact coordinates; make it with :meth:`of`.

    Attributes
    ----------
    topology
        Which parts lie.
    shares
        For each part the ends of its elements as shares of it.
    planned
        The contact coordinates for which it was planned.
    """

    length: float
    topology: Topology
    shares: tuple[Array, ...]
    planned: Array
    make: Callable[[Array], Model]

    @classmethod
    def of(cls, length: float, topology: Topology, contact: Array, sizes: Sizes, make: Callable[[Array], Model]) -> ContactMesh:
        """Plan a mesh for contact coordinates near ``contact``; ``make`` is the strip with given ends of elements."""
        parts = topology.value
        at = np.concatenate([[0.0], contact, [length]])
        shares = tuple(
            sizes.shares(float(at[i + 1] - at[i]), parts[i], (i > 0, i + 1 < len(parts))) for i in range(len(parts))
        )
        mesh = cls(length, topology, shares, contact, make)
        model = make(mesh.ends(contact))
        if isinstance(model, Solid):
            return cls(length, topology, shares, contact, model.with_ends)
        return mesh

    def ends(self, contact: Array) -> Array:
        """Ends of the elements, shape (n_elements + 1,)."""
        at = np.concatenate([[0.0], contact, [self.length]])
        parts = [at[i] + (at[i + 1] - at[i]) * share[:-1] for i, share in enumerate(self.shares)]
        return np.concatenate([*parts, [self.length]])

    def model(self, contact: Array) -> Model:
        """The strip with this contact."""
        return self.make(self.ends(contact))

    def drifted(self, contact: Array) -> bool:
        """Whether the elements are no longer as long as planned."""
        ratio = np.diff(contact, prepend=0.0) / np.diff(self.planned, prepend=0.0)
        return bool(np.any(ratio > DRIFT) or np.any(ratio * DRIFT < 1.0))

    @property
    def elements_at(self) -> Index:
        """Numbers of the element ends at the contact coordinates."""
        return np.cumsum([len(share) - 1 for share in self.shares])[:-1]

    @property
    def on_floor(self) -> Array:
        """Whether each element lies, shape (n_elements,)."""
        return np.concatenate([np.full(len(s) - 1, on) for s, on in zip(self.shares, self.topology.value, strict=True)])


def is_rod(model: Model) -> bool:
    """Whether the contact of this model holds slopes, too."""
    return isinstance(model, Rod)
