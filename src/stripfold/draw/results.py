"""Figures of single results, for their ``plot()``: arrays in, a figure out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from stripfold.base.arrays import Array
from stripfold.draw.colours import CRITICAL, GRIPPER, SETTLED, STATIC
from stripfold.draw.style import CM, around, equal_panels, legend_above, styled


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
