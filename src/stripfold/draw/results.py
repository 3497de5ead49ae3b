"""Figures of single results, for their ``plot()``: arrays in, a figure out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from stripfold.base.arrays import Array
from stripfold.draw.colours import BLACK, CRITICAL, GREY, GRIPPER, PINK, SETTLED, SKY, STATIC, TOUCHING
from stripfold.draw.style import CM, around, equal_panels, figure, legend_above, styled

ETA_B_STYLES = ((SKY, "--"), (BLACK, "-"), (PINK, ":"))
"""Colours and kinds of line of the least, the given and the largest eta_b."""


@styled
def draw_strip(
    states: Sequence[Array], path: Array | None = None, marks: Array | None = None, fallen: Sequence[Array] = ()
) -> Figure:
    """Draw states of a strip, grey and the last one black, those after a fall green, with the path of the gripper.

    ``states``, ``fallen``: mid-surfaces, shape (n, 2) each, m; may be none.  ``path``: places of the gripper, shape
    (k, 2), m.  ``marks``: critical places on the path, shape (j, 2), m.
    """
    drawn = [*states, *fallen, *([path] if path is not None else [])]
    fig, (ax,) = equal_panels([around(CM * np.vstack(drawn))], above=0.42 if path is not None else 0.0)
    for group, colour, last, name in (
        (states, STATIC, CRITICAL, "before a fall" if len(fallen) else ""),
        (fallen, SETTLED, SETTLED, "after it"),
    ):
        for i, state in enumerate(group):
            is_last = i == len(group) - 1
            label = f"last state {name}".rstrip() if is_last else "_state"
            ax.plot(*(CM * state.T), color=last if is_last else colour, lw=1.4 if is_last else 0.7, label=label)
    if path is None:
        return fig
    ax.plot(*(CM * path.T), color=GRIPPER, ls="--", lw=1.0, label="gripper")
    if marks is not None and len(marks):
        ax.plot(*(CM * np.asarray(marks).T), "x", color=GRIPPER, mew=1.4, zorder=4, label="critical point")
    legend_above(fig, ax.get_legend_handles_labels()[0], fontsize=7)
    return fig


@styled
def draw_along(waypoints: Array, distances: Array, names: Sequence[str], asked: float | None) -> Figure:
    """Draw the distance from snap boundaries, the height and the rotation of the gripper over time.

    ``waypoints``: time, x, z and rotation, shape (n, 4), s, m and degrees.  ``distances``: from the boundaries of the
    strips of :data:`ETA_B_STYLES`, shape (3, n), m, and their ``names``.  ``asked``: the margin asked for, if any, m.
    """
    t, _, z, angle = waypoints.T
    fig = figure(4.2)
    margin, height, rotation = fig.subplots(3, 1, sharex=True)
    for name, distance, (colour, line) in zip(names, distances, ETA_B_STYLES, strict=True):
        margin.plot(t, CM * distance, line, color=colour, label=name)
    if asked is not None:
        margin.axhline(CM * asked, color=GREY, lw=0.8, ls="--", label="asked")
    margin.axhline(0.0, color=TOUCHING, lw=0.8)
    margin.set_ylabel("from the snap [cm]")
    margin.legend(title=r"$\eta_b$ [m$^{-4}$ s$^2$]", fontsize=7, title_fontsize=7)
    height.plot(t, CM * z, color=GRIPPER)
    height.set_ylabel("$z$ [cm]")
    rotation.plot(t, angle, color=GRIPPER)
    rotation.set(ylabel="angle [degree]", xlabel="time [s]")
    return fig
