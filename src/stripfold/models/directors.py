"""The bend of each element: the angle between the sections at its two ends, and its derivatives.

The director of a section is a vector that turns with it.  In the solid it is the vector across the section per
thickness, D = (-sin phi, cos phi) times the stretch, which is (0, 1) plus the difference of two relative unknowns
(:mod:`.strip_mesh`).  In the rod it is the tangent, (1, 0) plus the slopes.  No length of the strip is subtracted from
another, so the rounding error of an angle is that of numbers of order one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold.arrays import Array, Index
from stripfold.models.strip_mesh import StripMesh

END_SIGN = np.array([-1.0, 1.0])
"""An element's turn is the angle at its right end less that at its left."""


@dataclass(frozen=True, eq=False)
class Directors:
    """The directors at both ends of each element; made once per mesh.  For straight meshes (no ``distort``).

    Attributes
    ----------
    unknowns
        Shape (n_elements, 2 ends, n_points, 2 components): the unknowns of an element's directors, left end first.
        The points are the corner nodes from bottom to top in the solid, the slope in the rod.
    local
        Shape (4 n_points,): their positions among the element's own unknowns.
    n_local
        Number of these.
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
    local: Index
    n_local: int
    factor: Array
    straight: Array
    length: Array
    across: int

    @classmethod
    def of(cls, mesh: StripMesh) -> Directors:
        n_local = mesh.element_unknowns.shape[1]
        # Within an element the unknowns ascend by column, node, component (see strip_mesh).
        nodes = round((n_local // 2) ** 0.5)
        local = np.arange(n_local).reshape(nodes, nodes, 2)[np.ix_([0, -1], [0, -1])]
        unknowns = mesh.element_unknowns[:, local]
        nodes_across = mesh.unknowns.shape[1]
        across = (nodes_across - 1) // (nodes - 1)
        is_middle = np.isin(unknowns[..., 0], mesh.middle[:, 0])
        factor = np.where(is_middle, 0.0, across * np.array([-1.0, 1.0]))
        length = np.diff(mesh.s[unknowns[:, :, 0, 0] // (2 * nodes_across)], axis=1)[:, 0]
        return cls(unknowns, local.ravel(), n_local, factor, np.array([0.0, 1.0]), length, across)

    def at(self, q: Array) -> Array:
        """Shape (n_elements, 2 ends, 2 components)."""
        return np.asarray(np.einsum("eaf,eafi->eai", self.factor, q[self.unknowns]) + self.straight)

    def turn(self, directors: Array) -> Array:
        """Angle from the left to the right director of each element, rad, in (-pi, pi], shape (n_elements,).

        Between neighbours, not from angles with an axis: the number of turns of the strip is not limited.
        """
        left, right = directors[:, 0], directors[:, 1]
        return np.arctan2(left[:, 0] * right[:, 1] - left[:, 1] * right[:, 0], np.sum(left * right, axis=1))

    def gradient(self, directors: Array) -> Array:
        """Derivative of the turn by the unknowns ``local``, shape (n_elements, 4 n_points)."""
        x, z = directors[..., 0], directors[..., 1]
        by_director = np.stack([-z, x], axis=-1) * (END_SIGN / (x**2 + z**2))[..., None]
        return np.asarray((self.factor[..., None] * by_director[:, :, None, :]).reshape(len(directors), -1))

    def hessian(self, directors: Array) -> Array:
        """Second derivative of the turn, shape (n_elements, 4 n_points, 4 n_points); the two ends do not couple."""
        x, z = directors[..., 0], directors[..., 1]
        xz, difference = 2.0 * x * z, z**2 - x**2
        by_director = np.stack([np.stack([xz, difference], -1), np.stack([difference, -xz], -1)], -2)
        by_director *= (END_SIGN / (x**2 + z**2) ** 2)[..., None, None]
        n_points = self.factor.shape[2]
        out = np.zeros((len(directors), 2, n_points, 2, 2, n_points, 2))
        for end in (0, 1):
            f = self.factor[:, end]
            out[:, end, :, :, end, :, :] = np.einsum("ef,eg,eij->efigj", f, f, by_director[:, end])
        return out.reshape(len(directors), 4 * n_points, 4 * n_points)
