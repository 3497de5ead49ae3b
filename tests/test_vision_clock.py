"""Synchronisation of the robot's clock with the camera's, with known offsets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.film import clock

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
    shift, slope, bend = mapping_sd * np.array([1.0, clock.SLOPE_SHARE, clock.BEND_SHARE]) * rng.standard_normal(3)
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
            lag = clock.LAG_SD * PIXEL * rng.standard_normal()
            x = advance(times) - lag * moving + rng.normal(0.0, 1e-6, len(times))
            clocks = clock.synchronise(times, x, 1e-6, log(3.0), 5e-4, PIXEL, predicted)
            errors.append((clocks.offset - 3.0) / clocks.sd)
        z[predicted] = np.sqrt(np.mean(np.square(errors)))
    assert z[True] < 1.2 < z[False]


def test_a_log_of_another_origin_is_not_explained_by_the_clock() -> None:
    times = np.arange(0.0, 8.0, 1.0 / 30.0)
    x = advance(times) + 3e-3 + np.random.default_rng(0).normal(0.0, 2e-5, len(times))
    clocks = clock.synchronise(times, x, 1e-5, log(3.0), 3e-5, PIXEL)
    assert clocks.offset == pytest.approx(3.0, abs=0.02)
    assert clocks.shift == pytest.approx(3e-3, rel=0.15)


def test_a_log_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "robot.csv"
    path.write_text("# by the robot\nt,x,z\n0.0,0.1,0.2\n0.5,0.3,0.2\n", encoding="utf-8")
    found = clock.read_log(path)
    np.testing.assert_allclose(found.time, [0.0, 0.5])
    np.testing.assert_allclose(found.x, [0.1, 0.3])
    np.testing.assert_allclose(found.z, [0.2, 0.2])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,x\n0,1\n1,2\n", "header t,x,z"),
        ("t,x,z\n0,1,2\n", "1 rows"),
        ("t,x,z\n0,1,2\n0,1,2\n", "row 3"),
        ("t,x,z\n0,1,2\n1,inf,2\n", "row 3"),
        ("", "'0 rows' cannot be used; allowed: a CSV file with the header t,x,z and 2 to"),
        ("0,1,2,3\n1,2,3,4\n", "name its columns in the first row"),
        ("t,x,z\n" + "0" * 300_000, "field limit"),
    ],
)
def test_bad_logs(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "robot.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInputError, match=message):
        clock.read_log(path)
