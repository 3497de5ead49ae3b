"""What scikit-fem supplies to a strip's mesh: shape functions and quadrature, turned to our unknowns.

Along the strip there is one Gauss point fewer than for full integration, where the membrane strain of a quadratic
element is accurate: no membrane locking however thin the strip.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stripfold.base.arrays import Array, Index, Mask
from stripfold.base.errors import InvalidInputError

if TYPE_CHECKING:
    import skfem

Distort = Callable[[Array], Array]
CORNERS = np.array([[0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]])
"""Of skfem's unit square, shape (2, 4)."""
STORED = Path(__file__).with_name("unit_elements.npz")
"""What :func:`unit_elements` computes for each kind: to import scikit-fem takes longer than many a run."""
KINDS = ((1, 2), (2, 1), (2, 2))
"""Order and elements across."""


def unit_elements(order: int, across: int) -> tuple[Array, ...]:
    """Integrals of the elements across a straight strip, of length and thickness one."""
    return tuple(a[:across] for a in integrals(np.arange(4.0), 1.0, order, across, None))


def store() -> None:
    """Compute :data:`STORED` anew: ``make starts``."""
    found = {f"{kind}{i}": a for kind in KINDS for i, a in enumerate(unit_elements(*kind))}
    np.savez(STORED, allow_pickle=False, **found)


@lru_cache(maxsize=16)
def unit_integrals(thickness: float, order: int, across: int) -> tuple[Array, Array, Array, Array]:
    """Those of the elements across a straight strip, of length one."""
    with np.load(STORED) as stored:
        gradients, weights, mass, gravity = (stored[f"{order, across}{i}"] for i in range(4))
    # Unknowns are displacements, but those relative to the middle of a column, which are divided by the thickness.
    node = order * np.arange(across)[:, None] + np.arange(order + 1)
    factor = np.tile(np.where(node == order * across // 2, 1.0, thickness), order + 1)
    gradients[:, :, 0] *= factor[:, None]
    factor = np.repeat(factor, 2, axis=1)
    mass *= factor[:, :, None] * factor[:, None]
    return gradients, thickness * weights, thickness * mass, thickness * factor * gravity


def integrals(
    ends: Array, thickness: float, order: int, across: int, distort: Distort | None
) -> tuple[Array, Array, Array, Array]:
    """Gradients, weights, masses and weights of gravity of all elements: the last four of :class:`.StripMesh`."""
    basis, full, nodal_of = bases(ends, thickness, order, across, distort)
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


def bases(
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
