"""A page about a measured recording: numbers with their meaning, film, montage and curves in one HTML file."""

from __future__ import annotations

import base64
import io
from fractions import Fraction
from math import hypot, isfinite
from typing import Any, NamedTuple

import av
import cv2
import numpy as np
from av.video.stream import VideoStream
from matplotlib.figure import Figure

from stripfold.base.arrays import Array, Index, Picture
from stripfold.base.errors import MeasurementError
from stripfold.draw import save
from stripfold.draw.colours import BLACK, BLUE, GREY, RED
from stripfold.draw.style import MILLI, styled
from stripfold.film import calibration, snap
from stripfold.film.calibration import MAX_PLANE_RMS, MAX_SCALE_ERROR, MAX_SIDE_ERROR
from stripfold.film.measure import RecordingMeasurement
from stripfold.film.pictures import one_thread
from stripfold.film.recording import half_width

WIDTH, TILE = 480, 400
"""Largest width of the film, and width of a frame in the montage, pixels."""
MONTAGE_TIMES = (-0.5, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.5)
"""Times from the onset in the montage, s; stretched for a slow snap, so that the last but one shows its peak."""
MARGIN = 0.08
"""Room around the strip in the montage, as a share of its width."""
_ENCODING = {"crf": "26", "preset": "veryfast", "threads": "1", "subq": "1", "me_method": "dia", "trellis": "0"}
_RED, _BLUE = (0, 0, 212), (178, 114, 0)  # BGR

Box = tuple[int, int, int, int]
"""Left, top, right, bottom, pixels."""


class Entry(NamedTuple):
    """A number of the calibration: what it is, the unit that it is shown in, its factor from SI, and its pass mark."""

    words: str
    unit: str = ""
    factor: float = 1.0
    mark: str = ""


CALIBRATION = {
    "camera_from": Entry("camera from"),
    "camera_uncertainty": Entry("uncertainty of the camera"),
    "camera_views": Entry("views of the board", mark=f"at least {calibration.MIN_VIEWS}"),
    "camera_coverage": Entry("covered by them", "% of the picture", 100.0, f"at least {calibration.MIN_COVERAGE:.0%}"),
    "camera_rms": Entry("reprojection error", "px", 1.0, f"at most {calibration.MAX_RMS:g} px"),
    "camera_worst_view_rms": Entry(
        "  of the worst view", "px", 1.0, f"at most {calibration.OUTLIER:g} times the median"
    ),
    "camera_split_half": Entry("difference of two halves of the views", "mm", 1e3),
    "camera_inflation": Entry("factor on its uncertainty, from their scatter"),
    "plate_rms": Entry("corners of the plate off a plane", "px"),
    "plane_rms": Entry("corners off the folding plane", "px", 1.0, f"at most {MAX_PLANE_RMS:g} px"),
    "resolution": Entry("size of a pixel there", "mm", 1e3),
    "stops": Entry("stops of the robot", mark=f"at least {calibration.MIN_STOPS}"),
    "robot_rms": Entry("their distance from the fit", "mm", 1e3),
    "robot_left_out_rms": Entry(
        "  from the fit to the others", "mm", 1e3, f"each at most {1e3 * calibration.MAX_STOP_ERROR:g} mm"
    ),
    "robot_scale": Entry("metre of the board in the robot's", "m", 1.0, f"1 m within {MAX_SCALE_ERROR:.0%}"),
    "marker_side": Entry("marker's side over the described one", mark=f"1 within {MAX_SIDE_ERROR:.0%} and its blur"),
}
PARTS = {
    "level": "speeds at the peak and while following",
    "frames": "time between frames",
    "mapping": "calibration",
    "camera": "motion of the camera since the calibration",
    "gripper": "noise of the marker or template",
    "clock": "synchronisation of the clocks",
    "flat_end": "flat_end as described",
    "offset": "offset as described",
    "manual": "onset set by hand",
}
"""Causes of uncertainty in words."""


@one_thread()
def html(found: RecordingMeasurement) -> str:
    """The page of a measurement."""
    from stripfold.draw.save import as_svg

    return save.html(
        "report.html",
        title=found.recording.entries.title,
        synthetic=found.recording.entries.synthetic,
        snapped=found.snapped,
        result=result(found),
        manual=found.manual,
        flags=found.flags,
        rows=rows(found),
        calibration=calibration_rows(found.calibration.quality),
        pictures=pictures(found),
        curves=as_svg(figure_of(found)),
    )


def result(found: RecordingMeasurement) -> str:
    """The result in one line."""
    low, high = (1e3 * value for value in found.interval)
    if not found.snapped:
        return f"No snap: λ_c is more than {1e3 * found.event:.2f} mm"
    event = f"λ = {1e3 * found.event:.2f} mm at the onset of the snap, friction and lag included"
    return f"{event}, 95 % interval {low:.2f} to {high:.2f} mm"


def rows(found: RecordingMeasurement) -> list[tuple[str, str]]:
    """The numbers, each with its name."""
    deviations = [
        ("standard deviation", _millimetres(found.sd, 3)),
        *((f"  from {PARTS.get(name, name)}", _millimetres(value, 3)) for name, value in found.parts.items()),
    ]
    return [
        ("onset of the snap", f"{found.event_time:.3f} s" if found.snapped else "-"),
        ("λ by the video alone", _millimetres(found.by_video)),
        ("λ by the robot's log", _millimetres(found.by_log)),
        *_model_rows(found),
        *_eta_b_rows(found),
        *(deviations if found.sd > 0.0 else []),
        ("speed of the gripper", f"{1e3 * found.speed:.2f} mm/s"),
        ("speed of the snap over following", f"{found.motion.ratio:.1f}"),
        ("frames", str(len(found.tracks.timing.time))),
        ("visible length of the strip", _millimetres(float(np.nanmedian(found.tracks.visible_length)), 1)),
    ]


def _model_rows(found: RecordingMeasurement) -> list[tuple[str, str]]:
    model = found.model
    if not isfinite(model.without_friction):
        unknown = found.calibration.relative and isinstance(found.eta_b, MeasurementError)
        why = "no eta_b is known" if unknown else "the sag touches the lower layer first"
        return [("λ_c of the model", f"none: {why}")]
    text = f"{_millimetres(model.without_friction)} without friction"
    if isfinite(model.low):
        text += f", 95 % interval {1e3 * model.low:.2f} to {1e3 * model.high:.2f} mm from that of eta_b"
    shown = [("λ_c of the model", text)]
    if isfinite(model.with_friction):
        shown.append(("  with the fabric's friction", f"{_millimetres(model.with_friction)}, to first order"))
    return shown


def _eta_b_rows(found: RecordingMeasurement) -> list[tuple[str, str]]:
    eta_b = found.eta_b
    if isinstance(eta_b, MeasurementError):
        return [("eta_b by the motion", f"none: {eta_b.found}")]
    described = found.recording.entries.strip.eta_b
    text = f"{eta_b.eta_b:.4g} m^-4 s^2, 95 % interval {eta_b.low:.4g} to {eta_b.high:.4g}"
    if described != eta_b.eta_b:  # else it was not known, and is this one
        text += f", described {described:.4g}"
    friction = f"M_0 = {eta_b.friction:.2g} rho_a g L*^2, {'as described' if eta_b.known else 'fitted beside it'}"
    pulled = [
        (f"{pull.name} by the shapes", f"{1e3 * pull.off:+.1f} mm from the given one, SD {_millimetres(pull.sd, 1)}")
        for pull in eta_b.pulls
    ]
    return [("eta_b by the motion", text), ("  with friction", friction), *pulled]


def _millimetres(value: float, digits: int = 2) -> str:
    return f"{1e3 * value:.{digits}f} mm" if isfinite(value) else "-"


def calibration_rows(quality: dict[str, Any]) -> list[tuple[str, str, str]]:
    """What the calibration's numbers are, with their units, and from where on they are refused."""
    known = [name for name in CALIBRATION if name in quality]
    shown = []
    for name in (*known, *(name for name in quality if name not in CALIBRATION)):
        entry, value = CALIBRATION.get(name, Entry(name.replace("_", " "))), quality[name]
        text = f"{entry.factor * value:.4g}" if isinstance(value, float) else str(value)
        shown.append((entry.words, f"{text} {entry.unit}".strip(), entry.mark))
    return shown


@styled
def figure_of(found: RecordingMeasurement) -> Figure:
    """lambda, height of the gripped end, speed of the strip with the onset's level, and confidence over time."""
    tracks, motion, gripper = found.tracks, found.motion, found.recording.entries.gripper
    fig = Figure(figsize=(7.5, 6.0))
    # Placed by hand: to arrange them takes a twentieth of the time of measuring a film.
    placed = {"left": 0.09, "right": 0.985, "bottom": 0.075, "top": 0.985, "hspace": 0.1}
    advance, height, speed, confidence = axes = fig.subplots(4, 1, sharex=True, gridspec_kw=placed)
    fig.align_ylabels(axes)
    advance.margins(y=0.12)
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


class Pictures(NamedTuple):
    """In base64: the film, mp4; its frame at the onset, and frames around it with their times in words, JPEG."""

    film: str
    poster: str
    montage: list[tuple[str, str]]


def pictures(found: RecordingMeasurement) -> Pictures:
    """The film and the frames around the onset, with the strip and its gripped end drawn in."""
    kept = found.tracks.thumbnails
    frames = np.arange(0, len(found.tracks.timing.time), kept.every)
    times = found.tracks.timing.time[frames] - found.event_time
    peak = found.motion.t[found.motion.peak] - found.event_time
    asked = max(1.0, peak / MONTAGE_TIMES[-2]) * np.array(MONTAGE_TIMES)
    chosen = sorted({int(np.argmin(np.abs(times - at))) for at in asked})
    onset = int(np.argmin(np.abs(times)))
    box, montage, poster = _strip_box(found, frames[chosen]), [], ""
    tile = TILE, round(TILE * (box[3] - box[1]) / (box[2] - box[0]))
    whole, size = (0, 0, *kept.size), _film_size(*kept.size)
    rate = Fraction(1.0 / (found.tracks.timing.period * kept.every)).limit_denominator(1000)
    film = io.BytesIO()
    with av.open(film, "w", format="mp4") as container:
        stream: VideoStream = container.add_stream("libx264", rate=rate, options=_ENCODING)
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        for k, (frame, small) in enumerate(zip(frames.tolist(), kept.pictures, strict=True)):
            picture = _annotated(found, frame, small, whole, size)
            planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420), dtype=np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(planes, format="yuv420p")))
            if k == onset:
                poster = _jpeg(picture)
            if k in chosen:
                montage.append((f"{times[k]:+.2f} s", _jpeg(_annotated(found, frame, small, box, tile))))
        container.mux(stream.encode())
    return Pictures(base64.b64encode(film.getvalue()).decode(), poster, montage)


def _film_size(width: int, height: int) -> tuple[int, int]:
    """Width and height of the film, even as the encoder needs them."""
    small = min(WIDTH, width) // 2 * 2
    return small, round(small * height / width / 2) * 2


def _strip_box(found: RecordingMeasurement, chosen: Index) -> Box:
    """What to show of the small frames: the strip in all that are chosen, with some room."""
    tracks, size = found.tracks, found.tracks.thumbnails.size
    points = np.concatenate([tracks.points[chosen].reshape(-1, 2), tracks.gripped_end[chosen]])
    pixels = _small(found, points[np.isfinite(points).all(axis=1)])
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    room = MARGIN * (high[0] - low[0])
    left, top = np.maximum(low - room, 0.0).astype(int)
    right, bottom = np.minimum(high + room, size).astype(int)
    return int(left), int(top), max(int(right), int(left) + 2), max(int(bottom), int(top) + 2)


def _small(found: RecordingMeasurement, points: Array) -> Array:
    """Pixels of the small frames where points, shape (n, 2), m, are."""
    scale = np.array(found.tracks.thumbnails.size) / found.tracks.size
    return scale * (found.calibration.mapping.to_pixels(points) + 0.5) - 0.5


def _annotated(found: RecordingMeasurement, frame: int, small: Picture, box: Box, size: tuple[int, int]) -> Picture:
    """A part of a small frame in another size, with the strip and its gripped end."""
    tracks = found.tracks
    left, top, right, bottom = box
    part = cv2.resize(small[top:bottom, left:right], size, interpolation=cv2.INTER_LINEAR)
    picture = np.asarray(cv2.cvtColor(part, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    scale = np.array(size) / (right - left, bottom - top)

    def places(points: Array) -> Array:
        # OpenCV takes coordinates with three binary digits after the point.
        return np.rint(8.0 * (scale * (_small(found, points) - (left, top) + 0.5) - 0.5)).astype(np.int32)

    if np.isfinite(tracks.strip_time[frame]):
        cv2.polylines(picture, [places(tracks.points[frame])], False, _RED, 1, cv2.LINE_AA, 3)
    x, z = places(tracks.gripped_end[frame][None])[0]
    cv2.circle(picture, (int(x), int(z)), 32, _BLUE, 1, cv2.LINE_AA, 3)
    return picture


def _jpeg(picture: Picture) -> str:
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 85])
    return base64.b64encode(data.tobytes()).decode()
