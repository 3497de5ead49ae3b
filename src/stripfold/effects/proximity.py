"""How near the parts of a mid-surface come to each other: what real self-contact and its monitor ask.

All pairs of a node and a segment between two neighbouring nodes that are far apart along the strip.  Where one of both
lies, within h of the floor, the floor stands in for the contact of layers (``docs/effects.md``).
Lengths in L*.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array

APART = 0.5
"""Arc length from which two places are no neighbours, L*: a strip bent to a circle that short has 12 times the moment
per length of its weight, and folds have a quarter of it."""
STEEPEST = 5.0
"""How much a gap can shrink per move of all nodes: two ends of a distance, and two rims of slope 3/2 that rise."""


@dataclass(frozen=True, eq=False)
class Pairs:
    """Which nodes and segments are no neighbours on a strip; made once per mesh.

    Attributes
    ----------
    thickness
        h, L*: how far apart layers have to be.
    far
        Shape (columns, columns - 1), of a node and a segment: whether they are far apart along the strip.
    """

    thickness: float
    far: NDArray[np.bool_]

    @classmethod
    def of(cls, s: Array, thickness: float) -> Pairs:
        """For nodes at the arc lengths ``s``, shape (columns,), of a strip of this thickness."""
        apart = max(APART, 5.0 * thickness)
        before, after = np.abs(s[:, None] - s[None, :-1]), np.abs(s[:, None] - s[None, 1:])
        return cls(thickness, np.minimum(before, after) > apart)

    def measure(self, position: Array) -> Found:
        """Distances in a state with the mid-surface ``position``, shape (columns, 2)."""
        begin, along = position[:-1], np.diff(position, axis=0)
        x = position[:, :1] - begin[:, 0]
        z = position[:, 1:] - begin[:, 1]
        share = np.clip((x * along[:, 0] + z * along[:, 1]) / np.sum(along**2, axis=1), 0.0, 1.0)
        distance = np.sqrt((x - share * along[:, 0]) ** 2 + (z - share * along[:, 1]) ** 2)
        side = along[:, 0] * z - along[:, 1] * x
        height = position[:, 1]
        middle = 0.5 * (height[:-1] + height[1:])
        # Two segments cross where the ends of each are on different sides of the other.
        parted = side[:-1] * side[1:] < 0.0
        aloft = middle > 2.0 * self.thickness
        crossed = parted & parted.T & self.far[:-1] & self.far[1:] & aloft & aloft[:, None]
        reach = self.thickness * rim(height, self.thickness)[:, None] * rim(middle, self.thickness)
        low = 0.25 * self.thickness
        lies = height <= low, middle <= low
        return Found(self, distance, reach, *lies, bool(crossed.any()))


@dataclass(frozen=True, eq=False)
class Found:
    """Distances of a node and a segment and how far apart they have to be, in L*, of shape (columns, columns - 1).

    ``nodes_lie``, ``segments_lie``: which of them are within h/4 of the floor, shapes (columns,), (columns - 1,);
    ``crossed`` where layers have gone through each other.
    """

    pairs: Pairs
    distance: Array
    reach: Array
    nodes_lie: NDArray[np.bool_]
    segments_lie: NDArray[np.bool_]
    crossed: bool

    @property
    def gap(self) -> float:
        """The smallest of distance less thickness, L*; negative in contact, -h where layers have crossed."""
        if self.crossed:
            return -self.pairs.thickness
        aloft = self.pairs.far & (self.reach > 0.0)
        return float(np.min((self.distance - self.reach)[aloft], initial=np.inf))

    @property
    def free_move(self) -> float:
        """How far all nodes can move from here without any two places coming into contact, L*.

        As long as what lies stays within the thickness of the floor (:meth:`still_lies`).
        """
        if self.crossed:
            return 0.0
        # Whatever the heights, no more than h is asked for; and of what lies, nothing.
        way = np.maximum((self.distance - self.reach) / STEEPEST, 0.5 * (self.distance - self.pairs.thickness))
        counts = self.pairs.far & ~self.nodes_lie[:, None] & ~self.segments_lie
        return max(float(np.min(way[counts], initial=np.inf)), 0.0)

    def still_lies(self, height: Array) -> bool:
        """Whether what lay is low enough to have no reach, with the nodes at these heights, L*, shape (columns,)."""
        middle = 0.5 * (height[:-1] + height[1:])
        highest = max(height[self.nodes_lie].max(initial=0.0), middle[self.segments_lie].max(initial=0.0))
        return bool(highest <= self.pairs.thickness)


def rim(height: Array, thickness: float) -> Array:
    """What part of the thickness counts at a height: none up to h, all from 2 h, smooth between."""
    share = height / thickness - 1.0
    # So written it serves complex numbers too, whose imaginary parts are derivatives.
    share = np.where(share.real < 0.0, 0.0, np.where(share.real > 1.0, 1.0, share))
    return np.asarray(share * share * (3.0 - 2.0 * share))


def rim_slope(height: Array, thickness: float) -> Array:
    """Its derivative by the height, 1/L*."""
    share = height / thickness - 1.0
    share = np.where(share.real < 0.0, 0.0, np.where(share.real > 1.0, 1.0, share))
    return np.asarray(6.0 * share * (1.0 - share) / thickness)
