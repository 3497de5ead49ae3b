"""Length L* of real fabrics, and their internal friction beside that which an R-path needs."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.friction_needed import MOMENT
from plots.pieces import LENGTH_TITLE, note
from stripfold.draw.colours import BLACK, FRICTION, GREY, SKY, VERMILLION
from stripfold.draw.style import CM, figure, styled

KNOWN = (BLACK, SKY, VERMILLION, FRICTION)
"""Colours of the uncertainties of eta_b."""


@styled
def draw(data: xr.Dataset, needed: xr.Dataset) -> Figure:
    """Draw (a) the share of fabrics up to each L*, (b) the M_0 that an R-path needs, beside that of fabrics.

    ``data`` is from :func:`verification.fabrics.run`, ``needed`` from :func:`verification.friction_margin.run`.
    """
    fig = figure(5.4)
    top, bottom = fig.subplots(2, 1, height_ratios=(1.0, 1.6))
    lengths = data["gravity_length"].sortby(data["gravity_length"])
    share = (np.arange(len(lengths)) + 1.0) / len(lengths)
    tested = np.isin(lengths["fabric"].values, data["bent"].values)
    for chosen, label, fill in ((tested, "Kawabata's test", BLACK), (~tested, "cantilever", "white")):
        top.plot(CM * lengths.values[chosen], share[chosen], "o", ms=4, color=BLACK, mfc=fill, label=label)
    top.set(xlabel="$L^*$ [cm]", ylabel="share of fabrics", xlim=(0.0, None), ylim=(0.0, 1.05))
    top.legend(loc="lower right", fontsize=7)
    for color, (uncertainty, one) in zip(KNOWN, needed["suffices"].groupby("uncertainty"), strict=False):
        known = f"known to {100.0 * uncertainty:g} %" if uncertainty else "known exactly"
        bottom.plot(needed["length"], one.squeeze(), "o-", ms=4, color=color, label=rf"$\eta_b$ {known}")
    right = float(needed["length"].max())
    left = float(needed["length"].min())
    own = dict(zip(data["bent"].values, data["friction"].values, strict=True))
    own["dry textile (secant)"] = float(data["textile_friction_secant"])
    # Alternately at either side: neighbours may be close.
    for i, (name, moment) in enumerate(sorted(own.items(), key=lambda item: item[1])):
        bottom.axhline(moment, color=GREY, lw=0.8, ls=":", zorder=0)
        x, side, below = (right, "right", "top") if i % 2 else (left, "left", "bottom")
        bottom.text(x, moment, name, ha=side, va=below, fontsize=7, color=GREY)
    bottom.set(yscale="log", xlabel=LENGTH_TITLE, ylabel=MOMENT.split(": ")[1])
    bottom.set_ylim(None, 1.6 * max(own.values()))
    bottom.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=7)
    note(top, "(a)")
    note(bottom, "(b)", "lower right")
    return fig
