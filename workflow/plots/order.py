"""Rod and solid: error of lambda_c over the element length, and run time over the number of elements."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from plots.models import LOOKS, plain_numbers
from plots.pieces import note
from stripfold.draw.colours import GREY
from stripfold.draw.style import figure, styled


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the error over the element length, beside plain powers, (b) the time over the number of elements.

    ``data`` is from :func:`verification.order.run`.
    """
    fig = figure(4.8)
    top, bottom = fig.subplots(2, 1)
    for name in data["model"].values:
        one = data.sel(model=name)
        # Of the meshes up to the reference of the stored errors; that reference has an error of its own.
        count = 1 + int(one["error"].notnull().sum())
        size, lambda_c = one["size"].values[:count], one["lambda_c"].values
        error = np.abs(lambda_c[:count] - lambda_c[min(count + 1, len(lambda_c) - 1)])
        power = float(one["order"])
        top.plot(size, error, **LOOKS[name]._asdict(), label=name)
        line = error[-1] * (size / size[-1]) ** round(power)
        top.plot(size, line, color=LOOKS[name].color, ls=":", lw=0.8, label=f"power {power:.0f}")
        bottom.plot(one["elements"], one["seconds"], **LOOKS[name]._asdict(), label=name)
    elements, seconds = (data[name].isel(model=-1).values for name in ("elements", "seconds"))
    bottom.plot(elements, seconds[-1] * elements / elements[-1], color=GREY, ls="--", lw=0.8, label="linear")
    top.set(xlabel="element length off the floor $/\\,L^*$", ylabel=r"error of $\lambda_c\,/\,L^*$")
    bottom.set(xlabel="elements", ylabel=r"run time of one $\lambda_c$ [s]")
    note(top, f"(a) $z = {data.attrs['height_star']:g}\\,L^*$, $h = {data.attrs['thickness']:g}\\,L^*$")
    note(bottom, "(b)")
    for ax in (top, bottom):
        ax.set(xscale="log", yscale="log")
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.legend(loc="lower right", fontsize=7)
    plain_numbers(top.xaxis)
    fig.align_ylabels()
    return fig
