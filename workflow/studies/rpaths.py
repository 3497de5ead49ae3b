"""R-paths: where they meet the stability boundary, and how the friction they need depends on the steps.

The R-path touches the boundary.  On the elastica its critical state is found from the path's side and compared with
lambda_c of its height.  The solid meets its own boundary at a small angle; its critical point is compared with its own
lambda_c.  Lengths in L*, k_f in g/L*, M_0 in rho_a g L*^2.  Source: docs/physics.md, sections 5 and 8.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import xarray as xr

from stripfold import elastica
from stripfold.base.errors import SolveError
from stripfold.elastica.half_fold import critical_state_fixed_lift_off
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel
from stripfold.follow.track import BIFURCATION
from stripfold.paths.rpath import plan_r_path
from studies.common import Progress, dataset, grid
from tasks.assess_data import off_the_boundary
from tasks.friction import LAWS, smallest


def planned(length: float) -> dict[str, float]:
    """The elastica's critical state on the R-path: the gripper's place, and errors."""
    plan = plan_r_path(length)
    state = critical_state_fixed_lift_off(length - plan.lying_length)
    x, z = state.gripper
    return {
        "planned_x": length / 2.0 - plan.lying_length - x,
        "planned_z": z,
        "plan_error": max(state.first_integral_error for state in plan.states),
        "elastica_error": state.advance - elastica.critical(z).advance,
    }


def critical(refinement: float, length: float, thickness: float) -> dict[str, float]:
    """The solid's critical point on the R-path.

    Raises SolveError: a part cannot be computed, or no state on the path is critical.
    """
    strip, path = StripModel(length, thickness), plan_r_path(length).path
    events = assess_strip(strip, path, refinement=refinement).events
    if not events:
        raise SolveError("no critical point on the R-path")
    first = events[0]
    x, z = place = path.position(first.travelled)
    off = off_the_boundary(strip, place, refinement)
    return {"x": x, "z": z, "angle": first.angle, "boundary_error": off, "bifurcation": first.kind == BIFURCATION}


def run_tangency(
    lengths: Sequence[float],
    thicknesses: Sequence[float],
    refinement: float,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Critical points on R-paths, over ``length`` and ``thickness``."""
    names = ("x", "z", "angle", "boundary_error", "bifurcation")
    axes = {"length": lengths, "thickness": thicknesses}
    values = grid(partial(critical, refinement), names, axes, threads, progress)
    plans = [planned(length) for length in lengths]
    return dataset("tangency", values | {name: ("length", [plan[name] for plan in plans]) for name in plans[0]})


def needed(length: float, thickness: float, refinement: float, law: str, step: float) -> dict[str, float]:
    """The smallest sufficient friction of the rod (a third of the cost); raises SolveError where none suffices."""
    plan = plan_r_path(length)
    mesh = StripModel(length, thickness, kind="rod").contact_mesh(refinement, memory=True)
    found = smallest(mesh, plan, law, step)
    return {"fails": found.fails, "suffices": found.suffices, "touch_error": found.touch_x - plan.first_touch}


def run_friction_steps(
    length: float,
    thickness: float,
    steps: Sequence[float],
    refinement: float,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The smallest sufficient friction, over ``law`` and ``step``: the paper's pull depends on the step."""
    case = partial(needed, length, thickness, refinement)
    names = ("fails", "suffices", "touch_error")
    values = grid(case, names, {"law": LAWS, "step": steps}, threads, progress)
    return dataset("friction_steps", values, {"length": length, "thickness": thickness})
