"""Detection of boards, camera intrinsics and their acceptance, and files that cannot be used."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

import boards_seen as seen
from stripfold.base.arrays import Array
from stripfold.base.errors import CalibrationError, InvalidInputError
from stripfold.film import intrinsics
from stripfold.film.boards import Board, detect
from stripfold.film.camera import read_camera
from stripfold.film.intrinsics import View
from stripfold.film.pictures import read_calibration_picture

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
