"""Friction that an R-path needs over the length of the strip, with an eta_b that is known exactly or not.

The path is planned for the given eta_b and followed by rods with the least, the given and the largest one of the
interval: M_0 suffices if all of them follow.  M_0 in rho_a g L*^2 of the given strip.  Source: docs/plan.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import xarray as xr

from stripfold import paths
from stripfold.analysis.friction_needed import needed
from stripfold.errors import SolveError
from stripfold.inputs import UNSTRETCHED, FoldingPlan
from stripfold.material import Material
from studies.common import Progress, dataset, grid

ETA_B = 3780.0
"""Any: in units of L* a thin strip of one length is one strip."""
SEARCHED_FROM = 1e-3
"""M_0 from which the search begins, rho_a g L*^2: less is no number of a fabric."""


def smallest(length: float, uncertainty: float) -> dict[str, float]:
    """The least M_0 found to suffice and the largest found not to.

    Raises SolveError: a path could not be followed, or no M_0 suffices.
    """
    unit = Material(ETA_B).gravity_length
    given = FoldingPlan(length=length * unit, eta_b=ETA_B, eta_m=UNSTRETCHED, eta_b_uncertainty=uncertainty)
    path = paths.r_path(given)
    strips = given.strips if uncertainty else given.strips[1:2]
    followed = [(strip.material, strip.length, path.curve.scaled(1.0 / strip.gravity_length)) for strip in strips]
    scale = given.material.force_scale * given.gravity_length
    found = needed(followed, None, SEARCHED_FROM * scale)
    if isinstance(found, str):
        raise SolveError(found)
    return {"suffices": found.moment / scale, "fails": found.fails / scale}


def run(
    lengths: Sequence[float],
    uncertainties: Sequence[float],
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The friction needed over ``length``, L*, and ``uncertainty``, relative, of eta_b; nan where none was found."""
    axes = {"length": lengths, "uncertainty": uncertainties}
    return dataset("friction_margin", grid(partial(smallest), ("suffices", "fails"), axes, threads, progress))
