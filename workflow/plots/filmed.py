"""Recordings: lambda measured in them, and the paths of their grippers."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import ETA_TITLE, entry, note, speed_mark
from plots.readers import recordings
from stripfold.draw.colours import BLACK, CRITICAL, GRIPPER
from stripfold.draw.style import CM, MILLI, figure, legend_above, styled

LINES = ("-", "--")
"""Kinds of the lines below, of the slowest gripper and of others."""


@styled
def draw_measured(data: xr.Dataset) -> Figure:
    """Draw the model's lambda_c as lines and the measured values as marks, small for the slowest gripper.

    Below is the distance of each value from the line with its 95 % interval: friction and the speed of the gripper make
    the strip snap later.

    ``data`` is the table of measured recordings, over ``recording``.
    """
    fig = figure(5.8)
    top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.6))
    speeds = np.unique(np.round(data["speed"].values, 4))
    handles = []
    for eta, look, part in recordings(data):
        z, first = np.unique(part["gripper_height"].values, return_index=True)
        top.plot(CM * z, CM * part["lambda_model"].values[first], color=look.color, lw=1.0)
        for i, speed in enumerate(speeds):
            some = part.isel(recording=(np.round(part["speed"].values, 4) == speed) & (part["snapped"].values == 1.0))
            names = ("gripper_height", "lambda_event", "lambda_low", "lambda_high", "lambda_model")
            z, event, low, high, model = (CM * some[name].values for name in names)
            options = {"marker": look.marker, "color": look.color, **speed_mark(i, look.color)}
            top.plot(z, event, ls="none", **options)
            interval = [event - low, high - event]
            bottom.errorbar(z, event - model, interval, ls=LINES[i > 0], lw=0.7, capsize=1.5, **options)
        handles.append(entry(f"{eta:.5g}", look.color, marker=look.marker, ms=3.5, lw=1.0))
    bottom.axhline(0.0, color=BLACK, lw=0.8)
    top.set(ylabel=r"$\lambda$ [cm]", xlim=(0.0, None), ylim=(0.0, None))
    bottom.set(ylabel=r"$\lambda - \lambda_c$ [cm]", xlabel="gripper height $z$ [cm]")
    for i, speed in enumerate(speeds):
        options = {"marker": "o", "lw": 0.7, **speed_mark(i, BLACK)}
        handles.append(entry(f"{MILLI * speed:.2g} mm/s", BLACK, LINES[i > 0], **options))
    legend_above(fig, handles, ncols=3, title=f"{ETA_TITLE} and speed of the gripper")
    if np.all(data["synthetic"].values == 1.0):
        note(top, "synthetic recordings; lines: $\\lambda_c$ without friction")
    note(bottom, "measured less $\\lambda_c$; bars: 95 % intervals")
    return fig


@styled
def draw_real_paths(data: xr.Dataset, frames: xr.Dataset) -> Figure:
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
