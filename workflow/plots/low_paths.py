"""Between which heights a low path is stable, and what it does to the part that lies."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import entry, note
from stripfold import elastica
from stripfold.draw.colours import BLACK, BLUE, GREY, SHADE, VERMILLION
from stripfold.draw.style import figure, styled
from verification.low_paths import LIMITED, STABLE, compliance

FLAT = 1.0
"""Height up to which a bump is that of a beam, L*."""
LOOKS = {STABLE: ("stable", BLUE, "."), LIMITED: ("limit point", VERMILLION, "x")}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the outcomes over height and compliance with the elastica's limit, (b) pushes over the height.

    ``data`` is from :func:`verification.low_paths.run`.
    """
    fig = figure(5.6)
    limits, forces = fig.subplots(2, 1, height_ratios=(1.3, 1.0), sharex=True)
    z, curve = data["curve_height"].values, data["curve_compliance"].values
    given = compliance(data["length"], data["thickness"]).values
    lowest = 0.7 * float(given.min())
    edge = np.append(z, elastica.touch_limit()), np.append(curve, lowest)
    limits.fill_between(*edge, lowest, color=SHADE, lw=0.0)
    limits.plot(*edge, color=BLACK, lw=1.0, label="_limit")
    height = data["height"].values
    for outcome, (_, color, marker) in LOOKS.items():
        chosen = data["rod"].values == outcome
        style = {"color": color, "marker": marker, "ls": "none", "ms": 3.5}
        limits.plot(height[chosen], given[chosen], **style, label=f"_{outcome}")
    limits.set(yscale="log", ylabel=r"compliance $c\,\rho_a g$")
    limits.set_ylim(lowest, 3.0 * float(curve.max()))
    looks = [entry(text, color, "none", marker=marker, ms=3.5) for text, color, marker in LOOKS.values()]
    limits.legend(handles=[*looks, entry("elastica on what gives", BLACK)], loc="upper right", fontsize=7)
    forces.plot(height, data["hold"].values, ".", color=BLUE, ms=3.5, label="push at the held end, rod")
    forces.plot(z, data["curve_push"].values, color=BLACK, lw=1.0, label="elastica")
    forces.plot(z, 2.75 / z**2, color=GREY, ls=":", lw=2.0, zorder=1, label=r"$2.75\,{L^*}^2/z^2$")
    bump = data["curve_bump"].values
    style = {"color": VERMILLION, "ls": "--", "lw": 1.0, "label": "height of a bump that grows"}
    forces.plot(z[bump < FLAT], bump[bump < FLAT], **style)
    forces.set(yscale="log", xlabel="gripper height $z\\,/\\,L^*$")
    forces.set_ylabel(r"push$\,/\,\rho_a g L^*$, height$\,/\,L^*$")
    forces.set(xlim=(0.25, 1.75), ylim=(0.01, 100.0))
    forces.legend(loc="lower right", fontsize=7)
    note(limits, "(a)")
    note(forces, "(b)")
    return fig
