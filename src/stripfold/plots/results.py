"""Figures of single results, for their ``plot()``: arrays in, a figure out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from stripfold.arrays import Array
from stripfold.plots.colours import CRITICAL, GRIPPER, STATIC
from stripfold.plots.style import CM, around, equal_panels, styled


@styled
def draw_strip(states: Sequence[Array], path: Array | None = None, marks: Array | None = None) -> Figure:
    """States of a strip, grey and the last one black, with the path of the gripper.

    ``states``: mid-surfaces, shape (n, 2) each, m; may be none.  ``path``: places of the gripper, shape (k, 2), m.
    ``marks``: places on the path to be marked, shape (j, 2), m.
    """
    drawn = [*states, *([path] if path is not None else [])]
    fig, (ax,) = equal_panels([around(CM * np.vstack(drawn))])
    for i, state in enumerate(states):
        last = i == len(states) - 1
        ax.plot(*(CM * state.T), color=CRITICAL if last else STATIC, lw=1.4 if last else 0.7)
    if path is not None:
        ax.plot(*(CM * path.T), color=GRIPPER, ls="--", lw=1.0)
    if marks is not None and len(marks):
        ax.plot(*(CM * np.asarray(marks).T), "x", color=GRIPPER, mew=1.4, zorder=4)
    return fig
