"""How the friction that an R-path needs depends on the size of the steps: the paper's pull does, the hysteresis not.

Lengths in L*, k_f in g/L*, M_0 in rho_a g L*^2.  Source: docs/physics.md, section 8.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from stripfold.analysis.friction import LAWS, follow, model_for, smallest
from stripfold.analysis.static import StripModel
from stripfold.paths.rpath import plan_r_path


def run(
    length: float,
    thickness: float,
    steps: Sequence[float],
    refinement: float,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """The smallest friction that suffices, over ``law`` and ``step``.

    Raises
    ------
    SolveError
        None suffices.
    """
    plan = plan_r_path(length)
    model = model_for(StripModel(length, thickness), plan, refinement)
    names = {
        "fails": "not enough: k_f / (g/L*), or M_0 / rho_a g L*^2",
        "suffices": "enough: k_f / (g/L*), or M_0 / rho_a g L*^2",
        "touch_error": "first touch less the planned one / L*, with what suffices",
    }
    data = {name: np.full((len(LAWS), len(steps)), np.nan) for name in names}
    for i, law in enumerate(LAWS):
        for j, step in enumerate(steps):
            fails, suffices = smallest(model, plan, law, step)
            data["fails"][i, j], data["suffices"][i, j] = fails, suffices
            data["touch_error"][i, j] = follow(model, plan, law, suffices, step).touch_x - plan.first_touch
            if progress:
                progress(f"{law}, steps of {step:g} L*: {suffices:.4g}")
    coords = {
        "law": ("law", np.array(LAWS, dtype=object), {"units": "1", "long_name": "law of friction"}),
        "step": ("step", np.array(steps), {"units": "1", "long_name": "size of the steps / L*"}),
    }
    return xr.Dataset(
        {key: (("law", "step"), values, {"units": "1", "long_name": names[key]}) for key, values in data.items()},
        coords=coords,
        attrs={"length": length, "thickness": thickness},
    )
