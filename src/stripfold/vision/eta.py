"""eta_b from one picture: of the loop of a folded strip, or of a strip that hangs out of a clamp.

The interval holds what the picture says: scatter of the edges, the free end, the plumb line.  It does not hold the
scale: an error of 1 % of it is one of 3 % of eta_b, with either method.  Nor does it hold what the model leaves out:
a folded strip of thickness t lands on itself t higher than an infinitely thin one, its loop is 0.12 t higher, and
eta_b comes out 0.38 t / L* too low (2 % at t = 0.05 L*).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stripfold import elastica
from stripfold.errors import InvalidInputError, TrackingError
from stripfold.inputs import ETA_B
from stripfold.material import GRAVITY, Material
from stripfold.vision import cantilever, folded
from stripfold.vision.centreline import Centreline, find

SCALE = (1e-7, 1e-2)
"""Allowed metres per pixel."""
POINTS = 100
VAGUE = 30.0
"""Largest ratio of an interval's ends that is still called a measurement."""
LEVEL = (2.5, 97.5)
"""Percentiles of the interval."""


@dataclass(frozen=True, eq=False)
class EtaB:
    """What one picture says of a strip.

    Parameters
    ----------
    method
        "fold" or "cantilever".
    eta_b, interval
        Weight-to-bending-stiffness ratio and its 95 % interval, m^-4 s^2.
    gravity_length
        L*, m.
    residual
        Root mean square of the distances between what was measured and what was fitted, m.
    scale
        m per pixel.
    fold
        The loop, with the method "fold".
    line, shape, power
        With the method "cantilever": the centreline from the clamp, the linear elastica's fit, and that of a law
        ``M ~ kappa^n``.
    """

    method: str
    eta_b: float
    interval: tuple[float, float]
    residual: float
    scale: float
    fold: folded.Fold | None = None
    line: Centreline | None = None
    shape: cantilever.Fit | None = None
    power: cantilever.Fit | None = None

    @property
    def gravity_length(self) -> float:
        """L*, m."""
        return Material(self.eta_b).gravity_length

    @property
    def exponent(self) -> tuple[float, float, float] | None:
        """n of ``M ~ kappa^n`` and its 95 % interval; 1 for a linear strip."""
        if self.power is None:
            return None
        low, high = np.percentile(self.power.exponents, LEVEL)
        return self.power.exponent, float(low), float(high)

    @property
    def linear(self) -> bool | None:
        """Whether the shape is that of a linear strip; None with the method "fold", which does not tell."""
        return None if (found := self.exponent) is None else bool(found[1] <= 1.0 <= found[2])

    def secant(self, share: float) -> float:
        """eta_b of the secant stiffness at ``share`` of the largest curvature, m^-4 s^2; needs "cantilever".

        The stiffness ``M / kappa`` goes with ``kappa^(n - 1)``.
        """
        if self.power is None or self.line is None:
            raise InvalidInputError("method", self.method, "cantilever")
        return _eta(self.power.ratio, self.line.length * self.scale) * share ** (1.0 - self.power.exponent)

    def fields(self) -> dict[str, Any]:
        """Plain values, SI units."""
        values: dict[str, Any] = {
            "method": self.method,
            "eta_b": self.eta_b,
            "eta_b_lower": self.interval[0],
            "eta_b_upper": self.interval[1],
            "gravity_length": self.gravity_length,
            "residual": self.residual,
        }
        if self.fold is not None:
            values |= {"height": self.fold.height * self.scale, "height_sd": self.fold.sd * self.scale}
        if self.line is not None and self.shape is not None and self.exponent is not None:
            names = ("exponent", "exponent_lower", "exponent_upper")
            values |= {"length": self.line.length * self.scale, "linear": self.linear}
            values |= dict(zip(names, self.exponent, strict=True))
            values |= {"eta_b_secant": self.secant(1.0), "curvature": self.shape.curvature / self.scale}
        return values


def from_image(image: NDArray[np.uint8], scale: float, method: str, source: str = "picture") -> EtaB:
    """eta_b from grey values, shape (h, w), with ``scale`` metres per pixel; the picture is upright.

    Raises
    ------
    InvalidInputError
        A scale or method that cannot be, or a scale with which eta_b could not be.
    TrackingError
        No strip as the method needs it.
    """
    if not SCALE[0] <= scale <= SCALE[1]:
        raise InvalidInputError("scale", scale, f"from {SCALE[0]:g} to {SCALE[1]:g} m per pixel")
    methods = {"fold": _from_fold, "cantilever": _from_cantilever}
    if method not in methods:
        raise InvalidInputError("method", method, " or ".join(methods))
    found = methods[method](image, scale, source)
    if not ETA_B[0] <= found.eta_b <= ETA_B[1]:
        text = f"one that makes eta_b {ETA_B[0]:g} to {ETA_B[1]:g} m^-4 s^2; it would be {found.eta_b:.3g}"
        raise InvalidInputError("scale", scale, text, "the unit is m per pixel")
    return found


def _eta(ratio: float, length: float) -> float:
    """From ``(length / L*)^3``; length in m."""
    return ratio / (GRAVITY * length**3)


def _from_fold(image: NDArray[np.uint8], scale: float, source: str) -> EtaB:
    fold = folded.measure_fold(image, source)
    ends = (fold.height + 1.96 * fold.sd, fold.height - 1.96 * fold.sd)
    if ends[1] <= 0.0:
        raise TrackingError(source, "the loop's height is within its uncertainty", folded.NEEDED, "come closer")
    low, high = (elastica.eta_b_from_fold_height(height * scale) for height in ends)
    eta_b = elastica.eta_b_from_fold_height(fold.height * scale)
    residual = float(np.sqrt(np.mean(fold.residual**2))) * scale
    return EtaB("fold", eta_b, (low, high), residual, scale, fold=fold)


def _from_cantilever(image: NDArray[np.uint8], scale: float, source: str) -> EtaB:
    line = find(image, points=POINTS, source=source)
    # The free end hangs below the clamp.
    if line.points[0, 1] > line.points[-1, 1]:
        line = line.reversed()
    if line.open_ends[1]:
        found = "the strip's lower end is cut by the picture's border"
        raise TrackingError(source, found, cantilever.NEEDED, "show all of the strip that hangs")
    # Frayed or slanted, the end is known to half of the strip's thickness.
    tip_sd = max(0.5 * float(np.median(line.width)), 1.0)
    shape, power = (
        cantilever.fit(line.points, line.sd, tip_sd, linear=linear, source=source) for linear in (True, False)
    )
    length = line.length * scale
    low, high = (_eta(float(ratio), length) for ratio in np.percentile(shape.ratios, LEVEL))
    if high > VAGUE * low:
        found = f"the strip's shape leaves eta_b anywhere from {low:.3g} to {high:.3g} m^-4 s^2"
        raise TrackingError(source, found, f"an interval narrower than a factor {VAGUE:g}", "let 1 to 4 L* of it hang")
    eta_b = _eta(shape.ratio, length)
    return EtaB("cantilever", eta_b, (low, high), shape.rms * scale, scale, line=line, shape=shape, power=power)
