"""Distances between layers of a strip, for self-contact and its monitor.

All pairs of a node of the mid-surface and a segment between two neighbouring nodes that are far apart along the strip.
Where one of them lies within h of the floor, the floor stands in for contact of the layers (docs/effects.md).
Lengths in L*.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold.arrays import Array, Index, Mask

MIN_ARC_DISTANCE = 0.5
"""Arc length, L*, from which two places can be in contact. A strip bent to a circle that short has 12 times the moment
per length of its weight; folds have a quarter of it."""
MAX_GAP_RATE = 5.0
"""Largest decrease of a gap per displacement of all nodes: the two ends of the distance, and two smooth steps of slope
3/2 in the required distance."""


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of a node and a segment that can be in contact; made once per mesh.

    Attributes
    ----------
    thickness
        h, L*: the required distance of layers.
    separate
        Shape (columns, columns - 1), by node and segment: whether they are far apart along the strip.
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
        place, height = np.ascontiguousarray(position.T)
        along, up = np.diff(place), np.diff(height)
        middle = 0.5 * (height[:-1] + height[1:])
        x, z = place[:, None] - place[:-1], height[:, None] - height[:-1]
        crossed = self._crossed(along * z - up * x, np.flatnonzero(middle > 2.0 * self.thickness))
        # In place: these arrays are most of the cost.
        squared = along**2 + up**2
        foot = x * (along / squared)
        foot += z * (up / squared)
        np.clip(foot, 0.0, 1.0, out=foot)
        x -= foot * along
        z -= foot * up
        distance = np.sqrt(x * x + z * z)
        required = self.thickness * smooth_step(height, self.thickness)[:, None] * smooth_step(middle, self.thickness)
        low = 0.25 * self.thickness
        return Distances(self, distance, required, height <= low, middle <= low, crossed)

    def _crossed(self, side: Array, aloft: Index) -> bool:
        """Whether two of the segments ``aloft`` cross; ``side``: of which side of each segment each node is."""
        # The end points of each are on different sides of the other.
        parted = (side[aloft] * side[aloft + 1])[:, aloft] < 0.0
        one, other = np.nonzero(parted & parted.T)
        node, segment = aloft[one], aloft[other]
        return bool(np.any(self.separate[node, segment] & self.separate[node + 1, segment]))


@dataclass(frozen=True, eq=False)
class Distances:
    """Actual and required distances, L*, of shape (columns, columns - 1) by node and segment.

    ``nodes_on_floor``, ``segments_on_floor``: within h/4 of the floor, shapes (columns,), (columns - 1,);
    ``crossed``: layers have passed through each other.
    """

    pairs: Pairs
    distance: Array
    required: Array
    nodes_on_floor: Mask
    segments_on_floor: Mask
    crossed: bool

    @property
    def gap(self) -> float:
        """The smallest difference of distance and required distance, L*: negative in contact, -h after crossing."""
        if self.crossed:
            return -self.pairs.thickness
        aloft = self.pairs.separate & (self.required > 0.0)
        return float(np.min((self.distance - self.required)[aloft], initial=np.inf))

    @property
    def safe_displacement(self) -> float:
        """Displacement of all nodes, L*, up to which no contact is possible while :meth:`stays_on_floor` holds."""
        if self.crossed:
            return 0.0
        # The required distance never exceeds h, and is zero on the floor.
        bound = np.maximum((self.distance - self.required) / MAX_GAP_RATE, 0.5 * (self.distance - self.pairs.thickness))
        counts = self.pairs.separate & ~self.nodes_on_floor[:, None] & ~self.segments_on_floor
        return max(float(np.min(bound[counts], initial=np.inf)), 0.0)

    def stays_on_floor(self, height: Array) -> bool:
        """Whether all parts on the floor are within h of it with the nodes at these heights, L*, shape (columns,)."""
        middle = 0.5 * (height[:-1] + height[1:])
        highest = max(height[self.nodes_on_floor].max(initial=0.0), middle[self.segments_on_floor].max(initial=0.0))
        return bool(highest <= self.pairs.thickness)


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
