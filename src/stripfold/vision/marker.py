"""A square fiducial marker in a picture: detection, then a fit of its known pattern to the grey values.

The model of a picture is the pattern, blurred, under a homography, times a gain and plus an offset that vary smoothly
over the marker (lighting, shadows).  The pattern of square cells, blurred by a Gaussian, and its derivatives have
closed forms.  The fit is Gauss-Newton with Tukey's biweight, which rejects what covers the marker.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from stripfold.arrays import Array, Picture
from stripfold.errors import InvalidInputError
from stripfold.vision import boards
from stripfold.vision.boards import Refinement, refine
from stripfold.vision.smoothing import median

CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
"""The marker's corners in its own frame, in sides, in OpenCV's order."""
WINDOW = 0.08
"""Half-window of the corners' refinement over the marker's side: half a cell of the largest markers."""
_ENLARGED, _MAX_ENLARGED = (1, 2, 3), 2000
"""Magnifications tried in turn for detection, up to this longest side, pixels."""
_MARGIN = 0.5
"""Width of the white rim that is fitted too, cells."""
_MIN_SAMPLES, _MAX_SAMPLES = 24, 32
"""Sample points along a side; between these limits about one per pixel."""
_SMOOTHING = 0.7
"""Gaussian smoothing of the picture, pixels or sample spacings: it reduces the effect of interpolation."""
_MAX_ITERATIONS = 12
_TOLERANCE = 3e-3
"""Movement of the centre that ends the iteration, pixels."""
_TUKEY = 4.685
_MIN_SCALE = 0.015
"""Least scale of the residuals over the contrast: no edge is blurred exactly as in the model."""
_KERNEL = np.clip(1.5 - np.abs(np.arange(-5, 6)) / 4.0, 0.0, 1.0)
"""Weight of products of residuals by their distance in samples: neighbours are correlated."""
_CORRELATED = 7.0
"""Samples per independent value of the noise, after smoothing and interpolation."""
_START_BLUR, _MIN_BLUR, _MAX_BLUR = 0.8, 0.3, 1.0
"""Initial and least blur, pixels; largest, cells."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A marker found in a picture.

    Attributes
    ----------
    homography
        Shape (3, 3): from the marker's own frame, in sides, to pixels; its last entry is 1.
    blur
        Shape (2,): standard deviation of the blur along the marker's axes, sides.
    sd
        Shape (2,): standard deviation of the centre, pixels.
    score
        Correlation of the picture with the pattern, 0 to 1; 0 before a fit.
    """

    homography: Array
    blur: Array
    sd: Array
    score: float

    @property
    def centre(self) -> Array:
        """Shape (2,), pixels."""
        return self.homography[:2, 2]

    @property
    def corners(self) -> Array:
        """Shape (4, 2), pixels, in OpenCV's order."""
        return _project(self.homography, CORNERS.T).T

    @property
    def side(self) -> float:
        """Side in the picture, pixels: the square root of the area."""
        return float(np.sqrt(cv2.contourArea(self.corners.astype(np.float32))))

    def moved(self, shift: Array) -> Fit:
        """The marker translated by ``shift``, shape (2,), pixels."""
        translation = np.eye(3)
        translation[:2, 2] = shift
        return replace(self, homography=translation @ self.homography)


class Marker:
    """Marker ``number`` of a dictionary named in :data:`.boards.Dictionary`.

    Raises
    ------
    InvalidInputError
        The dictionary has fewer markers.
    """

    def __init__(self, dictionary: str, number: int) -> None:
        known = boards.dictionary(dictionary)
        if not 0 <= number < len(known.bytesList):
            raise InvalidInputError("marker.id", number, f"0 to {len(known.bytesList) - 1} for {dictionary}")
        self._number = number
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(known, parameters)
        self.cells = int(known.markerSize) + 2
        pattern = np.asarray(cv2.aruco.generateImageMarker(known, number, self.cells), dtype=np.float64) / 255.0
        # The pattern on white as a sum of steps: entry (i, j) is added right of edge j and below edge i.
        self._steps = np.diff(np.diff(np.pad(pattern - 1.0, 1), axis=0), axis=1)

    def corners(self, picture: Picture) -> Array | None:
        """The marker's corners, shape (4, 2), pixels, refined with sub-pixel accuracy, or None."""
        rough = self._detect(picture)
        if rough is None:
            return None
        shortest = float(np.linalg.norm(rough - np.roll(rough, 1, axis=0), axis=1).min())
        return refine(picture, rough, Refinement(max(2, int(WINDOW * shortest))))

    def find(self, picture: Picture) -> Fit | None:
        """The marker anywhere in a picture, accurate to about half a pixel, or None."""
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
            enlarged = stretched
            if factor > 1:
                enlarged = cv2.resize(stretched, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
            quads, numbers, _ = self._detector.detectMarkers(enlarged)
            found = [
                quad
                for quad, n in zip(quads, np.ravel(numbers) if len(quads) else (), strict=True)
                if n == self._number
            ]
            if found:
                largest = np.asarray(max(found, key=cv2.contourArea), dtype=np.float32).reshape(4, 2)
                return (largest + np.float32(0.5)) / np.float32(factor) - np.float32(0.5)
        return None

    def fit(self, picture: Picture, start: Fit) -> Fit | None:
        """Fit the pattern to the picture near ``start``, to a few hundredths of a pixel, or None."""
        rim = 0.5 + _MARGIN / self.cells
        count = int(np.clip(round(2.0 * rim * start.side), _MIN_SAMPLES, _MAX_SAMPLES))
        axis = np.linspace(-rim, rim, count)
        points = np.stack(np.meshgrid(axis, axis)).reshape(2, -1)
        lighting = _lighting(count)
        patch, origin = _patch(picture, start, _SMOOTHING * max(1.0, start.side / count))
        homography, blur = start.homography, start.blur
        gain = weights = np.empty(0)
        for iteration in range(_MAX_ITERATIONS):
            pixels = _project(homography, points)
            grey, inside = _sample(patch, pixels - origin[:, None], count)
            pattern, by_u, by_v, by_blur = self._pattern(axis, blur)
            if iteration == 0:
                gain, weights = np.full(len(grey), _slope(pattern, grey)), inside
            columns = np.concatenate(
                [
                    -_homography_columns(homography, points, pixels, gain * by_u, gain * by_v),
                    gain * by_blur,
                    lighting,
                    lighting * pattern,
                ]
            )
            weighted = columns * weights
            normal = weighted @ columns.T
            # Regularised: where the pattern has one colour only, gain and offset are not independent.
            normal[np.diag_indices_from(normal)] += 1e-6 * np.diag(normal) + 1e-12
            solution = np.linalg.solve(normal, weighted @ grey)
            residual = grey - solution @ columns
            scale = max(1.4826 * median(np.abs(residual)), _MIN_SCALE * median(np.abs(gain)), 1e-3)
            weights = inside * np.clip(1.0 - (residual / (_TUKEY * scale)) ** 2, 0.0, None) ** 2
            gain = solution[10 + len(lighting) :] @ lighting
            change = np.append(solution[:8], 0.0).reshape(3, 3)
            homography = homography + change
            least, most = _MIN_BLUR / start.side, _MAX_BLUR / self.cells
            blur = np.clip(blur + solution[8:10], np.maximum(least, blur / 1.5), np.minimum(most, blur * 1.5))
            moved = np.linalg.norm(homography[:2, 2] - start.centre)
            if moved > 1.5 * start.side / self.cells or not np.all(np.isfinite(homography)):
                return None
            if np.linalg.norm(change[:2, 2]) < _TOLERANCE:
                break
        if weights.sum() < 2 * len(columns) or median(gain) <= 0.0:
            return None
        sd = _centre_sd(normal, columns, weights * residual, count)
        # Of all samples, also the rejected ones: a fit to something else rejects most of it.
        spread = float(np.std(grey))
        score = max(_slope(pattern, grey) * float(np.std(pattern)) / spread, 0.0) if spread > 0.0 else 0.0
        return Fit(homography, blur, sd, score)

    def _pattern(self, axis: Array, blur: Array) -> tuple[Array, Array, Array, Array]:
        """The blurred pattern on a square grid and its derivatives by u, by v and by both blurs.

        Shapes (n*n,), (n*n,), (n*n,) and (2, n*n).
        """
        edges = np.arange(self.cells + 1) / self.cells - 0.5
        u, v = (axis[:, None] - edges) / blur[0], (axis[:, None] - edges) / blur[1]
        step_u, step_v = ndtr(u), ndtr(v)
        density_u, density_v = (np.exp(-0.5 * t * t) / np.sqrt(2.0 * np.pi) for t in (u, v))
        along_u, along_v = self._steps @ step_u.T, step_v @ self._steps
        return (
            1.0 + (step_v @ along_u).ravel(),
            (along_v @ (density_u / blur[0]).T).ravel(),
            ((density_v / blur[1]) @ along_u).ravel(),
            np.stack(
                [
                    (along_v @ (-u * density_u / blur[0]).T).ravel(),
                    ((-v * density_v / blur[1]) @ along_u).ravel(),
                ]
            ),
        )


def _centre_sd(normal: Array, columns: Array, weighted_residual: Array, count: int) -> Array:
    """Standard deviation of the marker's centre, shape (2,), pixels, allowing for correlated residuals."""
    unit = np.zeros((len(normal), 2))
    unit[2, 0] = unit[5, 1] = 1.0
    # The contribution of each sample to the centre; products of neighbours are summed too.
    influence = (np.linalg.solve(normal, unit).T @ columns) * weighted_residual
    n = len(weighted_residual)
    variance = np.empty(2)
    for k, field in enumerate(influence.reshape(2, count, count)):
        around = cv2.sepFilter2D(field, -1, _KERNEL, _KERNEL, borderType=cv2.BORDER_CONSTANT)
        variance[k] = max(float(np.sum(field * around)), float(np.sum(field**2)))
    return np.asarray(np.sqrt(variance * n / (n - _CORRELATED * len(columns))))


def _slope(x: Array, y: Array) -> float:
    """Of the least-squares line through points."""
    centred = x - x.mean()
    return float(centred @ y / (centred @ centred))


@lru_cache(maxsize=16)
def _lighting(count: int) -> Array:
    """Sixteen bilinear hat functions on a grid of 4 x 4 nodes, shape (16, n*n); they sum to 1.

    With a grid of 3 x 3 the edge of a shadow across the marker moves the centre by a quarter of a pixel.
    """
    nodes = np.linspace(0.0, count - 1.0, 4)
    hats = np.clip(1.0 - np.abs(np.arange(count)[:, None] - nodes) / nodes[1], 0.0, None)
    return np.asarray(np.einsum("ia,jb->abij", hats, hats).reshape(16, count * count))


def _patch(picture: Picture, start: Fit, sigma: float) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """The smoothed part of a picture around a marker, and the position of its first pixel."""
    low = np.clip(np.floor(start.centre - start.side), 0, None).astype(np.int64)
    high = np.clip(np.ceil(start.centre + start.side) + 1, 0, picture.shape[::-1]).astype(int)
    part = picture[low[1] : high[1], low[0] : high[0]]
    if not part.size:
        return np.zeros((1, 1), np.float32), low
    return np.asarray(cv2.GaussianBlur(part.astype(np.float32), (0, 0), sigma), dtype=np.float32), low


def _sample(patch: NDArray[np.float32], pixels: Array, count: int) -> tuple[Array, Array]:
    """Grey values at ``pixels``, shape (2, n), and 1 where they are inside the picture, else 0; each shape (n,)."""
    x, y = pixels.reshape(2, count, count).astype(np.float32)
    grey = cv2.remap(patch, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    limits = np.array(patch.shape[::-1])[:, None] - 1.0
    inside = np.all((pixels >= 0.0) & (pixels <= limits), axis=0)
    return grey.ravel().astype(np.float64), inside.astype(np.float64)


def _project(homography: Array, points: Array) -> Array:
    """Pixels of ``points``; shapes (2, n)."""
    homogeneous = homography[:, :2] @ points + homography[:, 2:]
    return np.asarray(homogeneous[:2] / homogeneous[2])


def _homography_columns(homography: Array, points: Array, pixels: Array, by_u: Array, by_v: Array) -> Array:
    """Derivatives of the grey values at ``points`` by the homography's first eight entries, shape (8, n).

    ``by_u`` and ``by_v`` are the derivatives of the grey values in the marker's frame.
    """
    # Derivatives in pixels, by the inverse of the Jacobian (a, b; c, d).  The third homogeneous coordinate divides both
    # the Jacobian and the effect of the entries, and cancels.
    (a, b), (c, d) = homography[:2, :2, None] - pixels[:, None] * homography[2, :2, None]
    determinant = a * d - b * c
    by_x = (d * by_u - c * by_v) / determinant
    by_y = (a * by_v - b * by_u) / determinant
    by_w = -(by_x * pixels[0] + by_y * pixels[1])
    u, v = points
    return np.stack([by_x * u, by_x * v, by_x, by_y * u, by_y * v, by_y, by_w * u, by_w * v])
