"""A square marker in a picture, to a small part of a pixel: its known pattern is fitted to the greys.

The model of a picture is the pattern, blurred, under a homography, times a gain and plus an offset that vary smoothly
over the marker (lighting, shadows).  Blurred with a Gaussian, the pattern of square cells and its derivatives are
known in closed form.  The fit is Gauss-Newton's with Tukey's weights, which leave out what covers the marker.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from stripfold.arrays import Array
from stripfold.vision import boards
from stripfold.vision.decoder import Image
from stripfold.vision.smooth import median

CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
"""The marker's corners in its own frame, in sides, in OpenCV's order."""
_ENLARGED = (1, 2, 3)
"""How many times a picture is enlarged in which the marker was not found."""
_LARGEST = 2000
"""Up to what longest side, pixels."""
_MARGIN = 0.5
"""How much of the white around the marker is fitted too, cells."""
_SAMPLES = (24, 32)
"""Fewest and most points of the fit along a side: about one per pixel between."""
_SMOOTHED = 0.7
"""How much the picture is smoothed first, pixels and distances of the points: interpolating changes little then."""
_ITERATIONS = 12
_CONVERGED = 3e-3
"""Movement of the centre that ends the iteration, pixels."""
_TUKEY = 4.685
_NOISE = 0.015
"""Least scale of the residuals, as a share of the contrast: edges are never blurred quite as the model says."""
_KERNEL = np.clip(1.5 - np.abs(np.arange(-5, 6)) / 4.0, 0.0, 1.0)
"""How far residuals count as correlated, by their distance in samples."""
_SHARED = 7.0
"""Samples that share one value of the noise, after smoothing and interpolating."""
_START_BLUR = 0.8
"""Blur to begin with, pixels."""
_LEAST_BLUR, _MOST_BLUR = 0.3, 1.0
"""Least blur, pixels; most, cells."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A marker as it was found.

    Attributes
    ----------
    homography
        Shape (3, 3): from the marker's own frame, in sides, to pixels; its last entry is 1.
    blur
        Of the picture along the marker's two axes, sides.
    sd
        Shape (2,): standard deviation of the centre, pixels.
    score
        Correlation of the picture with the marker's pattern, 0 to 1.
    """

    homography: Array
    blur: tuple[float, float]
    sd: Array
    score: float

    @property
    def centre(self) -> Array:
        """Shape (2,), pixels."""
        return self.homography[:2, 2]

    @property
    def corners(self) -> Array:
        """Shape (4, 2), pixels, in OpenCV's order."""
        return _mapped(self.homography, CORNERS.T).T

    @property
    def side(self) -> float:
        """Length of a side in the picture, pixels."""
        return float(np.sqrt(cv2.contourArea(self.corners.astype(np.float32))))

    def moved(self, shift: Array) -> Fit:
        """The same marker elsewhere; ``shift`` has shape (2,), pixels."""
        move = np.eye(3)
        move[:2, 2] = shift
        return Fit(move @ self.homography, self.blur, self.sd, self.score)


class Marker:
    """One marker of a dictionary.

    Parameters
    ----------
    dictionary
        A name in :data:`.boards.DICTIONARIES`.
    number
        Which marker of it.
    """

    def __init__(self, dictionary: str, number: int) -> None:
        known = boards.dictionary(dictionary)
        self._number = number
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(known, parameters)
        self.cells = int(known.markerSize) + 2
        pattern = np.asarray(cv2.aruco.generateImageMarker(known, number, self.cells), dtype=np.float64) / 255.0
        self._steps = _corner_steps(pattern)

    def find(self, image: Image) -> Fit | None:
        """The marker anywhere in a picture, to about half a pixel, or None."""
        # A dark picture needs its contrast stretched, a small marker that is out of focus more pixels.
        stretched = np.asarray(cv2.normalize(image, None, 0, 255, cv2.NORM_MINMAX), dtype=np.uint8)
        for factor in _ENLARGED:
            picture = stretched
            if factor > 1:
                if max(image.shape) * factor > _LARGEST:
                    break
                picture = np.asarray(
                    cv2.resize(stretched, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC), dtype=np.uint8
                )
            fit = self._detected(picture, factor)
            if fit is not None:
                return fit
        return None

    def _detected(self, image: Image, factor: int) -> Fit | None:
        """The marker in a picture that was enlarged by ``factor``, in pixels of the picture itself."""
        quads, numbers, _ = self._detector.detectMarkers(image)
        for quad, number in zip(quads, np.reshape(numbers, -1) if numbers is not None else (), strict=True):
            if int(number) == self._number:
                seen = (np.asarray(quad, dtype=np.float32).reshape(4, 2) + 0.5) / factor - 0.5
                homography = cv2.getPerspectiveTransform(CORNERS.astype(np.float32), seen.astype(np.float32))
                homography = homography.astype(np.float64)
                fit = Fit(homography / homography[2, 2], (0.0, 0.0), np.full(2, 1.0), 0.0)
                return Fit(fit.homography, (_START_BLUR / fit.side,) * 2, fit.sd, 0.0)
        return None

    def fit(self, image: Image, start: Fit) -> Fit | None:
        """The marker near ``start``, to a small part of a pixel, or None where there is none."""
        count = int(np.clip(round(start.side * (1.0 + 2.0 * _MARGIN / self.cells)), *_SAMPLES))
        reach = 0.5 + _MARGIN / self.cells
        axis = np.linspace(-reach, reach, count)
        fields = _fields(count)
        points = np.stack(np.meshgrid(axis, axis)).reshape(2, -1)
        homography, blur = start.homography, np.array(start.blur)
        part, corner = _smoothed(image, start, _SMOOTHED * max(1.0, start.side / count))
        least, most = _LEAST_BLUR / start.side, _MOST_BLUR / self.cells
        gain = weights = None
        farthest = 1.5 * start.side / self.cells
        for _ in range(_ITERATIONS):
            places = _mapped(homography, points)
            greys, inside = _greys(part, places - corner[:, None], count)
            value, along_u, along_v, wide_u, wide_v = self._pattern(axis, blur)
            if gain is None:
                gain = _slope(value, greys) * np.ones(len(greys))
            design = np.concatenate(
                [
                    -_moves(homography, points, places, gain * along_u, gain * along_v),
                    (gain * wide_u)[None],
                    (gain * wide_v)[None],
                    fields,
                    fields * value,
                ]
            )
            weights = inside if weights is None else weights
            weighted = design * weights
            normal = weighted @ design.T
            # A ridge: where the pattern is of one colour, its gain and its offset cannot be told apart.
            scale = np.diag(normal).copy()
            normal[np.diag_indices_from(normal)] += 1e-6 * scale + 1e-12
            solution = np.linalg.solve(normal, weighted @ greys)
            residual = greys - solution @ design
            spread = max(1.4826 * median(np.abs(residual)), _NOISE * median(np.abs(gain)), 1e-3)
            weights = inside * np.clip(1.0 - (residual / (_TUKEY * spread)) ** 2, 0.0, None) ** 2
            gain = solution[10 + len(fields) :] @ fields
            change = np.append(solution[:8], 0.0).reshape(3, 3)
            homography = homography + change
            blur = np.clip(blur + solution[8:10], np.maximum(least, blur / 1.5), np.minimum(most, blur * 1.5))
            if np.linalg.norm(homography[:2, 2] - start.centre) > farthest or not np.all(np.isfinite(homography)):
                return None
            if np.linalg.norm(change[:2, 2]) < _CONVERGED:
                break
        assert gain is not None
        assert weights is not None
        return self._judged(homography, blur, design, normal, residual, weights, gain, value, greys, count)

    def _judged(
        self,
        homography: Array,
        blur: Array,
        design: Array,
        normal: Array,
        residual: Array,
        weights: Array,
        gain: Array,
        value: Array,
        greys: Array,
        count: int,
    ) -> Fit | None:
        if weights.sum() < 2 * len(design) or median(gain) <= 0.0:
            return None
        unit = np.zeros((len(normal), 2))
        unit[2, 0] = unit[5, 1] = 1.0
        # How much each sample moves the centre; summed with those of its neighbours, as noise is correlated.
        shares = (np.linalg.solve(normal, unit).T @ design) * (weights * residual)
        freedom = len(residual) / (len(residual) - _SHARED * len(design))
        variance = np.empty(2)
        for k in range(2):
            field = shares[k].reshape(count, count)
            around = cv2.sepFilter2D(field, -1, _KERNEL, _KERNEL, borderType=cv2.BORDER_CONSTANT)
            variance[k] = freedom * max(float(np.sum(field * around)), float(np.sum(field**2)))
        # Of all the greys, also those that the weights leave out: a fit to something else leaves out most of it.
        spread = np.std(greys)
        score = max(_slope(value, greys) * float(np.std(value) / spread), 0.0) if spread > 0.0 else 0.0
        return Fit(homography, (float(blur[0]), float(blur[1])), np.sqrt(variance), score)

    def _pattern(self, axis: Array, blur: Array) -> tuple[Array, Array, Array, Array, Array]:
        """The blurred pattern at a grid of points and its derivatives: by u, by v, by both blurs; each shape (n*n,)."""
        edges = np.arange(self.cells + 1) / self.cells - 0.5
        u, v = (axis[:, None] - edges) / blur[0], (axis[:, None] - edges) / blur[1]
        at_u, at_v = ndtr(u), ndtr(v)
        slope_u, slope_v = (np.exp(-0.5 * t * t) / np.sqrt(2.0 * np.pi) for t in (u, v))
        right, left = self._steps @ at_u.T, at_v @ self._steps
        return (
            1.0 + (at_v @ right).ravel(),
            (left @ (slope_u / blur[0]).T).ravel(),
            ((slope_v / blur[1]) @ right).ravel(),
            (left @ (-u * slope_u / blur[0]).T).ravel(),
            ((-v * slope_v / blur[1]) @ right).ravel(),
        )


def _slope(x: Array, y: Array) -> float:
    """Of the straight line through points, by least squares."""
    centred = x - x.mean()
    return float(centred @ y / (centred @ centred))


def _corner_steps(pattern: Array) -> Array:
    """The pattern on white as a sum of steps: entry (i, j) is added right of edge j and below edge i."""
    darker = np.pad(pattern - 1.0, 1)
    return np.diff(np.diff(darker, axis=0), axis=1)


@lru_cache(maxsize=16)
def _fields(count: int) -> Array:
    """Sixteen smooth fields that sum to 1, shape (16, n*n): hats on a grid of four by four.

    The edge of a shadow over the marker moves the centre by a quarter of a pixel with a grid of three by three.
    """
    nodes = np.linspace(0.0, count - 1.0, 4)
    hats = np.clip(1.0 - np.abs(np.arange(count)[:, None] - nodes) / nodes[1], 0.0, None)
    return np.asarray(np.einsum("ia,jb->abij", hats, hats).reshape(16, count * count))


def _smoothed(image: Image, start: Fit, width: float) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """The part of a picture around a marker, smoothed, and the place of its first pixel."""
    reach = start.side
    low = np.clip(np.floor(start.centre - reach), 0, None).astype(np.int64)
    high = np.clip(np.ceil(start.centre + reach) + 1, 0, image.shape[::-1]).astype(int)
    part = image[low[1] : high[1], low[0] : high[0]]
    if not part.size:
        return np.zeros((1, 1), np.float32), low
    return np.asarray(cv2.GaussianBlur(part.astype(np.float32), (0, 0), width), dtype=np.float32), low


def _greys(image: NDArray[np.float32], places: Array, count: int) -> tuple[Array, Array]:
    """Greys at ``places``, shape (2, n), and 1 where they are inside of the picture, else 0; each shape (n,)."""
    x, y = places.reshape(2, count, count).astype(np.float32)
    greys = cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    size = np.array(image.shape[::-1])[:, None]
    inside = np.all((places >= 0.0) & (places <= size - 1.0), axis=0)
    return greys.ravel().astype(np.float64), inside.astype(np.float64)


def _mapped(homography: Array, points: Array) -> Array:
    """Where ``points``, shape (2, n), are in the picture."""
    homogeneous = homography[:, :2] @ points + homography[:, 2:]
    return np.asarray(homogeneous[:2] / homogeneous[2])


def _moves(homography: Array, points: Array, places: Array, along_u: Array, along_v: Array) -> Array:
    """How the greys at ``points`` change as the homography's first 8 entries do, shape (8, n).

    ``along_u`` and ``along_v`` are the slopes of the greys in the marker's frame.
    """
    (a, b), (c, d) = homography[:2, :2, None] - places[:, None] * homography[2, :2, None]
    # Slopes in pixels, by the inverse of the mapping's Jacobian: both that, a to d, and what the entries do are over
    # the third homogeneous coordinate, which thus drops out.
    scale = 1.0 / (a * d - b * c)
    x = (d * along_u - c * along_v) * scale
    y = (a * along_v - b * along_u) * scale
    away = -(x * places[0] + y * places[1])
    return np.stack(
        [x * points[0], x * points[1], x, y * points[0], y * points[1], y, away * points[0], away * points[1]]
    )
