"""The strip's centreline in a picture and through a film, against drawn and rendered strips."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.spatial import cKDTree

import drawn_strips as drawn
from stripfold import elastica
from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import InvalidInputError, TrackingError
from stripfold.film import (
    pictures,
    tracking,
)
from stripfold.film.camera import Mapping
from stripfold.film.line import Centreline, edges_at, find, normals
from stripfold.film.video import Frame
from stripfold.synthetic.recording import history_of
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.sensor import Sensor
from stripfold.synthetic.view import View

SIZE = (640, 400)


LOOKS = {
    "sharp": {"blur": 0.8, "noise": 2.0},
    "noisy": {"blur": 1.5, "noise": 9.0},
    "dark": {"strip": 30.0, "ground": 150.0},
}


def hook(advance: float = 0.6, shift: float = 0.0) -> drawn.Array:
    """A state on the way from no horizontal force (0) to the critical point (1)."""
    return drawn.hook(STATES[round(advance * (len(STATES) - 1))], 33.0, 340.0, 600.0 + shift, 14.5)


def _states() -> list[elastica.State]:
    states = list(elastica.x_axis_branch(2.5, max_step=0.05))
    return states[: int(np.argmax([state.advance for state in states])) + 1]


STATES = _states()


CURVES = {"arc": drawn.arc(), "hook": hook()}


SHARES = {
    (name, width): drawn.coverage(curve, width, SIZE) for name, curve in CURVES.items() for width in (2.5, 6.0, 12.0)
}


@pytest.fixture(scope="module")
def line() -> Centreline:
    return find(drawn.picture(SHARES["hook", 6.0]), CURVES["hook"][0])


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize(("name", "width"), SHARES)
def test_strip_in_an_unknown_picture(name: str, width: float, look: str) -> None:
    curve = CURVES[name]
    found = find(drawn.picture(SHARES[name, width], **LOOKS[look]), curve[0])
    off = drawn.errors(found.points, curve)
    limit = {"sharp": 0.04, "noisy": 0.15, "dark": 0.06}[look]
    assert np.sqrt(np.mean(off**2)) < limit
    assert found.bright == (look != "dark")
    # From the gripper's end along the strip, both ends included.
    np.testing.assert_allclose(found.points[[0, -1]], curve[[0, -1]], atol=1.5)
    assert found.length == pytest.approx(drawn.length(curve), abs=1.5)
    steps = np.hypot(*np.diff(found.points, axis=0).T)
    np.testing.assert_allclose(steps, steps.mean(), rtol=0.02)
    if look == "sharp" and width > 4.0:
        assert np.median(found.width) == pytest.approx(width, abs=0.15)
    assert np.median(found.score) > 0.9


def test_uncertainty_matches_the_errors() -> None:
    pooled = []
    for seed, ((name, _), share) in enumerate(SHARES.items()):
        for look in LOOKS.values():
            found = find(drawn.picture(share, 50 + seed, **look), CURVES[name][0])
            pooled.append(drawn.errors(found.points, CURVES[name]) / found.sd)
    scaled = np.concatenate(pooled)
    assert 0.7 < np.std(scaled) < 1.4
    assert np.mean(np.abs(scaled) < 1.96) > 0.88


def test_hidden_part_is_uncertain() -> None:
    hidden = drawn.picture(SHARES["arc", 6.0])
    centre = CURVES["arc"][300].astype(int)
    hidden[centre[1] - 20 : centre[1] + 20, centre[0] - 18 : centre[0] + 18] = 60
    found = find(hidden)
    covered = np.all(np.abs(found.points - centre) < 14, axis=1)
    assert covered.sum() >= 3
    assert found.score[covered].max() < 0.4
    assert found.score[~covered].mean() > 0.9
    assert found.sd[covered].min() > 2.0 * np.median(found.sd[~covered])
    # In the middle of what is hidden: some hundredths of how far away the last sight of it is.
    assert found.sd[covered].max() > 0.3
    off = drawn.errors(found.points, CURVES["arc"])
    assert np.abs(off[~covered]).max() < 0.5
    assert np.abs(off / found.sd).max() < 5.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("depth", [0.3, 0.5])
def test_a_shadow_beside_a_dark_strip_is_none_of_it(depth: float, side: float) -> None:
    curve, width = CURVES["arc"], 12.0
    table = 150.0 - depth * 120.0 * drawn.coverage(curve + np.array([0.0, 8.0 * side]), width, SIZE)
    image = cv2.GaussianBlur(table + (30.0 - table) * SHARES["arc", width], (0, 0), 1.0)
    image = np.rint(image + np.random.default_rng(1).normal(0.0, 3.0, image.shape)).astype(np.uint8)
    inner = curve[340:540:10]  # there all of the shadow is seen
    edges = edges_at(image, inner, normals(inner), width, bright=False)
    assert edges.found.all()
    assert np.abs(edges.offset).max() < 0.5
    assert np.median(edges.width) == pytest.approx(width, abs=0.3)


def test_no_strip_is_an_error() -> None:
    empty = drawn.picture(np.zeros(SIZE[::-1]))
    with pytest.raises(TrackingError, match="frame 7: no strip was found"):
        find(empty, source="frame 7")
    with pytest.raises(TrackingError, match="no strip was found"):
        find(np.full((200, 300), 7, np.uint8))


def saved(tmp_path: Path, array: np.ndarray, name: str = "strip.png", **options: object) -> Path:
    path = tmp_path / name
    Image.fromarray(array).save(path, **options)
    return path


def test_pictures(tmp_path: Path) -> None:
    grey = drawn.picture(SHARES["arc", 6.0])
    np.testing.assert_array_equal(pictures.read_grey(saved(tmp_path, grey)), grey)
    deep = saved(tmp_path, (grey.astype(np.uint16) * 257), "deep.png")
    np.testing.assert_array_equal(pictures.read_grey(deep), grey)
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera was held upright
    turned = saved(tmp_path, grey, "turned.png", exif=exif)
    assert pictures.read_grey(turned).shape == grey.shape[::-1]


def claiming(png: bytes, side: int) -> bytes:
    """The same file, whose header says that it is ``side`` pixels wide and high."""
    header = b"IHDR" + side.to_bytes(4, "big") * 2 + png[24:29]
    return png[:12] + header + zlib.crc32(header).to_bytes(4, "big") + png[33:]


def test_unusable_pictures(tmp_path: Path) -> None:
    good = saved(tmp_path, drawn.picture(SHARES["arc", 6.0])).read_bytes()
    contents = {"cut.png": good[: len(good) // 2], "text.jpg": b"not a picture", "empty.png": b""}
    contents |= {"wide.png": claiming(good, 9000), "bomb.png": claiming(good, 200_000)}
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InvalidInputError, match=f"image = .*{name}.*at most 50 million pixels") as caught:
            pictures.read_grey(tmp_path / name)
        assert "9000 x 9000" in str(caught.value) or name != "wide.png"
    with pytest.raises(InvalidInputError, match="an existing file"):
        pictures.read_grey(tmp_path / "none.png")
    with pytest.raises(InvalidInputError, match="each side 32"):
        pictures.read_grey(saved(tmp_path, np.zeros((8, 100), np.uint8), "tiny.png"))


PERIOD = 1.0 / 20.0


STRIP = 0.45


BAND = 0.03 * np.sin(np.radians(4.0) + 0.085 / 0.9) * 480 / 0.32
"""Height of the lying strip in the picture, pixels: its width, seen from above at the camera's tilt."""


@dataclass(frozen=True, eq=False)
class Film:
    """Frames with the truth in pixels: the strip's curve, the gripped end and the marker's corners."""

    frames: list[Frame]
    curves: list[Array]
    ends: list[Array]
    corners: list[Array]
    mapping: Mapping

    def tracker(self) -> tracking.StripTracker:
        return tracking.StripTracker(self.mapping, STRIP, "film")

    def track(self, pictures: dict[int, Picture] | None = None) -> list[Centreline | None]:
        """The lines in all frames, some of which show other pictures."""
        tracker = self.tracker()
        return [
            tracker(replace(frame, image=(pictures or {}).get(frame.index, frame.image)), end, corners)
            for frame, end, corners in zip(self.frames, self.ends, self.corners, strict=True)
        ]

    def blank(self, frames: range) -> dict[int, Picture]:
        return dict.fromkeys(frames, np.full_like(self.frames[0].image, 70))

    def behind_bar(self, places: dict[int, float], width: float, grey: int) -> dict[int, Picture]:
        """Frames, some of them behind an upright bar at the given column."""
        pictures = {}
        for k, x in places.items():
            pictures[k] = self.frames[k].image.copy()
            pictures[k][:, max(round(x - 0.5 * width), 0) : round(x + 0.5 * width)] = grey
        return pictures

    def assert_on_strip(self, k: int, line: Centreline | None, tolerance: float = 1.5) -> None:
        """The line is the middle of the band behind the true curve, that of the edge that faces the camera."""
        assert line is not None
        share, fine = np.linspace(0.0, 1.0, len(self.curves[k])), np.linspace(0.0, 1.0, 4000)
        dense = np.column_stack([np.interp(fine, share, self.curves[k][:, i]) for i in range(2)])
        away, at = cKDTree(dense).query(line.points)
        # The ends of the strip are hidden.
        assert away[(at > 0.04 * 4000) & (at < 0.96 * 4000)].max() < 0.5 * BAND + tolerance


@pytest.fixture(scope="module")
def film() -> Film:
    return filmed(26)


def filmed(frames: int, strip: dict[str, Any] | None = None, eta_b: float = 3780.0, **filming: Any) -> Film:
    """The first frames of a film from a second before the snap on."""
    scene = Scene(
        eta_b=eta_b,
        strip=strip or {},
        filming={"size": [480, 360], "frame_rate": 20.0, "tilt": 4.0} | filming,
        speed=0.02,
        motion={"before": 0.02, "after": 0.3},
        seed=11,
    )
    history, view = history_of(scene), View.of(scene.filming)
    sensor = Sensor(Renderer(scene, history.curve[0]), float(history.t[-1]), np.random.default_rng(4))
    onset = history.events()["fall"]
    assert onset is not None
    times = onset - 1.0 + PERIOD * np.arange(frames)
    curves, grippers = history.at(times)
    to_plane = np.linalg.inv(
        view.camera.matrix @ np.column_stack([view.matrix[:, 0], view.matrix[:, 2], view.translation])
    )
    images = [sensor.delivered(sensor.exposed(history, float(t)), float(t)) for t in times]
    square = 0.5 * scene.gripper.marker_size * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])
    return Film(
        frames=[Frame(i, PERIOD * i, np.asarray(image, dtype=np.uint8)) for i, image in enumerate(images)],
        curves=list(view.in_plane(curves)),
        ends=list(view.in_plane(grippers)),
        corners=[view.in_plane(gripper - np.asarray(scene.gripper.offset) + square) for gripper in grippers],
        mapping=Mapping(view.camera, to_plane / to_plane[2, 2]),
    )


@pytest.fixture(scope="module")
def lines(film: Film) -> list[Centreline]:
    found = [line for line in film.track() if line is not None]
    assert len(found) == len(film.frames)
    return found


def test_line_is_on_the_strip_from_the_gripped_end_to_a_fixed_lying_end(film: Film, lines: list[Centreline]) -> None:
    offset = lines[0].points[0] - film.ends[0]
    assert np.hypot(*offset) < 2.0
    for k, line in enumerate(lines):
        film.assert_on_strip(k, line)
        assert np.hypot(*(line.points[0] - film.ends[k] - offset)) < 1.0
    assert np.ptp([line.points[-1] for line in lines], axis=0).max() < 1.5


@pytest.mark.parametrize("beyond", [-3, 40])
def test_strip_described_longer_is_noticed_where_its_end_is_in_the_picture(beyond: int) -> None:
    """The end may be close to the border, or the border beyond a table's rim that looks a little like the strip."""
    film = filmed(1)
    image = film.frames[0].image[:, : round(film.curves[0][-1, 0]) + beyond].copy()
    tracker = tracking.StripTracker(film.mapping, 0.52, "film")
    later = [replace(film.frames[0], image=image, time=time) for time in (0.0, 1.0)]
    assert tracker(later[0], film.ends[0], film.corners[0]) is None
    with pytest.raises(TrackingError, match=r"4[34]\d mm of the strip are seen, its length is 520 mm"):
        tracker(later[1], film.ends[0], film.corners[0])


@pytest.mark.parametrize("grey", [5, 90, 235])
def test_passing_object_hides_but_does_not_mislead(film: Film, grey: int) -> None:
    left, right = float(film.curves[0][:, 0].min()), float(film.ends[0][0])
    found = film.track(film.behind_bar({4 + i: left + (right + 40.0 - left) * i / 11.0 for i in range(12)}, 14.0, grey))
    for k, line in enumerate(found):
        if k >= 17 or line is not None:
            film.assert_on_strip(k, line, 4.0 if k < 17 else 1.5)
    assert sum(line is None for line in found) <= 4


def test_strip_is_lost_in_blank_frames_and_found_again(film: Film) -> None:
    found = film.track(film.blank(range(6, 8)))
    assert [i for i, line in enumerate(found) if line is None] == [6, 7]
    film.assert_on_strip(8, found[8])


def test_strip_hidden_for_long_is_an_error(film: Film) -> None:
    with pytest.raises(TrackingError, match=r"lost at 0\.[678]"):
        film.track(film.blank(range(3, 26)))


def test_strip_away_from_the_gripper_is_an_error(film: Film) -> None:
    tracker = film.tracker()
    dropped = film.ends[0] + np.array([70.0, -70.0])
    assert tracker(film.frames[0], dropped, film.corners[0]) is None
    with pytest.raises(TrackingError, match="from where the gripper should hold it"):
        tracker(film.frames[11], dropped, film.corners[11])
