"""The centreline of a textile in its authors' photograph, their midline, and the stiffness from each.

The photograph belongs to P. H. Broberg et al. (Composites Part B, 2023, 110763; repository bendstiff, MIT licence):
a caption has to say so.  It is not part of the project, so this figure is in no table and drawn by hand only.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import ETA_TITLE
from stripfold.arrays import Picture
from stripfold.plots.colours import BLUE, GREEN, GREY, MID_SURFACE, ORANGE
from stripfold.plots.style import MILLI, figure, styled
from stripfold.vision.eta_figure import draw_picture

SOURCE = "photograph: Broberg et al. 2023, bendstiff, MIT"


@styled
def draw(data: xr.Dataset, image: Picture, scale: float) -> Figure:
    """Draw the photograph with both lines, the distance between them, and eta_b over the curvature.

    Parameters
    ----------
    data
        From :func:`studies.centrelines.run`.
    image
        The textile's photograph, grey values, shape (h, w).
    scale
        Its metres per pixel.
    """
    fig = figure(5.4)
    above, middle, below = fig.subplots(3, 1, height_ratios=(2.2, 1.0, 1.6))
    line = MILLI * np.array([data["x"], -data["z"]])
    reference = MILLI * np.array([data["reference_x"], -data["reference_z"]])
    draw_picture(above, image, MILLI * scale)
    above.plot(*line, color=MID_SURFACE, lw=1.0, label="centreline")
    above.plot(*reference, "o", color=GREEN, ms=1.6, mew=0.0, label="authors' midline")
    above.text(0.02, 0.03, SOURCE, color="white", size=7.0, transform=above.transAxes)
    distance = MILLI * data["reference_distance"].values
    middle.fill_between(line[0], -2 * MILLI * data["sd"], 2 * MILLI * data["sd"], color=GREY, alpha=0.4, lw=0.0)
    middle.plot(reference[0][: len(distance)], distance, "o-", color=GREEN, ms=1.6, lw=0.7, label="_distance")
    middle.axhline(0.0, color=MID_SURFACE, lw=0.8)
    middle.set(xlabel="mm", ylabel="distance [mm]", xlim=above.get_xlim())
    kappa = data["share"] * data["largest_curvature"]
    below.loglog(data["reference_curvature"], data["reference_eta_b"], color=GREEN, label="authors' law, secant")
    below.loglog(kappa, data["secant_eta_b"], color=ORANGE, label=r"fit of $M \sim \kappa^n$, secant")
    below.axhspan(float(data["eta_b_lower"]), float(data["eta_b_upper"]), color=BLUE, alpha=0.25, lw=0.0)
    below.axhline(float(data["eta_b"]), color=BLUE, lw=1.0, label="linear strip, 95 %")
    below.set(xlabel="curvature [m$^{-1}$]", ylabel=ETA_TITLE)
    above.legend(loc="upper right")
    below.legend(loc="upper left")
    return fig
