"""A page about a measured recording: film, montage, curves and numbers in one HTML file."""

from __future__ import annotations

import base64
import io
import tempfile
from collections.abc import Iterator
from fractions import Fraction
from importlib.resources import files
from math import hypot, isfinite
from pathlib import Path

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
from stripfold.vision.measure import Z_95, Measurement
from stripfold.vision.threads import one_thread

WIDTH = 480
"""Largest width of the film, pixels."""
MAX_FRAMES = 900
"""Most frames of the film in the report: of a longer one every second, third, ... is shown."""
MONTAGE_TIMES = (-0.5, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.5)
"""Times from the onset in the montage, s."""
_ENCODING = {"crf": "26", "preset": "veryfast", "threads": "1", "subq": "1", "me_method": "dia", "trellis": "0"}
_RED, _BLUE = (0, 0, 212), (178, 114, 0)  # BGR


@one_thread()
def html(found: Measurement) -> str:
    """The page of a measurement."""
    text = files("stripfold.vision").joinpath("templates/report.html").read_text(encoding="utf-8")
    template = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(text)
    film, montage = _pictures(found)
    quality = [
        (name.replace("_", " "), f"{value:.4g}" if isinstance(value, float) else str(value))
        for name, value in found.calibration.quality.items()
    ]
    return template.render(
        title=found.recording.entries.title,
        synthetic=found.recording.entries.synthetic,
        result=result(found),
        manual=found.manual,
        flags=found.flags,
        rows=rows(found),
        quality=quality,
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
    return [
        ("onset of the snap", f"{found.event_time:.3f} s" if found.snapped else "-"),
        ("λ by the video alone", _millimetres(found.by_video)),
        ("λ by the robot's log", _millimetres(found.by_log)),
        *_model_rows(found),
        ("standard deviation", _millimetres(found.sd, 3)),
        *((f"  from {name}", _millimetres(value, 3)) for name, value in found.parts.items()),
        ("speed of the gripper", f"{1e3 * found.speed:.2f} mm/s"),
        ("speed of the snap over following", f"{found.motion.ratio:.1f}"),
        ("frames", str(len(found.tracks.timing.time))),
        ("visible length of the strip", _millimetres(float(np.nanmedian(found.tracks.visible_length)), 1)),
    ]


def _model_rows(found: Measurement) -> list[tuple[str, str]]:
    model = found.model
    if not isfinite(model.without_friction):
        return [("λ_c of the model", "none: the sag touches the lower layer first")]
    text = _millimetres(model.without_friction)
    if isfinite(model.low):
        text += f", 95 % interval {1e3 * model.low:.2f} to {1e3 * model.high:.2f} mm from that of eta_b"
    shown = [("λ_c of the model", text)]
    if isfinite(model.with_friction):
        shown.append(("  with the fabric's friction", f"{_millimetres(model.with_friction)}, to first order"))
    return shown


def _millimetres(value: float, digits: int = 2) -> str:
    return f"{1e3 * value:.{digits}f} mm" if isfinite(value) else "-"


@styled
def curves(found: Measurement) -> Figure:
    """Position of the gripped end, speed of the strip, and confidence over time, with the onset and its interval."""
    tracks, motion = found.tracks, found.motion
    fig = figure(6.0, 7.0)
    x, z, speed, score = fig.subplots(4, 1, sharex=True)
    x.plot(tracks.grip_time, 1e3 * tracks.gripped_end[:, 0], color=BLACK)
    x.set_ylabel("$x$ [mm]")
    z.plot(tracks.grip_time, 1e3 * tracks.gripped_end[:, 1], color=BLACK)
    z.axhline(1e3 * found.recording.entries.gripper.height, color=GREY, linewidth=0.8, linestyle="--")
    z.set_ylabel("$z$ [mm]")
    speed.plot(motion.t, 1e3 * motion.u, color=RED)
    speed.axhline(1e3 * motion.following, color=GREY, linewidth=0.8, linestyle="--")
    speed.set_ylabel("speed [mm/s]")
    score.plot(tracks.timing.time, tracks.gripper.score, color=BLUE, label="marker")
    score.plot(tracks.timing.time, tracks.score, color=RED, label="strip")
    score.set(ylabel="confidence", ylim=(0.0, 1.05), xlabel="time [s]")
    score.legend(loc="lower left", ncols=2)
    for ax in (x, z, speed, score):
        # Mathematical text takes longer than all the rest of the figure.
        ax.ticklabel_format(useMathText=False)
    if found.snapped:
        sd = hypot(*(found.parts[name] for name in ("shape", "level", "frames")))
        half = Z_95 * sd / max(found.speed, 1e-9)
        for ax in (x, z, speed, score):
            ax.axvline(found.event_time, color=BLACK, linewidth=0.8)
            ax.axvspan(found.event_time - half, found.event_time + half, color=GREY, alpha=0.3, linewidth=0.0)
    return fig


def _svg(fig: Figure) -> str:
    text = io.StringIO()
    fig.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    # Inside a page there is no XML declaration.
    return text.getvalue()[text.getvalue().index("<svg") :]


def _pictures(found: Measurement) -> tuple[str, str]:
    """The film with the detections drawn in, and the montage, both in base64."""
    times = found.tracks.timing.time
    labels = {int(np.argmin(np.abs(times - found.event_time - at))): f"{at:+.1f} s" for at in MONTAGE_TIMES}
    shown: list[Picture] = []
    every = -(-len(times) // MAX_FRAMES)
    rate = Fraction(1.0 / (found.tracks.timing.period * every)).limit_denominator(1000)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        with av.open(str(path), "w", format="mp4") as container:
            stream: VideoStream = container.add_stream("libx264", rate=rate, options=_ENCODING)
            stream.width, stream.height = _film_size(found)
            stream.pix_fmt = "yuv420p"
            for index, picture in enumerate(_annotated(found)):
                if index % every == 0:
                    planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420), dtype=np.uint8)
                    container.mux(stream.encode(av.VideoFrame.from_ndarray(planes, format="yuv420p")))
                if index in labels:
                    cv2.putText(picture, labels[index], (6, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (255, 255, 255), 1)
                    shown.append(picture)
            container.mux(stream.encode())
        film = path.read_bytes()
    shown += [np.full_like(shown[0], 255)] * (-len(shown) % 4)
    montage = np.vstack([np.hstack(shown[i : i + 4]) for i in range(0, len(shown), 4)])
    _, png = cv2.imencode(".png", montage)
    return base64.b64encode(film).decode(), base64.b64encode(png.tobytes()).decode()


def _film_size(found: Measurement) -> tuple[int, int]:
    """Width and height of the film, even as the encoder needs them."""
    width, height = found.tracks.size
    small = min(WIDTH, width) // 2 * 2
    return small, round(small * height / width / 2) * 2


def _annotated(found: Measurement) -> Iterator[Picture]:
    """Each frame in the film's size, with the strip and its gripped end."""
    tracks, mapping = found.tracks, found.calibration.mapping
    size = _film_size(found)
    scale = np.array(size) / tracks.size
    with video.read(found.recording.video, found.recording.timestamps) as frames:
        for frame in frames:
            small = cv2.resize(frame.image, size, interpolation=cv2.INTER_AREA)
            picture = np.asarray(cv2.cvtColor(small, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
            # OpenCV takes coordinates with three binary digits after the point.
            if np.isfinite(tracks.strip_time[frame.index]):
                line = np.rint(8.0 * scale * mapping.to_pixels(tracks.points[frame.index])).astype(np.int32)
                cv2.polylines(picture, [line], False, _RED, 1, cv2.LINE_AA, 3)
            x, z = np.rint(8.0 * scale * mapping.to_pixels(tracks.gripped_end[frame.index][None])[0]).astype(int)
            cv2.circle(picture, (int(x), int(z)), 32, _BLUE, 1, cv2.LINE_AA, 3)
            yield picture
