"""The accuracy of measured values of lambda, from many small synthetic recordings, each with its truth.

The recordings are rendered, encoded and measured like any other; the truth is the same definition of the event
(:mod:`stripfold.vision.snap`) applied to the motion itself, dense in time and without a camera.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold.arrays import Array
from stripfold.errors import StripfoldError
from stripfold.store import variable
from stripfold.vision import measure, recording, snap
from stripfold.vision.measure import Measurement
from studies.recordings_design import Case, case

MEASURED, BOUND, REFUSED = "measured", "bound", "refused"
"""Outcomes: a value; a bound, since no snap was seen; an error."""


_COLUMNS = {
    "event": ("m", "lambda measured at the event; the largest if no snap was seen"),
    "truth": ("m", "lambda at the event of the motion itself; its static lambda_c if no snap was seen"),
    "static": ("m", "end of the quasi-static branch, measured"),
    "static_sd": ("m", "its standard deviation by the fit"),
    "static_truth": ("m", "static lambda_c of the motion"),
    "sd": ("m", "standard deviation of lambda by the measurement"),
    "ratio": ("1", "speed of the snap over that before it"),
    "speed": ("m s-1", "speed of the gripper"),
    "seconds_off": ("s", "error of the event's time by the video's clock"),
    "tracked": ("1", "share of the frames in which the strip was found"),
}


def run(
    numbers: range, seed: int, dynamics: float, calibrations: Path, progress: Callable[[str], None] | None = None
) -> xr.Dataset:
    """Render and measure the cases with these numbers, see :func:`.recordings_design.case`; a dataset over ``case``.

    ``calibrations`` is a folder for the calibrations that cases share.
    """
    rows = []
    for number in numbers:
        rows.append(_measured(case(number, seed, dynamics), calibrations))
        if progress:
            progress(f"{number}: {rows[-1]['outcome']} {rows[-1]['message']}")
    data = {"case": variable("case", numbers, "1", "number of the case")}
    for name, value in rows[0].items():
        units, text = _COLUMNS.get(name, ("1", name.replace("_", " ")))
        values = np.array([row[name] for row in rows], dtype=object if isinstance(value, str) else np.float64)
        data[name] = variable("case", values, units, text)
    return xr.Dataset(data)


def _measured(case: Case, calibrations: Path) -> dict[str, Any]:
    """The row of a case."""
    row: dict[str, Any] = dict.fromkeys(_COLUMNS, np.nan) | {"message": "", "flags": ""} | dict(case.factors)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recording"
        case.write(folder, calibrations)
        try:
            found = measure.measure(recording.read(folder))
        except StripfoldError as error:
            return row | {"outcome": REFUSED, "message": f"{type(error).__name__}: {error}"}
        onset, event, static = _truth(folder, found)
    if found.static:
        row |= {"static": found.static.lam, "static_sd": found.static.sd}
    return row | {
        "outcome": MEASURED if found.snapped else BOUND,
        "event": found.event,
        "truth": event if found.snapped else static,
        "static_truth": static,
        "sd": found.sd,
        "ratio": found.motion.ratio,
        "speed": found.speed,
        "seconds_off": found.event_time - onset,
        "flags": "; ".join(found.flags),
        "tracked": float(np.mean(found.tracks.score > 0.0)),
    }


def _truth(folder: Path, found: Measurement) -> tuple[float, float, float]:
    """Onset, s, lambda at the onset, m, and static lambda_c, m, of the motion itself; nan where there is no snap."""
    with xr.open_dataset(folder / "truth.nc") as opened:
        truth = opened.load()
    t, lam, curve = truth["time"].values, truth["lambda"].values, truth["curve"].values.astype(np.float64)
    start, stop = snap.steady_advance(t, truth["gripper"].values[:, 0])
    within = (t >= start) & (t <= stop)
    t, lam, curve = t[within], lam[within], curve[within]
    raised = snap.raised(curve, float(found.recording.entries["gripper"]["height"]))
    motion = snap.speed(t, curve[:, raised])
    static = json.loads((folder / "truth.json").read_text(encoding="utf-8"))["lambda_c"]
    return motion.onset, float(np.interp(motion.onset, t, lam)), float("nan") if static is None else float(static)


def error(data: xr.Dataset) -> Array:
    """Measured minus true lambda of the measured cases, m, shape (n,)."""
    chosen = data["outcome"].values == MEASURED
    return np.asarray((data["event"] - data["truth"]).values[chosen], dtype=np.float64)
