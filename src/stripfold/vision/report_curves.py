"""The curves of a measurement over time, and their drawing in a report: SVG, without the import of a plotting library.

The same :func:`panels` are what :mod:`stripfold.vision.measurement_figure` plots.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np

from stripfold.arrays import Array
from stripfold.plots.colours import BLACK, BLUE, GREY, RED
from stripfold.vision import snap
from stripfold.vision.measurement import Measurement, half_width

MARGIN = 0.05
"""Room above and below the curves of a panel, as a share of their range."""
_WIDTH, _HEIGHT, _LEFT, _GAP = 640, 130, 62, 14
"""Width of the drawing, height of a panel, room to the left of the panels and between them, pixels."""
_TICKS = 5
"""Most ticks along an axis."""


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over time.

    Attributes
    ----------
    name
        Of the vertical axis, with its unit.
    lines
        Times, s, values, colour and name of each curve.
    levels
        Value, meaning and colour of each horizontal line.
    dot
        Time and value of a point; None where there is none.
    limits
        Of the vertical axis; None for those of the curves and levels.
    margin
        Room above and below them, as a share of their range.
    """

    name: str
    lines: tuple[tuple[Array, Array, str, str], ...]
    levels: tuple[tuple[float, str, str], ...] = ()
    dot: tuple[float, float] | None = None
    limits: tuple[float, float] | None = None
    margin: float = MARGIN

    @property
    def span(self) -> tuple[float, float]:
        """Ends of the vertical axis."""
        if self.limits is not None:
            return self.limits
        values = np.concatenate([*(line[1] for line in self.lines), [level[0] for level in self.levels]])
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        room = self.margin * (high - low) or 0.5
        return low - room, high + room


def panels(found: Measurement) -> tuple[Panel, ...]:
    """lambda, height of the gripped end, speed of the strip with the onset's level, and confidence."""
    tracks, motion, gripper = found.tracks, found.motion, found.recording.entries.gripper
    advance, z = gripper.direction * (tracks.gripped_end[:, 0] - gripper.flat_end), tracks.gripped_end[:, 1]
    event = ((1e3 * found.event, f"{1e3 * found.event:.2f} mm", BLACK),) if found.snapped else ()
    levels, dot = [(1e3 * motion.following, "following the gripper", GREY)], None
    if found.snapped and not found.manual:
        levels.append((1e3 * motion.level(snap.LEVEL), "level of the onset", BLACK))
        dot = (float(motion.t[motion.peak]), 1e3 * float(motion.u[motion.peak]))
    described = ((1e3 * gripper.height, "as described", GREY),)
    scores = (tracks.gripper.score, BLUE, "marker"), (tracks.score, RED, "strip")
    return (
        Panel("λ [mm]", ((tracks.grip_time, 1e3 * advance, BLACK, ""),), event),
        Panel("z [mm]", ((tracks.grip_time, 1e3 * z, BLACK, ""),), described, margin=0.2),
        Panel("speed [mm/s]", ((motion.t, 1e3 * motion.u, RED, ""),), tuple(levels), dot),
        Panel("confidence", tuple((tracks.timing.time, *score) for score in scores), limits=(0.0, 1.05)),
    )


def onset(found: Measurement) -> tuple[float, float, float] | None:
    """Time of the onset and the ends of its 95 % interval, s; None without a snap."""
    if not found.snapped:
        return None
    sd = hypot(*(found.parts[name] for name in ("level", "frames", "manual")))
    half = half_width(0.95) * sd / max(found.speed, 1e-9)
    return found.event_time, found.event_time - half, found.event_time + half


def svg(found: Measurement) -> str:
    """The panels below each other."""
    drawn = panels(found)
    times = [line[0] for panel in drawn for line in panel.lines]
    start, end = float(min(t[0] for t in times)), float(max(t[-1] for t in times))
    right, bottom = _WIDTH - 8.0, len(drawn) * (_HEIGHT + _GAP)
    scale = (right - _LEFT) / (end - start)
    marked = onset(found)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {bottom + 30}" width="{_WIDTH}"'
        ' font-family="sans-serif" font-size="11" fill="none" stroke-linejoin="round">'
    ]
    for k, panel in enumerate(drawn):
        parts += _panel(panel, k * (_HEIGHT + _GAP) + _GAP, start, scale, right, marked)
    for t in _ticks(start, end):
        parts.append(_text(_LEFT + scale * (t - start), bottom + 14.0, f"{t:g}", "middle"))
    parts += [_text(0.5 * (_LEFT + right), bottom + 28.0, "time [s]", "middle"), "</svg>"]
    return "\n".join(parts)


def _panel(
    panel: Panel, top: float, start: float, scale: float, right: float, marked: tuple[float, float, float] | None
) -> list[str]:
    """The elements of a panel whose upper edge is at ``top``, its curves clipped by a nested drawing."""
    low, high = panel.span
    up, end = _HEIGHT / (high - low), start + (right - _LEFT) / scale
    parts = [_text(12.0, top + 0.5 * _HEIGHT, panel.name, "middle", f' transform="rotate(-90 12 {top + 65:g})"')]
    parts += [_text(_LEFT - 5.0, top + up * (high - y) + 4.0, f"{y:g}", "end") for y in _ticks(low, high)]
    parts.append(f'<svg x="{_LEFT}" y="{top}" width="{right - _LEFT:g}" height="{_HEIGHT}">')
    grid = "".join(f"M{scale * (t - start):.1f} 0V{_HEIGHT}" for t in _ticks(start, end))
    grid += "".join(f"M0 {up * (high - y):.1f}H{right:g}" for y in _ticks(low, high))
    parts.append(f'<path d="{grid}" stroke="#e4e4e4"/>')
    if marked is not None:
        at, before, after = (scale * (t - start) for t in marked)
        parts.append(
            f'<rect x="{before:.2f}" width="{after - before:.2f}" height="{_HEIGHT}" fill="{GREY}" opacity=".3"/>'
            f'<path d="M{at:.2f} 0V{_HEIGHT}" stroke="{BLACK}" stroke-width=".8"/>'
        )
    for value, text, colour in panel.levels:
        y = up * (high - value)
        parts.append(f'<path d="M0 {y:.1f}H{right:g}" stroke="{colour}" stroke-width=".8" stroke-dasharray="4 2"/>')
        parts.append(_text(4.0, y - 3.0 if y > 14.0 else y + 11.0, text, "start"))
    for k, (t, values, colour, name) in enumerate(panel.lines):
        seen = np.isfinite(values)
        places = np.column_stack([scale * (t[seen] - start), up * (high - values[seen])])
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in places.tolist())
        parts.append(f'<polyline points="{points}" stroke="{colour}" stroke-width="1.2"/>')
        if name:
            parts.append(_text(8.0 + 60.0 * k, _HEIGHT - 8.0, name, "start", f' style="fill:{colour}"'))
    if panel.dot is not None:
        parts.append(f'<circle cx="{scale * (panel.dot[0] - start):.1f}" cy="{up * (high - panel.dot[1]):.1f}" r="3"')
        parts[-1] += f' fill="{RED}"/>'
    return [*parts, f'<rect width="{right - _LEFT:g}" height="{_HEIGHT}" stroke="{BLACK}"/>', "</svg>"]


def _ticks(low: float, high: float) -> list[float]:
    """Round numbers between two."""
    decade = 10.0 ** np.floor(np.log10((high - low) / _TICKS))
    step = next(step for step in (decade, 2.0 * decade, 5.0 * decade, 10.0 * decade) if (high - low) / step <= _TICKS)
    return [float(f"{k * step:.12g}") for k in range(int(np.ceil(low / step)), int(np.floor(high / step)) + 1)]


def _text(x: float, y: float, text: str, anchor: str, more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{BLACK}"{more}>{text}</text>'
