"""A moment-curvature law that is not linear, as what it adds to the linear one of rod and solid.

The strip itself has the bending stiffness one, in units of rho_a g L*^3; the law adds m(kappa) - kappa in each element,
kappa the mean curvature of the element from the angle between the sections at its ends, as in :mod:`.hysteresis`.
In the solid the moment acts between sections, whose stress stays linear over the thickness.  The stretch of a bent
section is that of the linear strip, too: for strips so thin that (h kappa)^2 is small beside dm/dkappa.
For statics: a motion in time would count its work as friction's.  Source: docs/physics.md, section 11.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.strip.effect import Directors, ElementMoments, Reaction
from stripfold.strip.model import Model


class MomentCurvature:
    """A law m(kappa), odd and monotone: a table interpolated by monotone cubics, straight on beyond its last interval.

    ``curvature``, ``moment``: shape (n,), n >= 2: 1/L* and rho_a g L*^2, positive and increasing; no moment without
    curvature is implied.  Raises InvalidInputError: numbers that are not finite, positive and increasing.
    """

    def __init__(self, curvature: Array, moment: Array) -> None:
        from scipy.interpolate import PchipInterpolator

        for name, values in (("curvature", curvature), ("moment", moment)):
            at = np.concatenate([[0.0], values])
            if len(curvature) < 2 or not np.all(np.isfinite(at)) or np.any(np.diff(at) <= 0.0):
                raise InvalidInputError(name, values, "at least two finite numbers, positive and increasing")
        # One interval more on the straight line through the last one: its slope is that beyond the table.
        kappa, m = (np.append(values, 2.0 * values[-1] - values[-2]) for values in (curvature, moment))
        kappa, m = (np.concatenate([-values[::-1], [0.0], values]) for values in (kappa, m))
        self.end = float(kappa[-1])
        self._moment = PchipInterpolator(kappa, m)
        self._slope = self._moment.derivative()
        self._integral = self._moment.antiderivative()
        self._last = float(self._slope(self.end))

    def moment(self, kappa: Array) -> Array:
        """m, shape as ``kappa``."""
        inside = np.clip(kappa, -self.end, self.end)
        return np.asarray(self._moment(inside) + self._last * (kappa - inside))

    def tangent(self, kappa: Array) -> Array:
        """dm/dkappa, positive."""
        return np.asarray(self._slope(np.clip(kappa, -self.end, self.end)))

    def energy(self, kappa: Array) -> Array:
        """Integral of m from 0."""
        inside = np.clip(kappa, -self.end, self.end)
        beyond = kappa - inside
        at_end = self._integral(inside) - self._integral(0.0)
        return np.asarray(at_end + beyond * (self._moment(inside) + 0.5 * self._last * beyond))


def split_loop(curvature: Array, loading: Array, unloading: Array) -> tuple[MomentCurvature, float]:
    """The law and the friction moment M_0 of :class:`.Hysteresis` that together have a measured loop.

    The law is the mean of the moments of bending and unbending at the same curvatures, shape (n,) each, M_0 half of
    their difference, averaged over the curvature: friction that does not depend on it.

    Raises InvalidInputError: the mean is no law, or unbending takes more moment than bending.
    """
    width = float(np.trapezoid(loading - unloading, curvature) / (curvature[-1] - curvature[0]))
    if width < 0.0:
        raise InvalidInputError("unloading", unloading, "moments below those of loading, on average")
    return MomentCurvature(curvature, 0.5 * (loading + unloading)), 0.5 * width


@dataclass(frozen=True, eq=False)
class BendingLaw(ElementMoments):
    """The moment ``m(kappa) - kappa`` in each element; it has no memory.  See :meth:`of`."""

    model: Model = field(repr=False)
    law: MomentCurvature
    directors: Directors = field(repr=False)

    @classmethod
    def of(cls, model: Model, law: MomentCurvature) -> Self:
        """The law on a strip."""
        return cls(model, law, model.directors)

    def moments(self, q: Array) -> Array:
        """The strip's moment m(kappa) in each element, rho_a g L*^2, shape (n_elements,)."""
        return self.law.moment(self.curvature(q))

    def stored(self, q: Array) -> float:
        """What the law adds to the elastic energy, rho_a g L*^2 per width; may be negative."""
        kappa = self.curvature(q)
        return float(self.directors.length @ (self.law.energy(kappa) - 0.5 * kappa**2))

    def _moment(self, curvature: Array) -> tuple[Array, Array]:
        return self.law.moment(curvature) - curvature, self.law.tangent(curvature) - 1.0

    def _rate(self, curvature: Array, growth: Array) -> Array:
        return -curvature * growth

    def on(self, before: Model, model: Model) -> Self:
        return self.of(model, self.law)

    def committed(self, q: Array, reaction: Reaction) -> Self:
        return self
