"""A motion and a way of filming it into the complete folder of a recording, which says that it is synthetic."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import xarray as xr
import yaml

from stripfold import store
from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.synthetic.boards import Board, Calibration, truth_of
from stripfold.synthetic.encode import encode, tick
from stripfold.synthetic.history import History
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.sensor import Sensor, Timeline, timeline


def history_of(scene: Scene) -> History:
    """The motion of a scene, by its generator, which says what it cannot do."""
    if scene.generator == "dynamics":
        from stripfold.synthetic.dynamics import from_dynamics

        found: History = from_dynamics(scene)
        return found
    from stripfold.synthetic.shapes import history

    return history(scene)


def write_calibration(scene: Scene, folder: Path) -> None:
    """Render the calibration of a scene's camera into a new folder: boards, plane, robot stops.

    It depends on the camera, its pose, its noise, the gripper's marker and the seed, and may serve several recordings
    with the same of these.
    """
    renderer = Renderer(scene, np.array([[0.0, 0.0], [scene.strip.length, 0.0]]))
    with store.atomic(folder) as temporary:
        temporary.mkdir()
        Calibration(renderer, np.random.default_rng([scene.seed, 4])).write(temporary)


def write_recording(
    history: History, scene: Scene, folder: str | os.PathLike[str], calibration: Path | None = None
) -> None:
    """Render everything of a recording and write its folder, whole or not at all.

    Parameters
    ----------
    history
        The motion.
    scene
        Strip, gripper and filming; its seed decides noise, jitter and poses of the boards.
    folder
        Where to; it must not be there yet.
    calibration
        From :func:`write_calibration`, with the same camera; rendered anew where it is not given.

    Raises
    ------
    InvalidInputError
        The folder is there already, or what would be written is no recording.
    """
    folder = Path(folder)
    if folder.exists():
        raise InvalidInputError("output", str(folder), "a folder that is not there yet", "remove it, or choose another")
    filming = scene.filming
    config = recording_config(scene)
    renderer = Renderer(scene, history.curve[0])
    rng = np.random.default_rng([scene.seed, 5])
    events = history.events()
    end = float(history.t[-1]) - filming.rolling_shutter - filming.exposure
    step = tick(filming)
    clock = 1e-6 if filming.timestamps else float(step)
    times = timeline(filming, end, events["fall"], clock, rng)
    stamps = np.arange(len(times.t)) if filming.timestamps else np.rint(times.t / float(step)).astype(int)
    with store.atomic(folder) as temporary:
        temporary.mkdir()
        if calibration is None:
            write_calibration(scene, temporary / "calibration")
        else:
            shutil.copytree(calibration, temporary / "calibration")
        film = Sensor(renderer, end, rng).film(history, times)
        encode(temporary / config["video"], film, [int(stamp) for stamp in stamps], filming)
        _lines(temporary / "robot.csv", "t,x,z", robot_log(history, scene, rng), "{:.6f},{:.6f},{:.6f}")
        if filming.timestamps:
            _lines(temporary / "timestamps.csv", "frame,t", list(enumerate(times.t)), "{},{:.6f}")
        (temporary / "recording.yaml").write_text(
            "# SYNTHETIC: computed, not filmed.\n" + yaml.safe_dump(config, sort_keys=False), encoding="utf-8"
        )
        _write_truth(temporary, history, scene, events, times, renderer)


def recording_config(scene: Scene) -> dict[str, Any]:
    """What stands in recording.yaml.

    Raises
    ------
    InvalidInputError
        It does not fit the schema of a recording.
    """
    strip, gripper, filming = scene.strip, scene.gripper, scene.filming
    board = Board.of(filming).as_config()
    marker = {"dictionary": "4x4_50", "id": gripper.marker, "size": gripper.marker_size, "offset": list(gripper.offset)}
    config: dict[str, Any] = {
        "title": scene.title,
        "synthetic": True,
        "strip": {"length": strip.length, "eta_b": strip.eta_b, "width": strip.width, "material": strip.material},
        "gripper": {"height": gripper.height, "speed": gripper.speed, "flat_end": strip.flat_end, "marker": marker},
        "video": f"video.{filming.container}",
        **({"timestamps": "timestamps.csv"} if filming.timestamps else {}),
        "robot_log": "robot.csv",
        "camera": {"images": "calibration/camera", "board": board, "rolling_shutter": filming.rolling_shutter},
        "plane": {"image": "calibration/plane.png", "board": board},
        "robot": {"grid": "calibration/robot.csv"},
    }
    # Through JSON: the file shall hold plain numbers, and the board twice instead of a reference.
    config = json.loads(json.dumps(config))
    try:
        jsonschema.validate(config, _schema())
    except jsonschema.ValidationError as error:
        key = ".".join(str(part) for part in error.absolute_path)
        raise InvalidInputError(key, error.instance, "what a recording may hold", error.message) from error
    return config


@cache
def _schema() -> Mapping[str, Any]:
    text = (files("stripfold.vision") / "recording.schema.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def robot_log(history: History, scene: Scene, rng: np.random.Generator) -> Array:
    """Shape (n, 3): time by the robot's clock, s, and x and z of the gripped end as it reports them, m."""
    filming = scene.filming
    # A log begins before its film and ends after it, at no round time.
    t = np.arange(-0.5 + rng.uniform(0.0, 1.0 / filming.log_rate), history.t[-1] + 0.5, 1.0 / filming.log_rate)
    places = np.column_stack([np.interp(t, history.t, history.gripper[:, i]) for i in range(2)])
    return np.column_stack([t + filming.log_offset, places + filming.log_noise * rng.standard_normal(places.shape)])


def _lines(path: Path, header: str, rows: Any, form: str) -> None:
    text = "\n".join([header, *(form.format(*row) for row in rows)]) + "\n"
    path.write_text(text, encoding="utf-8", newline="\n")


def _write_truth(
    folder: Path,
    history: History,
    scene: Scene,
    events: Mapping[str, float | None],
    times: Timeline,
    renderer: Renderer,
) -> None:
    advance = history.gripper[:, 0] - scene.strip.flat_end

    def at(moment: float | None) -> float | None:
        return None if moment is None else float(np.interp(moment, history.t, advance))

    truth = {
        "synthetic": True,
        "lambda_c": history.truth["lambda_c"],
        "speed": scene.gripper.speed,
        "events": {name: {"t": moment, "lambda": at(moment)} for name, moment in events.items()},
        "truth": {key: value for key, value in history.truth.items() if key != "lambda_c"},
        "camera": truth_of(renderer.view),
        "clock_offset": scene.filming.log_offset,
        "frames": {"t": times.t, "shown": times.shown, "dropped": times.dropped},
        "scene": scene.as_config(),
    }
    store.write_json(truth, folder / "truth.json")
    # Single precision: 1e-8 m, and half the size.
    variables = {
        "lambda": (("time",), advance, "advance of the gripper past the flat end"),
        "gripper": (("time", "axis"), history.gripper, "gripped end"),
        "curve": (("time", "point", "axis"), history.curve.astype(np.float32), "mid-surface from the gripped end"),
    }
    dataset = xr.Dataset(
        {key: (dims, value, {"units": "m", "long_name": name}) for key, (dims, value, name) in variables.items()},
        coords={
            "time": ("time", history.t, {"units": "s", "long_name": "time of the video"}),
            "axis": ("axis", np.array(["x", "z"], dtype=object), {"units": "1", "long_name": "axis of the robot"}),
        },
    )
    store.write(dataset, folder / "truth.nc", title="truth of a synthetic recording", config=scene.as_config())
