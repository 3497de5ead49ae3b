"""The centreline of a textile in its authors' photograph, their midline, and what stiffness each of them tells.

The photograph belongs to P. H. Broberg et al. (Composites Part B, 2023, 110763; repository bendstiff, MIT licence):
a caption has to say so.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stripfold.plots.materials import ETA_TITLE
from stripfold.plots.style import BLUE, GREEN, GREY, RED, WIDTH, styled

MM = 1000.0
"""Millimetres in a metre."""
COARSE = 4
"""Every which pixel of the photograph is drawn."""
SOURCE = "photograph: Broberg et al. 2023, bendstiff, MIT"


@styled
def draw(data: xr.Dataset, image: NDArray[np.uint8], scale: float) -> Figure:
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
    fig = Figure(figsize=(WIDTH, 5.4), layout="constrained")
    above, middle, below = fig.subplots(3, 1, height_ratios=(2.2, 1.0, 1.6))
    h, w = image.shape
    extent = (-0.5 * scale * MM, (w - 0.5) * scale * MM, -(h - 0.5) * scale * MM, 0.5 * scale * MM)
    above.imshow(image[::COARSE, ::COARSE], cmap="gray", extent=extent, alpha=0.75)
    above.grid(False)
    line, reference = MM * np.array([data["x"], data["z"]]), MM * np.array([data["reference_x"], data["reference_z"]])
    above.plot(*line, color=RED, lw=1.0, label="centreline")
    above.plot(*reference, "o", color=GREEN, ms=1.6, mew=0.0, label="authors' midline")
    above.set(xlabel="mm", ylabel="mm", xlim=extent[:2], ylim=extent[2:])
    above.text(0.02, 0.03, SOURCE, color="white", size=7.0, transform=above.transAxes)
    beside = MM * data["reference_distance"].values
    covered = reference[0][: len(beside)]
    middle.fill_between(line[0], -2 * MM * data["sd"], 2 * MM * data["sd"], color=GREY, alpha=0.4, lw=0.0)
    middle.plot(covered, beside, "o-", color=GREEN, ms=1.6, lw=0.7, label="_distance")
    middle.axhline(0.0, color=RED, lw=0.8)
    middle.set(xlabel="mm", ylabel="distance / mm", xlim=extent[:2])
    kappa = data["share"] * data["largest_curvature"]
    below.loglog(data["reference_curvature"], data["reference_eta_b"], color=GREEN, label="authors' law, secant")
    below.loglog(kappa, data["secant_eta_b"], color=BLUE, label=r"fit of $M \sim \kappa^n$, secant")
    low, high = float(data["eta_b_lower"]), float(data["eta_b_upper"])
    below.axhspan(low, high, color=RED, alpha=0.25, lw=0.0, label="_interval")
    below.axhline(float(data["eta_b"]), color=RED, lw=1.0, label="linear strip, 95 %")
    below.set(xlabel="curvature / m$^{-1}$", ylabel=ETA_TITLE)
    for ax, columns in ((above, 1), (below, 1)):
        ax.legend(loc="upper right" if ax is above else "upper left", ncols=columns)
    return fig
