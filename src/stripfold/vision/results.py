"""A measurement as a dataset, and as plain values for the command line."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from stripfold.store import variable
from stripfold.vision.measure import PARTS, Measurement


def fields(found: Measurement) -> dict[str, Any]:
    """The result; lengths in m, times in s."""
    low, high = found.interval
    return {
        "snap": found.snapped,
        "lambda_event": found.event,
        "lambda_low": low,
        "lambda_high": high,
        "event_time": found.event_time,
        "lambda_video": found.by_video,
        "lambda_log": found.by_log,
        "lambda_static": found.static.lam if found.static else float("nan"),
        "lambda_static_sd": found.static.sd if found.static else float("nan"),
        "speed": found.speed,
        "flags": list(found.flags),
        "manual_onset": found.manual,
        "synthetic": bool(found.recording.entries["synthetic"]),
    }


_FIELDS = {
    "lambda_event": ("m", "lambda at the onset of the snap; without a snap the farthest lambda"),
    "lambda_low": ("m", "lower end of its 95 % interval"),
    "lambda_high": ("m", "upper end of its 95 % interval"),
    "event_time": ("s", "onset of the snap by the video's clock"),
    "lambda_video": ("m", "lambda at the event from the video alone"),
    "lambda_log": ("m", "lambda at the event from the robot's log"),
    "lambda_static": ("m", "end of the quasi-static branch by a square root"),
    "lambda_static_sd": ("m", "its standard deviation by the fit alone"),
}


def as_dataset(found: Measurement) -> xr.Dataset:
    """The whole measurement, SI.

    Returns
    -------
    Dataset over ``t`` (frames), ``moment`` (of the speed), ``station`` (along the strip); scalars for the result.
    """
    tracks, motion, entries = found.tracks, found.motion, found.recording.entries
    values = fields(found)
    scalars: dict[str, tuple[float, str, str]] = {
        **{name: (values[name], *texts) for name, texts in _FIELDS.items()},
        "lambda_sd": (found.sd, "m", "standard deviation of lambda at the event"),
        **{f"sd_{name}": (sd, "m", f"contribution to it: {PARTS[name]}") for name, sd in found.parts.items()},
        "snapped": (int(found.snapped), "1", "whether there was a snap"),
        "gripper_speed": (found.speed, "m s-1", "speed of the gripper around the event"),
        "speed_ratio": (motion.ratio, "1", "peak of the strip's speed over that with which it follows its gripper"),
        "following": (motion.following, "m s-1", "speed with which the strip follows its gripper"),
        "clock_offset": (found.clock.offset if found.clock else np.nan, "s", "time of the log minus that of the video"),
        "height": (entries["gripper"]["height"], "m", "height of the gripper, as described"),
        "eta_b": (entries["strip"]["eta_b"], "m-4 s2", "weight-to-bending-stiffness ratio, as described"),
        "length": (entries["strip"]["length"], "m", "length of the strip, as described"),
    }
    arrays: dict[str, tuple[Any, Any, str, str]] = {
        "x": ("t", tracks.gripped_end[:, 0], "m", "x of the gripped end by the video"),
        "z": ("t", tracks.gripped_end[:, 1], "m", "z of the gripped end by the video"),
        "gripper_seen": ("t", tracks.gripper.tracked.astype(np.int8), "1", "whether the marker was seen"),
        "gripper_score": ("t", tracks.gripper.score, "1", "confidence in the marker, 0 to 1"),
        "strip_score": ("t", tracks.score, "1", "confidence in the strip, 0 to 1; 0 lost"),
        "strip": (("t", "station", "axis"), tracks.points.astype(np.float32), "m", "material points, x and z"),
        "speed": ("moment", motion.u, "m s-1", "speed of the strip: median over its points in a window of 0.15 s"),
    }
    coords = {
        "t": ("t", tracks.timing.time, "s", "time of the frame"),
        "moment": ("moment", motion.t, "s", "middle of the window"),
        "station": ("station", tracks.stations, "m", "length along the strip from the gripper"),
        "axis": ("axis", ["x", "z"], "1", "coordinate"),
    }
    attrs = {
        "recording": entries["title"],
        "synthetic": int(entries["synthetic"]),
        "flags": "; ".join(found.flags),
        "manual_onset": found.manual,
        **{f"calibration_{name}": value for name, value in found.calibration.quality.items()},
    }
    data = {name: variable((), *given) for name, given in scalars.items()}
    data |= {name: variable(*given) for name, given in arrays.items()}
    return xr.Dataset(data, {name: variable(*given) for name, given in coords.items()}, attrs)
