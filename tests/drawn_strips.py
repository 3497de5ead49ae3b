"""Pictures of strips whose centrelines are known: each pixel's share of the band from its distance to the curve."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from stripfold import elastica
from stripfold.base.arrays import Array


def coverage(curve: Array, width: float, size: tuple[int, int]) -> Array:
    """Share of each pixel that a band of ``width`` with square ends covers; shape (h, w) of ``size`` (w, h)."""
    steps = np.hypot(*np.diff(curve, axis=0).T)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    fine = CubicSpline(arc, curve)(np.linspace(0.0, arc[-1], int(arc[-1] / 0.1)))
    y, x = np.mgrid[: size[1], : size[0]]
    pixels = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    away, index = cKDTree(fine).query(pixels, distance_upper_bound=width / 2 + 2.0)
    share = np.clip(width / 2 - np.minimum(away, width) + 0.5, 0.0, 1.0)
    for end, before in ((0, 1), (len(fine) - 1, len(fine) - 2)):
        out = fine[end] - fine[before]
        beyond = (pixels - fine[end]) @ (out / np.hypot(*out))
        share = np.where(index == end, share * np.clip(0.5 - beyond, 0.0, 1.0), share)
    return np.asarray(share.reshape(size[1], size[0]))


def photographed(
    curve: Array, thickness: float, size: tuple[int, int], *, width: float, distance: float, tilt: float, turn: float
) -> Array:
    """Share of each pixel that a strip of ``width`` behind ``curve`` covers for a camera at a ``distance``; pixels.

    ``curve`` is its near edge, in the picture's scale.  The camera's axis leads through the middle of the picture, a
    ``tilt`` down and a ``turn`` sideways, degrees, from the direction of the width.
    """
    fine = np.zeros((4 * size[1], 4 * size[0]), np.uint8)
    middle, (a, b) = 0.5 * np.array(size), np.radians([tilt, turn])
    x, down = (curve - middle).T
    for y in np.linspace(0.0, width, int(width) + 2):
        right, ahead = x * np.cos(b) + y * np.sin(b), y * np.cos(b) - x * np.sin(b)
        low, away = down * np.cos(a) - ahead * np.sin(a), distance + ahead * np.cos(a) + down * np.sin(a)
        seen = middle + distance / away[:, None] * np.column_stack([right, low])
        line = np.rint(256.0 * (4.0 * (seen + 0.5) - 0.5)).astype(np.int32)
        cv2.polylines(fine, [line[:, None]], False, 255, round(4.0 * thickness), shift=8)
    return np.asarray(cv2.resize(fine, size, interpolation=cv2.INTER_AREA) / 255.0)


def picture(
    share: Array,
    seed: int = 0,
    *,
    strip: float = 200.0,
    ground: float = 40.0,
    blur: float = 1.0,
    noise: float = 4.0,
    slope: float = 25.0,
) -> NDArray[np.uint8]:
    """A photograph of it: background that grows brighter by ``slope`` from left to right, blur, noise."""
    background = ground + slope * np.linspace(0.0, 1.0, share.shape[1])
    image = cv2.GaussianBlur(background + (strip - background) * share, (0, 0), blur)
    image = image + np.random.default_rng(seed).normal(0.0, noise, share.shape)
    return np.clip(np.round(image), 0, 255).astype(np.uint8)


def errors(points: Array, curve: Array) -> Array:
    """Signed distances of ``points`` from ``curve``, normal to it, shape (n,)."""
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve, axis=0).T))])
    spline = CubicSpline(arc, curve)
    fine = np.linspace(0.0, arc[-1], 20 * len(curve))
    _, index = cKDTree(spline(fine)).query(points)
    along = spline(fine[index], 1)
    along /= np.hypot(*along.T)[:, None]
    away = points - spline(fine[index])
    return np.asarray(away[:, 1] * along[:, 0] - away[:, 0] * along[:, 1])


def length(curve: Array) -> float:
    """Length of a densely sampled curve."""
    return float(np.hypot(*np.diff(curve, axis=0).T).sum())


def arc(centre: tuple[float, float] = (320.0, 330.0), radius: float = 220.0) -> Array:
    """Part of a circle, from the left over the top."""
    angle = np.linspace(3.0, 0.4, 800)
    return np.column_stack([centre[0] + radius * np.cos(angle), centre[1] - radius * np.sin(angle)])


def hook(state: elastica.State, unit: float, floor: float, held: float, total: float) -> Array:
    """A strip whose gripper moves to the right: from its end, through the loop, flat to the held end at ``held``."""
    raised = state.at(np.linspace(state.length, 0.0, 600))
    flat = np.linspace(0.0, total - state.length, 300)[1:]
    x = np.concatenate([raised.x, -flat])
    z = np.concatenate([raised.z, np.zeros(299)])
    return np.column_stack([held - unit * (x + flat[-1]), floor - unit * z])


def folded(unit: float, right: bool = True) -> Array:
    """A strip folded in half, 6 pixels thick; ``unit`` pixels are one L*."""
    loop = elastica.folded_loop(6.0 / unit)
    profile = loop.state.at(np.linspace(0.0, loop.arc, 800))
    lying = np.linspace(-4.0, 0.0, 300)[:-1]
    landed = np.linspace(profile.x[-1], -4.0, 300)[1:]
    x = np.concatenate([lying, profile.x, landed])
    z = np.concatenate([np.zeros(299), profile.z, np.full(299, 6.0 / unit)])
    side = 1.0 if right else -1.0
    return np.column_stack([320.0 + side * unit * (x + 1.6), 330.0 - unit * z])


def looped(kind: str, half: float, unit: float, turned: float = 0.0) -> Array:
    """A strip 6 pixels thick that hangs as a loop, ``half`` of its length in L*; ``turned``: of the camera, degrees.

    By a solver of boundary value problems, from the loop without weight on.
    """
    s, upright = np.linspace(0.0, half, 400), 0.5 * np.pi if kind == "heart" else -0.5 * np.pi
    angle = upright - (np.pi + upright) * s / half + (0.0 if kind == "heart" else 1.2) * np.sin(np.pi * s / half)
    y = np.array([angle, np.gradient(angle, s), *(np.cumsum(of(angle)) * s[1] for of in (np.cos, np.sin))])
    force = np.zeros(1)
    for weight in np.linspace(0.0, 1.0, 12) ** 3:

        def rates(s: Array, y: Array, p: Array, weight: float = weight) -> Array:
            sin, cos = np.sin(y[0]), np.cos(y[0])
            return np.array([y[1], p[0] * sin - weight * (s - half) * cos, cos, sin])

        def ends(a: Array, b: Array, p: Array) -> Array:
            return np.array([a[0] - upright, b[0] + np.pi, a[2] - 3.0 / unit, a[3], b[2]])

        found = solve_bvp(rates, ends, s, y, force, tol=1e-6, max_nodes=20000)
        assert found.success
        y, force = found.sol(s), found.p
    right = found.sol(np.linspace(0.0, half, 500))[2:].T
    curve = unit * np.concatenate([right * [-1.0, 1.0], right[-2::-1]])
    c, s_ = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    curve = (curve * [1.0, -1.0]) @ np.array([[c, s_], [-s_, c]])
    return np.asarray(curve - 0.5 * (curve.min(axis=0) + curve.max(axis=0)) + [320.0, 260.0])
