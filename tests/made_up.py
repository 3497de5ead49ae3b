"""What several tests read or call: a made-up collapse, a fold's picture, commands' inputs, paths in L* assessed."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import xarray as xr

from stripfold.ask.assess import PathAssessment, assess
from stripfold.ask.inputs import PathInputs
from stripfold.base.material import Material
from stripfold.paths import FoldPath
from stripfold.paths.curve import GripperPath

INPUTS = {
    "grid.yaml": "{length: 0.6, model: rod, height: [0.06, 0.09], eta_b: [2000, 3780]}",
    "scene.yaml": "{length: 0.5, height: 0.09, eta_b: 3780, model: rod}",
    "filmed.yaml": "{length: 0.45, speed: 0.01, filming: {size: [320, 240]}}",
}
"""Files that commands read."""
LENGTH, HEIGHT = 0.6, 0.15
LAMBDA_0, LAMBDA_C, LAMBDA_END = 0.12, 0.36, 0.6
TOUCH, SETTLE = 0.5, 2.0
COUNTS = {"before": 31, "fall": 41, "after": 21}
NODES = 61


def collapse(after: bool = True) -> xr.Dataset:
    """A straight leg down to a sag that goes down to the floor in the fall; times in it are not evenly spaced."""
    way = {phase: np.linspace(0.0, 1.0, count) for phase, count in COUNTS.items()}
    time = SETTLE * way["fall"] ** 2
    advance = np.concatenate(
        [
            LAMBDA_0 + (LAMBDA_C - LAMBDA_0) * way["before"],
            np.full(COUNTS["fall"], LAMBDA_C),
            LAMBDA_C + (LAMBDA_END - LAMBDA_C) * way["after"],
        ]
    )
    down = np.concatenate([np.zeros(COUNTS["before"]), np.minimum(time / TOUCH, 1.0), np.ones(COUNTS["after"])])
    s = np.linspace(0.0, LENGTH, NODES)
    # From the gripper down to the floor within 0.2 m, and lying from there on; the sag is a cosine.
    hanging = s < 0.2
    x = np.where(hanging, advance[:, None] - LENGTH / 2.0, s - LENGTH / 2.0)
    sag = 0.02 * np.exp(-(((s - 0.25) / 0.05) ** 2))
    z = np.where(hanging, HEIGHT * (1.0 - s / 0.2), 0.0) + (1.0 - down[:, None]) * np.where(hanging, 0.0, sag)
    phase = np.repeat(list(COUNTS), list(COUNTS.values()))
    falling = phase == "fall"

    def in_fall(values: np.ndarray) -> np.ndarray:
        out = np.full(len(phase), np.nan)
        out[falling] = values
        return out

    share = np.minimum(time / SETTLE, 1.0)
    deflection = np.sqrt(np.mean((x - x[0]) ** 2 + (z - z[0]) ** 2, axis=1))
    at = ("state",)
    columns = {
        "time": (at, in_fall(time), "s"),
        "advance": (at, advance, "m"),
        "deflection": (at, deflection, "m"),
        "kinetic": (at, in_fall(2e-4 * share * (1.0 - share)), "J m-1"),
        "elastic": (at, 0.03 + in_fall(2e-3 * share), "J m-1"),
        "gravity": (at, 0.12 - in_fall(3e-3 * share), "J m-1"),
        "work": (at, in_fall(0.0 * share), "J m-1"),
        "air": (at, in_fall(5e-4 * share), "J m-1"),
        "viscous": (at, in_fall(3e-4 * share - 2e-4 * share * (1.0 - share)), "J m-1"),
        "contact": (at, in_fall(1e-4 * share), "J m-1"),
        "numerical": (at, in_fall(1e-4 * share), "J m-1"),
        "closing": (at, in_fall(-3e-15 * np.sign(share)), "J m-1"),
        "contacts": (at, np.full(len(phase), 40.0), "1"),
        "minimal_gap": (at, np.zeros(len(phase)), "m"),
        "x": ((*at, "node"), x, "m"),
        "z": ((*at, "node"), z, "m"),
        "arc": (("node",), s, "m"),
    }
    data = xr.Dataset({name: (dims, v, {"units": u, "long_name": name}) for name, (dims, v, u) in columns.items()})
    data = data.assign_coords(phase=("state", phase.astype(object), {"units": "1", "long_name": "part of the motion"}))
    data = data.assign(gripper_height=HEIGHT, lambda_0=LAMBDA_0, lambda_c=LAMBDA_C)
    data = data.assign(touch_time=TOUCH, touch_x=-0.05, settle_time=SETTLE)
    data.attrs = {"length": LENGTH, "gravity_length": 0.03, "eta_b": 3780.0}
    return data if after else until_touch(data)


def until_touch(data: xr.Dataset) -> xr.Dataset:
    """The same, as it is when only the way to the first touch was asked for."""
    keep = (data["phase"].values == "before") | (data["time"].values <= TOUCH)
    return data.isel(state=np.flatnonzero(keep)).assign(settle_time=np.nan)


def assess_path(
    material: Material,
    length: float,
    path: GripperPath,
    *,
    yield_curvature: float | None = None,
    refinement: float = 1.0,
    compare: bool = True,
    **given: Any,
) -> PathAssessment:
    """Assess a path in L* for a strip of ``length``, m; ``given`` are the other inputs."""
    unit = material.gravity_length
    asked = PathInputs(**asdict(material), length=length, **given)
    own = FoldPath(path.name, length, unit, path.scaled(unit))
    return assess(asked, own, yield_curvature=yield_curvature, refinement=refinement, compare=compare)
