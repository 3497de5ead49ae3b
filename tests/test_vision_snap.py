"""The snap in a record of points: its onset against motions whose speed is known."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold.film import measure, snap

TOUCH, TIME = 2.6, 0.12
SLOW, FAST = 0.01, 0.81
ONSET = TOUCH + TIME * np.log(snap.LEVEL)
SHAPE = np.random.default_rng(7).normal(size=(20, 2))
SHAPE /= np.sqrt(np.mean(np.sum(SHAPE**2, axis=1)))


def way(t: np.ndarray) -> np.ndarray:
    """Integral of a speed that rises exponentially from SLOW to FAST, and falls back at once."""
    rise = (FAST - SLOW) * TIME * np.exp((np.minimum(t, TOUCH) - TOUCH) / TIME)
    return SLOW * t + rise


def moving(t: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """Points that move along a direction of their own each, their median as :func:`way`."""
    return scale * way(t)[:, None, None] * SHAPE


@pytest.mark.parametrize("rate", [25.0, 30.0, 60.0, 240.0])
def test_onset_is_at_its_level_at_any_frame_rate(rate: float):
    t = np.arange(0.013, 4.0, 1.0 / rate)
    found = snap.speed(t, moving(t))
    assert found.onset == pytest.approx(ONSET, abs=0.006)
    assert found.following == pytest.approx(SLOW, rel=1e-3)
    # The mean of the exponential over the window before its end.
    share = TIME / snap.WINDOW * (1.0 - np.exp(-snap.WINDOW / TIME))
    assert found.ratio == pytest.approx(1.0 + share * (FAST - SLOW) / SLOW, rel=0.05)
    assert not found.several


def test_a_steady_rise_is_delayed_by_a_quarter_of_the_window():
    """The correction is for what lies between it and an exponential rise, whose onset the window does not shift."""
    t = np.arange(0.0, 4.0, 1.0 / 60.0)
    began, took = 1.2, TOUCH - 1.2
    ran = np.clip(t - began, 0.0, took)
    steady = snap.speed(t, (SLOW * t + 0.5 * 0.06 * ran**2)[:, None, None] * SHAPE)
    late = steady.onset - (began + snap.LEVEL * took)
    assert late == pytest.approx(0.25 * snap.WINDOW, abs=0.012)
    assert 0.0 < late - measure.WINDOW_SHIFT * steady.delay < 1.1 * measure.WINDOW_SD * steady.delay
    assert snap.speed(t, moving(t)).delay < 0.25 * snap.WINDOW < 0.7 * snap.WINDOW < steady.delay < snap.WINDOW


def test_steady_advance():
    t = np.linspace(0.0, 6.0, 181)
    x = 0.01 * np.clip(t - 1.0, 0.0, 4.0)
    start, stop = snap.steady_advance(t, -x)
    assert start == pytest.approx(1.0 + snap.SETTLING_TIME, abs=0.2)
    assert stop == pytest.approx(5.0, abs=0.2)


def test_following_alone_is_no_snap():
    t = np.arange(0.0, 4.0, 1.0 / 30.0)
    noise = 2e-5 * np.random.default_rng(3).normal(size=(len(t), 20, 2))
    found = snap.speed(t, SLOW * t[:, None, None] * SHAPE + noise)
    assert found.ratio < snap.MIN_RATIO


def test_ripple_before_the_snap_is_ignored():
    """A burst three times as fast as following, and irreversible, but a tenth of what comes later."""
    t = np.arange(0.0, 4.0, 1.0 / 30.0)
    ripple = 0.004 * np.clip((t - 1.0) / 0.2, 0.0, 1.0)
    assert snap.speed(t, moving(t) + ripple[:, None, None] * SHAPE).onset == pytest.approx(ONSET, abs=0.01)


def test_second_snap_is_detected():
    t = np.arange(0.0, 6.0, 1.0 / 30.0)
    twice = moving(t) + moving(np.maximum(t - 1.8, 0.0))
    assert snap.speed(t, twice).several
    assert not snap.speed(t, moving(t)).several


def test_displacement_that_is_reversed_is_no_snap():
    """Something passes and takes the points along for a moment, faster than the snap behind it."""
    t = np.arange(0.0, 4.0, 1.0 / 30.0)
    points = moving(t)
    points[(t > 1.0) & (t < 1.2)] += 0.05 * SHAPE
    assert snap.speed(t, points).onset == pytest.approx(ONSET, abs=0.01)


def test_noise_at_a_low_gripper_speed_is_no_snap():
    """Following at 2 mm/s the noise of the points is as fast as the strip; the snap is far above both."""
    random = np.random.default_rng(5)
    t = np.arange(0.0, 4.0, 1.0 / 30.0)
    slow = moving(t) - 0.8 * SLOW * t[:, None, None] * SHAPE
    together = 4e-4 * random.normal(size=(len(t), 1, 1)) * SHAPE
    assert snap.speed(t, slow + together).onset == pytest.approx(ONSET, abs=0.05)
