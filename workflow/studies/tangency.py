"""The R-path touches the stability boundary: measured on the elastica and on the solid, for several lengths.

On the elastica the critical state on the path is found from the path's side and compared with lambda_c of its height.
The solid follows the same path, meets its own boundary at a small angle, and its critical point is compared with its
own lambda_c.  Lengths in L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.analysis.assess import BIFURCATION, assess_strip, off_the_boundary
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from stripfold.elastica.half_fold import critical_state_fixed_lift_off
from stripfold.paths.rpath import plan_r_path


def run(
    lengths: Sequence[float],
    thicknesses: Sequence[float],
    refinement: float,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Critical points on R-paths, over ``length`` and ``thickness``.

    Raises
    ------
    SolveError
        A length with which the strip touches before it is critical, or a part that could not be computed.
    """
    shape = (len(lengths), len(thicknesses))
    names = ("x", "z", "angle", "boundary_error", "bifurcation")
    found: dict[str, Array] = {name: np.full(shape, np.nan) for name in names}
    plans: dict[str, list[float]] = {"planned_x": [], "planned_z": [], "elastica_error": [], "plan_error": []}
    for i, length in enumerate(lengths):
        plan = plan_r_path(length)
        state = critical_state_fixed_lift_off(length - plan.lying_length)
        x, z = state.gripper
        plans["planned_x"].append(length / 2.0 - plan.lying_length - x)
        plans["planned_z"].append(z)
        plans["plan_error"].append(max(state.first_integral_error for state in plan.states))
        plans["elastica_error"].append(state.advance - elastica.critical(z).advance)
        for j, thickness in enumerate(thicknesses):
            strip = StripModel(length, thickness)
            events = assess_strip(strip, plan.path, refinement=refinement).events
            if not events:
                continue
            first = events[0]
            found["x"][i, j], found["z"][i, j] = first.place
            found["angle"][i, j] = first.angle
            found["boundary_error"][i, j] = off_the_boundary(strip, first, refinement)
            found["bifurcation"][i, j] = float(first.kind == BIFURCATION)
            if progress:
                progress(f"{length:g} L*, h = {thickness:g}: off by {found['boundary_error'][i, j]:.1e} L*")
    texts = {
        "x": ("1", "gripper at the solid's critical point, horizontal / L*"),
        "z": ("1", "gripper at the solid's critical point, height / L*"),
        "angle": ("degree", "angle between path and stability boundary"),
        "boundary_error": ("1", "solid's critical point less lambda_c of its x-axis study at that height / L*"),
        "bifurcation": ("1", "1 where it is told to be a bifurcation; nan where there is no critical point"),
        "planned_x": ("1", "gripper at the elastica's critical state, horizontal / L*"),
        "planned_z": ("1", "gripper at the elastica's critical state, height / L*"),
        "plan_error": ("1", "largest error of the first integral in the planned states"),
        "elastica_error": ("1", "its advance less lambda_c of its height / L*"),
    }
    data: dict[str, Any] = {}
    for name, values in (found | {key: np.array(column) for key, column in plans.items()}).items():
        unit, text = texts[name]
        dims = ("length", "thickness")[: values.ndim]
        data[name] = (dims, values, {"units": unit, "long_name": text})
    coords = {
        "length": ("length", np.array(lengths), {"units": "1", "long_name": "length of the strip / L*"}),
        "thickness": ("thickness", np.array(thicknesses), {"units": "1", "long_name": "h / L*"}),
    }
    return xr.Dataset(data, coords=coords)
