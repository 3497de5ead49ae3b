"""Synchronisation of the robot's clock with the camera's, with known offsets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError, SynchronisationError
from stripfold.vision import clock


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
    """A true offset and the clock found."""
    rng = np.random.default_rng(seed)
    offset = rng.uniform(-50.0, 50.0)
    x = advance(times) + rng.normal(0.0, mapping_sd) + rng.normal(0.0, noise, len(times))
    return offset, clock.synchronise(times, x, noise, log(offset), mapping_sd)


@pytest.mark.parametrize(
    ("start", "stop", "least", "most"),
    [(0.0, 8.0, 3e-4, 1e-3), (2.0, 5.0, 0.024, 0.026)],
    ids=["with starts and stops", "steady"],
)
def test_stated_sd_is_the_true_error(start: float, stop: float, least: float, most: float) -> None:
    """Starts and stops determine the offset; a steady advance only does by the mapping: 0.5 mm at 20 mm/s are 25 ms."""
    pairs = [found(seed, np.arange(start, stop, 1.0 / 30.0), 5e-4) for seed in range(60)]
    errors = np.array([clocks.offset - offset for offset, clocks in pairs])
    sds = np.array([clocks.sd for _, clocks in pairs])
    assert np.all((sds > least) & (sds < most))
    assert 0.7 < np.sqrt(np.mean((errors / sds) ** 2)) < 1.4
    assert all(clocks.correlation > 0.9999 for _, clocks in pairs)


def test_shift_of_the_mapping() -> None:
    times = np.arange(0.0, 8.0, 1.0 / 30.0)
    x = advance(times) + 7e-4
    clocks = clock.synchronise(times, x, 1e-4, log(3.25), 1e-3)
    assert clocks.offset == pytest.approx(3.25, abs=1e-4)
    assert clocks.shift == pytest.approx(7e-4, rel=1e-2)
    np.testing.assert_allclose(clocks.to_log(np.array([1.0, 3.0])), [4.25, 6.25], atol=1e-4)


def test_a_slow_log_and_irregular_frames() -> None:
    rng = np.random.default_rng(2)
    times = np.sort(rng.uniform(0.0, 8.0, 200))
    x = advance(times, ramp=0.5) + rng.normal(0.0, 1e-4, 200)
    t = np.arange(0.0, 9.0, 0.1)
    slow = clock.RobotLog(t - 12.0, advance(t, ramp=0.5), 0.0 * t)
    clocks = clock.synchronise(times, x, 1e-4, slow, 1e-3)
    assert clocks.offset == pytest.approx(-12.0, abs=5e-3)


def test_an_advance_towards_falling_x() -> None:
    times = np.arange(0.0, 8.0, 1.0 / 30.0)
    t = np.arange(0.0, 9.0, 0.02)
    back = clock.RobotLog(t + 4.0, -advance(t), 0.0 * t)
    assert clock.synchronise(times, -advance(times), 1e-4, back, 1e-3).offset == pytest.approx(4.0, abs=1e-4)


def test_correlated_noise_widens_the_sd() -> None:
    times = np.arange(0.0, 8.0, 1.0 / 30.0)
    x = advance(times)
    white = clock.synchronise(times, x + np.random.default_rng(0).normal(0, 1e-4, len(times)), 1e-4, log(0.0), 1e-3)
    waves = clock.synchronise(times, x + 1.4e-4 * np.sin(4.0 * times), 1e-4, log(0.0), 1e-3)
    assert waves.sd > 2.0 * white.sd
    assert abs(waves.offset) < 4.0 * waves.sd


@pytest.mark.parametrize(
    ("x", "robot", "message"),
    [
        (lambda t: advance(t), log(0.0, speed=0.022), "correlation of 0.99"),
        (lambda t: -advance(t), log(0.0), "correlation of -?0"),
        (lambda t: 0.1 + 0.0 * t, log(0.0), "0.00 mm in the video"),
        (lambda t: advance(t), clock.RobotLog(np.arange(9.0), np.zeros(9), np.zeros(9)), "0.00 mm in the log"),
        (
            lambda t: advance(t),
            clock.RobotLog(np.array([0.0, 0.02]), np.array([0.0, 0.1]), np.zeros(2)),
            "log of 0.02 s",
        ),
    ],
)
def test_motions_that_differ(x, robot: clock.RobotLog, message: str) -> None:  # type: ignore[no-untyped-def]
    times = np.arange(0.0, 8.0, 1.0 / 30.0)
    with pytest.raises(SynchronisationError, match=message) as caught:
        clock.synchronise(times, x(times), 1e-4, robot, 1e-3, "robot.csv")
    assert str(caught.value).startswith("robot.csv: ")


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
        ("t,x,z\n0,1,2\n0,1,2\n", "row 2"),
        ("t,x,z\n0,1,2\n1,inf,2\n", "row 2"),
        ("", "header t,x,z"),
        ("t,x,z\n" + "0" * 300_000, "field limit"),
    ],
)
def test_bad_logs(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "robot.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInputError, match=message):
        clock.read_log(path)
