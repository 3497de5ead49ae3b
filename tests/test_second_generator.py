"""The second generator of recordings: its chain against the elastica, its camera against its own rays."""

from __future__ import annotations

import numpy as np
import pytest

from second_generator import chain
from second_generator.camera import Camera
from second_generator.recording import CAMERAS, Design
from stripfold import elastica
from studies import recordings_accuracy
from studies import recordings_chain as chained


def test_the_chain_snaps_where_the_elastica_does():
    """Swept at two speeds; the lag grows with the speed to a power of about 2/3, between 0.6 and 0.8."""
    height = 4.5
    start = chain.critical(height) - 0.25
    slow, fast = (chain.landing(height, start, speed) for speed in (0.002, 0.004))
    limits = [slow - (fast - slow) / (2.0**power - 1.0) for power in (0.6, 0.8)]
    known = elastica.critical(height).advance
    np.testing.assert_allclose(limits, known, rtol=3e-3)
    assert chain.critical(height) == pytest.approx(known, rel=5e-3)


@pytest.mark.parametrize("of", CAMERAS)
def test_rays_lead_to_where_the_camera_shows_them(of: dict):
    camera = Camera(**of)
    pixels = np.random.default_rng(0).uniform(0.0, 1.0, (50, 2)) * camera.size
    rays = camera.rays(pixels)
    np.testing.assert_allclose(camera.project(camera.place + 0.7 * rays), pixels, atol=1e-9)
    np.testing.assert_allclose(rays @ camera.axes[2], 1.0)
    # The middle of the folding plane is near the middle of the picture, x to the right, z up.
    origin, right, up = camera.project(np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.0, 0.01]]))
    assert np.abs(origin - 0.5 * np.array(camera.size)).max() < 0.02 * camera.size[0]
    assert right[0] - origin[0] == pytest.approx(0.01 / of["field"] * camera.size[0], rel=0.02)
    assert up[1] < origin[1]


def test_a_quarter_of_the_recordings_is_of_the_chain():
    names = [recordings_accuracy._case(number, 1, 0.25).generator for number in range(40)]
    assert [names.count(name) for name in ("chain", "dynamics", "shapes")] == [10, 10, 20]
    assert Design(3, 1) == Design(3, 1)
    assert Design(3, 1).factors != Design(7, 1).factors
    factors = chained.ChainCase(1, 7).factors
    assert set(factors) == set(recordings_accuracy._case(0, 7, 0.25).factors)
    assert np.isnan(factors["tone"])
