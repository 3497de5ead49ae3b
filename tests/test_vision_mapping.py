"""From pixels to the robot: the mapping, its acceptance, its uncertainty, and a whole rendered calibration."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from shutil import copytree
from typing import Any

import cv2
import numpy as np
import pytest

import boards_seen as seen
from stripfold.arrays import Array
from stripfold.errors import CalibrationError, InvalidInputError
from stripfold.vision import calibrated, calibration, markers, pictures, robot_grid
from stripfold.vision.boards import Board
from stripfold.vision.calibrated import Calibration
from stripfold.vision.camera import Camera
from stripfold.vision.mapping import Mapping, Similarity
from stripfold.vision.robot_grid import Stop

PLACES = np.array([[0.2, 0.12], [0.4, 0.22], [0.6, 0.35], [0.5, 0.08], [0.25, 0.4]])
IDEAL = Camera(np.array([[800.0, 0.0, 319.5], [0.0, 800.0, 239.5], [0.0, 0.0, 1.0]]), np.zeros(5), (640, 480))


@pytest.mark.parametrize("mirrored", [False, True])
def test_similarity(mirrored: bool) -> None:
    random = np.random.default_rng(0)
    plane = random.normal(size=(7, 2))
    # By complex numbers: z -> a z + b, or a times its conjugate.
    z = plane[:, 0] + 1j * plane[:, 1]
    w = 1.7 * np.exp(0.4j) * (np.conj(z) if mirrored else z) + (0.3 - 0.8j)
    robot = np.column_stack([w.real, w.imag])
    found = Similarity.fit(plane, robot)
    assert found.mirrored is mirrored
    assert found.scale == pytest.approx(1.7)
    assert found.angle == pytest.approx(0.4)
    np.testing.assert_allclose(found.shift, [0.3, -0.8], atol=1e-12)
    np.testing.assert_allclose(found.apply(plane), robot, atol=1e-12)
    np.testing.assert_allclose(found.invert(robot), plane, atol=1e-12)
    # Least squares: with errors, no other is better.
    rough = robot + random.normal(0.0, 0.1, robot.shape)
    best = Similarity.fit(plane, rough)
    least = np.sum((best.apply(plane) - rough) ** 2)
    for scale, angle, shift in ((1.001, 0.0, 0.0), (1.0, 0.001, 0.0), (1.0, 0.0, 0.001), (0.999, -0.001, 0.0)):
        other = Similarity(best.scale * scale, best.angle + angle, best.shift + shift, best.mirrored)
        assert np.sum((other.apply(plane) - rough) ** 2) > least


def exact() -> Calibration:
    random = np.random.default_rng(1)
    return calibrated.assemble(seen.LENS, seen.plane_board(0.0, random), seen.stops(0.0, 0.0, random), seen.SIDE)


def test_mapping_and_back() -> None:
    found = exact()
    pixels = seen.pixels_of(PLACES)
    np.testing.assert_allclose(found.mapping.to_robot(pixels), PLACES, atol=2e-6)
    np.testing.assert_allclose(found.mapping.to_pixels(PLACES), pixels, atol=2e-3)
    assert found.mapping.robot.mirrored
    assert found.quality["camera_from"] == "file"
    assert found.quality["camera_uncertainty"] == "taken as zero"
    assert found.quality["robot_scale"] == pytest.approx(1.0, abs=1e-5)
    assert found.quality["marker_side"] == pytest.approx(1.0, abs=1e-5)


def test_resolution_of_a_frontal_plane() -> None:
    plane = np.array([[0.002, 0.0, -0.3], [0.0, 0.002, -0.2], [0.0, 0.0, 1.0]])
    frontal = Mapping(IDEAL, plane, Similarity(1.01, 0.3, np.zeros(2), True))
    np.testing.assert_allclose(frontal.resolution(np.array([[3.0, 4.0], [300.0, 200.0]])), 0.00202, rtol=1e-6)
    # With a tilt: the area that a small square of pixels covers, by its corners.
    mapping = exact().mapping
    corners = mapping.to_robot(np.array([[400.0, 300.0], [402.0, 300.0], [402.0, 302.0], [400.0, 302.0]]))
    area = cv2.contourArea(((corners - corners[0]) * 1e3).astype(np.float32)) * 1e-6
    assert mapping.resolution(np.array([[401.0, 301.0]]))[0] == pytest.approx(np.sqrt(area) / 2.0, rel=1e-3)


def test_predicted_spread_is_the_true_error() -> None:
    random = np.random.default_rng(5)
    pixels = seen.pixels_of(PLACES)
    normalised = []
    board = Board("chessboard", 6, 5, 0.035)
    for _ in range(60):
        intrinsics = calibration.calibrate(seen.views(9, 0.15, random, board), seen.SIZE)
        stops = seen.stops(0.1, 2e-4, random)
        found = calibrated.assemble(intrinsics, seen.plane_board(0.15, random), stops, seen.SIDE)
        draws = np.array([found.resample(random).to_robot(pixels) for _ in range(40)])
        normalised.append((found.mapping.to_robot(pixels) - PLACES) / draws.std(axis=0))
    assert 0.8 < np.sqrt(np.mean(np.square(normalised))) < 1.25


@pytest.mark.parametrize(("corner", "slack"), [(0.2, 2e-5), (0.02, 5e-4)])
def test_each_part_of_the_spread(corner: float, slack: float) -> None:
    """Where the plane's picture, or the robot, is nearly all of the error, the camera being exact."""
    random = np.random.default_rng(6)
    pixels = seen.pixels_of(PLACES)
    normalised = []
    for _ in range(60):
        board, stops = seen.plane_board(corner, random), seen.stops(0.02, slack, random)
        found = calibrated.assemble(seen.LENS, board, stops, seen.SIDE)
        draws = np.array([found.resample(random).to_robot(pixels) for _ in range(40)])
        normalised.append((found.mapping.to_robot(pixels) - PLACES) / draws.std(axis=0))
    assert 0.8 < np.sqrt(np.mean(np.square(normalised))) < 1.25


def test_draws_come_from_their_generator() -> None:
    random = np.random.default_rng(7)
    found = calibrated.assemble(
        calibration.calibrate(seen.views(9, 0.1, random), seen.SIZE),
        seen.plane_board(0.1, random),
        seen.stops(0.1, 1e-4, random),
        seen.SIDE,
    )
    one, same, other = (found.resample(np.random.default_rng(seed)).to_robot(PLACES * 500.0) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert np.all(one != other)


def test_where_the_mapping_is_known() -> None:
    found = exact()
    inside, outside = PLACES[:3], np.array([[0.0, 0.2], [0.4, 0.45], [0.8, 0.2]])
    assert found.covers(seen.pixels_of(inside)).all()
    assert not found.covers(seen.pixels_of(outside)).any()


def shifted(index: int, by: Array) -> Callable[[list[Stop]], list[Stop]]:
    return lambda stops: [stop._replace(place=stop.place + by * (i == index)) for i, stop in enumerate(stops)]


def placed(change: Callable[[Array], Array]) -> Callable[[list[Stop]], list[Stop]]:
    return lambda stops: [stop._replace(place=change(stop.place)) for stop in stops]


def interchanged(stops: list[Stop]) -> list[Stop]:
    return [
        stop._replace(place=stops[{1: 5, 5: 1}.get(i, i)].place)  # two rows of the table
        for i, stop in enumerate(stops)
    ]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda stops: stops[:5], "5 stops; needed is 6"),
        (lambda stops: [*stops[:3], *(stop._replace(name="again") for stop in stops[:3])], "on a line"),
        (placed(lambda place: place * [1.0, 0.01]), "on a line"),
        (shifted(4, np.array([0.0, 0.006])), r"^4\.png: a stop 6\.\d mm from"),
        (interchanged, r"a stop \d+\.\d mm from"),
        (placed(lambda place: place * 1000.0), r"that is 1e\+03 m of the robot's"),
        (placed(lambda place: place * 1.05), r"that is 1\.05 m"),
        (placed(lambda place: place[::-1]), "turned by 9. degrees"),
        (placed(lambda place: place * [1.0, -1.0]), "turned by 1.. degrees"),
    ],
)
def test_robot_grids_that_are_refused(change: Callable[[list[Stop]], list[Stop]], told: str) -> None:
    random = np.random.default_rng(8)
    stops = change(seen.stops(0.05, 1e-4, random))
    with pytest.raises(CalibrationError, match=told):
        calibrated.assemble(seen.LENS, seen.plane_board(0.05, random), stops, seen.SIDE)


def test_planes_that_are_refused() -> None:
    random = np.random.default_rng(9)
    board, stops = seen.plane_board(0.05, random), seen.stops(0.05, 1e-4, random)
    with pytest.raises(CalibrationError, match=r"wall\.png: corners 1\.\d+ px off a plane"):
        calibrated.assemble(seen.LENS, seen.plane_board(0.8, random), stops, seen.SIDE, "wall.png")
    # Another camera's lens: the board's lines are not straight.
    with pytest.raises(CalibrationError, match="same zoom"):
        calibrated.assemble(Camera(seen.LENS.matrix, np.zeros(5), seen.SIZE), board, stops, seen.SIDE)
    wrong = board._replace(object_points=board.object_points * 0.9)
    with pytest.raises(CalibrationError, match=r"board's square as described"):
        calibrated.assemble(seen.LENS, wrong, stops, seen.SIDE)
    with pytest.raises(CalibrationError, match=r"sides 0\.75 times"):
        calibrated.assemble(seen.LENS, board, stops, seen.SIDE / 0.75)


@pytest.mark.parametrize("name", ["4x4_50", "6x6_250", "apriltag_36h11"])
def test_markers(name: str) -> None:
    place = np.array([0.42, 0.21])
    image = seen.marker_picture(name, 3, place, np.random.default_rng(10))
    found = markers.find(image, name, 3)
    assert found is not None
    np.testing.assert_allclose(found.centre, seen.pixels_of(place)[0], atol=0.1)
    np.testing.assert_allclose(found.corners, seen.pixels_of(seen.square(place)), atol=0.6)
    assert 0.8 < found.score <= 1.0
    near = markers.find(image, name, 3, found.centre + np.array([4.0, -3.0]), 20.0)
    assert near is not None
    np.testing.assert_allclose(near.centre, found.centre, atol=0.02)
    assert markers.find(image, name, 4) is None
    assert markers.find(image, name, 3, found.centre + np.array([100.0, 0.0]), 20.0) is None
    assert markers.find(image, name, 3, np.array([-500.0, 9000.0]), 20.0) is None


def test_diagonals_cross_in_the_middle_of_a_square_seen_aslant() -> None:
    slant = np.array([[1.0, 0.2, 5.0], [0.1, 0.9, 3.0], [0.1, 0.3, 1.0]])
    seen_corners = cv2.perspectiveTransform(np.array([[[-1.0, 1], [1, 1], [1, -1], [-1, -1]]]), slant)[0]
    middle = cv2.perspectiveTransform(np.zeros((1, 1, 2)), slant)[0, 0]
    np.testing.assert_allclose(markers.crossing(seen_corners), middle, atol=1e-12)
    assert np.linalg.norm(seen_corners.mean(axis=0) - middle) > 0.1


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("recording")
    return folder, seen.write_folder(folder, np.random.default_rng(11))


def test_a_rendered_calibration(filmed: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    folder, recording = filmed
    found = calibrated.calibrate_folder(folder, recording)
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
    given = calibrated.calibrate_folder(folder, recording | FROM_FILE)
    assert given.intrinsics is None
    assert np.abs(given.mapping.to_robot(pixels) - PLACES).max() < 3e-4
    assert given.resample(random).camera is given.mapping.camera
    assert found.resample(random).camera is not found.mapping.camera


FROM_FILE = {"camera": {"intrinsics": "camera.yml"}}


def replaced(folder: Path, name: str, text: str) -> None:
    (folder / name).write_text(text, encoding="utf-8")


def blank(folder: Path, name: str, size: tuple[int, int] = (640, 480)) -> None:
    cv2.imwrite(str(folder / name), np.full(size[::-1], 200, dtype=np.uint8))


GRID = "grid/robot.csv"


@pytest.mark.parametrize(
    ("spoil", "error", "told"),
    [
        (lambda f: (f / "plane.png").unlink(), InvalidInputError, r"plane\.png"),
        (lambda f: blank(f, "plane.png"), CalibrationError, r"plane\.png: no board as described"),
        (lambda f: blank(f, "plane.png", (320, 240)), CalibrationError, r"plane\.png: 320 x 240 pixels"),
        (lambda f: (f / "camera.yml").unlink(), InvalidInputError, r"camera\.yml"),
        (lambda f: blank(f, "grid/4.png"), CalibrationError, r"4\.png: no marker 7 of 4x4_50"),
        (lambda f: (f / "grid/4.png").unlink(), InvalidInputError, r"4\.png"),
        (lambda f: (f / GRID).unlink(), InvalidInputError, r"robot\.csv"),
        (lambda f: replaced(f, GRID, ""), InvalidInputError, "header image,x,z"),
        (lambda f: replaced(f, GRID, "image,z,x\n0.png,1,2\n"), InvalidInputError, "header image,x,z"),
        (lambda f: replaced(f, GRID, "image,x,z\n0.png,1\n"), InvalidInputError, "not enough values"),
        (lambda f: replaced(f, GRID, "image,x,z\n0.png,a,1\n"), InvalidInputError, "could not convert"),
        (lambda f: replaced(f, GRID, "image,x,z\n0.png,nan,1\n"), InvalidInputError, "not finite"),
        (lambda f: replaced(f, GRID, "image,x,z\n0.png,0,1\n0.png,1,1\n"), InvalidInputError, "twice"),
        (lambda f: replaced(f, GRID, "image,x,z\n" + "0.png,0,1\n" * 20000), InvalidInputError, "image,x,z"),
        (lambda f: replaced(f, GRID, "image,x,z\n"), CalibrationError, "0 stops"),
        (lambda f: (f / GRID).write_bytes(b"\xff\xfe\x00"), InvalidInputError, r"robot\.csv"),
    ],
)
def test_calibrations_that_miss_something(
    filmed: tuple[Path, dict[str, Any]],
    tmp_path: Path,
    spoil: Callable[[Path], object],
    error: type[Exception],
    told: str,
) -> None:
    folder = copytree(filmed[0], tmp_path / "recording")
    spoil(folder)
    with pytest.raises(error, match=told):
        calibrated.calibrate_folder(folder, filmed[1] | FROM_FILE)


def test_a_bad_picture_among_the_views(filmed: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    folder = copytree(filmed[0], tmp_path / "recording")
    blank(folder, "camera/3.png", (320, 240))
    with pytest.raises(CalibrationError, match=r"3\.png: 320 x 240"):
        calibrated.calibrate_folder(folder, filmed[1])
    replaced(folder, "camera/3.png", "text")
    with pytest.raises(InvalidInputError, match=r"3\.png"):
        calibrated.calibrate_folder(folder, filmed[1])


def test_too_many_stops(tmp_path: Path) -> None:
    rows = [f"{i}.png,{i},0" for i in range(robot_grid.MOST + 1)]
    replaced(tmp_path, "robot.csv", "\n".join(["image,x,z", *rows]))
    with pytest.raises(InvalidInputError, match="it has 101 rows"):
        robot_grid.read(tmp_path / "robot.csv")


def test_pictures_of_the_camera(tmp_path: Path) -> None:
    blank(tmp_path, "a.png", (64, 48))
    assert pictures.of_size(tmp_path / "a.png", (64, 48)).shape == (48, 64)
