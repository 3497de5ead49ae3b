"""A measurement as a dataset, and as plain values for the command line."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from stripfold.schema import Values, Variable, dataset, variables
from stripfold.vision.measure import Measurement


def fields(found: Measurement) -> dict[str, Any]:
    """The result; lengths in m, times in s."""
    return {
        "snap": found.snapped,
        **_numbers(found),
        "speed": found.speed,
        "flags": list(found.flags),
        "manual_onset": found.manual,
        "synthetic": bool(found.recording.entries.synthetic),
    }


def _numbers(found: Measurement) -> dict[str, float]:
    low, high = found.interval
    return {
        "lambda_event": found.event,
        "lambda_low": low,
        "lambda_high": high,
        "event_time": found.event_time,
        "lambda_video": found.by_video,
        "lambda_log": found.by_log,
        "lambda_static": found.static.lam if found.static else float("nan"),
        "lambda_static_sd": found.static.sd if found.static else float("nan"),
    }


def as_dataset(found: Measurement) -> xr.Dataset:
    """The whole measurement, SI.

    Returns
    -------
    Dataset over ``t`` (frames), ``moment`` (of the speed), ``station`` (along the strip); scalars for the result.
    """
    tracks, motion, entries = found.tracks, found.motion, found.recording.entries
    scalars = {
        **_numbers(found),
        "lambda_sd": found.sd,
        **{f"sd_{name}": sd for name, sd in found.parts.items()},
        "snapped": int(found.snapped),
        "gripper_speed": found.speed,
        "speed_ratio": motion.ratio,
        "following": motion.following,
        "clock_offset": found.clock.offset if found.clock else np.nan,
        "height": entries.gripper.height,
        "eta_b": entries.strip.eta_b,
        "length": entries.strip.length,
    }
    values: Values = {name: ((), value) for name, value in scalars.items()} | {
        "t": ("t", tracks.timing.time),
        "x": ("t", tracks.gripped_end[:, 0]),
        "z": ("t", tracks.gripped_end[:, 1]),
        "gripper_seen": ("t", tracks.gripper.tracked.astype(np.int8)),
        "gripper_score": ("t", tracks.gripper.score),
        "strip_score": ("t", tracks.score),
        "moment": ("moment", motion.t),
        "speed": ("moment", motion.u),
        "station": ("station", tracks.stations),
        "axis": ("axis", ["x", "z"]),
        "strip": (("t", "station", "axis"), tracks.points.astype(np.float32)),
    }
    attrs = {
        "recording": entries.title,
        "synthetic": int(entries.synthetic),
        "flags": "; ".join(found.flags),
        "manual_onset": found.manual,
        **{f"calibration_{name}": value for name, value in found.calibration.quality.items()},
    }
    gripped_end = {axis: Variable("m", f"{axis} of the gripped end by the video") for axis in ("x", "z")}
    return dataset(values, attrs, table=variables() | gripped_end)
