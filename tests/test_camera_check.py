"""`stripfold calibrate`: what is said of each picture, and what is accepted and refused."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

import boards_seen as seen
from stripfold import cli
from stripfold.film import camera_check
from stripfold.film.boards import Board
from stripfold.film.camera import read_camera

Change = Callable[[np.ndarray], np.ndarray]
BOARDS = {"chessboard": seen.CHESS, "charuco": seen.CHARUCO}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Nine pictures of each board."""
    made = {}
    for name, board in BOARDS.items():
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


@pytest.mark.parametrize("name", BOARDS)
def test_a_good_calibration_is_accepted_and_written(
    name: str, folders: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "camera.yaml"
    assert cli.main(["calibrate", str(folders[name]), *words(BOARDS[name]), "--output", str(path), "--json"]) == 0
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
        ("chessboard", words(seen.CHESS, columns=8), "another board: chessboard with 9 x 6 inner corners"),
        ("chessboard", words(seen.CHARUCO), "another board: chessboard with 9 x 6 inner corners"),
        ("charuco", words(seen.CHARUCO, columns=6), "another board: marker 16 is not on one of 6 x 5 squares"),
        ("charuco", words(seen.CHARUCO, columns=8), "do not lie as on one of 8 x 5 squares"),
        ("charuco", words(seen.CHARUCO, rows=6), "no marker after 16 is in any picture"),
        ("charuco", words(seen.CHARUCO, dictionary="4x4_50"), "its markers are of 5x5_100"),
        ("charuco", words(seen.CHESS, columns=6, rows=4), "another board: ChArUco, with markers of 5x5_100"),
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


def test_views_too_few_for_a_fit_have_no_error(folders: dict[str, Path], tmp_path: Path) -> None:
    shutil.copy(folders["chessboard"] / "0.png", tmp_path)
    assert ("0.png", "found") in camera_check.check(tmp_path, seen.CHESS).rows()


@pytest.mark.parametrize(
    ("name", "change", "text"),
    [
        ("charuco", lambda picture: picture[:, ::-1], "mirrored"),
        ("chessboard", lambda picture: picture[::2, ::2], "from another camera"),
        ("chessboard", lambda picture: np.pad(picture[:, 230:], ((0, 0), (0, 230)), mode="edge"), "cut by the border"),
        ("chessboard", lambda picture: np.full_like(picture, 90), "no board"),
    ],
)
def test_a_picture_that_does_not_fit_is_named(
    name: str, change: Change, text: str, folders: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in folders[name].iterdir():
        picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        cv2.imwrite(str(tmp_path / path.name), change(picture) if path.stem == "0" else picture)
    cli.main(["calibrate", str(tmp_path), *words(BOARDS[name]), "--output", str(tmp_path / "camera.yaml")])
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("0.png")]
    assert text in line
