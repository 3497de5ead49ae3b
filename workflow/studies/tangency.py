"""The R-path touches the stability boundary: measured on the elastica and on the solid, for several lengths.

On the elastica the critical state on the path is found from the path's side and compared with lambda_c of its height.
The solid follows the same path, meets its own boundary at a small angle, and its critical point is compared with its
own lambda_c.  Lengths in L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from collections.abc import Sequence

import xarray as xr

from stripfold import elastica
from stripfold.analysis.assess import BIFURCATION, assess_strip, off_the_boundary
from stripfold.analysis.static import StripModel
from stripfold.elastica.half_fold import critical_state_fixed_lift_off
from stripfold.paths.rpath import plan_r_path
from studies.common import Progress, blank, dataset


def run(
    lengths: Sequence[float],
    thicknesses: Sequence[float],
    refinement: float,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Critical points on R-paths, over ``length`` and ``thickness``.

    Raises
    ------
    SolveError
        A length with which the strip touches before it is critical, or a part that could not be computed.
    """
    columns = ("x", "z", "angle", "boundary_error", "bifurcation")
    found = {name: blank(len(lengths), len(thicknesses)) for name in columns}
    planned = {name: blank(len(lengths)) for name in ("planned_x", "planned_z", "plan_error", "elastica_error")}
    for i, length in enumerate(lengths):
        plan = plan_r_path(length)
        state = critical_state_fixed_lift_off(length - plan.lying_length)
        x, z = state.gripper
        planned["planned_x"][i], planned["planned_z"][i] = length / 2.0 - plan.lying_length - x, z
        planned["plan_error"][i] = max(state.first_integral_error for state in plan.states)
        planned["elastica_error"][i] = state.advance - elastica.critical(z).advance
        for j, thickness in enumerate(thicknesses):
            strip = StripModel(length, thickness)
            events = assess_strip(strip, plan.path, refinement=refinement).events
            if not events:
                continue
            first = events[0]
            off = off_the_boundary(strip, first, refinement)
            numbers = (*first.place, first.angle, off, float(first.kind == BIFURCATION))
            for name, number in zip(columns, numbers, strict=True):
                found[name][i, j] = number
            if progress:
                progress(f"{length:g} L*, h = {thickness:g}: off by {off:.1e} L*")
    return dataset(
        "tangency",
        {
            "length": ("length", lengths),
            "thickness": ("thickness", thicknesses),
            **{name: (("length", "thickness"), values) for name, values in found.items()},
            **{name: ("length", values) for name, values in planned.items()},
        },
    )
