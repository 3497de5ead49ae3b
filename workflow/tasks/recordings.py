"""Synthetic recordings of the configured materials, and lambda measured in any against the frictionless model.

The strips have friction in bending and the gripper moves: both delay the snap, as in the paper's real strips
(docs/physics.md, sections 7 and 8).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.ask import critical
from stripfold.ask.inputs import Scene as StripScene
from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.film.measure import WARNING, RecordingMeasurement
from stripfold.synthetic.scene import Scene
from verification.common import dataset

UNITS = {
    "m": "gripper_height lambda_event lambda_high lambda_low lambda_model lambda_zero track",
    "m s-1": "speed",
    "m-4 s2": "eta_b",
}
SIZE = (480, 360)
FIELD = 8.0
"""Least width of the picture in the folding plane, L*."""
OVER = 1.6
"""Height of the picture over the gripper's, so that the marker is in it."""
BEFORE, AFTER = 0.25, 0.8
"""Start of a film before the static limit, L*, and its duration after the first touch, s."""
RATE = 20.0
"""Frames per second."""
SAMPLES = 60
"""Of the gripper's track."""
EXPONENTS = (2.0 / 3.0, 4.0 / 5.0)
"""Exponents of the lag in the speed, with damping and with inertia dominant."""


def scene_of(
    material: Mapping[str, Any], height: float, speed: float, friction: float, length: float, number: int
) -> Scene:
    """The synthetic recording of a material, an entry of the configuration.

    ``height`` of the gripper and ``length`` of the strip in L*, ``speed`` in m/s, ``friction`` M_0 in rho_a g L*^2;
    ``number`` is the seed.
    """
    unit = Material(material["eta_b"]).gravity_length
    lambda_c = elastica.critical(height).advance
    field = max(FIELD, OVER * height * SIZE[0] / SIZE[1]) * unit
    # The loop is two L* wide, behind the gripper: the middle of both.
    x = (-0.5 * length + lambda_c - 1.0) * unit
    share = field / 0.32
    return Scene.of(
        {
            "length": length * unit,
            "eta_b": material["eta_b"],
            "height": height * unit,
            "speed": speed,
            "strip": {"material": material["name"], "width": 0.02 * share},
            "gripper": {
                "marker_size": 0.024 * share,
                "offset": [0.0, -0.032 * share],
                "finger": 0.003 * share,
            },
            "filming": {
                "size": list(SIZE),
                "target": [x, 0.5 * OVER * height * unit - 0.5 * unit],
                "field": field,
                "distance": 3.0 * field,
                "log_offset": 0.2,
                "codec": "mjpeg",
                "frame_rate": RATE,
            },
            "generator": "dynamics",
            "motion": {
                "friction_moment_star": friction,
                "before": BEFORE * unit,
                "after": AFTER,
                "eta_m": material["eta_m"],
                # Closer to the solid than any measurement (docs/method.md), and faster.
                "model": "rod",
                "refinement": 1.0,
            },
            "seed": number,
            "title": f"{material['name']} at z = {height:g} L*, {speed * 1e3:g} mm/s (synthetic)",
        }
    )


def table(
    measured: Sequence[xr.Dataset],
    shown: Path,
    names: Sequence[str],
    materials: Mapping[str, Mapping[str, Any]],
    framed: str,
) -> list[xr.Dataset]:
    """The measured recordings, with the frictionless model's lambda_c at the same height; frames of one.

    ``measured``, ``names``: datasets of measured recordings, and their names.  ``materials``: entries of the
    configuration by name, for eta_m; a recording with none of their eta_b has the paper's eta_m.  ``shown``,
    ``framed``: folder and name of the recording of which frames are stored.
    """
    stored = ("eta_b", "gripper_height", "lambda_event", "lambda_low", "lambda_high", "snapped")
    columns = {name: np.array([float(data[name]) for data in measured]) for name in stored}
    columns |= {
        "speed": np.array([float(data["gripper_speed"]) for data in measured]),
        "synthetic": np.array([float(data.attrs["synthetic"]) for data in measured]),
        "flagged": np.array([float(WARNING in data.attrs["flags"]) for data in measured]),
        "lambda_model": np.array([_model(data, materials) for data in measured]),
    }
    columns["lambda_zero"] = zero_speed(columns)
    values: dict[str, tuple[Any, Any]] = {name: ("recording", column) for name, column in columns.items()}
    tracks = np.array([_track(data) for data in measured]).reshape(-1, SAMPLES, 2)
    values |= {"track": (("recording", "sample", "axis"), tracks), "axis": ("axis", ["lambda", "z"])}
    found = dataset(values | {"recording": ("recording", list(names))}, units=UNITS)
    return [
        found.assign_attrs(title="lambda measured in recordings"),
        frames(shown, measured[list(names).index(framed)]).assign_attrs(title="frames of a synthetic recording"),
    ]


def _track(data: xr.Dataset) -> Array:
    """lambda and z in the film, shape (samples, 2), m: the lambda of the event, continued by the video."""
    t = np.linspace(float(data["t"][0]), float(data["t"][-1]), SAMPLES)
    x, z = (np.interp(t, data["t"].values, data[name].values) for name in ("x", "z"))
    event = float(data["event_time"])
    advance = np.abs(x - np.interp(event, data["t"].values, data["x"].values)) * np.sign(t - event)
    return np.stack([float(data["lambda_event"]) + advance, z], axis=1)


def _model(data: xr.Dataset, materials: Mapping[str, Mapping[str, Any]]) -> float:
    """lambda_c of the model without friction, m."""
    eta_b, height, length = (float(data[name]) for name in ("eta_b", "gripper_height", "length"))
    eta_m = next((m["eta_m"] for m in materials.values() if np.isclose(m["eta_b"], eta_b, rtol=1e-6)), 1e-3)
    strip = StripScene(length=length, height=height, eta_b=eta_b, eta_m=eta_m, model="rod")
    return critical.find(strip).lambda_c


def zero_speed(columns: Mapping[str, Array]) -> Array:
    """lambda at the onset extrapolated to speed zero, m, shape (n,); nan where there is one speed only.

    The lag grows with the speed to the power 2/3 (damped) or 4/5 (inertial): the mean of both, whose difference is less
    than the lag that is left.
    """
    speeds, events, snapped = columns["speed"], columns["lambda_event"], columns["snapped"] == 1.0
    zero = np.full(len(speeds), np.nan)
    key = np.round(np.column_stack([columns["eta_b"], columns["gripper_height"]]), 6)
    for group in np.unique(key, axis=0):
        rows = np.flatnonzero(np.all(key == group, axis=1) & snapped)
        speed, lam = speeds[rows], events[rows]
        if len(rows) > 1 and np.ptp(speed) > 0.1 * speed.max():
            zero[rows] = np.mean([np.polyfit(speed**power, lam, 1)[1] for power in EXPONENTS])
    return zero


def record(
    material: Mapping[str, Any],
    recordings: Sequence[Mapping[str, Any]],
    friction: float,
    length: float,
    output: Sequence[str],
    progress: Callable[[str], None],
) -> None:
    """Synthetic recordings of a material, as a folder each."""
    from stripfold.synthetic.recording import history_of, write_recording

    for of, folder in zip(recordings, output, strict=True):
        progress(f"{folder}: motion")
        scene = scene_of(material, of["height"], of["speed"], friction, length, of["number"])
        history = history_of(scene)
        progress(f"{folder}: film")
        write_recording(history, scene, Path(folder))


def measure(folders: Sequence[Path], output: Any, progress: Callable[[str], None]) -> list[xr.Dataset]:
    """Recordings measured; the page of each is written beside."""
    made = []
    for folder, page in zip(folders, output.report, strict=True):
        progress(str(folder))
        found = RecordingMeasurement.of(folder, progress)
        found.report(page)
        made.append(found.to_dataset())
    return made


def frames(folder: Path, measured: xr.Dataset) -> xr.Dataset:
    """The first frame of a synthetic recording, that at the onset of the snap, and the last."""
    from stripfold.film.video import read

    with read(folder / "video.mkv") as film:
        every = [(frame.time, frame.image.copy()) for frame in film]
    times = np.array([time for time, _ in every])
    event = float(measured["event_time"])
    chosen = [0, int(np.abs(times - event).argmin()), len(every) - 1]
    values = {
        "frame": (("instant", "row", "column"), np.array([every[i][1] for i in chosen])),
        "instant": ("instant", times[chosen] - event),
    }
    return dataset(values, {"recording": str(measured.attrs["recording"])}, {"s": "instant"})
