"""A measurement as a dataset: what is stored of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from stripfold.vision.measure import Measurement


def fields(found: Measurement) -> dict[str, Any]:
    """The result alone, for the command line; lengths in m, times in s."""
    low, high = found.interval
    static = found.static
    return {
        "snap": found.snapped,
        "lambda_event": found.event,
        "lambda_low": low,
        "lambda_high": high,
        "event_time": found.event_time,
        "lambda_video": found.by_video,
        "lambda_log": found.by_log,
        "lambda_static": static.lam if static else float("nan"),
        "lambda_static_sd": static.sd if static else float("nan"),
        "speed": found.speed,
        "flags": list(found.flags),
        "override": found.manual,
        "synthetic": bool(found.recording.entries["synthetic"]),
    }


_NAMES = {
    "shape": "noise of the strip's points",
    "level": "how well the peak of the strip's speed is known",
    "frames": "time between frames",
    "mapping": "calibration",
    "gripper": "noise of the gripper's marker",
    "clock": "bringing the clocks together",
}


def as_dataset(found: Measurement) -> xr.Dataset:
    """All of a measurement, SI.

    Returns
    -------
    Dataset over ``t`` (frames), ``moment`` (of the speed), ``station`` (along the strip); scalars for the result.
    """
    tracks, motion = found.tracks, found.motion
    low, high = found.interval
    gripper, strip = found.recording.entries["gripper"], found.recording.entries["strip"]
    static = found.static
    scalars: dict[str, tuple[float, str, str]] = {
        "lambda_event": (found.event, "m", "lambda at the onset of the snap; without a snap the farthest lambda"),
        "lambda_low": (low, "m", "lower end of its 95 % interval"),
        "lambda_high": (high, "m", "upper end of its 95 % interval"),
        "lambda_sd": (found.sd, "m", "its standard deviation"),
        **{f"sd_{k}": (v, "m", f"part of it: {_NAMES[k]}") for k, v in found.parts.items()},
        "lambda_video": (found.by_video, "m", "lambda at the event from the video alone"),
        "lambda_log": (found.by_log, "m", "lambda at the event from the robot's log"),
        "lambda_static": (static.lam if static else np.nan, "m", "end of the quasi-static branch by a square root"),
        "lambda_static_sd": (static.sd if static else np.nan, "m", "its standard deviation by the fit alone"),
        "event_time": (found.event_time, "s", "onset of the snap by the video's clock"),
        "gripper_speed": (found.speed, "m s-1", "speed of the gripper around the event"),
        "speed_ratio": (motion.ratio, "1", "peak of the strip's speed over that with which it follows its gripper"),
        "following": (motion.following, "m s-1", "speed with which the strip follows its gripper"),
        "clock_offset": (found.clock.offset if found.clock else np.nan, "s", "time of the log minus that of the video"),
        "height": (gripper["height"], "m", "height of the gripper, as described"),
        "eta_b": (strip["eta_b"], "m-4 s2", "weight-to-bending-stiffness ratio, as described"),
        "length": (strip["length"], "m", "length of the strip, as described"),
    }
    data: dict[str, Any] = {
        name: ((), value, {"units": unit, "long_name": text}) for name, (value, unit, text) in scalars.items()
    }
    data |= {
        "snapped": ((), int(found.snapped), {"units": "1", "long_name": "whether there was a snap"}),
        "x": ("t", tracks.place[:, 0], {"units": "m", "long_name": "x of the gripped end by the video"}),
        "z": ("t", tracks.place[:, 1], {"units": "m", "long_name": "z of the gripped end by the video"}),
        "gripper_seen": (
            "t",
            tracks.gripper.tracked.astype(np.int8),
            {"units": "1", "long_name": "whether the marker was seen"},
        ),
        "gripper_score": ("t", tracks.gripper.score, {"units": "1", "long_name": "confidence in the marker, 0 to 1"}),
        "strip_score": ("t", tracks.score, {"units": "1", "long_name": "confidence in the strip, 0 to 1; 0 lost"}),
        "strip": (
            ("t", "station", "axis"),
            tracks.points.astype(np.float32),
            {"units": "m", "long_name": "points fixed in the strip, x and z"},
        ),
        "speed": ("moment", motion.u, {"units": "m s-1", "long_name": "rms speed of the strip within 0.1 s"}),
    }
    coords = {
        "t": ("t", tracks.timing.time, {"units": "s", "long_name": "time of the frame"}),
        "moment": ("moment", motion.t, {"units": "s", "long_name": "middle of the window"}),
        "station": ("station", tracks.stations, {"units": "m", "long_name": "length along the strip from the gripper"}),
        "axis": ("axis", ["x", "z"], {"units": "1", "long_name": "coordinate"}),
    }
    attrs = {
        "recording": found.recording.entries["title"],
        "synthetic": int(found.recording.entries["synthetic"]),
        "flags": "; ".join(found.flags),
        "override": found.manual,
        **{f"calibration_{name}": value for name, value in found.calibration.quality.items()},
    }
    return xr.Dataset(data, coords, attrs)
