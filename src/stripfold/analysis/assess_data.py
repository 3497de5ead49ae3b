"""Assessments of the paper's paths as files: one per path and material, and the table of all."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stripfold.analysis.assess import (
    Assessment,
    assess_strip,
    lying_length,
    off_the_boundary,
    peak_forces,
    shape_error,
)
from stripfold.analysis.release import Fall, Progress
from stripfold.analysis.states import dataset, rows_of_motion, rows_of_segment
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from stripfold.material import Material
from stripfold.paths.rpath import path_of, plan_r_path

PATHS = ("r-path", "triangular", "circular")

NUMBERS = {
    "critical_points": ("1", "critical points on the path"),
    "critical_travelled": ("m", "length travelled at the first critical point"),
    "critical_x": ("m", "gripper at the first critical point, horizontal"),
    "critical_z": ("m", "gripper at the first critical point, height"),
    "critical_angle": ("degree", "angle between path and stability boundary at the first critical point"),
    "bifurcation": ("1", "1 where the first critical point is a bifurcation, 0 where it is a snap-through"),
    "boundary_error": ("m", "distance of the first critical point from lambda_c of the x-axis study at its height"),
    "touch_x": ("m", "first touch, horizontal; origin mid-strip"),
    "touch_travelled": ("m", "length travelled at the first touch"),
    "fell": ("1", "1 where the strip fell to its first touch"),
    "planned_touch_x": ("m", "landing place of the folded state"),
    "assumed_touch_x": ("m", "first touch that the path's own assumption implies"),
    "touch_error": ("m", "first touch less the landing place of the folded state; negative: short of it"),
    "lying_length": ("m", "length lying from the held end in the last state"),
    "shape_error": ("m", "largest distance of the last state's mid-surface from the folded state"),
    "peak_force": ("N m-1", "largest force of the gripper, statics"),
    "peak_hold": ("N m-1", "largest horizontal force at the held end, statics"),
    "relative_length": ("1", "length of the strip / L*"),
    "completed": ("1", "1 where the path was followed to its end"),
}


def run(
    material: Material,
    length: float,
    name: str,
    fall: Fall,
    refinement: float,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Assess one of the paper's paths; ``length`` in m, ``fall`` in solver units.

    Returns
    -------
    Dataset
        As :func:`.states.dataset`, with :data:`NUMBERS` as attributes; nan where there is no such thing.

    Raises
    ------
    InvalidInputError, SolveError
        As in :func:`.assess.assess`.
    """
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu)
    path = path_of(name, strip.length)
    found = assess_strip(strip, path, fall, refinement, progress)
    rows = []
    for i, segment in enumerate(found.segments):
        rows += rows_of_segment(segment, 2 * i)
        if i < len(found.motions):
            rows += rows_of_motion(found.motions[i], segment.problem(-1), 2 * i + 1)
    data = dataset(rows, found.model, path, material)
    return data.assign_attrs(path=name, length=length, **in_si(numbers(found, strip, name, refinement), material))


def numbers(found: Assessment, strip: StripModel, name: str, refinement: float) -> dict[str, float]:
    """:data:`NUMBERS` in solver units."""
    nan = float("nan")
    first = found.events[0] if found.events else None
    plan = plan_r_path(strip.length)
    # What each path takes for granted: no stiffness or a hinge at the fold line; the elastica.
    assumed = plan.first_touch if name == "r-path" else 0.0
    peak_force, peak_hold = peak_forces(found.states)
    touch = found.touch
    return {
        "critical_points": float(len(found.events)),
        "critical_travelled": first.travelled if first else nan,
        "critical_x": float(first.place[0]) if first else nan,
        "critical_z": float(first.place[1]) if first else nan,
        "critical_angle": first.angle if first else nan,
        "bifurcation": float(first.kind == "bifurcation") if first else nan,
        "boundary_error": off_the_boundary(strip, first, refinement) if first else nan,
        "touch_x": touch.x if touch else nan,
        "touch_travelled": touch.travelled if touch else nan,
        "fell": float(touch.fell) if touch else nan,
        "planned_touch_x": plan.landing,
        "assumed_touch_x": assumed,
        "touch_error": touch.x - plan.landing if touch else nan,
        "lying_length": lying_length(found.model, found.last),
        "shape_error": shape_error(found.model, found.last, plan),
        "peak_force": peak_force,
        "peak_hold": peak_hold,
        "relative_length": strip.length,
        "completed": float(found.at_end),
    }


def in_si(values: Mapping[str, float], material: Material) -> dict[str, float]:
    """:data:`NUMBERS` in their units."""
    factors = {
        "m": material.gravity_length,
        "N m-1": material.rho_a * material.gravity * material.gravity_length,
    }
    return {key: factors.get(NUMBERS[key][0], 1.0) * value for key, value in values.items()}


def table(files: Mapping[tuple[str, str], xr.Dataset], labels: Mapping[str, str]) -> xr.Dataset:
    """All assessments' numbers over ``material`` and ``path``; ``files`` by both names."""
    materials = list(labels)

    def per(get: str) -> Array:
        return np.array([[float(files[m, p].attrs[get]) for p in PATHS] for m in materials])

    data = {key: (("material", "path"), per(key), {"units": u, "long_name": t}) for key, (u, t) in NUMBERS.items()}
    for key, u, t in (("eta_b", "m-4 s2", "weight-to-bending-stiffness ratio"), ("gravity_length", "m", "L*")):
        values = np.array([float(files[m, PATHS[0]].attrs[key]) for m in materials])
        data[key] = (("material",), values, {"units": u, "long_name": t})  # type: ignore[assignment]
    coords = {
        "material": ("material", np.array(materials, dtype=object), {"units": "1", "long_name": "name"}),
        "path": ("path", np.array(PATHS, dtype=object), {"units": "1", "long_name": "folding path"}),
        "label": ("material", np.array(list(labels.values()), dtype=object), {"units": "1", "long_name": "label"}),
    }
    return xr.Dataset(data, coords=coords)
