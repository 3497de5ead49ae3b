"""The strip on each of the paper's paths, up to the first critical point, and its fall from there."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import CARETUP

from plots.path_readers import Part, parts, planned
from plots.pieces import draw_states, entry, note
from plots.planned_paths import draw_path, limits
from stripfold.base.progress import FALL
from stripfold.draw.colours import BLACK, CRITICAL, FALLING, LYING, STATIC
from stripfold.draw.style import CM, equal_panels, legend_above, styled

TITLES = {"r-path": "(a) R-path", "triangular": "(b) triangular path", "circular": "(c) circular path"}
SHOWN = 16
"""Largest number of states drawn on each path."""
FALLING_STATES = 4
"""Largest number of states drawn in each fall."""


@styled
def draw(r_path: xr.Dataset, triangular: xr.Dataset, circular: xr.Dataset, plans: xr.Dataset) -> Figure:
    """Draw static states in grey, the last before the first critical point in black, the fall red, the path dashed.

    Marks on the floor tell where the strip first touches, where it should, by the plan of the R-path, and where the
    folded strip begins to lie.

    ``r_path``, ``triangular``, ``circular``: from :func:`tasks.assess_data.run`; ``plans``: from
    :func:`tasks.plans.dataset`, for the same strip.
    """
    found = (r_path, triangular, circular)
    each = [parts(data) for data in found]
    plan, first = [planned(plans, name) for name in TITLES], [own[0] for own in each]
    lying = float(plans.attrs["length"]) / 2.0 - float(plans.attrs["lying_length"])
    intended = float(plans.attrs["planned_touch_x"])
    fig, axes = equal_panels([limits([*pair]) for pair in zip(plan, first, strict=True)], above=0.75, one_x=True)
    for i, (ax, title) in enumerate(zip(axes, TITLES.values(), strict=True)):
        path = draw_path(ax, plan[i])
        critical = float(found[i].attrs["critical_points"]) > 0.0
        static, last = draw_evolution(ax, first[i], SHOWN, critical)
        for part in [own for own in each[i][1:] if own.phase == FALL][:1]:
            fallen = part.states[part.evenly(FALLING_STATES + 1)[1:]]
            draw_states(ax, fallen, "fall", color=FALLING, ls="--", lw=0.8, zorder=3)
        if np.isfinite(touch := float(found[i].attrs["touch_x"])):
            ax.plot(CM * touch, 0.0, marker=CARETUP, color=FALLING, ms=5, mew=0, zorder=6, label="_touch")
        ax.plot(CM * intended, 0.0, marker=CARETUP, color=BLACK, ms=5, mew=0, zorder=5, label="_planned-touch")
        ax.plot(CM * lying, 0.0, "o", color=LYING, mec="white", mew=0.4, ms=5, zorder=6, label="_lying")
        note(ax, title + ("" if critical else ",\n      no critical point"))
    mark = entry("folded strip lies from here on", LYING, "none", marker="o", ms=4)
    fall = entry("fall", FALLING, "--", lw=0.8)
    touched = entry("first touch", FALLING, "none", marker=CARETUP, ms=5, mew=0)
    intention = entry("planned first touch", BLACK, "none", marker=CARETUP, ms=5, mew=0)
    legend_above(fig, [static, last, path, fall, touched, intention, mark])
    return fig


def draw_evolution(ax: Axes, part: Part, count: int, critical: bool) -> list[Line2D]:
    """Draw a static part in grey, its last state black where it is ``critical``; returns entries of a legend."""
    chosen = part.evenly(count)
    draw_states(ax, part.states[chosen[:-1] if critical else chosen], "static", color=STATIC, zorder=2)
    if critical:
        draw_states(ax, part.states[[-1]], "critical", color=CRITICAL, lw=1.4, zorder=4)
    return [entry("static states", STATIC, lw=0.8), entry("last before the critical point", CRITICAL, lw=1.4)]
