"""The strip followed through a few rendered frames, against the curve that was rendered."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from oracles import following as oracle
from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import TrackingError
from stripfold.film import cross_sections, following, strip_tracker, tracking
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


def test_mapping_of_these_tests_is_that_of_the_camera(film: Film) -> None:
    inside = film.curves[0][5:40]
    np.testing.assert_allclose(film.mapping.to_pixels(film.mapping.to_robot(inside)), inside, atol=1e-3)


def test_line_is_on_the_strip_from_the_gripped_end_to_a_fixed_lying_end(film: Film, lines: list[Centreline]) -> None:
    offset = lines[0].points[0] - film.ends[0]
    assert np.hypot(*offset) < 2.0
    for k, line in enumerate(lines):
        film.assert_on_strip(k, line)
        assert np.hypot(*(line.points[0] - film.ends[k] - offset)) < 1.0
    assert np.ptp([line.points[-1] for line in lines], axis=0).max() < 1.5


@pytest.mark.parametrize("dark", [False, True])
def test_wide_strip_whose_sag_hides_the_gap_to_the_lying_part(dark: bool) -> None:
    strip, filming = ({"grey": 0.1, "edge": 0.14}, {"background": 0.75, "table": 0.65}) if dark else ({}, {})
    wide = filmed(6, {"width": 0.08} | strip, **filming)
    for line, true in zip(wide.track(), wide.curves, strict=True):
        assert line is not None
        # Seen is the middle of the band, behind the edge: higher up, and inside of the loop.
        middle = 0.5 * float(np.median(line.width))
        length = cross_sections.arc_length(true[true[:, 0] < line.points[-1, 0]])[-1]
        assert line.length == pytest.approx(length - np.pi * middle, rel=0.05)
        # Beyond its end is a clamp, as dark as a dark strip.
        assert cKDTree(true).query(line.points[:-4])[0].max() < middle + 5.0
        # The thin end at the gripper is part of it.
        assert line.width[2] < 0.7 * middle


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


def test_first_line_is_measured_until_it_is_on_its_own_layer_where_they_touch() -> None:
    wide = filmed(5, {"width": 0.08})
    lengths = []
    for frame, end, corners in zip(wide.frames, wide.ends, wide.corners, strict=True):
        line = wide.tracker()(frame, end, corners)
        assert line is not None
        lengths.append(line.length)
    # One that dips into the other layer is 2 % longer.
    assert np.ptp(lengths) < 0.005 * np.mean(lengths)


def test_first_line_keeps_to_its_own_layer_where_the_sag_is_low() -> None:
    """With a search that reaches the other layer the loop is left out, a fifth of the length."""
    wide = filmed(20, {"width": 0.08}, target=[0.055, 0.085])
    for frame, end, corners, true in list(zip(wide.frames, wide.ends, wide.corners, wide.curves, strict=True))[-3:]:
        line = wide.tracker()(frame, end, corners)
        assert line is not None
        # Seen is the inner side of the bends.
        seen = cross_sections.arc_length(true[true[:, 0] < line.points[-1, 0]])[-1]
        assert line.length == pytest.approx(0.97 * seen, rel=0.02)


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


def test_strip_that_leaves_the_picture_may_be_longer() -> None:
    film = filmed(1)
    image = film.frames[0].image[:, : round(film.curves[0][-1, 0]) - 10].copy()
    line = strip_tracker.StripTracker(film.mapping, 0.52, "film")(
        replace(film.frames[0], image=image), film.ends[0], film.corners[0]
    )
    assert line is not None
    assert line.open_ends == (False, True)


@pytest.mark.parametrize("grey", [5, 90, 235])
def test_passing_object_hides_but_does_not_mislead(film: Film, grey: int) -> None:
    left, right = float(film.curves[0][:, 0].min()), float(film.ends[0][0])
    found = film.track(film.behind_bar({4 + i: left + (right + 40.0 - left) * i / 11.0 for i in range(12)}, 14.0, grey))
    for k, line in enumerate(found):
        if k >= 17 or line is not None:
            film.assert_on_strip(k, line, 4.0 if k < 17 else 1.5)
    assert sum(line is None for line in found) <= 4


def test_object_moving_along_the_hanging_part_does_not_take_the_line_along(film: Film) -> None:
    """As dark as the strip before a bright wall, upright like the part at the gripper, and slow."""
    grey = int(film.frames[0].image[tuple(np.rint(film.curves[0][6])[::-1].astype(int))])
    places = {3 + i: float(film.ends[0][0]) - 16.0 + 3.0 * i for i in range(15)}
    found = film.track(film.behind_bar(places, 9.0, grey))
    for k, line in enumerate(found):
        if line is not None:
            assert np.hypot(*(line.points[0] - film.ends[k])) < 0.5 * BAND + 2.0
        if k >= 19:
            film.assert_on_strip(k, line)


def test_strip_is_lost_in_blank_frames_and_found_again(film: Film) -> None:
    found = film.track(film.blank(range(6, 8)))
    assert [i for i, line in enumerate(found) if line is None] == [6, 7]
    film.assert_on_strip(8, found[8])


def test_strip_is_searched_until_it_is_there(film: Film) -> None:
    found = film.track(film.blank(range(3)))
    assert [line is None for line in found[:4]] == [True, True, True, False]
    with pytest.raises(TrackingError, match="no strip was found"):
        film.track(film.blank(range(26)))


def test_strip_with_a_hidden_bend_in_the_first_frames_is_waited_for(film: Film) -> None:
    """Something in front of the loop makes sag and lying part look like one strip, much too short."""
    background = int(np.median(film.frames[0].image[:40]))
    left = float(film.curves[0][:, 0].min())
    found = film.track(film.behind_bar(dict.fromkeys(range(5), left + 20.0), 90.0, background))
    assert all(line is None for line in found[:5])
    film.assert_on_strip(5, found[5])


def test_strip_hidden_for_long_is_an_error(film: Film) -> None:
    with pytest.raises(TrackingError, match=r"lost at 0\.[678]"):
        film.track(film.blank(range(3, 26)))


def test_strip_away_from_the_gripper_is_an_error(film: Film) -> None:
    tracker = film.tracker()
    dropped = film.ends[0] + np.array([70.0, -70.0])
    assert tracker(film.frames[0], dropped, film.corners[0]) is None
    with pytest.raises(TrackingError, match="from where the gripper should hold it"):
        tracker(film.frames[11], dropped, film.corners[11])


def test_strip_that_is_dim_next_to_the_gripper_is_followed_from_there(film: Film) -> None:
    """Seen edge-on it may be thinner than a pixel; where nothing is seen the gripper has lost it."""
    image, end, hanging = film.frames[0].image, film.ends[0], film.curves[0]
    near = np.hypot(*(hanging - end).T) < 80.0
    rows, columns = (
        slice(round(end[1]) - 3, round(hanging[near][:, 1].max())),
        slice(*np.rint(end[0] + [-12, 12]).astype(int)),
    )
    around = float(np.median(image[rows, columns]))
    for contrast, holds in ((0.3, True), (0.0, False)):
        dim = image.copy()
        dim[rows, columns] = np.rint(around + contrast * (image[rows, columns] - around))
        tracker = film.tracker()
        line = tracker(replace(film.frames[0], image=dim), end, film.corners[0])
        assert (line is not None) == holds
        if line is not None:
            film.assert_on_strip(0, line)
            assert np.hypot(*(line.points[0] - end)) < 3.0


def test_tight_bend_in_a_small_picture_stays_on_the_strip() -> None:
    """The line would be a little shorter in each frame, until it has left the bend."""
    small = filmed(20, {"width": 0.04}, eta_b=9000.0, size=[320, 240], defocus=1.0)
    lengths = [line.length for line in small.track() if line is not None]
    assert len(lengths) == 20
    assert min(lengths) > 0.98 * lengths[0]


def test_strip_is_found_where_it_was_after_a_wrong_velocity(film: Film) -> None:
    tracker = film.tracker()
    for i in range(4):
        tracker(film.frames[i], film.ends[i], film.corners[i])
    tracker._motion = np.tile([3000.0, -3000.0], (strip_tracker.POINTS, 1))
    film.assert_on_strip(4, tracker(film.frames[4], film.ends[4], film.corners[4]))


def test_hidden_bend_does_not_shift_the_material_behind_it() -> None:
    """In the middle one of five frames a tenth of a straight strip is hidden, and seems half as long."""
    s = np.linspace(0.0, 0.4, 81)
    lines = []
    for cut in (0.0, 0.0, 0.02, 0.0, 0.0):
        score = np.where((s > 0.1) & (s < 0.14) & (cut > 0.0), 0.0, 1.0)
        points = np.column_stack([s - cut * np.clip((s - 0.1) / 0.04, 0.0, 1.0), np.zeros(81)])
        lines.append(Centreline(points, np.zeros(81), np.ones(81), np.full(81, 100.0), score, True))
    mapping: Any = SimpleNamespace(to_robot=lambda points: points)
    stations, points, visible = tracking.material_points(lines, mapping)
    assert visible[2] == pytest.approx(0.38)
    behind = stations > 0.15
    np.testing.assert_allclose(points[2, behind, 0], points[1, behind, 0] - 0.02, atol=8e-3)


def test_missing_length_is_attributed_to_hidden_parts() -> None:
    arc, score = np.linspace(0.0, 1.0, 101), np.ones(101)
    score[30:41] = 0.0
    found = tracking.corrected_arc(arc, score, 1.05)
    assert found[-1] == pytest.approx(1.05)
    assert np.diff(found)[31:39] == pytest.approx(np.diff(found)[31])
    assert found[30] - arc[30] < 0.15 * 0.05
    assert found[40] - arc[40] > 0.75 * 0.05
    np.testing.assert_allclose(tracking.corrected_arc(arc, np.ones(101), 1.05), 1.05 * arc)


@pytest.mark.parametrize(
    ("length", "plausible"), [(0.4, True), (0.395, True), (0.398, False), (0.403, False), (0.39, False)]
)
def test_length_grows_slowly_or_returns_to_the_usual_one(film: Film, length: float, plausible: bool) -> None:
    tracker = film.tracker()
    tracker._first_length, tracker._lengths = 0.4, [(0.0, 0.4), (0.04, 0.4), (0.08, 0.394)]
    assert tracker._plausible(length, 0.04) == plausible


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


def test_places_nearer_to_another_layer_are_rejected() -> None:
    curve = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [20.0, 12.0], [10.0, 12.0], [0.0, 12.0]])
    places = curve + np.array([[0.0, 5.0], [0.0, 7.0], *[[0.0, 0.0]] * 4])
    assert cross_sections.on_own_layer(places, curve, 2).tolist() == [True, False, True, True, True, True]


def test_only_the_outer_edge_counts_next_to_another_layer() -> None:
    """Two bands with blurred edges and a gap too narrow to be seen; the upper one is next to the gripper."""
    x = np.arange(20.0, 160.0, 4.0)
    upper = np.column_stack([x[::-1], np.full(len(x), 40.0)])
    curve = np.concatenate([upper, [[10.0, 44.0]], upper[::-1] + np.array([0.0, 8.0])])
    across, width = cross_sections.normals(curve), np.full(len(curve), 6.0)
    side = oracle.free_side(curve, across, width, 8)
    up = np.sign(across[:, 1])
    assert np.all(side[5:25] == -up[5:25])
    assert np.all(side[-25:-5] == up[-25:-5])
    assert not oracle.free_side(curve, across, width - 3.0, 8).any()
    image = np.full((90, 180), 40, np.uint8)
    for y in (40, 48):
        image[y - 3 : y + 4, 15:165] = 200
    image = np.asarray(cv2.GaussianBlur(image, (0, 0), 1.5), dtype=np.uint8)
    seen = oracle.edges_beside(image, curve[5:25], across[5:25], np.full(20, 7.0), side[5:25])
    assert np.abs(seen.offset).max() < 0.25
    assert np.all(seen.found)
    both = cross_sections.edges_at(image, curve[5:25], across[5:25], 7.0, True)
    assert np.abs(both.offset).min() > 0.5


def test_curve_is_cut_or_extended_to_its_ends() -> None:
    curve = np.column_stack([np.linspace(0.0, 10.0, 11), np.zeros(11)])
    for ends in ([[-2.0, 1.0], [8.0, -1.0]], [[1.0, 0.0], [13.0, 0.0]]):
        points, places = following.between_ends(curve, np.array(ends), 11)
        expected = np.linspace(ends[0][0], ends[1][0], 11)
        np.testing.assert_allclose(points, np.column_stack([expected, np.zeros(11)]), atol=1e-9)
        np.testing.assert_allclose(places, expected, atol=1e-9)
