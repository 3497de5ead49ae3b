"""The sheet with the plates and the markers for the gripper, to be printed at its own size."""

from __future__ import annotations

from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from stripfold.base.arrays import Array
from stripfold.draw.style import MILLI, styled
from stripfold.film.boards import Board, black_cells
from stripfold.film.plate import CARD, FOOT, GRIPPERS, LONG, MARGIN, SIDE

Paper = Literal["a4", "letter"]
PAPERS = {"a4": (297.0, 210.0), "letter": (279.4, 215.9)}
"""Width and height of a sheet on its side, mm."""
INCH, EDGE, GAP = 25.4, 8.0, 6.0
"""mm; from the paper's edge, where printers do not reach, and between the parts."""
LINE = 100.0
"""Length of the line to check the print with, mm."""
RIM = 1.0 / 6.0
"""White around a marker, over its side."""
STEPS = (
    "Print at 100 %, without fitting to the page; check the line. Glue it on stiff board, cut along the grey lines.",
    "Film: the long plate stands on the table on its lower edge, beside the cloth's held end and in the plane of its",
    "     near edge; a square marker sticks on the gripper, above the cloth's end, in the same plane. Phone steady, on",
    "     its side, a metre away, plate and fold wholly in view. Press record while the strip lies flat, gripped;",
    "     lift it, pull steadily at 1 to 4 mm/s, let it snap.",
    "     stripfold measure FILM.mp4 --length 0.45  (--plate-width 0.24: of the ten squares, as a ruler says)",
)
PHOTOGRAPH = (
    "Photograph: the card stands beside the fold, or below a strip that",
    "     hangs, in the plane of its near edge.",
    "     stripfold eta --image PHOTO.jpg --method fold --width 0.03",
)


@styled
def sheet(paper: Paper = "a4") -> Figure:
    """Draw the sheet."""
    width, height = PAPERS[paper]
    fig = Figure(figsize=(width / INCH, height / INCH))
    ax = fig.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set(xlim=(0.0, width), ylim=(0.0, height))
    ax.set_axis_off()
    long, card = (_size(board) for board in (LONG, CARD))
    left, low = 0.5 * (width - long[0]), EDGE
    _board(ax, LONG, left, low)
    low += long[1] + GAP
    _board(ax, CARD, left, low)
    across = left + card[0] + GAP
    for number in GRIPPERS:
        _marker(ax, number, across, low)
        across += MILLI * SIDE * (1.0 + 2.0 * RIM) + GAP
    top, right = height - EDGE, width - left
    for x, steps in ((left, STEPS), (right - LINE, PHOTOGRAPH)):
        ax.text(x, top - 7.0, "\n".join(steps), fontsize=7.5, va="top", linespacing=1.2)
    ax.text(left, top, "stripfold: plate for films and photographs", fontsize=12, va="top")
    ends = right - LINE, right
    ax.plot(ends, (top - 4.0, top - 4.0), color="black", lw=0.6, solid_capstyle="butt")
    for end in ends:
        ax.plot((end, end), (top - 6.0, top - 2.0), color="black", lw=0.6)
    ax.text(right - 0.5 * LINE, top - 3.0, f"{LINE:g} mm", ha="center", fontsize=8)
    return fig


def _size(board: Board) -> Array:
    """Of a plate that is cut out, mm."""
    side = MILLI * board.square
    return side * np.array([board.columns + 2.0 * MARGIN, board.rows + FOOT + MARGIN])


def _cut(ax: Axes, left: float, low: float, width: float, height: float) -> None:
    ax.add_patch(Rectangle((left, low), width, height, fill=False, ec="0.6", lw=0.4))


def _board(ax: Axes, board: Board, left: float, low: float) -> None:
    """Draw a plate whose lower left corner, cut out, is at a place, mm."""
    _cut(ax, left, low, *_size(board))
    side = MILLI * board.square
    x, top = left + MARGIN * side, low + (FOOT + board.rows) * side
    places = MILLI * board.black
    squares = [Rectangle((x + across, top - down - size), size, size) for across, down, size in places]
    ax.add_collection(PatchCollection(squares, fc="black", ec="none", antialiased=False))


def _marker(ax: Axes, number: int, left: float, low: float) -> None:
    side = MILLI * SIDE
    rim = RIM * side
    _cut(ax, left, low, side + 2.0 * rim, side + 2.0 * rim)
    cells = black_cells(str(LONG.dictionary), number)
    size, top = side / len(cells), low + rim + side
    squares = [
        Rectangle((left + rim + j * size, top - (i + 1) * size), size, size)
        for i, j in zip(*np.nonzero(cells), strict=True)
    ]
    ax.add_collection(PatchCollection(squares, fc="black", ec="none", antialiased=False))
