"""Whether the camera stood still, from pictures that are shifted by a known amount."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from filmed import landscape
from stripfold.base.arrays import Array, Picture
from stripfold.film import camera_motion
from stripfold.film.gripper import Track
from stripfold.film.thumbnails import Thumbnails

SIZE = 400, 300


def room(shift: tuple[float, float] = (0.0, 0.0), seed: int = 0, light: float = 1.0) -> Array:
    """A table before a wall with crosses on it, as seen by a shifted camera, with noise."""
    picture = np.full((SIZE[1] + 80, SIZE[0] + 80), 60.0, np.float32)
    picture[280:] = 90.0
    for x in range(50, 480, 60):
        cv2.drawMarker(picture, (x, 80), (35.0,), cv2.MARKER_CROSS, 12, 3)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
    matrix = np.column_stack([np.eye(2), np.array(shift) - 40.0])
    seen = cv2.warpAffine(picture, matrix, SIZE, flags=cv2.INTER_CUBIC)
    gradient = light * np.linspace(1.2, 0.8, SIZE[0])
    return np.asarray(seen * gradient + np.random.default_rng(seed).normal(0.0, 1.0, seen.shape))


@pytest.mark.parametrize("shift", [(3.0, 0.0), (0.0, -2.2), (-2.1, 2.1), (9.6, -4.3), (-10.0, 10.0)])
def test_a_moved_camera_is_noticed_and_measured(shift: tuple[float, float]):
    found = camera_motion.between(room(), room(shift, 1, 0.8))
    assert found.moved
    np.testing.assert_allclose(found[:2], shift, atol=0.4)


def test_a_camera_at_rest_is_not():
    """In other light, with noise, and although something else moved or has come into view."""
    first, second = room(), room(seed=1, light=0.7)
    second[60:130, 40:90] = landscape(1, 70, 50)
    first[110:140, 150:180], second[110:140, 156:186] = 2 * [landscape(2, 30, 30)]
    found = camera_motion.between(first, second)
    np.testing.assert_allclose(found[:2], 0.0, atol=0.4)
    assert not found.moved
    assert found.problem == ""


def crosses(seed: int) -> Array:
    """A wall with crosses at random places: each resembles another one."""
    random = np.random.default_rng(seed)
    picture = np.full(SIZE[::-1], 60.0, np.float32)
    for x, y in np.mgrid[20:400:45, 20:300:45].reshape(2, -1).T + random.integers(-8, 9, (63, 2)):
        cv2.drawMarker(picture, (int(x), int(y)), (30.0,), cv2.MARKER_CROSS, 12, 3)
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), 0.8) + random.normal(0.0, 1.0, picture.shape))


def film(jump: tuple[float, float], camera: bool, at: int = 30) -> tuple[Track, Thumbnails]:
    """A film of a marker that starts to move and jumps, with the picture or alone."""
    time = np.arange(60) / 20.0
    centre = np.column_stack([100.0 + 8.0 * np.clip(time - 0.5, 0.0, None), np.full(60, 50.0)])
    centre += np.random.default_rng(3).normal(0.0, 0.05, centre.shape)
    centre[at:] += jump
    kept = Thumbnails(SIZE)
    pictures: list[Picture] = [
        np.clip(room(jump if camera and k >= at else (0.0, 0.0), k), 0, 255).astype(np.uint8) for k in range(60)
    ]
    kept.pictures = pictures
    ones = np.ones(60)
    return Track(time, centre, np.zeros((60, 4, 2)), np.ones((60, 2)), ones, ones > 0.0), kept


def test_a_knock_in_the_film():
    found = camera_motion.knock(*film((2.6, -2.0), True))
    assert found is not None
    assert found[0] == pytest.approx(1.5, abs=0.15)
    np.testing.assert_allclose(found[1], (2.6, -2.0), atol=0.3)
    assert camera_motion.knock(*film((0.0, 0.0), True)) is None
    # The robot jerks, the camera stands still.
    assert camera_motion.knock(*film((2.6, -2.0), False)) is None
