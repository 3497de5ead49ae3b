"""The textile's measured bending law, its secant, and what either says about the snap."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import note
from stripfold.draw.colours import BLACK, GREY, SKY
from stripfold.draw.style import figure, styled
from stripfold.strip.effects import MomentCurvature

COLOURS = {"measured": BLACK, "secant": SKY}
NAMES = {"measured": "measured law", "secant": "secant"}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) moment over curvature, with the largest curvature of each critical state, (b) lambda_c over the height.

    ``data`` is from :func:`verification.textile_law.run`.
    """
    fig = figure(4.6)
    top, bottom = fig.subplots(2, 1)
    kappa, moment = data["measured_curvature"].values, data["measured_moment"].values
    laws = {"measured": MomentCurvature(kappa, moment), "secant": MomentCurvature(kappa, kappa)}
    for name, law in laws.items():
        one, color = data.sel(law=name), COLOURS[name]
        bends = one["curvature"].values
        inside, beyond = np.linspace(0.0, kappa[-1], 200), np.linspace(kappa[-1], max(bends.max(), kappa[-1]), 20)
        top.plot(inside, law.moment(inside), color=color, lw=1.0, label=NAMES[name])
        top.plot(beyond, law.moment(beyond), color=color, ls="--", lw=1.0, label=f"_{name}-beyond")
        top.plot(bends, law.moment(bends), "|", color=color, ms=14, label=f"_{name}-critical")
        bottom.plot(data["gripper_height"], one["advance"], color=color, marker="o", label=f"snap, {NAMES[name]}")
    top.plot(kappa, moment, ".", color=BLACK, ms=4, label="measured points")
    top.plot([], [], color=BLACK, ls="--", lw=1.0, label="extrapolated")
    top.plot([], [], "|", color=GREY, ms=10, label=r"sharpest bends at $\lambda_c$")
    ends = data["leaves"].sel(law="measured")
    bottom.plot(data["gripper_height"], ends, color=BLACK, ls=":", marker="x", label="end of the measured curvatures")
    top.set(xlabel=r"curvature $\kappa L^*$", ylabel=r"moment $m\,/\,\rho_a g {L^*}^2$")
    top.set(xlim=(0.0, None), ylim=(0.0, 1.15 * laws["measured"].moment(data["curvature"].values).max()))
    bottom.set(xlabel=r"gripper height $z\,/\,L^*$", ylabel=r"advance $\lambda\,/\,L^*$", ylim=(0.0, None))
    top.legend(loc="lower right", fontsize=7)
    bottom.legend(loc="lower right", fontsize=7)
    note(top, "(a)")
    note(bottom, "(b)")
    return fig
