"""The strip as a planar rod that bends and stretches: the fast model beside the solid.

A cubic (Hermite) mid-line with a continuous slope, without shear.  Its strains are at most quadratic in the unknowns,
as the energy-momentum step and :meth:`Rod.predict_stress` require::

    eps = (r'.r' - 1) / 2,    kappa = r' x r'',    energy = integral of (12 eps^2 / h^2 + B) / 2 ds,
    B = 3/4 kappa^2 + 1/4 r''.r''

(a prime is d/ds, x the plane's cross product).  12 / h^2 is the membrane stiffness in plane strain beside a bending
stiffness of one.  Both bending terms are theta'^2, theta the slope's angle, in a strip that does not stretch; with a
stretch kappa^2 is theta'^2 (1 + 4 eps) and r''.r'' is theta'^2 (1 + 2 eps).  Their shares are :data:`BENDING`.
Units: lengths in L*, forces per width in rho_a g L*.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Index
from stripfold.solve.linear import Band, BandPattern
from stripfold.strip.effects import Directors
from stripfold.strip.model import Model, lengths_of

if TYPE_CHECKING:
    from stripfold.kernels.elements import Elements

AT_STRETCH, W_STRETCH = np.array([0.0, 0.5, 1.0]), np.array([1.0, 4.0, 1.0]) / 6.0
"""Simpson's points for the membrane strain.

As many constraints as a thin strip's slope can meet, so no locking; with Gauss's two points the tangential slopes have
a mode that no strain sees (``docs/method.md``).
"""
AT_BEND, W_BEND = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0), np.array([0.5, 0.5])
"""Gauss's two points for the curvature, where a cubic has it best."""
BENDING = (0.75, 0.25)
"""Shares of kappa^2 and of r''.r'' in the bending energy: it grows with the stretch as 1 + 3.5 eps.

A plane section of St Venant-Kirchhoff material has 1 + 3 eps.  Another half stands for what the rod lacks, terms of
theta'^4 and theta''^2: fitted to the solid with nu = 0, not derived.  With kappa^2 alone, or with 1 + 3 eps, lambda_c
is several times farther from that one's.
"""
STRETCHING = np.concatenate([12.0 * W_STRETCH, np.zeros(6)])
BENDING_STIFFNESS = np.concatenate([np.zeros(3), *(share * W_BEND for share in (BENDING[0], BENDING[1], BENDING[1]))])
"""Stiffness of each strain on an element of length one, times the thickness squared in stretching."""
IN_CURL = np.concatenate([np.zeros(3), W_BEND, np.zeros(4)])
"""Weight of each strain in the integral of the curvature."""
VISCOUS = np.array([1.0, 1.0, 1.0, 1.0 / BENDING[0], 1.0 / BENDING[0], 0.0, 0.0, 0.0, 0.0])
"""Weight of each strain in viscosity over its weight in energy: only kappa counts in bending.

A rotation dissipates nothing; it changes r'' but not kappa.
"""
FULL = tuple(0.5 * a for a in np.polynomial.legendre.leggauss(4))
"""Gauss rule that is exact for mass and weight; points from the middle of the element."""
IS_SLOPE = np.array([0.0, 0.0, 1.0, 1.0] * 2)
"""One for an element's unknowns that are slopes, zero for displacements."""
WEIGHT = np.array([0.0, 6.0, 0.0, 1.0, 0.0, 6.0, 0.0, -1.0]) / 12.0
"""Weight of an element of length one on its unknowns."""
X, Z = np.array([0, 2, 4, 6]), np.array([1, 3, 5, 7])
"""Positions of an element's x and z unknowns: displacement, slope; left end, right end."""


CUBICS = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-3.0, -2.0, 3.0, -1.0], [2.0, 1.0, -2.0, 1.0]])
FIRST = CUBICS[1:] * np.array([1.0, 2.0, 3.0])[:, None]
SECOND = FIRST[1:] * np.array([1.0, 2.0])[:, None]
"""Coefficients of Hermite's cubics and their derivatives, shape (powers, 4)."""


def hermite(t: Array) -> tuple[Array, Array, Array]:
    """Hermite's cubics on an element of length one, and two derivatives, at points from 0 to 1; shape (n, 4) each.

    The functions go with the displacement and the slope at the left end, then those at the right end.
    """
    powers = np.vander(t, 4, increasing=True)
    return powers @ CUBICS, powers[:, :3] @ FIRST, powers[:, :2] @ SECOND


def _mass() -> Array:
    """Mass matrix of an element of length one, shape (8, 8)."""
    points, weights = FULL
    value, mass = hermite(0.5 + points)[0], np.zeros((8, 8))
    mass[np.ix_(X, X)] = mass[np.ix_(Z, Z)] = (weights[:, None] * value).T @ value
    return mass


MASS = _mass()
SHAPE = np.concatenate([hermite(AT_STRETCH)[1], *hermite(AT_BEND)[1:]])[None, None]
"""Derivatives of the cubics at the points of the strains."""


@lru_cache(maxsize=64)
def _numbering(elements: int) -> tuple[Index, BandPattern]:
    """The unknowns of each element, shape (elements, 8), and the pattern of their matrices."""
    unknowns = 4 * np.arange(elements)[:, None] + np.arange(8)
    return unknowns, BandPattern.of(unknowns, 4 * (elements + 1))


@lru_cache(maxsize=64)
def _stiffness(thickness: float) -> Array:
    """Of each strain, times its weight, per length and times the length of an element; shape (2, 9)."""
    return np.stack([STRETCHING / thickness**2, BENDING_STIFFNESS])


CRUSHED = -1.0 / 3.0
"""Membrane strain at which the force of the law, ``eps sqrt(1 + 2 eps)``, is largest in compression."""


@dataclass(frozen=True)
class Rod(Model):
    """A strip as a rod; make it with :meth:`of`.

    A node has four unknowns: its displacement (x, z) and that one's derivative by s, (x, z).

    ``lengths``: of the elements, shape (n_elements,): as they are, since differences of the nodes' places are rounded
    to the place's digits.  ``element_unknowns``: shape (n_elements, 8).
    """

    length: float
    thickness: float
    lengths: Array = field(repr=False)
    element_unknowns: Index = field(repr=False)
    pattern: BandPattern = field(repr=False)
    curl: float = 0.0

    @classmethod
    def of(cls, length: float, thickness: float, *, elements: int | Array = 100, curl: float = 0.0) -> Rod:
        """Discretise a strip; lengths in L*.

        ``elements``: number of elements, or their ends as distances from the grasped end, shape (m,).  ``curl``: its
        curvature without forces, 1/L*.  Raises InvalidInputError: ends that cannot be used.
        """
        lengths = lengths_of(length, elements)
        unknowns, pattern = _numbering(len(lengths))
        return cls(length, thickness, lengths, unknowns, pattern, curl)

    def with_lengths(self, lengths: Array) -> Rod:
        return Rod(self.length, self.thickness, lengths, self.element_unknowns, self.pattern, self.curl)

    @property
    def stiffness(self) -> Array:
        """Of each strain (see :meth:`strain`), times its weight in the integral over the strip; (n_elements, 9)."""
        along, across = _stiffness(self.thickness)
        return np.asarray(self._size * along + across / self._size)

    @property
    def _size(self) -> Array:
        """Lengths of the elements, shape (n_elements, 1)."""
        return self.lengths[:, None]

    @property
    def s(self) -> Array:
        """The nodes, which are the elements' ends."""
        return self.ends

    @property
    def slopes(self) -> Index:
        return 4 * np.arange(len(self.lengths) + 1) + 3

    @cached_property
    def mass(self) -> Band:
        # A length times the scaled unknowns.
        factor = self._size**IS_SLOPE
        return self.pattern.assemble((self._size * factor)[:, :, None] * factor[:, None, :] * MASS)

    def mass_rate(self, q: Array) -> Array:
        factor = self._size**IS_SLOPE
        local = factor * q[self.element_unknowns]
        return np.asarray(self._size * factor * ((1.0 + IS_SLOPE) * (local @ MASS) + (IS_SLOPE * local) @ MASS))

    @cached_property
    def element_weight(self) -> Array:
        return np.asarray(self._size * WEIGHT * self._size**IS_SLOPE)

    @property
    def weight_rate(self) -> Array:
        return np.asarray((1.0 + IS_SLOPE) * self.element_weight)

    @property
    def size(self) -> int:
        return 4 * (len(self.lengths) + 1)

    @cached_property
    def middle(self) -> Index:
        return 4 * np.arange(len(self.lengths) + 1)[:, None] + np.arange(2)

    @cached_property
    def directors(self) -> Directors:
        """The tangents at an element's ends."""
        unknowns = self.element_unknowns.reshape(-1, 2, 2, 2)[:, :, 1:].copy()
        return Directors(unknowns, np.ones((len(unknowns), 2, 1)), np.array([1.0, 0.0]), self.lengths)

    @cached_property
    def elements(self) -> Elements:
        stiffness, rest = _stiffness(self.thickness), -self.curl * IN_CURL
        return kernels.elements.Elements(
            True, self.element_unknowns, SHAPE, self.lengths, stiffness, VISCOUS, 0.0, 0.0, rest
        )

    @property
    def stress_shape(self) -> tuple[int, ...]:
        """A stress for each strain of each element."""
        return (len(self.element_unknowns), 9)

    def strain(self, q: Array) -> Array:
        """eps at three points, kappa at two, and r'' at two, its x before its z; shape (n_elements, 9).

        The last six times the element's length.
        """
        return self.predict_stress(q, np.zeros_like(q)) / self.stiffness

    def admissibility(self, q: Array) -> str:
        """Not empty where the rod is compressed past the largest force of its law."""
        least = kernels.elements.least(self.elements, np.ascontiguousarray(q))
        return "" if least > CRUSHED else f"the rod is crushed: its strain is {least:.2g}, least allowed is -1/3"

    def resampled_stress(self, q: Array, other: Rod) -> Array:
        size, s = self._size, self.s[:-1, None]
        new_size, new_s = other._size, other.s[:-1, None]
        strain = self.strain(q)
        out = np.empty((len(new_size), 9))
        # At the elements' ends the membrane strain is a mean of both sides.
        at = s + size * AT_STRETCH
        out[:, :3] = np.interp(new_s + new_size * AT_STRETCH, at[:, 1], strain[:, :3] @ W_STRETCH)
        at, new_at = s + size * AT_BEND, new_s + new_size * AT_BEND
        for pair in (slice(3, 5), slice(5, 7), slice(7, 9)):
            out[:, pair] = new_size * np.interp(new_at, at.ravel(), (strain[:, pair] / size).ravel())
        return other.stiffness * out

    def resampled(self, q: Array, s: Array) -> Array:
        e = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 2)
        size = self.lengths[e]
        value, rate, _ = hermite((s - self.s[e]) / size)
        nodes = q.reshape(-1, 4)
        slope = size[:, None] * nodes[:, 2:][e], size[:, None] * nodes[:, 2:][e + 1]
        terms = np.stack([nodes[e, :2], slope[0], nodes[e + 1, :2], slope[1]], axis=1)
        place, along = np.einsum("ea,eai->ei", value, terms), np.einsum("ea,eai->ei", rate, terms)
        return np.concatenate([place, along / size[:, None]], axis=1).ravel()

    def unknowns_of(self, position: Array, angle: Array) -> Array:
        straight = np.stack([self.s - self.length / 2.0, np.zeros_like(self.s)], axis=1)
        slope = np.stack([np.cos(angle) - 1.0, np.sin(angle)], axis=1)
        return np.concatenate([position - straight, slope], axis=1).ravel()
