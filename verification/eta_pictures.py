"""eta_b from pictures: the interval of a fold against its truth, and pictures that show no strip.

The folds are drawn from a boundary-value problem solved here by other means than the fit's, with random thickness,
size, tilt, blur, noise and light.  The pictures without a strip are drawn at random (boards, rings, letters, closed
curves, textures), together with the public ones of the configured folder; none may give an eta_b.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
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

UNITS = {"radian": "tilt"}

SIZE = 640, 360
"""Width and height of a drawn picture, pixels."""
FINE = 4
"""Supersampling."""
SCALE = 3e-4
FLAT = eta.View(tilt=0.0, roll=0.0, depth=0.0)
"""The drawings are as flat as the edge of the strip."""
METHODS = "fold", "cantilever"
KINDS = "board", "rings", "letters", "closed curves", "stripes", "texture", "triangles", "crosses"
PUBLIC = "opencv_calib/*.jpg", "opencv_charuco/*.jpg"
"""Public pictures that show no strip."""


@dataclass(frozen=True)
class Look:
    """How a fold is drawn: L* in pixels, thickness in L*, tilt in rad, side, blur and noise, and grey values.

    ``slope`` is that of the background over the picture, ``shade`` the difference between the strip's two faces.
    """

    unit: float
    thickness: float
    tilt: float
    side: float
    blur: float
    noise: float
    strip: float
    ground: float
    slope: float
    shade: float
    seed: int


def looks(count: int, thicknesses: list[float], seed: int) -> Iterator[Look]:
    """Random looks; a band is at least 3 pixels wide."""
    random = np.random.default_rng(seed)
    for number in range(count):
        thickness = float(random.choice(thicknesses))
        dark, light = random.uniform(15.0, 70.0), random.uniform(130.0, 220.0)
        bright = random.random() < 0.5
        yield Look(
            unit=float(random.uniform(max(50.0, 3.0 / thickness), 125.0)),
            thickness=thickness,
            tilt=float(np.radians(random.uniform(-8.0, 8.0))),
            side=float(random.choice([-1.0, 1.0])),
            blur=float(random.uniform(0.6, 2.0)),
            noise=float(random.uniform(1.0, 8.0)),
            strip=light if bright else dark,
            ground=dark if bright else light,
            slope=float(random.uniform(-25.0, 25.0)),
            shade=float(random.uniform(-25.0, 25.0)),
            seed=seed + number,
        )


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


def drawn(look: Look) -> NDArray[np.uint8]:
    """The picture of a fold."""
    path = loop(look.thickness)
    curve = np.vstack([[-4.0, 0.0], path, path[-1] - [1.2, 0.0]]) + np.array([1.2, -0.4])
    c, s = np.cos(look.tilt), np.sin(look.tilt)
    pixels = look.unit * (curve * [look.side, -1.0]) @ np.array([[c, s], [-s, c]]) + np.array(SIZE) / 2.0
    # The filled quadrilaterals include the pixels on their edges.
    half = 0.5 * (look.thickness * look.unit - 1.0 / FINE)
    step = np.diff(pixels, axis=0)
    away = half * np.column_stack([-step[:, 1], step[:, 0]]) / np.hypot(*step.T)[:, None]
    ground = look.ground + look.slope * np.linspace(-0.5, 0.5, SIZE[0])
    strip, face = (_share(pixels, away, inner) for inner in (-1.0, 0.0))
    grey = ground + (look.strip - ground) * strip + look.shade * face
    return photographed(grey, look.blur, look.noise, look.seed)


def _share(pixels: Array, away: Array, inner: float) -> Array:
    """Share of each pixel that a band beside a polygon covers, from ``inner`` times ``away`` to ``away``."""
    ends = (pixels[:-1] + away, pixels[1:] + away, pixels[1:] + inner * away, pixels[:-1] + inner * away)
    fine = np.zeros((SIZE[1] * FINE, SIZE[0] * FINE), np.uint8)
    for quad in np.rint(256.0 * ((np.stack(ends, axis=1) + 0.5) * FINE - 0.5)).astype(np.int32):
        cv2.fillConvexPoly(fine, quad, 255, shift=8)
    return cv2.resize(fine, SIZE, interpolation=cv2.INTER_AREA) / 255.0


def photographed(grey: Array, blur: float, noise: float, seed: int) -> NDArray[np.uint8]:
    """With blur and noise, rounded."""
    image = cv2.GaussianBlur(np.asarray(grey, np.float64), (0, 0), blur)
    image = image + np.random.default_rng(seed).normal(0.0, noise, image.shape)
    return np.clip(np.round(image), 0, 255).astype(np.uint8)


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
    return photographed(grey, float(random.uniform(0.6, 1.5)), float(random.uniform(1.0, 8.0)), seed)


def measured(image: Picture, method: str) -> tuple[float, float, float, str]:
    """eta_b, the ends of its interval, and why there is none."""
    try:
        found = eta.from_image(image, SCALE, method, view=FLAT)
    except StripfoldError as error:
        return np.nan, np.nan, np.nan, str(error)
    return found.eta_b, *found.interval, ""


def _fold(look: Look) -> tuple[float, float, float, str]:
    return measured(drawn(look), "fold")


def _empty(method: str, case: tuple[str, int] | Path) -> tuple[float, float, float, str]:
    return measured(read_grey(case) if isinstance(case, Path) else empty(*case), method)


def run(
    images: str | Path = "../shared/data",
    cases: int = 60,
    seed: int = 1,
    scenes: int = 1,
    thicknesses: list[float] = (0.03, 0.05, 0.08, 0.12, 0.16),
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Measure ``cases`` drawn folds, and ``scenes`` drawn pictures of each kind that show no strip.

    Dataset over ``case``: eta_b of a fold relative to the truth with its interval, nan where refused; and over
    ``picture`` and ``method``: whether an eta_b was given for a picture without a strip.
    """
    some = list(looks(cases, thicknesses, seed))
    rows = pooled(_fold, some, threads, progress)
    true = np.array([1.0 / (GRAVITY * (look.unit * SCALE) ** 3) for look in some])
    values = {
        name: ("case", np.array([row[i] for row in rows]) / true) for i, name in enumerate(("eta", "low", "high"))
    }
    public = [path for pattern in PUBLIC for path in sorted(Path(images).glob(pattern))]
    drawn_ones = [(kind, seed + number) for kind in KINDS for number in range(scenes)]
    given = np.array(
        [
            [row[3] == "" for row in pooled(partial(_empty, method), [*drawn_ones, *public], threads)]
            for method in METHODS
        ]
    )
    return dataset(
        {
            **values,
            "refusal": ("case", [row[3] for row in rows]),
            **{
                name: ("case", [getattr(look, name) for look in some])
                for name in ("unit", "thickness", "tilt", "blur", "noise")
            },
            "picture": (
                "picture",
                [*(f"{kind} {number}" for kind, number in drawn_ones), *(path.name for path in public)],
            ),
            "method": ("method", list(METHODS)),
            "given": (("method", "picture"), given.astype(float)),
        },
        {"seed": seed},
        units=UNITS,
    )


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
            "eta_b given for pictures that show no strip, by either method, of {empty} ({seed})"),
    ),
}
# fmt: on
