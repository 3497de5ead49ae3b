"""Other programs beside this one: error against time, for one equilibrium and one critical point."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from stripfold.plots.style import figure, look, note, styled
from studies.peers import QUESTIONS, TITLES, runs_of

LABELS = {"equilibrium": "error of the centre-line $/\\,L^*$", "critical": "error of $\\lambda_c\\,/\\,L^*$"}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the error over the time of every run; ours in bold.

    Parameters
    ----------
    data
        From :func:`studies.peers.run`.
    """
    fig = figure(5.2)
    axes = fig.subplots(2, 1, sharex=True, sharey=True)
    for ax, question, letter in zip(axes, QUESTIONS, "ab", strict=True):
        for i, name in enumerate(data["program"].values):
            runs = runs_of(data, name, question).sortby("seconds")
            how, ours = look(i), name not in TITLES
            ax.plot(
                runs["seconds"],
                runs["error"],
                color=how.colour,
                marker=how.marker,
                lw=2.2 if ours else 1.0,
                ms=5.0 if ours else 3.5,
                label=f"ours: {name}" if ours else TITLES[name],
            )
        ax.set(xscale="log", yscale="log", ylabel=LABELS[question])
        note(ax, f"({letter}) {question}", "lower left")
    axes[-1].set_xlabel("processor time [s]")
    handles, labels = axes[0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper center", ncols=3, fontsize=7)
    return fig
