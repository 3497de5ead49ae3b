"""The pictures of a report: the film with what was detected, frames around the snap, and curves over time."""

from __future__ import annotations

import base64
import tempfile
from fractions import Fraction
from math import hypot
from pathlib import Path
from typing import NamedTuple

import av
import cv2
import numpy as np
from av.video.stream import VideoStream
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stripfold.arrays import Picture
from stripfold.plots.colours import BLACK, BLUE, GREY, RED
from stripfold.plots.style import figure, styled
from stripfold.vision import snap, video
from stripfold.vision.measure import Measurement, half_width
from stripfold.vision.video import Frame

WIDTH, TILE = 480, 400
"""Largest width of the film, and width of a frame in the montage, pixels."""
MAX_FRAMES = 900
"""Most frames of the film in the report: of a longer one every second, third, ... is shown."""
MONTAGE_TIMES = (-0.5, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.5)
"""Times from the onset in the montage, s."""
MARGIN = 0.08
"""Room around the strip in the montage, as a share of its width."""
_ENCODING = {"crf": "26", "preset": "veryfast", "threads": "1", "subq": "1", "me_method": "dia", "trellis": "0"}
_RED, _BLUE = (0, 0, 212), (178, 114, 0)  # BGR

Box = tuple[int, int, int, int]
"""Left, top, right, bottom, pixels."""


class Pictures(NamedTuple):
    """In base64: the film, mp4; its frame at the onset, and frames around it with their times in words, JPEG."""

    film: str
    poster: str
    montage: list[tuple[str, str]]


def pictures(found: Measurement) -> Pictures:
    """The film and the frames around the onset, with the strip and its gripped end drawn in; the film is read once."""
    times = found.tracks.timing.time
    chosen = sorted({int(np.argmin(np.abs(times - found.event_time - at))) for at in MONTAGE_TIMES})
    onset = int(np.argmin(np.abs(times - found.event_time)))
    box, montage, poster = _strip_box(found, chosen), [], ""
    width, height = found.tracks.size
    whole, size = (0, 0, width, height), _film_size(width, height)
    every = -(-len(times) // MAX_FRAMES)
    rate = Fraction(1.0 / (found.tracks.timing.period * every)).limit_denominator(1000)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        with (
            av.open(str(path), "w", format="mp4") as container,
            video.read(found.recording.video, found.recording.timestamps) as frames,
        ):
            stream: VideoStream = container.add_stream("libx264", rate=rate, options=_ENCODING)
            stream.width, stream.height = size
            stream.pix_fmt = "yuv420p"
            for frame in frames:
                if frame.index == onset:
                    poster = _jpeg(_annotated(found, frame, whole, size))
                if frame.index % every == 0:
                    picture = _annotated(found, frame, whole, size)
                    planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420), dtype=np.uint8)
                    container.mux(stream.encode(av.VideoFrame.from_ndarray(planes, format="yuv420p")))
                if frame.index in chosen:
                    tile = (TILE, round(TILE * (box[3] - box[1]) / (box[2] - box[0])))
                    label = f"{times[frame.index] - found.event_time:+.2f} s"
                    montage.append((label, _jpeg(_annotated(found, frame, box, tile))))
            container.mux(stream.encode())
        film = path.read_bytes()
    return Pictures(base64.b64encode(film).decode(), poster, montage)


def _film_size(width: int, height: int) -> tuple[int, int]:
    """Width and height of the film, even as the encoder needs them."""
    small = min(WIDTH, width) // 2 * 2
    return small, round(small * height / width / 2) * 2


def _strip_box(found: Measurement, chosen: list[int]) -> Box:
    """What to show of the frames: the strip in all of them, with some room."""
    tracks, mapping = found.tracks, found.calibration.mapping
    points = np.concatenate([tracks.points[chosen].reshape(-1, 2), tracks.gripped_end[chosen]])
    pixels = mapping.to_pixels(points[np.isfinite(points).all(axis=1)])
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    room = MARGIN * (high[0] - low[0])
    left, top = np.maximum(low - room, 0.0).astype(int)
    right, bottom = np.minimum(high + room, tracks.size).astype(int)
    return int(left), int(top), max(int(right), int(left) + 2), max(int(bottom), int(top) + 2)


def _annotated(found: Measurement, frame: Frame, box: Box, size: tuple[int, int]) -> Picture:
    """A part of a frame in another size, with the strip and its gripped end."""
    tracks, mapping = found.tracks, found.calibration.mapping
    left, top, right, bottom = box
    small = cv2.resize(frame.image[top:bottom, left:right], size, interpolation=cv2.INTER_AREA)
    picture = np.asarray(cv2.cvtColor(small, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    scale = np.array(size) / (right - left, bottom - top)

    def places(points: np.ndarray) -> np.ndarray:
        # OpenCV takes coordinates with three binary digits after the point.
        return np.rint(8.0 * scale * (mapping.to_pixels(points) - (left, top))).astype(np.int32)

    if np.isfinite(tracks.strip_time[frame.index]):
        cv2.polylines(picture, [places(tracks.points[frame.index])], False, _RED, 1, cv2.LINE_AA, 3)
    x, z = places(tracks.gripped_end[frame.index][None])[0]
    cv2.circle(picture, (int(x), int(z)), 32, _BLUE, 1, cv2.LINE_AA, 3)
    return picture


def _jpeg(picture: Picture) -> str:
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 85])
    return base64.b64encode(data.tobytes()).decode()


@styled
def curves(found: Measurement) -> Figure:
    """lambda, height of the gripped end, speed of the strip with the onset's level, and confidence over time."""
    tracks, motion, entries = found.tracks, found.motion, found.recording.entries
    fig = figure(6.0, 7.5)
    axes = lam, z, speed, score = fig.subplots(4, 1, sharex=True)
    advance = entries.gripper.direction * (tracks.gripped_end[:, 0] - entries.gripper.flat_end)
    lam.plot(tracks.grip_time, 1e3 * advance, color=BLACK)
    lam.set_ylabel(r"$\lambda$ [mm]")
    if found.snapped:
        _level(lam, 1e3 * found.event, f"{1e3 * found.event:.2f} mm", BLACK)
    z.plot(tracks.grip_time, 1e3 * tracks.gripped_end[:, 1], color=BLACK)
    z.set_ylabel("$z$ [mm]")
    z.margins(y=0.2)
    _level(z, 1e3 * entries.gripper.height, "as described", GREY)
    speed.plot(motion.t, 1e3 * motion.u, color=RED)
    speed.set_ylabel("speed [mm/s]")
    _level(speed, 1e3 * motion.following, "following the gripper", GREY)
    if found.snapped and not found.manual:
        _level(speed, 1e3 * motion.level(snap.LEVEL), "level of the onset", BLACK)
        speed.plot(motion.t[motion.peak], 1e3 * motion.u[motion.peak], "o", color=RED, markersize=4)
    score.plot(tracks.timing.time, tracks.gripper.score, color=BLUE, label="marker")
    score.plot(tracks.timing.time, tracks.score, color=RED, label="strip")
    score.set(ylabel="confidence", ylim=(0.0, 1.05), xlabel="time [s]")
    score.legend(loc="lower left", ncols=2)
    for ax in axes:
        # Mathematical text takes longer than all the rest of the figure.
        ax.ticklabel_format(useMathText=False, useOffset=False)
    if found.snapped:
        sd = hypot(*(found.parts[name] for name in ("level", "frames", "manual")))
        half = half_width(0.95) * sd / max(found.speed, 1e-9)
        for ax in axes:
            ax.axvline(found.event_time, color=BLACK, linewidth=0.8)
            ax.axvspan(found.event_time - half, found.event_time + half, color=GREY, alpha=0.3, linewidth=0.0)
    return fig


def _level(ax: Axes, value: float, text: str, color: str) -> None:
    """A horizontal line with its meaning at its left end."""
    ax.axhline(value, color=color, linewidth=0.8, linestyle="--")
    ax.annotate(text, (0.01, value), (0, 2), xycoords=("axes fraction", "data"), textcoords="offset points", fontsize=7)
