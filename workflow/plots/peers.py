"""Other programs on the same strip: error against time, for one equilibrium and one critical point."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from plots import models
from plots.pieces import Look, note
from stripfold.draw.colours import BLACK, ORANGE, PINK, SKY
from stripfold.draw.style import figure, legend_above, styled
from verification.peers import QUESTIONS, TITLES, runs_of

LABELS = {"equilibrium": "error of the centreline $/\\,L^*$", "critical": "error of $\\lambda_c\\,/\\,L^*$"}
PANELS = {"equilibrium": "(a) equilibrium", "critical": "(b) critical point"}
LOOKS = models.LOOKS | {
    "felupe": Look(PINK, "D"), "mujoco": Look(ORANGE, "v"), "pyelastica": Look(SKY, "P"), "auto": Look(BLACK, "X"),
}  # fmt: skip


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the error over the time of every run; ours in bold.

    ``data`` is from :func:`verification.peers.run`.
    """
    fig = figure(5.2)
    axes = fig.subplots(2, 1, sharex=True, sharey=True)
    for ax, question in zip(axes, QUESTIONS, strict=True):
        for name in data["program"].values:
            runs = runs_of(data, name, question).sortby("seconds")
            label, size = (TITLES[name], (1.0, 3.5)) if name in TITLES else (f"ours: {name}", (2.2, 5.0))
            ax.plot(runs["seconds"], runs["error"], lw=size[0], ms=size[1], label=label, **LOOKS[name]._asdict())
        ax.set(xscale="log", yscale="log", ylabel=LABELS[question])
        note(ax, PANELS[question], "upper right")
    axes[-1].set_xlabel("processor time [s]")
    legend_above(fig, axes[0].get_legend_handles_labels()[0], ncols=3, fontsize=7)
    return fig
