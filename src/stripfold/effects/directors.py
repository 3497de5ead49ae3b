"""How far each element is bent: the angle between the sections at its two ends, and its derivatives.

The director of a section is the vector across it per thickness, D = (-sin phi, cos phi) times the stretch.  A middle
node carries its displacement and the others theirs relative to it, per thickness (:mod:`..models.strip_mesh`), so D is
(0, 1) plus the difference of two relative unknowns: no length of the strip is subtracted from another, and the
rounding of an angle is that of numbers of the size of one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..models.strip_mesh import StripMesh

Array = NDArray[np.float64]
Index = NDArray[np.intp]

END_SIGN = np.array([-1.0, 1.0])
"""An element's turn is the angle at its right end less that at its left."""


@dataclass(frozen=True, eq=False)
class Directors:
    """The directors at both ends of each element; made once per mesh.  For straight meshes (no ``distort``).

    Attributes
    ----------
    unknowns
        Shape (n_elements, 2 ends, 2 faces, 2 components): the unknowns of an element's corner nodes; the ends from
        left to right, the faces from bottom to top.
    local
        Shape (8,): where they stand among the element's own unknowns.
    factor
        Shape (n_elements, 2 ends, 2 faces): derivative of the director by them.  With two elements across each has
        half the section for its own: its director is the vector from the mid-surface to the face, times two.
    length
        Shape (n_elements,): reference length, L*.
    across
        Number of elements across the thickness.
    """

    unknowns: Index
    local: Index
    factor: Array
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
        return cls(unknowns, local.ravel(), factor, length, across)

    def at(self, q: Array) -> Array:
        """Shape (n_elements, 2 ends, 2 components)."""
        d = np.einsum("eaf,eafi->eai", self.factor, q[self.unknowns])
        d[..., 1] += 1.0
        return d

    def turn(self, directors: Array) -> Array:
        """Angle from the left to the right director of each element, rad, in (-pi, pi], shape (n_elements,).

        Taken between neighbours, not as a difference of angles with an axis: a strip may turn as often as it likes.
        """
        left, right = directors[:, 0], directors[:, 1]
        return np.arctan2(left[:, 0] * right[:, 1] - left[:, 1] * right[:, 0], np.sum(left * right, axis=1))

    def gradient(self, directors: Array) -> Array:
        """Derivative of the turn by the corner unknowns, shape (n_elements, 8)."""
        x, z = directors[..., 0], directors[..., 1]
        by_director = np.stack([-z, x], axis=-1) * (END_SIGN / (x**2 + z**2))[..., None]
        return np.asarray((self.factor[..., None] * by_director[:, :, None, :]).reshape(-1, 8))

    def hessian(self, directors: Array) -> Array:
        """Second derivative of the turn, shape (n_elements, 8, 8); an angle's own at either end, no end with the
        other."""
        x, z = directors[..., 0], directors[..., 1]
        xz, difference = 2.0 * x * z, z**2 - x**2
        by_director = np.stack([np.stack([xz, difference], -1), np.stack([difference, -xz], -1)], -2)
        by_director *= (END_SIGN / (x**2 + z**2) ** 2)[..., None, None]
        out = np.zeros((len(directors), 2, 2, 2, 2, 2, 2))
        for end in (0, 1):
            f = self.factor[:, end]
            out[:, end, :, :, end, :, :] = np.einsum("ef,eg,eij->efigj", f, f, by_director[:, end])
        return out.reshape(-1, 8, 8)
