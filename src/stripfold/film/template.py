"""A part of the gripper, marked by a box in the first frame, found again in other pictures: where there is no marker.

The box is searched for by normalised correlation, then fitted by Gauss-Newton iterations: an affine motion of the
template, with a gain and an offset that vary linearly over it (lighting, shadows), and Tukey's biweight, which rejects
what covers it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import InvalidInputError
from stripfold.film.marker import TUKEY, Fit, centre_sd

MIN_FOUND = 0.7
"""Correlation from which the box is found in a whole picture."""
MAX_ALIKE = 0.9
"""Correlation of another place with the box, relative to the best, from which it is ambiguous."""
MIN_TEXTURE = 8.0
"""Least standard deviation of the grey values in the box, over their noise of about 1 to 3."""
MIN_SIDE = 12
"""Least side of the box, pixels."""
MIN_SCORE = 0.98
"""Least correlation of a fit; noise of 3 grey levels leaves 0.98 of the least texture, a covered part less."""
MIN_SEEN = 0.8
"""Least mean weight of the box's pixels: below it too much of it is covered or out of the picture."""
MAX_GROWTH = 0.2
"""Largest change of the box's area, relative to it."""
_MARGIN = 8
"""Pixels around the box in which it is fitted, more than it moves from where it is expected."""
_SMOOTHING = 1.0
"""Standard deviation of the Gaussian filter of both pictures, pixels: it reduces the effect of interpolation."""
_MAX_ITERATIONS = 30
_TOLERANCE = 3e-3
"""Movement of the centre that ends the iteration, pixels."""
_MIN_SCALE = 0.03
"""Least scale of the residuals over the template's contrast: neither interpolation nor the light is exactly so."""
_MIN_SD = 0.003
"""Least standard deviation of the centre, pixels: the first frame fits itself exactly."""


class Template:
    """A box x, y, width, height of a first frame, pixels; it serves as a :class:`.marker.Marker` does.

    Raises InvalidInputError: the box is too small, not in the picture, without texture, or like another place in the
    picture.
    """

    def __init__(self, first: Picture, box: tuple[int, int, int, int]) -> None:
        x, y, width, height = box
        rows, columns = first.shape
        self.name, key = "the template", "template.box"
        if min(width, height) < MIN_SIDE or min(x, y) < 0 or x + width > columns or y + height > rows:
            allowed = f"x, y, width, height of at least {MIN_SIDE} in a picture of {columns} x {rows} pixels"
            raise InvalidInputError(key, list(box), allowed)
        self._patch = np.ascontiguousarray(first[y : y + height, x : x + width])
        blurred = ndimage.gaussian_filter(first.astype(np.float64), _SMOOTHING)
        slopes = [slope[y : y + height, x : x + width] for slope in np.gradient(blurred)[::-1]]
        blurred = blurred[y : y + height, x : x + width]
        advice = "choose a part of the gripper with edges in both directions, without the strip or the background"
        if blurred.std() < MIN_TEXTURE or min(slope.std() for slope in slopes) < MIN_TEXTURE / MIN_SIDE:
            allowed = "a box with upright and level edges"
            raise InvalidInputError(key, list(box), allowed, advice)
        self._size = np.array([width, height])
        v, u = np.meshgrid(*(np.arange(n) - 0.5 * (n - 1.0) for n in (height, width)), indexing="ij")
        self._places = np.stack([u, v]).reshape(2, -1)
        linear = np.stack([np.ones_like(u), u / width, v / height])
        # How the picture depends on the motion along x and y, on the gain and on the offset.
        parts = [slopes[0] * linear, slopes[1] * linear, blurred * linear, linear]
        self._derivatives = np.concatenate(parts).reshape(12, -1).T
        self._ridge = 1e-6 * np.sum(self._derivatives**2, axis=0)
        self._contrast = float(blurred.std())
        _, alike, place = self._search(first)
        if alike > MAX_ALIKE or np.abs(place - self._size / 2.0 + 0.5 - [x, y]).max() > 1.0:
            raise InvalidInputError(key, list(box), "a box that is like no other place in the picture", advice)

    def corners(self, picture: Picture) -> Array | None:
        """The box's corners, shape (4, 2), pixels, or None."""
        rough = self.find(picture)
        fit = None if rough is None else self.fit(picture, rough)
        return None if fit is None else fit.corners

    def find(self, picture: Picture) -> Fit | None:
        """The box anywhere in a picture, to a pixel, or None where it is not there or not the only one like it."""
        if np.any(np.array(picture.shape[::-1]) < self._size):
            return None
        best, alike, place = self._search(picture)
        if alike > MAX_ALIKE or best < MIN_FOUND:
            return None
        homography = np.array([[self._size[0], 0.0, place[0]], [0.0, self._size[1], place[1]], [0.0, 0.0, 1.0]])
        return Fit(homography, np.zeros(2), np.ones(2), 0.0)

    def fit(self, picture: Picture, start: Fit) -> Fit | None:
        """The box near ``start``, to a hundredth of a pixel, or None; ``sd`` is of its motion since the first frame."""
        low = np.clip(np.floor(start.centre - 0.5 * self._size).astype(int) - _MARGIN, 0, None)
        part = picture[low[1] :, low[0] :][: self._size[1] + 2 * _MARGIN, : self._size[0] + 2 * _MARGIN]
        if np.any(np.array(part.shape[::-1]) < self._size // 2):
            return None
        part = ndimage.spline_filter(ndimage.gaussian_filter(part.astype(np.float64), _SMOOTHING))
        turn, centre = start.homography[:2, :2] / self._size, start.centre - low
        weight = np.ones(self._patch.size)
        for _ in range(_MAX_ITERATIONS):
            values, inside = self._seen(part, turn, centre)
            weighted = (weight * inside)[:, None] * self._derivatives
            inverse = np.linalg.inv(weighted.T @ self._derivatives + np.diag(self._ridge))
            found = inverse @ (weighted.T @ values)
            residual = values - self._derivatives @ found
            gain = float(found[6])
            scale = max(1.4826 * float(np.median(np.abs(residual))), _MIN_SCALE * self._contrast * abs(gain))
            share = inside * np.clip(1.0 - (residual / (TUKEY * scale)) ** 2, 0.0, None)
            weight = share**2
            if weight.mean() < MIN_SEEN or gain <= 0.0:
                return None
            # The picture shows at a place what the template has this motion away.
            motion = found[:6].reshape(2, 3) / gain
            step = turn @ motion[:, 0]
            centre = centre - step
            turn = turn @ (np.eye(2) - motion[:, 1:] / self._size)
            if np.abs(centre + low - start.centre).max() > _MARGIN or abs(np.linalg.det(turn) - 1.0) > MAX_GROWTH:
                return None
            if np.hypot(*step) < _TOLERANCE:
                break
        else:
            return None
        homography = np.eye(3)
        homography[:2, :2], homography[:2, 2] = turn * self._size, centre + low
        # The weights change with the residuals: the biweight's influence rises by less than they say.
        rise = float(np.sum(share * (5.0 * share - 4.0)) / np.sum(weight))
        influence = (turn @ inverse[[0, 3]] @ self._derivatives.T) * (weight * residual) / (gain * rise)
        sd = np.maximum(centre_sd(influence.reshape(2, *self._patch.shape), len(found)), _MIN_SD)
        power = np.average((values - np.average(values, weights=weight)) ** 2, weights=weight)
        score = float(np.sqrt(max(1.0 - np.average(residual**2, weights=weight) / power, 0.0)))
        return replace(start, homography=homography, sd=sd, score=score) if score > MIN_SCORE else None

    def _seen(self, part: Array, turn: Array, centre: Array) -> tuple[Array, Array]:
        """The picture at the template's pixels, and which of these are in it; each of shape (n,)."""
        # OpenCV rounds places to 1/32 pixel.
        places = turn @ self._places + centre[:, None]
        values = ndimage.map_coordinates(part, places[::-1], order=3, prefilter=False)
        inside = np.all((places >= 0.0) & (places <= np.array(part.shape[::-1])[:, None] - 1.0), axis=0)
        return np.asarray(values), inside.astype(np.float64)

    def _search(self, picture: Picture) -> tuple[float, float, Array]:
        """Correlation of the best place, that of the second over it, and the centre of the best, shape (2,), pixels."""
        found: NDArray[Any] = cv2.matchTemplate(picture, self._patch, cv2.TM_CCOEFF_NORMED)
        row, column = np.unravel_index(np.argmax(found), found.shape)
        best = max(float(found[row, column]), 1e-9)
        away = self._size // 2
        found[max(row - away[1], 0) : row + away[1] + 1, max(column - away[0], 0) : column + away[0] + 1] = 0.0
        return best, float(found.max()) / best, np.array([column, row]) + 0.5 * (self._size - 1.0)
