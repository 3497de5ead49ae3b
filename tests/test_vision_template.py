"""A part of the gripper in place of a marker: found, followed and refused."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from scipy import ndimage

from filmed import exposed, landscape
from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import InvalidInputError, TrackingError
from stripfold.film.frames import Frame
from stripfold.film.gripper import GripperTracker, Track, interpolate_gaps
from stripfold.film.template import Template

SIZE = 240, 180
BOX = (61, 42, 44, 36)
CENTRE = np.array([82.5, 59.5])


def picture(place: Array, rng: np.random.Generator, light: float = 1.0, turn: float = 0.0) -> Picture:
    """A patterned block with its middle at a place, before a plain wall."""
    block = cv2.GaussianBlur(np.random.default_rng(1).uniform(40.0, 220.0, (60, 70)), (0, 0), 2.5)
    block = 120.0 + 4.0 * (block - block.mean())
    cos, sin = np.cos(turn), np.sin(turn)
    linear = np.array([[cos, -sin], [sin, cos]])
    # OpenCV would round places to 1/32 pixel.
    back = np.linalg.inv(linear)[::-1, ::-1]
    seen = ndimage.affine_transform(block, back, [29.5, 34.5] - back @ place[::-1], SIZE[::-1], cval=np.nan)
    seen = np.where(np.isnan(seen), 90.0, seen)
    return exposed(light * seen, 1.5, rng)


def plate(place: Array, rng: np.random.Generator, light: float = 1.0) -> Picture:
    """A dark square with a spot on a light plate: few edges, which something dark before it imitates."""
    columns, rows = np.meshgrid(*(np.arange(n) for n in SIZE))
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
        track, place = followed(seed, picture)
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


def test_it_is_found_anywhere_and_slightly_turned():
    rng = np.random.default_rng(2)
    template = Template(picture(CENTRE, rng), BOX)
    place = np.array([150.3, 110.8])
    corners = template.corners(picture(place, rng, 0.7, 0.03))
    assert corners is not None
    np.testing.assert_allclose(corners.mean(axis=0), place, atol=0.1)
    assert template.corners(landscape(3, *SIZE[::-1])) is None
    assert template.find(landscape(3, 20, 20)) is None


def test_a_lost_template_is_an_error():
    rng = np.random.default_rng(5)
    tracker = GripperTracker(Template(picture(CENTRE, rng), BOX), "film.mp4")
    tracker(Frame(0, 0.0, picture(CENTRE, rng)))
    wall = exposed(np.full(SIZE[::-1], 90.0), 1.5, rng)
    assert not tracker(Frame(1, 0.1, wall)).tracked
    with pytest.raises(TrackingError, match="the template is lost from 0"):
        tracker(Frame(2, 0.8, wall))


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
        Template(picture(CENTRE, np.random.default_rng(6)), box)
