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
    fig = figure(2.6)
    left, right = fig.subplots(1, 2)
    kappa, moment = data["measured_curvature"].values, data["measured_moment"].values
    laws = {"measured": MomentCurvature(kappa, moment), "secant": MomentCurvature(kappa, kappa)}
    for name, law in laws.items():
        one, color = data.sel(law=name), COLOURS[name]
        bends = one["curvature"].values
        inside, beyond = np.linspace(0.0, kappa[-1], 200), np.linspace(kappa[-1], max(bends.max(), kappa[-1]), 20)
        left.plot(inside, law.moment(inside), color=color, lw=1.0, label=NAMES[name])
        left.plot(beyond, law.moment(beyond), color=color, ls="--", lw=1.0, label=f"_{name}-beyond")
        left.plot(bends, law.moment(bends), "|", color=color, ms=9, label=f"_{name}-critical")
        right.plot(
            data["gripper_height"], one["advance"], color=color, marker="o", label=rf"$\lambda_c$, {NAMES[name]}"
        )
    left.plot(kappa, moment, ".", color=BLACK, ms=4, label="_rows")
    left.plot([], [], "|", color=GREY, ms=9, label="critical states")
    left.plot([], [], color=GREY, ls="--", lw=1.0, label="not measured")
    ends = data["leaves"].sel(law="measured")
    right.plot(data["gripper_height"], ends, color=BLACK, ls=":", marker="x", label="measured range ends")
    left.set(xlabel=r"curvature $\kappa L^*$", ylabel=r"moment $m\,/\,\rho_a g {L^*}^2$", xlim=(0.0, None))
    left.set_ylim(0.0, 1.5 * laws["measured"].moment(data["curvature"].values).max())
    right.set(xlabel="gripper height $z\\,/\\,L^*$", ylabel=r"advance $\lambda\,/\,L^*$")
    # Room for the legend above what is drawn.
    right.set_ylim(0.0, 1.5 * float(data["advance"].max()))
    left.legend(loc="lower right", fontsize=7)
    right.legend(loc="upper right", fontsize=7)
    note(left, "(a)")
    note(right, "(b)", "lower right")
    return fig
