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


def test_onset_at_uneven_times():
    random = np.random.default_rng(1)
    t = np.sort(np.arange(0.0, 4.0, 1.0 / 30.0) + random.uniform(-0.012, 0.012, 120))
    assert snap.speed(t, moving(t)).onset == pytest.approx(ONSET, abs=0.006)


def test_onset_does_not_depend_on_the_scale():
    t = np.arange(0.0, 4.0, 1.0 / 30.0)
    wanted = snap.speed(t, moving(t)).onset
    assert snap.speed(t, moving(t, 7.0)).onset == pytest.approx(wanted, abs=1e-9)


def test_onset_ignores_a_few_outlying_points():
    t = np.arange(0.0, 4.0, 1.0 / 30.0)
    points = moving(t)
    points[t > 1.0, :6] += 0.1
    assert snap.speed(t, points).onset == pytest.approx(ONSET, abs=0.02)


def test_raised_part_includes_a_sag_that_nearly_touches():
    stations = np.linspace(0.0, 0.4, 41)
    z = np.interp(stations, [0.0, 0.1, 0.2, 0.25, 0.4], [0.1, 0.012, 0.03, 0.0, 0.0])
    points = np.stack([stations, z], axis=1)[None].repeat(6, axis=0)
    chosen = snap.raised(points, 0.1)
    assert chosen[:23].all()
    assert not chosen[25:].any()


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


def test_a_frame_that_shows_the_strip_late_is_not_the_peak_of_a_slow_snap():
    t = np.delete(np.arange(0.0, 14.0, 1.0 / 15.0), 154)
    began, end, slow, fast = 9.0, 12.7, 0.003, 0.014
    ran = np.clip(t - began, 0.0, end - began)
    points = (slow * t + 0.5 * (fast - slow) / (end - began) * ran**2)[:, None, None] * SHAPE
    late = 153
    points[late] = points[late - 1]
    found = snap.speed(t, points)
    assert found.u[np.searchsorted(found.t, t[late + 1] + 0.03)] > 1.1 * found.level(snap.LEVEL)
    assert found.t[found.peak] == pytest.approx(end, abs=0.05)
    assert found.onset == pytest.approx(began + snap.LEVEL * (end - began), abs=0.1)


def test_onset_is_the_middle_of_several_crossings():
    """Noise of a slow rise makes the speed pass its half many times; the onset is not the last of them."""
    t = np.linspace(0.0, 6.0, 601)
    rise = np.clip(t - 1.0, 0.0, 4.0) / 4.0
    swings = 0.1 * np.sin(2.0 * np.pi * t / 0.2)
    u = np.where(t < 5.2, 1.0 + 3.0 * rise + 3.0 * swings * (rise > 0.0), 0.0)
    found = snap.Speed(t, u, 1.0, int(np.argmax(u)))
    last = t[np.flatnonzero(u[: found.peak] < found.level(snap.LEVEL))[-1]]
    middle = 1.0 + 4.0 * (found.level(snap.LEVEL) - 1.0) / 3.0
    assert last > middle + 0.2
    assert found.onset == pytest.approx(middle, abs=0.1)


def test_displacement_that_is_reversed_in_one_burst_is_no_snap():
    """Something passes for half a second; by then following alone has gone half as far."""
    t = np.arange(0.0, 4.0, 1.0 / 30.0)
    points = moving(t)
    points += 0.012 * np.clip(np.minimum((t - 0.8) / 0.2, (1.3 - t) / 0.1), 0.0, 1.0)[:, None, None] * SHAPE
    assert snap.speed(t, points).onset == pytest.approx(ONSET, abs=0.01)


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


def test_crossing_is_interpolated_linearly():
    """By hand: it rises by one per second, from nothing to two."""
    rising = snap.Speed(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0]), 0.0, 2)
    assert rising.crossing(1.3) == pytest.approx(1.3)
    assert rising.onset == pytest.approx(2.0 * snap.LEVEL)
    assert rising.onset_shift(0.1) == pytest.approx(0.2 * snap.LEVEL)
    assert np.isnan(rising.crossing(-0.5))


def test_a_fall_of_the_speed_before_the_peak() -> None:
    """By hand: from 1 to 6, half-way at 3.5; what falls by 1 of 5 before the onset, and by 2 of 5 behind it."""
    u = np.array([1.0, 2.0, 1.0, 3.0, 5.0, 3.0, 6.0, 0.0])
    assert snap.Speed(np.arange(8.0), u, 1.0, 6).fall == pytest.approx(0.4)
    assert snap.Speed(np.arange(3.0), np.array([1.0, 0.5, 6.0]), 1.0, 2).fall == 0.0


def test_noise_at_a_low_gripper_speed_is_no_snap():
    """Following at 2 mm/s the noise of the points is as fast as the strip; the snap is far above both."""
    random = np.random.default_rng(5)
    t = np.arange(0.0, 4.0, 1.0 / 30.0)
    slow = moving(t) - 0.8 * SLOW * t[:, None, None] * SHAPE
    together = 4e-4 * random.normal(size=(len(t), 1, 1)) * SHAPE
    assert snap.speed(t, slow + together).onset == pytest.approx(ONSET, abs=0.05)
