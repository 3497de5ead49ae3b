"""The strip's mesh and the numbering of its unknowns.

scikit-fem supplies mesh, element and quadrature.  Three choices differ, for measured reasons:

* unknowns are numbered column by column along the strip: the tangent is then a narrow band, and a banded
  factorisation is four times faster than a general sparse one;
* in a column the middle node carries its displacement and the other nodes their displacement *relative to it*,
  divided by the thickness: with nodal displacements the rounding of large displacements hides the change of a small
  thickness (``docs/method.md``);
* along the strip there is one Gauss point fewer than for full integration, where the membrane strain of a quadratic
  element is accurate: no membrane locking however thin the strip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from stripfold.arrays import Array, Index, Mask
from stripfold.errors import InvalidInputError
from stripfold.solve.linear import BandPattern

if TYPE_CHECKING:
    import skfem

Distort = Callable[[Array], Array]
CORNERS = np.array([[0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]])
"""Of skfem's unit square, shape (2, 4)."""


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

    @property
    def middle(self) -> Index:
        """Shape (columns, 2): unknowns of the mid-surface nodes (their x and z displacement)."""
        return np.asarray(self.unknowns[:, self.unknowns.shape[1] // 2, :])

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

    @cached_property
    def _bases(self) -> tuple[skfem.Basis, skfem.Basis, Index]:
        return _bases(self.ends, self.thickness, self.order, self.across, self.distort)

    @property
    def basis(self) -> skfem.Basis:
        """scikit-fem basis (vector-valued) in scikit-fem's own numbering."""
        return self._bases[0]

    @property
    def full(self) -> skfem.Basis:
        """With a full rule, for mass and weight: with the other a pattern of alternating nodes had no mass."""
        return self._bases[1]

    @property
    def nodal_of(self) -> Index:
        """Shape (n_unknowns,): scikit-fem's number of the nodal displacement that sits at each of our unknowns."""
        return self._bases[2]

    def to_nodal(self, q: Array) -> Array:
        """Nodal displacements in scikit-fem's numbering, shape (n,), from the unknowns ``q``, shape (n,)."""
        across = self.unknowns.shape[1]
        columns = q[self.unknowns]
        nodal = columns[:, across // 2, None, :] + self.thickness * columns
        nodal[:, across // 2, :] = columns[:, across // 2, :]
        out = np.empty_like(q)
        out[self.nodal_of[self.unknowns]] = nodal
        return out


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

    Parameters
    ----------
    length, thickness
        In units of L*.
    order
        1 or 2: bilinear or biquadratic quadrilaterals.
    elements
        Number of elements along the strip, or the element boundaries as distances from the grasped end, shape (m,).
    across
        Number of elements across the thickness; ``order * across`` must be even, so that the mid-surface has nodes.
    distort
        Map of the mesh's points, shape (2, n) to (2, n), for tests on distorted elements.

    Raises
    ------
    InvalidInputError
        Order, counts or boundaries that cannot be used.
    """
    if order not in (1, 2):
        raise InvalidInputError("order", order, "1 or 2")
    if across not in (1, 2) or order * across % 2:
        raise InvalidInputError(
            "elements_across",
            across,
            "2, or 1 with order 2",
            "the mid-surface needs a row of nodes of its own",
        )
    boundaries = np.linspace(0.0, length, elements + 1) if np.ndim(elements) == 0 else np.asarray(elements, float)
    if len(boundaries) < 4 or np.any(np.diff(boundaries) <= 0.0):
        # Fewer make a matrix smaller than its band.
        raise InvalidInputError("elements", elements, "at least 3 elements, boundaries increasing")
    along = len(boundaries) - 1
    unknowns, element_unknowns, _ = numbering(along, order, across)
    if distort is not None:
        integrals = _integrals(boundaries, thickness, order, across, distort)
        return StripMesh(boundaries, thickness, order, across, distort, unknowns, element_unknowns, *integrals)
    # All elements of a straight strip are alike but for their length.
    unit = (np.tile(a, (along, *(1,) * (a.ndim - 1))) for a in _unit_integrals(thickness, order, across))
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


@lru_cache(maxsize=16)
def _unit_integrals(thickness: float, order: int, across: int) -> tuple[Array, ...]:
    """Those of the elements across a straight strip, of length one."""
    return tuple(a[:across] for a in _integrals(np.arange(4.0), thickness, order, across, None))


def _integrals(
    ends: Array, thickness: float, order: int, across: int, distort: Distort | None
) -> tuple[Array, Array, Array, Array]:
    """The last four of :class:`StripMesh`."""
    basis, full, nodal_of = _bases(ends, thickness, order, across, distort)
    # The weights are absolute values: an element inside out would count as if nothing were wrong.  Of a quadrilateral
    # with straight edges, the corners are the first that are.
    if distort is not None and np.ptp(np.sign(basis.mapping.detDF(CORNERS))) > 0.0:
        raise InvalidInputError("distort", distort, "a map that turns no part of an element inside out")
    dofs, pick = _element_unknowns(basis, nodal_of)
    gradients = np.stack([np.asarray(b[0].grad).transpose(2, 3, 0, 1) for b in basis.basis], axis=2)
    values = np.stack([np.asarray(b[0].value).transpose(1, 2, 0) for b in full.basis], axis=2)
    gradients = np.take_along_axis(gradients, pick[:, None, :, None, None], axis=2)
    values = np.take_along_axis(values, pick[:, None, :, None], axis=2)
    nodes = order * across + 1
    middle = dofs // 2 % nodes == nodes // 2
    gradients = _relative(gradients, middle, order, thickness)
    values = _relative(values, middle, order, thickness)
    # The two unknowns of a node have the same shape function, each for its own component.
    gradients = np.ascontiguousarray(gradients[:, :, ::2, 0].transpose(0, 1, 3, 2))
    per_length = np.asarray(full.dx) / np.repeat(np.diff(ends), across)[:, None]
    mass = np.einsum("eq,eqai,eqbi->eab", per_length, values, values, optimize=True)
    weight = np.einsum("eq,eqa->ea", per_length, values[..., 1])
    return gradients, np.ascontiguousarray(basis.dx), mass, weight


def _bases(
    ends: Array, thickness: float, order: int, across: int, distort: Distort | None
) -> tuple[skfem.Basis, skfem.Basis, Index]:
    """scikit-fem's bases with the reduced and the full rule, and its numbers of our unknowns."""
    import skfem

    elements = {1: skfem.ElementQuad1, 2: skfem.ElementQuad2}
    mesh = skfem.MeshQuad.init_tensor(ends - ends[-1] / 2.0, np.linspace(-thickness / 2.0, thickness / 2.0, across + 1))
    element, rule = skfem.ElementVector(elements[order]()), _tensor_rule(order, order + 1)
    basis = skfem.Basis(mesh, element, quadrature=rule)
    nodal_of = _number(basis)
    if distort is not None:
        basis = skfem.Basis(skfem.MeshQuad(distort(mesh.p), mesh.t), element, quadrature=rule)
    return basis, skfem.Basis(basis.mesh, element, quadrature=_tensor_rule(order + 1, order + 1)), nodal_of


def _tensor_rule(along: int, across: int) -> tuple[Array, Array]:
    """Gauss rule on the unit square with different counts along and across the strip."""
    x, wx = np.polynomial.legendre.leggauss(along)
    z, wz = np.polynomial.legendre.leggauss(across)
    # scikit-fem's tensor mesh runs its elements' first local axis across the strip (z), the second along it (x).
    points = np.stack([np.tile((z + 1) / 2, along), np.repeat((x + 1) / 2, across)])
    return points, np.tile(wz / 2, along) * np.repeat(wx / 2, across)


def _number(basis: skfem.Basis) -> Index:
    """Scikit-fem's numbers of our unknowns, which are numbered by column, node, component."""
    x, z = basis.doflocs
    component = np.zeros(len(x), dtype=int)
    for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
        if dofs.size:
            component[dofs[1]] = 1
    # Equal columns differ by rounding only: compare them on a grid much finer than any element.
    column = np.unique(np.round(x / np.ptp(x) * 1e10), return_inverse=True)[1]
    return np.lexsort((component, z, column))


def _element_unknowns(basis: skfem.Basis, nodal_of: Index) -> tuple[Index, Index]:
    """Unknowns of each element in ascending order, and the local numbers that put them there."""
    ours = np.empty_like(nodal_of)
    ours[nodal_of] = np.arange(len(nodal_of))
    dofs = ours[np.asarray(basis.element_dofs).T]
    pick = np.argsort(dofs, axis=1)
    return np.take_along_axis(dofs, pick, axis=1), pick


def _relative(derivative: Array, middle: Mask, order: int, thickness: float) -> Array:
    """Turn derivatives by nodal displacements into derivatives by our unknowns.

    ``derivative`` has shape (n_elements, n_quadrature, unknowns_per_element, ...).  Within an element the unknowns of
    one column are contiguous: the middle node's takes the sum over the column, the others the factor h.
    """
    n_elements, n_quadrature, n_local = derivative.shape[:3]
    columns, nodes = order + 1, order + 1
    shape = (n_elements, n_quadrature, columns, nodes, 2, *derivative.shape[3:])
    by_node = derivative.reshape(shape)
    out = thickness * by_node
    total = by_node.sum(axis=3, keepdims=True)
    # The shape functions of a column add up to one across the strip: what differs from zero there is rounding,
    # which the division by a small thickness would blow up.
    total[np.abs(total) < 1e-11 * np.abs(by_node).max()] = 0.0
    is_middle = middle.reshape(n_elements, 1, columns, nodes, 2, *([1] * (derivative.ndim - 3)))
    out = np.where(is_middle, total, out)
    return out.reshape(n_elements, n_quadrature, n_local, *derivative.shape[3:])
