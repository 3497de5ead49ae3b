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
from typing import TYPE_CHECKING

import numpy as np

from stripfold.arrays import Array, Index, Mask
from stripfold.errors import InvalidInputError

if TYPE_CHECKING:
    import skfem

CORNERS = np.array([[0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]])
"""Of skfem's unit square, shape (2, 4)."""


@dataclass(frozen=True)
class StripMesh:
    """A strip of ``columns`` node columns; see :func:`build`.

    Attributes
    ----------
    basis
        scikit-fem basis (vector-valued) in scikit-fem's own numbering.
    nodal_of
        Shape (n_unknowns,): scikit-fem's number of the nodal displacement that sits at each of our unknowns.
    unknowns
        Shape (columns, nodes_across, 2): our number of each unknown.
    element_unknowns
        Shape (n_elements, unknowns_per_element): the unknowns each element touches, in our numbering.
    gradients
        Shape (n_elements, n_quadrature, 2, nodes_per_element): derivative of ``du_i/dX_J`` with respect to component i
        of each node's unknowns.
    weights
        Shape (n_elements, n_quadrature): quadrature weights times Jacobian.
    full
        The basis with a full rule, for mass and weight: with the other a pattern of alternating nodes had no mass.
    values
        Shape (n_elements, n_full_quadrature, unknowns_per_element, 2): derivative of the displacement, full rule.
    value_weights
        Shape (n_elements, n_full_quadrature): weights of the full rule.
    lifted
        Shape (n_elements, unknowns_per_element): integral of the z component of ``values``.
    s
        Shape (columns,): distance of each column from the grasped end in the reference configuration.
    """

    basis: skfem.Basis
    nodal_of: Index
    unknowns: Index
    element_unknowns: Index
    gradients: Array
    weights: Array
    full: skfem.Basis
    values: Array
    value_weights: Array
    lifted: Array
    s: Array
    thickness: float

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.unknowns.size)

    @property
    def middle(self) -> Index:
        """Shape (columns, 2): unknowns of the mid-surface nodes (their x and z displacement)."""
        return np.asarray(self.unknowns[:, self.unknowns.shape[1] // 2, :])

    def stretched(self, ends: Array) -> StripMesh:
        """This mesh, if straight, with elements that end elsewhere; ``basis`` and ``full`` stay those of the first."""
        order = (len(self.s) - 1) // (len(ends) - 1)
        size = ends[1:] - ends[:-1]
        factor = size / (self.s[order::order] - self.s[:-1:order])
        s = np.append((ends[:-1, None] + size[:, None] * (np.arange(order) / order)).ravel(), ends[-1])
        # Elements across the strip are neighbours in the numbering.
        factor = np.repeat(factor, len(self.weights) // len(factor))[:, None]
        gradients = self.gradients.copy()
        gradients[:, :, 0] /= factor[:, :, None]
        return StripMesh(
            self.basis,
            self.nodal_of,
            self.unknowns,
            self.element_unknowns,
            gradients,
            factor * self.weights,
            self.full,
            self.values,
            factor * self.value_weights,
            factor * self.lifted,
            s,
            self.thickness,
        )

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
    distort: Callable[[Array], Array] | None = None,
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
    import skfem

    elements_of = {1: skfem.ElementQuad1, 2: skfem.ElementQuad2}
    if order not in elements_of:
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
    mesh = skfem.MeshQuad.init_tensor(
        boundaries - length / 2.0, np.linspace(-thickness / 2.0, thickness / 2.0, across + 1)
    )
    element = skfem.ElementVector(elements_of[order]())
    rule = _tensor_rule(order, order + 1)
    basis = skfem.Basis(mesh, element, quadrature=rule)
    nodal_of, unknowns, s = _number(basis, order * across + 1)
    s = s + length / 2.0
    if distort is not None:
        basis = skfem.Basis(skfem.MeshQuad(distort(mesh.p), mesh.t), element, quadrature=rule)
    full = skfem.Basis(basis.mesh, element, quadrature=_tensor_rule(order + 1, order + 1))
    # The weights are absolute values: an element inside out would count as if nothing were wrong.  Of a quadrilateral
    # with straight edges, the corners are the first that are.
    if distort is not None and np.ptp(np.sign(basis.mapping.detDF(CORNERS))) > 0.0:
        raise InvalidInputError("distort", distort, "a map that turns no part of an element inside out")
    dofs, pick = _element_unknowns(basis, nodal_of)
    gradients = np.stack([np.asarray(b[0].grad).transpose(2, 3, 0, 1) for b in basis.basis], axis=2)
    values = np.stack([np.asarray(b[0].value).transpose(1, 2, 0) for b in full.basis], axis=2)
    gradients = np.take_along_axis(gradients, pick[:, None, :, None, None], axis=2)
    values = np.take_along_axis(values, pick[:, None, :, None], axis=2)
    middle = np.isin(dofs, unknowns[:, order * across // 2, :])
    gradients = _relative(gradients, middle, order, thickness)
    values = _relative(values, middle, order, thickness)
    # The two unknowns of a node have the same shape function, each for its own component.
    gradients = np.ascontiguousarray(gradients[:, :, ::2, 0].transpose(0, 1, 3, 2))
    weights, value_weights = np.ascontiguousarray(basis.dx), np.asarray(full.dx)
    lifted = np.einsum("eq,eqa->ea", value_weights, values[..., 1])
    return StripMesh(
        basis, nodal_of, unknowns, dofs, gradients, weights, full, values, value_weights, lifted, s, thickness
    )


def _tensor_rule(along: int, across: int) -> tuple[Array, Array]:
    """Gauss rule on the unit square with different counts along and across the strip."""
    x, wx = np.polynomial.legendre.leggauss(along)
    z, wz = np.polynomial.legendre.leggauss(across)
    # scikit-fem's tensor mesh runs its elements' first local axis across the strip (z), the second along it (x).
    points = np.stack([np.tile((z + 1) / 2, along), np.repeat((x + 1) / 2, across)])
    return points, np.tile(wz / 2, along) * np.repeat(wx / 2, across)


def _number(basis: skfem.Basis, nodes_across: int) -> tuple[Index, Index, Array]:
    """Number the unknowns by column, node, component: ``nodal_of``, ``unknowns`` and x of the columns."""
    x, z = basis.doflocs
    component = np.zeros(len(x), dtype=int)
    for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
        if dofs.size:
            component[dofs[1]] = 1
    # Equal columns differ by rounding only: compare them on a grid much finer than any element.
    column = np.unique(np.round(x / np.ptp(x) * 1e10), return_inverse=True)[1]
    nodal_of = np.lexsort((component, z, column))
    unknowns = np.arange(len(x)).reshape(-1, nodes_across, 2)
    return nodal_of, unknowns, x[nodal_of[unknowns[:, 0, 0]]]


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
