"""Paths of the gripper in recordings, and the points on them where the strips snapped."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import entry, note, speed_mark
from plots.readers import recordings
from stripfold.draw.colours import BLACK, CRITICAL, GRIPPER
from stripfold.draw.style import CM, MILLI, figure, styled


@styled
def draw(data: xr.Dataset, frames: xr.Dataset) -> Figure:
    """Draw frames of one film; the gripper's way in each recording, the onset of the snap on it, the model's boundary.

    ``data`` is the table of measured recordings, over ``recording``; ``frames`` from :func:`tasks.recordings.frames`.
    """
    groups = list(recordings(data))
    speeds = np.unique(np.round(data["speed"].values, 4))
    columns = min(len(groups), 2)
    rows = -(-len(groups) // columns)
    fig = figure(1.9 + 1.9 * rows)
    film, below = fig.subfigures(2, 1, squeeze=False, height_ratios=(1.3, 0.6 + 1.9 * rows)).ravel()
    film.suptitle(str(frames.attrs["recording"]), fontsize=8)
    first, _, last = frames["instant"].values
    titles = (f"{first:+.1f} s", "onset of the snap", f"{last:+.1f} s")
    for ax, image, title in zip(film.subplots(1, 3), frames["frame"].values, titles, strict=True):
        ax.imshow(image, cmap="gray", vmin=0, vmax=255)
        ax.set_axis_off()
        ax.set_title(title, fontsize=8, loc="center")
    axes = below.subplots(rows, columns, squeeze=False).ravel()
    for ax, (eta, look, part) in zip(axes, groups, strict=False):
        for track in part["track"].values:
            ax.plot(*(CM * track).T, color=GRIPPER, lw=0.8)
        for i, speed in enumerate(speeds):
            some = part.isel(recording=(np.round(part["speed"].values, 4) == speed) & (part["snapped"].values == 1.0))
            options = {"marker": look.marker, "color": look.color, **speed_mark(i, look.color)}
            ax.plot(CM * some["lambda_event"], CM * some["gripper_height"], ls="none", **options)
        z, first = np.unique(part["gripper_height"].values, return_index=True)
        ax.plot(CM * part["lambda_model"].values[first], CM * z, ":", color=CRITICAL)
        ax.set(xlabel=r"$\lambda$ [cm]", ylabel="$z$ [cm]")
        ax.margins(y=0.2)
        note(ax, rf"$\eta_b$ = {eta:.5g} m$^{{-4}}$ s$^2$")
    for ax in axes[len(groups) :]:
        ax.set_visible(False)
    handles = [entry("gripper, by the video", GRIPPER, lw=0.8), entry(r"$\lambda_c$ without friction", CRITICAL, ":")]
    for i, speed in enumerate(speeds):
        text = f"onset of the snap at {MILLI * speed:.2g} mm/s"
        handles.append(entry(text, BLACK, "none", marker="o", **speed_mark(i, BLACK)))
    origin = "synthetic recordings" if np.all(data["synthetic"].values == 1.0) else None
    below.legend(handles=handles, loc="outside upper center", ncols=2, title=origin)
    return fig
