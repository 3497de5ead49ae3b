"""Synthetic recordings of the configured materials, and what was measured in them beside what the model says.

The strips have friction in bending and the gripper moves: both make the strip snap later than the frictionless model
says, as the paper's real strips did (docs/physics.md, section 7 and 8).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.analysis import critical_point as critical
from stripfold.inputs import Scene as Asked
from stripfold.material import Material
from stripfold.synthetic.scene import Scene

SIZE = (480, 360)
FIELD = 8.0
"""Width of the picture in the folding plane, L*; at least enough for the gripper's height."""
OVER = 1.6
"""Height of the picture over the gripper's, with the marker."""
BEFORE, AFTER = 0.25, 0.8
"""How far before the loss of stability a film begins, L*, and how long it goes on after the first touch, s."""
RATE = 20.0
"""Frames per second."""
SAMPLES = 60
EXPONENTS = (2.0 / 3.0, 4.0 / 5.0)
"""Of the lag in the speed: where friction decides, and where inertia does."""


def scene_of(
    material: Mapping[str, Any], height: float, speed: float, friction: float, length: float, number: int
) -> Scene:
    """The synthetic recording of a material.

    Parameters
    ----------
    material
        Entry of the configuration.
    height, length
        Of the gripper and the strip, L*.
    speed
        Of the gripper, m/s.
    friction
        M_0, rho_a g L*^2.
    number
        Decides the noise.
    """
    unit = Material(material["eta_b"]).gravity_length
    lambda_c = elastica.critical(height).advance
    field = max(FIELD, OVER * height * SIZE[0] / SIZE[1]) * unit
    # The loop is behind the gripper and as wide as two L*: between both is the middle.
    x = (-0.5 * length + lambda_c - 1.0) * unit
    share = field / 0.32
    return Scene.of(
        {
            "strip": {
                "length": length * unit,
                "eta_b": material["eta_b"],
                "material": material["name"],
                "width": 0.02 * share,
            },
            "gripper": {
                "height": height * unit,
                "speed": speed,
                "marker_size": 0.024 * share,
                "offset": [0.0, -0.032 * share],
                "finger": 0.003 * share,
            },
            "filming": {
                "size": list(SIZE),
                "target": [x, 0.5 * OVER * height * unit - 0.5 * unit],
                "field": field,
                "distance": 3.0 * field,
                "log_offset": 0.2,
                "codec": "mjpeg",
                "frame_rate": RATE,
            },
            "generator": "dynamics",
            "motion": {
                "friction": friction,
                "before": BEFORE * unit,
                "after": AFTER,
                "eta_m": material["eta_m"],
                # Nearer to the solid than anything that is measured (docs/method.md), and faster.
                "model": "rod",
                "refinement": 1.0,
            },
            "seed": number,
            "title": f"{material['name']} at z = {height:g} L*, {speed * 1e3:g} mm/s (synthetic)",
        }
    )


def table(
    measured: Sequence[xr.Dataset], names: Sequence[str], materials: Mapping[str, Mapping[str, Any]]
) -> xr.Dataset:
    """What was measured, recording by recording, with the frictionless model's lambda_c at the same height.

    Parameters
    ----------
    measured
        Datasets of measured recordings.
    names
        Of the recordings.
    materials
        Entries of the configuration by name; a recording whose eta_b is none of theirs has the paper's eta_m.
    """
    rows = [_row(data, materials) for data in measured]
    units = {
        "eta_b": ("m-4 s2", "weight-to-bending-stiffness ratio"),
        "height": ("m", "height of the gripper"),
        "speed": ("m s-1", "speed of the gripper"),
        "lambda_event": ("m", "lambda at the onset of the snap, measured"),
        "lambda_low": ("m", "lower end of its 95 % interval"),
        "lambda_high": ("m", "upper end of its 95 % interval"),
        "lambda_static": ("m", "end of the quasi-static branch, measured"),
        "lambda_zero": ("m", "onset extrapolated to vanishing speed, from the recordings at this height"),
        "lambda_model": ("m", "lambda_c of the model without friction"),
        "snapped": ("1", "whether there was a snap"),
        "synthetic": ("1", "whether the recording was computed, not filmed"),
        "flagged": ("1", "whether the measurement has flags"),
    }
    data: dict[str, Any] = {
        name: ("recording", np.array([row[name] for row in rows], dtype=np.float64), {"units": u, "long_name": text})
        for name, (u, text) in units.items()
        if name != "lambda_zero"
    }
    found = xr.Dataset(data, {"recording": ("recording", list(names), {"units": "1", "long_name": "name"})})
    zero = zero_speed(found)
    unit, text = units["lambda_zero"]
    places = np.array([_track(data) for data in measured]).reshape(-1, SAMPLES, 2)
    return found.assign(
        lambda_zero=("recording", zero, {"units": unit, "long_name": text}),
        track=(
            ("recording", "sample", "axis"),
            places,
            {"units": "m", "long_name": "lambda and height of the gripped end in equal times, by the video"},
        ),
    ).assign_coords(axis=("axis", ["lambda", "z"], {"units": "1", "long_name": "coordinate"}))


def _track(data: xr.Dataset) -> np.ndarray:
    """lambda and z in the film, shape (samples, 2), m: lambda is that of the event, counted on by the video."""
    t = np.linspace(float(data["t"][0]), float(data["t"][-1]), SAMPLES)
    x, z = (np.interp(t, data["t"].values, data[name].values) for name in ("x", "z"))
    moment = float(data["event_time"])
    advance = np.abs(x - np.interp(moment, data["t"].values, data["x"].values)) * np.sign(t - moment)
    return np.stack([float(data["lambda_event"]) + advance, z], axis=1)


def _row(data: xr.Dataset, materials: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    eta_b, height, length = (float(data[name]) for name in ("eta_b", "height", "length"))
    near = [m for m in materials.values() if np.isclose(m["eta_b"], eta_b, rtol=1e-6)]
    eta_m = near[0]["eta_m"] if near else 1e-3
    model = critical.find(Asked(length=length, height=height, eta_b=eta_b, eta_m=eta_m, model="rod"))
    return {
        **{
            name: float(data[name])
            for name in ("lambda_event", "lambda_low", "lambda_high", "lambda_static", "snapped")
        },
        "eta_b": eta_b,
        "height": height,
        "speed": float(data["gripper_speed"]),
        "lambda_model": model.lambda_c,
        "synthetic": float(data.attrs["synthetic"]),
        "flagged": float(bool(data.attrs["flags"])),
    }


def zero_speed(data: xr.Dataset) -> np.ndarray:
    """lambda at the onset extrapolated to speed zero, m, shape (n,): nan where there is one speed only.

    The lag grows with the speed to the power 2/3 (damped) or 4/5 (not): the mean of both; half of what they differ by
    is less than the lag that is left.
    """
    zero = np.full(data.sizes["recording"], np.nan)
    key = [(round(float(e), 6), round(float(z), 6)) for e, z in zip(data["eta_b"], data["height"], strict=True)]
    for group in set(key):
        rows = [i for i, k in enumerate(key) if k == group and data["snapped"].values[i]]
        speed, lam = data["speed"].values[rows], data["lambda_event"].values[rows]
        if len(rows) > 1 and np.ptp(speed) > 0.1 * speed.max():
            zero[rows] = np.mean([np.polyfit(speed**power, lam, 1)[1] for power in EXPONENTS])
    return zero
