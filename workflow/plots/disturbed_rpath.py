"""First touch on a disturbed R-path, without and with bending friction."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import look
from stripfold.draw.colours import LYING
from stripfold.draw.style import figure, legend_above, styled


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the first touch less the planned one of each disturbance, a mark for each M_0.

    ``data`` is from :func:`verification.disturbed_rpath.run`.
    """
    names = data["disturbance"].values
    rows = -np.arange(len(names), dtype=float)
    fig = figure(1.2 + 0.24 * len(names))
    ax = fig.subplots()
    ax.axvline(0.0, color=LYING, lw=0.8, zorder=1)
    for i, moment in enumerate(data["moment"].values):
        color, marker = look(i)
        error = data["touch_error"].sel(moment=moment).values
        ax.plot(error, rows, marker, color=color, ms=5, mfc="none", label=f"$M_0 = {moment:g}$")
    ax.set_yticks(rows, [_label(name) for name in names])
    ax.tick_params(axis="y", length=0)
    ax.set(xlabel="first touch less planned [$L^*$]")
    legend_above(fig, ncols=2, fontsize=7)
    return fig


def _label(name: str) -> str:
    """A disturbance with its symbols: eta_b, L* and, of a vibration, the angular frequency."""
    for plain, symbol in (
        ("eta_b", r"$\eta_b$"),
        ("L*, ", r"L*, $\omega = $"),
        ("L*", "$L^*$"),
        ("-", "\N{MINUS SIGN}"),
    ):
        name = name.replace(plain, symbol)
    return name
