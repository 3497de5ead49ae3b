"""The smallest internal friction with which an R-path is followed, over the materials."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stripfold.plots.materials import ETA_TITLE
from stripfold.plots.style import BLACK, BLUE, HELD, Look, figure, note, styled
from stripfold.plots.touch_error import common, draw_points, lengths_above

MOMENT = r"hysteresis: $M_0\,/\,\rho_a g {L^*}^2$"
PULL = r"pull: $k_f\,\Delta s\,/\,g$"
LOOKS = {"pull": (PULL, Look(HELD, "s")), "hysteresis": (MOMENT, Look(BLACK, "x"))}
RATIOS = {"ratio_max": ("largest", Look(HELD, "^")), "ratio_median": ("median", Look(BLUE, "v"))}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw over eta_b (a) the friction that suffices, by either law, (b) pulling force over gripper force.

    Strips of the commonest length are joined by a line.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.friction_data.table`.
    """
    eta, long = data["eta_b"].values, data["relative_length"].values
    unit, step = data["gravity_length"].values, data["step"].values
    joined, filled = common(unit * long), np.ones(len(eta), dtype=bool)
    # k_f is stored in g/L*.
    factor = {"pull": step / unit, "hysteresis": np.ones_like(eta)}
    fig = figure(4.6)
    top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=(1.3, 1.0))
    for law, (label, look) in LOOKS.items():
        draw_points(top, eta, factor[law] * data["suffices"].sel(law=law).values, look, joined, filled, law)
        top.plot([], [], color=look.colour, marker=look.marker, lw=1.0, label=label)
    for name, (label, look) in RATIOS.items():
        draw_points(bottom, eta, data[name].sel(law="pull").values, look, joined, filled, name)
        bottom.plot([], [], color=look.colour, marker=look.marker, lw=1.0, label=label)
    for ax in (top, bottom):
        ax.set(xscale="log", yscale="log")
        _decades(ax)
        ax.legend(loc="upper right", fontsize=7)
    top.set_ylabel("friction that suffices")
    bottom.set(xlabel=f"weight-to-bending-stiffness ratio {ETA_TITLE}", ylabel="pull$\\,/\\,$gripper force")
    note(top, "(a)")
    note(bottom, "(b) up to the first touch")
    lengths_above(top, data, long, joined)
    fig.align_ylabels()
    return fig


def _decades(ax: Axes) -> None:
    """Whole powers of ten around what is drawn, with room for the markers."""
    low, high = np.log10(ax.dataLim.intervaly)
    ax.set_ylim(10.0 ** np.floor(low - 0.1), 10.0 ** np.ceil(high + 0.1))
