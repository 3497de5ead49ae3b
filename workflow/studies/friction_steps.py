"""How the friction that an R-path needs depends on the size of the steps: the paper's pull does, the hysteresis not.

Lengths in L*, k_f in g/L*, M_0 in rho_a g L*^2.  Source: docs/physics.md, section 8.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stripfold.analysis.static import StripModel
from stripfold.paths.rpath import plan_r_path
from studies.common import Progress, blank, dataset
from tasks.friction import LAWS, follow, smallest


def run(
    length: float,
    thickness: float,
    steps: Sequence[float],
    refinement: float,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The smallest sufficient friction, over ``law`` and ``step``.

    Raises
    ------
    SolveError
        None suffices.
    """
    plan = plan_r_path(length)
    mesh = StripModel(length, thickness).contact_mesh(refinement, memory=True)
    fails, suffices, touch_error = (blank(len(LAWS), len(steps)) for _ in range(3))
    for i, j in np.ndindex(fails.shape):
        law, step = LAWS[i], steps[j]
        fails[i, j], enough = smallest(mesh, plan, law, step)
        suffices[i, j] = enough
        touch_error[i, j] = follow(mesh, plan, law, enough, step).touch_x - plan.first_touch
        if progress:
            progress(f"{law}, steps of {step:g} L*: {enough:.4g}")
    both = ("law", "step")
    values = {"fails": (both, fails), "suffices": (both, suffices), "touch_error": (both, touch_error)}
    return dataset(
        "friction_steps",
        {"law": ("law", LAWS), "step": ("step", steps), **values},
        {"length": length, "thickness": thickness},
    )
