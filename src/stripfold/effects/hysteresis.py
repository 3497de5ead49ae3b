"""Friction in bending that does not depend on the rate or on the steps: each element resists being bent either way.

Source: ``docs/physics.md``, section 8; the friction moment of Kawabata's bending test, with the element of Jenkins and
Prandtl (a spring in series with a slider) in its place.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.models.directors import Directors
from stripfold.models.model import Model
from stripfold.solve.linear import Band

YIELD_CURVATURE = 0.05
"""Change of curvature after which friction slides, 1/L*.

Two per cent of the largest curvature of the critical state at z = 3 L* (2.69/L*): small beside what folding does to the
strip, and large enough for the spring not to be far stiffer than the strip itself.
"""
ON_THE_EDGE = 1e-9
"""Relative excess of the spring's curvature over the yield curvature that still counts as sticking.

A state that slid is committed with the spring at its limit up to rounding, which may not decide its tangent.
"""


@dataclass(frozen=True, eq=False)
class Hysteresis:
    """A moment ``m = stiffness * clip(kappa - kappa_p, -kappa_y, kappa_y)`` beside the elastic one; make it with
    :meth:`of`.

    Attributes
    ----------
    model
        The strip it acts on.
    moment
        M_0, the largest friction moment, rho_a g L*^2: half the height of the loop (half of Kawabata's 2HB).
    yield_curvature
        kappa_y, 1/L*; ``moment / yield_curvature`` is the spring's stiffness in units of the bending stiffness.
    slid
        kappa_p, 1/L*, shape (n_elements,): the curvature at which each element's spring is slack, as committed.
    dissipated
        Energy dissipated in all committed steps, rho_a g L*^2 per width.
    directors
        The geometry.
    """

    model: Model = field(repr=False)
    moment: float
    yield_curvature: float
    slid: Array = field(repr=False)
    dissipated: float
    directors: Directors = field(repr=False)

    @classmethod
    def of(
        cls, model: Model, moment: float, *, yield_curvature: float = YIELD_CURVATURE, slack: Array | None = None
    ) -> Self:
        """Friction on a strip that is slack (no friction moment) when flat, or in the state ``slack``, shape (n,).

        The smaller ``yield_curvature``, the nearer to dry friction, which holds any curvature until M_0 is exceeded,
        and the shorter the steps have to be: Newton's method stands changes of two or three yield curvatures in one.
        Where it slides the moment does not depend on it.

        Raises
        ------
        InvalidInputError
            When ``moment`` is negative or ``yield_curvature`` not positive, or either not finite.
        """
        if not 0.0 <= moment < np.inf:
            raise InvalidInputError("moment", moment, "a finite number >= 0 (rho_a g L*^2)")
        if not 0.0 < yield_curvature < np.inf:
            raise InvalidInputError("yield_curvature", yield_curvature, "a finite number > 0 (1/L*)")
        directors = model.directors
        slid = np.zeros(len(directors.length))
        if slack is not None:
            slid = directors.turn(directors.at(slack)) / directors.length
        return cls(model, moment, yield_curvature, slid, 0.0, directors)

    @property
    def needs_steps(self) -> bool:
        """No: it depends on neither rate nor steps."""
        return False

    @property
    def stiffness(self) -> float:
        """The spring's, in units of the strip's bending stiffness rho_a g L*^3."""
        return self.moment / self.yield_curvature

    @property
    def _share(self) -> float:
        """What one element has of its section's friction: all of it, or half where two lie across."""
        return 1.0 / self.directors.across

    def curvature(self, q: Array) -> Array:
        """Mean curvature of each element (turn of the sections per reference length), 1/L*, shape (n_elements,)."""
        return self.directors.turn(self.directors.at(q)) / self.directors.length

    def moments(self, q: Array) -> Array:
        """The friction moment m at each element's section, rho_a g L*^2, shape (n_elements,)."""
        return self.stiffness * self._spring(self.curvature(q))

    def _spring(self, curvature: Array) -> Array:
        """What of the curvature the spring has, the slider having given way."""
        return np.clip(curvature - self.slid, -self.yield_curvature, self.yield_curvature)

    def force(self, q: Array) -> Array:
        """``sum over elements of m * length * d kappa / dq``, shape (n,)."""
        d = self.directors.at(q)
        moment = self._share * self.stiffness * self._spring(self.directors.turn(d) / self.directors.length)
        return self._scatter(moment[:, None] * self.directors.gradient(d))

    def force_and_tangent(self, q: Array) -> tuple[Array, Band]:
        """The same and its derivative: with the spring's stiffness where it sticks, without where it slides."""
        d = self.directors.at(q)
        length = self.directors.length
        curvature = self.directors.turn(d) / length
        moment = self._share * self.stiffness * self._spring(curvature)
        sticks = np.abs(curvature - self.slid) <= self.yield_curvature * (1.0 + ON_THE_EDGE)
        modulus = self._share * self.stiffness * sticks / length
        gradient = self.directors.gradient(d)
        corners = modulus[:, None, None] * (gradient[:, :, None] * gradient[:, None, :])
        corners += moment[:, None, None] * self.directors.hessian(d)
        local, n_local = self.directors.local, self.directors.n_local
        matrices = np.zeros((len(length), n_local, n_local))
        matrices[:, local[:, None], local] = corners
        return self._scatter(moment[:, None] * gradient), self.model.pattern.assemble(matrices)

    def _scatter(self, corners: Array) -> Array:
        unknowns = self.directors.unknowns.ravel()
        return np.bincount(unknowns, corners.ravel(), minlength=self.model.size).astype(float)

    def stored(self, q: Array) -> float:
        """Elastic energy of the springs, rho_a g L*^2 per width."""
        spring = self._spring(self.curvature(q))
        return 0.5 * self._share * self.stiffness * float(self.directors.length @ spring**2)

    def dissipation(self, q: Array) -> float:
        """What committing ``q`` dissipates; exact where no element turns back within the step."""
        curvature = self.curvature(q)
        slip = curvature - self._spring(curvature) - self.slid
        return self._share * self.moment * float(self.directors.length @ np.abs(slip))

    def committed(self, q: Array) -> Self:
        """The friction after an accepted step to ``q``: where it slid, the spring is slack at a new curvature.

        There the tangent at ``q`` itself is from now on that of turning back (sticking).
        """
        curvature = self.curvature(q)
        slid = curvature - self._spring(curvature)
        return replace(self, slid=slid, dissipated=self.dissipated + self.dissipation(q))
