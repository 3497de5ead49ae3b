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
from stripfold.ask.friction import PlannedStrip, lost_with
from stripfold.ask.inputs import PlanInputs
from stripfold.base.errors import SolveError
from stripfold.base.material import Material
from verification.common import Progress, dataset, grid
from verification.numbers import Facts, Number

ETA_B = 3780.0
"""Any: in units of L* a strip of one length is nearly one strip."""
SEARCHED_FROM = 1e-3
"""M_0 from which the search begins, rho_a g L*^2: less is no number of a fabric."""

NARROW = 1.15
"""Ratio of the bracket's ends at which the search ends."""
MOST = 2.0
"""Largest M_0 tried, rho_a g L*^2: beyond that of fabrics."""


def least(strips: Sequence[PlannedStrip], yield_curvature: float | None) -> tuple[float, float]:
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
    given = PlanInputs(length=length * unit, eta_b=ETA_B, eta_b_uncertainty=uncertainty)
    path = paths.r_path(given)
    strips = given.strips if uncertainty else given.strips[1:2]
    followed = [(strip.material, strip.length, path.curve.scaled(1.0 / strip.gravity_length)) for strip in strips]
    return dict(zip(("suffices", "fails"), least(followed, None), strict=True))


def run(
    lengths: Sequence[float] = (20.0,),
    uncertainties: Sequence[float] = (0.0, 0.2),
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The friction needed over ``length``, L*, and ``uncertainty``, relative, of eta_b; nan where none was found."""
    axes = {"length": lengths, "uncertainty": uncertainties}
    return dataset(grid(partial(smallest), ("suffices", "fails"), axes, threads, progress))


def facts(d: xr.Dataset, fabrics: xr.Dataset) -> Facts:
    """What fabrics have over what R-paths need, with the smallest and the largest uncertainty of eta_b."""
    least, median = float(fabrics.friction.min()), float(fabrics.friction.median())

    def each(needed: xr.DataArray) -> str:
        rows = zip(d.length.values, needed.values, strict=True)
        return ", ".join(f"{least / m:.2g} and {median / m:.2g} at {length:g} L*" for length, m in rows)

    exact, uncertain = (d.suffices.sel(uncertainty=u) for u in (d.uncertainty.min(), d.uncertainty.max()))
    return {
        "bent": fabrics.sizes["bent"],
        "uncertainty": d.uncertainty.max(),
        # A length for which none was found has no margin.
        "exact": (least / exact).fillna(0.0).min(),
        "uncertain": (least / uncertain).fillna(0.0).min(),
        "exact_each": each(exact),
        "uncertain_each": each(uncertain),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("friction_margin_exact", "exact", "1", "> 1",
            "least M_0 of the {bent} fabrics with 2HB over the M_0 that suffices on the R-path of a strip whose eta_b "
            "is known exactly, the least over the lengths; least and median fabric by length: {exact_each}"),
        Number("friction_margin_uncertain", "uncertain", "1", "> 1",
            "the same where eta_b is known to {uncertainty:.0%} and all of the interval must be followed: "
            "{uncertain_each}"),
    ),
}
# fmt: on
