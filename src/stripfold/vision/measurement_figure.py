"""The curves of a measurement as a matplotlib figure."""

from __future__ import annotations

from matplotlib.figure import Figure

from stripfold.plots.colours import BLACK, GREY, RED
from stripfold.plots.style import figure, styled
from stripfold.vision.measurement import Measurement
from stripfold.vision.report_curves import onset, panels


@styled
def draw(found: Measurement) -> Figure:
    """The panels of :func:`.report_curves.panels` below each other."""
    fig, drawn, marked = figure(6.0, 7.5), panels(found), onset(found)
    for ax, panel in zip(fig.subplots(len(drawn), 1, sharex=True), drawn, strict=True):
        for t, values, colour, name in panel.lines:
            ax.plot(t, values, color=colour, label=name)
        for value, text, colour in panel.levels:
            ax.axhline(value, color=colour, linewidth=0.8, linestyle="--")
            place = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points"}
            ax.annotate(text, (0.01, value), (0, 2), fontsize=7, **place)
        if panel.dot is not None:
            ax.plot(*panel.dot, "o", color=RED, markersize=4)
        ax.set(ylabel=panel.name, ylim=panel.span)
        if panel.lines[0][3]:
            ax.legend(loc="lower left", ncols=len(panel.lines))
        if marked is not None:
            ax.axvline(marked[0], color=BLACK, linewidth=0.8)
            ax.axvspan(*marked[1:], color=GREY, alpha=0.3, linewidth=0.0)
    ax.set_xlabel("time [s]")
    return fig
