"""Results as one JSON object: the numbers, the inputs that they are for, the units, and the program's version."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Any

import stripfold

OTHER = {
    "acceleration": "m s-2",
    "accuracy": "1",
    "advance": "m",
    "agreement": "1",
    "angle": "degree",
    "bending_length": "m",
    "camera_matrix": "px",
    "cases": "1",
    "count": "1",
    "coverage": "1",
    "curvature": "m-1",
    "distortion_coefficients": "1",
    "disturbance": "m s-1",
    "change": "m",
    "drop": "m",
    "duration": "s",
    "end": "m",
    "end_t": "1",
    "end_x": "m",
    "end_z": "m",
    "energy": "J m-1",
    "eta_b_secant": "m-4 s2",
    "eta_b_uncertainty": "1",
    "exponent": "1",
    "exponent_lower": "1",
    "exponent_upper": "1",
    "fold_at": "m",
    "fold_height": "m",
    "friction": "1",
    "friction_boundary": "m",
    "friction_moment": "N",
    "gain": "m",
    "gravity": "m s-2",
    "gsm": "g m-2",
    "height": "m",
    "height_sd": "m",
    "hysteresis": "N",
    "image_size": "px",
    "kes_2hb": "gf cm/cm",
    "kes_b": "gf cm2/cm",
    "layer_friction": "1",
    "margin": "m",
    "residual": "m",
    "rigidity": "N m",
    "rms": "px",
    "s": "m",
    "scale": "m",
    "second_gripper": "m",
    "seconds": "s",
    "slope": "degree",
    "snap_boundary": "m",
    "split_half": "px",
    "square": "m",
    "step": "m",
    "t": "1",
    "no_result": "1",
    "touch": "1",
    "touch_limit": "m",
    "x_c": "m",
}
"""Units of numbers that no stored dataset has, or has as something else."""
OF_INPUTS = {"air": "s-1", "friction": "s-2", "stiffness": "s"}
"""Those of inputs with the name of another number."""


def document(numbers: Mapping[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers by their names, and ``inputs``, ``units`` (of both, by name, as in the netCDF files) and version."""
    from stripfold import schema

    known = {name: variable.unit for name, variable in schema.variables().items()} | OTHER
    units = {name: known[name] for name in _numeric(numbers) if name in known}
    asked = {name: unit for name in _numeric(inputs) if (unit := (known | OF_INPUTS).get(name))}
    return {
        **numbers,
        "inputs": dict(inputs),
        "units": dict(sorted((asked | units).items())),
        "stripfold_version": stripfold.__version__,
    }


def _numeric(values: Any, name: str = "") -> Iterator[str]:
    """Names of all numbers, also of those within lists and mappings."""
    if isinstance(values, Mapping):
        for key, value in values.items():
            yield from _numeric(value, str(key))
    elif isinstance(values, list | tuple):
        for value in values:
            yield from _numeric(value, name)
    elif isinstance(values, int | float) and not isinstance(values, bool):
        yield name


def as_json(values: Mapping[str, Any]) -> str:
    """One JSON object; JSON has no nan: null stands for no number."""

    def plain(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: plain(item) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [plain(item) for item in value]
        return None if isinstance(value, float) and not isfinite(value) else value

    return json.dumps(plain(values), allow_nan=False)
