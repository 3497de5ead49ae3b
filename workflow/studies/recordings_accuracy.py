"""What measured values of lambda are worth: many small synthetic recordings over a design, each with its truth.

The recordings are rendered, encoded and measured like any other; the truth is the same definition of the event
(:mod:`stripfold.vision.snap`) on the motion itself, dense in time and without a camera.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold.errors import StripfoldError
from stripfold.vision import measure, recording, snap
from stripfold.vision.measure import Measurement
from studies import recordings_design as design

MEASURED, BOUND, REFUSED = "measured", "bound", "refused"
"""A number; none, as there was no snap: a bound; an error."""
FRICTIONS = (0.0, 0.01, 0.02)
"""M_0 of the motions from dynamics, rho_a g L*^2."""
BEFORE, AFTER = 0.01, 0.5
"""How far before the loss of stability they begin, m, and how long they go on after the touch, s."""


def run(
    numbers: range, seed: int, dynamics: float, calibrations: Path, progress: Callable[[str], None] | None = None
) -> xr.Dataset:
    """Render and measure the cases with these numbers.

    Parameters
    ----------
    numbers, seed
        Of the design.
    dynamics
        Share of the cases whose motion is from the project's own dynamics; the rest has one that knows no mechanics.
    calibrations
        Folder in which calibrations that cases share are kept.

    Returns
    -------
    Dataset over ``case``.
    """
    rows = []
    for number in numbers:
        rows.append(_one(case(number, seed, dynamics), calibrations))
        if progress:
            progress(f"{number}: {rows[-1]['outcome']} {rows[-1]['message']}")
    return dataset(rows, numbers)


def case(number: int, seed: int, dynamics: float) -> design.Case:
    """A case of the design, its motion from the project's own dynamics where it is the turn of that."""
    if (number * dynamics) % 1.0 + dynamics < 1.0:
        return design.case(number, seed)
    motion = {"friction": FRICTIONS[number % len(FRICTIONS)], "before": BEFORE, "after": AFTER}
    return design.case(number, seed, "dynamics", motion)


def _one(case: design.Case, calibrations: Path) -> dict[str, Any]:
    nan = float("nan")
    numbers = ("event", "truth", "static", "static_sd", "static_truth", "sd", "ratio", "speed", "seconds_off")
    row: dict[str, Any] = {name: nan for name in numbers} | {"message": "", "flags": "", "tracked": nan}
    row |= case.factors
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recording"
        case.write(folder, calibrations)
        try:
            found = measure.measure(recording.read(folder))
        except StripfoldError as error:
            return {**row, "outcome": REFUSED, "message": f"{type(error).__name__}: {error}"}
        onset, event, static = _truth(folder, found)
    static_found = found.static
    return {
        **row,
        "outcome": MEASURED if found.snapped else BOUND,
        "event": found.event,
        "truth": event if found.snapped else static,
        "static": static_found.lam if static_found else nan,
        "static_sd": static_found.sd if static_found else nan,
        "static_truth": static,
        "sd": found.sd,
        "ratio": found.motion.ratio,
        "speed": found.speed,
        "seconds_off": found.event_time - onset,
        "flags": "; ".join(found.flags),
        "tracked": float(np.mean(found.tracks.score > 0.0)),
    }


def _truth(folder: Path, found: Measurement) -> tuple[float, float, float]:
    """Onset, s, lambda there, m, and the static lambda_c, m, of the motion itself; nan where there is none."""
    with xr.open_dataset(folder / "truth.nc") as opened:
        truth = opened.load()
    t, lam, curve = truth["time"].values, truth["lambda"].values, truth["curve"].values.astype(np.float64)
    arc = np.linspace(0.0, float(found.recording.entries["strip"]["length"]), curve.shape[1])
    start, stop = snap.underway(t, truth["gripper"].values[:, 0])
    within = (t >= start) & (t <= stop)
    t, lam, curve = t[within], lam[within], curve[within]
    raised = snap.raised(curve, arc, float(found.recording.entries["gripper"]["height"]))
    motion = snap.speed(t, curve[:, raised])
    static = json.loads((folder / "truth.json").read_text(encoding="utf-8"))["lambda_c"]
    return motion.onset, float(np.interp(motion.onset, t, lam)), float("nan") if static is None else float(static)


_UNITS = {
    "event": ("m", "lambda measured at the event; where there was no snap the farthest"),
    "truth": ("m", "lambda at the event of the motion itself; where there was no snap its static lambda_c"),
    "static": ("m", "end of the quasi-static branch, measured"),
    "static_sd": ("m", "its standard deviation by the fit"),
    "static_truth": ("m", "static lambda_c of the motion"),
    "sd": ("m", "standard deviation that the measurement claims"),
    "ratio": ("1", "speed of the snap over that of following"),
    "speed": ("m s-1", "speed of the gripper"),
    "seconds_off": ("s", "error of the event's time by the video's clock"),
    "tracked": ("1", "share of the frames in which the strip was found"),
}


def dataset(rows: list[dict[str, Any]], numbers: range) -> xr.Dataset:
    """The rows over ``case``."""
    data = {}
    for name in rows[0]:
        values = [row[name] for row in rows]
        text = isinstance(values[0], str)
        unit, words = _UNITS.get(name, ("1", name.replace("_", " ")))
        array = np.array(values, dtype=object if text else np.float64)
        data[name] = ("case", array, {"units": unit, "long_name": words})
    coords = {"case": ("case", np.array(numbers), {"units": "1", "long_name": "number of the case"})}
    return xr.Dataset(data, coords=coords)


def error(data: xr.Dataset) -> np.ndarray:
    """Measured minus true lambda of the measured cases, m, shape (n,)."""
    chosen = data["outcome"].values == MEASURED
    return np.asarray((data["event"] - data["truth"]).values[chosen], dtype=np.float64)
