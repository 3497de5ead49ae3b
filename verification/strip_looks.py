"""Strips of many looks in synthetic recordings, measured: width, tone or colour, stripes, table, and direction.

Each table and direction goes with each width, tone and pattern equally often.
"""

from __future__ import annotations

import tempfile
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold.film import recording
from stripfold.synthetic import recording as synthetic
from stripfold.synthetic.scene import Scene
from verification.common import Progress, attempted, pooled, table
from verification.numbers import Facts, Number, seed_of
from verification.recordings_common import event_of, measure_with

UNITS = {"m": "event high low stripe truth width"}

WIDTHS = (0.01, 0.04, 0.08)
"""m."""
TONES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "light": ({"grey": 0.85, "edge": 0.95}, {"background": 0.22, "table": 0.32}),
    "dark": ({"grey": 0.1, "edge": 0.14}, {"background": 0.75, "table": 0.65}),
    "orange": ({"colour": (0.62, 0.36, 0.12)}, {"background": 0.3, "table": 0.38}),
    "blue": ({"colour": (0.2, 0.35, 0.75)}, {"background": 0.36, "table": 0.36}),
}
"""Strips and what is behind them; the luma of the colours is that of the table."""
STRIPES = (0.0, 0.02)
"""Lengths of the stripes, m; 0: plain."""
GRAINS = (0.05, 0.1)
"""Of the table: plain and textured; with 0.15 a strip 10 mm wide, three pixels here, is lost in some films."""
DIRECTIONS: tuple[tuple[bool, int], ...] = ((False, 1), (True, 1), (False, -1), (True, -1))
"""Whether the camera is behind the plane, so that the strip moves to the left, and the sign of the robot's x."""
CAMERA: dict[str, Any] = {
    "size": [480, 360],
    "frame_rate": 20.0,
    "codec": "mjpeg",
    "quality": 3,
    "target": [0.055, 0.085],
}
"""The clamp, which is as dark as the dark strips, is out of view."""
LOOKS = list(product(WIDTHS, TONES, STRIPES))


def run(cases: int = 6, seed: int = 1, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Render and measure the first ``cases`` looks; a dataset over ``case``."""
    with tempfile.TemporaryDirectory() as folder:
        for turned in DIRECTIONS:
            scene = Scene.of({**_turned(turned), "seed": seed})
            attempted(partial(synthetic.write_calibration, scene, _calibration(Path(folder), turned)))
        one = partial(measured, seed=seed, calibrations=Path(folder))
        rows = pooled(one, range(min(cases, len(LOOKS))), threads, progress)
    return table("case", rows, {"seed": seed}, units=UNITS)


def measured(number: int, seed: int, calibrations: Path) -> dict[str, Any]:
    """The look of this number, rendered and measured."""
    width, tone, stripe = LOOKS[number]
    # Over eight looks, a width, each table and direction occurs with each pattern.
    block, place = divmod(number, len(TONES) * len(STRIPES))
    grain = GRAINS[(place // 2 + place + block) % 2]
    turned = DIRECTIONS[(place // 2 + 2 * (place % 2) + block) % 4]
    look = {"width": width, "tone": tone, "stripe": stripe, "grain": grain, "behind": turned[0], "direction": turned[1]}
    row = {"case": number, **look, "message": "", "flags": ""}
    row |= dict.fromkeys(("truth", "event", "low", "high"), np.nan)
    (strip, filming), camera = TONES[tone], _turned(turned)
    asked = {
        "strip": {**strip, "width": width, "stripe": stripe, "stripe_shade": 0.7},
        "speed": 0.006,
        "gripper": camera["gripper"],
        "filming": {**filming, **camera["filming"], "grain": grain},
        "motion": {"before": 0.009, "after": 0.6},
        "seed": seed,
    }
    kept = _calibration(calibrations, turned)
    scene = Scene.of(asked)
    motion = synthetic.history_of(scene)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recording"
        _, message = attempted(lambda: synthetic.write_recording(motion, scene, folder, kept))
        if message:
            return row | {"message": message}
        row["truth"] = event_of(folder)[1]
        found, message = attempted(lambda: measure_with(recording.read(folder), (calibrations, kept.name)))
    if found is None or not found.snapped:
        return row | {"message": message or "no snap was seen"}
    low, high = found.interval
    return row | {"event": found.event, "low": low, "high": high, "flags": "; ".join(map(str, found.flags))}


def _turned(turned: tuple[bool, int]) -> dict[str, Any]:
    return {"gripper": {"direction": turned[1]}, "filming": {**CAMERA, "behind": turned[0]}}


def _calibration(calibrations: Path, turned: tuple[bool, int]) -> Path:
    return calibrations / f"camera-{DIRECTIONS.index(turned)}"


def facts(d: xr.Dataset) -> Facts:
    """In mm."""
    off = 1e3 * np.abs(d.event - d.truth).values
    measured = np.isfinite(off)
    inside = (d.low <= d.truth) & (d.truth <= d.high)
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "measured": measured.sum(),
        "outside": np.sum(measured & ~inside.values),
        "worst": off[measured].max(initial=0.0),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("strip_looks", "measured", "count", "all {cases}",
            "strips measured, of {cases} looks ({seed}): 10, 40 and 80 mm wide, light, dark and two colours as bright "
            "as the table, plain and striped, on plain and textured tables, in either direction; {outside} outside of "
            "their 95 % intervals, at most {worst:.2f} mm off",
            lambda f: f.measured == f.cases),
    ),
}
# fmt: on
