"""A dimensionless shape fitted to the band of a strip in a picture, by both of its edges.

Unknown are the shape's unit, its place, the picture's rotation, and a few parameters of the shape.  The hole that the
strip encloses is compared with the shape's; then both edges of the band are measured on sections along the fitted
curve, without those where layers are too near to each other.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.measure import label, regionprops
from skimage.segmentation import clear_border

from stripfold.base.arrays import Array, Mask, Picture
from stripfold.base.errors import TrackingError
from stripfold.files.reporting import Rows
from stripfold.film.fitted import EDGE_SD, THICKNESS_SD, WIDTH_SD
from stripfold.film.line import edges_at, locate, rounded
from stripfold.film.line_kernels import inside, normals
from stripfold.film.segmentation import closed, foreground, piece_along, reduced, second_edge, unreduced

MIN_OVERLAP = 0.75
"""Least overlap of a hole with what a shape encloses (intersection over union)."""
MIN_HOLE = 100
"""Least area of a hole, pixels."""
MIN_FOUND = 0.85, 0.75
"""Least share of the sections on which the strip is found: edge-on, and where its face may be seen."""
ITERATIONS, LOCATED = 10, 3
"""Iterations of the fit, and those first ones in which the band is searched for around the curve."""
FIRST_BLUR = 1.5
"""Standard deviation of the blur before it is measured, pixels."""
GAP = 4.0, 3.0
"""Least gap between the layers on a section: pixels, and for each pixel of blur; nearer ones shift their edges."""
MAX_WIDENING = 0.3
"""Largest distance of both edges over that of the middle from the camera's foot: strips of a third of its distance."""
WIDENINGS = 0.0, 0.05, 0.1, 0.15, 0.2
"""Those that are tried for the hole, before the band is measured."""
MAX_BESIDE = 0.1
"""Largest area of what is connected with the strip but not a part of it, over the strip's: shadows are larger."""


@dataclass(frozen=True, eq=False)
class Depth:
    """What is known of how far a strip reaches behind the plane of its near edge.

    ``foot``: where the camera's perpendicular meets that plane, pixels, shape (2,).  ``share``, ``sd``: the far edge is
    seen nearer to it by this share of its distance, which is the strip's width over that of the far edge's plane.
    ``thickness``: of the cloth, and its standard deviation, pixels.
    """

    foot: Array
    share: float
    sd: float
    thickness: tuple[float, float] = (0.0, np.inf)

    @property
    def widening(self) -> float:
        """Difference of both edges' places over the distance of their middle from the foot."""
        return self.share / (1.0 - 0.5 * self.share)

    def aside(self, points: Array, across: Array) -> Array:
        """Distance of the foot from points of the middle along unit vectors, both of shape (n, 2): shape (n,)."""
        return np.abs(np.einsum("ij,ij->i", points - self.foot, across))

    def edges(self, curve: Array, points: Array, across: Array) -> Array:
        """Where both edges of a strip cross sections through ``points``, along ``across``, shape (2, n); nan: nowhere.

        ``curve``: the middle of the band, shape (m, 2), on which the points are.
        """
        if not self.widening:
            return np.zeros((2, len(points)))
        along, index = np.column_stack([across[:, 1], -across[:, 0]]), np.arange(len(points))
        found = []
        for factor in (0.5, -0.5):
            edge = self.foot + (1.0 + factor * self.widening) * (curve - self.foot)
            away = edge - points[:, None]
            ahead, aside = np.einsum("ijk,ik->ij", away, along), np.einsum("ijk,ik->ij", away, across)
            crosses = (ahead[:, :-1] <= 0.0) != (ahead[:, 1:] <= 0.0)
            j = np.where(crosses, np.abs(aside[:, 1:]), np.inf).argmin(axis=1)
            part = ahead[index, j] / np.where(crosses[index, j], ahead[index, j] - ahead[index, j + 1], np.nan)
            found.append((1.0 - part) * aside[index, j] + part * aside[index, j + 1])
        return np.array(found)

    def fitted(self, widths: Array, aside: Array, sd: float) -> tuple[float, Depth]:
        """The band's own width, and what is known with its ``widths`` on sections, shape (n,), pixels, each of ``sd``.

        A face of the strip that is seen widens the band by the distance of its edges, a share of ``aside``.
        """
        design = np.column_stack([np.ones_like(aside), aside])
        weights = np.ones_like(widths)
        usual = np.array([self.thickness[0], self.widening])
        prior = np.diag(1.0 / np.square([self.thickness[1], self.sd]))
        for _ in range(6):
            normal = (design.T * weights) @ design / sd**2 + prior
            found = np.linalg.solve(normal, design.T @ (weights * widths) / sd**2 + prior @ usual)
            residual = widths - design @ found
            sigma = max(1.4826 * float(np.median(np.abs(residual))), 0.2)
            weights = 1.0 / (1.0 + (residual / (2.4 * sigma)) ** 2)
        own, widening = max(float(found[0]), 1.0), float(np.clip(found[1], 0.0, MAX_WIDENING))
        share, share_sd = widening / (1.0 + 0.5 * widening), float(np.sqrt(np.linalg.inv(normal)[1, 1]))
        known = replace(self, share=share, sd=share_sd)
        return own, known


@dataclass(frozen=True, eq=False, kw_only=True)
class ShapeFit(ABC):
    """A heavy elastica fitted to a strip in a picture; lengths in pixels.

    ``unit``, ``interval``: L* and its 95 % interval.  ``curve``: the middle of the fitted strip, shape (m, 2).
    ``residual``: measured less fitted, normal to it, shape (n,).  ``depth``: what is known of it with the band's width.
    """

    method: ClassVar[str]
    depth: Depth | None = None
    unit: float
    interval: tuple[float, float]
    curve: Array
    residual: Array

    @property
    def rms(self) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @abstractmethod
    def rows(self, scale: float) -> Rows:
        """What is special to the method, in words, with ``scale`` metres per pixel."""

    @abstractmethod
    def numbers(self, scale: float) -> dict[str, Any]:
        """The same by name, SI."""


@dataclass(frozen=True)
class Place:
    """Where the loop is: unit, origin (the lift-off point), rotation in the picture (rad), and on which side it is."""

    unit: float
    x: float
    y: float
    angle: float
    side: float

    def direction(self, of: tuple[float, float]) -> Array:
        """The unit vector in pixels of one of the dimensionless loop, shape (1, 2)."""
        return (self.of(np.array([of])) - [self.x, self.y]) / self.unit

    def of(self, points: Array) -> Array:
        """Pixels of points of the dimensionless loop, shape (n, 2)."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.asarray([self.x, self.y] + self.unit * (points * [self.side, -1.0]) @ np.array([[c, s], [-s, c]]))

    def back(self, pixels: Array) -> Array:
        """Points of the dimensionless loop of pixels, shape (n, 2)."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.asarray((pixels - [self.x, self.y]) @ np.array([[c, -s], [s, c]]) / self.unit * [self.side, -1.0])

    def moved(self, change: Array) -> Place:
        """Changed by a relative change of the unit, x, y and the angle."""
        scale, x, y, turn = change.tolist()
        return Place(self.unit * float(np.exp(scale)), self.x + x, self.y + y, self.angle + turn, self.side)

    def slopes(self, points: Array, across: Array) -> Array:
        """Change of pixels of ``points`` along ``across`` by that of the unknowns in :meth:`moved`, shape (n, 4)."""
        arm = points - [self.x, self.y]
        turning = across[:, 1] * arm[:, 0] - across[:, 0] * arm[:, 1]
        return np.column_stack([np.einsum("ij,ij->i", arm, across), across, turning])


class Shape(ABC):
    """One of a family of dimensionless shapes with k parameters; layers meet, or nearly, at its origin.

    ``name``, ``unit_name``: in words.  ``needed``, ``advice``, ``crooked``: what a picture has to show, how, and why it
    may have another shape.  ``toward``: the direction in which the layers are near each other at the origin.
    ``largest_misfit``: largest root mean square of the residuals, over the unit.  ``most_holes``: number of the largest
    holes of a picture that are compared.  ``least_found``: least share of the sections on which the strip is found,
    edge-on, and where its face may be seen.
    """

    name: ClassVar[str]
    unit_name: ClassVar[str]
    needed: ClassVar[str]
    advice: ClassVar[str]
    crooked: ClassVar[str]
    toward: ClassVar[tuple[float, float]]
    largest_misfit: ClassVar[float]
    most_holes: ClassVar[int | None] = None
    least_found: ClassVar[tuple[float, float]] = MIN_FOUND

    @property
    @abstractmethod
    def middle(self) -> Array:
        """The middle of the band, shape (m, 2)."""

    @abstractmethod
    def sections(self, unit: float, width: float, apart: float, source: str) -> tuple[Array, Array, Array]:
        """Arc lengths, (n,), places where layers are ``apart``, (n, 2), and their change by the parameters, (k, n, 2).

        ``unit``, ``width``, ``apart``: pixels; the middles of both layers are to be so far from each other.  Raises
        TrackingError: there is no such place, or the band is too wide.
        """

    @abstractmethod
    def said_by(self, width: float, unit: float) -> tuple[Array, Array]:
        """What a band's width, pixels, says of the parameters: their change, and its standard deviation, shape (k,)."""

    @abstractmethod
    def is_around(self, found: Array, others: Array) -> Mask:
        """Which of the ``others`` may be no part of the strip, of places that were ``found``, shapes (n, 2)."""

    @abstractmethod
    def changed(self, by: Array) -> Self:
        """The shape with other parameters."""


def thickness_sd(width: float) -> float:
    """Uncertainty of a strip's thickness by the width of its band, pixels."""
    return float(np.hypot(THICKNESS_SD[0], THICKNESS_SD[1] * width))


class Alike(NamedTuple):
    """A shape whose inside is like a hole in a picture: its place, the width of its band, pixels, and the overlap of
    both insides, intersection over union.
    """

    shape: Shape
    place: Place
    width: float
    overlap: float


class Begin(NamedTuple):
    """Where a shape is in a picture, whether its band is bright and faint, and how much of it is its face."""

    alike: Alike
    bright: bool
    faint: bool
    seen: Depth


Match = Callable[[NDArray[np.uint8], tuple[slice, slice], Mask, Depth], Alike | None]
"""Finds the shape like a hole: takes the band's mask, where the hole is in it, the hole, and how a face is seen."""


def most_alike(image: Picture, source: str, depth: Depth | None, match: Match, kind: type[Shape]) -> Begin:
    """The hole of a picture that is most like the inside of a shape of this kind.

    ``depth``: what is known of it; without it the strip is taken as seen edge-on.  Raises TrackingError: there is none.
    """
    small, scale = reduced(image)
    tried = [Depth(np.zeros(2), 0.0, 0.0)]
    if depth is not None:
        foot = (depth.foot + 0.5) / scale - 0.5
        tried = [Depth(foot, widening / (1.0 + 0.5 * widening), depth.sd) for widening in WIDENINGS]
    best: Begin | None = None
    most = 0.0
    # Of something else in the picture that stands out more, as a ruler, the strip is told by its hole.
    for faint, bright in ((False, True), (False, False), (True, True), (True, False)):
        if faint and most >= MIN_OVERLAP:
            break
        mask = closed(foreground(small, bright, faint, depth is not None)[0])
        holes = regionprops(clear_border(label(mask == 0, connectivity=1)))
        for hole in sorted(holes, key=lambda hole: -hole.area)[: kind.most_holes]:
            if hole.area < MIN_HOLE:
                break
            for seen in tried:
                alike = match(mask, hole.slice, hole.image, seen)
                if alike is not None and alike.overlap > most:
                    best, most = Begin(alike, bright, faint, seen), alike.overlap
    if best is None:
        raise TrackingError(source, "the strip encloses no loop inside the picture", kind.needed, kind.advice)
    if most < MIN_OVERLAP:
        found = f"no {kind.name}: what is most like one shares {most:.0%} of its inside"
        raise TrackingError(source, found, kind.needed, kind.advice)
    (shape, place, width, overlap), bright, faint, seen = best
    (x, y), factor = unreduced(np.array([place.x, place.y]), scale).tolist(), float(scale.mean())
    place = replace(place, unit=place.unit * factor, x=x, y=y)
    seen = replace(seen, foot=unreduced(seen.foot, scale))
    return Begin(Alike(shape, place, width * factor, overlap), bright, faint, seen)


def filled(outlines: Sequence[Array]) -> tuple[NDArray[np.uint8], Array]:
    """What lies inside of all outlines, pixels, shape (n, 2) each: a mask, and the place of its first pixel."""
    first = outlines[0]
    start, size = np.floor(first.min(axis=0)) - 1.0, np.ceil(np.ptp(first, axis=0)).astype(int) + 3
    found = np.ones(size[::-1], np.uint8)
    for outline in outlines:
        one = np.zeros_like(found)
        cv2.fillPoly(one, [np.rint(outline - start).astype(np.int32)], 1)
        found &= one
    return found, start


def overlap(hole: Mask, where: tuple[slice, slice], other: NDArray[np.uint8], start: Array) -> float:
    """Intersection over union of a hole and another mask, whose first pixel is at ``start``."""
    corner = np.array([where[1].start, where[0].start])
    low = np.minimum(corner, start).astype(int)
    high = np.maximum(corner + hole.shape[::-1], start + other.shape[::-1]).astype(int)
    both = np.zeros((2, *(high - low)[::-1]), bool)
    for on, mask, place in zip(both, (hole, other), (corner, start), strict=True):
        x, y = place.astype(int) - low
        on[y : y + mask.shape[0], x : x + mask.shape[1]] = mask
    return float(both.all(axis=0).sum() / both.any(axis=0).sum())


class Settled(NamedTuple):
    """A shape fitted to the edges of a band; pixels.

    ``points``, shape (n, 2), ``arc`` and ``residual``, shape (n,): measured middles, where they are along the shape,
    and measured less fitted; ``band``: all pixels of the strip, shape (m, 2).  ``covariance``: of the relative change
    of the unit, x, y, the angle, the k parameters, and a shift of all sections, where the error of a section has this
    ``variance``; ``freedom``: degrees of it.
    """

    shape: Shape
    place: Place
    width: float
    seen: Depth
    points: Array
    arc: Array
    residual: Array
    band: Array
    covariance: Array
    variance: float
    freedom: float


def settled(image: Picture, source: str, depth: Depth | None, begin: Begin) -> Settled:
    """Fit a shape to both edges of a band in an upright picture, grey values of shape (h, w).

    ``depth``: as of :func:`most_alike`.  Raises TrackingError: its edges are not seen, the picture cuts it, it has
    another shape, or something is beside it.
    """
    (shape, place, width, _), bright, faint, seen = begin
    blur, least = FIRST_BLUR, shape.least_found[depth is not None]
    for iteration in range(ITERATIONS):
        below = seen.widening * float(seen.aside(place.of(np.zeros((1, 2))), place.direction(shape.toward))[0])
        apart = GAP[0] + GAP[1] * blur + width + below
        arc, there, by_parameters = shape.sections(place.unit, width, apart, source)
        points = place.of(there)
        if not inside(points, image.shape, width).all():
            advice = "leave some room around the loop"
            raise TrackingError(source, "the picture's border cuts the loop", shape.needed, advice)
        across = normals(points)
        sides = seen.edges(place.of(shape.middle), points, across)
        usable = np.isfinite(sides).all(axis=0)
        points, across, there, arc = (x[usable] for x in (points, across, there, arc))
        near, far = sides[:, usable]
        expected, face = points + 0.5 * (near + far)[:, None] * across, np.abs(near - far)
        widths, offset = width + face, np.zeros(len(points))
        if iteration < LOCATED:
            # The hole's outline is off by its roughness, and a thin band has to lie in the middle of its sections.
            reach = max(width, 6.0, 0.06 * place.unit)
            offset = locate(image, expected, across, rounded(widths), reach, bright, 3)
        edges = edges_at(image, expected + offset[:, None] * across, across, widths, bright)
        band = widths * (float(np.median((edges.width / widths)[edges.found])) if edges.found.any() else 1.0)
        contrast = np.median(edges.contrast)
        good = edges.found & (np.abs(edges.width - band) < 0.5 * band) & (edges.contrast > 0.4 * contrast)
        if good.mean() < (least if iteration >= LOCATED else 0.5):
            found = f"edges of a strip on {good.mean():.0%} of the outline of the loop"
            raise TrackingError(source, found, f"{least:.0%} or more of them", shape.advice)
        # Blur moves both edges of a bend towards its inside, by half of its variance times the curvature.
        blur = float(np.median((edges.noise * edges.contrast)[good]) / np.sqrt(np.pi))
        bend = _curvature(points)
        offset = (offset + edges.offset - 0.5 * blur**2 * bend)[good]
        more = [np.einsum("ij,ij->i", place.of(there + by[usable]) - points, across) for by in by_parameters]
        slopes = np.column_stack([place.slopes(points, across), *more, np.ones(len(points))])[good]
        change, covariance, variance, freedom = _robust(slopes, offset, *shape.said_by(width, place.unit))
        place = place.moved(change[:4])
        if depth is None:
            width = float(np.median(edges.width[good]))
        elif iteration >= LOCATED - 1:
            aside = face / seen.widening if seen.widening else seen.aside(points, across)
            width, seen = depth.fitted(edges.width[good], aside[good], WIDTH_SD)
        shape = shape.changed(change[4:-1])
    residual = offset - slopes @ change
    misfit = float(np.sqrt(np.mean(residual**2))) / place.unit
    if misfit > shape.largest_misfit:
        found = f"the best {shape.name} is {misfit:.1%} of {shape.unit_name} off"
        raise TrackingError(source, found, f"{shape.largest_misfit:.0%} or less; {shape.needed}", shape.crooked)
    band, _, beside = piece_along(image, points, widths, bright, faint, face=depth is not None)
    beside = beside[shape.is_around(place.back(points), place.back(band))]
    share = float(beside.sum() / max((~beside).sum(), 1))
    if share > MAX_BESIDE:
        raise second_edge(share, source, shape.needed)
    middles = points[good] + offset[:, None] * across[good]
    return Settled(shape, place, width, seen, middles, arc[good], residual, band, covariance, variance, freedom)


def _curvature(points: Array) -> Array:
    """Second derivative along the normals of equally spaced points, shape (n,), 0 at both ends; 1 / pixel."""
    step = np.diff(points, axis=0)
    second = np.diff(step, axis=0) / float(step[0] @ step[0])
    return np.pad(np.einsum("ij,ij->i", second, normals(points)[1:-1]), 1)


def _robust(slopes: Array, offset: Array, usual: Array, sd: Array) -> tuple[Array, Array, float, float]:
    """Least squares with Cauchy weights and priors: of the parameters, with their sd, and of a shift of all sections.

    Returns the change of the unknowns, its covariance, a section's variance in it, and the degrees of freedom:
    correlated neighbours count once.
    """
    design = np.vstack([slopes, np.eye(slopes.shape[1])[4:]])
    values = np.concatenate([offset, usual, [0.0]])
    priors = np.append(sd, EDGE_SD)
    # All but the shift.
    fitted = slopes.shape[1] - 1
    weights, variance = np.ones(len(values)), EDGE_SD**2
    for _ in range(6):
        weights[len(offset) :] = variance / priors**2
        inverse = np.linalg.inv(design.T @ (weights[:, None] * design))
        change = inverse @ (design.T @ (weights * values))
        residual = offset - slopes @ change
        block = correlation_length(residual)
        freedom = max(len(residual) / block - fitted, 1.0)
        scatter = float(weights[: len(offset)] @ residual**2) / float(weights[: len(offset)].sum())
        variance = scatter * block * (freedom + fitted) / freedom
        sigma = max(1.4826 * float(np.median(np.abs(residual))), 0.5 * EDGE_SD)
        weights[: len(offset)] = 1.0 / (1.0 + (residual / (2.4 * sigma)) ** 2)
    return np.asarray(change), np.asarray(inverse * variance), variance, freedom


def correlation_length(residual: Array) -> int:
    """Number of neighbours that are correlated: twice the summed autocorrelation up to its first zero."""
    n = len(residual)
    centred = residual - residual.mean()
    autocorrelation = np.correlate(centred, centred, "full")[n - 1 : n - 1 + n // 2]
    if autocorrelation[0] == 0.0:
        return 1
    positive = autocorrelation[: np.argmax(np.append(autocorrelation, 0.0) <= 0.0)]
    return int(np.clip(np.ceil(2.0 * positive.sum() / autocorrelation[0] - 1.0), 2, n // 4))
