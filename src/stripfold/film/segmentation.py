"""Segmentation of an unknown picture: strip-like regions, each reduced to the longest path through its skeleton.

A global threshold loses the dim parts of a strip.  Here the background is the local median; Otsu's threshold is that
of the differences that stand out from it, and dimmer pixels count where they are connected to clear ones (hysteresis).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree
from skimage.filters import apply_hysteresis_threshold, threshold_otsu
from skimage.graph import pixel_graph
from skimage.measure import label, regionprops
from skimage.morphology import skeletonize

from stripfold.base.arrays import Array, Index, Mask, Picture
from stripfold.base.errors import TrackingError
from stripfold.film.line_kernels import arc_length, normals, smoothed

WORKING_SIZE = 1300
"""Longest side of the picture that is segmented, pixels."""
MIN_CONTRAST = 12.0
"""Smallest grey-level difference to the background that can be a strip."""
DIM, DIM_FACE = 0.5, 0.3
"""Least difference of a dim pixel over that of a clear one; and where the face of a bright strip may be seen, which is
dimmer than its edge.  A dark one's is not: shadows are dark, too."""
SLENDER_FACE = 3.0
"""Least length of a strip whose face may be seen, in widths of its band."""
MIN_SLENDERNESS = 8.0
"""Least length of a strip in a picture, in its widths."""
LONGEST_CUTOFF = 0.055
"""Largest wave length that smoothing halves, as a share of the strip's length."""
HAIR = 1.5
"""Largest half width of a hair, pixels."""
MIN_LOOP = 2.0
"""Least distance of a loop's far end from the rest of a strip, in its widths."""
OUTSIDE = 3.0
"""How far beside a band the background is looked at, pixels of the picture that is segmented."""
REUSED = 10.0
"""Factor on the length of a way that has been gone already."""


@dataclass(frozen=True, eq=False)
class RoughPath:
    """A path along something long and thin: points, shape (n, 2), and widths, shape (n,), pixels, and its contrast."""

    points: Array
    widths: Array
    bright: bool
    contrast: float

    @property
    def width(self) -> float:
        """Typical width, pixels."""
        return float(np.median(self.widths))

    @property
    def length(self) -> float:
        """Length of the polygon, pixels."""
        return float(arc_length(self.points)[-1])

    def reversed(self) -> RoughPath:
        """The same, from the other end."""
        return replace(self, points=self.points[::-1], widths=self.widths[::-1])


def candidates(image: Picture, face: bool = False) -> Iterator[RoughPath]:
    """Long thin objects in ``image``, shape (h, w), bright and dark ones, each joined across its gaps.

    ``face``: whether the face of a strip may be seen.
    """
    slender = SLENDER_FACE if face else MIN_SLENDERNESS
    small, scale = reduced(image)
    for bright in (True, False):
        pieces = sorted(_pieces(*foreground(small, bright, face=face), bright), key=lambda piece: -piece.length)
        while pieces:
            joined, pieces = _joined(pieces)
            if joined.length > slender * joined.width:
                widths = joined.widths * float(scale.mean())
                yield replace(joined, points=unreduced(joined.points, scale), widths=widths)


def reduced(image: Picture) -> tuple[Picture, Array]:
    """``image`` at the size that is segmented, and the size of its pixels along x and y in those of ``image``."""
    factor = min(1.0, WORKING_SIZE / max(image.shape))
    if factor == 1.0:
        return image, np.ones(2)
    small = np.asarray(cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return small, np.array(image.shape[::-1]) / np.array(small.shape[::-1])


def unreduced(values: Array, scale: Array | float) -> Array:
    """Coordinates in the original picture: the centre of a large pixel lies between those that it covers."""
    return np.asarray((values + 0.5) * scale - 0.5)


def foreground(image: Picture, bright: bool, faint: bool = False, face: bool = False) -> tuple[Mask, Array]:
    """Where a picture is brighter (or darker) than its surroundings, and by how many grey levels; each (h, w).

    ``faint``: also where it is less so than something else in it, as a strip beside a bright ruler.  ``face``: whether
    the face of a strip may be seen.
    """
    smooth = np.asarray(cv2.GaussianBlur(image, (0, 0), 1.0), dtype=np.uint8)
    difference = np.asarray((smooth - _background(smooth)) * (1.0 if bright else -1.0), dtype=np.float64)
    noise = max(1.4826 * float(np.median(np.abs(difference - np.median(difference)))), 0.5)
    least = max(6.0 * noise, MIN_CONTRAST)
    outstanding = difference[difference > least]
    if outstanding.size < 20 or np.ptp(outstanding) == 0.0:
        return np.asarray(difference > least), difference
    high = max(float(threshold_otsu(outstanding)), least)
    if faint and np.ptp(fainter := outstanding[outstanding < high]) > 0.0:
        high = max(float(threshold_otsu(fainter)), least)
    dim = DIM_FACE if face and bright else DIM
    return np.asarray(apply_hysteresis_threshold(difference, max(dim * high, least), high)), difference


def closed(mask: Mask) -> NDArray[np.uint8]:
    """The mask without holes of a pixel or two."""
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.uint8)


def enclosed_share(image: Picture, points: Array, widths: Array, bright: bool, face: bool = False) -> float:
    """Share of a line's points, shape (n, 2), that have different pieces of the background on their two sides.

    It is 0 along a strip with a free end, around which both sides are connected, and large along a closed outline.
    """
    small, scale = reduced(image)
    pieces = label(closed(foreground(small, bright, face=face)[0]) == 0, connectivity=1)
    away = (0.5 * widths + OUTSIDE * scale.mean())[:, None] * normals(points)
    sides = []
    for place in (points - away, points + away):
        column, row = np.rint((place + 0.5) / scale - 0.5).astype(int).T
        inside = (row >= 0) & (row < pieces.shape[0]) & (column >= 0) & (column < pieces.shape[1])
        sides.append(np.where(inside, pieces[row * inside, column * inside], 0))
    left, right = sides
    return float(np.mean((left != right) & (left > 0) & (right > 0)))


def piece_along(
    image: Picture, points: Array, widths: Array, bright: bool, faint: bool = False, face: bool = False
) -> tuple[Array, Index, Mask]:
    """Find what is connected with a line of ``points``, shape (n, 2), in the middle of a band of ``widths``.

    Returns the piece's pixels, shape (k, 2); of each the nearest point of the line, and whether it is beside the band.
    """
    small, scale = reduced(image)
    pieces = label(closed(foreground(small, bright, faint, face)[0]), connectivity=1)
    column, row = np.clip(np.rint((points + 0.5) / scale - 0.5).astype(int).T, 0, [[n - 1] for n in pieces.shape[::-1]])
    mine = int(np.bincount(pieces[row, column], minlength=2)[1:].argmax()) + 1
    band = unreduced(np.argwhere(pieces == mine)[:, ::-1].astype(np.float64), scale)
    away, nearest = cKDTree(points).query(band)
    return band, nearest, away > widths[nearest] + scale.mean()


def second_edge(share: float, source: str, needed: str) -> TrackingError:
    """The error for something beside a strip with this ``share`` of the strip's area."""
    found = f"a second edge along the strip: something beside it is {share:.0%} as large as the strip there"
    return TrackingError(source, found, needed, "is it a shadow? take the strip from the wall, or use diffuse light")


def _background(image: Picture) -> Array:
    """Local median, grey levels, shape (h, w); its window is wide against a strip, small against the picture."""
    h, w = image.shape
    small = cv2.resize(image, (max(w // 4, 8), max(h // 4, 8)), interpolation=cv2.INTER_AREA)
    size = max(max(small.shape) // 6, 5) | 1
    edge = size // 2
    padded = cv2.copyMakeBorder(small, edge, edge, edge, edge, cv2.BORDER_REFLECT)
    median = cv2.medianBlur(padded, min(size, 255))[edge:-edge, edge:-edge]
    return np.asarray(cv2.resize(median, (w, h), interpolation=cv2.INTER_LINEAR), dtype=np.float64)


def cutoff_of(width: float, length: float) -> float:
    """Choose the wave length that smoothing halves, pixels: hairs and weave are shorter, bends of a strip longer."""
    return max(min(3.0 * width, LONGEST_CUTOFF * length), 24.0)


def smooth_path(rough: RoughPath) -> tuple[Array, Array]:
    """Smooth points along a skeleton, and widths, without its ends: there it runs into corners and frays."""
    arc = arc_length(rough.points)
    off = min(3.0 * rough.width, 0.1 * arc[-1])
    count = max(int((arc[-1] - 2.0 * off) / 2.0), 12)
    s = np.linspace(off, arc[-1] - off, count)
    even = np.column_stack([np.interp(s, arc, values) for values in (*rough.points.T, rough.widths)])
    smooth = smoothed(even, np.ones(count), cutoff_of(rough.width, rough.length) / (s[1] - s[0]))
    return smooth[:, :2], np.maximum(smooth[:, 2], 1.0)


def _pieces(mask: Mask, difference: Array, bright: bool) -> Iterator[RoughPath]:
    for region in regionprops(label(closed(mask), connectivity=2)):
        if max(region.image.shape) < 15 or region.area < 30:
            continue
        # Nothing is beyond the picture's border either: a band that leaves the picture ends there.
        room = cv2.distanceTransform(np.pad(region.image, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
        skeleton = skeletonize(region.image)
        if skeleton.sum() < 10:
            continue
        path = _strip_path(skeleton, MIN_LOOP * 2.0 * float(np.median(room[skeleton])))
        radius = room[tuple(path.T)]
        # A hair that sticks out of an end is thin, as is the tip of a skeleton; so is a strip that is seen edge-on.
        thick = np.flatnonzero(radius > min(0.5 * np.median(radius), HAIR))
        kept = slice(thick[0], thick[-1] + 1)
        path, radius = path[kept], radius[kept]
        if len(path) < 10:
            continue
        contrast = float(np.median(difference[region.slice][tuple(path.T)]))
        # Layers seen as one band lie on either side of its middle, which the path passes twice, the upper one first.
        _, first, which, times = np.unique(path, axis=0, return_index=True, return_inverse=True, return_counts=True)
        merged = times[np.ravel(which)] > 1
        side = np.where(np.isin(np.arange(len(path)), first), -1.0, 1.0)
        if merged.any():
            away, nearest = cKDTree(path[merged]).query(path)
            # To and from the middle the skeleton is on neither layer.
            kept = merged | (away > radius[merged][nearest])
            path, radius, merged, side = path[kept], radius[kept], merged[kept], side[kept]
        radius = np.where(merged, 0.5 * radius, radius)
        row = path[:, 0] + np.where(merged, side * radius, 0.0)
        corner = [region.slice[1].start, region.slice[0].start]
        points = np.column_stack([path[:, 1], row]) + corner
        yield RoughPath(points, np.maximum(2.0 * radius - 1.0, 1.0), bright, contrast)


def _strip_path(skeleton: Mask, least: float) -> Index:
    """Rows and columns, shape (n, 2), of the longest shortest path through a skeleton, from the end that is higher up.

    Where the sag of a folded strip hides the gap to the layer below, with the loop behind, at least ``least`` long.
    """
    graph, nodes = pixel_graph(skeleton, connectivity=2)
    # dijkstra needs indices of 32 bits, and old versions of SciPy do not convert them.
    indices, starts = graph.indices.astype(np.int32), graph.indptr.astype(np.int32)
    graph = csr_array((graph.data, indices, starts), graph.shape)
    places = np.column_stack(np.unravel_index(nodes, skeleton.shape))
    end = 0
    for _ in range(3):
        away, before = dijkstra(graph, directed=False, indices=end, return_predecessors=True)
        end = int(np.argmax(np.where(np.isfinite(away), away, -1.0)))
    path = _back(before, end)
    if places[path[0], 0] > places[path[-1], 0]:
        path = path[::-1]
    distance, back, _ = dijkstra(graph, directed=False, indices=path, return_predecessors=True, min_only=True)
    far = int(np.argmax(np.where(np.isfinite(distance), distance, -1.0)))
    if distance[far] < least:
        return places[path]
    one = _back(back, far)
    # The loop's other half begins next to it, or across a gap where the bend between the layers is too dim.
    gap = np.hypot(*(places - places[far]).T)
    gap[[*path, *one]] = np.inf
    near = int(np.argmin(gap))
    if gap[near] > least:
        return places[path]  # a branch
    # The other way round the loop avoids the first one.
    used = np.where(np.isin(np.arange(len(places)), one), REUSED, 1.0)
    row = np.repeat(np.arange(len(places)), np.diff(starts))
    detour = csr_array((graph.data * used[row] * used[indices], indices, starts), graph.shape)
    _, back, _ = dijkstra(detour, directed=False, indices=path, return_predecessors=True, min_only=True)
    other = _back(back, near)
    if np.isin(other, one).mean() > 0.5:
        return places[path]  # a branch
    # The gripper is above the strip: from it the upper layer comes first.
    upper, lower = sorted((one, other), key=lambda way: float(places[way, 0].mean()))
    first, last = path.index(upper[-1]), path.index(lower[-1])
    return places[[*path[:first], *upper[::-1], *lower, *path[last + 1 :]]]


def _back(before: Index, end: int) -> list[int]:
    """The nodes from one to the source of its shortest path."""
    path = [end]
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    return path


def _joined(pieces: list[RoughPath]) -> tuple[RoughPath, list[RoughPath]]:
    """The first piece with those that continue it across gaps, and the pieces that are left."""
    whole, rest = pieces[0], pieces[1:]
    while True:
        near = [
            (_gap(mine.points, its.points, whole.width), other, mine, its)
            for other in rest
            if 0.5 < other.width / whole.width < 2.0 and 0.4 < other.contrast / whole.contrast < 2.5
            for mine in (whole, whole.reversed())
            for its in (other, other.reversed())
        ]
        gap, other, mine, its = min(near, key=lambda found: found[0], default=(np.inf, whole, whole, whole))
        if gap >= max(12.0 * whole.width, 0.12 * whole.length):
            return whole, rest
        rest.remove(other)
        points, widths = np.concatenate([mine.points, its.points]), np.concatenate([mine.widths, its.widths])
        whole = replace(whole, points=points, widths=widths)


def _gap(before: Array, after: Array, width: float) -> float:
    """Distance from the end of one path to the start of another; infinite where no arc of a circle continues it."""
    n = max(int(2.0 * width), 10)
    step = after[0] - before[-1]
    distance = float(np.hypot(*step))
    first, last = _unit(before[-1] - before[-n:][0]), _unit(after[:n][-1] - after[0])
    if float(step @ first) < 0.0:
        return np.inf  # beside it, not behind its end
    # A short step is as rough as the paths.
    chord = _unit(step if distance > 2.0 * width else first + last)
    along = float(first @ chord)
    # The chord of an arc makes the same angle with both of its ends, of 45 degrees at most where it is a bend's.
    symmetric = float((2.0 * along * chord - first) @ last)
    return distance if min(along, symmetric) > 0.7 else np.inf


def _unit(vector: Array) -> Array:
    return np.asarray(vector / max(float(np.hypot(*vector)), 1e-9))
