"""eta_b from photographs held by hand, beside the card: intervals against truths.

The second generator of films draws folds and hanging strips of up to 6 cm width and hanging loops of up to 3 cm before
a backdrop, with wrinkles, their shadows and the card of :mod:`stripfold.film.plate`, printed by OpenCV; half of the
strips share the picture with a ruler.  A camera looks from a hand: up to 8 degrees down, 6 aside, rolled by up to 8.
Its focal length is known of two thirds of them, to the rounding of a phone's data, and so is the strip's width, to half
a millimetre.
"""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Any, NamedTuple

import cv2
import numpy as np
import xarray as xr
from scipy.integrate import solve_bvp

from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import SolveError
from stripfold.base.material import GRAVITY
from stripfold.film import eta, plate
from verification.common import Progress, attempted, pooled, table
from verification.eta_pictures import loop
from verification.films.second.picture import Camera, Look, Studio, exposed, polygons
from verification.numbers import Facts, Number, covers, seed_of, share
from verification.phone_films import PRINT_SD, plate_print

STRIPS, LOOPS = ("fold", "cantilever"), ("heart", "pear")
SIZE = 1600, 1200
WIDEST_LOOP = 0.03
"""Largest width of a strip that hangs as a loop, m: through a wider one little is seen."""
WRINKLE, WRINKLES = 0.004, 5
"""Largest height of each wave of a wrinkled strip, L*, and their number: one to five along the strip."""
WIDTH_SD, DEPTH_SD = 5e-4, 0.002
"""Standard deviations of the width that is told, and of the card's distance from the plane of the strip's edge, m."""
JAWS = {
    "cantilever": ((-0.05, 0.0, 0.015), (-0.05, 0.0, -0.015)),
    "heart": ((-0.004, 0.004, -0.012),),
    "pear": ((-0.015, 0.0, 0.04), (0.0, 0.015, 0.04)),
}
"""Rectangles beside the clamped end: x from and to, and how high, m."""
WRONG = 3.0
"""Half widths of an interval beyond which a value is wrong without a word."""


class Photograph(NamedTuple):
    """A picture, its truth, and what is said of it: width, m, and focal length over the longer side, or None."""

    image: Picture
    eta_b: float
    width: float | None
    focal: float | None


def hanging(length: float, slope: float) -> Array:
    """x and z of a strip that hangs out of a clamp, shape (n, 2), L*: ``slope`` is that of the clamp, rad."""
    s = np.linspace(0.0, length, 300)

    def rates(s: Array, y: Array) -> Array:
        return np.array([y[1], (length - s) * np.cos(y[0])])

    guess = np.array([slope - 0.5 * s, np.full_like(s, -0.5)])
    angle = solve_bvp(rates, lambda a, b: np.array([a[0] - slope, b[1]]), s, guess, max_nodes=20000).sol(s)[0]
    middle = 0.5 * (angle[1:] + angle[:-1])
    return np.vstack(
        [np.zeros(2), np.cumsum(np.diff(s)[:, None] * np.column_stack([np.cos(middle), np.sin(middle)]), 0)]
    )


def folded(thickness: float) -> Array:
    """x and z of the middle of a folded strip that lies on a table, shape (n, 2), L*."""
    path = loop(thickness)
    ends = [path[:1] - [4.0, 0.0], path[-1:] - [1.5, 0.0]]
    lines = [np.linspace(ends[0][0], path[0], 120)[:-1], path, np.linspace(path[-1], ends[1][0], 60)[1:]]
    return np.vstack(lines) + np.array([0.0, 0.5 * thickness])


def looped(kind: str, half: float, thickness: float) -> Array:
    """x and z of a loop that hangs from its ends, shape (n, 2), L*, these at the origin; ``half`` of its length."""
    right = _half_loop(kind, half, thickness)
    return np.concatenate([right * [-1.0, 1.0], right[-2::-1]])


@lru_cache
def _half_loop(kind: str, half: float, thickness: float) -> Array:
    """By a solver of boundary value problems, from the loop without weight on."""
    s, upright = np.linspace(0.0, 1.0, 400), 0.5 * np.pi if kind == "heart" else -0.5 * np.pi
    angle = upright - (np.pi + upright) * s + (0.0 if kind == "heart" else 1.2) * np.sin(np.pi * s)
    places = [np.cumsum(of(angle)) / len(s) for of in (np.cos, np.sin)]
    y, p = np.array([angle, np.gradient(angle, s), *places]), np.zeros(1)
    for weight in [0.0, *np.geomspace(0.05, max(half**3, 0.05), 24)]:

        def rates(s: Array, y: Array, p: Array, weight: float = weight) -> Array:
            sin, cos = np.sin(y[0]), np.cos(y[0])
            return np.array([y[1], p[0] * sin - weight * (s - 1.0) * cos, cos, sin])

        def ends(a: Array, b: Array, p: Array) -> Array:
            return np.array([a[0] - upright, b[0] + np.pi, a[2] - 0.5 * thickness / half, a[3], b[2]])

        found = solve_bvp(rates, ends, s, y, p, tol=1e-6, max_nodes=50000)
        if not found.success:
            raise SolveError("the loop that is drawn was not found", parameter=half)
        y, p = found.sol(s), found.p
    return half * np.asarray(found.sol(np.linspace(0.0, 1.0, 300))[2:].T)


def wrinkled(curve: Array, height: float, random: np.random.Generator) -> Array:
    """The curve with waves across it, each of up to ``height``, none at its ends."""
    share = np.linspace(0.0, 1.0, len(curve))
    along = np.gradient(curve, axis=0)
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    heights = random.uniform(-height, height, WRINKLES)
    return curve + (np.sin(np.pi * np.outer(share, 1.0 + np.arange(WRINKLES))) @ heights)[:, None] * normal


def photograph(method: str, random: np.random.Generator) -> Photograph:
    """Draw a strip, beside the card."""
    unit = float(random.uniform(0.02, 0.04))
    is_loop = method in LOOPS
    widest = WIDEST_LOOP if is_loop else 0.06
    width, thickness = float(random.uniform(0.005, widest)), float(random.uniform(0.02, 0.06)) * unit
    height = WRINKLE * float(random.choice([0.0, 1.0]))
    if method == "fold":
        curve = unit * wrinkled(folded(thickness / unit), height, random) * [random.choice([-1.0, 1.0]), 1.0]
        curve = curve - [0.5 * (curve[:, 0].min() + curve[:, 0].max()), 0.0]
    elif is_loop:
        curve = unit * wrinkled(looped(method, float(random.uniform(2.0, 5.0)), thickness / unit), height, random)
        curve = curve - [0.0, curve[:, 1].min() - random.uniform(0.01, 0.04)]
    else:
        shape = hanging(float(random.uniform(1.3, 3.5)), np.radians(random.uniform(-12.0, 12.0)))
        curve = unit * wrinkled(shape, height, random)
        curve = curve - [curve[:, 0].max(), curve[:, 1].min() - random.uniform(0.01, 0.04)]
    right = float(curve[:, 0].max()) + random.uniform(0.015, 0.04)
    paper, size = plate_print(plate.CARD)
    left, focal = float(curve[:, 0].min()), float(random.uniform(0.65, 0.85))
    middle, field = 0.5 * (left + right + size[0]), right + size[0] - left
    if is_loop:
        # A camera in front of the loop, with the card beside it.
        middle = random.uniform(0.0, 0.5) * middle
        field = 2.0 * (right + size[0] - middle)
    field /= float(random.uniform(0.55, 0.85))
    camera = Camera(
        SIZE,
        field,
        field * focal,
        float(random.normal(0.0, 0.004)),
        tilt=float(random.uniform(1.0, 8.0)),
        yaw=float(random.uniform(-6.0, 6.0)),
        roll=float(random.uniform(-8.0, 8.0)),
        wider=0.7,
    )
    camera.place += np.array([middle, 0.0, 0.4 * curve[:, 1].max() + 0.01])
    dark = bool(random.random() < 0.5)
    strip, desk, wall = (0.12, 0.5, 0.7) if dark else (0.8, 0.25, 0.15)
    look = Look(
        strip,
        desk,
        wall,
        (float(random.uniform(-0.7, 0.7)), -0.6, float(random.uniform(0.2, 1.0))),
        sheen=0.1,
        shadow=float(random.uniform(0.0, 0.35)),
        width=width,
        thickness=thickness,
        recede=float(random.normal(0.0, 0.0005)),
        narrowing=float(random.uniform(0.0, 0.02)),
        twist=0.0,
        hairs=int(random.choice([0, 40])),
        marker=0,
        marker_size=0.02,
        offset=(0.0, 0.0),
        solid=True,
    )
    studio = Studio(camera, look, random)
    canvas = studio.strip(curve, float(random.uniform(0.08, 0.3)), wall)
    if method != "fold":
        x, z = curve[0] if method == "cantilever" else 0.5 * (curve[0] + curve[-1])
        jaws = np.array([x, z]) + np.array([[[a, d], [b, d], [b, 0.0], [a, 0.0]] for a, b, d in JAWS[method]])
        at = np.stack([jaws[..., 0], np.full(jaws.shape[:2], -0.001), jaws[..., 1]], axis=-1)
        polygons(canvas, camera.on_canvas(at), np.array([70.0, 75.0]))
    printed = random.normal(1.0, PRINT_SD) * size
    studio.print(canvas, np.array([right, 0.0]), printed, paper, float(random.normal(0.0, DEPTH_SD)))
    if random.random() < 0.5:
        ruler = np.full((60, 1200), 230, np.uint8)
        ruler[:25, ::40] = 20
        studio.print(canvas, np.array([right, size[1] + 0.01]), np.array([0.12, 0.006]), ruler)
    noise = random.standard_normal(SIZE[::-1]).astype(np.float32)
    light = camera.seen(canvas, float(random.uniform(0.5, 1.2)))
    gain = float(random.uniform(0.8, 1.0) / np.percentile(light, 99.5))
    picture = exposed(light, gain, 0.6, noise, 1.0, 2.0)
    _, coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, int(random.integers(80, 96))])
    known = np.round(36.0 * focal) / 36.0 if random.random() < 2.0 / 3.0 else None
    said = max(width + float(random.normal(0.0, WIDTH_SD)), 0.002) if random.random() < 2.0 / 3.0 else None
    image = np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), np.uint8)
    return Photograph(image, 1.0 / (GRAVITY * unit**3), said, known)


def measured(number: int, seed: int, cases: int) -> dict[str, Any]:
    """One photograph, drawn and measured: eta_b and the ends of its interval over the truth, nan where refused.

    From number ``cases`` on of loops.
    """
    random = np.random.default_rng([seed, number])
    method = (STRIPS if number < cases else LOOPS)[number % 2]
    seen = photograph(method, random)
    row = {"case": number, "method": method, "told": (seen.width is not None) + 2.0 * (seen.focal is not None)}
    found, message = attempted(
        lambda: eta.from_plate(seen.image, method, width=seen.width, focal=seen.focal)  # type: ignore[arg-type]
    )
    values = (np.nan,) * 3 if found is None else (found.eta_b, *found.interval)
    return row | dict(zip(("eta", "low", "high"), np.array(values) / seen.eta_b, strict=True)) | {"message": message}


def run(
    cases: int = 4, loops: int = 2, seed: int = 1, threads: int = 1, progress: Progress | None = None
) -> xr.Dataset:
    """Draw and measure so many photographs of folds and hanging strips, and of loops; a dataset over ``case``."""
    rows = pooled(partial(measured, seed=seed, cases=cases), list(range(cases + loops)), threads, progress)
    return table("case", rows, {"seed": seed}, {})


def _of(d: xr.Dataset, methods: tuple[str, str]) -> Facts:
    d = d.isel(case=np.isin(d.method.values, methods))
    known = np.isfinite(d.eta.values)
    inside = ((d.low <= 1.0) & (d.high >= 1.0)).values
    half, off, first = 0.5 * (d.high - d.low).values, np.abs(d.eta.values - 1.0), d.method.values == methods[0]
    middle = lambda of: float(np.median(of)) if len(of) else np.nan  # noqa: E731
    return {
        "cases": len(known),
        "measured": known.sum(),
        "seed": seed_of(d),
        "share": share(inside[known]) if known.any() else np.nan,
        "refused": share(~known) if len(known) else np.nan,
        "first_error": middle(off[known & first]),
        "first_half": middle(half[known & first]),
        "second_error": middle(off[known & ~first]),
        "second_half": middle(half[known & ~first]),
        "wrong": (off > WRONG * half)[known].sum(),
    }


def facts(d: xr.Dataset) -> Facts:
    return _of(d, STRIPS)


def of_loops(d: xr.Dataset) -> Facts:
    return _of(d, LOOPS)


# fmt: off
NUMBERS = {
    facts: (
        Number("photo_coverage", "share", "1", "0.93 to 0.97",
            "share of the 95 % intervals of eta_b that hold the truth, of {measured} of {cases} photographs beside the "
            "card ({seed}), folds and hanging strips in turn; half widths {first_half:.0%} and {second_half:.0%} "
            "in the median, errors {first_error:.1%} and {second_error:.1%}",
            lambda f: covers(f.share, f.measured, 0.93, 0.97)),
        Number("photo_refused", "refused", "1", "<= 0.15", "share of these photographs that are refused"),
        Number("photo_wrong", "wrong", "count", "= 0",
            "of these photographs those whose eta_b is off by more than three half widths"),
    ),
    of_loops: (
        Number("loop_coverage", "share", "1", "0.93 to 0.97",
            "the same share of {measured} of {cases} photographs from in front of hearts and pears in turn, which hang "
            "beside the card; half widths {first_half:.0%} and {second_half:.0%} in the median, errors "
            "{first_error:.1%} and {second_error:.1%}; {wrong} off by more than three half widths",
            lambda f: covers(f.share, f.measured, 0.93, 0.97) and not f.wrong),
        Number("loop_refused", "refused", "1", "<= 0.15", "share of these photographs that are refused"),
    ),
}
# fmt: on
