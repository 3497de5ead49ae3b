"""Detection of boards, camera intrinsics and their acceptance, and files that cannot be used."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

import boards_seen as seen
from stripfold.base.arrays import Array
from stripfold.base.errors import CalibrationError, InvalidInputError
from stripfold.film import boards, intrinsics
from stripfold.film.boards import Board, Refinement, detect
from stripfold.film.camera import read_camera
from stripfold.film.intrinsics import View
from stripfold.film.pictures import read_calibration_picture

TURN, SHIFT = np.array([0.25, -0.3, 0.1]), np.array([-0.12, -0.07, 0.42])
BOARDS = pytest.mark.parametrize("board", [seen.CHESS, seen.CHARUCO], ids=["chessboard", "charuco"])


def error(found: Array, true: Array) -> float:
    """RMS distance to the nearest true corner, pixels: a chessboard may be numbered from its other end."""
    return float(np.sqrt(np.mean(np.linalg.norm(found[:, None] - true, axis=-1).min(axis=1) ** 2)))


def test_window_is_proportional_to_the_spacing_of_the_corners() -> None:
    far = np.array([-0.1, -0.06, 1.05])
    image = seen.board_picture(seen.CHESS, TURN, far, np.random.default_rng(1))
    true = seen.LENS.project(seen.CHESS.points, TURN, far)
    scaled, fixed = detect(image, seen.CHESS), detect(image, seen.CHESS, Refinement(11))
    assert scaled is not None
    assert fixed is not None
    assert error(scaled.pixels, true) < 0.12
    assert error(fixed.pixels, true) > 0.5


def test_blurred_charuco_board() -> None:
    """Markers that cannot be read are found by those that can, and no corner's window is within the blur."""
    far = np.array([-0.08, -0.06, 0.65])
    board = seen.CHARUCO.model_copy(update={"marker": 0.0234})
    image = seen.board_picture(board, TURN, far, np.random.default_rng(1), 1.2)
    true = seen.LENS.project(board.points, TURN, far)
    found = detect(image, board)
    assert found is not None
    assert len(found.ids) == len(true)
    assert error(found.pixels, true) < 0.12


def test_chessboard_is_found_in_noise() -> None:
    random = np.random.default_rng(1)
    far = np.array([-0.1, -0.06, 0.75])
    image = seen.board_picture(seen.CHESS, TURN, far, random, 1.2)
    dark = np.clip(np.round(0.1 * image + random.normal(0.0, 4.0, image.shape)), 0, 255).astype(np.uint8)
    found = detect(dark, seen.CHESS)
    assert found is not None
    assert error(found.pixels, seen.LENS.project(seen.CHESS.points, TURN, far)) < 1.0


def test_part_of_a_charuco_board() -> None:
    image = seen.board_picture(seen.CHARUCO, TURN, SHIFT, np.random.default_rng(2))
    true = seen.LENS.project(seen.CHARUCO.points, TURN, SHIFT)
    image[:, int(true[:, 0].mean()) :] = seen.PAPER
    corners = detect(image, seen.CHARUCO)
    assert corners is not None
    assert boards.MIN_CORNERS <= len(corners.ids) < len(true)
    np.testing.assert_allclose(corners.pixels, true[corners.ids], atol=0.3)


def test_a_board_described_with_fewer_rows_gives_the_same_corners() -> None:
    """The mapping then has fewer of them, and is the same but for their noise."""
    image = seen.board_picture(seen.CHARUCO, TURN, SHIFT, np.random.default_rng(2))
    corners = detect(image, seen.CHARUCO.model_copy(update={"rows": 4}))
    assert corners is not None
    assert len(corners.ids) == 18
    assert error(corners.pixels, seen.LENS.project(corners.object_points, TURN, SHIFT)) < 0.1


@BOARDS
def test_no_board(board: Board) -> None:
    random = np.random.default_rng(3)
    assert detect(np.full((480, 640), 128, dtype=np.uint8), board) is None
    assert detect(random.integers(0, 255, (480, 640), dtype=np.uint8), board) is None
    other = Board(type="chessboard", columns=7, rows=4, square=0.025) if board is seen.CHARUCO else seen.CHARUCO
    assert detect(seen.board_picture(other, TURN, SHIFT, random), board) is None


def test_folders_of_pictures(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="existing folder"):
        intrinsics.find_views(tmp_path / "none", seen.CHESS)
    (tmp_path / "notes.txt").write_text("not a picture")
    with pytest.raises(InvalidInputError, match="it has 0"):
        intrinsics.find_views(tmp_path, seen.CHESS)
    turned = Image.new("L", (64, 48))
    turned.getexif()[274] = 6  # the rotation that EXIF asks for is ignored, as a video has none
    turned.save(tmp_path / "1.jpg", exif=turned.getexif())
    assert read_calibration_picture(tmp_path / "1.jpg", (64, 48)).shape == (48, 64)
    Image.new("L", (48, 64)).save(tmp_path / "2.png")
    with pytest.raises(CalibrationError, match=r"2\.png: 48 x 64 pixels; needed is 64 x 48"):
        intrinsics.find_views(tmp_path, seen.CHESS)
    (tmp_path / "2.png").unlink()
    assert intrinsics.find_views(tmp_path, seen.CHESS) == ([], (64, 48))


def test_fit_is_reproducible() -> None:
    threads, views = cv2.getNumThreads(), seen.views(12, 0.2, np.random.default_rng(6))
    found = [intrinsics.parameters(intrinsics.fit(views, seen.SIZE).camera) for _ in range(6)]
    assert np.ptp(found, axis=0).max() == 0.0
    assert cv2.getNumThreads() == threads


def test_calibration_finds_the_camera() -> None:
    exact = intrinsics.calibrate(seen.views(9, 0.0, np.random.default_rng(0)), seen.SIZE)
    true = intrinsics.parameters(seen.LENS)
    np.testing.assert_allclose(intrinsics.parameters(exact.camera), true, rtol=1e-4, atol=1e-4)
    assert exact.rms < 1e-4
    random = np.random.default_rng(1)
    views = seen.views(12, 0.2, random)
    found = intrinsics.calibrate(views, seen.SIZE)
    # Both coordinates of a corner have noise of 0.2 px.
    assert found.rms == pytest.approx(0.2 * np.sqrt(2.0), rel=0.06)
    sd = np.sqrt(np.diag(found.covariance))
    assert np.all(np.abs(intrinsics.parameters(found.camera) - true) < 4.0 * sd)
    assert 0.0 < found.split_half < 0.3
    # OpenCV's own standard deviations, from its full normal matrix.
    points = [view.corners.object_points.astype(np.float32) for view in views]
    pixels = [view.corners.pixels.astype(np.float32) for view in views]
    theirs = cv2.calibrateCameraExtended(points, pixels, seen.SIZE, np.eye(3), np.zeros(5))[5].ravel()[:9]
    np.testing.assert_allclose(sd, theirs, rtol=0.02)
    drawn = np.array([intrinsics.parameters(found.draw(random)) for _ in range(2000)])
    np.testing.assert_allclose(drawn.std(axis=0), found.inflation * theirs, rtol=0.1)
    np.testing.assert_allclose(np.corrcoef(drawn.T)[0, 1], found.covariance[0, 1] / sd[0] / sd[1], atol=0.05)


def test_correlated_residuals_inflate_the_uncertainty() -> None:
    """A board that is bent differently in each view."""
    random = np.random.default_rng(2)
    bent = []
    for view in seen.views(12, 0.02, random):
        x, y = ((view.corners.object_points[:, :2] / [0.2, 0.125]) - 0.5).T
        bent.append(moved(view, np.column_stack([x * x - x * y, y * y + x * y]) @ random.normal(0.0, 0.5, (2, 2))))
    found = intrinsics.calibrate(bent, seen.SIZE)
    errors = intrinsics.parameters(found.camera) - intrinsics.parameters(seen.LENS)
    naive = np.sqrt(np.mean(errors**2 / np.diag(found.covariance)))
    assert found.inflation > 2.0
    assert naive > 1.5
    assert naive / found.inflation < 2.0


def moved(view: View, pixels: Array) -> View:
    return View(view.name, view.corners._replace(pixels=view.corners.pixels + pixels))


def test_calibrations_that_are_refused() -> None:
    random = np.random.default_rng(3)
    views = seen.views(9, 0.1, random)
    with pytest.raises(CalibrationError, match="the board was found in 5 pictures"):
        intrinsics.calibrate(views[:5], seen.SIZE)
    with pytest.raises(CalibrationError, match="of the picture; needed is 30%"):
        intrinsics.calibrate(views, (1280, 960))
    bad = [*views]
    bad[4] = moved(views[4], random.normal(0.0, 1.5, (54, 2)))
    with pytest.raises(CalibrationError, match=r"^04\.png \([12]\.\d\d px\): .*more than 3 times"):
        intrinsics.calibrate(bad, seen.SIZE)
    rough = [moved(view, random.normal(0.0, 0.6, (54, 2))) for view in views]
    with pytest.raises(CalibrationError, match=r"reprojection error of 0\.\d\d px"):
        intrinsics.calibrate(rough, seen.SIZE)
    # Always the same frontal view: focal length and distance are not independent.
    pixels = seen.LENS.project(seen.CHESS.points, np.zeros(3), np.array([-0.1, -0.065, 0.23]))
    one = views[0].corners._replace(pixels=pixels)
    alike = [moved(View(view.name, one), random.normal(0.0, 0.1, (54, 2))) for view in views]
    with pytest.raises(CalibrationError, match="too similar"):
        intrinsics.calibrate(alike, seen.SIZE)
    # The printed board itself in place of a picture of it: any distance fits.
    flat = [View(view.name, one._replace(pixels=one.object_points[:, :2] * 2500.0 + 20.0)) for view in views]
    with pytest.raises(CalibrationError, match=r"do not determine a camera|too similar"):
        intrinsics.calibrate(flat, seen.SIZE)


def test_intrinsics_written_by_opencv(tmp_path: Path) -> None:
    camera = read_camera(seen.write_intrinsics(tmp_path / "camera.yml"))
    assert camera.size == (640, 480)
    np.testing.assert_array_equal(camera.matrix, seen.LENS.matrix)
    np.testing.assert_array_equal(camera.distortion, seen.LENS.distortion)
    four = seen.write_intrinsics(tmp_path / "four.yml", distortion_coefficients=seen.LENS.distortion[:4])
    np.testing.assert_array_equal(read_camera(four).distortion, [*seen.LENS.distortion[:4], 0.0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"image_width": None}, "image_width is missing"),
        ({"camera_matrix": None}, "camera_matrix is missing"),
        ({"image_width": 6.5}, "pixels long"),
        ({"image_height": -480}, "pixels long"),
        ({"camera_matrix": 3}, "rows, cols and data"),
        ({"camera_matrix": np.eye(2)}, "without skew"),
        ({"camera_matrix": np.full((3, 3), np.nan)}, "finite|Nan"),
        ({"camera_matrix": np.diag([-500.0, 500.0, 1.0])}, "focal length"),
        ({"camera_matrix": seen.LENS.matrix * [1, 1, 3] / [[1], [1], [3]]}, "principal point"),
        ({"distortion_coefficients": np.ones(8)}, "8 numbers"),
        ({"distortion_coefficients": np.ones(2)}, "2 numbers"),
    ],
)
def test_impossible_intrinsics(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        read_camera(seen.write_intrinsics(tmp_path / "camera.yml", **changes))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00\x01\xff\xfe",
        b"%YAML:1.0\n---\n",
        b"%YAML:1.0\n---\n- 1\n",
        b"%YAML:1.0\n---\na: " + b"[" * 20_000,
        b"%YAML:1.0\n---\n" + b"- " * 20_000,
        b"%YAML:1.0\n---\n" + b"{ a: " * 20_000,
        b"%YAML:1.0\n---\n!!python/object/apply:os.getcwd []\n",
        b"%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix [1]\n",
        b"%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 2000000000\n"
        b"   cols: 2000000000\n   dt: d\n   data: [ 1. ]\n",
        b"#" * 300_000,
    ],
)
def test_hostile_intrinsics(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "camera.yml").write_bytes(content)
    with pytest.raises(InvalidInputError, match=r"camera\.yml"):
        read_camera(tmp_path / "camera.yml")
    with pytest.raises(InvalidInputError, match="existing file"):
        read_camera(tmp_path)


@pytest.mark.parametrize("value", [".nan", ".inf", "-.inf"])
def test_intrinsics_that_are_not_finite(tmp_path: Path, value: str) -> None:
    path = seen.write_intrinsics(tmp_path / "camera.yml")
    path.write_text(re.sub(r"-2\.\d+e-01|-0\.2\d*", value, path.read_text(), count=1))
    with pytest.raises(InvalidInputError, match="not finite"):
        read_camera(path)
