"""The bend of each element: the angle between the sections at its two ends.

The director of a section is a vector that turns with it.  In the solid it is the vector across the section per
thickness, D = (-sin phi, cos phi) times the stretch, which is (0, 1) plus the difference of two relative unknowns
(:mod:`.strip_mesh`).  In the rod it is the tangent, (1, 0) plus the slopes.  No length of the strip is subtracted from
another, so the rounding error of an angle is that of numbers of order one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Index
from stripfold.strip.strip_mesh import StripMesh


@dataclass(frozen=True, eq=False)
class Directors:
    """The directors at both ends of each element; made once per mesh.  For straight meshes (no ``distort``).

    Attributes
    ----------
    unknowns
        Shape (n_elements, 2 ends, n_points, 2 components): the unknowns of an element's directors, left end first.
        The points are the corner nodes from bottom to top in the solid, the slope in the rod.
    factor
        Shape (n_elements, 2 ends, n_points): derivative of the director by them.  With two elements across, each
        spans half the section: its director is twice the vector from the mid-surface to the face.
    straight
        Shape (2,): the director where all unknowns are zero.
    length
        Shape (n_elements,): reference length, L*.
    across
        Number of elements across the thickness.
    """

    unknowns: Index
    factor: Array
    straight: Array
    length: Array
    across: int

    @classmethod
    def of(cls, mesh: StripMesh) -> Directors:
        # Within an element the unknowns ascend by column, node, component (see strip_mesh).
        nodes = round((mesh.element_unknowns.shape[1] // 2) ** 0.5)
        local = np.arange(2 * nodes**2).reshape(nodes, nodes, 2)[np.ix_([0, -1], [0, -1])]
        unknowns = np.ascontiguousarray(mesh.element_unknowns[:, local])
        nodes_across = mesh.unknowns.shape[1]
        across = (nodes_across - 1) // (nodes - 1)
        is_middle = np.isin(unknowns[..., 0], mesh.middle[:, 0])
        factor = np.where(is_middle, 0.0, across * np.array([-1.0, 1.0]))
        length = np.diff(mesh.s[unknowns[:, :, 0, 0] // (2 * nodes_across)], axis=1)[:, 0]
        return cls(unknowns, factor, np.array([0.0, 1.0]), length, across)

    def turn(self, q: Array) -> Array:
        """Angle from the left to the right director of each element, rad, in (-pi, pi], shape (n_elements,)."""
        turns = kernels.bending.turns(self.unknowns, self.factor, self.straight, np.ascontiguousarray(q))
        return np.asarray(turns)
