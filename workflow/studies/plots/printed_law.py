"""What the paper's printed law does to a rotated strip, beside the objective law."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from stripfold.plots.style import BLACK, VERMILLION, figure, note, styled

_SVK = r"$\mathbf{S} = \mathbf{C}:\mathbf{E}$"
_PRINTED = r"$\mathbf{S} = \det\mathbf{F}\,\mathbf{F}^{-1}(\mathbf{C}:\mathbf{E})\,\mathbf{F}^{-\top}$"
_LAWS = (
    ("svk", f"{_SVK} (St Venant-Kirchhoff, used here)", BLACK, "-"),
    ("printed", f"{_PRINTED} (as printed)", VERMILLION, "--"),
)


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw stress (a) and bending stiffness (b) over the angle of rotation, for both laws.

    Parameters
    ----------
    data
        From :func:`studies.printed_law.run`.
    """
    fig = figure(4.2)
    top, bottom = fig.subplots(2, 1, sharex=True)
    for name, label, colour, line in _LAWS:
        top.plot(data["angle"], data[f"stress_{name}"], line, color=colour, label=label)
        bottom.plot(data["angle"], data[f"stiffness_{name}"], line, color=colour)
    marked = data[["stress_printed", "stiffness_printed"]].sel(angle=[0.0, 45.0, 90.0], method="nearest")
    for ax, values in ((top, marked["stress_printed"]), (bottom, marked["stiffness_printed"])):
        ax.plot(values["angle"], values, "o", color=VERMILLION, clip_on=False)
        ax.set_ylim(0.0, 1.32 * float(values.max()))
    places = (((4, -5), "left", "top"), ((5, 0), "left", "bottom"), ((-5, 5), "right", "bottom"))
    for place, (offset, ha, va) in zip(marked["angle"].values, places, strict=True):
        value = float(marked["stress_printed"].sel(angle=place))
        text = f"{value:.4f}" if value > 1e-9 else "0"
        at = (place, value)
        top.annotate(text, at, offset, textcoords="offset points", ha=ha, va=va, color=VERMILLION)
    percent = 100.0 * (float(data.attrs["stretch"]) - 1.0)
    note(top, f"(a) bar stretched by {percent:.0f} %, then rotated")
    note(bottom, "(b) unstretched strip, rotated")
    top.set_ylabel(r"stress $S_{11}\,/\,E$")
    bottom.set(xlabel=r"angle of rotation $\varphi$ [deg]", ylabel=r"bending stiffness $/\,D$")
    bottom.set_xlim(0.0, 90.0)
    bottom.xaxis.set_major_locator(MultipleLocator(15.0))
    fig.legend(loc="outside upper center")
    fig.align_ylabels()
    return fig
