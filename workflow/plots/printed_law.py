"""The paper's printed law applied to a rotated strip, beside the objective law."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from plots.pieces import note
from stripfold.draw.colours import BLACK, VERMILLION
from stripfold.draw.style import figure, legend_above, styled, text_at

_SVK = r"$\mathbf{S} = \mathbf{C}:\mathbf{E}$"
_PRINTED = r"$\mathbf{S} = \det\mathbf{F}\,\mathbf{F}^{-1}(\mathbf{C}:\mathbf{E})\,\mathbf{F}^{-\top}$"
_LAWS = (
    ("svk", f"{_SVK} (St Venant-Kirchhoff, used here)", BLACK, "-"),
    ("printed", f"{_PRINTED} (as printed)", VERMILLION, "--"),
)
_PLACES = {0.0: ((4, -5), "left", "top"), 45.0: ((5, 0), "left", "bottom"), 90.0: ((-5, 5), "right", "bottom")}
"""Offset and alignment of the number beside the point at an angle."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw stress (a) and bending stiffness (b) over the angle of rotation, for both laws.

    ``data`` is from :func:`verification.printed_law.run`.
    """
    fig = figure(4.2)
    axes = top, bottom = fig.subplots(2, 1, sharex=True)
    marked = data.sel(angle=list(_PLACES), method="nearest")
    for ax, quantity in zip(axes, ("stress", "stiffness"), strict=True):
        for name, label, colour, line in _LAWS:
            ax.plot(data["angle"], data[f"{quantity}_{name}"], line, color=colour, label=label if ax is top else None)
        values = marked[f"{quantity}_printed"]
        ax.plot(values["angle"], values, "o", color=VERMILLION, clip_on=False)
        ax.set_ylim(0.0, 1.32 * float(values.max()))
    for one, (offset, ha, va) in zip(marked["stress_printed"], _PLACES.values(), strict=True):
        text = f"{float(one):.4f}" if one > 1e-9 else "0"
        text_at(top, (float(one["angle"]), float(one)), text, offset, ha=ha, va=va, color=VERMILLION)
    percent = 100.0 * (float(data.attrs["stretch"]) - 1.0)
    note(top, f"(a) bar stretched by {percent:.0f} %, then rotated")
    note(bottom, "(b) unstretched strip, rotated")
    top.set_ylabel(r"stress $S_{11}\,/\,E$")
    bottom.set(xlabel=r"angle of rotation $\varphi$ [deg]", ylabel=r"bending stiffness $/\,D$", xlim=(0.0, 90.0))
    bottom.xaxis.set_major_locator(MultipleLocator(15.0))
    legend_above(fig, ncols=1)
    fig.align_ylabels()
    return fig
