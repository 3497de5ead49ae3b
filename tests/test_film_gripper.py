"""The gripper's marker, or a part of it in place of one: found, followed and refused."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from scipy import ndimage

from filmed import exposed, marker_picture
from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import InvalidInputError, TrackingError
from stripfold.film import (
    boards,
    gripper,
)
from stripfold.film.gripper import GripperTracker, Track, interpolate_gaps
from stripfold.film.holder import Marker, Template
from stripfold.film.video import Frame

A4 = boards.dictionary("4x4_50")


SIZE = (180, 150)


PLAIN = np.full(SIZE[::-1], 90, np.uint8)


@pytest.mark.parametrize(
    ("dictionary", "number", "side", "motion", "perspective"),
    [
        ("4x4_50", 7, 60.0, 0.0, 0.0),
        ("5x5_100", 99, 40.0, 0.0, 0.0),
        ("6x6_250", 3, 48.0, 4.0, 0.0),
        ("apriltag_36h11", 5, 80.0, 0.0, 0.03),
    ],
)
def test_centre_and_corners(dictionary: str, number: int, side: float, motion: float, perspective: float) -> None:
    rng = np.random.default_rng(number)
    marker, angle, centre = Marker(dictionary, number), 0.2, (121.3, 98.8)
    picture = marker_picture(
        boards.dictionary(dictionary), number, centre, side, angle, motion=motion, perspective=perspective
    )
    image = exposed(picture, 2.0, rng)
    rough = marker.find(image)
    assert rough is not None
    fit = marker.fit(image, rough.moved(np.array([1.5, -1.5])))
    assert fit is not None
    np.testing.assert_allclose(fit.centre, centre, atol=0.02)
    assert np.all(fit.sd < 0.02)
    assert fit.score > 0.98
    if not perspective:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]) * side
        np.testing.assert_allclose(fit.corners, centre + square @ turn.T, atol=0.12)
        assert fit.side == pytest.approx(side, abs=0.1)


@pytest.mark.parametrize("gamma", [1.0, 1.6, 2.2])
def test_its_size_is_told_whatever_the_tones(gamma: float) -> None:
    """As a camera codes them black shrinks beside white, by a per cent of a marker of 30 pixels."""
    rng, off = np.random.default_rng(4), []
    for number in (40, 41):
        marker = Marker("4x4_50", number)
        centre, side = (rng.uniform(50.0, 60.0), rng.uniform(50.0, 60.0)), rng.uniform(26.0, 38.0)
        picture = marker_picture(A4, number, centre, side, 0.1, size=(110, 110), blur=0.9)
        image = exposed(255.0 * (picture / 255.0) ** (1.0 / gamma), 1.0, rng)
        rough = marker.find(image)
        fit = None if rough is None else marker.fit(image, rough)
        assert fit is not None
        off.append(fit.side / side - 1.0)
    assert off == pytest.approx([0.0, 0.0], abs=2e-3)


@pytest.mark.parametrize(("noise", "motion"), [(2.0, 0.0), (6.0, 0.0), (3.0, 3.0)])
def test_the_stated_sd_is_the_scatter(noise: float, motion: float) -> None:
    rng = np.random.default_rng(int(10 * noise))
    marker, errors = Marker("4x4_50", 7), []
    for _ in range(30):
        centre = np.array([60.0, 52.0]) + rng.uniform(-1.0, 1.0, 2)
        picture = marker_picture(A4, 7, tuple(centre), 44.0, rng.uniform(-0.1, 0.1), size=(120, 104), motion=motion)
        rough = marker.find(exposed(picture, 1.0, rng))
        assert rough is not None
        for _ in range(3):
            fit = marker.fit(exposed(picture, noise, rng), rough)
            assert fit is not None
            errors.append((fit.centre - centre) / fit.sd)
    scatter = np.sqrt(np.mean(np.square(errors), axis=0))
    assert np.all((scatter > 0.7) & (scatter < 1.4)), scatter


@pytest.mark.parametrize(("side", "blur"), [(18.0, 1.1), (24.0, 1.5)])
def test_small_markers_out_of_focus_are_found(side: float, blur: float) -> None:
    rng = np.random.default_rng(3)
    for number in range(24):
        (x, y), angle = 60.0 + rng.uniform(0.0, 1.0, 2), rng.uniform(-0.1, 0.1)
        picture = marker_picture(A4, number, (x, y), side, angle, size=(120, 120), blur=blur)
        assert Marker("4x4_50", number).find(exposed(picture, 2.0, rng)) is not None, number


def test_no_marker() -> None:
    rng = np.random.default_rng(0)
    image = exposed(marker_picture(A4, 7, (120.0, 100.0), 50.0), 2.0, rng)
    marker = Marker("4x4_50", 7)
    found = marker.find(image)
    assert found is not None
    assert Marker("4x4_50", 8).find(image) is None
    for other in (PLAIN, rng.integers(0, 255, PLAIN.shape, dtype=np.uint8)):
        fit = marker.fit(other, found)
        assert fit is None or fit.score < gripper.MIN_SCORE
    fit = marker.fit(image, found.moved(np.array([500.0, 0.0])))
    assert fit is None or fit.score < gripper.MIN_SCORE


def position(t: Array) -> Array:
    """Position of a gripper that advances at 90 px/s from 0.3 to 1.0 s and oscillates a little vertically."""
    return np.column_stack([50.0 + 90.0 * np.clip(t - 0.3, 0.0, 0.7), 75.0 + 2.0 * np.sin(3.0 * t)])


TIMES = np.arange(40) / 30.0


@pytest.fixture(scope="module")
def film() -> list[Picture]:
    rng = np.random.default_rng(5)
    motion = np.where((TIMES > 0.3) & (TIMES < 1.0), 1.5, 0.0)
    return [
        exposed(marker_picture(A4, 7, tuple(place), 42.0, 0.05, size=SIZE, motion=blur), 2.0, rng)
        for place, blur in zip(position(TIMES), motion, strict=True)
    ]


def follow(images: list[Picture]) -> gripper.Track:
    tracker = gripper.GripperTracker(Marker("4x4_50", 7), "film.mp4")
    return gripper.interpolate_gaps([tracker(Frame(k, TIMES[k], image)) for k, image in enumerate(images)], "film.mp4")


def test_a_moving_gripper(film: list[Picture]) -> None:
    track = follow(film)
    assert np.all(track.tracked)
    errors = track.centre - position(TIMES)
    assert np.abs(errors).max() < 0.03
    scatter = np.sqrt(np.mean((errors / track.sd) ** 2))
    assert 0.7 < scatter < 1.4
    assert track.corners.shape == (40, 4, 2)


def test_hidden_for_a_while(film: list[Picture]) -> None:
    hidden = [PLAIN if 16 <= k < 22 else image for k, image in enumerate(film)]
    track = follow(hidden)
    assert np.flatnonzero(~track.tracked).tolist() == [16, 17, 18, 19, 20, 21]
    assert np.all(track.score[16:22] == 0.0)
    errors = track.centre - position(TIMES)
    assert np.all(np.abs(errors) <= 4.0 * track.sd)
    assert np.abs(errors).max() < 0.2
    assert np.all(np.isfinite(track.centre))
    assert np.all(track.sd[16:22] > track.sd[15])


def test_lost(film: list[Picture]) -> None:
    with pytest.raises(TrackingError, match="first frame") as caught:
        follow([PLAIN, *film[1:]])
    assert "film.mp4" in str(caught.value)
    with pytest.raises(TrackingError, match=r"lost from 0\.300 to 0\.\d+ s"):
        follow([*film[:10], *[PLAIN] * 30])
    with pytest.raises(TrackingError, match=r"2[0-9]% of 40 frames"):
        follow([PLAIN if k % 4 == 3 else image for k, image in enumerate(film)])


WALL = 240, 180


BOX = (61, 42, 44, 36)


CENTRE = np.array([82.5, 59.5])


def block(place: Array, rng: np.random.Generator, light: float = 1.0, turn: float = 0.0) -> Picture:
    """A patterned block with its middle at a place, before a plain wall."""
    block = cv2.GaussianBlur(np.random.default_rng(1).uniform(40.0, 220.0, (60, 70)), (0, 0), 2.5)
    block = 120.0 + 4.0 * (block - block.mean())
    cos, sin = np.cos(turn), np.sin(turn)
    linear = np.array([[cos, -sin], [sin, cos]])
    # OpenCV would round places to 1/32 pixel.
    back = np.linalg.inv(linear)[::-1, ::-1]
    seen = ndimage.affine_transform(block, back, [29.5, 34.5] - back @ place[::-1], WALL[::-1], cval=np.nan)
    seen = np.where(np.isnan(seen), 90.0, seen)
    return exposed(light * seen, 1.5, rng)


def plate(place: Array, rng: np.random.Generator, light: float = 1.0) -> Picture:
    """A dark square with a spot on a light plate: few edges, which something dark before it imitates."""
    columns, rows = np.meshgrid(*(np.arange(n) for n in WALL))
    x, y = columns - place[0], rows - place[1]

    def inside(distance: Array, reach: float) -> Array:
        return np.asarray(1.0 / (1.0 + np.exp(2.0 * (distance - reach))))

    square = np.maximum(np.abs(x), np.abs(y))
    seen = 90.0 + 110.0 * inside(square, 26.0) - 160.0 * inside(square, 15.0)
    return exposed(light * (seen + 130.0 * inside(np.hypot(x - 4.0, y + 3.0), 6.0)), 1.5, rng)


def followed(seed: int, show: Callable[..., Picture], covered: int = 0) -> tuple[Track, Array]:
    """The track in 40 frames with less and less light, and the true places; a post passes before some of them."""
    rng = np.random.default_rng(seed)
    tracker = GripperTracker(Template(show(CENTRE, rng), BOX), "film.mp4")
    time = np.arange(40) / 25.0
    place = CENTRE + np.outer(time, [33.7, -9.3])
    grips = []
    for k, t in enumerate(time):
        seen = show(place[k], rng, 1.0 - 0.2 * t)
        if 0 < k - 12 <= covered:
            edge = round(float(place[k, 0])) + 24 - 10 * (k - 12)
            seen[:, edge : edge + 12] = 10
        grips.append(tracker(Frame(k, t, seen)))
    return interpolate_gaps(grips, "film.mp4"), place


def test_it_is_followed_to_a_hundredth_of_a_pixel_and_knows_how_well():
    ratios = []
    for seed in range(5):
        track, place = followed(seed, block)
        assert np.all(track.tracked)
        errors = track.centre - place
        assert np.abs(errors).max() < 0.04
        ratios.append(errors[1:] / track.sd[1:])
    assert 0.75 < np.sqrt(np.mean(np.square(ratios))) < 1.3
    np.testing.assert_allclose(track.corners[0].mean(axis=0), track.centre[0], atol=1e-9)
    np.testing.assert_allclose(np.ptp(track.corners[0], axis=0), BOX[2:], atol=0.1)


def test_where_something_passes_before_it_the_stated_error_holds():
    track, place = followed(8, plate, covered=7)
    assert 3 <= np.sum(~track.tracked) <= 7
    errors = track.centre - place
    assert np.abs(errors).max() < 0.05
    assert np.abs(errors / track.sd).max() < 5.0


@pytest.mark.parametrize(
    ("box", "message"),
    [
        ((61, 42, 6, 36), "at least 12"),
        ((-1, 42, 40, 36), "240 x 180"),
        ((210, 42, 40, 36), "240 x 180"),
        ((180, 120, 40, 36), "upright and level edges"),
    ],
)
def test_boxes_that_are_refused(box: tuple[int, int, int, int], message: str):
    with pytest.raises(InvalidInputError, match=message):
        Template(block(CENTRE, np.random.default_rng(6)), box)
