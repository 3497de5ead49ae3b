"""lambda from films with the plate in view, as a phone makes them: whether the interval holds the truth.

Each film has the whole protocol: the strip flat, lifted, drawn up and pulled through the snap.  The phone stands
aside, tilted and rolled, with a lens that it corrects in part; it sags or zooms; the film is of 540 to 1080 rows, coded
as H.264, HEVC of 10 bits or MPEG-4, at an even or an uneven rate.  Every second one is of the second generator, which
shares nothing with the package: its plate is OpenCV's own picture of the board.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import av
import cv2
import numpy as np
import xarray as xr

from stripfold.base.arrays import Array, Picture
from stripfold.base.material import GRAVITY
from stripfold.film import measure, phone, plate
from stripfold.film.boards import Board
from stripfold.film.camera_motion import MOVED_BY
from stripfold.film.eta_motion import MotionEtaB
from stripfold.film.recording import half_width
from stripfold.synthetic.recording import history_of
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.sensor import Sensor
from verification.common import Progress, attempted, pooled, table
from verification.films import CHAIN, onset_of
from verification.films.second import recording as second
from verification.films.second.picture import Camera, Look, Studio, exposed
from verification.numbers import Facts, Number, seed_of, share

UNITS = {"m": "event half truth"}
MEASURED, BOUND, REFUSED, NOT_MADE = "measured", "bound", "refused", "not made"
SIZES = (960, 540), (1280, 720), (1920, 1080)
CODECS = ("libx264", "yuv420p"), ("libx265", "yuv420p10le"), ("mpeg4", "yuv420p")
MOTIONS = "still", "sag", "zoom"
SPEEDS, RATES = (0.002, 0.003, 0.004), (25.0, 30.0)
FIELD = 0.86
"""Width of the picture in the folding plane, m: strip, plate and some room."""
LENS = 0.004
"""Standard deviation of k_1 of the lens."""
SLACK, TICK = 0.25, Fraction(1, 60000)
"""Share of the frames' distance by which those of an uneven film are off; unit of their times, s."""
DEPTH_SD, TURNED_SD, LEANS_SD, PRINT_SD = 0.008, 0.05, 0.03, 0.0015
"""Standard deviations of the plate's distance from the plane of the gripper's marker, m, of the angles by which the
second generator's marker faces aside and leans, rad, and of the print's scale."""
RULER_SD = 1e-4
"""Standard deviation of a width by a ruler, m."""
OFFSET = (0.004, -0.042)
"""From the marker's middle to the strip's end, m."""
SQUARE = 60
"""Pixels of a square of the plate's print: its white borders are a whole number of them, too."""
BESIDE = 0.04
"""Distance of the plate from the strip's held end, m."""
WRONG = 2.0
"""Half widths of an interval, which misses one film in twenty, beyond which a value is wrong."""
LIFT, DRAW = 1.5, 3.0
"""Durations for which a chain is lifted and drawn up, s."""


class Shot(NamedTuple):
    """A film to be made: its frames' times, s, a function of a time that gives the picture, truth, length and width of
    the strip, m, its eta_b, and the scale of the print.
    """

    t: Array
    at: Callable[[float], Picture]
    truth: float
    length: float
    width: float
    eta_b: float
    print: float


def run(cases: int = 2, seed: int = 38, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Make and measure so many films; a dataset over ``case``.  The first two of this seed have 540 rows, and are made
    in half the time of others."""
    rows = pooled(partial(measured, seed=seed), list(range(cases)), threads, progress)
    return table("case", rows, {"seed": seed}, UNITS)


def measured(number: int, seed: int) -> dict[str, Any]:
    """One film, made and measured."""
    random = np.random.default_rng([seed, number])
    row: dict[str, Any] = {"case": number, **dict.fromkeys(("event", "truth", "half", "eta", "low", "high"), np.nan)}
    row |= {"generator": CHAIN if number % 2 else "dynamics", "message": "", "flags": "", "ruler": False}
    row |= {"motion": str(random.choice(MOTIONS)), "codec": CODECS[random.integers(len(CODECS))][0]}
    size = SIZES[random.integers(len(SIZES))]
    with tempfile.TemporaryDirectory() as folder:
        film = Path(folder) / "film.mp4"
        shot, message = attempted(lambda: (_chain if number % 2 else _scene)(number, seed, size, random))
        if shot is None:
            return row | {"outcome": NOT_MADE, "message": message}
        uneven = bool(random.random() < 0.5)
        _encode(film, shot, size, row["codec"], _moved(row["motion"], size, random), uneven, random)
        row["truth"] = shot.truth
        # Every other pair of films has a plate that was measured.
        ruler = None if number // 2 % 2 else shot.print * phone.WIDTH + float(random.normal(0.0, RULER_SD))
        row["ruler"] = ruler is not None
        found, message = attempted(
            lambda: measure.measure(film, length=shot.length, width=shot.width, plate_width=ruler)
        )
    if found is None:
        return row | {"outcome": REFUSED, "message": message}
    flags = "; ".join(map(str, found.flags))
    row |= {"event": found.event, "half": half_width(0.95) * found.sd, "flags": flags}
    if isinstance(found.eta_b, MotionEtaB):
        row |= {"eta": found.eta_b.eta_b / shot.eta_b, "low": found.eta_b.low / shot.eta_b}
        row |= {"high": found.eta_b.high / shot.eta_b}
    return row | {"outcome": MEASURED if found.snapped else BOUND}


def _pose(random: np.random.Generator) -> dict[str, Any]:
    """Distance, m, and angles of the camera, degrees."""
    return {
        "distance": FIELD * random.uniform(0.75, 1.3),
        "tilt": random.uniform(1.0, 10.0),
        "yaw": random.uniform(-5.0, 5.0),
        "roll": random.uniform(-4.0, 4.0),
    }


def _scene(number: int, seed: int, size: tuple[int, int], random: np.random.Generator) -> Shot:
    """A film of the package's generator."""
    eta_b, length = float(random.choice([2500.0, 3800.0, 6000.0])), 0.45
    unit = (eta_b * GRAVITY) ** (-1.0 / 3.0)
    width = float(random.uniform(0.015, 0.04))
    rate = float(random.choice(RATES))
    asked: dict[str, Any] = {
        "length": length,
        "eta_b": eta_b,
        "height": float(random.uniform(3.0, 3.7)) * unit,
        "speed": float(random.choice(SPEEDS)),
        "generator": "dynamics",
        "motion": {
            "friction_moment_star": float(random.choice([0.0, 0.01, 0.02])),
            "before": float(random.uniform(0.3, 0.7)) * unit,
            "after": 0.6,
            "model": "rod",
            "refinement": 1.0,
        },
        "strip": {"width": width, "hairs": float(random.choice([0.0, 300.0]))},
        "gripper": {
            "marker": int(random.choice(plate.GRIPPERS)),
            "offset": (float(random.uniform(-4e-3, 4e-3)), OFFSET[1]),
        },
        "filming": {
            **_pose(random),
            "size": size,
            "field": FIELD,
            "target": (0.15, 0.1),
            "plate": 0.5 * length + BESIDE,
            "plate_depth": float(random.normal(0.0, DEPTH_SD)),
            "plate_scale": float(random.normal(1.0, PRINT_SD)),
            "frame_rate": rate,
            "distortion": (float(random.normal(0.0, LENS)), 0.0, 0.0, 0.0),
            "light": float(random.choice([0.4, 0.6, 0.9])),
            "read_noise": float(random.choice([0.5, 1.5])),
            "shadow": float(random.choice([0.0, 0.3])),
            "gradient": float(random.choice([0.0, 0.3])),
            "flicker": float(random.choice([0.0, 0.04])),
            "rolling_shutter": float(random.choice([0.008, 0.02])),
            "defocus": float(random.uniform(0.4, 0.9)),
        },
        "seed": seed + number,
    }
    # Of the same sheet.
    asked["gripper"]["marker_size"] = plate.SIDE * asked["filming"]["plate_scale"]
    scene = Scene.of(asked)
    history = history_of(scene)
    advance = history.gripper[:, 0] - scene.flat_end
    pulled = _pulled(history.t, advance, history.touch, scene.speed)
    _, truth = onset_of(history.t[pulled], advance[pulled], history.curve[pulled], history.touch)
    end = float(history.t[-1]) - scene.filming.rolling_shutter - scene.filming.exposure
    sensor = Sensor(Renderer(scene, history.curve[0]), end, random)

    def at(t: float) -> Picture:
        return np.asarray(next(iter(sensor.film(history, np.array([t])))), np.uint8)

    return Shot(np.arange(0.0, end, 1.0 / rate), at, truth, length, width, eta_b, scene.filming.plate_scale)


def _pulled(t: Array, advance: Array, touch: float, speed: float) -> slice:
    """From where on the gripper moves at its speed up to the touch."""
    rate = np.gradient(advance, t)
    steady = np.abs(rate / speed - 1.0) < 0.5
    last = int(np.flatnonzero(~steady[: int(np.searchsorted(t, touch))])[-1])
    return slice(last + 1, None)


def _chain(number: int, seed: int, size: tuple[int, int], random: np.random.Generator) -> Shot:
    """A film of the second generator: a chain that snaps, and before it a strip that is only drawn."""
    f = second.Design(number, seed).factors | {"speed": float(random.choice(SPEEDS)), "rate": 25.0, "mirrored": False}
    unit = (f["eta_b"] * GRAVITY) ** (-1.0 / 3.0)
    motion, length = second.move(f), second.LENGTH * unit
    truth = second.truth(motion, f["height"] * unit)
    rate = float(random.choice(RATES))
    # Into the world of a wider picture, whose middle is the origin.
    middle = np.array([0.16 - 0.5 * length, 0.1])
    shift = np.array(second.TARGET) - middle
    nodes = motion.nodes + shift
    flat = np.column_stack([np.linspace(-length, 0.0, nodes.shape[1]), np.zeros(nodes.shape[1])]) - middle
    start, height = nodes[0], f["height"] * unit
    lead = 1.0 + LIFT + DRAW

    def state(t: float) -> Array:
        if t >= lead:
            i = int(np.clip(np.searchsorted(motion.t, t - lead), 1, len(motion.t) - 1))
            part = np.clip((t - lead - motion.t[i - 1]) / (motion.t[i] - motion.t[i - 1]), 0.0, 1.0)
            return np.asarray((1.0 - part) * nodes[i - 1] + part * nodes[i])
        lift, draw = np.clip([(t - 1.0) / LIFT, (t - 1.0 - LIFT) / DRAW], 0.0, 1.0)
        s = np.linspace(0.0, length, len(flat))
        raised = flat + np.column_stack(
            [np.zeros_like(s), lift * height * np.clip(1.0 - s / (2.5 * height), 0.0, 1.0) ** 2]
        )
        return np.asarray((1.0 - draw) * raised + draw * start)

    pose = _pose(random)
    camera = Camera(
        size, FIELD, pose["distance"], float(random.normal(0.0, LENS)), pose["tilt"], pose["yaw"], pose["roll"]
    )
    strip, desk, wall = (0.12, 0.6, 0.75) if f["dark"] else (0.8, 0.25, 0.18)
    names = ("sheen", "shadow", "width", "recede", "narrowing", "twist", "hairs")
    scale = float(random.normal(1.0, PRINT_SD))
    marker: dict[str, Any] = {
        "marker": int(random.choice(plate.GRIPPERS)),
        "marker_size": scale * plate.SIDE,
        "offset": OFFSET,
        "turned": float(random.normal(0.0, TURNED_SD)),
        "leans": float(random.normal(0.0, LEANS_SD)),
    }
    shape = {name: f[name] for name in names}
    look = Look(
        strip, desk, wall, (f["lamp"], -0.6, 0.75), thickness=1.2e-3, ground=-float(middle[1]), **shape, **marker
    )
    studio = Studio(camera, look, random)
    paper, paper_size = plate_print(plate.LONG)
    low = np.array([BESIDE - plate.MARGIN * plate.LONG.square, 0.0]) - middle
    depth = float(random.normal(0.0, DEPTH_SD))
    noise = random.standard_normal((size[1] + 64, size[0] + 64)).astype(np.float32)

    def at(t: float) -> Picture:
        curve = state(t)
        canvas = studio.frame(_refined(curve), curve[0])
        studio.print(canvas, low, scale * paper_size, paper, depth)
        x, y = random.integers(0, 64, 2)
        light = camera.seen(canvas, f["blur"])
        return exposed(light, f["gain"], f["gamma"], noise[y : y + size[1], x : x + size[0]], f["read"], 1.0)

    end = lead + float(motion.t[-1]) - 0.05
    advance = abs(motion.end[:, 0] - (-length - second.TARGET[0]))
    event = float(np.interp(truth["onset"], motion.t, advance))
    return Shot(np.arange(0.0, end, 1.0 / rate), at, event, length, f["width"], f["eta_b"], scale)


def plate_print(board: Board) -> tuple[Picture, Array]:
    """OpenCV's own print of a plate as it is cut out, grey values, and its width and height, m."""
    foot, margin = round(SQUARE * plate.FOOT), round(SQUARE * plate.MARGIN)
    pixels = (board.columns * SQUARE, board.rows * SQUARE)
    squares = board.charuco.generateImage(pixels, marginSize=0, borderBits=1)
    paper = np.pad(squares, ((margin, foot), (margin, margin)), constant_values=255)
    return paper, board.square / SQUARE * np.array(paper.shape[::-1])


def _refined(curve: Array) -> Array:
    """Points between the nodes, so that a wide picture shows no corners."""
    s = np.arange(len(curve), dtype=float)
    fine = np.linspace(0.0, s[-1], 3 * len(curve))
    return np.column_stack([np.interp(fine, s, curve[:, i]) for i in range(2)])


def _moved(motion: str, size: tuple[int, int], random: np.random.Generator) -> Callable[[float], Array]:
    """The similarity, shape (2, 3), of a phone that moves, by the share of the film."""
    angle, sag = random.uniform(0.0, 2.0 * np.pi), random.uniform(2.0, 12.0) * (motion == "sag")
    zoom = random.uniform(0.003, 0.012) * (motion == "zoom")

    def matrix(share: float) -> Array:
        grown = 1.0 + zoom * share
        x, y = sag * share * np.array([np.cos(angle), np.sin(angle)]) - 0.5 * zoom * share * np.array(size)
        return np.array([[grown, 0.0, x], [0.0, grown, y]])

    return matrix


def _encode(
    path: Path,
    shot: Shot,
    size: tuple[int, int],
    codec: str,
    moved: Callable[[float], Array],
    uneven: bool,
    random: np.random.Generator,
) -> None:
    """Write the film, as a phone that is not quite still codes it: its sensor lies in any way."""
    t, turns = shot.t.copy(), int(random.spawn(1)[0].integers(4))
    if uneven:
        t[1:] += SLACK * np.diff(t) * random.uniform(-1.0, 1.0, len(t) - 1)
    pixels = dict(CODECS)[codec]
    options = {
        "libx264": {"crf": "20", "preset": "veryfast"},
        "libx265": {"crf": "20", "preset": "ultrafast", "x265-params": "log-level=none"},
    }
    with av.open(path, "w") as container:
        quality = options.get(codec, {"qmin": "3", "qmax": "3"})
        stream: Any = container.add_stream(codec, rate=30, options=quality)
        stream.width, stream.height = size[::-1] if turns % 2 else size
        stream.set_display_rotation(90 * turns)
        stream.pix_fmt = pixels
        stream.time_base = stream.codec_context.time_base = TICK
        for picture, stamp, share in zip(_pictures(shot, t), t, np.linspace(0.0, 1.0, len(t)), strict=True):
            seen = cv2.warpAffine(picture, moved(share), size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
            seen = np.ascontiguousarray(np.rot90(seen, -turns))
            frame = av.VideoFrame.from_ndarray(seen, format="gray").reformat(format=pixels)
            frame.pts, frame.time_base = round(stamp / TICK), TICK
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def _pictures(shot: Shot, t: Array) -> Iterator[Picture]:
    for moment in t:
        yield shot.at(float(moment))


def facts(d: xr.Dataset) -> Facts:
    """In mm."""
    known = d.outcome.values == MEASURED
    off, half = 1e3 * (d.event - d.truth).values[known], 1e3 * d.half.values[known]
    wrong = (np.abs(off) > 1.0) & (np.abs(off) > WRONG * half)
    flags = d.flags.values[known]
    inside = np.abs(off) <= half
    chain, ruled = d.generator.values[known] == CHAIN, d.ruler.values[known].astype(bool)
    eta = d.isel(case=np.flatnonzero(np.isfinite(d.eta.values)))
    some = off if off.size else np.array([np.nan])
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "measured": known.sum(),
        "share": share(inside),
        "chain_share": share(inside[chain]),
        "rms": np.sqrt(np.mean(some**2)),
        "worst": np.abs(some).max(),
        "half": np.median(half[~ruled]) if (~ruled).any() else np.nan,
        "half_ruled": np.median(half[ruled]) if ruled.any() else np.nan,
        "refused": share(~np.isin(d.outcome.values, (MEASURED, BOUND))),
        "wrong": int(np.sum(wrong & ~np.array(["warning" in text for text in flags], dtype=bool))),
        "moved": sum(MOVED_BY in text for text in flags),
        "etas": eta.sizes["case"],
        "eta_share": share(((eta.low <= 1.0) & (eta.high >= 1.0)).values),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("phone_coverage", "share", "1", ">= 0.93",
            "share of the 95 % intervals of lambda that hold the truth, of {measured} of {cases} phone-like films with "
            "the plate ({seed}), half of them of the second generator ({chain_share:.2f} of these): three sizes, "
            "H.264, HEVC of 10 bits or MPEG-4, even and uneven rates, tilts up to 10 degrees, phones that sag or zoom, "
            "plates 8 mm off the marker's plane, markers that face aside by 3 and lean by 2 degrees (standard "
            "deviations)"),
        Number("phone_error", "rms", "mm", "-",
            "root mean square error of lambda in these films, at most {worst:.2f} mm; the intervals are +- "
            "{half_ruled:.1f} mm in the median where a ruler says how wide the plate is, else {half:.1f} mm"),
        Number("phone_refused", "refused", "1", "<= 0.05", "share of these films that are refused"),
        Number("phone_wrong", "wrong", "1", "= 0",
            "of these films those off by more than 1 mm and by more than twice the interval's half width (beyond once "
            "is one in twenty), without a warning"),
        Number("phone_eta_coverage", "eta_share", "1", ">= 0.9",
            "share of the 95 % intervals of eta_b by the motion that hold the truth, in {etas} of these films"),
    ),
}
# fmt: on
