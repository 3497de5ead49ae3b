"""Element integrals of the rod and the solid: internal force and tangent, over a time step or in one state.

Both have strains that are quadratic in the unknowns and a stress that is linear in them, so one scheme serves both
(:func:`assemble`).  Entry (i, j) of a band matrix is at ``band[j, top + i - j]``.
"""

from __future__ import annotations

from typing import NamedTuple

import numba

from stripfold.base.arrays import Array, Index
from stripfold.kernels import rod, solid
from stripfold.kernels.compiler import compiled, matrix, vector


class Elements(NamedTuple):
    """The elements of a strip.

    Attributes
    ----------
    is_rod
        Which of the two models.
    unknowns
        Shape (n_elements, n_local).
    shape
        Rod: shape (1, 1, 7, 4), first derivatives of the cubics at the points of the membrane strain (3) and of the
        curvature (2), second derivatives at the latter (2), on an element of length one.
        Solid: shape (n_elements, POINTS, 2, NODES), gradients of the unknowns' shape functions.
    size
        Rod: shape (n_elements,), lengths.
    stiffness
        Rod: shape (2, 9), of each strain times its weight, per length of an element and times it.
        Solid: shape (n_elements, n_quadrature), quadrature weights.
    viscous
        Rod: shape (9,), weight of each strain in viscosity over its weight in energy.
    lam, mu
        Solid: Lame parameters.
    rest
        Stress of the flat strip, which by itself would be curled.  Rod: shape (9,), times its weight, of each strain.
        Solid: shape (n_quadrature,), along the strip.
    """

    is_rod: bool
    unknowns: Index
    shape: Array
    size: Array
    stiffness: Array
    viscous: Array
    lam: float
    mu: float
    rest: Array


elements_type = numba.types.NamedTuple(
    [
        numba.boolean,
        numba.int64[:, ::1],
        numba.float64[:, :, :, ::1],
        vector,
        matrix,
        vector,
        numba.float64,
        numba.float64,
        vector,
    ],
    Elements,
)


@compiled(
    numba.void(
        elements_type, vector, vector, numba.float64, numba.boolean, matrix, vector, matrix, numba.int64, matrix, matrix
    )
)
def assemble(el, q0, q1, kappa, in_state, predicted, force, band, top, growth, columns):
    """Add the internal force over a time step from ``q0`` to ``q1`` and its derivative by ``q1``.

    Parameters
    ----------
    el
        The elements.
    q0, q1, kappa
        Ends of the step, shape (n,), and viscosity: see :meth:`.Model.force_over_step`.
    in_state
        Force and tangent in the state ``q1``; ``q0`` must be the same, and ``kappa`` is not used.
    predicted
        Stress at ``q1`` for the tangent's geometric part, as :func:`predict` returns it; empty: that of the strain.
    force, band, top
        What is added to: shape (n,), and a band matrix of shape (n, height) or empty.
    growth, columns
        Derivatives of the logarithm of each element's length by k parameters, shape (k, n_elements), and what the
        derivatives of the force by them, with the unknowns fixed, are added to, shape (k, n).  Only of a state, with
        its tangent; otherwise k must be zero.
    """
    if el.is_rod:
        rod.assemble(el, q0, q1, kappa, in_state, predicted, force, band, top, growth, columns)
    else:
        solid.assemble(el, q0, q1, kappa, in_state, predicted, force, band, top, growth, columns)


@compiled(matrix(elements_type, vector, vector, vector))
def predict(el, q, dq, growth):
    """Stress at ``q + dq`` from the strain linearised at ``q``, without ``rest``: see :meth:`.Model.predict_stress`.

    ``growth``: change of each element's length as a share of it, shape (n_elements,); empty for none.
    Rod: times its weight, shape (n_elements, 9).  Solid: shape (n_elements, 4 n_quadrature), xx, xz, zx, zz.
    """
    if el.is_rod:
        return rod.predict(el, q, dq, growth)
    return solid.predict(el, q, dq, growth)


@compiled(numba.float64(elements_type, vector, vector, numba.boolean))
def distance(el, q0, q1, viscous):
    """Squared distance of two states in strain, weighted with the stiffness, or with the share of it in viscosity."""
    if el.is_rod:
        return rod.distance(el, q0, q1, viscous)
    return solid.distance(el, q0, q1)


@compiled(numba.float64(elements_type, vector))
def rest_energy(el, q):
    """Work of ``rest`` from the flat state on."""
    if el.is_rod:
        return rod.rest_energy(el, q)
    return solid.rest_energy(el, q)


@compiled(numba.float64(elements_type, vector))
def least(el, q):
    """Smallest membrane strain of the rod, smallest principal strain of the solid."""
    if el.is_rod:
        return rod.least(el, q)
    return solid.least(el, q)
