"""What holds the strip, found in pictures: a fiducial marker, or a part of the gripper boxed in the first frame.

Both are a known pattern, fitted to the grey values by Gauss-Newton iterations with Tukey's biweight, which rejects
what covers it.  Unknown are the pattern's motion, a gain and an offset that vary smoothly over it (lighting, shadows),
and of a marker the blur: the pattern of square cells, blurred by a Gaussian, and its derivatives have closed forms.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import ndtr

from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import InvalidInputError
from stripfold.film import boards, video
from stripfold.film.boards import Refinement, refine
from stripfold.film.camera import transform
from stripfold.film.recording import Entries, MarkerEntry

CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
"""The corners in the pattern's own frame, in sides, in OpenCV's order."""
TUKEY = 4.685
"""Constant of Tukey's biweight: 95 % as efficient as least squares."""
TOLERANCE, ITERATIONS = 0.03, 30
"""Movement of the centre, pixels, that ends the iteration: the next one would be a tenth of it; most iterations."""
REACH = 0.2
"""How far the centre may move in a fit, sides."""
SCALE = 0.03
"""Least scale of the residuals over the contrast: neither interpolation nor the light is exactly so."""
MIN_SD = 0.003
"""Least standard deviation of the centre, pixels: the first frame fits itself exactly."""
_KERNEL = np.clip(1.5 - np.abs(np.arange(-5, 6)) / 4.0, 0.0, 1.0)
"""Weight of products of residuals by their distance in samples: neighbours are correlated."""
_CORRELATED = 7.0
"""Samples per independent value of the noise, after smoothing and interpolation."""

MARKER_WINDOW = 0.08
"""Half-window of the corners' refinement over the marker's side: half a cell of the largest markers."""
_ENLARGED, _MAX_ENLARGED = (1, 2, 3), 2000
"""Magnifications tried in turn for detection, up to this longest side, pixels."""
_RIM = 0.5
"""Width of the white rim that is fitted too, cells."""
_MIN_SAMPLES, _MAX_SAMPLES = 24, 28
"""Sample points along a marker's side; between these limits about one per pixel."""
_NODES = 4, 2
"""Nodes of gain and of offset along a marker's side: with 3 of the gain the edge of a shadow moves it by 0.25 px."""
_START_BLUR, _MIN_BLUR, _MAX_BLUR = 0.8, 0.3, 1.0
"""Initial and least blur of a marker, pixels; largest, cells."""
_SAME_BLUR = 0.1
"""Change of the blur, as a share, from which its pattern is computed again; smaller ones have linear effects."""

MIN_FOUND = 0.7
"""Correlation from which a template is found in a whole picture."""
MAX_ALIKE = 0.9
"""Correlation of another place with the template, relative to the best, from which it is ambiguous."""
MIN_TEXTURE = 8.0
"""Least standard deviation of the grey values in a template, over their noise of about 1 to 3."""
MIN_SIDE = 12
"""Least side of a template, pixels."""
LEAST_SCORE = 0.98
"""Least correlation of what is not covered of a template: noise of 3 grey levels leaves this of the least texture."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A pattern found in a picture.

    ``homography``, shape (3, 3), from the pattern's own frame, in sides, to pixels; its last entry is 1.  ``blur``,
    shape (2,), standard deviation of a marker's blur along its axes, sides.  ``sd``, shape (2,), standard deviation of
    the centre, pixels.  ``score``, correlation of the picture with the pattern, 0 to 1; 0 before a fit.
    """

    homography: Array
    blur: Array
    sd: Array
    score: float

    @property
    def centre(self) -> Array:
        """Shape (2,), pixels."""
        return self.homography[:2, 2]

    @cached_property
    def corners(self) -> Array:
        """Shape (4, 2), pixels, in OpenCV's order."""
        return transform(self.homography, CORNERS)

    @cached_property
    def side(self) -> float:
        """Side in the picture, pixels: the square root of the area."""
        return float(np.sqrt(cv2.contourArea(self.corners.astype(np.float32))))

    def moved(self, shift: Array) -> Fit:
        """The pattern translated by ``shift``, shape (2,), pixels."""
        return replace(self, homography=_shifted(self.homography, shift))


def _shifted(homography: Array, shift: Array) -> Array:
    return np.asarray(homography + np.append(shift, 0.0)[:, None] * homography[2])


@dataclass(frozen=True, eq=False)
class _Pattern:
    """Grey values at points of the pattern's frame, and how they change; n points of a grid of ``shape``.

    ``places``, shape (2, n), sides; ``values``, shape (n,); ``slopes``, shape (2, n), along both axes; ``gains``,
    ``offsets``, shape (k, n): functions whose sums are gain and offset, one of a marker's offsets how far its black
    shrinks; ``bends``, shape (2, n) or (0, n): derivatives by the squared ``blur``, shape (2,), of a pattern that has
    one.  ``sigma``: standard deviation of the smoothing of the picture, pixels: it reduces the effect of interpolation.
    """

    shape: tuple[int, int]
    places: Array
    values: Array
    slopes: Array
    gains: Array
    offsets: Array
    bends: Array
    blur: Array
    perspective: bool
    sigma: float = 1.0

    @cached_property
    def rows(self) -> Array:
        """Derivatives by the motion, 6 or with a perspective 8, the gain, the offset and the blur, shape (..., n)."""
        (u, v), (by_u, by_v) = self.places, self.slopes
        motion = [by_u, by_u * u, by_u * v, by_v, by_v * u, by_v * v]
        if self.perspective:
            along = by_u * u + by_v * v
            motion += [-along * u, -along * v]
        return np.concatenate([motion, self.gains * self.values, self.offsets, self.bends])


class Holder(ABC):
    """What is followed of the gripper: a pattern with a ``name`` that is found in pictures, and fitted to them.

    Of it ``seen`` is the least mean weight of the samples, ``growth`` the largest change of the area, as a share,
    ``order`` that of the interpolation between pixels.
    """

    name: str
    seen: float
    growth: float
    order = 1

    @abstractmethod
    def find(self, picture: Picture) -> Fit | None:
        """Find the pattern anywhere in a picture, to about a pixel; None where it is not there."""

    def corners(self, picture: Picture) -> Array | None:
        """Find its corners, shape (4, 2), pixels, with sub-pixel accuracy; None where it is not there."""
        rough = self.find(picture)
        fit = None if rough is None else self.fit(picture, rough)
        return None if fit is None else fit.corners

    def fit(self, picture: Picture, start: Fit) -> Fit | None:
        """Fit the pattern to the picture near ``start``, to a few hundredths of a pixel; None where it is not there."""
        reach, pattern, blur = REACH * start.side, self._pattern(start, start.blur), start.blur
        around = transform(start.homography, CORNERS * np.ptp(pattern.places, axis=1))
        low = np.maximum(np.floor(around.min(axis=0) - reach).astype(int), 0)
        high = np.maximum(np.ceil(around.max(axis=0) + reach).astype(int) + 1, 0)
        part = picture[low[1] : high[1], low[0] : high[0]]
        if min(part.shape) < 0.25 * start.side:
            return None
        part = cv2.GaussianBlur(part.astype(np.float64), (0, 0), pattern.sigma)
        part = ndimage.spline_filter(part) if self.order > 1 else part
        homography = _shifted(start.homography, -low)
        expected = homography[:2, 2]
        rows, motions = pattern.rows, 8 if pattern.perspective else 6
        light, contrast = pattern.gains.mean(axis=1), float(np.std(pattern.values))
        weight, last = np.ones(len(pattern.values)), np.array(part.shape[::-1])[:, None] - 1.0
        for _ in range(ITERATIONS):
            places = homography[:, :2] @ pattern.places + homography[:, 2:]
            places = places[:2] / places[2]
            # OpenCV rounds places to 1/32 pixel.
            values = ndimage.map_coordinates(part, places[::-1], order=self.order, mode="nearest", prefilter=False)
            inside = ((places >= 0.0) & (places <= last)).all(axis=0)
            weighted = (weight * inside) * rows
            normal = weighted @ rows.T
            # Regularised: where the pattern has one colour only, gain and offset are not independent.
            normal.flat[:: len(normal) + 1] += 1e-6 * normal.diagonal() + 1e-9
            found = np.linalg.solve(normal, weighted @ values)
            residual = values - found @ rows
            gain = float(found[motions : motions + len(light)] @ light)
            scale = max(1.4826 * float(np.median(np.abs(residual))), SCALE * abs(gain) * contrast, 1e-3)
            share = inside * np.maximum(1.0 - (residual / (TUKEY * scale)) ** 2, 0.0)
            weight = share**2
            if weight.mean() < self.seen or gain <= 0.0:
                return None
            # The picture shows at a place what the pattern has this motion away.
            away, before = np.append(found[:motions] / gain, [0.0, 0.0])[:8], homography[:2, 2]
            motion = np.array([[1.0 + away[1], away[2], away[0]], [away[4], 1.0 + away[5], away[3]], [*away[6:], 1.0]])
            homography = homography @ np.linalg.inv(motion)
            homography = homography / homography[2, 2]
            area = abs(np.linalg.det(homography)) / start.side**2
            if not np.hypot(*(homography[:2, 2] - expected)) <= reach or abs(area - 1.0) > self.growth:
                return None
            settled = np.hypot(*(homography[:2, 2] - before)) < TOLERANCE
            if len(pattern.bends):
                change = pattern.blur**2 + found[-2:] / gain
                blur = np.sqrt(np.clip(change, (blur / 1.5) ** 2, (1.5 * blur) ** 2))
                again = self._pattern(start, blur)
                if again is not pattern:
                    settled, pattern, rows = False, again, again.rows
            if settled:
                break
        else:
            return None
        score = self._score(pattern, values, residual, weight)
        if score <= 0.0:
            return None
        # The weights change with the residuals: the biweight's influence rises by less than they say.
        rise = max(float(np.sum(share * (5.0 * share - 4.0)) / np.sum(weight)), 0.2)
        turn = homography[:2, :2] - np.outer(homography[:2, 2], homography[2, :2])
        shifts = np.linalg.solve(normal, np.eye(len(normal))[:, [0, 3]]).T
        influence = turn @ shifts @ rows * (weight * residual) / (gain * rise)
        sd = np.maximum(_centre_sd(influence.reshape(2, *pattern.shape), len(found)), MIN_SD)
        return Fit(_shifted(homography, low), blur, sd, score)

    @abstractmethod
    def _pattern(self, start: Fit, blur: Array) -> _Pattern:
        """The pattern near a fit, with this blur or nearly so."""

    @abstractmethod
    def _score(self, pattern: _Pattern, values: Array, residual: Array, weight: Array) -> float:
        """Correlation with the pattern; 0 where it is too small."""


def _centre_sd(influence: Array, unknowns: int) -> Array:
    """Standard deviation of the centre, shape (2,), pixels, allowing for correlated residuals.

    ``influence``, shape (2, m, n), is the contribution of each sample; products of neighbours are summed too.
    """
    n = influence[0].size
    around = [cv2.sepFilter2D(one, -1, _KERNEL, _KERNEL, borderType=cv2.BORDER_CONSTANT) for one in influence]
    variance = np.maximum(np.sum(influence * around, axis=(1, 2)), np.sum(influence**2, axis=(1, 2)))
    return np.asarray(np.sqrt(variance * n / (n - _CORRELATED * unknowns)))


class Marker(Holder):
    """Marker ``number`` of a :data:`.boards.Dictionary`; InvalidInputError: it has fewer markers."""

    seen, growth = 0.1, 0.5

    def __init__(self, dictionary: str, number: int) -> None:
        known = boards.dictionary(dictionary)
        if not 0 <= number < len(known.bytesList):
            raise InvalidInputError("marker.id", number, f"0 to {len(known.bytesList) - 1} for {dictionary}")
        self._number, self.name = number, f"marker {number} of {dictionary}"
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        # The middle of each cell is read: with OpenCV's own settings small markers are missed, some in clear pictures.
        parameters.perspectiveRemovePixelPerCell = 8
        parameters.perspectiveRemoveIgnoredMarginPerCell = 0.3
        self._detector = cv2.aruco.ArucoDetector(known, parameters)
        self.cells = int(known.markerSize) + 2
        self._rim = 0.5 + _RIM / self.cells
        self._known: _Pattern | None = None
        pattern = np.asarray(cv2.aruco.generateImageMarker(known, number, self.cells), dtype=np.float64) / 255.0
        # The pattern on white as a sum of steps: entry (i, j) is added right of edge j and below edge i.
        self._steps = np.diff(np.diff(np.pad(pattern - 1.0, 1), axis=0), axis=1)

    def corners(self, picture: Picture) -> Array | None:
        rough = self._detect(picture)
        if rough is None:
            return None
        shortest = float(np.linalg.norm(rough - np.roll(rough, 1, axis=0), axis=1).min())
        return refine(picture, rough, Refinement(max(2, int(MARKER_WINDOW * shortest))))

    def find(self, picture: Picture) -> Fit | None:
        corners = self._detect(picture)
        if corners is None:
            return None
        homography = cv2.getPerspectiveTransform(CORNERS.astype(np.float32), corners).astype(np.float64)
        fit = Fit(homography / homography[2, 2], np.zeros(2), np.ones(2), 0.0)
        return replace(fit, blur=np.full(2, _START_BLUR / fit.side))

    def _detect(self, picture: Picture) -> NDArray[np.float32] | None:
        """Corners, shape (4, 2), of the largest marker of this number."""
        # Dark pictures need more contrast, small markers that are out of focus a larger picture.
        stretched = cv2.normalize(picture, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)
        for factor in _ENLARGED:
            if factor > 1 and max(picture.shape) * factor > _MAX_ENLARGED:
                break
            size = stretched.shape[1] * factor, stretched.shape[0] * factor
            quads, numbers, _ = self._detector.detectMarkers(cv2.resize(stretched, size, interpolation=cv2.INTER_CUBIC))
            found = [quad for quad, n in zip(quads, np.ravel(numbers), strict=False) if n == self._number]
            if found:
                largest = np.asarray(max(found, key=cv2.contourArea), dtype=np.float32).reshape(4, 2)
                return (largest + np.float32(0.5)) / np.float32(factor) - np.float32(0.5)
        return None

    def _pattern(self, start: Fit, blur: Array) -> _Pattern:
        known, blur = self._known, np.clip(blur, _MIN_BLUR / start.side, _MAX_BLUR / self.cells)
        # Samples along a side.
        n = int(np.clip(round(2.0 * self._rim * start.side), _MIN_SAMPLES, _MAX_SAMPLES))
        if known and known.shape == (n, n) and np.abs(blur / known.blur - 1.0).max() <= _SAME_BLUR:
            return known
        axis = np.linspace(-self._rim, self._rim, n)
        (u, by_u, bend_u), (v, by_v, bend_v) = (self._edges(axis, size) for size in blur)
        rows, columns = self._steps @ u.T, v @ self._steps
        values, slopes = 1.0 + columns @ u.T, np.stack([columns @ by_u.T, by_v @ rows])
        gains, offsets = (
            np.maximum(1.0 - np.abs(np.linspace(0.0, k - 1.0, n) - np.arange(k)[:, None]), 0.0) for k in _NODES
        )
        # Blurred before its tones are coded, black shrinks beside white: all edges move towards it, those inside the
        # marker one way and the other, so that its size is still told to 0.2 per cent, where it was one too small.
        shrinks = np.hypot(*slopes).ravel()
        self._known = _Pattern(
            shape=(n, n),
            places=np.stack(np.meshgrid(axis, axis)).reshape(2, -1),
            values=values.ravel(),
            slopes=slopes.reshape(2, -1),
            gains=np.asarray(np.kron(gains, gains), dtype=np.float64),
            offsets=np.concatenate([np.kron(offsets, offsets), shrinks[None]]),
            bends=np.stack([columns @ bend_u.T, bend_v @ rows]).reshape(2, -1),
            blur=blur,
            perspective=True,
            sigma=0.7 * max(1.0, start.side / n),
        )
        return self._known

    def _edges(self, axis: Array, blur: float) -> tuple[Array, Array, Array]:
        """Of each edge at each place: its blurred step, its density, and the step's derivative by the blur squared."""
        t = (axis[:, None] - np.linspace(-0.5, 0.5, self.cells + 1)) / blur
        density = np.exp(-0.5 * t * t) / (np.sqrt(2.0 * np.pi) * blur)
        return ndtr(t), density, -0.5 * t / blur * density

    def _score(self, pattern: _Pattern, values: Array, residual: Array, weight: Array) -> float:
        away, known = values - values.mean(), pattern.values - pattern.values.mean()
        return max(float(away @ known) / max(float(np.sqrt((away @ away) * (known @ known))), 1e-9), 0.0)


class Template(Holder):
    """A box x, y, width, height of a first frame, pixels.

    Raises InvalidInputError: it is too small, not in the picture, without texture, or like another place.
    """

    seen, growth, order = 0.8, 0.2, 3

    def __init__(self, first: Picture, box: tuple[int, int, int, int]) -> None:
        x, y, width, height = box
        rows, columns = first.shape
        self.name, key = "the template", "template.box"
        if min(width, height) < MIN_SIDE or min(x, y) < 0 or x + width > columns or y + height > rows:
            allowed = f"x, y, width, height of at least {MIN_SIDE} in a picture of {columns} x {rows} pixels"
            raise InvalidInputError(key, list(box), allowed)
        self._patch = np.ascontiguousarray(first[y : y + height, x : x + width])
        blurred = cv2.GaussianBlur(first.astype(np.float64), (0, 0), _Pattern.sigma)
        slopes = [slope[y : y + height, x : x + width] for slope in np.gradient(blurred)[::-1]]
        blurred = blurred[y : y + height, x : x + width]
        advice = "choose a part of the gripper with edges in both directions, without the strip or the background"
        if blurred.std() < MIN_TEXTURE or min(slope.std() for slope in slopes) < MIN_TEXTURE / MIN_SIDE:
            allowed = "a box with upright and level edges"
            raise InvalidInputError(key, list(box), allowed, advice)
        self._size = np.array([width, height])
        u, v = np.meshgrid(*((np.arange(n) - 0.5 * (n - 1.0)) / n for n in (width, height)))
        linear = np.stack([np.ones_like(u), u, v]).reshape(3, -1)
        self._known = _Pattern(
            shape=(height, width),
            places=np.stack([u, v]).reshape(2, -1),
            values=blurred.ravel(),
            slopes=np.stack([slopes[0] * width, slopes[1] * height]).reshape(2, -1),
            gains=linear,
            offsets=linear,
            bends=np.empty((0, u.size)),
            blur=np.zeros(2),
            perspective=False,
        )
        _, alike, place = self._search(first)
        if alike > MAX_ALIKE or np.abs(place - self._size / 2.0 + 0.5 - [x, y]).max() > 1.0:
            raise InvalidInputError(key, list(box), "a box that is like no other place in the picture", advice)

    def find(self, picture: Picture) -> Fit | None:
        if np.any(np.array(picture.shape[::-1]) < self._size):
            return None
        best, alike, place = self._search(picture)
        if alike > MAX_ALIKE or best < MIN_FOUND:
            return None
        homography = np.array([[self._size[0], 0.0, place[0]], [0.0, self._size[1], place[1]], [0.0, 0.0, 1.0]])
        return Fit(homography, np.zeros(2), np.ones(2), 0.0)

    def _pattern(self, start: Fit, blur: Array) -> _Pattern:
        return self._known

    def _score(self, pattern: _Pattern, values: Array, residual: Array, weight: Array) -> float:
        power = np.average((values - np.average(values, weights=weight)) ** 2, weights=weight)
        score = float(np.sqrt(max(1.0 - np.average(residual**2, weights=weight) / power, 0.0)))
        return score if score > LEAST_SCORE else 0.0

    def _search(self, picture: Picture) -> tuple[float, float, Array]:
        """Correlation of the best place, that of the second over it, and the centre of the best, shape (2,), pixels."""
        found: NDArray[Any] = cv2.matchTemplate(picture, self._patch, cv2.TM_CCOEFF_NORMED)
        row, column = np.unravel_index(np.argmax(found), found.shape)
        best = max(float(found[row, column]), 1e-9)
        away = self._size // 2
        found[max(row - away[1], 0) : row + away[1] + 1, max(column - away[0], 0) : column + away[0] + 1] = 0.0
        return best, float(found.max()) / best, np.array([column, row]) + 0.5 * (self._size - 1.0)


def holder_of(folder: Path, entries: Entries) -> Holder:
    """Prepare what is followed; InvalidInputError: no such marker, or a template that does not stand out."""
    described = entries.gripper.holder
    if isinstance(described, MarkerEntry):
        return Marker(described.dictionary, described.id)
    timestamps = None if entries.timestamps is None else folder / entries.timestamps
    with video.read(folder / entries.video, timestamps) as film:
        return Template(next(film).image, described.box)
