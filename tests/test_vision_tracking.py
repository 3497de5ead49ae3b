"""The strip followed through a few rendered frames, against the curve that was rendered."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from stripfold.arrays import Array, Picture
from stripfold.errors import TrackingError
from stripfold.synthetic.recording import history_of
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.sensor import Sensor
from stripfold.synthetic.view import View
from stripfold.vision import following, strip_tracker, tracking
from stripfold.vision.centreline import Centreline
from stripfold.vision.mapping import Mapping
from stripfold.vision.video import Frame

PERIOD = 1.0 / 20.0
STRIP = 0.45
BAND = 0.03 * np.sin(np.radians(4.0) + 0.085 / 0.9) * 480 / 0.32
"""Height of the lying strip in the picture, pixels: its width, seen from above at the camera's tilt."""


@dataclass(frozen=True, eq=False)
class Film:
    """Frames with what is true in them: the strip's curve and the gripped end, pixels, and the marker's corners."""

    frames: list[Frame]
    curves: list[Array]
    ends: list[Array]
    corners: list[Array]
    calibration: Any


@pytest.fixture(scope="module")
def film() -> Film:
    scene = Scene(
        filming={"size": [480, 360], "frame_rate": 20.0, "tilt": 4.0},
        gripper={"speed": 0.02},
        motion={"before": 0.02, "after": 0.3},
        seed=11,
    )
    history, view = history_of(scene), View.of(scene.filming)
    sensor = Sensor(Renderer(scene, history.curve[0]), float(history.t[-1]), np.random.default_rng(4))
    onset = history.events()["fall"]
    assert onset is not None
    times = onset - 1.0 + PERIOD * np.arange(26)
    curves, grippers = history.at(times)
    marker = scene.gripper
    to_plane = np.linalg.inv(
        view.camera.matrix @ np.column_stack([view.matrix[:, 0], view.matrix[:, 2], view.translation])
    )
    mapping = Mapping(view.camera, to_plane / to_plane[2, 2])
    frames, corners = [], []
    for i, t in enumerate(times):
        image = sensor.delivered(sensor.exposed(history, float(t)), float(t))
        frames.append(Frame(i, PERIOD * i, np.asarray(image, dtype=np.uint8)))
        centre = grippers[i] - np.asarray(marker.offset)
        half = 0.5 * marker.marker_size
        corners.append(view.in_plane(centre + half * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])))
    calibration = SimpleNamespace(mapping=mapping)
    return Film(frames, list(view.in_plane(curves)), list(view.in_plane(grippers)), corners, calibration)


def followed(film: Film, pictures: dict[int, Picture] | None = None) -> list[Centreline | None]:
    """The lines in all frames, some of which show other pictures."""
    tracker = strip_tracker.StripTracker(film.calibration.mapping, STRIP, "film")
    lines = []
    for frame, end, corners in zip(film.frames, film.ends, film.corners, strict=True):
        image = (pictures or {}).get(frame.index, frame.image)
        lines.append(tracker(Frame(frame.index, frame.time, image), end, corners))
    return lines


def distances(points: Array, curve: Array) -> Array:
    """Of points from a curve, pixels, but for the curve's hidden ends."""
    share, fine = np.linspace(0.0, 1.0, len(curve)), np.linspace(0.0, 1.0, 4000)
    dense = np.column_stack([np.interp(fine, share, curve[:, k]) for k in range(2)])
    away, at = cKDTree(dense).query(points)
    return np.asarray(away[(at > 0.04 * 4000) & (at < 0.96 * 4000)])


def crossed(picture: Picture, x: float, width: float, grey: int) -> Picture:
    """The picture behind an upright bar."""
    covered = picture.copy()
    covered[:, max(round(x - 0.5 * width), 0) : round(x + 0.5 * width)] = grey
    return covered


@pytest.fixture(scope="module")
def lines(film: Film) -> list[Centreline | None]:
    return followed(film)


def test_the_mapping_of_these_tests_is_the_camera_s(film: Film) -> None:
    inside = film.curves[0][5:40]
    back = film.calibration.mapping.to_pixels(film.calibration.mapping.to_robot(inside))
    np.testing.assert_allclose(back, inside, atol=1e-3)


def test_the_line_is_on_the_strip(film: Film, lines: list[Centreline | None]) -> None:
    for line, curve in zip(lines, film.curves, strict=True):
        assert line is not None
        # The curve is that of the edge that faces the camera, the line the middle of the band behind it.
        assert distances(line.points, curve).max() < 0.5 * BAND + 1.5


def test_the_line_begins_where_the_strip_is_held(film: Film, lines: list[Centreline | None]) -> None:
    first = lines[0]
    assert first is not None
    aside = first.points[0] - film.ends[0]
    assert np.hypot(*aside) < 2.0
    for line, end in zip(lines, film.ends, strict=True):
        assert line is not None
        assert np.hypot(*(line.points[0] - end - aside)) < 1.0


def test_the_lying_end_stays_where_it_is(lines: list[Centreline | None]) -> None:
    ends = np.array([line.points[-1] for line in lines if line is not None])
    assert len(ends) == len(lines)
    assert np.ptp(ends, axis=0).max() < 1.5


@pytest.mark.parametrize("grey", [5, 90, 235])
def test_a_passing_thing_hides_but_does_not_mislead(film: Film, grey: int) -> None:
    left, right = float(film.curves[0][:, 0].min()), float(film.ends[0][0])
    places = {4 + i: left + (right + 40.0 - left) * i / 11.0 for i in range(12)}
    pictures = {k: crossed(film.frames[k].image, x, 14.0, grey) for k, x in places.items()}
    found = followed(film, pictures)
    for line, curve in zip(found, film.curves, strict=True):
        if line is not None:
            assert distances(line.points, curve).max() < 0.5 * BAND + 4.0
    for line, curve in zip(found[17:], film.curves[17:], strict=True):
        assert line is not None
        assert distances(line.points, curve).max() < 0.5 * BAND + 1.5
    assert sum(line is None for line in found) <= 4


def test_a_covered_frame_is_lost_and_the_strip_is_found_again(film: Film) -> None:
    blank = np.full_like(film.frames[0].image, 70)
    found = followed(film, {6: blank, 7: blank})
    assert [i for i, line in enumerate(found) if line is None] == [6, 7]
    assert found[8] is not None
    assert distances(found[8].points, film.curves[8]).max() < 0.5 * BAND + 1.5


def test_the_strip_is_looked_for_until_it_is_there(film: Film) -> None:
    blank = np.full_like(film.frames[0].image, 70)
    found = followed(film, dict.fromkeys(range(3), blank))
    assert [line is None for line in found[:4]] == [True, True, True, False]
    with pytest.raises(TrackingError):
        followed(film, dict.fromkeys(range(26), blank))


def test_a_strip_that_is_hidden_for_long_is_lost(film: Film) -> None:
    blank = np.full_like(film.frames[0].image, 70)
    with pytest.raises(TrackingError, match=r"lost at 0\.[678]"):
        followed(film, dict.fromkeys(range(3, 26), blank))


def test_a_strip_that_nobody_holds(film: Film) -> None:
    tracker = strip_tracker.StripTracker(film.calibration.mapping, STRIP, "film")
    dropped = film.ends[0] + np.array([70.0, -70.0])
    assert tracker(film.frames[0], dropped, film.corners[0]) is None
    with pytest.raises(TrackingError, match="from where the gripper should hold it"):
        tracker(film.frames[11], dropped, film.corners[11])


def test_a_thing_that_goes_along_the_hanging_part_does_not_take_it_along(film: Film) -> None:
    """As dark as the strip before a bright wall, upright like the part at the gripper, and slow."""
    end = float(film.ends[0][0])
    grey = int(film.frames[0].image[tuple(np.rint(film.curves[0][6])[::-1].astype(int))])
    places = {3 + i: end - 16.0 + 3.0 * i for i in range(15)}
    found = followed(film, {k: crossed(film.frames[k].image, x, 9.0, grey) for k, x in places.items()})
    for line, at in zip(found, film.ends, strict=True):
        if line is not None:
            assert np.hypot(*(line.points[0] - at)) < 0.5 * BAND + 2.0
    for line, curve in zip(found[19:], film.curves[19:], strict=True):
        assert line is not None
        assert distances(line.points, curve).max() < 0.5 * BAND + 1.5


def test_a_strip_that_seemed_to_rush_off_is_found_where_it_was(film: Film) -> None:
    tracker = strip_tracker.StripTracker(film.calibration.mapping, STRIP, "film")
    for i in range(4):
        tracker(film.frames[i], film.ends[i], film.corners[i])
    tracker._motion = np.tile([3000.0, -3000.0], (strip_tracker.POINTS, 1))
    line = tracker(film.frames[4], film.ends[4], film.corners[4])
    assert line is not None
    assert distances(line.points, film.curves[4]).max() < 0.5 * BAND + 1.5


def test_a_strip_partly_hidden_is_not_looked_for_where_it_was_once_it_is_found(
    film: Film, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks: list[bool] = []

    def follow(image: Picture, guess: Centreline, *rest: Any) -> following.Followed | None:
        found = following.follow(image, guess, *rest)
        looks.append(found is not None and found.sound and found.share < strip_tracker.CLEARLY_SEEN)
        return found

    monkeypatch.setattr(strip_tracker, "follow", follow)
    middle = 0.5 * (float(film.curves[0][:, 0].min()) + float(film.ends[0][0]))
    lines = followed(film, {4: crossed(film.frames[4].image, middle, 70.0, 90)})
    assert lines[4] is not None
    # Once in each frame, twice in the one in which little is seen.
    assert sum(looks) == 2
    assert len(looks) == len(film.frames)


def test_a_bend_cut_short_does_not_shift_what_comes_behind_it() -> None:
    """In the middle one of five frames a tenth of a straight strip is not seen, and seems half as long."""
    s = np.linspace(0.0, 0.4, 81)
    lines = []
    for cut in (0.0, 0.0, 0.02, 0.0, 0.0):
        hidden = (s > 0.1) & (s < 0.14)
        x = s - cut * np.clip((s - 0.1) / 0.04, 0.0, 1.0)
        score = np.where(hidden & (cut > 0.0), 0.0, 1.0)
        points = np.column_stack([x, np.zeros(81)])
        lines.append(Centreline(points, np.zeros(81), np.ones(81), np.full(81, 100.0), score, True))
    mapping = SimpleNamespace(to_robot=lambda points: points)
    stations, points, visible = tracking.material_points(lines, mapping)
    assert visible[2] == pytest.approx(0.38)
    behind = stations > 0.15
    # What is cut away took the rest of the strip along: the same material is as far from the end as ever.
    np.testing.assert_allclose(points[2, behind, 0], points[1, behind, 0] - 0.02, atol=8e-3)


def test_a_strip_of_which_a_bend_is_hidden_at_first_is_waited_for(film: Film) -> None:
    """Something in front of the loop makes sag and lying part look like one strip, much too short."""
    background = int(np.median(film.frames[0].image[:40]))
    left = float(film.curves[0][:, 0].min())
    hidden = {k: crossed(film.frames[k].image, left + 20.0, 90.0, background) for k in range(5)}
    found = followed(film, hidden)
    assert all(line is None for line in found[:5])
    assert found[5] is not None
    assert distances(found[5].points, film.curves[5]).max() < 0.5 * BAND + 1.5


def test_what_a_line_lacks_is_missing_where_it_is_hidden() -> None:
    arc, score = np.linspace(0.0, 1.0, 101), np.ones(101)
    score[30:41] = 0.0
    found = tracking.corrected_arc(arc, score, 1.05)
    assert found[-1] == pytest.approx(1.05)
    assert np.diff(found)[31:39] == pytest.approx(np.diff(found)[31])
    assert found[30] - arc[30] < 0.15 * 0.05
    assert found[40] - arc[40] > 0.75 * 0.05
    np.testing.assert_allclose(tracking.corrected_arc(arc, np.ones(101), 1.05), 1.05 * arc)


def test_a_line_may_be_as_long_again_as_usual_at_once_but_no_longer(film: Film) -> None:
    tracker = strip_tracker.StripTracker(film.calibration.mapping, STRIP, "film")
    tracker._first_length, tracker._lengths = 0.4, [(0.0, 0.4), (0.04, 0.4), (0.08, 0.394)]
    assert tracker._plausible(0.4, 0.04)
    assert tracker._plausible(0.395, 0.04)
    assert not tracker._plausible(0.398, 0.04)
    assert not tracker._plausible(0.403, 0.04)
    assert not tracker._plausible(0.39, 0.04)


def test_the_marker_is_not_taken_for_the_strip(film: Film) -> None:
    image = film.frames[0].image.copy()
    corners = np.array([[300.0, 40.0], [340.0, 40.0], [340.0, 80.0], [300.0, 80.0]])
    cv2.fillConvexPoly(image, corners.astype(np.int32), (255,))
    before = image.copy()
    cleared = strip_tracker.without_marker(image, corners)
    np.testing.assert_array_equal(image, before)
    assert cleared[290 - 250 : 80, 300:340].max() < 200
    outside = np.ones(image.shape, bool)
    outside[60 - 33 : 60 + 34, 320 - 33 : 320 + 34] = False
    np.testing.assert_array_equal(cleared[outside], image[outside])


def test_places_nearer_to_another_layer_are_not_the_strip_s_own() -> None:
    curve = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [20.0, 12.0], [10.0, 12.0], [0.0, 12.0]])
    places = curve.copy()
    places[0, 1] = 5.0
    places[1, 1] = 7.0
    assert following._on_own_layer(places, curve, 2).tolist() == [True, False, True, True, True, True]


def test_what_is_learnt_of_a_strip_stays_a_width(
    film: Film, lines: list[Centreline | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Evening out may overshoot where widths jump; of a width below nothing the next scores would be no numbers."""
    line, image = lines[0], film.frames[0].image
    assert line is not None
    guess = following.with_appearance(image, line)
    monkeypatch.setattr(following, "_denoised", lambda values: np.full_like(values, -1e3))
    found = following.follow(image, guess, line.points[[0, -1]], 4.0)
    assert found is not None
    assert found.line.width.min() >= 1.0
    assert found.line.contrast.min() >= 1.0


def test_a_curve_is_cut_or_extended_to_its_ends() -> None:
    curve = np.column_stack([np.linspace(0.0, 10.0, 11), np.zeros(11)])
    points, places = following.between_ends(curve, np.array([[-2.0, 1.0], [8.0, -1.0]]), 11)
    np.testing.assert_allclose(points, np.column_stack([np.linspace(-2.0, 8.0, 11), np.zeros(11)]), atol=1e-9)
    np.testing.assert_allclose(places, np.linspace(-2.0, 8.0, 11), atol=1e-9)
    points, _ = following.between_ends(curve, np.array([[1.0, 0.0], [13.0, 0.0]]), 5)
    np.testing.assert_allclose(points[:, 0], np.linspace(1.0, 13.0, 5), atol=1e-9)
