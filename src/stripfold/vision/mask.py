"""Where a strip roughly runs in a picture that nothing is known of: mask, skeleton, longest way through it.

One threshold for the whole picture loses the dim parts of a strip.  Here the background is the median around each
place, what stands out from it is parted by Otsu's method among itself, and dimmer parts count where they hang
together with clear ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from skimage.filters import apply_hysteresis_threshold, threshold_otsu
from skimage.morphology import skeletonize

from stripfold.arrays import Array, Mask

WORKING_SIZE = 1300
"""Longest side of the picture that masks are made of, pixels."""
MIN_CONTRAST = 12.0
"""Smallest grey-level difference to the background that can be a strip."""
SLENDER = 8.0
"""Least length of a strip in a picture, in its widths."""


@dataclass(frozen=True, eq=False)
class Rough:
    """A way along something long and thin.

    Parameters
    ----------
    points
        Shape (n, 2), pixels, in order.
    width
        Typical width, pixels.
    bright
        Whether it is brighter than what is around it.
    contrast
        Typical difference to the background, grey levels.
    """

    points: Array
    width: float
    bright: bool
    contrast: float

    @property
    def length(self) -> float:
        """Length of the polygon, pixels."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())


def foreground(image: NDArray[np.uint8], bright: bool) -> tuple[Mask, Array]:
    """What is brighter (or darker) than its surroundings.

    Parameters
    ----------
    image
        Grey values, shape (h, w).
    bright
        Which of the two.

    Returns
    -------
    mask, difference
        Shape (h, w): what stands out, and by how many grey levels each pixel does.
    """
    smooth = np.asarray(cv2.GaussianBlur(image, (0, 0), 1.0), dtype=np.uint8)
    difference = (smooth.astype(np.float32) - background(smooth)) * (1.0 if bright else -1.0)
    noise = max(1.4826 * float(np.median(np.abs(difference - np.median(difference)))), 0.5)
    least = max(6.0 * noise, MIN_CONTRAST)
    out = difference[difference > least]
    if out.size < 20 or np.ptp(out) == 0.0:
        return np.asarray(difference > least), difference
    high = max(float(threshold_otsu(out)), least)
    return np.asarray(apply_hysteresis_threshold(difference, max(0.5 * high, least), high)), difference


def background(image: NDArray[np.uint8]) -> Array:
    """The median around each pixel, grey levels, shape (h, w); wide against a strip, narrow against the picture."""
    h, w = image.shape
    small = cv2.resize(image, (max(w // 4, 8), max(h // 4, 8)), interpolation=cv2.INTER_AREA)
    size = max(max(small.shape) // 6, 5) | 1
    edge = size // 2
    padded = cv2.copyMakeBorder(small, edge, edge, edge, edge, cv2.BORDER_REFLECT)
    median = cv2.medianBlur(padded, min(size, 255))[edge:-edge, edge:-edge]
    return np.asarray(cv2.resize(median, (w, h), interpolation=cv2.INTER_LINEAR), dtype=np.float32)


def reduced(image: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], Array]:
    """``image`` at the size that masks are made of, and how many of its pixels one of that is, along x and y."""
    factor = min(1.0, WORKING_SIZE / max(image.shape))
    if factor == 1.0:
        return image, np.ones(2)
    small = np.asarray(cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return small, np.array(image.shape[::-1]) / np.array(small.shape[::-1])


def candidates(image: NDArray[np.uint8]) -> Iterator[Rough]:
    """Long thin things in ``image``, shape (h, w), bright and dark ones, each joined over its gaps."""
    small, scale = reduced(image)
    for bright in (True, False):
        mask, difference = foreground(small, bright)
        pieces = sorted(_pieces(mask, difference, bright), key=lambda piece: -piece.length)
        while pieces:
            joined, pieces = _joined(pieces)
            if joined.length > SLENDER * joined.width:
                # The centre of a large pixel lies between those of the small ones that it covers.
                points = (joined.points + 0.5) * scale - 0.5
                yield Rough(points, joined.width * float(scale.mean()), bright, joined.contrast)


def _pieces(mask: Mask, difference: Array, bright: bool) -> Iterator[Rough]:
    solid = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(solid, connectivity=8)
    for label in range(1, count):
        x, y, w, h, area = (int(value) for value in boxes[label])
        if max(w, h) < 15 or area < 30:
            continue
        window = np.s_[y : y + h, x : x + w]
        piece = _piece(np.asarray(labels[window] == label), difference[window], bright)
        if piece is not None:
            yield Rough(piece.points + np.array([x, y]), piece.width, bright, piece.contrast)


def _piece(part: Mask, difference: Array, bright: bool) -> Rough | None:
    # Nothing is beyond the picture's border either: a band that leaves the picture ends there.
    room = cv2.distanceTransform(np.pad(part, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    rows, columns = np.nonzero(skeletonize(part))
    if len(rows) < 10:
        return None
    order = _longest(rows, columns, part.shape)
    rows, columns = rows[order], columns[order]
    radius = room[rows, columns]
    # A hair that sticks out of an end is thinner than the strip; so is the tip of a skeleton.
    thick = np.flatnonzero(radius > 0.5 * np.median(radius))
    keep = slice(int(thick[0]), int(thick[-1]) + 1)
    rows, columns = rows[keep], columns[keep]
    if len(rows) < 10:
        return None
    points = np.column_stack([columns, rows]).astype(np.float64)
    width = max(2.0 * float(np.median(radius)) - 1.0, 1.0)
    return Rough(points, width, bright, float(np.median(difference[rows, columns])))


def _longest(rows: NDArray[np.intp], columns: NDArray[np.intp], shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Indices of the pixels along the longest of the shortest ways between two pixels of a skeleton."""
    number = np.full((shape[0] + 2, shape[1] + 2), -1)
    number[rows + 1, columns + 1] = np.arange(len(rows))
    starts, ends, steps = [], [], []
    for down, right in ((0, 1), (1, -1), (1, 0), (1, 1)):
        other = number[rows + 1 + down, columns + 1 + right]
        near = np.flatnonzero(other >= 0)
        starts.append(near)
        ends.append(other[near])
        steps.append(np.full(len(near), np.hypot(down, right)))
    data = (np.concatenate(steps), (np.concatenate(starts), np.concatenate(ends)))
    graph = coo_array(data, shape=(len(rows), len(rows))).tocsr()
    first = 0
    for _ in range(2):
        away = dijkstra(graph, directed=False, indices=first)
        first = int(np.argmax(np.where(np.isfinite(away), away, -1.0)))
    away, before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
    at = int(np.argmax(np.where(np.isfinite(away), away, -1.0)))
    order = [at]
    while before[at] >= 0:
        at = int(before[at])
        order.append(at)
    return np.array(order)


def _joined(pieces: list[Rough]) -> tuple[Rough, list[Rough]]:
    """The first piece with those that go on in its direction behind a gap, and the pieces that are left."""
    whole, rest = pieces[0], list(pieces[1:])
    while True:
        best: tuple[float, int, Array] | None = None
        for i, other in enumerate(rest):
            if not 0.5 < other.width / whole.width < 2.0 or not 0.4 < other.contrast / whole.contrast < 2.5:
                continue
            for mine in (whole.points, whole.points[::-1]):
                for its in (other.points, other.points[::-1]):
                    gap = _gap(mine, its, whole.width)
                    if gap < max(12.0 * whole.width, 0.12 * whole.length) and (best is None or gap < best[0]):
                        best = (gap, i, np.concatenate([mine, its]))
        if best is None:
            return whole, rest
        whole = Rough(best[2], whole.width, whole.bright, whole.contrast)
        del rest[best[1]]


def _gap(before: Array, after: Array, width: float) -> float:
    """Distance from the end of one way to the start of the other, infinite where that is no way to go on."""
    reach = max(int(4.0 * width), 10)
    way = after[0] - before[-1]
    distance = float(np.hypot(*way))
    directions = [_direction(before[-reach:]), _direction(after[:reach])]
    if float(np.dot(way, directions[0])) < 0.0:
        return np.inf  # beside it, not behind its end
    if distance > 2.0 * width:
        directions.append(way / distance)
    aligned = min(float(np.dot(a, b)) for a in directions for b in directions)
    return distance if aligned > 0.8 else np.inf


def _direction(points: Array) -> Array:
    way = points[-1] - points[0]
    return np.asarray(way / max(float(np.hypot(*way)), 1e-9))
