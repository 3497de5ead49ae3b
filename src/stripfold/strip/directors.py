"""The bend of each element: the angle between the sections at its two ends.

The director of a section is a vector that turns with it.  In the solid it is the vector across the section per
thickness, D = (-sin phi, cos phi) times the stretch, which is (0, 1) plus the difference of two relative unknowns
(:mod:`.solid`).  In the rod it is the tangent, (1, 0) plus the slopes.  No length of the strip is subtracted from
another, so the rounding error of an angle is that of numbers of order one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Index


@dataclass(frozen=True, eq=False)
class Directors:
    """The directors at both ends of each element; made once per mesh.

    Attributes
    ----------
    unknowns
        Shape (n_elements, 2 ends, n_points, 2 components): the unknowns of an element's directors, left end first.
        The points are the corner nodes from bottom to top in the solid, the slope in the rod.
    factor
        Shape (n_elements, 2 ends, n_points): derivative of the director by them.
    straight
        Shape (2,): the director where all unknowns are zero.
    length
        Shape (n_elements,): reference length, L*.
    """

    unknowns: Index
    factor: Array
    straight: Array
    length: Array

    def turn(self, q: Array) -> Array:
        """Angle from the left to the right director of each element, rad, in (-pi, pi], shape (n_elements,)."""
        turns = kernels.bending.turns(self.unknowns, self.factor, self.straight, np.ascontiguousarray(q))
        return np.asarray(turns)
