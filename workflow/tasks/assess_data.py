"""Assessments of the paper's paths as files: one per path and material, and the table of all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.files import schema
from stripfold.follow.assess import Assessment, CriticalEvent, assess_strip, lying_length, peak_forces, shape_error
from stripfold.follow.release import Fall, Progress
from stripfold.follow.static import StripModel, solve_height
from stripfold.paths.curve import GripperPath
from stripfold.paths.geometric import circular, triangular
from stripfold.paths.rpath import plan_r_path
from tasks.states import dataset, rows_of_motion, rows_of_segment

if TYPE_CHECKING:
    import xarray as xr

PATHS = ("r-path", "triangular", "circular")

NUMBERS = (
    "critical_points",
    "critical_travelled",
    "critical_x",
    "critical_z",
    "critical_angle",
    "bifurcation",
    "boundary_error",
    "touch_x",
    "touch_travelled",
    "fell",
    "planned_touch_x",
    "landing_x",
    "assumed_touch_x",
    "touch_error",
    "touch_uncertainty",
    "lying_length",
    "shape_error",
    "peak_force",
    "peak_hold",
    "relative_length",
    "completed",
)
"""Numbers of an assessment, stored as attributes of its file."""


def path_of(name: str, length: float) -> GripperPath:
    """One of the paper's paths, "triangular", "circular" or "r-path", for a strip of this length, L*.

    Raises InvalidInputError: a length for which there is no such path.
    """
    if name == "r-path":
        return plan_r_path(length).path
    return {"triangular": triangular, "circular": circular}[name](length)


def run(
    material: Material, length: float, name: str, fall: Fall, refinement: float, progress: Progress | None = None
) -> xr.Dataset:
    """Assess one of the paper's paths; ``length`` in m, ``fall`` in solver units.

    As :func:`.states.dataset`, with :data:`NUMBERS` as attributes; nan where there is no such thing.  Raises
    InvalidInputError, SolveError: as in :func:`.assess_strip`.
    """
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu)
    path = path_of(name, strip.length)
    found = assess_strip(strip, path, fall, refinement, progress).complete()
    to_touch = replace(fall, to_rest=False)
    fine = assess_strip(strip, path, to_touch, 0.5 * refinement, progress).complete()
    rows = []
    for i, segment in enumerate(found.segments):
        rows += rows_of_segment(segment, 2 * i)
        if i < len(found.motions):
            rows += rows_of_motion(found.motions[i], 2 * i + 1)
    data = dataset(rows, path, material)
    found_si = schema.in_si(numbers(found, fine, strip, name, refinement), material.scales)
    return data.assign_attrs(path=name, length=length, contact=found.contact, **found_si)


def numbers(found: Assessment, fine: Assessment, strip: StripModel, name: str, refinement: float) -> dict[str, float]:
    """:data:`NUMBERS` in solver units; ``fine`` is the same up to the first touch, on elements half as long."""
    nan = float("nan")
    first = found.events[0] if found.events else None
    plan = plan_r_path(strip.length)
    # What each path takes for granted: no stiffness or a hinge at the fold line; the elastica.
    assumed = plan.first_touch if name == "r-path" else 0.0
    peak_force, peak_hold = peak_forces(found.states)
    touch, again = found.touch, fine.touch
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
        "planned_touch_x": plan.first_touch,
        "landing_x": plan.landing,
        "assumed_touch_x": assumed,
        "touch_error": touch.x - plan.first_touch if touch else nan,
        "touch_uncertainty": abs(touch.x - again.x) if touch and again else nan,
        "lying_length": lying_length(*found.last),
        "shape_error": shape_error(*found.last, plan),
        "peak_force": peak_force,
        "peak_hold": peak_hold,
        "relative_length": strip.length,
        "completed": float(found.at_end),
    }


def off_the_boundary(strip: StripModel, event: CriticalEvent, refinement: float = 1.0) -> float:
    """How far a critical point on a path is from lambda_c of the x-axis study at its height, L*.

    The boundary belongs to the strip, not to the path: what differs is error.  nan where the sag touches first at
    constant height.
    """
    x, z = event.place
    run = solve_height(strip, float(z), refinement)
    if run.critical is None:
        return float("nan")
    return float(x + strip.length / 2.0 - run.critical.lam)


def table(files: Mapping[tuple[str, str], xr.Dataset], labels: Mapping[str, str]) -> xr.Dataset:
    """All assessments' numbers over ``material`` and ``path``; ``files`` by both names."""
    materials = list(labels)

    def per(name: str) -> Array:
        return np.array([[float(files[m, p].attrs[name]) for p in PATHS] for m in materials])

    return schema.dataset(
        {
            **{name: (("material", "path"), per(name)) for name in NUMBERS},
            **{name: ("material", per(name)[:, 0]) for name in ("eta_b", "gravity_length", "rho_a")},
            "material": ("material", materials),
            "path": ("path", PATHS),
            "label": ("material", list(labels.values())),
        }
    )
