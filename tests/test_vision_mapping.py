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
from stripfold.base.arrays import Array
from stripfold.base.errors import CalibrationError, InvalidInputError
from stripfold.film import intrinsics, recording
from stripfold.film.boards import Board
from stripfold.film.calibration import Calibration, assemble, calibrate_folder
from stripfold.film.mapping import fit_similarity, scale, transform
from stripfold.film.marker import Marker
from stripfold.film.recording import Entries
from stripfold.film.robot_grid import Stops, find_stops

PLACES = np.array([[0.2, 0.12], [0.4, 0.22], [0.6, 0.35], [0.5, 0.08], [0.25, 0.4]])


@pytest.mark.parametrize("mirrored", [False, True])
def test_similarity(mirrored: bool) -> None:
    random = np.random.default_rng(0)
    plane = random.normal(size=(7, 2))
    # By complex numbers: z -> a z + b, or a times its conjugate.
    z = plane[:, 0] + 1j * plane[:, 1]
    w = 1.7 * np.exp(0.4j) * (np.conj(z) if mirrored else z) + (0.3 - 0.8j)
    robot = np.column_stack([w.real, w.imag])
    found = fit_similarity(plane, robot)
    np.testing.assert_allclose(transform(found, plane), robot, atol=1e-12)
    assert scale(found) == pytest.approx(1.7)
    # With noise no neighbouring similarity has a smaller sum of squares.
    rough = robot + random.normal(0.0, 0.1, robot.shape)
    best = fit_similarity(plane, rough)
    least = np.sum((transform(best, plane) - rough) ** 2)
    for factor, shift in ((1.001, 0.0), (0.999, 0.0), (np.exp(0.001j), 0.0), (np.exp(-0.001j), 0.0), (1.0, 0.001)):
        a = factor * (best[0, 0] + 1j * best[1, 0])
        other = np.array([[a.real, -a.imag, best[0, 2] + shift], [a.imag, a.real, best[1, 2]], [0.0, 0.0, 1.0]])
        other[:2, 1] *= -1.0 if mirrored else 1.0
        assert np.sum((transform(other, plane) - rough) ** 2) > least


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
            source = intrinsics.calibrate(views, seen.SIZE)
        stops = seen.stops(min(corner, 0.1) if camera == "fitted" else 0.02, place, random)
        found = assemble(source, seen.plane_board(corner, random), stops, seen.SIDE)
        draws = np.array([found.resample(random).to_robot(pixels) for _ in range(40)])
        normalised.append((found.mapping.to_robot(pixels) - PLACES) / draws.std(axis=0))
    assert 0.8 < np.sqrt(np.mean(np.square(normalised))) < 1.25


def placed(change: Callable[[Array], Any]) -> Callable[[Stops], Stops]:
    return lambda stops: stops._replace(places=np.array(change(stops.places)))


def one_moved(places: Array) -> Array:
    return places + np.outer(np.arange(len(places)) == 4, [0.0, 0.006])


def interchanged(places: Array) -> Array:
    return places[[0, 5, 2, 3, 4, 1, 6, 7, 8]]


def repeated(stops: Stops) -> Stops:
    return Stops(stops.names[:6], *(values[[0, 1, 2, 0, 1, 2]] for values in stops[1:]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda stops: Stops(*(values[:5] for values in stops)), "5 stops; needed is 6"),
        (repeated, "on a line"),
        (placed(lambda places: places * [1.0, 0.01]), "on a line"),
        (placed(one_moved), r"^4\.png: a stop 6\.\d mm from"),
        (
            placed(lambda places: places * np.where(np.arange(9) == 4, 100.0, 1.0)[:, None]),
            r"^4\.png: .* decimal point",
        ),
        (placed(interchanged), r"a stop \d+\.\d mm from"),
        (placed(lambda places: places * 1000.0), r"is 1e\+03 m of the robot"),
        (placed(lambda places: places * 1.05), r"is 1\.05 m of the robot"),
        (placed(lambda places: places[:, ::-1]), "rotated by 9. degrees"),
        (placed(lambda places: places * [1.0, -1.0]), "rotated by 1.. degrees"),
    ],
)
def test_robot_grids_that_are_refused(change: Callable[[Stops], Stops], message: str) -> None:
    random = np.random.default_rng(8)
    stops = change(seen.stops(0.05, 1e-4, random))
    with pytest.raises(CalibrationError, match=message):
        assemble(seen.LENS, seen.plane_board(0.05, random), stops, seen.SIDE)


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Entries]:
    folder = tmp_path_factory.mktemp("recording")
    return folder, seen.write_folder(folder, np.random.default_rng(11))


FROM_FILE = {"camera": recording.Camera(intrinsics="camera.yml")}


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
