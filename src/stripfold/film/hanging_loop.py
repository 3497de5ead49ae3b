"""The heavy loop fitted to a picture of a strip that hangs from its ends, held together: a heart or a pear.

In a heart the ends point upwards, in a pear downwards.  The shape depends on ``(half / L*)^3`` alone, half being half
of the length between the clamp's edges; how large the loop is, where it is and how the picture is turned is fitted with
it, so that neither the length nor the clamp need be seen.  A loop that its weight hardly bends says nothing about L*.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import stdtrit

from stripfold.base.arrays import Array, Index, Mask, Picture
from stripfold.base.errors import NewtonError, TrackingError
from stripfold.elastica.textile import WEIGHTS, hanging_loop
from stripfold.files.reporting import Rows, metres
from stripfold.film.fitted import WAVES, WAVES_SD
from stripfold.film.line_kernels import arc_length, normals
from stripfold.film.shape import (
    Alike,
    Depth,
    Place,
    Settled,
    Shape,
    ShapeFit,
    filled,
    most_alike,
    overlap,
    settled,
    thickness_sd,
)

Kind = Literal["heart", "pear"]
KINDS: tuple[Kind, ...] = ("heart", "pear")
TRIED = np.log(np.geomspace(0.5, 2000.0, 12))
"""ln of the weights with which a hole is compared."""
STEPS = 0.02, 1e-3
"""Changes of the parameters for the derivatives."""
MOST = 1.0
"""Largest change of ln of the weight in an iteration."""
HELD = 0.12
"""Share of the half loop beside the clamp that its jaws may hide."""
ROOM, JAWS = 0.15, 0.3
"""How far around the loop other things are looked for, and how far from the clamp they may be its own; over the half
loop's length."""
WIDEST = 0.12
"""Largest width of the band, over the half loop's length."""
MIN_FOUND = 0.75
"""Least share of the sections on which the strip is found: a loop shows its face on one side."""
MIN_BESIDE = 0.6
"""Least share of the part beside the clamp, where the layers are one, on which there is something of the strip's tone:
without it a ring would be a heart."""
UNEVEN = 0.1
"""Worth of bands that are as wide as a face that is seen so makes them, beside the overlap with the hole."""
MATCHES = 5
"""Iterations by which a loop gets the place and the size of a hole."""
MAX_TURN = 12.0
"""Largest angle of the loop's axis to the picture's columns, degrees."""
MAX_MISFIT = 0.01
"""Largest root mean square of the residuals, over the half loop's length."""


@lru_cache(maxsize=256)
def _half(kind: Kind, log_weight: float, gap: float) -> Array:
    return hanging_loop(kind, float(np.exp(log_weight)), gap)


@dataclass(frozen=True)
class HangingLoop(Shape):
    """A loop, lengths over its half's; parameters are ln of ``(half / L*)^3`` and ``gap``, half of the thickness."""

    kind: Kind
    log_weight: float
    gap: float
    name, unit_name = "loop of a hanging strip", "half its length"
    crooked = "are both ends clamped upright, at the same height, and is it neither twisted nor touched?"
    needed = "a strip that hangs from its ends, held together, seen from the side, with light through its loop"
    advice = "turn the camera along the strip's width; background much darker or brighter than the strip"
    toward, largest_misfit, most_holes = (1.0, 0.0), MAX_MISFIT, 4
    least_found = MIN_FOUND, MIN_FOUND

    @property
    def middle(self) -> Array:
        """From the left end to the right one, shape (401, 2)."""
        half = _half(self.kind, self.log_weight, self.gap)
        return np.concatenate([half * [-1.0, 1.0], half[-2::-1]])

    def sections(self, unit: float, width: float, apart: float, source: str) -> tuple[Array, Array, Array]:
        if not width / unit <= WIDEST:
            found = f"a band whose width is {width / unit:.2f} of half the loop's length"
            raise TrackingError(source, found, self.needed, f"at most {WIDEST:g}: take a longer strip")
        middle = self.middle
        near = 2.0 * np.abs(middle[:, 0]) * unit < apart
        # Beside the clamp the layers are one; at the lowest point there is one layer.
        first = max(int(np.argmin(near)), round(HELD * (len(middle) // 2)))
        if first > len(middle) // 4:
            found = "a loop whose layers are apart in its lower half only"
            raise TrackingError(source, found, self.needed, "come closer, or take a longer strip")
        chosen = slice(first, len(middle) - first)
        others = replace(self, log_weight=self.log_weight + STEPS[0]), replace(self, gap=self.gap + STEPS[1])
        changes = [(other.middle - middle)[chosen] / step for other, step in zip(others, STEPS, strict=True)]
        return arc_length(middle)[chosen], middle[chosen], np.array(changes)

    def said_by(self, width: float, unit: float) -> tuple[Array, Array]:
        return np.array([0.0, 0.5 * width / unit - self.gap]), np.array([np.inf, 0.5 * thickness_sd(width) / unit])

    def is_around(self, found: Array, others: Array) -> Mask:
        low, high = found.min(axis=0) - ROOM, found.max(axis=0) + ROOM
        # The jaws may have the strip's tone.
        return np.asarray(((others > low) & (others < high)).all(axis=1) & (np.hypot(*others.T) > JAWS))

    def changed(self, by: Array) -> HangingLoop:
        log_weight = float(np.clip(self.log_weight + np.clip(by[0], -MOST, MOST), *np.log(WEIGHTS)))
        return replace(self, log_weight=log_weight, gap=float(np.clip(self.gap + by[1], 0.0, WIDEST)))


@dataclass(frozen=True, eq=False, kw_only=True)
class FittedLoop(ShapeFit):
    """A fitted loop, pixels; ``length`` between the clamp's edges, which are at ``top``, ``height`` over ``foot``.

    ``points``, shape (n, 2), and ``arc``: measured middles.
    """

    kind: Kind
    length: float
    height: float
    top: Array
    foot: Array
    points: Array
    arc: Array

    @property
    def method(self) -> str:  # type: ignore[override]
        return self.kind

    def rows(self, scale: float) -> Rows:
        return [
            ("loop", f"a {self.kind}"),
            ("length", metres(self.length * scale, "of the fitted loop, from clamp to clamp")),
            ("height", metres(self.height * scale, "of the clamp's edge above the lowest point")),
        ]

    def numbers(self, scale: float) -> dict[str, Any]:
        return {"length": self.length * scale, "height": self.height * scale}


def measure(image: Picture, kinds: tuple[Kind, ...], source: str = "picture", depth: Depth | None = None) -> FittedLoop:
    """Fit a hanging loop, one of ``kinds``, in an upright picture, grey values of shape (h, w).

    ``depth``: what is known of it; without it the strip is taken as seen edge-on.  Raises TrackingError: no strip, no
    loop, one that the picture cuts or that has another shape, or one that its weight hardly bends.
    """
    try:
        found = settled(image, source, depth, most_alike(image, source, depth, partial(_like_loop, kinds), HangingLoop))
    except NewtonError as error:
        raise TrackingError(source, "no heavy loop of this shape", HangingLoop.needed, HangingLoop.advice) from error
    shape, place = found.shape, found.place
    assert isinstance(shape, HangingLoop)
    _check_clamp(found, shape, source)
    turned = float(np.degrees(place.angle))
    if abs(turned) > MAX_TURN:
        said = f"a loop that hangs {abs(turned):.0f} degrees off the picture's vertical"
        raise TrackingError(source, said, f"{MAX_TURN:g} degrees or less", "turn the picture upright")
    if not np.log(WEIGHTS[0]) < shape.log_weight < np.log(WEIGHTS[1]):
        longer = shape.log_weight < 0.0
        said = f"a loop that its weight {'hardly bends' if longer else 'pulls straight'}"
        raise TrackingError(source, said, HangingLoop.needed, f"take a {'longer' if longer else 'shorter'} strip")
    # ln L* = ln half - ln a / 3.
    row = np.array([1.0, 0.0, 0.0, 0.0, -1.0 / 3.0, 0.0, 0.0])
    # Waves of the strip are no error that neighbouring sections have apart.
    waves = (WAVES_SD * place.unit) ** 2 * len(found.residual) / WAVES
    sd = float(np.sqrt(row @ found.covariance @ row * (1.0 + waves / found.variance)))
    unit = place.unit * float(np.exp(-shape.log_weight / 3.0))
    spread = float(np.exp(stdtrit(found.freedom, 0.975) * sd))
    ends = place.of(np.array([[0.0, 0.0], [0.0, shape.middle[:, 1].min()]]))
    return FittedLoop(
        depth=None if depth is None else found.seen,
        unit=unit,
        interval=(unit / spread, unit * spread),
        kind=shape.kind,
        length=2.0 * place.unit,
        height=-float(shape.middle[:, 1].min()) * place.unit,
        top=ends[0],
        foot=ends[1],
        curve=place.of(shape.middle),
        points=found.points,
        arc=found.arc * place.unit,
        residual=found.residual,
    )


def _check_clamp(found: Settled, shape: HangingLoop, source: str) -> None:
    """Refuse a loop where its ends are not seen to rise, or to hang, out of the clamp; raises TrackingError."""
    curve, reach = found.place.of(shape.middle), 0.5 * found.width + 1.0
    beside = curve[1 : int(np.argmin(np.abs(arc_length(shape.middle) - found.arc.min())))]
    beside = beside[cKDTree(found.points).query(beside, distance_upper_bound=2.0 * reach)[0] > 2.0 * reach]
    if not len(beside):
        if shape.kind == "heart":
            said = "a loop whose ends are hidden by the strip's width"
            raise TrackingError(source, said, shape.needed, "come closer, or take a longer strip")
        return
    share = float(np.mean(cKDTree(found.band).query(beside)[0] < reach))
    if share < MIN_BESIDE:
        said = f"a strip on {share:.0%} of the loop's outline beside the clamp"
        raise TrackingError(source, said, f"{MIN_BESIDE:.0%} or more; {shape.needed}", shape.advice)


def _like_loop(
    kinds: tuple[Kind, ...], mask: NDArray[np.uint8], where: tuple[slice, slice], hole: Mask, seen: Depth
) -> Alike | None:
    """The upright loop whose inside is most like a hole."""
    rows, columns = (inside + part.start for inside, part in zip(np.nonzero(hole), where, strict=True))
    area, centre, bands = float(len(rows)), np.array([columns.mean(), rows.mean()]), _bands(mask, rows, columns)
    best: Alike | None = None
    for kind in kinds:
        for log_weight in TRIED:
            shape = HangingLoop(kind, float(log_weight), 0.0)
            middle = shape.middle
            # A first guess: the unit by the area that the middle encloses.
            encloses = float(cv2.contourArea(middle.astype(np.float32)))
            place, width = Place(float(np.sqrt(area / encloses)), float(centre[0]), float(centre[1]), 0.0, 1.0), 1.0
            for _ in range(MATCHES):
                width, uneven = _width(bands, middle, place, seen)
                shape = replace(shape, gap=0.5 * width / place.unit)
                its, start = _inside(shape, place, width, seen)
                its_area = float(its.sum())
                if its_area == 0.0:
                    place = replace(place, unit=1.2 * place.unit)
                    continue
                grows = float(np.clip(np.sqrt(area / its_area), 0.8, 1.25))
                y, x = np.nonzero(its)
                away = centre - (np.array([x.mean(), y.mean()]) + start)
                place = replace(place, unit=grows * place.unit, x=place.x + away[0], y=place.y + away[1])
            its, start = _inside(shape, place, width, seen)
            alike = overlap(hole, where, its, start) - UNEVEN * uneven
            if best is None or alike > best.overlap:
                best = Alike(shape, place, width, alike)
    return best


def _bands(mask: NDArray[np.uint8], rows: Index, columns: Index) -> Array:
    """Width of the band below, left and right of a hole's pixels."""
    low, left, right = (int(i) for i in (np.argmax(rows), np.argmin(columns), np.argmax(columns)))
    ways = (
        mask[rows[low] + 1 :, columns[low]],
        mask[rows[left], : columns[left]][::-1],
        mask[rows[right], columns[right] + 1 :],
    )
    return np.array([float(np.argmin(np.append(way, 0))) for way in ways])


def _width(bands: Array, middle: Array, place: Place, seen: Depth) -> tuple[float, float]:
    """The band's own width, by those below, left and right of the hole, and their scatter as a share of the widest."""
    lowest, left, right = len(middle) // 2, int(np.argmin(middle[:, 0])), int(np.argmax(middle[:, 0]))
    places = place.of(middle[[lowest, left, right]])
    across = np.concatenate([place.direction(of) for of in ((0.0, 1.0), (1.0, 0.0), (1.0, 0.0))])
    own = bands - seen.widening * seen.aside(places, across)
    return max(float(np.median(own)), 1.0), float(np.ptp(own) / max(bands.max(), 1.0))


def _inside(shape: HangingLoop, place: Place, width: float, seen: Depth) -> tuple[NDArray[np.uint8], Array]:
    """What is seen through a loop: inside of both its edges; a mask, and the place of its first pixel."""
    middle = shape.middle
    across = normals(middle)
    side = np.sign(across[len(middle) // 2, 1])  # towards the inside, above the lowest point
    inner = middle + side * 0.5 * width / place.unit * across
    # Beside the clamp the layers hide each other.
    inner = place.of(inner[inner[:, 0] * middle[:, 0] >= 0.0]) - seen.foot
    return filled([seen.foot + (1.0 + factor * seen.widening) * inner for factor in (0.5, -0.5)])
