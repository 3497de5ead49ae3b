"""One fiducial marker in a picture, its corners to a fraction of a pixel."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import cv2
import numpy as np

from stripfold.arrays import Array, Picture
from stripfold.vision.boards import Refinement, dictionary

WINDOW = 0.08
"""Half-window of the corners' refinement, as a share of the marker's side: half of a cell of the widest markers."""
AROUND = 1.5
"""How far from the expected centre a marker is sought, in its sides."""
CELL = 8
"""Pixels of a cell when a marker is compared with its drawing."""


class Marker(NamedTuple):
    """A marker that was found.

    Attributes
    ----------
    centre
        Shape (2,): where the diagonals cross, which perspective does not move, pixels.
    corners
        Shape (4, 2): clockwise from the marker's own upper left, pixels.
    score
        Correlation of what is seen with the marker's drawing, at most 1.
    """

    centre: Array
    corners: Array
    score: float


def find(
    image: Picture, name: str, identity: int, near: Array | None = None, side: float | None = None
) -> Marker | None:
    """Find a marker.

    Parameters
    ----------
    image
        Grey, shape (height, width).
    name, identity
        Its dictionary, as recordings name it, and which of it.
    near, side
        Where its centre is expected, shape (2,), and how long its sides are, pixels: only there it is sought.

    Returns
    -------
    Marker or None
        None where it is not seen.  Of several the one that looks most like its drawing.
    """
    corner = np.zeros(2)
    part = image
    if near is not None and side is not None:
        low = np.clip(np.floor(near - AROUND * side), 0, np.array(image.shape[::-1]) - 1).astype(int)
        high = np.maximum(np.ceil(near + AROUND * side).astype(int), low + 1)
        part = np.ascontiguousarray(image[low[1] : high[1], low[0] : high[0]])
        corner = low.astype(np.float64)
    seen, ids, _ = _detector(name).detectMarkers(part)
    if ids is None:
        return None
    found: list[Marker] = []
    for corners, number in zip(seen, np.ravel(ids), strict=True):
        if number == identity:
            corners = np.asarray(corners, dtype=np.float64).reshape(4, 2)
            shortest = float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).min())
            corners = Refinement(max(2, int(WINDOW * shortest))).of(part, corners)
            found.append(Marker(crossing(corners) + corner, corners + corner, _score(part, name, identity, corners)))
    return max(found, key=lambda marker: marker.score, default=None)


def crossing(corners: Array) -> Array:
    """Where the diagonals of a quadrilateral, shape (4, 2), cross."""
    a, b, c, d = corners
    share = np.linalg.solve(np.column_stack([c - a, b - d]), b - a)[0]
    return np.asarray(a + share * (c - a))


@cache
def _detector(name: str) -> cv2.aruco.ArucoDetector:
    return cv2.aruco.ArucoDetector(dictionary(name))


def _score(image: Picture, name: str, identity: int, corners: Array) -> float:
    cells = dictionary(name).markerSize + 2
    side = cells * CELL
    drawn = cv2.aruco.generateImageMarker(dictionary(name), identity, side).astype(np.float64)
    # The drawing's outline is half a pixel outside its outermost pixels' centres.
    outline = np.array([[0, 0], [side, 0], [side, side], [0, side]], dtype=np.float32) - np.float32(0.5)
    flat = cv2.getPerspectiveTransform(corners.astype(np.float32), outline)
    seen = cv2.warpPerspective(image, flat, (side, side)).astype(np.float64)
    if seen.std() == 0.0:
        return 0.0
    return float(np.corrcoef(seen.ravel(), drawn.ravel())[0, 1])
