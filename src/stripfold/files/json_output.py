"""Results as one JSON object: the numbers, the inputs that they are for, the units, and the program's version."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Any

from stripfold.base.version import version

OTHER = {
    name: unit
    for unit, names in {
        "m s-2": "acceleration gravity",
        "1": "accuracy agreement cases count coverage distortion_coefficients end_t eta_b_uncertainty exponent "
        "exponent_lower exponent_upper friction_moment_star layer_friction no_result row t touch",
        "m": "advance bending_length change drop end end_x end_z fold_at fold_height friction_boundary gain height "
        "height_sd margin residual s scale second_gripper snap_boundary square step touch_limit x_c",
        "degree": "angle slope",
        "px": "camera_matrix image_size rms split_half",
        "m-1": "curvature",
        "m s-1": "disturbance",
        "s": "duration seconds",
        "s-2": "pull",
        "J m-1": "energy",
        "m-4 s2": "eta_b_secant",
        "N": "friction_moment",
        "g m-2": "gsm",
        "gf cm/cm": "kes_2hb",
        "gf cm2/cm": "kes_b",
        "N m": "rigidity",
    }.items()
    for name in names.split()
}
"""Units of numbers that no stored dataset has, or has as something else."""
OF_INPUTS = {"air": "s-1", "stiffness": "s"}
"""Those of inputs with the name of another number."""


def document(numbers: Mapping[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers by their names, and ``inputs``, ``units`` (of both, by name, as in the netCDF files) and version."""
    from stripfold.files import schema

    known = {name: variable.unit for name, variable in schema.variables().items()} | OTHER
    units = {name: known[name] for name in _numeric(numbers) if name in known}
    asked = {name: unit for name in _numeric(inputs) if (unit := (known | OF_INPUTS).get(name))}
    return {
        **numbers,
        "inputs": dict(inputs),
        "units": dict(sorted((asked | units).items())),
        "stripfold_version": version(),
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
