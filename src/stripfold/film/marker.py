"""A square fiducial marker in a picture: detection, then a fit of its known pattern to the grey values.

The model of a picture is the pattern, blurred, under a homography, times a gain and plus an offset that vary smoothly
over the marker (lighting, shadows).  The pattern of square cells, blurred by a Gaussian, and its derivatives have
closed forms.  The fit is Gauss-Newton with Tukey's biweight, which rejects what covers the marker.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold import kernels
from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import InvalidInputError
from stripfold.film import boards
from stripfold.film.boards import Refinement, refine
from stripfold.film.mapping import transform

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
TUKEY = 4.685
"""Constant of Tukey's biweight: 95 % as efficient as least squares."""
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

    ``homography``: shape (3, 3): from the marker's own frame, in sides, to pixels; its last entry is 1.  ``blur``:
    shape (2,): standard deviation of the blur along the marker's axes, sides.  ``sd``: shape (2,): standard deviation
    of the centre, pixels.  ``score``: correlation of the picture with the pattern, 0 to 1; 0 before a fit.
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
        """The marker translated by ``shift``, shape (2,), pixels."""
        translation = np.eye(3)
        translation[:2, 2] = shift
        return replace(self, homography=translation @ self.homography)


class Marker:
    """Marker ``number`` of a dictionary named in :data:`.boards.Dictionary`.

    Raises InvalidInputError: the dictionary has fewer markers.
    """

    def __init__(self, dictionary: str, number: int) -> None:
        known = boards.dictionary(dictionary)
        if not 0 <= number < len(known.bytesList):
            raise InvalidInputError("marker.id", number, f"0 to {len(known.bytesList) - 1} for {dictionary}")
        self._number, self.name = number, f"marker {number} of {dictionary}"
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
        patch, origin = _patch(picture, start, _SMOOTHING * max(1.0, start.side / count))
        homography, blur = start.homography.copy(), start.blur.copy()
        blurs = _MIN_BLUR / start.side, _MAX_BLUR / self.cells
        limits = *blurs, 1.5 * start.side / self.cells, _TOLERANCE, TUKEY, _MIN_SCALE
        influence, quality = np.empty((2, count * count)), np.empty(3)
        near = kernels.marker.fit(
            patch,
            origin.astype(np.float64),
            self._steps,
            self.cells,
            np.linspace(-rim, rim, count),
            homography,
            blur,
            _MAX_ITERATIONS,
            limits,
            influence,
            quality,
        )
        weight, gain, score = quality
        if not near or weight < 2 * kernels.marker.UNKNOWNS or gain <= 0.0:
            return None
        return Fit(
            homography, blur, centre_sd(influence.reshape(2, count, count), kernels.marker.UNKNOWNS), float(score)
        )


def centre_sd(influence: Array, unknowns: int) -> Array:
    """Standard deviation of the marker's centre, shape (2,), pixels, allowing for correlated residuals.

    ``influence``, shape (2, m, n), is the contribution of each sample; products of neighbours are summed too.
    """
    n = influence[0].size
    variance = np.empty(2)
    for k, field in enumerate(influence):
        around = cv2.sepFilter2D(field, -1, _KERNEL, _KERNEL, borderType=cv2.BORDER_CONSTANT)
        variance[k] = max(float(np.sum(field * around)), float(np.sum(field**2)))
    return np.asarray(np.sqrt(variance * n / (n - _CORRELATED * unknowns)))


def _patch(picture: Picture, start: Fit, sigma: float) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """The smoothed part of a picture around a marker, and the position of its first pixel."""
    low = np.clip(np.floor(start.centre - start.side), 0, None).astype(np.int64)
    high = np.clip(np.ceil(start.centre + start.side) + 1, 0, picture.shape[::-1]).astype(int)
    part = picture[low[1] : high[1], low[0] : high[0]]
    if not part.size:
        return np.zeros((1, 1), np.float32), low
    return np.asarray(cv2.GaussianBlur(part.astype(np.float32), (0, 0), sigma), dtype=np.float32), low
