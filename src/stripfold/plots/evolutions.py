"""The strip on each of the paper's paths, up to the first critical point."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stripfold.plots.followed import Part, parts, planned
from stripfold.plots.planned_paths import limits
from stripfold.plots.style import BLACK, CM, GREY, LYING, STATES_GREY, equal_panels, floor, note, styled

TITLES = {"r-path": "R-path", "triangular": "triangular path", "circular": "circular path"}
SHOWN = 16
"""Largest number of states drawn on each path."""


@styled
def draw(r_path: xr.Dataset, triangular: xr.Dataset, circular: xr.Dataset, plans: xr.Dataset) -> Figure:
    """Draw static states in grey, the last before the first critical point in black, the path dashed.

    A mark on the floor tells where the folded strip begins to lie.

    Parameters
    ----------
    r_path, triangular, circular
        From :func:`stripfold.analysis.assess_data.run`.
    plans
        From :func:`stripfold.analysis.plans.dataset`, for the same strip.
    """
    found = dict(zip(TITLES, (r_path, triangular, circular), strict=True))
    ways = {name: planned(plans, name) for name in TITLES}
    lying = float(plans.attrs["length"]) / 2.0 - float(plans.attrs["lying_length"])
    first = {name: parts(data)[0] for name, data in found.items()}
    fig, axes = equal_panels([limits([ways[name], first[name]]) for name in TITLES], above=0.42, one_x=True)
    for ax, letter, (name, title) in zip(axes, "abc", TITLES.items(), strict=True):
        ax.plot(*(CM * ways[name].states[:, 0]).T, "--", color=GREY, lw=0.8, zorder=1.5, label="_path")
        critical = float(found[name].attrs["critical_points"]) > 0.0
        evolution(ax, first[name], SHOWN, critical)
        ax.plot(CM * lying, 0.0, "o", color=LYING, mec="white", mew=0.4, ms=5, zorder=6, label="_lying")
        ax.set(ylabel="$z$ [cm]")
        ax.grid(visible=False)
        floor(ax)
        note(ax, f"({letter}) {title}" + ("" if critical else ",\n      no critical point"))
    axes[-1].set_xlabel("$x$ [cm]")
    fig.legend(handles=_handles(), loc="upper center", borderaxespad=0.3, ncols=2, columnspacing=1.2)
    return fig


def evolution(ax: Axes, part: Part, count: int, critical: bool) -> None:
    """States of a static part in grey; its last in black where it is ``critical``."""
    chosen = part.evenly(count)
    for i in chosen[:-1] if critical else chosen:
        ax.plot(*(CM * part.states[i]).T, color=STATES_GREY, lw=0.8, zorder=2, label="_static")
    if critical:
        ax.plot(*(CM * part.states[-1]).T, color=BLACK, lw=1.4, zorder=4, label="_critical")


def _handles() -> list[Line2D]:
    return [
        Line2D([], [], color=STATES_GREY, lw=0.8, label="static states"),
        Line2D([], [], color=BLACK, lw=1.4, label="last before the critical point"),
        Line2D([], [], color=GREY, lw=0.8, ls="--", label="gripper path"),
        Line2D([], [], color=LYING, marker="o", ls="none", ms=4, label="folded strip lies from here on"),
    ]
