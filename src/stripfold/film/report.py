"""A page about a measured recording: numbers with their meaning, film, montage and curves in one HTML file."""

from __future__ import annotations

from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from stripfold.base.errors import MeasurementError
from stripfold.draw import page
from stripfold.film import calibration
from stripfold.film.calibration import MAX_PLANE_RMS, MAX_SCALE_ERROR, MAX_SIDE_ERROR
from stripfold.film.measurement import Measurement
from stripfold.film.pictures import one_thread
from stripfold.film.report_pictures import pictures


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
    "level": "height of the speed's peak",
    "frames": "time between frames",
    "mapping": "calibration",
    "gripper": "noise of the marker or template",
    "clock": "synchronisation of the clocks",
    "flat_end": "flat_end as described",
    "offset": "offset as described",
    "manual": "onset set by hand",
}
"""Causes of uncertainty in words."""


@one_thread()
def html(found: Measurement) -> str:
    """The page of a measurement."""
    from stripfold.draw.save import as_svg
    from stripfold.film import measurement_figure

    return page.html(
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
        curves=as_svg(measurement_figure.draw(found)),
    )


def result(found: Measurement) -> str:
    """The result in one line."""
    low, high = (1e3 * value for value in found.interval)
    if not found.snapped:
        return f"No snap: λ_c is more than {1e3 * found.event:.2f} mm"
    event = f"λ = {1e3 * found.event:.2f} mm at the onset of the snap, friction and lag included"
    return f"{event}, 95 % interval {low:.2f} to {high:.2f} mm"


def rows(found: Measurement) -> list[tuple[str, str]]:
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


def _model_rows(found: Measurement) -> list[tuple[str, str]]:
    model = found.model
    if not isfinite(model.without_friction):
        return [("λ_c of the model", "none: the sag touches the lower layer first")]
    text = f"{_millimetres(model.without_friction)} without friction"
    if isfinite(model.low):
        text += f", 95 % interval {1e3 * model.low:.2f} to {1e3 * model.high:.2f} mm from that of eta_b"
    shown = [("λ_c of the model", text)]
    if isfinite(model.with_friction):
        shown.append(("  with the fabric's friction", f"{_millimetres(model.with_friction)}, to first order"))
    return shown


def _eta_b_rows(found: Measurement) -> list[tuple[str, str]]:
    eta_b = found.eta_b
    if isinstance(eta_b, MeasurementError):
        return [("eta_b by the motion", f"none: {eta_b.found}")]
    described = found.recording.entries.strip.eta_b
    text = f"{eta_b.eta_b:.4g} m^-4 s^2, 95 % interval {eta_b.low:.4g} to {eta_b.high:.4g}, described {described:.4g}"
    friction = f"M_0 = {eta_b.friction:.2g} rho_a g L*^2, {'as described' if eta_b.known else 'fitted beside it'}"
    return [("eta_b by the motion", text), ("  with friction", friction)]


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
