"""The height of the loop of a strip folded in half: its inside in the picture, and the layers above and below it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from stripfold.arrays import Array, Picture
from stripfold.errors import TrackingError
from stripfold.vision.mask import candidates, foreground, reduced
from stripfold.vision.sections import edges_at, inside, sample

EDGE_SD = 0.1
"""How well the height of half contrast is that of an edge, pixels: blur and light are not the same on both sides."""
NEEDED = "a strip folded in half that lies on a table, seen from the side, with light through its loop"
ADVICE = "turn the camera along the fold, with a plain background much darker or brighter than the strip"


@dataclass(frozen=True, eq=False)
class Fold:
    """A measured loop, pixels.

    ``height`` of the upper layer's middle above the lower one's, with its standard deviation; ``width`` of the band;
    ``top``, shape (2,), and its ``foot`` on the lower layer; the middles of both layers where they were measured,
    shape (n, 2); ``residual`` of those of the upper layer about their curve, shape (n,).
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
    """The loop of a folded strip; the table is where the lower layer lies straight.

    Parameters
    ----------
    image
        Grey values, shape (h, w), upright.
    source
        Name for errors.

    Raises
    ------
    TrackingError
        No strip, no loop, or one that the picture cuts.
    """
    rough = max(candidates(image), key=lambda item: item.length * item.contrast, default=None)
    if rough is None:
        raise TrackingError(source, "no strip was found", NEEDED, ADVICE)
    columns, ceiling, ground = _hole(image, rough.bright, rough.width, source)
    high = int(np.argmin(ceiling))
    height = float(np.max(ground) - ceiling[high])
    width = _band_width(image, columns[high], ceiling[high], rough.width, rough.bright)
    # The loop is round on one side and ends in a wedge on the other, where the layers come together.
    wedge = 1.0 if columns[-1] - columns[high] > columns[high] - columns[0] else -1.0
    behind = wedge * (columns - columns[high])
    lying = (behind > 0.5 * height) & (behind < 1.8 * height) & (ground - ceiling > 0.15 * height)
    near = np.abs(behind) < 0.5 * height
    if lying.sum() < 8 or near.sum() < 8:
        raise TrackingError(source, "the loop is too small or has no lower layer", NEEDED, ADVICE)
    lower = _layer(image, columns[lying], ground[lying] + 0.5 * width, width, rough.bright, source)
    upper = _layer(image, columns[near], ceiling[near] - 0.5 * width, width, rough.bright, source)
    return _height(lower, upper, width)


def _height(lower: Array, upper: Array, width: float) -> Fold:
    """Largest distance of the upper layer from the line through the lower one."""
    centre = lower[:, 0].mean()
    (slope, level), line_covariance = _polynomial(lower[:, 0] - centre, lower[:, 1], 1)[:2]
    turn = 1.0 / np.hypot(1.0, slope)
    x = upper[:, 0] - centre
    away = (level + slope * x - upper[:, 1]) * turn
    middle, half = x.mean(), 0.5 * np.ptp(x)
    coefficients, covariance, residual = _polynomial((x - middle) / half, away, 4)
    t = np.linspace(-0.9, 0.9, 2001)
    values = np.polyval(coefficients, t)
    top = int(np.argmax(values))
    powers = t[top] ** np.arange(4, -1, -1)
    place = float(middle + half * t[top])
    spread = np.array([place, 1.0])
    variance = powers @ covariance @ powers + spread @ line_covariance @ spread + 2.0 * EDGE_SD**2
    height = float(values[top])
    foot = np.array([place + centre, level + slope * place])
    normal = turn * np.array([slope, -1.0])
    # Along the normal of the table, up: from the foot below the top.
    return Fold(height, float(np.sqrt(variance)), width, foot + height * normal, foot, upper, lower, residual)


def _polynomial(x: Array, y: Array, degree: int) -> tuple[Array, Array, Array]:
    """Robust fit: coefficients (highest power first), covariance with neighbours off together, residuals."""
    design = np.vander(x, degree + 1)
    weights = np.ones(len(x))
    for _ in range(5):
        root = np.sqrt(weights)
        coefficients = np.linalg.lstsq(design * root[:, None], y * root, rcond=None)[0]
        residual = y - design @ coefficients
        sigma = max(1.4826 * float(np.median(np.abs(residual))), 1e-3)
        weights = 1.0 / (1.0 + (residual / (2.4 * sigma)) ** 2)
    normal = np.linalg.inv(design.T @ (weights[:, None] * design))
    rho = float(np.clip(float(residual[1:] @ residual[:-1]) / max(float(residual @ residual), 1e-12), 0.0, 0.95))
    scatter = float(weights @ residual**2) / max(weights.sum() - degree - 1.0, 1.0)
    return np.asarray(coefficients), normal * scatter * (1.0 + rho) / (1.0 - rho), residual


def _hole(image: Picture, bright: bool, width: float, source: str) -> tuple[Array, Array, Array]:
    """Columns of the loop's inside, and the rows of its first and last pixel there; each of shape (n,), pixels."""
    small, scale = reduced(image)
    mask, _ = foreground(small, bright)
    solid = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(1 - solid, connectivity=4)
    best, area = 0, (2.0 * width / float(scale[0])) ** 2
    for label in range(1, count):
        x, y, w, h, size = (int(value) for value in boxes[label])
        outside = x == 0 or y == 0 or x + w == small.shape[1] or y + h == small.shape[0]
        if not outside and size > area and mask[max(y - 1, 0), x : x + w].any():
            best, area = label, float(size)
    if not best:
        raise TrackingError(source, "the strip encloses no loop inside the picture", NEEDED, ADVICE)
    x, y, w, h, _ = (int(value) for value in boxes[best])
    part = labels[y : y + h, x : x + w] == best
    columns = np.arange(x, x + w)
    first, last = y + np.argmax(part, axis=0), y + h - 1 - np.argmax(part[::-1], axis=0)
    # The centre of a large pixel lies between those of the small ones that it covers.
    return tuple(
        (values + 0.5) * size - 0.5 for values, size in ((columns, scale[0]), (first, scale[1]), (last, scale[1]))
    )  # type: ignore[return-value]


def _band_width(image: Picture, column: float, row: float, width: float, bright: bool) -> float:
    """Thickness of the upper layer at the loop's top, pixels: the skeleton's is that of two layers on each other."""
    reach = int(3.0 * width) + 6
    offsets = np.arange(-3.0, 4.0)
    points = np.column_stack([column + offsets, np.full(7, row)])
    across = np.tile([0.0, -1.0], (7, 1))
    profile = np.median(sample(image, points, across, reach, bright), axis=0)[reach:]
    peak = float(np.max(profile))
    level = 0.5 * (peak + float(np.min(profile)))
    above = np.flatnonzero(profile > level)
    first = int(above[0])
    behind = np.flatnonzero(profile[first:] < level)
    return float(behind[0]) if behind.size else width


def _layer(image: Picture, x: Array, y: Array, width: float, bright: bool, source: str) -> Array:
    """Middles of a layer on vertical sections, shape (n, 2), pixels."""
    points = np.column_stack([x, y])
    across = np.tile([0.0, 1.0], (len(x), 1))
    if not inside(points, image.shape, width).all():
        raise TrackingError(source, "the picture's border cuts the loop", NEEDED, "leave some room around the loop")
    # Twice: the mask's edge is a pixel or two off, and a thin band shall lie in the middle of its sections.
    points[:, 1] += edges_at(image, points, across, width, bright).offset
    edges = edges_at(image, points, across, width, bright)
    good = edges.found & (np.abs(edges.width / max(float(np.median(edges.width)), 1.0) - 1.0) < 0.5)
    if good.sum() < 8:
        raise TrackingError(source, "a layer of the loop has no clear edges", NEEDED, ADVICE)
    return np.column_stack([x, points[:, 1] + edges.offset])[good]
