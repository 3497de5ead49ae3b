"""One page about a measured recording: film, montage, curves, numbers; complete in one HTML file."""

from __future__ import annotations

import base64
import io
import tempfile
from collections.abc import Iterator
from fractions import Fraction
from importlib.resources import files
from math import isfinite
from pathlib import Path
from typing import Any

import av
import cv2
import jinja2
import numpy as np
from av.video.stream import VideoStream
from matplotlib.figure import Figure

import stripfold
from stripfold.arrays import Picture
from stripfold.plots.colours import BLACK, BLUE, GREY, RED
from stripfold.plots.style import figure, styled
from stripfold.store import running_commit
from stripfold.vision import video
from stripfold.vision.measure import Measurement

WIDTH = 480
"""Largest width of the film, pixels."""
MOST_FRAMES = 900
"""Most frames of the film in the report: of a longer one every second, third, ... is shown."""
MOMENTS = (-0.5, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.5)
"""Times from the onset that the montage shows, s."""
_RED, _BLUE = (0, 0, 212), (178, 114, 0)  # BGR


def html(found: Measurement) -> str:
    """The page of a measurement."""
    text = files("stripfold.vision").joinpath("templates/report.html").read_text(encoding="utf-8")
    template = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(text)
    film, montage = _pictures(found)
    return template.render(
        title=found.recording.entries["title"],
        synthetic=found.recording.entries["synthetic"],
        result=result(found),
        manual=found.manual,
        flags=found.flags,
        rows=rows(found),
        quality=[(name.replace("_", " "), _number(value)) for name, value in found.calibration.quality.items()],
        film=film,
        montage=montage,
        curves=_svg(curves(found)),
        version=stripfold.__version__,
        commit=running_commit(),
    )


def result(found: Measurement) -> str:
    """The result in one line."""
    low, high = (1e3 * value for value in found.interval)
    if not found.snapped:
        return f"No snap: λ_c is more than {1e3 * found.event:.2f} mm"
    return f"λ = {1e3 * found.event:.2f} mm at the onset of the snap, 95 % interval {low:.2f} to {high:.2f} mm"


def rows(found: Measurement) -> list[tuple[str, str]]:
    """The numbers, each with its name."""
    static = f"{1e3 * found.static.lam:.2f} ± {1e3 * found.static.sd:.2f} mm" if found.static else "out of sight"
    return [
        ("onset of the snap", f"{found.event_time:.3f} s" if found.snapped else "-"),
        ("λ by the video alone", _millimetres(found.by_video)),
        ("λ by the robot's log", _millimetres(found.by_log)),
        ("end of the quasi-static branch", static if found.snapped else "-"),
        ("standard deviation", _millimetres(found.sd, 3)),
        *((f"  from {name}", _millimetres(value, 3)) for name, value in found.parts.items()),
        ("speed of the gripper", f"{1e3 * found.speed:.2f} mm/s"),
        ("speed of the snap over following", f"{found.motion.ratio:.1f}"),
        ("frames", str(len(found.tracks.timing.time))),
        ("visible length of the strip", _millimetres(float(np.nanmedian(found.tracks.visible)), 1)),
    ]


@styled
def curves(found: Measurement) -> Figure:
    """x(t), z(t), the strip's speed with the event, the confidence per frame."""
    tracks, motion = found.tracks, found.motion
    fig = figure(6.0, 7.0)
    axes = fig.subplots(4, 1, sharex=True)
    axes[0].plot(tracks.grip_time, 1e3 * tracks.place[:, 0], color=BLACK)
    axes[0].set_ylabel("$x$ [mm]")
    axes[1].plot(tracks.grip_time, 1e3 * tracks.place[:, 1], color=BLACK)
    axes[1].axhline(1e3 * found.recording.entries["gripper"]["height"], color=GREY, linewidth=0.8, linestyle="--")
    axes[1].set_ylabel("$z$ [mm]")
    axes[2].plot(motion.t, 1e3 * motion.u, color=RED)
    axes[2].axhline(1e3 * motion.following, color=GREY, linewidth=0.8, linestyle="--")
    axes[2].set_ylabel("speed [mm/s]")
    axes[3].plot(tracks.timing.time, tracks.gripper.score, color=BLUE, label="marker")
    axes[3].plot(tracks.timing.time, tracks.score, color=RED, label="strip")
    axes[3].set(ylabel="confidence", ylim=(0.0, 1.05), xlabel="time [s]")
    axes[3].legend(loc="lower left", ncols=2)
    if found.snapped:
        half = (
            1.96
            * (found.parts["shape"] ** 2 + found.parts["level"] ** 2 + found.parts["frames"] ** 2) ** 0.5
            / max(found.speed, 1e-9)
        )
        for ax in axes:
            ax.axvline(found.event_time, color=BLACK, linewidth=0.8)
            ax.axvspan(found.event_time - half, found.event_time + half, color=GREY, alpha=0.3, linewidth=0.0)
    return fig


def _pictures(found: Measurement) -> tuple[str, str]:
    """The film with what was found, and the montage, both in base64."""
    moments = [found.event_time + at for at in MOMENTS]
    times = found.tracks.timing.time
    wanted = {int(np.argmin(np.abs(times - moment))): at for moment, at in zip(moments, MOMENTS, strict=True)}
    shown: list[Picture] = []
    every = -(-len(times) // MOST_FRAMES)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        with av.open(str(path), "w", format="mp4") as container:
            stream: VideoStream | None = None
            for index, picture in _drawn(found):
                if index in wanted:
                    label = picture.copy()
                    cv2.putText(label, f"{wanted[index]:+.1f} s", (6, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (255,) * 3, 1)
                    shown.append(label)
                if index % every:
                    continue
                if stream is None:
                    stream = _stream(container, picture, found.tracks.timing.period * every)
                frame = av.VideoFrame.from_ndarray(picture, format="bgr24")
                container.mux(stream.encode(frame))
            if stream is not None:
                container.mux(stream.encode())
        film = path.read_bytes()
    while len(shown) % 4:
        shown.append(np.full_like(shown[0], 255))
    montage = np.vstack([np.hstack(shown[i : i + 4]) for i in range(0, len(shown), 4)])
    done, png = cv2.imencode(".png", montage)
    assert done
    return base64.b64encode(film).decode(), base64.b64encode(png.tobytes()).decode()


def _stream(container: av.container.OutputContainer, picture: Picture, period: float) -> VideoStream:
    rate = Fraction(1.0 / period).limit_denominator(1000)
    stream = container.add_stream("libx264", rate=rate, options={"crf": "26", "preset": "veryfast"})
    stream.height, stream.width = picture.shape[:2]
    stream.pix_fmt = "yuv420p"
    return stream


def _drawn(found: Measurement) -> Iterator[tuple[int, Picture]]:
    """Each frame with the strip and its gripped end drawn in, as small as the film shall be; sizes are even."""
    tracks, mapping = found.tracks, found.calibration.mapping
    path = found.recording.file("video")
    assert path is not None
    width = min(WIDTH, tracks.size[0]) // 2 * 2
    height = round(width * tracks.size[1] / tracks.size[0] / 2) * 2
    scale = np.array([width / tracks.size[0], height / tracks.size[1]])
    with video.read(path, found.recording.file("timestamps")) as frames:
        for frame in frames:
            small = cv2.resize(frame.image, (width, height), interpolation=cv2.INTER_AREA)
            picture = cv2.cvtColor(small, cv2.COLOR_GRAY2BGR)
            if np.isfinite(tracks.strip_time[frame.index]):
                line = mapping.to_pixels(tracks.points[frame.index]) * scale
                cv2.polylines(picture, [np.rint(line * 8).astype(np.int32)], False, _RED, 1, cv2.LINE_AA, 3)
            end = mapping.to_pixels(tracks.place[frame.index][None])[0] * scale
            cv2.circle(picture, tuple(int(v) for v in np.rint(end * 8)), 32, _BLUE, 1, cv2.LINE_AA, 3)
            yield frame.index, np.asarray(picture, dtype=np.uint8)


def _svg(fig: Figure) -> str:
    text = io.StringIO()
    fig.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    # The page is one document: a declaration may only stand at its beginning.
    return text.getvalue()[text.getvalue().index("<svg") :]


def _millimetres(value: float, digits: int = 2) -> str:
    return f"{1e3 * value:.{digits}f} mm" if isfinite(value) else "-"


def _number(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
