"""Quadrilaterals of a strip's mesh integrated in our unknowns: shape functions, gradients, masses.

Along the strip there is one Gauss point fewer than for full integration, where the membrane strain of a quadratic
element is accurate: no membrane locking however thin the strip.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError

Distort = Callable[[Array], Array]
CORNERS = np.array([0.0, 0.0, 1.0, 1.0]), np.array([0.0, 1.0, 0.0, 1.0])
"""Of the unit square: along and across the strip."""


@lru_cache(maxsize=16)
def unit_integrals(thickness: float, order: int, across: int) -> tuple[Array, ...]:
    """Those of the elements across a straight strip, of length one."""
    return tuple(a[:across] for a in integrals(np.arange(2.0), thickness, order, across, None))


def integrals(
    ends: Array, thickness: float, order: int, across: int, distort: Distort | None
) -> tuple[Array, Array, Array, Array]:
    """Gradients, weights, masses and weights of gravity of all elements: the last four of :class:`.StripMesh`."""
    corners = _corners(ends, thickness, across, distort)
    # The weights are absolute values: an element inside out would count as if nothing were wrong.  Of a quadrilateral
    # with straight edges, the corners are the first that are.
    if np.ptp(np.sign(np.linalg.det(_jacobian(corners, *CORNERS)))) > 0.0:
        raise InvalidInputError("distort", distort, "a map that turns no part of an element inside out")
    x, z, weight = _tensor_rule(order, order + 1)
    jacobian = _jacobian(corners, x, z)
    _, derivatives = _functions(order, across, thickness, x, z)
    gradients = np.einsum("eqkJ,eqka->eqJa", np.linalg.inv(jacobian), np.tile(derivatives, (len(ends) - 1, 1, 1, 1)))
    weights = np.abs(np.linalg.det(jacobian)) * weight

    x, z, weight = _tensor_rule(order + 1, order + 1)
    values = np.tile(_functions(order, across, thickness, x, z)[0], (len(ends) - 1, 1, 1))
    per_length = np.abs(np.linalg.det(_jacobian(corners, x, z))) * weight / np.repeat(np.diff(ends), across)[:, None]
    # The two unknowns of a node have the same shape function, each for its own component.
    mass = np.kron(np.einsum("eq,eqa,eqb->eab", per_length, values, values, optimize=True), np.eye(2))
    gravity = np.kron(np.einsum("eq,eqa->ea", per_length, values), [0.0, 1.0])
    return np.ascontiguousarray(gradients), np.ascontiguousarray(weights), mass, gravity


def lagrange(order: int, t: Array) -> tuple[Array, Array]:
    """Polynomials of order 1 or 2 through equidistant nodes of [0, 1], and derivatives: shape (order + 1, *t.shape)."""
    if order == 1:
        return np.stack([1.0 - t, t]), np.stack([np.full_like(t, -1.0), np.ones_like(t)])
    return (
        np.stack([(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)]),
        np.stack([4.0 * t - 3.0, 4.0 - 8.0 * t, 4.0 * t - 1.0]),
    )


def _functions(order: int, across: int, thickness: float, x: Array, z: Array) -> tuple[Array, Array]:
    """Shape functions of our unknowns in the elements across a strip, and derivatives on the unit square.

    The middle node of a column carries the displacement of all of it: its function is that of the column, constant
    across the strip.  The others have the factor h.

    Returns
    -------
    values, derivatives
        Shape (across, n_points, nodes), and (across, n_points, 2, nodes): along and across.
    """
    (along, along_rate), (over, over_rate) = lagrange(order, x), lagrange(order, z)
    middle = order * across // 2 - order * np.arange(across)
    is_middle = np.arange(order + 1) == middle[:, None]
    over, over_rate = (
        np.where(is_middle[..., None], one, thickness * rows) for one, rows in ((1.0, over), (0.0, over_rate))
    )

    def product(a: Array, b: Array) -> Array:
        return np.asarray(np.einsum("aq,jbq->jqab", a, b).reshape(across, len(x), -1))

    return product(along, over), np.stack([product(along_rate, over), product(along, over_rate)], axis=2)


def _corners(ends: Array, thickness: float, across: int, distort: Distort | None) -> Array:
    """Corners of the elements, shape (n_elements, 2, 2, 2): along, across, coordinate."""
    levels = np.linspace(-thickness / 2.0, thickness / 2.0, across + 1)
    points = np.stack(np.meshgrid(ends - ends[-1] / 2.0, levels, indexing="ij"))
    if distort is not None:
        points = distort(points.reshape(2, -1)).reshape(points.shape)
    along = len(ends) - 1
    of = [points[:, i : along + i, j : across + j] for i in (0, 1) for j in (0, 1)]
    return np.stack(of).transpose(2, 3, 0, 1).reshape(-1, 2, 2, 2)


def _jacobian(corners: Array, x: Array, z: Array) -> Array:
    """Derivatives of the place by those on the unit square, shape (n_elements, n_points, 2, 2): ``[..., J, k]``."""
    (along, along_rate), (over, over_rate) = lagrange(1, x), lagrange(1, z)
    by = [np.einsum("aq,bq,eabJ->eqJ", *pair, corners) for pair in ((along_rate, over), (along, over_rate))]
    return np.stack(by, axis=-1)


def _tensor_rule(along: int, across: int) -> tuple[Array, Array, Array]:
    """Gauss rule on the unit square with different counts along and across the strip: places and weights."""
    x, wx = np.polynomial.legendre.leggauss(along)
    z, wz = np.polynomial.legendre.leggauss(across)
    return (
        np.repeat((x + 1) / 2, across),
        np.tile((z + 1) / 2, along),
        np.repeat(wx / 2, across) * np.tile(wz / 2, along),
    )
