"""Films of a strip: statics quickly, the fall in real time or slowed down, statics again; H.264 in MP4."""

from __future__ import annotations

import os
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import numpy as np
import xarray as xr
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc, VideoReformatter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.base.progress import AFTER, BEFORE, FALL, SLOW, Percent
from stripfold.draw.collapse_curve import Followed, collapse
from stripfold.draw.colours import BLACK, FALLING, GREY, GRIPPER, SETTLED
from stripfold.draw.style import CM, around, draw_held_end, equal_panels, styled
from stripfold.files.store import atomic, literal

FPS = 30
"""Frames per second."""
STATIC_SECONDS = 8.0
"""Duration of the static parts together, s."""
DPI = 360
"""Dots per inch: a frame is 1260 dots wide."""
SLOWDOWNS = (1, 2, 5, 10, 20, 50, 100)
"""Seconds of the film per second of the fall, to choose from."""
LEAST_SECONDS = 3.0
"""Least duration of the fall's motion in the film, s."""
STILL, HASTE = 0.3, 5.0
"""Mean speed over the largest in a fall below which it is shown faster, and how many times faster: the slow start and
the coming to rest."""
# Constant quality.  The number of threads changes the file, and so does what a processor's fastest code reads beside
# the picture, a little differently from run to run.
_ENCODER = {"crf": "18", "preset": "veryfast", "threads": "1", "x264-params": "cpu-independent=1"}
# The index in front, to play before all is loaded; neither date nor version.
_CONTAINER = {"movflags": "+faststart", "fflags": "+bitexact"}

Frame = NDArray[np.uint8]
Progress = Callable[[str], None]


def slowdown_of(found: Followed) -> float:
    """The first of :data:`SLOWDOWNS` with which the fall's motion lasts :data:`LEAST_SECONDS`, or the last."""
    still = _still(found)
    moves = (found.phase[1:] == FALL) & (found.phase[:-1] == FALL) & ~still
    if not moves.any():
        return SLOWDOWNS[0]
    lasts = float(np.diff(found.time)[moves].sum())
    return next((one for one in SLOWDOWNS if one * lasts >= LEAST_SECONDS), SLOWDOWNS[-1])


def clock(found: Followed, slowdown: float) -> Array:
    """Time of each state in the film, s: the fall at one rate, its still parts faster, statics by the gripper's way."""
    same = found.phase[1:] == found.phase[:-1]
    falling = same & (found.phase[1:] == FALL)
    way = np.where(same & ~falling, np.abs(np.diff(found.advance)), 0.0)
    rate = slowdown / np.where(_still(found), HASTE, 1.0)
    seconds = np.where(falling, rate * np.diff(found.time), STATIC_SECONDS * way / max(way.sum(), 1e-300))
    return np.concatenate([[0.0], np.cumsum(seconds)])


def _still(found: Followed) -> NDArray[np.bool_]:
    """Whether the strip hardly moves from each state to the next in a fall, shape (m - 1,)."""
    moved = np.sqrt(np.mean(np.sum(np.diff(found.states, axis=0) ** 2, axis=2), axis=1))
    falling = (found.phase[1:] == FALL) & (found.phase[:-1] == FALL)
    lasts = np.where(falling, np.diff(found.time), np.inf)
    speed = np.where(lasts > 0.0, moved / np.where(lasts > 0.0, lasts, 1.0), 0.0)
    return falling & (speed < STILL * speed.max())


def frames(times: Array) -> Array:
    """Position of each frame among the states, which are shown at ``times``, s; the last one is the last state."""
    count = int(np.ceil(times[-1] * FPS - 1e-9)) + 1
    return np.interp(np.arange(count) / FPS, times, np.arange(len(times)))


def film(data: xr.Dataset, path: str | os.PathLike[str], *, progress: Progress | None = None) -> Path:
    """Draw a collapse as a film: :func:`draw`.

    ``data``: from :func:`stripfold.ask.collapse.run`; ``path``, ``progress``: as there.

    Raises InvalidInputError:
    other data, or another suffix.
    """
    return draw(collapse(data), path, "𝜆 =", progress=progress)


@styled
def draw(found: Followed, path: str | os.PathLike[str], way: str, *, progress: Progress | None = None) -> Path:
    """Draw a strip frame by frame into an MP4 file that browsers play, atomically.

    The same data give the same bytes with the same versions of the libraries.

    ``found``: the states.  ``path``: output file with the suffix .mp4.  Missing folders are made.  ``way``: what the
    way of the gripper is called.  ``progress``: called with a line on how much is done.  Raises InvalidInputError:
    another suffix.
    """
    path = Path(path)
    if path.suffix.lower() != ".mp4":
        raise InvalidInputError("film", os.fspath(path), "a file name with the suffix .mp4")
    slowdown = slowdown_of(found)
    shown = frames(clock(found, slowdown))
    with atomic(path) as temporary, av.open(literal(temporary), "w", format="mp4", options=_CONTAINER) as container:
        stage = _Stage(found, slowdown, way)
        stream = container.add_stream("libx264", rate=FPS, options=_ENCODER)
        stream.width, stream.height = stage.size
        stream.pix_fmt = "yuv420p"
        # The colours of HDTV, which players otherwise have to guess.
        context = stream.codec_context
        context.time_base = Fraction(1, FPS)
        context.colorspace, context.color_range = Colorspace.ITU709, ColorRange.MPEG
        context.color_primaries, context.color_trc = ColorPrimaries.BT709, ColorTrc.BT709
        reformatter = VideoReformatter()
        # One frame at a time: memory does not grow with the length of the film.
        for i, position in enumerate(Percent(progress, "drawing").each(shown, len(shown))):
            picture = reformatter.reformat(
                av.VideoFrame.from_numpy_buffer(stage.frame(float(position)), format="rgba"),
                format="yuv420p",
                dst_colorspace=Colorspace.ITU709,
                dst_color_range=ColorRange.MPEG,
            )
            picture.pts, picture.time_base = i, Fraction(1, FPS)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path


_LOOKS = {BEFORE: (BLACK, "static"), FALL: (FALLING, "fall"), AFTER: (SETTLED, "static"), SLOW: (BLACK, "slow")}


class _Stage:
    """A figure whose background is drawn once; only the strip, the gripper and the texts are drawn for each frame."""

    def __init__(self, found: Followed, slowdown: float, way: str) -> None:
        self.found, self.slowdown, self.way = found, slowdown, way
        self.still = _still(found)
        fig, (ax,) = equal_panels([around(CM * found.states)], above=0.3)
        fig.set_dpi(DPI)
        # An even number of dots for the encoder.
        fig.set_figheight(2 * round(0.5 * DPI * fig.get_figheight()) / DPI)
        self.canvas = FigureCanvasAgg(fig)
        self.size = self.canvas.get_width_height()
        ax.plot(*(CM * found.states[:, 0]).T, color=GRIPPER, lw=0.6, ls=":")
        draw_held_end(ax, found.states[0, -1])
        position = ax.get_position()
        line = 0.5 * (1.0 + position.y1)
        self.said = fig.text(position.x0, line, "", va="center", animated=True)
        self.position = fig.text(position.x1, line, "", va="center", ha="right", animated=True)
        # The start of the fall stays, to compare with.
        (self.critical,) = ax.plot(*(CM * found.states[found.critical]).T, color=GREY, lw=0.8, animated=True, zorder=3)
        (self.strip,) = ax.plot([], [], lw=1.2, animated=True, zorder=4)
        (self.gripper,) = ax.plot([], [], "o", color=GRIPPER, ms=4, animated=True, zorder=5)
        self.canvas.draw()
        self.background = self.canvas.copy_from_bbox(fig.bbox)  # type: ignore[no-untyped-call]

    def frame(self, position: float) -> Frame:
        """The picture at a position among the states, linear in between: red, green, blue, alpha; the canvas's own."""
        found = self.found
        before = min(int(position), len(found.states) - 2)
        share = position - before

        def between(values: Array) -> Array:
            return np.asarray((1.0 - share) * values[before] + share * values[before + 1])

        phase = str(found.phase[before + 1])
        colour, text = _LOOKS[phase]
        state = CM * between(found.states)
        self.strip.set_data(*state.T)
        self.strip.set_color(colour)
        self.gripper.set_data(*state[:1].T)
        self.critical.set_visible(phase == FALL)
        if phase == FALL:
            pace = _pace(self.slowdown / (HASTE if self.still[before] else 1.0))
            text = f"{text}, {pace}: 𝑡 = {float(between(found.time)):.2f} s"
        self.said.set_text(text)
        self.said.set_color(colour)
        # Letters in italics: parsing mathematics in the text took longer than drawing the frame.
        self.position.set_text(f"{self.way} {CM * float(between(found.advance)):.1f} cm")
        self.canvas.restore_region(self.background)  # type: ignore[attr-defined]
        for artist in (self.critical, self.strip, self.gripper, self.said, self.position):
            self.canvas.figure.draw_artist(artist)
        return cast(Frame, np.asarray(self.canvas.buffer_rgba()))


def _pace(slowdown: float) -> str:
    if slowdown < 1.0:
        return f"{1.0 / slowdown:g} times as fast"
    return "real time" if slowdown == 1.0 else f"slowed down {slowdown:g} times"
