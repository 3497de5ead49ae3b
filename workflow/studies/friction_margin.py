"""Friction that an R-path needs over the length of the strip, with an eta_b that is known exactly or not.

The path is planned for the given eta_b and followed by rods with the least, the given and the largest one of the
interval: M_0 suffices if all of them follow.  M_0 in rho_a g L*^2 of the given strip.  Source: docs/plan.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import sqrt

import xarray as xr

from stripfold import paths
from stripfold.ask.friction_needed import Followed, lost_with
from stripfold.ask.inputs import FoldingPlan
from stripfold.base.errors import SolveError
from stripfold.base.material import Material
from studies.common import Progress, dataset, grid

ETA_B = 3780.0
"""Any: in units of L* a strip of one length is nearly one strip."""
SEARCHED_FROM = 1e-3
"""M_0 from which the search begins, rho_a g L*^2: less is no number of a fabric."""

NARROW = 1.15
"""Ratio of the bracket's ends at which the search ends."""
MOST = 2.0
"""Largest M_0 tried, rho_a g L*^2: beyond that of fabrics."""


def least(strips: Sequence[Followed], yield_curvature: float | None) -> tuple[float, float]:
    """The least M_0 found to suffice and the largest found not to, rho_a g L*^2 of the strip in the middle.

    Raises SolveError: a path could not be followed, or no M_0 suffices.
    """
    given, _, _ = strips[len(strips) // 2]
    scale = given.force_scale * given.gravity_length
    fails, suffices, tried = 0.0, 0.0, SEARCHED_FROM
    while not 0.0 < suffices <= NARROW * fails:
        if lost_with(strips, tried * scale, yield_curvature) is None:
            suffices = tried
        else:
            fails = tried
        if fails == 0.0:
            break
        tried = sqrt(fails * suffices) if suffices else 2.0 * fails
        if tried > MOST:
            raise SolveError(f"no friction moment up to {fails:.3g} rho_a g L*^2 holds the strip")
    return suffices, fails


def smallest(length: float, uncertainty: float) -> dict[str, float]:
    """The least M_0 found to suffice and the largest found not to.

    Raises SolveError: a path could not be followed, or no M_0 suffices.
    """
    unit = Material(ETA_B).gravity_length
    given = FoldingPlan(length=length * unit, eta_b=ETA_B, eta_b_uncertainty=uncertainty)
    path = paths.r_path(given)
    strips = given.strips if uncertainty else given.strips[1:2]
    followed = [(strip.material, strip.length, path.curve.scaled(1.0 / strip.gravity_length)) for strip in strips]
    return dict(zip(("suffices", "fails"), least(followed, None), strict=True))


def run(
    lengths: Sequence[float],
    uncertainties: Sequence[float],
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The friction needed over ``length``, L*, and ``uncertainty``, relative, of eta_b; nan where none was found."""
    axes = {"length": lengths, "uncertainty": uncertainties}
    return dataset("friction_margin", grid(partial(smallest), ("suffices", "fails"), axes, threads, progress))
