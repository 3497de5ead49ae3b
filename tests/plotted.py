"""What figures show: their lines, colours and texts; states of made-up datasets found again in them."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.legend import Legend

Part = Figure | Axes


def named(part: Part, name: str) -> list[Artist]:
    """Artists with this name as their id, or as a label that no legend shows."""
    return part.findobj(lambda artist: artist.get_gid() == name or artist.get_label() == f"_{name}")


def drawn(part: Part, name: str) -> np.ndarray:
    """Lines of this name, shape (lines, points, 2)."""
    return np.array([np.asarray(line.get_data()).T for line in named(part, name)])


def colours(part: Part, name: str) -> set[str]:
    return {to_hex(line.get_color()).upper() for line in named(part, name)}


def labelled(ax: Axes, label: str) -> np.ndarray:
    """The one line that a legend calls so, shape (points, 2)."""
    (line,) = [line for line in ax.lines if line.get_label() == label]
    return np.asarray(line.get_data()).T


def legend_texts(part: Part) -> list[str]:
    return [text.get_text() for legend in part.findobj(Legend) for text in legend.get_texts()]


def notes(ax: Axes) -> list[str]:
    return [artist.txt.get_text() for artist in ax.artists if hasattr(artist, "txt")]


def states_of(data: xr.Dataset) -> np.ndarray:
    """Shape (states, nodes, 2), cm."""
    return 100.0 * np.stack([data["x"].values, data["z"].values], axis=-1)


def indices_of(data: xr.Dataset, shown: np.ndarray, last: bool = False) -> list[int]:
    """The states of the dataset that are shown; of those that look the same the first or the last."""
    states = states_of(data)
    found = [np.flatnonzero(np.abs(states - one).max(axis=(1, 2)) < 1e-9) for one in shown]
    return [int(same[-1 if last else 0]) for same in found]


def lines(ax: Axes, style: str) -> list[np.ndarray]:
    """Lines of more than one point with this style, shape (points, 2) each."""
    return [line.get_xydata() for line in ax.lines if line.get_linestyle() == style and len(line.get_xdata()) > 1]
