"""eta_b from one picture: of the loop of a folded strip, or of a strip that hangs out of a clamp.

The interval covers what the picture says, scatter of the edges, light and the free end, and where the camera may have
stood, which nobody measures.  The scale holds in the plane of the strip's near edge; behind it all is seen smaller,
and the middle of the band that is seen lies between both edges: that makes eta_b up to 3/2 of the depth too high.  A
tilt of the camera shows a face of the strip and shortens the picture; its roll turns the vertical, on which only a
hanging strip depends.  The interval excludes the scale, an error of 1 % of which is one of 3 % of eta_b with either
method, and friction and plasticity of the cloth.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from stripfold.base.arrays import Picture
from stripfold.base.errors import TrackingError
from stripfold.base.material import GRAVITY, Material
from stripfold.film import cantilever, fold
from stripfold.film.cantilever import Cantilever
from stripfold.film.fold import Fold
from stripfold.film.line import Centreline, find
from stripfold.film.line_kernels import normals
from stripfold.film.segmentation import enclosed_share, piece_along, second_edge

POINTS = 100
MAX_INTERVAL_RATIO = 30.0
"""Largest ratio of an interval's ends that is still called a measurement."""
MIN_SAG = 0.0075
"""Least distance of a hanging strip from the straight line through its ends, relative to its length: what is straighter
can be the edge of anything."""
STRAIGHT = "let 1 to 4 L* of it hang; is it a ruler or an edge? take it out of the picture"
MAX_ENCLOSED = 0.25
"""Largest share of a hanging strip along which its two sides are different pieces of the background: a clamp may close
off some of it, but both are connected around the free end."""
CLAMP, MAX_BESIDE = 0.2, 0.25
"""Share of a hanging strip that may be held by something of its tone; largest share of the rest of what is connected
with the strip that is not a part of it: 0.11 in a photograph with hairs, 0.38 in a shadow that halves eta_b."""
TILT, ROLL, DEPTH = 3.0, 1.0, 0.05
"""Largest angles of the camera's axis to the strip's width, and of its rows to the horizontal, degrees, and largest
width of the strip over its distance from the camera, that are not excluded unless less is stated."""


@dataclass(frozen=True)
class View:
    """What is not excluded of the camera: ``tilt`` and ``roll``, degrees, and ``depth``, a share of its distance."""

    tilt: float = TILT
    roll: float = ROLL
    depth: float = DEPTH


@dataclass(frozen=True, eq=False)
class EtaB:
    """eta_b of a strip from one picture with ``scale`` metres per pixel: a shape fitted to what is seen."""

    scale: float
    view: View
    fit: Fold | Cantilever
    tilt_error: ClassVar[float]
    """Largest relative error of eta_b by a degree of the camera's tilt, in 95 % of drawn strips up to 2.5 L* wide."""

    @property
    def eta_b(self) -> float:
        """Weight-to-bending-stiffness ratio, m^-4 s^2."""
        return _eta_b(self.fit.unit * self.scale)

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of ``eta_b``, m^-4 s^2: 95 %, however the camera stood within its view."""
        low, high = self.fit.interval
        tilted = self.tilt_error * self.view.tilt
        nearer = (1.0 - 0.5 * self.view.depth) ** 3
        return _eta_b(high * self.scale) * nearer * (1.0 - tilted), _eta_b(low * self.scale) * (1.0 + tilted)

    @property
    def residual(self) -> float:
        """Root mean square of the distances between measured and fitted points, m."""
        return self.fit.rms * self.scale

    @property
    def gravity_length(self) -> float:
        """L*, m."""
        return Material(self.eta_b).gravity_length

    def fields(self) -> dict[str, Any]:
        """Plain values, SI units."""
        return {
            "eta_b": self.eta_b,
            "eta_b_lower": self.interval[0],
            "eta_b_upper": self.interval[1],
            "gravity_length": self.gravity_length,
            "residual": self.residual,
        }


@dataclass(frozen=True, eq=False)
class FoldEtaB(EtaB):
    """By the loop of a strip folded in half."""

    fit: Fold
    tilt_error = 0.008

    def fields(self) -> dict[str, Any]:
        height = self.fit.height * self.scale
        return {"method": "fold", **super().fields(), "height": height, "height_sd": height * self.fit.sd}


@dataclass(frozen=True, eq=False)
class CantileverEtaB(EtaB):
    """By a linear strip that hangs; ``line`` is the centreline from the clamp, ``power`` the fit of ``M ~ kappa^n``."""

    fit: Cantilever
    line: Centreline
    power: Cantilever
    # The far edge of the free end is seen beyond the near one.
    tilt_error = 0.025

    @property
    def exponent(self) -> tuple[float, float, float]:
        """n of ``M ~ kappa^n`` and its 95 % interval."""
        return self.power.exponent, *self.power.exponents

    @property
    def linear(self) -> bool:
        """Whether the shape is that of a linear strip."""
        _, low, high = self.exponent
        return low <= 1.0 <= high

    def secant(self, share: float) -> float:
        """eta_b of the secant stiffness at ``share`` of the largest curvature, m^-4 s^2.

        The stiffness ``M / kappa`` is proportional to ``kappa^(n - 1)``.
        """
        return _eta_b(self.power.unit * self.scale) * share ** (1.0 - self.power.exponent)

    def fields(self) -> dict[str, Any]:
        names = ("exponent", "exponent_lower", "exponent_upper")
        return {
            "method": "cantilever",
            **super().fields(),
            "length": self.line.length * self.scale,
            "linear": self.linear,
            **dict(zip(names, self.exponent, strict=True)),
            "eta_b_secant": self.secant(1.0),
            "curvature": self.fit.curvature / self.scale,
            "slope": float(np.degrees(self.fit.slope)),
        }


def from_image(
    image: Picture,
    scale: float,
    method: str,
    source: str = "picture",
    slope: float | None = None,
    view: View | None = None,
) -> FoldEtaB | CantileverEtaB:
    """eta_b from grey values, shape (h, w), with ``scale`` metres per pixel; the picture is upright.

    ``slope``, in degrees, is the angle of a cantilever below the horizontal at its clamp; None: as the shape has it.
    ``view``: what is not excluded of the camera; None: nothing was measured.

    Raises TrackingError: no strip as the method needs it.
    """
    view = view or View()
    if method == "fold":
        return FoldEtaB(scale, view, fold.measure(image, source))
    return _from_cantilever(image, scale, source, slope, view)


def _eta_b(unit: float) -> float:
    """From L*, m."""
    return 1.0 / (GRAVITY * unit**3)


def _from_cantilever(image: Picture, scale: float, source: str, slope: float | None, view: View) -> CantileverEtaB:
    line = find(image, points=POINTS, source=source)
    # The free end hangs below the clamp.
    if line.points[0, 1] > line.points[-1, 1]:
        line = line.reversed()
    if line.open_ends[1]:
        found = "the strip's lower end is cut by the picture's border"
        raise TrackingError(source, found, cantilever.NEEDED, "show all of the strip that hangs")
    enclosed = enclosed_share(image, line.points, line.width, line.bright)
    if enclosed > MAX_ENCLOSED:
        found = f"a closed outline: {enclosed:.0%} of the line divide what is enclosed from what is not"
        raise TrackingError(source, found, cantilever.NEEDED, "let nothing touch the free end, nor the strip itself")
    _, nearest, beside = piece_along(image, line.points, line.width, line.bright)
    beside = beside[nearest > CLAMP * POINTS]
    if beside.mean() > MAX_BESIDE:
        raise second_edge(float(beside.sum() / (~beside).sum()), source, cantilever.NEEDED)
    chord = line.points - line.points[0]
    sag = float(np.abs(chord @ normals(line.points[[0, -1]])[0]).max())
    if sag < MIN_SAG * line.length:
        found = f"a line that is bent by {sag / line.length:.1%} of its length"
        raise TrackingError(source, found, f"{MIN_SAG:.2%} or more; {cantilever.NEEDED}", STRAIGHT)
    # A frayed or slanted end is known to half of the strip's thickness.
    held = None if slope is None else float(np.radians(slope))
    tip_sd, roll = max(0.5 * float(np.median(line.width)), 1.0), float(np.radians(view.roll))
    shape, power = (
        cantilever.fit(line.points, line.sd, tip_sd, roll, linear=linear, slope=held, source=source)
        for linear in (True, False)
    )
    measured = CantileverEtaB(scale, view, shape, line, power)
    low, high = measured.interval
    if high > MAX_INTERVAL_RATIO * low:
        found = f"the strip's shape leaves eta_b anywhere from {low:.3g} to {high:.3g} m^-4 s^2"
        needed = f"an interval narrower than a factor {MAX_INTERVAL_RATIO:g}"
        raise TrackingError(source, found, needed, "let 1 to 4 L* of it hang")
    return measured
