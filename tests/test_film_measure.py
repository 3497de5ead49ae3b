"""A recording from its folder to lambda: the number, its interval, what is flagged and what is refused."""

from __future__ import annotations

import copy
import json
import pickle
import shutil
from copy import deepcopy
from dataclasses import fields, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import xarray as xr
import yaml
from PIL import Image

from filmed import event_of, write_video
from stripfold import cli
from stripfold.base.arrays import Index, Mask
from stripfold.base.errors import InvalidInputError, MeasurementError
from stripfold.cli import main
from stripfold.files import store
from stripfold.film import measure, recording, report, video
from stripfold.film.calibration import Calibration, calibrate_folder
from stripfold.film.camera import Camera
from stripfold.film.camera_motion import Shift
from stripfold.film.measure import RecordingMeasurement
from stripfold.film.pictures import Shown
from stripfold.film.recording import Entries, ManualOnset, Recording
from stripfold.film.tracking import Tracks, exposure, track
from stripfold.synthetic import shapes
from stripfold.synthetic.recording import history_of, write_recording
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.sensor import Sensor

ENTRIES: dict[str, Any] = {
    "title": "a made-up strip",
    "strip": {"length": 0.3, "eta_b": 3780.0},
    "gripper": {
        "height": 0.09,
        "speed": 0.005,
        "flat_end": 0.1,
        "marker": {"dictionary": "4x4_50", "id": 3, "size": 0.02, "offset": [0.0, -0.02]},
    },
    "video": "video.mkv",
    "camera": {"images": "camera", "board": {"type": "chessboard", "columns": 9, "rows": 6, "square": 0.025}},
    "plane": {
        "image": "plane.png",
        "board": {
            "type": "charuco",
            "columns": 5,
            "rows": 7,
            "square": 0.04,
            "marker": 0.02,
            "dictionary": "6x6_250",
        },
    },
    "robot": {"grid": "stops/robot.csv"},
}


def entries_with(path: str, value: Any) -> dict[str, Any]:
    """A copy with one entry changed, or removed where the value is None."""
    changed = deepcopy(ENTRIES)
    *parents, key = path.split(".")
    at = changed
    for parent in parents:
        at = at[parent]
    if value is None:
        del at[key]
    else:
        at[key] = value
    return changed


def write(folder: Path, entries: Any) -> Path:
    """A folder with all the files that the entries above name; their content does not matter here."""
    (folder / "camera").mkdir(parents=True)
    (folder / "stops").mkdir()
    for name in ("video.mkv", "plane.png", "stops/robot.csv"):
        (folder / name).touch()
    (folder / recording.NAME).write_text(yaml.safe_dump(entries), encoding="utf-8")
    return folder


def test_folder_is_read_with_defaults(tmp_path: Path) -> None:
    found = recording.read(write(tmp_path / "one", ENTRIES))
    assert found.entries.synthetic is False
    assert found.entries.gripper.direction == 1
    assert found.entries.camera.rolling_shutter == 0.0
    assert found.video == tmp_path / "one" / "video.mkv"
    assert found.robot_log is None
    assert found.timestamps is None


@pytest.mark.parametrize(
    ("path", "value", "key", "words"),
    [
        ("gripper.hight", 0.1, "gripper.hight", "did you mean height"),
        ("gripper.flat_end", 1e300, "gripper.flat_end", "from -1000 to 1000 m"),
        ("gripper.height", -0.1, "gripper.height", "greater than 0 m"),
        ("gripper.height", 12.0, "gripper.height", "less than strip.length = 0.3 m; the unit is m: is a decimal"),
        ("gripper.height", float("nan"), "gripper.height", "a number"),
        ("gripper.height", "9e-2", "gripper.height", "unless it has a point"),
        ("gripper.direction", 0, "gripper.direction", "one of 1, -1"),
        ("gripper.marker", None, "gripper.marker", "is missing"),
        ("gripper.template", {"box": [1, 2, 30, 40], "offset": [0.0, 0.0]}, "gripper.marker", "not both"),
        ("gripper.marker.offset", [0.0], "gripper.marker.offset", "2 entries"),
        ("gripper.marker.offset", [0.0, -32.0], "gripper.marker.offset[1]", "from -1 to 1 m"),
        ("gripper.marker.dictionary", "7x7", "gripper.marker.dictionary", "apriltag_36h11"),
        ("strip.eta_b", 0.1, "strip.eta_b", "it is 0.0894 L*"),
        ("strip.eta_b_interval", [4000.0, 5000.0], "strip.eta_b_interval", "around eta_b = 3780"),
        ("strip.friction_moment", 0.01, "strip.rho_a", "is missing"),
        ("strip.friction", 0.01, "strip.friction", "did you mean friction_moment?"),
        ("strip.eta_b", None, "strip.eta_b", "is missing"),
        ("camera.images", None, "camera.images", "give intrinsics instead"),
        ("camera.intrinsics", "plane.png", "camera.intrinsics", "nothing together with images"),
        ("plane.board.marker", None, "plane.board.marker", "is missing"),
        ("camera.board.marker", 0.02, "camera.board.marker", "of a ChArUco board only"),
        ("plane.board.type", "circles", "plane.board.type", "chessboard, charuco"),
        ("video", "film.mp4", "video", "an existing file"),
        ("video", "../film.mp4", "video", "inside the recording"),
        ("video", "/film.mp4", "video", "inside the recording"),
        ("video", "camera", "timestamps", "beside a folder of frames"),
    ],
)
def test_error_names_the_entry(tmp_path: Path, path: str, value: Any, key: str, words: str) -> None:
    with pytest.raises(InvalidInputError) as caught:
        recording.read(write(tmp_path / "one", entries_with(path, value)))
    assert caught.value.key == key
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "name",
    [
        recording.NAME,
        recording.ManualOnset.file_name,
        "video.mkv",
        "camera/1.png",
        "stops/robot.csv",
        "plane.png",
        "result",
    ],
)
def test_a_link_out_of_the_folder_is_refused_and_not_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    folder = write(tmp_path / "one", ENTRIES)
    other = write(tmp_path / "other", ENTRIES) / name
    secret = "key: [secret" if name.endswith(".yaml") else "secret"
    other.mkdir() if name == "result" else other.write_text(secret)
    (folder / name).unlink(missing_ok=True)
    (folder / name).symlink_to(other)
    assert main(["measure", str(folder)]) == 2
    said = capsys.readouterr().err
    assert "a path inside the recording's folder, and no link out of it" in said
    assert "secret" not in said


def test_folder_without_a_recording_is_refused(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "missing"):
        with pytest.raises(InvalidInputError, match=r"a folder with a recording\.yaml"):
            recording.read(folder)


Made = tuple[Recording, Calibration, Tracks]


def made(folder: Path, filming: dict[str, Any] | None = None, **motion: Any) -> Made:
    scene = Scene(
        speed=0.005,
        filming={"size": [320, 240], "frame_rate": 25.0, "codec": "mjpeg", "log_offset": 0.3} | (filming or {}),
        motion={"law": "parabolic", "before": 0.012, "after": 0.5} | motion,
        seed=4,
    )
    write_recording(history_of(scene), scene, folder)
    found = recording.read(folder)
    calibration = calibrate_folder(found.folder, found.entries)
    return found, calibration, track(found, calibration)


@pytest.fixture(scope="module")
def snapping(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return made(tmp_path_factory.mktemp("recordings") / "snapping")


@pytest.fixture(scope="module")
def found(snapping: Made) -> RecordingMeasurement:
    return measure.evaluate(*snapping, None)


def changed(entries: Entries, **parts: Any) -> Entries:
    """The entries of a recording with others in their place; those of a part are merged."""
    known = entries.model_dump(exclude_none=True)
    merged = {key: {**known[key], **new} if isinstance(new, dict) else new for key, new in parts.items()}
    return Entries.of({**known, **merged})


def evaluated(snapping: Made, tracks: Tracks | None = None, manual: ManualOnset | None = None, **parts: Any):
    """The measurement with other tracks, a manual onset, or changed entries."""
    asked, calibration, known = snapping
    recording = Recording(asked.folder, changed(asked.entries, **parts))
    return measure.evaluate(recording, calibration, tracks or known, manual)


def some_frames(tracks: Tracks, keep: Mask | Index) -> Tracks:
    """The tracks of the frames to keep."""
    names = ("grip_time", "gripped_end", "strip_time", "points", "score", "visible_length")
    timing = replace(tracks.timing, time=tracks.timing.time[keep], doubled=tracks.timing.doubled[keep])
    gripper = replace(tracks.gripper, **{f.name: getattr(tracks.gripper, f.name)[keep] for f in fields(tracks.gripper)})
    return replace(tracks, timing=timing, gripper=gripper, **{name: getattr(tracks, name)[keep] for name in names})


def test_lambda_is_the_truth_within_its_interval(snapping: Made, found: RecordingMeasurement):
    onset, event = event_of(snapping[0].folder)
    assert found.snapped
    assert found.event == pytest.approx(event, abs=5e-4)
    assert abs(found.event - event) < 3.0 * found.sd
    assert found.event_time == pytest.approx(onset, abs=0.1)
    assert found.sd == pytest.approx(np.sqrt(sum(part**2 for part in found.parts.values())))
    assert found.speed == pytest.approx(0.005, rel=0.02)
    assert found.clock is not None
    assert found.clock.offset == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("turns", [1, *(pytest.param(turns, marks=pytest.mark.slow) for turns in (2, 3))])
def test_a_camera_may_be_held_in_any_way(snapping: Made, tmp_path: Path, turns: int):
    """Film and pictures as the sensor has them, and how to show them: the same frames, and the same mapping."""
    folder = tmp_path / "turned"
    shutil.copytree(snapping[0].folder, folder)
    orientation = {1: 8, 2: 3, 3: 6}[turns]
    for file in folder.rglob("*.png"):
        with Image.open(file) as picture:
            raw = Image.fromarray(np.rot90(np.asarray(picture), -turns))
        exif = raw.getexif()
        exif[274] = orientation
        raw.save(file, exif=exif)
    film = snapping[0].entries.video
    with video.read(snapping[0].video) as frames:
        seen = list(frames)
    pts = [round(25.0 * frame.time) for frame in seen]
    images = [np.ascontiguousarray(np.rot90(frame.image, -turns)) for frame in seen]
    write_video(folder / film, "ffv1", images, pts, Fraction(1, 25), turns=turns)
    asked = recording.read(folder)
    calibration = calibrate_folder(asked.folder, asked.entries, video.shown(asked.video))
    np.testing.assert_allclose(calibration.mapping.homography, snapping[1].mapping.homography, atol=1e-9)
    assert video.shown(asked.video) == Shown((320, 240), turns)
    # The same camera from a file of the sensor's.
    camera = calibration.mapping.camera
    if turns % 2:
        again = camera.turned(4 - turns).of_film(Shown((320, 240), turns))
        np.testing.assert_allclose(again.distortion, camera.distortion, atol=1e-15)
        np.testing.assert_allclose(again.matrix, camera.matrix, atol=1e-9)
    if turns == 1:
        again = measure.evaluate(asked, calibration, track(asked, calibration), None)
        assert again.event == pytest.approx(measure.evaluate(*snapping, None).event, abs=1e-5)


def test_a_turned_camera_sees_turned_pictures() -> None:
    """A point seen in the turned picture is where the picture of it was turned to."""
    camera = Camera(
        np.array([[300.0, 0.0, 150.0], [0.0, 310.0, 130.0], [0.0, 0.0, 1.0]]),
        np.array([-0.1, 0.02, 1e-3, -2e-3, 5e-3]),
        (320, 240),
    )
    points, still = np.array([[0.3, -0.2, 1.0], [-0.4, 0.1, 1.2]]), np.zeros(3)
    pixels = camera.project(points, still, still)
    turned = camera.turned(1)
    seen = turned.project(points @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), still, still)
    np.testing.assert_allclose(seen, np.column_stack([pixels[:, 1], 319.0 - pixels[:, 0]]), atol=1e-9)
    assert turned.size == (240, 320)
    assert turned.turned(3).size == camera.size


@pytest.mark.parametrize("turns", range(4))
def test_rows_of_the_sensor_are_exposed_one_after_another(turns: int) -> None:
    sensor = np.array([[10.0, 0.0], [5.0, 23.0]])  # first and last row of 32 x 24
    picture = np.zeros((24, 32))
    for row, (x, y) in enumerate(sensor.astype(int)):
        picture[y, x] = row + 1.0
    shown = np.rot90(picture, turns)
    pixels = np.array([np.argwhere(shown == row + 1.0)[0][::-1] for row in range(2)], float)
    times = exposure(np.zeros(2), pixels, shown.shape[::-1], turns, 0.02)
    np.testing.assert_allclose(times, [0.0, 0.02], atol=1e-12)


def test_a_measurement_goes_through_pickle(found: RecordingMeasurement):
    result = found
    for again in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        assert again == result
    assert result != replace(found, event=found.event + 1e-3)
    assert len(repr(result)) < 200
    with pytest.raises(TypeError, match="unhashable"):
        hash(result)


def test_lambda_counts_from_the_flat_end_in_the_direction_of_the_advance(snapping: Made, found: RecordingMeasurement):
    flat_end = snapping[0].entries.gripper.flat_end
    moved = evaluated(snapping, gripper={"flat_end": flat_end + 0.01})
    assert moved.event == pytest.approx(found.event - 0.01)
    mirror = np.array([-1.0, 1.0])
    tracks = replace(snapping[2], gripped_end=mirror * snapping[2].gripped_end, points=mirror * snapping[2].points)
    other = evaluated(snapping, tracks, gripper={"direction": -1, "flat_end": -flat_end}, robot_log=None)
    assert other.event == pytest.approx(found.by_video)


def test_manual_onset_is_used_and_recorded(snapping: Made, found: RecordingMeasurement, tmp_path: Path):
    manual = ManualOnset(event_time=found.event_time - 0.2, sd=0.05, reason="the loop is hidden")
    by_hand = evaluated(snapping, manual=manual)
    assert by_hand.event == pytest.approx(found.event - 0.2 * found.speed, abs=1e-4)
    assert by_hand.parts["manual"] == pytest.approx(0.05 * found.speed, rel=0.05)
    assert by_hand.to_dataset().attrs["manual_onset"] == "the loop is hidden"
    with pytest.raises(MeasurementError, match="a time within the film"):
        evaluated(snapping, manual=ManualOnset(event_time=99.0, sd=0.05, reason="typing error"))
    asked = Recording(tmp_path, snapping[0].entries)
    assert asked.manual_onset() is None
    (tmp_path / "manual_onset.yaml").write_text("event_time: 2\nsd: 0.1\nreason: hidden\n", encoding="utf-8")
    assert asked.manual_onset() == ManualOnset(event_time=2.0, sd=0.1, reason="hidden")
    for text in ("event_time: 2\nsd: 0.1\n", "event_time: soon\nsd: 0.1\nreason: x\n", "[1]", "a: ["):
        (tmp_path / "manual_onset.yaml").write_text(text, encoding="utf-8")
        with pytest.raises(InvalidInputError):
            asked.manual_onset()


@pytest.mark.parametrize(
    ("gripper", "words"),
    [
        ({"height": 0.12}, r"gripper\.height = 0\.12 m, the video shows 0\.10"),
        ({"height": 0.104}, r"the video shows 0\.10.*at most 3\.1 mm between them.*height_uncertainty"),
        ({"height": 0.01}, "a factor of 10"),
        ({"direction": -1}, r"gripper\.direction = -1, in the video x of the gripper goes from"),
        ({"flat_end": 0.225}, r"gripper\.flat_end = 0\.225 m, by the lying part in the video it was at -0\.2"),
        ({"flat_end": 0.35}, r"gripper\.flat_end = 0\.35 m, by the lying part"),
        ({"speed": 0.05}, r"gripper\.speed = 0\.05 m/s, the video shows 0\.005 m/s.*a factor of 10"),
    ],
)
def test_contradiction_of_film_and_description_is_refused(snapping: Made, gripper: dict[str, Any], words: str):
    with pytest.raises(MeasurementError, match=words):
        evaluated(snapping, gripper=gripper)


@pytest.mark.parametrize(("speed", "said"), [(0.0056, True), (0.0053, False), (0.0047, False), (0.0044, True)])
def test_another_speed_is_noted(snapping: Made, speed: float, said: bool):
    flags = [flag.text for flag in evaluated(snapping, gripper={"speed": speed}).flags]
    assert any(f"described are {1e3 * speed:.2f}" in text for text in flags) is said


def copied(made: Made, folder: Path) -> Path:
    """The recording in another folder, without a result."""
    return Path(shutil.copytree(made[0].folder, folder, ignore=shutil.ignore_patterns("result")))


def test_truncated_film_is_refused(snapping: Made, tmp_path: Path):
    folder = copied(snapping, tmp_path / "cut")
    film = folder / snapping[0].entries.video
    film.write_bytes(film.read_bytes()[: film.stat().st_size * 7 // 10])
    with pytest.raises(MeasurementError, match=r"the last frame is at \d\.\d\d s, its header says"):
        track(Recording(folder, snapping[0].entries), snapping[1])


def test_drift_and_missing_frames_are_flagged(snapping: Made, found: RecordingMeasurement):
    tracks = snapping[2]
    end = tracks.gripped_end + np.linspace(0.0, 4e-3, len(tracks.gripped_end))[:, None] * [0.0, 1.0]
    assert any("height drifts" in flag.text for flag in evaluated(snapping, replace(tracks, gripped_end=end)).flags)
    fewer = evaluated(snapping, some_frames(tracks, np.abs(tracks.timing.time - found.event_time) > 0.1))
    assert any("is not seen for" in flag.text for flag in fewer.flags)
    assert fewer.sd > 1.3 * found.sd
    assert abs(fewer.event - found.event) < 3.0 * fewer.sd


def test_strip_without_a_snap_gives_a_bound(snapping: Made):
    early = some_frames(snapping[2], snapping[2].timing.time < 1.6)
    none = evaluated(snapping, early, robot_log=None)
    assert not none.snapped
    assert none.event == pytest.approx(early.gripped_end[-1, 0] - snapping[0].entries.gripper.flat_end, abs=2e-4)
    assert any("no snap" in flag.text for flag in none.flags)
    assert "more than" in report.result(none)
    end = early.gripped_end.copy()
    end[:, 0] = np.minimum(end[:, 0], end[-8, 0])
    stopped = evaluated(snapping, replace(early, gripped_end=end), robot_log=None)
    assert not any("the gripper moves at" in flag for flag in stopped.flags)
    assert "level of the onset" not in {text.get_text() for text in report.figure_of(stopped).axes[2].texts}


def test_a_return_is_no_advance_and_each_trial_has_its_row(snapping: Made):
    """There, back and there again, as in a mirror: the same onset twice, and none on the way back."""
    once = evaluated(snapping, robot_log=None)
    tracks, n = snapping[2], len(snapping[2].grip_time)
    order = np.concatenate([np.arange(n), np.arange(n)[::-1], np.arange(n)])
    twice = some_frames(tracks, order)
    late = np.repeat(np.arange(3) * (tracks.grip_time[-1] + tracks.timing.period), n)
    time = np.concatenate([tracks.grip_time, tracks.grip_time[-1] - tracks.grip_time[::-1], tracks.grip_time]) + late
    delay = (tracks.strip_time - tracks.grip_time)[order]
    timing = replace(twice.timing, time=time)
    found = evaluated(snapping, replace(twice, timing=timing, grip_time=time, strip_time=time + delay), robot_log=None)
    assert found.event == pytest.approx(once.event, abs=2e-5)
    assert found.event_time == pytest.approx(once.event_time, abs=0.01)
    assert [trial.snapped for trial in found.trials] == [True, True]
    assert found.trials[1].event == pytest.approx(once.event, abs=2e-5)
    assert found.trials[1].event_time == pytest.approx(once.event_time + late[-1], abs=0.01)
    assert "advance 2" in str(found)
    assert [trial["snapped"] for trial in found.to_dict()["trials"]] == [True, True]
    # A film that begins on the way back.
    begun = some_frames(
        replace(twice, timing=timing, grip_time=time, strip_time=time + delay), np.arange(3 * n) >= n + 5
    )
    later = evaluated(snapping, begun, robot_log=None)
    assert later.event == pytest.approx(once.event, abs=2e-5)
    assert not later.trials


def test_film_that_begins_after_the_snap_is_refused(tmp_path: Path):
    """It shows no snap, but lambda_c is not beyond the farthest place of the gripper."""
    longer = made(tmp_path / "longer", after=3.0)
    truth = json.loads((longer[0].folder / "truth.json").read_text(encoding="utf-8"))
    late = some_frames(longer[2], longer[2].timing.time > truth["events"]["touch"]["t"] + 0.3)
    with pytest.raises(MeasurementError, match="a film that begins before the snap"):
        evaluated(longer, late, robot_log=None)


def test_dataset_and_report_hold_the_result(found: RecordingMeasurement, tmp_path: Path):
    data = found.to_dataset()
    store.write(data, tmp_path / "measured.nc", title="test")
    with xr.open_dataset(tmp_path / "measured.nc") as stored:
        assert float(stored["lambda_event"]) == found.event
        assert stored.attrs["synthetic"] == 1
    page = report.html(replace(found, flags=(measure.Flag("warning", "first"), measure.Flag("note", "second"))))
    low, high = found.interval
    for text in (
        "SYNTHETIC",
        f"λ = {1e3 * found.event:.2f} mm at the onset of the snap, friction and lag included",
        f'λ_c of the model</td><td class="value">{1e3 * found.model.without_friction:.2f} mm without friction',
        f"95 % interval {1e3 * low:.2f} to {1e3 * high:.2f} mm",
        f'λ by the video alone</td><td class="value">{1e3 * found.by_video:.2f} mm<',
        '<p class="flag warning"><b>warning</b> first</p>\n<p class="flag note"><b>note</b> second</p>',
    ):
        assert page.count(text) == 1
    assert page.count("<svg") == 1
    assert page.count('src="data:video/mp4;base64,') == page.count('poster="data:image/jpeg;base64,') == 1
    assert "<script" not in page


def test_command_line_refuses_and_writes_nothing(tmp_path: Path, snapping: Made, capsys: pytest.CaptureFixture[str]):
    assert cli.main(["measure", str(tmp_path)]) == 2
    assert "recording.yaml" in capsys.readouterr().err
    folder = copied(snapping, tmp_path / "copy")
    (folder / "robot.csv").unlink()
    described = folder / "recording.yaml"
    text = described.read_text("utf-8").replace("robot_log: robot.csv\n", "")
    described.write_text(text.replace("height: 0.1\n", "height: 0.2\n"), encoding="utf-8")
    assert cli.main(["measure", str(folder)]) == 4
    assert "gripper.height = 0.2 m, the video shows 0.10" in capsys.readouterr().err
    assert not (folder / "result").exists()


def test_a_camera_that_moved_is_named(snapping: Made, found: RecordingMeasurement):
    """As a warning beside the value, and as the cause of an error."""
    assert found.tracks.camera.problem == ""
    np.testing.assert_allclose(found.tracks.camera[:2], 0.0, atol=0.3)
    moved = replace(snapping[2], camera=Shift(6.0, 0.0, True))
    assert evaluated(snapping, moved).flags[0].severity == measure.WARNING
    assert "the camera moved by 6.0 px" in evaluated(snapping, moved).flags[0].text
    with pytest.raises(MeasurementError, match=r"moved by 6\.0 px .*, and gripper\.height"):
        evaluated(snapping, moved, gripper={"height": 0.12})
    unknown = replace(snapping[2], camera=Shift(np.nan, 0.0, False))
    # What moves without mechanics, as here, has no shape of a strip.
    told = [flag for flag in evaluated(snapping, unknown).flags if "shapes" not in flag.text]
    assert [flag.severity for flag in told] == [measure.NOTE]


@pytest.mark.parametrize(
    "matrix",
    [
        pytest.param([[1, 0, 0], [0, 1, 2.5]], id="sag"),
        pytest.param([[1.012, 0, -1.9], [0, 1.012, -1.4]], id="zoom", marks=pytest.mark.slow),
    ],
)
def test_a_camera_that_moves_during_the_film_widens_the_interval(
    snapping: Made, found: RecordingMeasurement, matrix: list[list[float]]
):
    """From after its begin on: by what moves the gripper's place, where that is not read from a log."""
    tracks = snapping[2]
    still = evaluated(snapping, robot_log=None)
    assert still.parts["camera"] < 2e-4
    moved = copy.copy(tracks.thumbnails)
    size = moved.pictures[0].shape[::-1]
    moved.pictures = moved.pictures[:10] + [
        cv2.warpAffine(one, np.array(matrix), size, borderMode=cv2.BORDER_REPLICATE) for one in moved.pictures[10:]
    ]
    drifted = evaluated(snapping, replace(tracks, thumbnails=moved), robot_log=None)
    i = int(np.searchsorted(tracks.timing.time, found.event_time))
    place = tracks.gripper.centre[i] / moved.whole
    true = np.linalg.norm(np.array(matrix) @ [*place, 1.0] - place) * moved.whole
    assert drifted.parts["camera"] == pytest.approx(true * snapping[1].quality["resolution"], rel=0.3, abs=2e-4)
    assert drifted.flags[0].severity == measure.WARNING
    assert "the camera moved by" in drifted.flags[0].text
    assert evaluated(snapping, replace(tracks, thumbnails=moved)).parts["camera"] == 0.0


SMALL = {
    "filming": {"size": [320, 240], "frame_rate": 20.0, "dropped": 0.06, "doubled": 0.1, "log_offset": 12.5},
    "speed": 0.02,
    "motion": {"before": 0.008, "after": 0.5},
    "seed": 3,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = Scene(**SMALL)
    path = tmp_path_factory.mktemp("synthetic") / "small"
    write_recording(history_of(scene), scene, path)
    return path


def test_a_folder_can_be_read_and_says_that_it_is_synthetic(folder: Path) -> None:
    config = yaml.safe_load((folder / "recording.yaml").read_text(encoding="utf-8"))
    Entries.of(config)
    assert config["synthetic"] is True
    assert "synthetic" in config["title"]
    named = [config["video"], config["robot_log"], config["plane"]["image"], config["robot"]["grid"]]
    assert all((folder / name).is_file() for name in named)
    assert len(list((folder / config["camera"]["images"]).glob("*.png"))) == 10
    grid = (folder / config["robot"]["grid"]).read_text(encoding="utf-8").splitlines()
    assert grid[0] == "image,x,z"
    assert all((folder / "calibration" / row.split(",")[0]).is_file() for row in grid[1:])
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    assert truth["synthetic"] is True
    assert sorted(path.name for path in folder.parent.iterdir()) == ["small"]  # no temporary folders


def test_the_same_seed_gives_the_same_recording(folder: Path, tmp_path: Path) -> None:
    scene = Scene(**SMALL)
    history = history_of(scene)
    write_recording(history, scene, tmp_path / "again", folder / "calibration")
    for name in ("video.mkv", "robot.csv", "truth.json", "recording.yaml"):
        assert (tmp_path / "again" / name).read_bytes() == (folder / name).read_bytes(), name
    pictures = [
        Sensor(Renderer(one, history.curve[0]), 1.0, np.random.default_rng(1)).exposed(history, 0.5)
        for one in (scene, Scene(**{**SMALL, "seed": 4}))
    ]
    assert not np.array_equal(*pictures)


def test_an_existing_folder_is_left_alone(folder: Path) -> None:
    scene = Scene(**SMALL)
    with pytest.raises(InvalidInputError, match="not there yet"):
        write_recording(shapes.history(scene), scene, folder)
