"""The strip as a two-dimensional nonlinear solid: the paper's finite-element model.

One row of biquadratic quadrilaterals of St Venant-Kirchhoff material, S = C : E, in plane strain, as the paper's Voigt
matrix with the strip's width held (:mod:`.reference` has the same as it reads on the page, and the printed law).
Along the strip there is one Gauss point fewer than for full integration, where the membrane strain of a quadratic
element is accurate: no membrane locking however thin the strip.

Unknowns are numbered column by column along the strip: the tangent is then a narrow band, and a banded factorisation is
four times faster than a general sparse one.  In a column the middle node carries its displacement and the other nodes
their displacement *relative to it*, divided by the thickness: with nodal displacements the rounding of large
displacements hides the change of a small thickness (``docs/method.md``).
Units: lengths in L*, forces per width in rho_a g L* (``docs/physics.md``, section 1): the bending stiffness is one.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Self

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Index
from stripfold.solve.linear import Band, BandPattern
from stripfold.strip.effects import Directors
from stripfold.strip.model import Model, lengths_of

if TYPE_CHECKING:
    from stripfold.kernels.elements import Elements

ALONG, ACROSS = 2, 3
"""Gauss points of an element along and across the strip."""


def gauss(count: int) -> tuple[Array, Array]:
    """Points and weights on the interval from 0 to 1."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 + 0.5 * points, 0.5 * weights


LEAST_STRAIN = -0.3
"""Principal strain at which a tenth of the law's stiffness in compression is left: at -1/3, where there is none, a bend
narrows to an element, and the finer the mesh the earlier a strip seems to snap."""
HEIGHT = np.tile(gauss(ACROSS)[0] - 0.5, ALONG)
"""Of the Gauss points over the middle of the section, over the thickness."""


def quadratics(t: Array) -> tuple[Array, Array]:
    """Lagrange's quadratics with nodes at 0, 1/2 and 1, and their derivatives, shape (n, 3) each."""
    value = np.stack([(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)], axis=1)
    return value, np.stack([4.0 * t - 3.0, 4.0 - 8.0 * t, 4.0 * t - 1.0], axis=1)


@lru_cache(maxsize=16)
def unit_element(thickness: float) -> tuple[Array, Array, Array, Array]:
    """Integrals of an element of length one and density one per area and thickness.

    Gradients of the unknowns' shape functions, shape (points, 2, 9); quadrature weights, (points,); mass matrix,
    (18, 18); derivative of the integral of the z displacement, (18,).  A point is a place along the strip, then across.
    """

    def across_strip(t: Array) -> tuple[Array, Array]:
        # The sum over a column is one, so that the middle node's unknown moves all of it.
        value, slope = quadratics(t)
        value, slope = thickness * value, slope.copy()
        value[:, 1], slope[:, 1] = 1.0, 0.0
        return value, slope

    (x, wx), (z, wz) = gauss(ALONG), gauss(ACROSS)
    (along, along_slope), (across, across_slope) = quadratics(x), across_strip(z)
    gradients = [np.einsum("pa,qb->pqab", *pair) for pair in ((along_slope, across), (along, across_slope))]
    full, w = gauss(3)
    (column, _), (node, _) = quadratics(full), across_strip(full)
    of_columns, of_nodes = ((values.T * w) @ values for values in (column, node))
    mass = np.kron(np.kron(of_columns, of_nodes), np.eye(2))
    weight = np.kron(np.kron(w @ column, w @ node), [0.0, 1.0])
    shape = np.stack([gradient.reshape(ALONG * ACROSS, 9) for gradient in gradients], axis=1)
    return shape, thickness * np.outer(wx, wz).ravel(), mass, weight


@lru_cache(maxsize=64)
def numbering(along: int, order: int, across: int) -> tuple[Index, Index, BandPattern]:
    """Number the unknowns of elements of an order.

    Of each column, node and component; of each element, those across the strip follow each other; and the pattern of
    their matrices.
    """
    columns, nodes = order * along + 1, order * across + 1
    unknowns = np.arange(columns * nodes * 2).reshape(columns, nodes, 2)
    column, node = (order * np.arange(n)[:, None] + np.arange(order + 1) for n in (along, across))
    of_elements = unknowns[column[:, None, :, None], node[None, :, None, :]].reshape(along * across, -1)
    return unknowns, of_elements, BandPattern.of(of_elements, unknowns.size)


@dataclass(frozen=True)
class Solid(Model):
    """A strip of St Venant-Kirchhoff material; make it with :meth:`of`.

    ``nu``: Poisson's ratio.  ``lengths``: of the elements, shape (n_elements,).
    ``curl``: curvature without forces, 1/L*.
    """

    length: float
    thickness: float
    nu: float
    lengths: Array = field(repr=False)
    curl: float = field(default=0.0, kw_only=True)

    @classmethod
    def of(
        cls, length: float, thickness: float, *, nu: float = 0.0, elements: int | Array = 200, curl: float = 0.0
    ) -> Self:
        """Discretise a strip; lengths in L*.

        ``elements``: number of elements along the strip, or their ends as distances from the grasped end, shape (m,).
        ``curl``: its curvature without forces, 1/L*.  Raises InvalidInputError: ends that cannot be used.
        """
        return cls(length, thickness, nu, lengths_of(length, elements), curl=curl)

    def with_lengths(self, lengths: Array) -> Solid:
        return Solid(self.length, self.thickness, self.nu, lengths, curl=self.curl)

    @property
    def _numbering(self) -> tuple[Index, Index, BandPattern]:
        return numbering(len(self.lengths), 2, 1)

    @property
    def unknowns(self) -> Index:
        """Number of each unknown, shape (columns, nodes across, 2)."""
        return self._numbering[0]

    @property
    def element_unknowns(self) -> Index:
        return self._numbering[1]

    @property
    def pattern(self) -> BandPattern:
        return self._numbering[2]

    @property
    def size(self) -> int:
        return int(self.unknowns.size)

    @property
    def _order(self) -> int:
        return (len(self.unknowns) - 1) // len(self.lengths)

    @cached_property
    def s(self) -> Array:
        order = self._order
        inside = self.ends[:-1, None] + self.lengths[:, None] * (np.arange(order) / order)
        return np.append(inside.ravel(), self.ends[-1])

    @cached_property
    def middle(self) -> Index:
        return np.ascontiguousarray(self.unknowns[:, self.unknowns.shape[1] // 2])

    @property
    def slopes(self) -> None:
        return None

    @property
    def lame(self) -> tuple[float, float]:
        """Lame parameters lambda and mu; the bending stiffness E h^3 / 12 (1 - nu^2) is one in these units."""
        young = 12.0 * (1.0 - self.nu**2) / self.thickness**3
        lam = young * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))
        return lam, young / (2.0 * (1.0 + self.nu))

    @cached_property
    def mass(self) -> Band:
        return self.pattern.assemble(self.lengths[:, None, None] * unit_element(self.thickness)[2])

    def mass_rate(self, q: Array) -> Array:
        return np.asarray(self.lengths[:, None] * (q[self.element_unknowns] @ unit_element(self.thickness)[2]))

    @property
    def element_weight(self) -> Array:
        return np.asarray(self.lengths[:, None] * unit_element(self.thickness)[3])

    @property
    def weight_rate(self) -> Array:
        return self.element_weight

    @property
    def directors(self) -> Directors:
        """The sections at the ends of each element, from the bottom to the top."""
        corners = self.element_unknowns.reshape(-1, 3, 3, 2)[:, ::2, ::2].copy()
        factor = np.broadcast_to([-1.0, 1.0], corners.shape[:3]).copy()
        return Directors(corners, factor, np.array([0.0, 1.0]), self.lengths)

    @cached_property
    def elements(self) -> Elements:
        gradients, weights, *_ = unit_element(self.thickness)
        lengths, none = self.lengths, np.zeros(0)
        shape = np.empty((len(lengths), *gradients.shape))
        shape[:, :, 0] = gradients[:, 0] / lengths[:, None, None]
        shape[:, :, 1] = gradients[:, 1]
        # Straightened, a curled section has a stress that grows with the height over its middle.
        rest = 12.0 * self.curl / self.thickness**2 * HEIGHT
        return kernels.elements.Elements(
            False, self.element_unknowns, shape, none, lengths[:, None] * weights, none, *self.lame, rest
        )

    @property
    def stress_shape(self) -> tuple[int, ...]:
        """Shape of a second Piola-Kirchhoff stress at the quadrature points."""
        return (len(self.lengths), ALONG * ACROSS, 2, 2)

    def admissibility(self, q: Array) -> str:
        """Not empty where the law has lost nearly all of its stiffness in compression."""
        least = self._least_strain(q)
        if least > LEAST_STRAIN:
            return ""
        found = f"its strain is {least:.3g}, least allowed is {LEAST_STRAIN}"
        return f"the solid is crushed: {found}: take the rod, which bends linearly"

    def _least_strain(self, q: Array) -> float:
        return float(kernels.elements.least(self.elements, np.ascontiguousarray(q)))

    def resampled_stress(self, q: Array, other: Self) -> Array:
        stress = self.predict_stress(q, np.zeros(self.size)).reshape(-1, ACROSS * 4)
        at, new_at = (
            (ends[:-1, None] + np.diff(ends)[:, None] * gauss(ALONG)[0]).ravel() for ends in (self.ends, other.ends)
        )
        moved = np.stack([np.interp(new_at, at, column) for column in stress.T], axis=1)
        return moved.reshape(other.stress_shape)

    def resampled(self, q: Array, s: Array) -> Array:
        ends, order = self.ends, self._order
        e = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, len(ends) - 2)
        t = (s - ends[e]) / (ends[e + 1] - ends[e])
        value = np.stack([1.0 - t, t], axis=1) if order == 1 else quadratics(t)[0]
        columns = q[self.unknowns].reshape(len(self.s), -1)
        # The unknowns are numbered by column.
        return np.asarray(np.einsum("ea,eai->ei", value, columns[order * e[:, None] + np.arange(order + 1)])).ravel()

    def unknowns_of(self, position: Array, angle: Array) -> Array:
        q = np.zeros(self.size)
        offset = np.linspace(-0.5, 0.5, self.unknowns.shape[1])
        normal = np.stack([-np.sin(angle), np.cos(angle) - 1.0], axis=1)
        q[self.unknowns] = offset[None, :, None] * normal[:, None, :]
        q[self.middle] = position
        q[self.middle[:, 0]] -= self.s - self.length / 2.0
        return q
