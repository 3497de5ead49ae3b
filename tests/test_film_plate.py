"""The plate: the sheet is printed at its own size, and photographs beside it give eta_b however the camera is held."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.integrate import solve_bvp

import drawn_strips as drawn
import stripfold as sf
from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import InvalidInputError, TrackingError
from stripfold.cli import main
from stripfold.film import eta, plate
from stripfold.film.boards import Board, dictionary
from stripfold.film.cantilever import Cantilever
from stripfold.film.holder import Marker
from stripfold.film.plate_sheet import PAPERS, Paper, sheet
from stripfold.film.shape import Depth

ETA_B = 3780.0
UNIT = (ETA_B * 9.81) ** (-1.0 / 3.0)
SIZE, FIELD, DISTANCE = (1200, 900), 0.3, 0.6
FOCAL = DISTANCE / FIELD
"""Over the longer side of the picture."""
DPI = 254.0


@pytest.mark.parametrize("paper", PAPERS)
def test_the_sheet_is_printed_at_its_own_size(paper: Paper):
    """0.1 mm for each pixel: both plates whole, and the markers for the gripper."""
    file = io.BytesIO()
    sheet(paper).savefig(file, dpi=DPI)
    printed = np.asarray(Image.open(file).convert("L"))
    assert printed.shape[::-1] == pytest.approx(np.array(PAPERS[paper]) * 10.0, abs=1.0)
    for board in (plate.LONG, plate.CARD):
        seen = plate.find(printed, boards=(board,))
        assert len(seen.corners.ids) == (board.columns - 1) * (board.rows - 1)
        assert seen.mapping.resolution(seen.corners.pixels.mean(axis=0)) == pytest.approx(1e-4, rel=1e-3)
        # It stands on the line that it is cut along.
        low = seen.mapping.to_pixels(np.array([[0.0, 0.0]]))[0]
        rows = printed[round(low[1]) - 4 : round(low[1]) + 5, round(low[0]) + 20]
        assert rows.min() < 220
    for number in plate.GRIPPERS:
        corners = Marker("4x4_50", number).corners(printed)
        assert corners is not None
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
        np.testing.assert_allclose(sides, 1e4 * plate.SIDE, rtol=0.01)


def test_it_is_written_by_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "plate.pdf"
    assert main(["plate", "--paper", "letter", "--output", str(file)]) == 0
    assert file.read_bytes().startswith(b"%PDF")
    assert str(file) in capsys.readouterr().out
    assert main(["plate", "--output", str(tmp_path / "plate.png")]) == 2


Project = Callable[[Array], Array]


def camera(tilt: float, yaw: float, roll: float, target: Sequence[float]) -> Project:
    """A pinhole camera that looks at x and z of the target from :data:`DISTANCE`; angles in degrees."""
    a, b, c = np.radians([tilt, yaw, roll])
    ahead = np.array([np.sin(b) * np.cos(a), np.cos(b) * np.cos(a), -np.sin(a)])
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(ahead, right)
    axes = np.stack([np.cos(c) * right + np.sin(c) * down, np.cos(c) * down - np.sin(c) * right, ahead])
    place = np.array([target[0], 0.0, target[1]]) - DISTANCE * ahead
    middle = 0.5 * (np.array(SIZE) - 1.0)

    def project(points: Array) -> Array:
        seen = (points - place) @ axes.T
        return middle + FOCAL * SIZE[0] * seen[..., :2] / seen[..., 2:]

    return project


def photograph(project: Project, curve: Array, width: float, at: float, board: Board = plate.CARD) -> Picture:
    """A strip 1.5 mm thick whose near edge is a curve, shape (n, 2), m, beside a plate ``at`` some x on the table."""
    fine = 3
    picture = np.full((fine * SIZE[1], fine * SIZE[0]), 50.0, np.float32)

    def fill(corners: Array, grey: float) -> None:
        pixels = np.rint(256.0 * (fine * (project(corners) + 0.5) - 0.5)).astype(np.int32)
        cv2.fillPoly(picture, list(pixels.reshape(-1, *pixels.shape[-2:])), grey, cv2.LINE_AA, 8)

    fill(np.array([[-2.0, -0.3, 0.0], [2.0, -0.3, 0.0], [2.0, 0.5, 0.0], [-2.0, 0.5, 0.0]]), 85.0)
    pixel = FIELD / SIZE[0]
    for y in np.linspace(width, 0.0, 60):
        places = np.column_stack([curve[:, 0], np.full(len(curve), y), curve[:, 1]])
        line = np.rint(256.0 * (fine * (project(places) + 0.5) - 0.5)).astype(np.int32)
        thick = round(fine * 1.5e-3 / pixel * DISTANCE / (DISTANCE + y))
        cv2.polylines(picture, [line[:, None]], False, 190.0 if y else 215.0, thick, cv2.LINE_AA, 8)

    def squares(left: Array, low: Array, side: float, grey: float) -> None:
        x, z = left[:, None] + side * np.array([0, 1, 1, 0]), low[:, None] + side * np.array([0, 0, 1, 1])
        fill(np.stack([at + x, np.full_like(x, -1e-4), z], axis=-1), grey)

    (left, top), (right, _) = plate.outline(board)
    fill(np.array([[at + x, 0.0, z] for x, z in ((left, 0.0), (right, 0.0), (right, top), (left, top))]), 235.0)
    side, foot = board.square, plate.FOOT * board.square
    row, column = np.nonzero(np.indices((board.rows, board.columns)).sum(axis=0) % 2 == 0)
    squares(side * column, foot + side * (board.rows - 1.0 - row), side, 15.0)
    known, marker = dictionary(str(board.dictionary)), board.marker or 0.0
    cell, rim = marker / (known.markerSize + 2), 0.5 * (side - marker)
    row, column = np.nonzero(np.indices((board.rows, board.columns)).sum(axis=0) % 2 == 1)
    for number, (i, j) in enumerate(zip(row, column, strict=True)):
        down, right = np.nonzero(cv2.aruco.generateImageMarker(known, number, known.markerSize + 2) == 0)
        squares(side * j + rim + cell * right, foot + side * (board.rows - i) - rim - cell * (down + 1.0), cell, 15.0)
    seen = cv2.GaussianBlur(cv2.resize(picture, SIZE, interpolation=cv2.INTER_AREA), (0, 0), 1.0)
    return np.clip(np.rint(seen + np.random.default_rng(5).normal(0.0, 2.0, seen.shape)), 0, 255).astype(np.uint8)


def folded() -> Array:
    """The near edge of a folded strip, to the left of x = 0.02 m."""
    curve = (drawn.folded(1000.0) - [2600.0, 330.0]) / 1000.0
    return UNIT * curve * [1.0, -1.0] + [0.0, 1e-3]


def hanging() -> Array:
    """The near edge of 3 L* that hang out of a level clamp, by a boundary-value problem."""
    s = np.linspace(0.0, 3.0, 200)

    def rates(s: Array, y: Array) -> Array:
        return np.array([y[1], -(3.0 - s) * np.cos(y[0])])

    angle = solve_bvp(rates, lambda a, b: np.array([a[0], b[1]]), s, np.array([0.4 * s, 0.0 * s + 1.0])).sol(s)[0]
    middle = 0.5 * (angle[1:] + angle[:-1])
    steps = np.diff(s)[:, None] * np.column_stack([np.cos(middle), -np.sin(middle)])
    return UNIT * np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]) + [-0.08, 0.12]


def saved(picture: Picture, folder: Path, focal: float | None = FOCAL, turned: int = 0) -> str:
    """A JPEG as of a phone: focal length in its data, and ``turned`` by so many quarters without saying so."""
    data = Image.Exif()
    if focal is not None:
        data.get_ifd(0x8769)[0xA405] = round(36.0 * focal)
    file = folder / "photo.jpg"
    Image.fromarray(np.rot90(picture, turned)).save(file, quality=95, exif=data)
    return str(file)


@pytest.mark.parametrize(
    ("tilt", "yaw", "roll", "width", "turned"),
    [(2.0, 0.0, 0.0, 0.03, 0), (4.0, 2.0, 3.0, 0.03, 0), (3.0, -4.0, -8.0, 0.005, 0), (4.0, 2.0, 8.0, 0.02, 2)],
)
def test_a_fold_beside_the_card(tilt: float, yaw: float, roll: float, width: float, turned: int, tmp_path: Path):
    """Rolled by 8 degrees, or upside down: the plate says what is up, how far and from where it is seen."""
    picture = photograph(camera(tilt, yaw, roll, (-0.02, 0.03)), folded(), width, 0.06)
    found = sf.eta_b(image=saved(picture, tmp_path, turned=turned), method="fold", width=width)
    assert found.eta_b == pytest.approx(ETA_B, rel=0.05)
    assert found.interval[0] < ETA_B < found.interval[1]
    assert found.interval[1] < 1.5 * found.interval[0]
    assert found.scale_sd < 0.01
    assert "scale by the plate" in str(found)


@pytest.mark.parametrize("roll", [0.0, 3.0, -6.0])
def test_a_hanging_strip_beside_the_card(roll: float, tmp_path: Path):
    """A roll of 3 degrees alone would make eta_b a quarter too large."""
    picture = photograph(camera(3.0, 2.0, roll, (-0.02, 0.06)), hanging(), 0.01, 0.03)
    found = sf.eta_b(image=saved(picture, tmp_path), method="cantilever", width=0.01)
    assert found.eta_b == pytest.approx(ETA_B, rel=0.08)
    assert found.interval[0] < ETA_B < found.interval[1]


@pytest.mark.parametrize(("tilt", "yaw", "roll", "x"), [(3.0, -5.0, 3.0, 0.0), (7.0, 2.0, 0.0, 0.06)])
def test_a_hanging_strip_whose_face_is_seen(tilt: float, yaw: float, roll: float, x: float):
    """The band begins and ends slanted, and where it bends its middle is that of neither edge."""
    picture = photograph(camera(tilt, yaw, roll, (x, 0.06)), hanging(), 0.1, 0.03)
    found = eta.from_plate(picture, "cantilever", width=0.1, focal=FOCAL)
    assert found.eta_b == pytest.approx(ETA_B, rel=0.06)
    assert found.interval[0] < ETA_B < found.interval[1]
    assert isinstance(found.fit, Cantilever)
    assert found.fit.linear


@pytest.mark.parametrize("width", [0.03, *(pytest.param(width, marks=pytest.mark.slow) for width in (0.005, 0.06))])
def test_the_band_says_how_far_the_far_edge_is(width: float, tmp_path: Path):
    """Without width and focal length, too, as seen from above a face widens the band."""
    picture = photograph(camera(7.0, 3.0, 0.0, (-0.02, 0.03)), folded(), width, 0.06)
    known = sf.eta_b(image=saved(picture, tmp_path), method="fold", width=width)
    unknown = sf.eta_b(image=saved(picture, tmp_path, focal=None), method="fold")
    for found in (known, unknown):
        assert found.eta_b == pytest.approx(ETA_B, rel=0.04)
        assert found.interval[0] < ETA_B < found.interval[1] < 1.25 * found.interval[0]
    assert known.fit is not None
    assert known.fit.depth is not None
    assert known.fit.depth.share == pytest.approx(width / (DISTANCE + width), abs=0.005)


def test_the_edges_of_a_wide_strip_cross_a_section_where_they_are():
    """Both edges of a circle's ruled surface are circles about places beside its middle: crossings in closed form."""
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)
    circle = 100.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    depth = Depth(np.array([400.0, 150.0]), 0.1, 0.0)
    at = np.arange(200, 4000, 400)
    across = circle[at] / 100.0
    found = depth.edges(circle, circle[at], across)
    for factor, crossing in zip((1.0, -1.0), found, strict=True):
        grown = 1.0 + 0.5 * factor * depth.widening
        middle, radius = (1.0 - grown) * depth.foot, 100.0 * grown
        along = across @ middle
        expected = along + np.sqrt(along**2 - middle @ middle + radius**2) - 100.0
        np.testing.assert_allclose(crossing, expected, atol=1e-3)


def test_what_cannot_be_used_is_refused(tmp_path: Path):
    picture = photograph(camera(2.0, 0.0, 0.0, (-0.02, 0.03)), folded(), 0.01, 0.06)
    with pytest.raises(TrackingError, match=r"no plate.*stripfold plate prints it"):
        sf.eta_b(image=saved(picture[:, :600], tmp_path), method="fold")
    aside = photograph(camera(2.0, 34.0, 0.0, (-0.02, 0.03)), folded(), 0.005, 0.06)
    with pytest.raises(TrackingError, match=r"seen from 3\d degrees aside"):
        sf.eta_b(image=saved(aside, tmp_path), method="fold")
    with pytest.raises(InvalidInputError, match="width"):
        sf.eta_b(image=saved(picture, tmp_path), method="fold", scale=1e-4, width=0.01)
    for given in ({"tilt": 1.0}, {"depth": 0.01}):
        with pytest.raises(InvalidInputError, match=r"only together with a scale.*it is measured"):
            sf.eta_b(image=saved(picture, tmp_path), method="fold", **given)


def test_what_is_in_a_picture_is_found(tmp_path: Path):
    seen = camera(3.0, 2.0, 0.0, (-0.02, 0.05))
    for curve, method in ((folded(), "fold"), (hanging(), "cantilever")):
        file = saved(photograph(seen, curve, 0.01, 0.04), tmp_path)
        found, told = (sf.eta_b(image=file, width=0.01, **given) for given in ({}, {"method": method}))
        assert found.to_dict() == told.to_dict()
    empty = photograph(seen, np.array([[0.5, 0.0], [0.6, 0.0]]), 0.01, 0.04)
    with pytest.raises(TrackingError, match=r"neither a fold \(.*nor a hanging loop \(.*nor a hanging strip \("):
        sf.eta_b(image=saved(empty, tmp_path), width=0.01)


def test_a_ruler_is_a_scale(tmp_path: Path):
    picture = photograph(camera(0.0, 0.0, 0.0, (-0.02, 0.03)), folded(), 0.002, 0.2)
    file = saved(picture, tmp_path)
    by_scale = sf.eta_b(image=file, method="fold", scale=FIELD / SIZE[0])
    by_ruler = sf.eta_b(image=file, method="fold", ruler=f"100,40,{100 + 0.1 / FIELD * SIZE[0]:.1f},40,0.1")
    assert by_ruler.eta_b == pytest.approx(by_scale.eta_b, rel=1e-6)
    assert main(["eta", "--image", file, "--method", "fold", "--ruler", "100,40,500,40,0.1"]) == 0
    for wrong in ("100,40,500,40", "1,2,3,2,0.1", "100,40,500,40,100"):
        with pytest.raises(InvalidInputError, match="ruler"):
            sf.eta_b(image=file, method="fold", ruler=wrong)


@pytest.mark.slow
def test_several_photographs_in_one_call(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    """Each with its own view; together they are no less certain than the scale, and no more than they scatter."""
    files = []
    for number, (tilt, roll) in enumerate(((2.0, 0.0), (5.0, 4.0), (3.0, -5.0))):
        folder = tmp_path / str(number)
        folder.mkdir()
        files.append(saved(photograph(camera(tilt, 2.0 - number, roll, (-0.02, 0.03)), folded(), 0.02, 0.06), folder))
    command = ["eta", "--image", *files, "--method", "fold", "--width", "0.02"]
    assert main(command) == 0
    said = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in said] == ["photo.jpg"] * 3 + ["eta_b", "95"]
    assert main([*command, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["eta_b"] == pytest.approx(ETA_B, rel=0.04)
    assert told["eta_b_lower"] < ETA_B < told["eta_b_upper"]
    assert 0.0 < told["scatter"] < 0.05
    assert [one["image"] for one in told["pictures"]] == files
    single = [one["eta_b"] for one in told["pictures"]]
    assert told["eta_b"] == pytest.approx(np.exp(np.mean(np.log(single))))
    assert main([*command, "--picture", str(tmp_path / "fit.png")]) == 2
    assert "only together with one image" in capsys.readouterr().err
