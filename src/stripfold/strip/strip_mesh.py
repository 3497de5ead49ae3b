"""The strip's mesh and the numbering of its unknowns.

Unknowns are numbered column by column along the strip: the tangent is then a narrow band, and a banded factorisation is
four times faster than a general sparse one.  In a column the middle node carries its displacement and the other nodes
their displacement *relative to it*, divided by the thickness: with nodal displacements the rounding of large
displacements hides the change of a small thickness (``docs/method.md``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import InvalidInputError
from stripfold.solve.linear import BandPattern
from stripfold.strip.element_integrals import Distort, integrals, unit_integrals


@dataclass(frozen=True)
class StripMesh:
    """A strip of ``columns`` node columns; see :func:`build`.

    Attributes
    ----------
    ends
        Shape (n_along + 1,): distance of the elements' ends from the grasped end.
    order, across, distort
        As in :func:`build`.
    unknowns
        Shape (columns, nodes_across, 2): our number of each unknown.
    element_unknowns
        Shape (n_elements, unknowns_per_element): the unknowns each element touches, in our numbering.  Elements across
        the strip follow each other.
    gradients
        Shape (n_elements, n_quadrature, 2, nodes_per_element): derivative of ``du_i/dX_J`` with respect to component i
        of each node's unknowns.
    weights
        Shape (n_elements, n_quadrature): quadrature weights times Jacobian.
    unit_mass
        Shape (n_elements, unknowns_per_element, unknowns_per_element): mass matrices for a density of one, per length.
    unit_weight
        Shape (n_elements, unknowns_per_element): derivative of the integral of the z displacement, per length.
    """

    ends: Array
    thickness: float
    order: int
    across: int
    distort: Distort | None
    unknowns: Index
    element_unknowns: Index
    gradients: Array
    weights: Array
    unit_mass: Array
    unit_weight: Array

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.unknowns.size)

    @property
    def lengths(self) -> Array:
        """Shape (n_elements,): of the elements, along the strip."""
        return np.repeat(np.diff(self.ends), self.across)

    @cached_property
    def s(self) -> Array:
        """Shape (columns,): distance of each column from the grasped end in the reference configuration."""
        left, size = self.ends[:-1, None], np.diff(self.ends)[:, None]
        return np.append((left + size * (np.arange(self.order) / self.order)).ravel(), self.ends[-1])

    @cached_property
    def middle(self) -> Index:
        """Shape (columns, 2): unknowns of the mid-surface nodes (their x and z displacement)."""
        return np.ascontiguousarray(self.unknowns[:, self.unknowns.shape[1] // 2, :])

    def stretched(self, ends: Array) -> StripMesh:
        """This mesh, if straight, with elements that end elsewhere."""
        factor = np.repeat((ends[1:] - ends[:-1]) / (self.ends[1:] - self.ends[:-1]), self.across)[:, None]
        gradients = self.gradients.copy()
        gradients[:, :, 0] /= factor[:, :, None]
        return StripMesh(
            ends,
            self.thickness,
            self.order,
            self.across,
            None,
            self.unknowns,
            self.element_unknowns,
            gradients,
            factor * self.weights,
            self.unit_mass,
            self.unit_weight,
        )


def build(
    length: float,
    thickness: float,
    *,
    order: int = 2,
    elements: int | Array = 200,
    across: int = 1,
    distort: Distort | None = None,
) -> StripMesh:
    """Mesh a strip that lies from x = -length/2 (grasped) to +length/2 (held), |z| <= thickness/2.

    ``length``, ``thickness``: in units of L*.  ``order``: 1 or 2: bilinear or biquadratic quadrilaterals.
    ``elements``: number of elements along the strip, or the element boundaries as distances from the grasped end, shape
    (m,).  ``across``: number of elements across the thickness; ``order * across`` must be even, so that the mid-surface
    has nodes.  ``distort``: map of the mesh's points, shape (2, n) to (2, n), for tests on distorted elements.  Raises
    InvalidInputError: order, counts or boundaries that cannot be used.
    """
    if order not in (1, 2):
        raise InvalidInputError("order", order, "1 or 2")
    if across not in (1, 2) or order * across % 2:
        raise InvalidInputError(
            "elements_across", across, "2, or 1 with order 2", "the mid-surface needs a row of nodes of its own"
        )
    boundaries = np.linspace(0.0, length, elements + 1) if np.ndim(elements) == 0 else np.asarray(elements, float)
    if len(boundaries) < 4 or np.any(np.diff(boundaries) <= 0.0):
        # Fewer make a matrix smaller than its band.
        raise InvalidInputError("elements", elements, "at least 3 elements, boundaries increasing")
    along = len(boundaries) - 1
    unknowns, element_unknowns, _ = numbering(along, order, across)
    if distort is not None:
        own = integrals(boundaries, thickness, order, across, distort)
        return StripMesh(boundaries, thickness, order, across, distort, unknowns, element_unknowns, *own)
    # All elements of a straight strip are alike but for their length.
    unit = (np.tile(a, (along, *(1,) * (a.ndim - 1))) for a in unit_integrals(thickness, order, across))
    ends = np.arange(along + 1.0)
    return StripMesh(ends, thickness, order, across, None, unknowns, element_unknowns, *unit).stretched(boundaries)


@lru_cache(maxsize=64)
def numbering(along: int, order: int, across: int) -> tuple[Index, Index, BandPattern]:
    """``unknowns`` and ``element_unknowns`` of :class:`StripMesh`, and the pattern of their matrices."""
    columns, nodes = order * along + 1, order * across + 1
    unknowns = np.arange(columns * nodes * 2).reshape(columns, nodes, 2)
    column, node = (order * np.arange(n)[:, None] + np.arange(order + 1) for n in (along, across))
    of_elements = unknowns[column[:, None, :, None], node[None, :, None, :]].reshape(along * across, -1)
    return unknowns, of_elements, BandPattern.of(of_elements, unknowns.size)
