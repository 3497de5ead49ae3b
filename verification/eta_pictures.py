"""eta_b from pictures: the interval of a fold against its truth, and pictures that show no strip.

The folds are drawn from a boundary-value problem solved here by other means than the fit's, with random thickness,
size, tilt, blur, noise and light.  The pictures without a strip are drawn at random (boards, rings, letters, closed
curves, textures), together with the public ones of the configured folder; none may give an eta_b.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from pathlib import Path

import cv2
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import SolveError, StripfoldError
from stripfold.base.material import GRAVITY
from stripfold.film import eta
from stripfold.film.pictures import read_grey
from verification.common import Progress, dataset, pooled
from verification.numbers import Facts, Number, covers, seed_of, share

SIZE = 640, 360
"""Width and height of a drawn picture, pixels."""
FINE = 4
"""Supersampling."""
SCALE = 3e-4
FLAT = eta.View(tilt=0.0, roll=0.0, depth=0.0)
"""The drawings are as flat as the edge of the strip."""
KINDS = "board", "rings", "letters", "closed curves", "stripes", "texture", "triangles", "crosses"
PUBLIC = "opencv_calib/*.jpg", "opencv_charuco/*.jpg"
"""Public pictures that show no strip."""


@lru_cache
def loop(thickness: float) -> Array:
    """x and z of the loop of a strip that lands on itself, shape (n, 2), L*; lift-off is the origin.

    theta'' = F_x sin(theta) - (F_0 + s) cos(theta), with no moment at both ends and ``thickness`` between the layers.
    """

    def rates(x: Array, y: Array, p: Array) -> Array:
        cos, sin = np.cos(y[0]), np.sin(y[0])
        return np.asarray(p[2] * np.array([y[1], p[1] * sin - (p[0] + p[2] * x) * cos, cos, sin]))

    def ends(a: Array, b: Array, p: Array) -> Array:
        return np.array([a[0], a[1], a[2], a[3], b[0] - np.pi, b[1], b[3] - thickness])

    x = np.linspace(0.0, 1.0, 60)
    angle = np.pi * np.clip(1.6 * x - 0.1, 0.0, 1.25) - 0.8 * np.pi * np.clip(x - 0.75, 0.0, 0.25)
    path = [np.cumsum(f(angle)) * 4.68 / 60.0 for f in (np.cos, np.sin)]
    found = solve_bvp(rates, ends, x, np.array([angle, np.gradient(angle, 4.68 * x), *path]), [-3.745, 0.0, 4.683])
    if not found.success or not 4.0 < found.p[2] < 5.0:
        raise SolveError("the loop that is drawn was not found", parameter=thickness)
    return np.asarray(found.sol(np.linspace(0.0, 1.0, 300))[2:].T)


def fold(case: tuple[int, int], thicknesses: Sequence[float]) -> tuple[float, float, float]:
    """eta_b of a drawn fold over its truth, and the ends of its interval; ``case``: number and seed of its look."""
    random = np.random.default_rng(case)
    thickness, side = float(random.choice(thicknesses)), float(random.choice([-1.0, 1.0]))
    tilt = np.radians(random.uniform(-8.0, 8.0))
    # L* in pixels: a band is at least 3 pixels wide.
    unit = random.uniform(max(50.0, 3.0 / thickness), 125.0)
    path = loop(thickness)
    curve = np.vstack([[-4.0, 0.0], path, path[-1] - [1.2, 0.0]]) + np.array([1.2, -0.4])
    c, s = np.cos(tilt), np.sin(tilt)
    pixels = unit * (curve * [side, -1.0]) @ np.array([[c, s], [-s, c]]) + np.array(SIZE) / 2.0
    # The filled quadrilaterals include the pixels on their edges.
    half = 0.5 * (thickness * unit - 1.0 / FINE)
    step = np.diff(pixels, axis=0)
    away = half * np.column_stack([-step[:, 1], step[:, 0]]) / np.hypot(*step.T)[:, None]
    tones = [random.uniform(15.0, 70.0), random.uniform(130.0, 220.0)]
    strip, ground = random.permutation(tones)
    slope, shade = random.uniform(-25.0, 25.0, 2)
    # The background's slope over the picture, and the difference between the strip's two faces.
    behind = ground + slope * np.linspace(-0.5, 0.5, SIZE[0])
    covered, face = (_share(pixels, away, inner) for inner in (-1.0, 0.0))
    grey = behind + (strip - behind) * covered + shade * face
    found = measured(photographed(grey, random.uniform(0.6, 2.0), random.uniform(1.0, 8.0), random), "fold")
    eta_b, low, high = np.array(found) * GRAVITY * (unit * SCALE) ** 3
    return float(eta_b), float(low), float(high)


def _share(pixels: Array, away: Array, inner: float) -> Array:
    """Share of each pixel that a band beside a polygon covers, from ``inner`` times ``away`` to ``away``."""
    ends = (pixels[:-1] + away, pixels[1:] + away, pixels[1:] + inner * away, pixels[:-1] + inner * away)
    fine = np.zeros((SIZE[1] * FINE, SIZE[0] * FINE), np.uint8)
    for quad in np.rint(256.0 * ((np.stack(ends, axis=1) + 0.5) * FINE - 0.5)).astype(np.int32):
        cv2.fillConvexPoly(fine, quad, 255, shift=8)
    return cv2.resize(fine, SIZE, interpolation=cv2.INTER_AREA) / 255.0


def photographed(grey: Array, blur: float, noise: float, random: np.random.Generator) -> NDArray[np.uint8]:
    """With blur and noise, rounded."""
    image = cv2.GaussianBlur(np.asarray(grey, np.float64), (0, 0), blur)
    return np.clip(np.round(image + random.normal(0.0, noise, image.shape)), 0, 255).astype(np.uint8)


def empty(kind: str, seed: int) -> NDArray[np.uint8]:
    """A picture without a strip."""
    random = np.random.default_rng(seed)
    grey: Array = np.full(SIZE[::-1], 60, np.uint8)
    light = int(random.integers(120, 230))
    thick = int(random.integers(3, 14))
    centres = random.uniform([100.0, 80.0], [660.0, 340.0], (6, 2)).astype(int)
    if kind == "board":
        size = int(random.integers(20, 60))
        y, x = np.indices(grey.shape)
        grey[((x // size + y // size) % 2 == 0) & (x > 80) & (x < 680) & (y > 40) & (y < 380)] = light
    elif kind == "rings":
        for x, y in centres:
            axes = (int(random.integers(20, 120)), int(random.integers(20, 70)))
            cv2.ellipse(grey, (int(x), int(y)), axes, float(random.uniform(0, 180)), 0.0, 360.0, light, thick)
    elif kind == "letters":
        text = "".join(random.choice(list("ABDOPQR0689beoq"), 6))
        cv2.putText(grey, text, (40, 280), cv2.FONT_HERSHEY_SIMPLEX, 5.0, light, thick)
    elif kind == "closed curves":
        for x, y in centres[:2]:
            angle = np.linspace(0.0, 2.0 * np.pi, 200)
            radius = 90.0 * (1.0 + sum(random.normal(0.0, 0.3 / k) * np.cos(k * angle + k) for k in (1, 2, 3)))
            curve = np.column_stack([x + 1.6 * radius * np.cos(angle), y + radius * np.sin(angle)])
            cv2.polylines(grey, [curve.astype(np.int32)], True, light, thick)
    elif kind == "stripes":
        y, x = np.indices(grey.shape)
        grey = 100.0 + 60.0 * np.sign(np.sin((x * random.uniform(-1, 1) + y) / random.uniform(8, 30)))
    elif kind == "texture":
        grey = cv2.GaussianBlur(random.normal(0.0, 1.0, SIZE[::-1]), (0, 0), float(random.uniform(2.0, 15.0)))
        grey = 120.0 + 45.0 * grey / grey.std()
    elif kind == "triangles":
        for x, y in centres[:4]:
            # A triangle without a visible inside is a picture of a bent rod, which a strip may look like.
            corners = random.uniform(-120.0, 120.0, (3, 2))
            while min(cv2.minAreaRect(corners.astype(np.float32))[1]) < 3.0 * thick:
                corners = random.uniform(-120.0, 120.0, (3, 2))
            cv2.polylines(grey, [(np.array([x, y]) + corners).astype(np.int32)], True, light, thick)
    else:
        for (x, y), angle in zip(centres, random.uniform(0.0, np.pi, 6), strict=True):
            arm = 150.0 * np.array([np.cos(angle), np.sin(angle)])
            cv2.line(grey, (x - int(arm[0]), y - int(arm[1])), (x + int(arm[0]), y + int(arm[1])), light, thick)
    return photographed(grey, float(random.uniform(0.6, 1.5)), float(random.uniform(1.0, 8.0)), random)


def measured(image: Picture, method: str) -> tuple[float, float, float]:
    """eta_b and the ends of its interval; nan where it is refused."""
    try:
        found = eta.from_image(image, SCALE, method, view=FLAT)
    except StripfoldError:
        return np.nan, np.nan, np.nan
    return found.eta_b, *found.interval


def given(case: tuple[str, int] | Path) -> bool:
    """Whether any method gives an eta_b for a picture without a strip."""
    image = read_grey(case) if isinstance(case, Path) else empty(*case)
    return any(np.isfinite(measured(image, method)[0]) for method in ("fold", "loop", "cantilever"))


def run(
    images: str | Path = "../shared/data",
    cases: int = 60,
    seed: int = 1,
    scenes: int = 1,
    thicknesses: Sequence[float] = (0.03, 0.05, 0.08, 0.12, 0.16),
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Measure ``cases`` drawn folds, and ``scenes`` drawn pictures of each kind that show no strip.

    Dataset over ``case``: eta_b of a fold relative to the truth with its interval, nan where refused; and over
    ``picture``: whether an eta_b was given for a picture without a strip.
    """
    folds = [(number, seed) for number in range(cases)]
    columns = zip(*pooled(partial(fold, thicknesses=thicknesses), folds, threads, progress), strict=True)
    found = {name: ("case", column) for name, column in zip(("eta", "low", "high"), columns, strict=True)}
    pictures: list[tuple[str, int] | Path] = [(kind, seed + number) for kind in KINDS for number in range(scenes)]
    pictures += [path for pattern in PUBLIC for path in sorted(Path(images).glob(pattern))]
    wrong = [float(one) for one in pooled(given, pictures, threads)]
    return dataset({**found, "given": ("picture", wrong)}, {"seed": seed})


def facts(d: xr.Dataset) -> Facts:
    known = np.isfinite(d.eta.values)
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "refused": np.sum(~known),
        "share": share(((d.low <= 1.0) & (d.high >= 1.0)).values),
        "error": np.median(np.abs(d.eta.values[known] - 1.0)) if known.any() else np.nan,
        "half": np.median((d.high - d.low).values[known]) / 2.0 if known.any() else np.nan,
        "given": d.given.sum(),
        "empty": d.sizes["picture"],
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("eta_fold_coverage", "share", "1", "0.93 to 0.97",
            "share of the 95 % intervals of eta_b that contain the truth, {cases} drawn folds ({seed}), the {refused} "
            "refused among them; median error {error:.2%}, half width {half:.2%}",
            lambda f: covers(f.share, f.cases, 0.93, 0.97)),
        Number("eta_not_fabric", "given", "count", "= 0",
            "eta_b given for pictures that show no strip, by any method, of {empty} ({seed})"),
    ),
}
# fmt: on
