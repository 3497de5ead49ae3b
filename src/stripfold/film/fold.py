"""The universal folded loop fitted to a picture of a strip folded in half, seen from the side.

Without friction all folds have one shape, that of the heavy elastica: its unit is L*, its origin the lift-off point.
The distance of the layers where they meet, which is roughly the width of the band, is fitted, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from stripfold import elastica
from stripfold.base.arrays import Array, Mask, Picture
from stripfold.base.errors import TrackingError
from stripfold.files.reporting import Rows, metres
from stripfold.film.line_kernels import normals
from stripfold.film.shape import (
    Alike,
    Depth,
    Place,
    Shape,
    ShapeFit,
    filled,
    most_alike,
    overlap,
    settled,
    thickness_sd,
)

MAX_THICKNESS = 0.3
"""Largest thickness, L*."""
SECTIONS = 200
MAX_MISFIT = 0.02
"""Largest root mean square of the residuals, L*."""
FINE = 100.0
"""Pixels of one L* in which the loop's own inside is drawn."""
MAX_HIDDEN = 0.6
"""Largest height above the lower layer, L*, that the gap between the layers and the thickness may take."""
ROOM = 0.4
"""How far around the loop other things are looked for, L*."""


@dataclass(frozen=True)
class FoldedLoop(Shape):
    """The loop of a strip folded in half, L*; its parameter is the distance of the layers where they meet."""

    thickness: float
    name, unit_name, crooked = "loop of a folded strip", "L*", "is it folded without a crease?"
    needed = "a strip folded in half that lies on a table, seen from the side, with light through its loop"
    advice = (
        "turn the camera along the fold; background much darker or brighter than the strip, nothing beside its loop"
    )
    toward, largest_misfit = (0.0, 1.0), MAX_MISFIT

    @property
    def middle(self) -> Array:
        return outline(self.thickness)

    def sections(self, unit: float, width: float, apart: float, source: str) -> tuple[Array, Array, Array]:
        if not width / unit <= MAX_THICKNESS:
            found = f"a band whose width is {width / unit:.2f} of the loop's L*"
            raise TrackingError(source, found, self.needed, f"the strip may be {MAX_THICKNESS:g} L* thick at most")
        if apart / unit > MAX_HIDDEN:
            found = f"the loop's L* has {unit:.0f} pixels: too small"
            raise TrackingError(source, found, self.needed, "come closer")
        arc, places, by_thickness = visible(self.thickness, apart / unit)
        return arc, places, by_thickness[None]

    def said_by(self, width: float, unit: float) -> tuple[Array, Array]:
        return np.array([width / unit - self.thickness]), np.array([thickness_sd(width) / unit])

    def is_around(self, found: Array, others: Array) -> Mask:
        low, high = [found[:, 0].min(), 0.0], found.max(axis=0) + ROOM
        return np.asarray(((others > low) & (others < high)).all(axis=1))

    def changed(self, by: Array) -> FoldedLoop:
        return FoldedLoop(float(np.clip(self.thickness + by[0], 0.0, MAX_THICKNESS)))


@dataclass(frozen=True, eq=False, kw_only=True)
class Fold(ShapeFit):
    """A fitted loop, pixels; ``sd`` is that of the logarithm of ``unit``.

    ``height`` of the upper layer's middle above the lower one's, from ``foot`` to ``top``, shape (2,); ``width`` of the
    band; ``thickness`` between the layers where they meet.  ``points``, shape (n, 2), and ``arc``: measured middles.
    """

    method = "fold"
    sd: float
    height: float
    width: float
    thickness: float
    top: Array
    foot: Array
    points: Array
    arc: Array

    def rows(self, scale: float) -> Rows:
        return [("height", metres(self.height * scale, "of the fitted loop, between layers' middles"))]

    def numbers(self, scale: float) -> dict[str, Any]:
        return {"height": self.height * scale, "height_sd": self.height * scale * self.sd}


def measure(image: Picture, source: str = "picture", depth: Depth | None = None) -> Fold:
    """Fit the loop of a folded strip in an upright picture, grey values of shape (h, w).

    ``depth``: what is known of it; without it the strip is taken as seen edge-on.  Raises TrackingError: no strip, no
    loop, one that the picture cuts, or one that has not the shape of a fold.
    """
    found = settled(image, source, depth, most_alike(image, source, depth, _like_fold, FoldedLoop))
    place, shape = found.place, found.shape
    assert isinstance(shape, FoldedLoop)
    curve = shape.middle
    top = curve[np.argmax(curve[:, 1])]
    ends = place.of(np.array([top, [top[0], 0.0]]))
    sd = float(np.sqrt(found.covariance[0, 0]))
    spread = float(np.exp(stdtrit(found.freedom, 0.975) * sd))
    return Fold(
        depth=None if depth is None else found.seen,
        unit=place.unit,
        interval=(place.unit / spread, place.unit * spread),
        sd=sd,
        height=float(top[1]) * place.unit,
        width=found.width,
        thickness=shape.thickness * place.unit,
        top=ends[0],
        foot=ends[1],
        curve=place.of(curve),
        points=found.points,
        arc=found.arc * place.unit,
        residual=found.residual,
    )


def _moments(mask: Mask) -> tuple[float, Array, float, float]:
    """Area, centre, direction of the longest axis (rad, within a quarter turn of x), and skewness along it."""
    points = np.column_stack(np.nonzero(mask))[:, ::-1].astype(np.float64)
    centre = points.mean(axis=0)
    away = points - centre
    axis = np.linalg.eigh(away.T @ away)[1][:, 1]
    axis = axis if axis[0] >= 0.0 else -axis
    along = away @ axis
    skewness = float(np.mean(along**3) / np.mean(along**2) ** 1.5)
    return float(len(points)), centre, float(np.arctan2(axis[1], axis[0])), skewness


def _like_fold(mask: NDArray[np.uint8], where: tuple[slice, slice], hole: Mask, seen: Depth) -> Alike | None:
    """The loop whose inside has the area, centre, direction and skewness of a hole.

    None: through a loop that is as wide as it nothing is seen.
    """
    area, centre, angle, skewness = _moments(hole)
    top, left = where[0].start, where[1].start
    highest = int(hole.argmax(axis=0).argmin())
    above = mask[: top + int(hole[:, highest].argmax()), left + highest][::-1]
    band = float(np.argmin(np.append(above, 0)))
    thickness, place = 0.05, None
    for _ in range(8):
        within = FINE * inside_of(thickness, place, seen)
        if not within.size:
            return None
        corner = within.min(axis=0)
        shape = np.zeros(np.ceil(np.ptp(within, axis=0)).astype(int)[::-1] + 2, np.uint8)
        cv2.fillPoly(shape, [np.rint(within - corner).astype(np.int32)], 1)
        its_area, its_centre, its_angle, its_skewness = _moments(shape > 0)
        unit = FINE * float(np.sqrt(area / its_area))
        side = 1.0 if skewness * its_skewness > 0.0 else -1.0
        place = Place(unit, 0.0, 0.0, angle + side * its_angle, side)
        x, y = centre + np.array([left, top]) - place.of((its_centre + corner)[None] / FINE)[0]
        place = replace(place, x=float(x), y=float(y))
        crown = place.of(loop(thickness)[None, 400, 1:])
        face = seen.widening * float(seen.aside(crown, place.direction((0.0, 1.0)))[0])
        width = max(band - face, 1.0)
        thickness = min(width / unit, MAX_THICKNESS)
    assert place is not None
    within = inside_of(min(width / place.unit, MAX_THICKNESS), place, seen)
    alike = overlap(hole, where, *filled([place.of(within)])) if within.size else 0.0
    return Alike(FoldedLoop(width / place.unit), place, width, alike)


@cache
def _table() -> tuple[Array, Array]:
    """Thicknesses, shape (4,), and loops with them, arc length, x and z at equal shares, shape (4, 801, 3); L*."""
    thickness = np.linspace(0.0, MAX_THICKNESS, 4)
    loops = []
    for value in thickness:
        state = elastica.folded_loop(float(value)).state
        profile = state.at(np.linspace(0.0, state.length, 801))
        loops.append(np.column_stack([profile.s, profile.x, profile.z]))
    return thickness, np.array(loops)


def loop(thickness: float) -> Array:
    """Arc length, x and z of the loop of a strip of this thickness, shape (801, 3), by cubic interpolation; L*."""
    at, loops = _table()
    weights = [np.prod([(thickness - b) / (a - b) for b in at if b != a]) for a in at]
    return np.einsum("k,kij->ij", np.array(weights), loops)


def outline(thickness: float) -> Array:
    """The loop with the lower layer under it, shape (1100, 2), L*."""
    middle = loop(thickness)[:, 1:]
    return np.concatenate([np.column_stack([np.linspace(middle[-1, 0], 0.0, 300)[:-1], np.zeros(299)]), middle])


def visible(thickness: float, high: float) -> tuple[Array, Array, Array]:
    """Arc lengths, shape (n,), places and their change with the thickness, shape (n, 2), from ``high`` up; L*."""
    middle = loop(thickness)
    falling = middle[np.argmax(middle[:, 2]) :]
    last = falling[falling[:, 2] > high][-1]
    s = np.linspace(last[1], last[0], SECTIONS)
    nearby = [loop(thickness + step) for step in (0.0, 0.01)]
    share = np.maximum(s, 0.0) / middle[-1, 0]
    here, there = (
        np.column_stack([np.interp(share, one[:, 0] / one[-1, 0], one[:, i]) for i in (1, 2)]) for one in nearby
    )
    here[:, 0] += np.minimum(s, 0.0)
    there[:, 0] += np.minimum(s, 0.0)
    return s, here, (there - here) / 0.01


def inside_of(thickness: float, place: Place | None, seen: Depth) -> Array:
    """Outline of the hole that the loop encloses, shape (n, 2), 0 without one; L*.  At a ``place`` a face is seen."""
    middle = loop(thickness)[:, 1:]
    away, lower = np.full(len(middle), 0.5 * thickness), 0.5 * thickness
    if place is not None:
        here = replace(seen, foot=place.back(seen.foot[None])[0])
        away += 0.5 * here.widening * here.aside(middle, normals(middle))
        lower += 0.5 * here.widening * abs(float(here.foot[1]))
    inner = middle + away[:, None] * normals(middle)
    inner = inner[(inner[:, 1] > lower) & (np.arange(len(inner)) > 10)]
    if not inner.size:
        return inner
    return np.concatenate([inner, [[inner[-1, 0], lower], [inner[0, 0], lower]]])
