"""The curves of a measurement over time."""

from __future__ import annotations

from math import hypot

from matplotlib.figure import Figure

from stripfold.draw.colours import BLACK, BLUE, GREY, RED
from stripfold.draw.style import MILLI, figure, styled
from stripfold.film import snap
from stripfold.film.measurement import Measurement, half_width


@styled
def draw(found: Measurement) -> Figure:
    """lambda, height of the gripped end, speed of the strip with the onset's level, and confidence over time."""
    tracks, motion, gripper = found.tracks, found.motion, found.recording.entries.gripper
    fig = figure(6.0, 7.5)
    advance, height, speed, confidence = axes = fig.subplots(4, 1, sharex=True)
    x, z = tracks.gripped_end.T
    advance.plot(tracks.grip_time, MILLI * gripper.direction * (x - gripper.flat_end), color=BLACK)
    height.plot(tracks.grip_time, MILLI * z, color=BLACK)
    speed.plot(motion.t, MILLI * motion.u, color=RED)
    confidence.plot(tracks.timing.time, tracks.gripper.score, color=BLUE, label="gripper")
    confidence.plot(tracks.timing.time, tracks.score, color=RED, label="strip")
    confidence.legend(loc="lower left", ncols=2)
    levels = [
        (height, MILLI * gripper.height, "as described", GREY),
        (speed, MILLI * motion.following, "following the gripper", GREY),
    ]
    if found.snapped:
        levels.append((advance, MILLI * found.event, f"{MILLI * found.event:.2f} mm", BLACK))
        sd = hypot(*(found.parts[name] for name in ("level", "frames", "manual")))
        half = half_width(0.95) * sd / max(found.speed, 1e-9)
        for ax in axes:
            ax.axvline(found.event_time, color=BLACK, linewidth=0.8)
            ax.axvspan(found.event_time - half, found.event_time + half, color=GREY, alpha=0.3, linewidth=0.0)
        if not found.manual:
            levels.append((speed, MILLI * motion.level(snap.LEVEL), "level of the onset", BLACK))
            speed.plot(motion.t[motion.peak], MILLI * motion.u[motion.peak], "o", color=RED, markersize=4)
    for ax, value, text, colour in levels:
        ax.axhline(value, color=colour, linewidth=0.8, linestyle="--")
        place = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points"}
        ax.annotate(text, (0.01, value), (0, 2), fontsize=7, **place)
    for ax, name in zip(axes, ("λ [mm]", "z [mm]", "speed [mm/s]", "confidence"), strict=True):
        ax.set_ylabel(name)
    confidence.set(ylim=(0.0, 1.05), xlabel="time [s]")
    return fig
