"""The strip followed through a few rendered frames, against the curve that was rendered."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import TrackingError
from stripfold.film import strip_tracker
from stripfold.film.centreline import Centreline
from stripfold.film.frames import Frame
from stripfold.film.mapping import Mapping
from stripfold.synthetic.recording import history_of
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.sensor import Sensor
from stripfold.synthetic.view import View

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

    def tracker(self) -> strip_tracker.StripTracker:
        return strip_tracker.StripTracker(self.mapping, STRIP, "film")

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


def test_loop_behind_the_sag_is_found_across_a_gap_in_its_bend() -> None:
    wide = filmed(1, {"width": 0.08})
    column, row = wide.curves[0][np.argmin(wide.curves[0][:, 0])].astype(int)
    image = wide.frames[0].image.copy()
    image[row - 9 : row + 3, column - 25 : column + 25] = image[row, column - 40]
    (line,) = wide.track({0: image})
    assert line is not None
    # Seen is the middle of the band, inside of the loop; on the short way, over the touch, most of it was missing.
    assert line.points[:, 0].min() < column + np.median(line.width)
    assert cKDTree(wide.curves[0]).query(line.points[:-4])[0].max() < 0.5 * np.median(line.width) + 5.0


@pytest.mark.parametrize("beyond", [-3, 40])
def test_strip_described_longer_is_noticed_where_its_end_is_in_the_picture(beyond: int) -> None:
    """The end may be close to the border, or the border beyond a table's rim that looks a little like the strip."""
    film = filmed(1)
    image = film.frames[0].image[:, : round(film.curves[0][-1, 0]) + beyond].copy()
    tracker = strip_tracker.StripTracker(film.mapping, 0.52, "film")
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


def test_marker_is_removed_from_the_picture(film: Film) -> None:
    image = film.frames[0].image.copy()
    corners = np.array([[300.0, 40.0], [340.0, 40.0], [340.0, 80.0], [300.0, 80.0]])
    cv2.fillConvexPoly(image, corners.astype(np.int32), (255,))
    before = image.copy()
    cleared = strip_tracker.without_marker(image, corners)
    np.testing.assert_array_equal(image, before)
    assert cleared[40:80, 300:340].max() < 200
    changed = np.argwhere(cleared != image)
    assert np.abs(changed - [60, 320]).max() <= 33
