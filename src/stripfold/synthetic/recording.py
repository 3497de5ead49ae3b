"""The folder of a synthetic recording: film, calibration, robot log and truth; all of it says that it is synthetic."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import yaml

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.base.progress import Percent
from stripfold.files import schema, store
from stripfold.film.recording import Entries
from stripfold.synthetic import shapes
from stripfold.synthetic.calibration import Calibration, board_of
from stripfold.synthetic.history import History, from_dynamics, with_lead
from stripfold.synthetic.render import DICTIONARY, Renderer
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.sensor import Sensor, encode, tick, timeline

LOG_NOISE = 2e-5
"""Standard deviation of a place in the robot's log, m."""


def history_of(scene: Scene) -> History:
    """The motion of a scene, by its generator.

    Raises InvalidInputError, SolveError: there is no such motion.
    """
    found = from_dynamics(scene) if scene.generator == "dynamics" else shapes.history(scene)
    return found if scene.filming.plate is None else with_lead(found, scene)


def write_calibration(scene: Scene, folder: Path) -> None:
    """Render the calibration of a scene's camera into a new folder.

    It depends on the camera, its pose and noise, the gripper's marker and the seed: recordings with the same of these
    can share it.
    """
    _write_calibration(Renderer(scene, np.array([[0.0, 0.0], [scene.length, 0.0]])), folder)


def _write_calibration(renderer: Renderer, folder: Path) -> None:
    with store.atomic(folder) as temporary:
        Calibration(renderer, np.random.default_rng([renderer.scene.seed, 4])).write(temporary)


def write_recording(
    history: History,
    scene: Scene,
    folder: str | os.PathLike[str],
    calibration: Path | None = None,
    progress: Callable[[str], None] | None = None,
) -> None:
    """Render a motion as a recording in a new folder, whole or not at all.

    ``calibration`` is a folder from :func:`write_calibration` with the same camera; it is rendered anew if not given.
    The seed of the scene decides noise, jitter and the poses of the boards.  ``progress`` is called with a line on how
    much is done.

    Raises InvalidInputError: the folder exists, or the recording would not be valid.
    """
    folder = Path(folder)
    if folder.exists():
        raise InvalidInputError("output", str(folder), "a folder that is not there yet", "remove it, or choose another")
    filming = scene.filming
    config = recording_config(scene)
    renderer = Renderer(scene, history.curve[0])
    rng = np.random.default_rng([scene.seed, 5])
    truth, events = _truth(history, scene), history.events()
    end = float(history.t[-1]) - filming.rolling_shutter - filming.exposure
    frames = timeline(filming, end, events["fall"], rng)
    stamps = np.arange(len(frames.t)) if filming.timestamps else np.rint(frames.t / float(tick(filming))).astype(int)
    with store.atomic(folder) as temporary:
        temporary.mkdir()
        if calibration is None:
            _write_calibration(renderer, temporary / "calibration")
        else:
            shutil.copytree(calibration, temporary / "calibration")
        film = Sensor(renderer, end, rng).film(history, frames.shown)
        film = Percent(progress, "filming").each(film, len(frames.t))
        encode(temporary / config["video"], film, stamps.tolist(), filming, scene.strip.colour is not None)
        log = robot_log(history, scene, rng)
        np.savetxt(temporary / "robot.csv", log, "%.6f,%.6f,%.6f", header="t,x,z", comments="")
        if filming.timestamps:
            table = np.column_stack([stamps, frames.t])
            np.savetxt(temporary / "timestamps.csv", table, "%d,%.6f", header="frame,t", comments="")
        text = "# SYNTHETIC: computed, not filmed.\n" + yaml.safe_dump(config, sort_keys=False)
        store.write_text(text, temporary / "recording.yaml")
        camera = renderer.view.camera
        numbers = {
            "synthetic": True,
            "lambda_c": history.lambda_c,
            "speed": scene.speed,
            "events": {
                name: {"t": t, "lambda": float(np.interp(t, truth["time"], truth["advance"]))}
                for name, t in events.items()
            },
            "camera": {
                "matrix": camera.matrix,
                "distortion": camera.distortion,
                "rotation": renderer.view.rotation,
                "translation": renderer.view.translation,
            },
            "clock_offset": filming.log_offset,
            "frames": frames._asdict(),
            "scene": scene.as_config(),
        }
        store.write_json(numbers, temporary / "truth.json")
        store.write(truth, temporary / "truth.nc", title="truth of a synthetic recording", config=scene.as_config())


def recording_config(scene: Scene) -> dict[str, Any]:
    """The content of recording.yaml.

    Raises InvalidInputError: it would not be a valid recording.
    """
    strip, gripper, filming = scene.strip, scene.gripper, scene.filming
    board = board_of(filming)
    marker = {"dictionary": DICTIONARY, "id": gripper.marker, "size": gripper.marker_size}
    marker["offset"] = [gripper.offset[0] * gripper.direction, gripper.offset[1]]
    marker["offset_uncertainty"] = 0.0
    entries = Entries.of(
        {
            "title": scene.title,
            "synthetic": True,
            "strip": {"length": scene.length, "eta_b": scene.eta_b, "width": strip.width, "material": strip.material},
            "gripper": {
                "height": scene.height,
                "speed": scene.speed,
                "flat_end": scene.flat_end * gripper.direction,
                "flat_end_uncertainty": 0.0,
                "direction": gripper.direction,
                "marker": marker,
            },
            "video": f"video.{filming.container}",
            **({"timestamps": "timestamps.csv"} if filming.timestamps else {}),
            "robot_log": "robot.csv",
            "camera": {"images": "calibration/camera", "board": board, "rolling_shutter": filming.rolling_shutter},
            "plane": {"image": "calibration/plane.png", "board": board},
            "robot": {"grid": "calibration/robot.csv"},
        }
    )
    return entries.model_dump(mode="json", exclude_unset=True)


def robot_log(history: History, scene: Scene, rng: np.random.Generator) -> Array:
    """Shape (n, 3): time by the robot's clock, s, and the reported x and z of the gripped end, m."""
    filming = scene.filming
    # The log begins before the film and ends after it, at no round time.
    t = np.arange(-0.5 + rng.uniform(0.0, 1.0 / filming.log_rate), history.t[-1] + 0.5, 1.0 / filming.log_rate)
    places = np.column_stack([np.interp(t, history.t, history.gripper[:, i]) for i in range(2)])
    places[:, 0] *= scene.gripper.direction
    return np.column_stack([t + filming.log_offset, places + LOG_NOISE * rng.standard_normal(places.shape)])


def _truth(history: History, scene: Scene) -> xr.Dataset:
    """The motion, SI."""
    advance = history.gripper[:, 0] - scene.flat_end
    # Single precision, 1e-8 m, halves the file.
    return schema.dataset(
        {
            "advance": ("time", advance),
            "gripper": (("time", "axis"), history.gripper),
            "curve": (("time", "point", "axis"), history.curve.astype(np.float32)),
            "time": ("time", history.t),
            "axis": ("axis", ["x", "z"]),
        }
    )
