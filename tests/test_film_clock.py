"""The onset of the snap in a record of points, and the two clocks, against motions that are known."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold.base.arrays import Array
from stripfold.base.errors import SynchronisationError
from stripfold.film import clock, fitted, snap

PIXEL = 5e-4
"""m."""


def advance(t: Array, start: float = 1.0, stop: float = 6.0, speed: float = 0.02, ramp: float = 0.2) -> Array:
    """x of a gripper that accelerates within ``ramp``, advances and stops."""

    def since(begin: float) -> Array:
        s = t - begin
        return np.where(s < 0.0, 0.0, np.where(s < ramp, s * s / (2.0 * ramp), s - ramp / 2.0))

    return 0.1 + speed * (since(start) - since(stop))


def log(offset: float, speed: float = 0.02, rate: float = 50.0) -> clock.RobotLog:
    t = np.arange(0.0, 9.0, 1.0 / rate)
    return clock.RobotLog(t + offset, advance(t, speed=speed), np.full_like(t, 0.09))


def found(seed: int, times: Array, mapping_sd: float, noise: float = 1e-4) -> tuple[float, clock.Clock]:
    """A true offset and the clock found; the errors of x are of the place: at rest they repeat."""
    rng = np.random.default_rng(seed)
    offset = rng.uniform(-50.0, 50.0)
    x = advance(times)
    along = 2.0 * (x - x.min()) / np.ptp(x) - 1.0
    shift, slope, bend = mapping_sd * np.array([1.0, fitted.SLOPE_SHARE, fitted.BEND_SHARE]) * rng.standard_normal(3)
    marker = rng.normal(0.0, noise, 2000)[np.rint((x - 0.1) / (clock.REPEATED * PIXEL)).astype(int)]
    error = shift + slope * along + bend * (1.5 * along**2 - 0.5) + marker
    return offset, clock.synchronise(times, x + error, noise, log(offset), mapping_sd, PIXEL)


@pytest.mark.parametrize(
    ("start", "stop", "least", "most"),
    [(0.0, 8.0, 2e-3, 0.015), (2.0, 5.0, 0.024, 0.026)],
    ids=["with starts and stops", "steady"],
)
def test_stated_sd_is_the_true_error(start: float, stop: float, least: float, most: float) -> None:
    """Starts and stops determine the offset; a steady advance only does by the mapping: 0.5 mm at 20 mm/s are 25 ms."""
    pairs = [found(seed, np.arange(start, stop, 1.0 / 30.0), 5e-4) for seed in range(100)]
    errors = np.array([clocks.offset - offset for offset, clocks in pairs])
    sds = np.array([clocks.sd for _, clocks in pairs])
    assert least < np.median(sds) < most
    assert 0.8 < np.sqrt(np.mean((errors / sds) ** 2)) < 1.2
    assert all(clocks.correlation > 0.9999 for _, clocks in pairs)


@pytest.mark.parametrize("stop", [8.0, 5.0], ids=["starts and stops", "starts"])
def test_a_marker_that_lags_while_it_moves_is_within_the_interval(stop: float) -> None:
    """As in films compressed by prediction: without its own term the offset takes the lag for a delay."""
    times, z = np.arange(0.0, stop, 1.0 / 30.0), {}
    moving = np.gradient(advance(times), times) / 0.02
    for predicted in (False, True):
        errors = []
        for seed in range(60):
            rng = np.random.default_rng(seed)
            lag = fitted.LAG_SD * PIXEL * rng.standard_normal()
            x = advance(times) - lag * moving + rng.normal(0.0, 1e-6, len(times))
            clocks = clock.synchronise(times, x, 1e-6, log(3.0), 5e-4, PIXEL, predicted)
            errors.append((clocks.offset - 3.0) / clocks.sd)
        z[predicted] = np.sqrt(np.mean(np.square(errors)))
    assert z[True] < 1.2 < z[False]


def test_slow_motion_is_recognised() -> None:
    times = np.arange(0.0, 8.0, 1.0 / 240.0)
    with pytest.raises(SynchronisationError, match=r"8 times as fast by the log.* slow motion needs the true times"):
        clock.synchronise(8.0 * times, advance(times), 1e-4, log(3.0), 5e-4, PIXEL)


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
    assert 0.0 < late - fitted.WINDOW_SHIFT * steady.delay < 1.1 * fitted.WINDOW_SD * steady.delay
    assert snap.speed(t, moving(t)).delay < 0.25 * snap.WINDOW < 0.7 * snap.WINDOW < steady.delay < snap.WINDOW


def test_a_strip_that_does_not_follow_yet_makes_the_onset_uncertain():
    """It is drawn up while the film begins, and the snap is slow: from later on the onset is another."""
    t = np.arange(0.0, 4.0, 1.0 / 30.0)

    def seen(begin: float) -> snap.Speed:
        u = np.minimum(t / 0.6, 1.0) + np.clip(t - 1.0, 0.0, TOUCH - 1.0) ** 2
        u[t > TOUCH] = 0.1
        points = SLOW * np.cumsum(u)[:, None, None] / 30.0 * SHAPE
        return snap.speed(t[t >= begin], points[t >= begin])

    early, late = seen(0.0), seen(0.3)
    assert late.drift < 1e-3
    assert 0.01 < late.onset - early.onset < 1.96 * early.onset_shift(early.drift)


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
