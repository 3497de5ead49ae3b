"""The paper's paths assessed, as files: states of one per path and material, and the table of all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.base.progress import FALL
from stripfold.files import schema
from stripfold.follow.fall import Fall, Progress, assess_strip
from stripfold.follow.statics import StripModel, solve_height
from stripfold.follow.track import (
    End,
    Track,
    first_landing,
    forces_of,
    grip_and_hold,
    lying_length,
    mid_surfaces,
    nodes,
    peak_forces,
    shape_error,
)
from stripfold.paths.curve import GripperPath
from stripfold.paths.geometric import circular, triangular
from stripfold.paths.rpath import plan_r_path
from stripfold.solve.dynamics import TimeState
from stripfold.solve.problem import Point

if TYPE_CHECKING:
    import xarray as xr

STATIC = "static"
"""Value of ``phase`` of static states; the other is ``FALL``."""
MAX_STATES = 60
"""States kept of one fall; the strip's way between two neighbours is about the same."""
PATHS = ("r-path", "triangular", "circular")

NUMBERS = [
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
]
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

    As :func:`states`, with :data:`NUMBERS` as attributes; nan where there is no such thing.  Raises
    InvalidInputError, SolveError: as in :func:`.assess_strip`.
    """
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu)
    path = path_of(name, strip.length)
    found = assess_strip(strip, path, fall, refinement, progress).complete()
    fine = assess_strip(strip, path, replace(fall, to_rest=False), 0.5 * refinement, progress).complete()
    found_si = schema.in_si(numbers(found, fine, strip, path, refinement), material.scales)
    return states(found, path, material).assign_attrs(path=name, length=length, contact=found.contact, **found_si)


def states(found: Track, path: GripperPath, material: Material) -> xr.Dataset:
    """All states over ``state`` and ``node``, few of each fall; energies and forces per metre of width.

    The states have their own meshes; they are stored at equal distances 0.1 L* or less along the strip.  ``part``
    counts statics and falls.  Forces are those of the gripper and of the held end on the strip; in a fall they are nan.
    """
    kept = [(part, i) for part, rows in enumerate(found.parts) for i in _kept(found, rows)]
    rows = [found.states[i] for _, i in kept]
    arc = nodes(rows[0].problem.model.length)
    middle = mid_surfaces(rows, arc)
    points = [point for _, point in rows]

    def static(get: Callable[[Point], float]) -> Array:
        return np.array([get(point) if isinstance(point, Point) else nan for point in points], dtype=float)

    forces = [grip_and_hold(*row) for row in rows]
    still = np.array([isinstance(point, Point) for point in points])
    columns = {
        "travelled": np.array([point.lam for point in points]),
        "pseudo_time": np.array([path.pseudo_time(point.lam) for point in points]),
        "part": np.array([part for part, _ in kept]),
        "time": np.array([point.t if isinstance(point, TimeState) else nan for point in points]),
        "gripper_x": middle[:, 0, 0],
        "gripper_z": middle[:, 0, 1],
        "force_x": np.where(still, [grip[0] for grip, _ in forces], nan),
        "force_z": np.where(still, [grip[1] for grip, _ in forces], nan),
        "hold_x": np.where(still, [hold for _, hold in forces], nan),
        "eigenvalue": static(lambda point: float(point.eigenvalues[0])),
        "negatives": static(lambda point: point.negatives),
    }
    axes = ("state", "node")
    return schema.dataset(
        {
            **{name: ("state", values) for name, values in columns.items()},
            **{"x": (axes, middle[..., 0]), "z": (axes, middle[..., 1]), "arc": ("node", arc)},
            "phase": ("state", np.where(still, STATIC, FALL)),
        },
        material.attributes,
        material.scales,
    )


def _kept(found: Track, part: slice) -> list[int]:
    """Indices of the states of a part that are stored: of a fall the first, the touch and the last among them."""
    if found.phases[part.start] != FALL:
        return list(range(part.start, part.stop))
    fall = found.states[part]
    moved = [problem.model.largest_move(a.q, b.q) for (problem, a), (_, b) in pairwise(fall)]
    way = np.concatenate([[0.0], np.cumsum(moved)])
    kept = {*np.searchsorted(way, np.linspace(0.0, way[-1], MAX_STATES)).tolist(), 0, len(fall) - 1}
    if (landing := first_landing(fall)) is not None:
        kept.add(landing)
    return [part.start + i for i in sorted(kept)]


def numbers(found: Track, fine: Track, strip: StripModel, path: GripperPath, refinement: float) -> dict[str, float]:
    """:data:`NUMBERS` in solver units; ``fine`` is the same up to the first touch, on elements half as long."""
    first = found.events[0] if found.events else None
    plan = plan_r_path(strip.length)
    peak_force, peak_hold = peak_forces(forces_of(found.static))
    touch, again, last = found.touch, fine.touch, found.static[-1]
    place = path.position(first.travelled) if first else np.full(2, nan)
    return {
        "critical_points": float(len(found.events)),
        "critical_travelled": first.travelled if first else nan,
        "critical_x": float(place[0]),
        "critical_z": float(place[1]),
        "critical_angle": first.angle if first else nan,
        "bifurcation": float(first.kind == "bifurcation") if first else nan,
        "boundary_error": off_the_boundary(strip, place, refinement) if first else nan,
        "touch_x": touch.x if touch else nan,
        "touch_travelled": touch.travelled if touch else nan,
        "fell": float(touch.fell) if touch else nan,
        "planned_touch_x": plan.first_touch,
        "landing_x": plan.landing,
        # What each path takes for granted: no stiffness or a hinge at the fold line; the elastica.
        "assumed_touch_x": plan.first_touch if path.name == "r-path" else 0.0,
        "touch_error": touch.x - plan.first_touch if touch else nan,
        "touch_uncertainty": abs(touch.x - again.x) if touch and again else nan,
        "lying_length": lying_length(*last),
        "shape_error": shape_error(*last, plan),
        "peak_force": peak_force,
        "peak_hold": peak_hold,
        "relative_length": strip.length,
        "completed": float(found.end is End.PATH),
    }


def off_the_boundary(strip: StripModel, place: Array, refinement: float = 1.0) -> float:
    """How far a critical point with the gripper at (x, z) is from lambda_c of the x-axis study at its height, L*.

    The boundary belongs to the strip, not to the path: what differs is error.  nan where the sag touches first at
    constant height.
    """
    x, z = place
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
