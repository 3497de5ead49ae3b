"""The edges of a band on cross sections in NumPy, as :mod:`stripfold.kernels.sections` finds them."""

from __future__ import annotations

import cv2
import numpy as np

from stripfold.base.arrays import Array
from stripfold.film.cross_sections import THIN, Grey


def edges(profiles: Grey, width: Array) -> Array:
    """Offset, width, contrast and noise, and whether both edges were found, shape (5, n)."""
    middle = profiles.shape[1] // 2
    far = np.rint(1.2 * width).astype(int) + 5
    blurred = cv2.blur(profiles, (3, 1), borderType=cv2.BORDER_REPLICATE)
    t = np.abs(np.arange(-middle, middle + 1))
    core = (0.3 * width).astype(int)[:, None]
    top = np.sum(profiles, axis=1, where=t <= core) / (2 * core[:, 0] + 1)
    beside = (t > np.minimum(np.rint(0.5 * width) + 1, far - 1)[:, None]) & (t <= far[:, None])
    blurred[~beside] = np.inf
    left, right = blurred[:, :middle].min(axis=1), blurred[:, middle:].min(axis=1)
    below, found_below, slope_below = _crossing(profiles[:, middle::-1], 0.5 * (top + left), far)
    above, found_above, slope_above = _crossing(profiles[:, middle:], 0.5 * (top + right), far)
    base = 0.5 * (left + right)
    near = t <= np.minimum(0.5 * width + 2.0, far)[:, None]
    weight = np.maximum(profiles - (base + 0.1 * (top - base))[:, None], 0.0) * near
    centroid = (weight @ np.arange(-middle, middle + 1)) / np.maximum(weight.sum(axis=1), 1e-6)
    offset = np.where(width <= THIN, centroid, 0.5 * (above - below))
    noise = 0.5 * np.hypot(1.0 / slope_below, 1.0 / slope_above)
    return np.array([offset, above + below, top - np.maximum(left, right), noise, found_below & found_above])


def _crossing(values: Grey, level: Array, far: Array) -> tuple[Array, Array, Array]:
    low = values < level[:, None]
    low[:, 0] = False
    at = np.argmax(low, axis=1)
    rows = np.arange(len(values))
    found = (at > 0) & (at <= far)
    at = np.where(found, at, 1)
    before, after = values[rows, at - 1], values[rows, at]
    drop = np.maximum(before - after, 1e-3)
    return at - 1 + np.clip((before - level) / drop, 0.0, 1.0), found, np.maximum(drop, 1.0)
