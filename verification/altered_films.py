"""Films of many looks, of a camera that is moved, and of a gripper without a marker: whether they are measured.

Looks: width, tone or colour, stripes, table, and direction; each table and direction goes with each width, tone and
pattern equally often.  Moved: the frames are shifted from some moment on, or all of them, as if the camera had been
moved between its calibration and the film, and there is no robot's log; it must be noticed.  Template: no marker and no
robot's log; a box in the first frame, about where the marker's card is, gives a part of the gripper to follow.
Half of the latter two are of the second generator (:mod:`verification.films.second`).
"""

from __future__ import annotations

import csv
import tempfile
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import xarray as xr
import yaml

from stripfold.film import camera_motion, recording, video
from stripfold.film.calibration import calibrate_folder
from stripfold.film.holder import Marker
from stripfold.film.measure import measure
from stripfold.film.recording import NAME
from stripfold.synthetic.scene import Scene
from verification.common import Progress, attempted, pooled, table
from verification.films import Film, film, truth_of
from verification.numbers import Facts, Number, seed_of, share

UNITS = {"m": "event high low truth"}

LOOK, MOVED, TEMPLATE = "look", "moved", "template"
TONES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "light": ({"grey": 0.85, "edge": 0.95}, {"background": 0.22, "table": 0.32}),
    "dark": ({"grey": 0.1, "edge": 0.14}, {"background": 0.75, "table": 0.65}),
    "orange": ({"colour": (0.62, 0.36, 0.12)}, {"background": 0.3, "table": 0.38}),
    "blue": ({"colour": (0.2, 0.35, 0.75)}, {"background": 0.36, "table": 0.36}),
}
"""Strips and what is behind them; the luma of the colours is that of the table."""
LOOKS = list(product((0.01, 0.04, 0.08), TONES, (0.0, 0.02)))
"""Widths, m, tones, and lengths of the stripes, m; 0: plain."""
GRAINS = (0.05, 0.1)
"""Of the table: plain and textured; with 0.15 a strip 10 mm wide, three pixels here, is lost in some films."""
DIRECTIONS = ((False, 1), (True, 1), (False, -1), (True, -1))
"""Whether the camera is behind the plane, so that the strip moves to the left, and the sign of the robot's x."""
CAMERA = {"size": [480, 360], "frame_rate": 20.0, "codec": "mjpeg", "quality": 3, "target": [0.055, 0.085]}
"""The clamp, which is as dark as the dark strips, is out of view."""
SHIFTS = 3.0, 10.0
"""Least and largest shift, pixels."""
LABEL = 0.05, 0.25
"""Height and width of the corner that a recorder writes on, as shares of the picture's: it does not move."""
BOX = 0.55, 0.75
"""Half sides of the box, relative to the marker's side: within its white rim, and beyond it."""
OFF = 0.1
"""By how much the box's middle misses the marker's, relative to its side."""


def run(
    looks: int = 2,
    moved: int = 2,
    templates: int = 1,
    seed: int = 1,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Render, alter and measure so many films of each kind; a dataset over ``case``."""
    counts = {LOOK: min(looks, len(LOOKS)), MOVED: moved, TEMPLATE: templates}
    cases = [(kind, number) for kind, count in counts.items() for number in range(count)]
    return table("case", pooled(partial(measured, seed=seed), cases, threads, progress), {"seed": seed}, UNITS)


def measured(case: tuple[str, int], seed: int) -> dict[str, Any]:
    """The film of a kind and number; nan where it has no value, and a message."""
    kind, number = case
    rng = np.random.default_rng([seed, number, (LOOK, MOVED, TEMPLATE).index(kind)])
    before = kind == MOVED and number % 2 == 0
    chain = kind != LOOK and (number // 2 if kind == MOVED else number) % 2 == 1
    row = {"kind": kind, "number": number, "chain": float(chain), "before": float(before), "message": ""}
    row |= dict.fromkeys(("truth", "event", "low", "high"), np.nan)
    asked = look(number, seed) if kind == LOOK else film(number, seed, chain=chain)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recording"
        _, message = attempted(lambda: asked.write(folder, Path(temporary)))
        if message:
            return row | {"message": message}
        row["truth"] = truth_of(folder)[1]
        if kind == MOVED:
            move(folder, 0.0 if before else rng.uniform(0.02, 0.98), rng)
        elif kind == TEMPLATE:
            describe(folder, rng)
        found, message = attempted(lambda: measure(folder))
    if found is None or not found.snapped:
        return row | {"message": message or "no snap was seen"}
    low, high = found.interval
    return row | {"event": found.event, "low": low, "high": high, "message": "; ".join(map(str, found.flags))}


def look(number: int, seed: int) -> Film:
    """The look of this number."""
    width, tone, stripe = LOOKS[number]
    # Over eight looks, a width, each table and direction occurs with each pattern.
    block, place = divmod(number, 8)
    grain = GRAINS[(place // 2 + place + block) % 2]
    behind, direction = DIRECTIONS[(place // 2 + 2 * (place % 2) + block) % 4]
    strip, filming = TONES[tone]
    turned = {"gripper": {"direction": direction}, "filming": {**CAMERA, "behind": behind}, "seed": seed}
    scene = {
        **turned,
        "strip": {**strip, "width": width, "stripe": stripe, "stripe_shade": 0.7},
        "speed": 0.006,
        "filming": {**filming, **CAMERA, "behind": behind, "grain": grain},
        "motion": {"before": 0.009, "after": 0.6},
    }
    asked = Scene.of(scene)
    return Film(asked, asked.eta_b, "camera", seed, Scene.of(turned))


def move(folder: Path, share_before: float, rng: np.random.Generator) -> None:
    """Replace a film by its frames, shifted after a share of its duration, and forget the robot's log."""
    size, angle = rng.uniform(*SHIFTS), rng.uniform(0.0, 2.0 * np.pi)
    matrix = np.array([[1.0, 0.0, size * np.cos(angle)], [0.0, 1.0, size * np.sin(angle)]])
    asked = recording.read(folder)
    with video.read(asked.video, asked.timestamps) as opened:
        frames = [(frame.time, frame.image.copy()) for frame in opened]
    (folder / "shifted").mkdir()
    first = frames[0][0] + share_before * (frames[-1][0] - frames[0][0])
    for i, (time, image) in enumerate(frames):
        seen = image
        if time >= first:
            shape = image.shape[::-1]
            seen = cv2.warpAffine(image, matrix, shape, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
            high, wide = (-int(part * side) for part, side in zip(LABEL, image.shape, strict=True))
            seen[high:, wide:] = image[high:, wide:]
        cv2.imwrite(str(folder / "shifted" / f"{i:05d}.png"), seen)
    lines = [f"{i},{time:.6f}\n" for i, (time, _) in enumerate(frames)]
    (folder / "shifted.csv").write_text("frame,t\n" + "".join(lines), encoding="utf-8")
    told = yaml.safe_load((folder / NAME).read_text(encoding="utf-8"))
    del told["robot_log"]
    told |= {"video": "shifted", "timestamps": "shifted.csv"}
    (folder / NAME).write_text(yaml.safe_dump(told, sort_keys=False), encoding="utf-8")


def describe(folder: Path, rng: np.random.Generator) -> None:
    """Describe a template in place of the marker: a box around it, not quite in its middle."""
    asked = recording.read(folder)
    marker = asked.entries.gripper.marker
    assert marker is not None
    mapping = calibrate_folder(folder, asked.entries).mapping
    with video.read(asked.video, asked.timestamps) as opened:
        seen = (Marker(marker.dictionary, marker.id).corners(frame.image) for frame in opened)
        # It may not be told in the very first frame; the gripper stands at first.
        corners = next(found for found in seen if found is not None)
    side = float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).mean())
    half = np.rint(rng.uniform(*BOX, 2) * side)
    low = np.rint(corners.mean(axis=0) + rng.uniform(-OFF, OFF, 2) * side - half).astype(int)
    size = (2 * half).astype(int)
    at, middle = mapping.to_robot(np.array([corners.mean(axis=0), low + 0.5 * (size - 1.0)]))
    told = yaml.safe_load((folder / NAME).read_text(encoding="utf-8"))
    del told["gripper"]["marker"], told["robot_log"]
    offset = (np.array(marker.offset) - (middle - at)).tolist()
    told["gripper"]["template"] = {"box": [*low.tolist(), *size.tolist()], "offset": offset, "offset_uncertainty": 0.0}
    (folder / NAME).write_text(yaml.safe_dump(told, sort_keys=False), encoding="utf-8")
    # At the robot's stops, too, it is the box that is followed.
    grid = folder / told["robot"]["grid"]
    header, *rows = csv.reader(grid.read_text(encoding="utf-8").splitlines())
    x, z = middle - at
    stops = [f"{name},{float(stop_x) + x:.6f},{float(stop_z) + z:.6f}" for name, stop_x, stop_z in rows]
    grid.write_text("\n".join([",".join(header), *stops]) + "\n", encoding="utf-8")


def facts(d: xr.Dataset) -> Facts:
    """In mm."""
    looks, moved, templates = (d.isel(case=np.flatnonzero(d.kind.values == kind)) for kind in (LOOK, MOVED, TEMPLATE))
    noticed = np.array([camera_motion.MOVED_BY in str(text) for text in moved.message.values])
    found: Facts = {"seed": seed_of(d), "noticed": share(noticed), "moved": noticed.size}
    found |= {"before": moved.before.sum(), "chain": moved.chain.sum()}
    for name, one in (("look", looks), ("template", templates)):
        off, inside = 1e3 * (one.event - one.truth).values, ((one.low <= one.truth) & (one.truth <= one.high)).values
        known = np.isfinite(off)
        found |= {
            f"{name}s": off.size,
            f"{name}_measured": known.sum(),
            f"{name}_share": share(known),
            f"{name}_inside": share(inside[known]),
            f"{name}_outside": np.sum(known & ~inside),
            f"{name}_worst": np.abs(off[known]).max(initial=0.0),
            f"{name}_rms": np.sqrt(np.mean(off[known] ** 2)) if known.any() else np.nan,
            f"{name}_half": np.median(5e2 * (one.high - one.low).values[known]) if known.any() else np.nan,
        }
    return found


# fmt: off
NUMBERS = {
    facts: (
        Number("strip_looks", "look_share", "1", "= 1",
            "share measured of strips of {looks} looks ({seed}): 10, 40 and 80 mm wide, light, dark and two colours as "
            "bright as the table, plain and striped, on plain and textured tables, in either direction; {look_outside} "
            "outside of their 95 % intervals, at most {look_worst:.2f} mm off"),
        Number("camera_bump", "noticed", "1", "= 1",
            "share of {moved} moves of the camera by 3 to 10 pixels ({seed}) that are noticed, {before:.0f} between "
            "its calibration and the film, the others in the film; {chain:.0f} of the second generator"),
        Number("markerless_coverage", "template_inside", "1", ">= 0.85",
            "share of the 95 % intervals of lambda that contain the truth, {template_measured} measured of {templates} "
            "recordings without a marker and without a robot's log, by a template ({seed}); root mean square error "
            "{template_rms:.2f} mm, median half width {template_half:.2f} mm", spread=0.3),
    ),
}
# fmt: on
