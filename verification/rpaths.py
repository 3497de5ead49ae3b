"""R-paths: where they meet the stability boundary, and how the friction they need depends on the steps.

The R-path touches the boundary.  On the elastica its critical state is found from the path's side and compared with
lambda_c of its height.  The solid meets its own boundary at a small angle; its critical point is compared with its own
lambda_c.  Lengths in L*, k_f in g/L*, M_0 in rho_a g L*^2.  Source: docs/physics.md, sections 5 and 8.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.base.errors import SolveError
from stripfold.elastica.half_fold import critical_state_fixed_lift_off
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel
from stripfold.follow.track import BIFURCATION
from stripfold.paths.rpath import plan_r_path
from tasks.assess_data import off_the_boundary
from tasks.friction import LAWS, smallest
from verification.common import NO_RESULT, Progress, dataset, grid
from verification.numbers import Facts, Number

UNITS = {"degree": "angle"}


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


def needed(length: float, thickness: float, refinement: float, law: str, step: float) -> dict[str, float]:
    """The smallest sufficient friction of the rod (a third of the cost); raises SolveError where none suffices."""
    plan = plan_r_path(length)
    mesh = StripModel(length, thickness, kind="rod").contact_mesh(refinement, memory=True)
    found = smallest(mesh, plan, law, step)
    return {"fails": found.fails, "suffices": found.suffices}


def run(
    lengths: Sequence[float] = (13.0, 15.0, 20.0, 30.0, 40.0),
    thicknesses: Sequence[float] = (0.0594, 0.015),
    refinement: float = 0.5,
    length: float = 20.0,
    thickness: float = 0.0594,
    steps: Sequence[float] = (0.4, 0.2),
    step_refinement: float = 1.0,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Critical points on R-paths over ``lengths`` and ``thicknesses``; the least friction of a strip over ``steps``.

    ``refinement``: at 1.0 the critical points of the thinnest strips are off by 1e-3 L*.
    """
    names = ("x", "z", "angle", "boundary_error", "bifurcation")
    axes = {"length": lengths, "thickness": thicknesses}
    values = grid(partial(critical, refinement), names, axes, threads, progress)
    plans = [planned(length) for length in lengths]
    values |= {name: ("length", [plan[name] for plan in plans]) for name in plans[0]}
    # The paper's pull depends on the step.
    case = partial(needed, length, thickness, step_refinement)
    found = grid(case, ("fails", "suffices"), {"law": LAWS, "step": steps}, threads, progress)
    found["friction_no_result"] = found.pop(NO_RESULT)
    return dataset(values | found, units=UNITS)


def facts(d: xr.Dataset) -> Facts:
    error, thin, thick = np.abs(d.boundary_error), d.thickness.values.argmin(), d.thickness.values.argmax()
    return {
        "error": error.max(),
        "missing": np.isnan(error).sum(),
        "lengths": f"{d.sizes['length']} lengths from {float(d.length.min()):g} to {float(d.length.max()):g}",
        "elastica": np.abs(d.elastica_error).max(),
        "plan": d.plan_error.max(),
        "thinnest": d.thickness[thin],
        "thickest": d.thickness[thick],
        "angle": d.angle[:, thin].max(),
        "angle_thick": d.angle[:, thick].max(),
    }


def friction_steps(d: xr.Dataset) -> Facts:
    pull, moment = (d.suffices.sel(law=law) for law in ("pull", "hysteresis"))
    product = (pull * d.step).values
    return {
        "steps": f"{float(d.step.min()):g} to {float(d.step.max()):g}",
        "k_f": pull.max() / pull.min(),
        "products": f"{product.min():.4f} to {product.max():.4f}",
        "spread": product.max() / product.min(),
        "M_0": moment.max() / moment.min(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("tangency_error_max", "error", "L*", "< 1e-3 L*, none missing",
            "largest distance of the solid's critical point on the R-path from its lambda_c(z), {lengths} L*, "
            "{d.sizes[thickness]} thicknesses, {missing} missing; on the elastica {elastica:.0e} L*",
            lambda f: f.missing == 0),
        Number("tangency_angle", "angle", "degree", "less than on the thickest strip",
            "largest angle between R-path and stability boundary at h = {thinnest:g} L*; at h = {thickest:g} L* "
            "{angle_thick:.1f} degrees", lambda f: f.angle < f.angle_thick),
        Number("rpath_plan_error", "plan", "1", "< 1e-8",
            "largest error of the first integral in the planned states of the R-paths"),
    ),
    friction_steps: (
        Number("friction_step_k_f", "k_f", "1", "k_f times the step within a factor 1.2",
            "smallest sufficient k_f, largest over smallest for steps of {steps} L*; k_f times the step is "
            "{products} g", lambda f: f.spread < 1.2),
        Number("friction_step_M_0", "M_0", "1", "< 1.2",
            "smallest sufficient M_0 of bending hysteresis, largest over smallest for the same steps"),
    ),
}
# fmt: on
