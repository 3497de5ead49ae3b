"""The height of the loop of a strip folded in half: its inside in the picture, and the layers above and below it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from skimage.measure import label, regionprops
from skimage.segmentation import clear_border

from stripfold.arrays import Array, Picture
from stripfold.errors import TrackingError
from stripfold.vision.cross_sections import edges_at, inside, sample
from stripfold.vision.segmentation import RoughPath, candidates, closed, foreground, reduced, unreduced

EDGE_SD = 0.1
"""Uncertainty of an edge at half contrast, pixels: blur and light are not the same on both sides."""
NEEDED = "a strip folded in half that lies on a table, seen from the side, with light through its loop"
ADVICE = "turn the camera along the fold, with a plain background much darker or brighter than the strip"


@dataclass(frozen=True, eq=False)
class Fold:
    """A measured loop, pixels.

    ``height`` of the upper layer's middle above the lower one's, with its standard deviation; ``width`` of the band;
    ``top``, shape (2,), and its ``foot`` on the lower layer; measured middles of both layers, shape (n, 2);
    ``residual`` of those of the upper layer about their curve, shape (n,).
    """

    height: float
    sd: float
    width: float
    top: Array
    foot: Array
    upper: Array
    lower: Array
    residual: Array


def measure_fold(image: Picture, source: str = "picture") -> Fold:
    """The loop of a folded strip in an upright picture; the table is where the lower layer lies straight.

    Raises
    ------
    TrackingError
        No strip, no loop, or one that the picture cuts.
    """
    rough = max(candidates(image), key=lambda item: item.length * item.contrast, default=None)
    if rough is None:
        raise TrackingError(source, "no strip was found", NEEDED, ADVICE)
    columns, ceiling, ground = _inside_of_loop(image, rough, source)
    high = int(np.argmin(ceiling))
    height = float(np.max(ground) - ceiling[high])
    width = _band_width(image, columns[high], ceiling[high], rough)
    # The loop is round on one side and ends in a wedge on the other, where the layers meet.
    wedge = 1.0 if columns[-1] - columns[high] > columns[high] - columns[0] else -1.0
    along = wedge * (columns - columns[high])
    lying = (along > 0.5 * height) & (along < 1.8 * height) & (ground - ceiling > 0.15 * height)
    near = np.abs(along) < 0.5 * height
    if lying.sum() < 8 or near.sum() < 8:
        raise TrackingError(source, "the loop is too small or has no lower layer", NEEDED, ADVICE)
    lower = _layer(image, columns[lying], ground[lying] + 0.5 * width, width, rough.bright, source)
    upper = _layer(image, columns[near], ceiling[near] - 0.5 * width, width, rough.bright, source)
    return _largest_distance(lower, upper, width)


def _inside_of_loop(image: Picture, rough: RoughPath, source: str) -> tuple[Array, Array, Array]:
    """Columns of the loop's inside, and the rows of its first and last pixel there; each of shape (n,), pixels."""
    small, scale = reduced(image)
    mask, _ = foreground(small, rough.bright)
    regions = regionprops(clear_border(label(closed(mask) == 0, connectivity=1)))
    holes = [
        region
        for region in regions
        if region.area > (2.0 * rough.width / scale[0]) ** 2 and mask[max(region.bbox[0] - 1, 0), region.slice[1]].any()
    ]
    if not holes:
        raise TrackingError(source, "the strip encloses no loop inside the picture", NEEDED, ADVICE)
    hole = max(holes, key=lambda region: region.area)
    top, left, bottom, right = hole.bbox
    first, last = top + np.argmax(hole.image, axis=0), bottom - 1 - np.argmax(hole.image[::-1], axis=0)
    columns, first, last = (
        unreduced(a, k) for a, k in zip((np.arange(left, right), first, last), scale[[0, 1, 1]], strict=True)
    )
    return columns, first, last


def _band_width(image: Picture, column: float, row: float, rough: RoughPath) -> float:
    """Thickness of the upper layer at the loop's top, pixels: that of the skeleton is of two layers on each other."""
    reach = int(3.0 * rough.width) + 6
    points = np.column_stack([column + np.arange(-3.0, 4.0), np.full(7, row)])
    upwards = np.tile([0.0, -1.0], (7, 1))
    profile = np.median(sample(image, points, upwards, reach, rough.bright), axis=0)[reach:]
    clear = profile > 0.5 * (float(np.max(profile)) + float(np.min(profile)))
    first = int(np.argmax(clear))
    return float(np.argmin(clear[first:])) or rough.width


def _layer(image: Picture, x: Array, y: Array, width: float, bright: bool, source: str) -> Array:
    """Middles of a layer on vertical sections, shape (n, 2), pixels."""
    points = np.column_stack([x, y])
    down = np.tile([0.0, 1.0], (len(x), 1))
    if not inside(points, image.shape, width).all():
        raise TrackingError(source, "the picture's border cuts the loop", NEEDED, "leave some room around the loop")
    # Twice: the mask's edge is a pixel or two off, and a thin band has to lie in the middle of its sections.
    points[:, 1] += edges_at(image, points, down, width, bright).offset
    edges = edges_at(image, points, down, width, bright)
    good = edges.found & (np.abs(edges.width / max(float(np.median(edges.width)), 1.0) - 1.0) < 0.5)
    if good.sum() < 8:
        raise TrackingError(source, "a layer of the loop has no clear edges", NEEDED, ADVICE)
    return np.column_stack([x, points[:, 1] + edges.offset])[good]


def _largest_distance(lower: Array, upper: Array, width: float) -> Fold:
    """Largest distance of the upper layer from the line through the lower one."""
    centre = lower[:, 0].mean()
    (slope, level), line_covariance, _ = _robust_polynomial(lower[:, 0] - centre, lower[:, 1], 1)
    shortening = 1.0 / np.hypot(1.0, slope)
    x = upper[:, 0] - centre
    away = (level + slope * x - upper[:, 1]) * shortening
    middle, half = x.mean(), 0.5 * np.ptp(x)
    coefficients, covariance, residual = _robust_polynomial((x - middle) / half, away, 4)
    t = np.linspace(-0.9, 0.9, 2001)
    values = np.polyval(coefficients, t)
    top = int(np.argmax(values))
    height, place = float(values[top]), float(middle + half * t[top])
    of_curve, of_line = np.vander([t[top]], 5)[0], np.array([place, 1.0])
    variance = of_curve @ covariance @ of_curve + of_line @ line_covariance @ of_line + 2.0 * EDGE_SD**2
    foot = np.array([place + centre, level + slope * place])
    up = shortening * np.array([slope, -1.0])
    return Fold(height, float(np.sqrt(variance)), width, foot + height * up, foot, upper, lower, residual)


def _robust_polynomial(x: Array, y: Array, degree: int) -> tuple[Array, Array, Array]:
    """Coefficients (highest power first), their covariance with neighbours correlated, and residuals."""
    design = np.vander(x, degree + 1)
    weights = np.ones(len(x))
    for _ in range(5):
        root = np.sqrt(weights)
        coefficients = np.linalg.lstsq(design * root[:, None], y * root, rcond=None)[0]
        residual = y - design @ coefficients
        sigma = max(1.4826 * float(np.median(np.abs(residual))), 1e-3)
        weights = 1.0 / (1.0 + (residual / (2.4 * sigma)) ** 2)
    normal = np.linalg.inv(design.T @ (weights[:, None] * design))
    rho = float(np.clip(residual[1:] @ residual[:-1] / max(float(residual @ residual), 1e-12), 0.0, 0.95))
    scatter = float(weights @ residual**2) / max(weights.sum() - degree - 1.0, 1.0)
    return np.asarray(coefficients), normal * scatter * (1.0 + rho) / (1.0 - rho), residual
