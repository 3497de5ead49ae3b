"""The camera: boards, calibration, mapping to the robot, and whether it stood still."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from shutil import copytree
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

import boards_seen as seen
from filmed import landscape
from stripfold import cli
from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import CalibrationError, InvalidInputError
from stripfold.film import calibration, camera_motion, recording
from stripfold.film.boards import Board, detect
from stripfold.film.calibration import Calibration, View, assemble, calibrate_folder, find_stops
from stripfold.film.camera import read_camera
from stripfold.film.gripper import Track
from stripfold.film.holder import Marker
from stripfold.film.pictures import Shown, read_calibration_picture
from stripfold.film.recording import Entries
from stripfold.film.video import Thumbnails

TURN, SHIFT = np.array([0.25, -0.3, 0.1]), np.array([-0.12, -0.07, 0.42])


BOARDS = pytest.mark.parametrize("board", [seen.CHESS, seen.CHARUCO], ids=["chessboard", "charuco"])


def error(found: Array, true: Array) -> float:
    """RMS distance to the nearest true corner, pixels: a chessboard may be numbered from its other end."""
    return float(np.sqrt(np.mean(np.linalg.norm(found[:, None] - true, axis=-1).min(axis=1) ** 2)))


@BOARDS
def test_no_board(board: Board) -> None:
    random = np.random.default_rng(3)
    assert detect(np.full((480, 640), 128, dtype=np.uint8), board) is None
    assert detect(random.integers(0, 255, (480, 640), dtype=np.uint8), board) is None
    other = Board(type="chessboard", columns=7, rows=4, square=0.025) if board is seen.CHARUCO else seen.CHARUCO
    assert detect(seen.board_picture(other, TURN, SHIFT, random), board) is None


def test_a_corner_that_is_found_beside_the_board_is_put_right(monkeypatch: pytest.MonkeyPatch) -> None:
    """OpenCV's search takes other things for a corner of the board itself, half a square away."""
    picture = seen.board_picture(seen.CHESS, TURN, SHIFT, np.random.default_rng(3))
    right, search = detect(picture, seen.CHESS), cv2.findChessboardCorners

    def mistaken(*given: Any, **named: Any) -> Any:
        found, corners = search(*given, **named)
        corners[[0, -1]] += np.array([16.0, 12.0], dtype=np.float32)
        return found, corners

    monkeypatch.setattr(cv2, "findChessboardCorners", mistaken)
    again = detect(picture, seen.CHESS)
    assert right is not None
    assert again is not None
    np.testing.assert_allclose(again.pixels, right.pixels, atol=0.02)


def test_folders_of_pictures(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="existing folder"):
        calibration.find_views(tmp_path / "none", seen.CHESS)
    (tmp_path / "notes.txt").write_text("not a picture")
    with pytest.raises(InvalidInputError, match="it has 0"):
        calibration.find_views(tmp_path, seen.CHESS)
    turned = Image.new("L", (64, 48))
    turned.getexif()[274] = 6  # the rotation that EXIF asks for is ignored, as a video has none
    turned.save(tmp_path / "1.jpg", exif=turned.getexif())
    assert read_calibration_picture(tmp_path / "1.jpg", (64, 48)).shape == (48, 64)
    Image.new("L", (48, 64)).save(tmp_path / "2.png")
    with pytest.raises(CalibrationError, match=r"2\.png: 48 x 64 pixels; needed is 64 x 48"):
        calibration.find_views(tmp_path, seen.CHESS)
    (tmp_path / "2.png").unlink()
    assert calibration.find_views(tmp_path, seen.CHESS) == ([], (64, 48))


@pytest.mark.parametrize("raw", [(64, 48), (48, 64)], ids=["as the sensor has it", "turned by a program"])
def test_a_picture_for_a_film_on_its_side(tmp_path: Path, raw: tuple[int, int]) -> None:
    picture = Image.new("L", raw)
    exif = picture.getexif()
    exif[271] = "a camera's maker"
    picture.save(tmp_path / "1.jpg", exif=exif)
    assert read_calibration_picture(tmp_path / "1.jpg", (48, 64), Shown((48, 64), 1)).shape == (64, 48)


def test_calibration_finds_the_camera() -> None:
    exact = calibration.calibrate_camera(seen.views(9, 0.0, np.random.default_rng(0)), seen.SIZE)
    true = calibration.parameters(seen.LENS)
    np.testing.assert_allclose(calibration.parameters(exact.camera), true, rtol=1e-4, atol=1e-4)
    assert exact.rms < 1e-4
    random = np.random.default_rng(1)
    views = seen.views(12, 0.2, random)
    found = calibration.calibrate_camera(views, seen.SIZE)
    # Both coordinates of a corner have noise of 0.2 px.
    assert found.rms == pytest.approx(0.2 * np.sqrt(2.0), rel=0.06)
    sd = np.sqrt(np.diag(found.covariance))
    assert np.all(np.abs(calibration.parameters(found.camera) - true) < 4.0 * sd)
    assert 0.0 < found.split_half < 0.3
    # OpenCV's own standard deviations, from its full normal matrix.
    points = [view.corners.object_points.astype(np.float32) for view in views]
    pixels = [view.corners.pixels.astype(np.float32) for view in views]
    theirs = cv2.calibrateCameraExtended(points, pixels, seen.SIZE, np.eye(3), np.zeros(5))[5].ravel()[:9]
    np.testing.assert_allclose(sd, theirs, rtol=0.02)
    drawn = np.array([calibration.parameters(found.draw(random)) for _ in range(2000)])
    np.testing.assert_allclose(drawn.std(axis=0), found.inflation * theirs, rtol=0.1)
    np.testing.assert_allclose(np.corrcoef(drawn.T)[0, 1], found.covariance[0, 1] / sd[0] / sd[1], atol=0.05)


def moved(view: View, pixels: Array) -> View:
    return View(view.name, view.corners._replace(pixels=view.corners.pixels + pixels))


def test_calibrations_that_are_refused() -> None:
    random = np.random.default_rng(3)
    views = seen.views(9, 0.1, random)
    with pytest.raises(CalibrationError, match="the board was found in 5 pictures"):
        calibration.calibrate_camera(views[:5], seen.SIZE)
    with pytest.raises(CalibrationError, match="of the picture; needed is 30%"):
        calibration.calibrate_camera(views, (1280, 960))
    bad = [*views]
    bad[4] = moved(views[4], random.normal(0.0, 1.5, (54, 2)))
    with pytest.raises(CalibrationError, match=r"^04\.png \([12]\.\d\d px\): .*more than 3 times"):
        calibration.calibrate_camera(bad, seen.SIZE)
    rough = [moved(view, random.normal(0.0, 0.6, (54, 2))) for view in views]
    with pytest.raises(CalibrationError, match=r"reprojection error of 0\.\d\d px"):
        calibration.calibrate_camera(rough, seen.SIZE)
    # Always the same frontal view: focal length and distance are not independent.
    pixels = seen.LENS.project(seen.CHESS.points, np.zeros(3), np.array([-0.1, -0.065, 0.23]))
    one = views[0].corners._replace(pixels=pixels)
    alike = [moved(View(view.name, one), random.normal(0.0, 0.1, (54, 2))) for view in views]
    with pytest.raises(CalibrationError, match="too similar"):
        calibration.calibrate_camera(alike, seen.SIZE)
    # The printed board itself in place of a picture of it: any distance fits.
    flat = [View(view.name, one._replace(pixels=one.object_points[:, :2] * 2500.0 + 20.0)) for view in views]
    with pytest.raises(CalibrationError, match=r"do not determine a camera|too similar"):
        calibration.calibrate_camera(flat, seen.SIZE)


def test_intrinsics_written_by_opencv(tmp_path: Path) -> None:
    camera = read_camera(seen.write_intrinsics(tmp_path / "camera.yml"))
    assert camera.size == (640, 480)
    np.testing.assert_array_equal(camera.matrix, seen.LENS.matrix)
    np.testing.assert_array_equal(camera.distortion, seen.LENS.distortion)
    four = seen.write_intrinsics(tmp_path / "four.yml", distortion_coefficients=seen.LENS.distortion[:4])
    np.testing.assert_array_equal(read_camera(four).distortion, [*seen.LENS.distortion[:4], 0.0])


PLACES = np.array([[0.2, 0.12], [0.4, 0.22], [0.6, 0.35], [0.5, 0.08], [0.25, 0.4]])


def exact() -> Calibration:
    random = np.random.default_rng(1)
    return assemble(seen.LENS, seen.plane_board(0.0, random), seen.stops(0.0, 0.0, random), seen.SIDE)


def test_mapping_and_back() -> None:
    found = exact()
    pixels = seen.pixels_of(PLACES)
    np.testing.assert_allclose(found.mapping.to_robot(pixels), PLACES, atol=1e-7)
    np.testing.assert_allclose(found.mapping.to_pixels(PLACES), pixels, atol=1e-4)
    assert found.quality["camera_from"] == "file"
    assert found.quality["camera_uncertainty"] == "taken as zero"
    assert found.quality["robot_scale"] == pytest.approx(1.0, abs=1e-5)
    assert found.quality["marker_side"] == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize(
    ("corner", "place", "camera"),
    [(0.15, 2e-4, "fitted"), (0.2, 2e-5, "known"), (0.02, 4e-4, "known")],
    ids=["all", "plane", "robot"],
)
def test_predicted_spread_is_the_true_error(corner: float, place: float, camera: str) -> None:
    """With all sources of error, and where the plane's picture or the robot is nearly all of it."""
    random = np.random.default_rng(5)
    pixels = seen.pixels_of(PLACES)
    normalised = []
    for _ in range(30):
        source: Any = seen.LENS
        if camera == "fitted":
            views = seen.views(9, corner, random, Board(type="chessboard", columns=6, rows=5, square=0.035))
            source = calibration.calibrate_camera(views, seen.SIZE)
        stops = seen.stops(min(corner, 0.1) if camera == "fitted" else 0.02, place, random)
        found = assemble(source, seen.plane_board(corner, random), stops, seen.SIDE)
        draws = np.array([found.resample(random).to_robot(pixels) for _ in range(40)])
        normalised.append((found.mapping.to_robot(pixels) - PLACES) / draws.std(axis=0))
    assert 0.8 < np.sqrt(np.mean(np.square(normalised))) < 1.25


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Entries]:
    folder = tmp_path_factory.mktemp("recording")
    return folder, seen.write_folder(folder, np.random.default_rng(11))


FROM_FILE = {"camera": recording.CameraEntry(intrinsics="camera.yml")}


def test_a_rendered_calibration(filmed: tuple[Path, Entries]) -> None:
    folder, entries = filmed
    found = calibrate_folder(folder, entries)
    pixels = seen.pixels_of(PLACES)
    assert np.abs(found.mapping.to_robot(pixels) - PLACES).max() < 3e-4
    random = np.random.default_rng(12)
    draws = np.array([found.resample(random).to_robot(pixels) for _ in range(100)])
    assert np.abs((found.mapping.to_robot(pixels) - PLACES) / draws.std(axis=0)).max() < 3.5
    for key in ("camera_rms", "plane_rms"):
        assert found.quality[key] < 0.2
    assert 6 <= found.quality["camera_views"] <= 9
    assert found.quality["stops"] == 9
    # The same with the camera from a file.
    given = calibrate_folder(folder, entries.model_copy(update=FROM_FILE))
    assert given.intrinsics is None
    assert np.abs(given.mapping.to_robot(pixels) - PLACES).max() < 3e-4
    assert given.resample(random).camera is given.mapping.camera
    assert found.resample(random).camera is not found.mapping.camera


def blank(folder: Path, name: str, size: tuple[int, int] = (640, 480)) -> None:
    cv2.imwrite(str(folder / name), np.full(size[::-1], 200, dtype=np.uint8))


GRID = "grid/robot.csv"


@pytest.mark.parametrize(
    ("spoil", "error", "message"),
    [
        (lambda f: (f / "plane.png").unlink(), InvalidInputError, r"plane\.png"),
        (lambda f: blank(f, "plane.png"), CalibrationError, r"plane\.png: the board was not found"),
        (lambda f: blank(f, "plane.png", (320, 240)), CalibrationError, r"plane\.png: 320 x 240 pixels"),
        (lambda f: (f / "camera.yml").unlink(), InvalidInputError, r"camera\.yml"),
        (lambda f: blank(f, "grid/4.png"), CalibrationError, r"4\.png: marker 7 of 4x4_50 was not found"),
        (lambda f: (f / "grid/4.png").unlink(), InvalidInputError, r"4\.png"),
        (lambda f: (f / GRID).unlink(), InvalidInputError, r"robot\.csv"),
        (lambda f: (f / GRID).write_bytes(b"\xff\xfe\x00"), InvalidInputError, r"robot\.csv"),
    ],
)
def test_calibrations_with_unusable_files(
    filmed: tuple[Path, Entries],
    tmp_path: Path,
    spoil: Callable[[Path], object],
    error: type[Exception],
    message: str,
) -> None:
    folder = copytree(filmed[0], tmp_path / "recording")
    spoil(folder)
    with pytest.raises(error, match=message):
        calibrate_folder(folder, filmed[1].model_copy(update=FROM_FILE))


@pytest.mark.parametrize("name", ["../secret.png", "/secret.png"])
def test_a_picture_outside_the_folder(tmp_path: Path, name: str) -> None:
    (tmp_path / "secret.png").touch()
    folder = tmp_path / "recording"
    folder.mkdir()
    (folder / "robot.csv").write_text(f"image,x,z\n{name},0,1\n", encoding="utf-8")
    with pytest.raises(InvalidInputError, match="inside the recording's folder"):
        find_stops(folder, "robot.csv", Marker("4x4_50", 7), seen.SIZE)


DESCRIBED = {"chessboard": seen.CHESS, "charuco": seen.CHARUCO}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Nine pictures of each board."""
    made = {}
    for name, board in DESCRIBED.items():
        random = np.random.default_rng(3)
        made[name] = tmp_path_factory.mktemp(name)
        for i, (turn, shift) in enumerate(seen.poses(9, random, board.points.mean(axis=0))):
            cv2.imwrite(str(made[name] / f"{i}.png"), seen.board_picture(board, turn, shift, random))
    return made


def words(board: Board, **changes: object) -> list[str]:
    known = {"columns": board.columns, "rows": board.rows, "square": board.square}
    if board.type == "charuco":
        known |= {"marker": board.marker, "dictionary": board.dictionary}
    return [
        "--board",
        board.type,
        *(text for key, value in (known | changes).items() for text in (f"--{key}", f"{value}")),
    ]


@pytest.mark.parametrize("name", DESCRIBED)
def test_a_good_calibration_is_accepted_and_written(
    name: str, folders: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "camera.yaml"
    assert cli.main(["calibrate", str(folders[name]), *words(DESCRIBED[name]), "--output", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["accepted"]
    assert all(picture["found"] and picture["rms"] < 0.2 for picture in found["pictures"])
    camera = read_camera(path)
    assert camera.size == seen.SIZE
    np.testing.assert_array_equal(camera.matrix, found["camera_matrix"])
    np.testing.assert_allclose(camera.matrix, seen.LENS.matrix, atol=8.0)


@pytest.mark.parametrize(
    ("name", "described", "text"),
    [
        pytest.param(
            *("chessboard", words(seen.CHESS, columns=8), "another board: chessboard with 9 x 6 inner corners"),
            marks=pytest.mark.slow,
        ),
        ("chessboard", words(seen.CHARUCO), "another board: chessboard with 9 x 6 inner corners"),
        pytest.param(
            *("charuco", words(seen.CHARUCO, columns=8), "do not lie as on one of 8 x 5 squares"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("charuco", words(seen.CHARUCO, rows=6), "on a board of 7 x 6 squares it is 20"), marks=pytest.mark.slow
        ),
        pytest.param(
            *("charuco", words(seen.CHARUCO, dictionary="4x4_50"), "its markers are of 5x5_100"), marks=pytest.mark.slow
        ),
        pytest.param(
            *("charuco", words(seen.CHESS, columns=6, rows=4), "another board: ChArUco, its markers are of 5x5_100"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_the_wrong_board_is_recognised(
    name: str,
    described: list[str],
    text: str,
    folders: dict[str, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "camera.yaml"
    assert cli.main(["calibrate", str(folders[name]), *described, "--output", str(path)]) == 4
    told = capsys.readouterr()
    assert "refused" in told.out
    assert text in told.err
    # What single pictures show may be a part of the reason; the reason itself is said once.
    reason = told.err.removeprefix("stripfold: error: ").strip()
    assert reason not in told.out
    assert "needed is" not in told.out
    assert not path.exists()


SIZE = 400, 300


def room(shift: tuple[float, float] = (0.0, 0.0), seed: int = 0, light: float = 1.0, wide: int = 480) -> Array:
    """A table before a wall with crosses on some width of it, as seen by a shifted camera, with noise."""
    picture = np.full((SIZE[1] + 80, SIZE[0] + 80), 60.0, np.float32)
    picture[280:] = 90.0
    for x in range(50, wide, 60):
        cv2.drawMarker(picture, (x, 80), (35.0,), cv2.MARKER_CROSS, 12, 3)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
    matrix = np.column_stack([np.eye(2), np.array(shift) - 40.0])
    seen = cv2.warpAffine(picture, matrix, SIZE, flags=cv2.INTER_CUBIC)
    gradient = light * np.linspace(1.2, 0.8, SIZE[0])
    return np.asarray(seen * gradient + np.random.default_rng(seed).normal(0.0, 1.0, seen.shape))


@pytest.mark.parametrize("shift", [(3.0, 0.0), (0.0, -2.2), (-2.1, 2.1), (9.6, -4.3), (-10.0, 10.0)])
def test_a_moved_camera_is_noticed_and_measured(shift: tuple[float, float]):
    found = camera_motion.between(room(), room(shift, 1, 0.8))
    assert found.moved
    np.testing.assert_allclose(found[:2], shift, atol=0.4)


def test_a_moved_camera_is_noticed_beside_what_a_recorder_writes():
    """That stays where it is, and has most of the clear corners."""
    pictures, writing = [room(), room((3.0, -2.0), 1)], np.zeros(SIZE[::-1], np.uint8)
    for y in range(250, 300, 15):
        cv2.putText(writing, "2026-11-29 10:00", (250, y), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255,), 1)
    for picture in pictures:
        picture[writing > 127] = 220.0
    assert camera_motion.between(*pictures).moved


def test_one_thing_that_gives_way_does_not_move_the_camera():
    """Far from all else it turns the picture that agrees with it, and so moves that one corner."""
    pictures = [room(wide=200), room(seed=1, wide=200)]
    for picture, y in zip(pictures, (270.0, 272.0), strict=True):
        spot = np.hypot(*(np.mgrid[: SIZE[1], : SIZE[0]] - np.array([y, 390.0])[:, None, None]))
        picture += 60.0 * np.exp(-0.5 * (spot / 2.0) ** 2)
    assert not camera_motion.between(*pictures).moved


def test_a_camera_at_rest_is_not():
    """In other light, with noise, and although something else moved or has come into view."""
    first, second = room(), room(seed=1, light=0.7)
    second[60:130, 40:90] = landscape(1, 70, 50)
    first[110:140, 150:180], second[110:140, 156:186] = 2 * [landscape(2, 30, 30)]
    found = camera_motion.between(first, second)
    np.testing.assert_allclose(found[:2], 0.0, atol=0.4)
    assert not found.moved
    assert found.problem == ""


def film(jump: tuple[float, float], camera: bool, at: int = 30) -> tuple[Track, Thumbnails]:
    """A film of a marker that starts to move and jumps, with the picture or alone."""
    time = np.arange(60) / 20.0
    centre = np.column_stack([100.0 + 8.0 * np.clip(time - 0.5, 0.0, None), np.full(60, 50.0)])
    centre += np.random.default_rng(3).normal(0.0, 0.05, centre.shape)
    centre[at:] += jump
    kept = Thumbnails(SIZE)
    pictures: list[Picture] = [
        np.clip(room(jump if camera and k >= at else (0.0, 0.0), k), 0, 255).astype(np.uint8) for k in range(60)
    ]
    kept.pictures = pictures
    ones = np.ones(60)
    return Track(time, centre, np.zeros((60, 4, 2)), np.ones((60, 2)), ones, ones > 0.0), kept


def test_a_knock_in_the_film():
    found = camera_motion.knock(*film((2.6, -2.0), True))
    assert found is not None
    assert found[0] == pytest.approx(1.5, abs=0.15)
    np.testing.assert_allclose(found[1], (2.6, -2.0), atol=0.3)
    assert camera_motion.knock(*film((0.0, 0.0), True)) is None
    # The robot jerks, the camera stands still.
    assert camera_motion.knock(*film((2.6, -2.0), False)) is None
