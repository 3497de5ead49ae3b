"""Distances between layers of a strip, for self-contact and its monitor.

All pairs of a node of the mid-surface and a segment between two neighbouring nodes that are far apart along the strip.
Where one of them lies within h of the floor, the floor stands in for contact of the layers (docs/effects.md).
Lengths in L*.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stripfold.base.arrays import Array, Index, Mask

MIN_ARC_DISTANCE = 0.5
"""Arc length, L*, from which two places can be in contact. A strip bent to a circle that short has 12 times the moment
per length of its weight; folds have a quarter of it."""
MAX_GAP_RATE = 5.0
"""Largest decrease of a gap per displacement of all nodes: the two ends of the distance, and two smooth steps of slope
3/2 in the required distance."""


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of a node and a segment that can be in contact; made once per mesh.

    ``thickness``: h, L*: the required distance of layers.  ``separate``: shape (columns, columns - 1), by node and
    segment: whether they are far apart along the strip.
    """

    thickness: float
    separate: Mask

    @classmethod
    def of(cls, s: Array, thickness: float) -> Pairs:
        """For nodes at the arc lengths ``s``, shape (columns,)."""
        distance = np.abs(s[:, None] - s)
        return cls(thickness, np.minimum(distance[:, :-1], distance[:, 1:]) > max(MIN_ARC_DISTANCE, 5.0 * thickness))

    def measure(self, position: Array) -> Distances:
        """Distances in a state with the mid-surface ``position``, shape (columns, 2)."""
        return Distances(self, *np.ascontiguousarray(position.T))

    def between(self, place: Array, height: Array, nodes: Index, segments: Index) -> tuple[Array, Array]:
        """Actual and required distances of some of the pairs, L*, shape (len(nodes), len(segments))."""
        along, up = (np.diff(values)[segments] for values in (place, height))
        x, z = place[nodes, None] - place[segments], height[nodes, None] - height[segments]
        # In place: these arrays are most of the cost.
        squared = along**2 + up**2
        foot = x * (along / squared)
        foot += z * (up / squared)
        np.clip(foot, 0.0, 1.0, out=foot)
        x -= foot * along
        z -= foot * up
        x *= x
        z *= z
        x += z
        middle = height[segments] + 0.5 * up
        steps = (smooth_step(values, self.thickness) for values in (height[nodes], middle))
        return np.sqrt(x, out=x), self.thickness * np.multiply.outer(*steps)


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances in one state: ``place`` and ``height`` of the nodes, L*, shape (columns,)."""

    pairs: Pairs
    place: Array
    height: Array

    @cached_property
    def everywhere(self) -> tuple[Array, Array]:
        """Actual and required distances of all pairs, L*, shape (columns, columns - 1) by node and segment."""
        columns = np.arange(len(self.height))
        return self.pairs.between(self.place, self.height, columns, columns[:-1])

    @cached_property
    def _middle(self) -> Array:
        return 0.5 * (self.height[:-1] + self.height[1:])

    @cached_property
    def _floor(self) -> tuple[Index, Index]:
        """Nodes and segments within h/4 of the floor: the required distance is zero."""
        low = 0.25 * self.pairs.thickness
        return np.flatnonzero(self.height <= low), np.flatnonzero(self._middle <= low)

    @cached_property
    def _aloft(self) -> tuple[Array, Array]:
        """Actual and required distances of the pairs off the floor that are far apart along the strip, shape (n,)."""
        (nodes, segments), columns = self._floor, np.arange(len(self.height))
        nodes, segments = np.delete(columns, nodes), np.delete(columns[:-1], segments)
        distance, required = self.pairs.between(self.place, self.height, nodes, segments)
        separate = self.pairs.separate[np.ix_(nodes, segments)]
        return distance[separate], required[separate]

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
        return bool(np.any(self.pairs.separate[node, segment] & self.pairs.separate[node + 1, segment]))

    @property
    def gap(self) -> float:
        """The smallest difference of distance and required distance, L*: negative in contact, -h after crossing."""
        if self.crossed:
            return -self.pairs.thickness
        distance, required = self._aloft
        return float(np.min((distance - required)[required > 0.0], initial=np.inf))

    @cached_property
    def safe_displacement(self) -> float:
        """Displacement of all nodes, L*, up to which no contact is possible while :meth:`stays_on_floor` holds."""
        if self.crossed:
            return 0.0
        distance, required = self._aloft
        # The required distance never exceeds h, and is zero on the floor.
        bound = np.maximum((distance - required) / MAX_GAP_RATE, 0.5 * (distance - self.pairs.thickness))
        return max(float(np.min(bound, initial=np.inf)), 0.0)

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
