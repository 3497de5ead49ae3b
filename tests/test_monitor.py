"""Readings of a monitor beside the stability map that it tabulates."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import stripfold as sf
from stripfold.base.arrays import Array

STRIP = sf.Strip(length=0.36, eta_b=3780.0)
UNIT = STRIP.gravity_length
Places = tuple[Array, Array, sf.StabilityMap]


@pytest.fixture(scope="module")
def monitor() -> sf.Monitor:
    return sf.Monitor(STRIP)


@pytest.fixture(scope="module")
def places() -> Places:
    """Random places at which the strip hangs, and the map."""
    random, found = np.random.default_rng(20261128), STRIP.map()
    x, z = random.uniform(-0.18, 0.18, 5000), random.uniform(0.0, 0.3, 5000)
    hangs = found.hangs(x, z)
    return x[hangs], z[hangs], found


def test_margin_is_the_maps(monitor: sf.Monitor, places: Places) -> None:
    x, z, found = places
    reading = monitor(x, z)
    off = np.abs(reading.margin - found.margin(x, z)) / UNIT
    assert off.max() < 1e-3


def test_margin_is_the_distance_from_the_nearest_part_of_the_boundary() -> None:
    """Also where two parts of it are about as near, as at the first place: beside a fine polygon."""
    strip = sf.Strip(length=0.6, eta_b=3780.0)
    random, found = np.random.default_rng(1), strip.map()
    x = np.append(-0.249119401, random.uniform(-0.3, 0.3, 1000))
    z = np.append(0.193288582, random.uniform(0.0, 0.45, 1000))
    snap = found.in_star.snap
    heights = np.linspace(snap.z[0], snap.z[-1], 20_000)
    line = np.column_stack([snap.at(heights), heights])
    unit, hangs = strip.gravity_length, found.hangs(x, z)
    places = np.column_stack([x + 0.3, z])[hangs] / unit
    away = [np.hypot(*(line - place).T).min() for place in places]
    assert hangs[0]
    np.testing.assert_allclose(np.abs(found.margin(x, z)[hangs]) / unit, away, atol=5e-4)


def test_energy_is_the_maps_where_the_strip_can_fall(monitor: sf.Monitor, places: Places) -> None:
    """Within 0.3 L* before the boundary: where the sag cannot lie there is no fall."""
    *_, found = places
    random = np.random.default_rng(20261129)
    boundary = found.snap_boundary[random.integers(1, len(found.snap_boundary) - 1, 2000)]
    x, z = boundary[:, 0] - UNIT * random.uniform(1e-3, 0.3, 2000), boundary[:, 1]
    reading, barrier = monitor(x, z), found.barrier(x, z)
    falls = np.isfinite(barrier)
    assert 200 < falls.sum() < 1800
    np.testing.assert_allclose(reading.energy[falls], barrier[falls], rtol=1e-3, atol=1e-4 * barrier[falls].max())
    assert np.isinf(reading.energy[~falls]).mean() > 0.99


def test_the_nearest_place_is_on_the_boundary(monitor: sf.Monitor, places: Places) -> None:
    x, z, found = places
    reading = monitor(x, z)
    near = reading.margin < UNIT
    to = np.column_stack([reading.x, reading.z])[near]
    apart = np.linalg.norm(to[:, None] - found.snap_boundary, axis=2).min(axis=1)
    spacing = np.linalg.norm(np.diff(found.snap_boundary, axis=0), axis=1).max()
    assert np.quantile(apart, 0.99) < spacing
    away = np.hypot(to[:, 0] - x[near], to[:, 1] - z[near])
    assert np.median(away / reading.margin[near]) == pytest.approx(1.0, abs=1e-3)


def test_behind_the_boundary_and_below_the_touch_limit(monitor: sf.Monitor, places: Places) -> None:
    *_, found = places
    x, z = found.snap_boundary[20]
    behind, before = monitor(x + 0.1 * UNIT, z), monitor(x - 0.01 * UNIT, z)
    assert behind.margin < 0.0 == behind.energy
    assert 0.0 < before.margin < 0.011 * UNIT
    assert 0.0 < before.energy < np.inf
    low = monitor(0.0, 0.5 * found.touch_limit)
    assert low.margin > 0.4 * found.touch_limit
    assert low.energy == np.inf


def test_numbers_arrays_and_places_far_outside(monitor: sf.Monitor) -> None:
    x, z = np.array([[-0.1, 0.0], [0.1, 5.0]]), np.array([[0.01, 0.1], [0.2, -3.0]])
    many = monitor(x, z)
    for at in np.ndindex(x.shape):
        one = monitor(float(x[at]), float(z[at]))
        assert [float(value[at]) for value in many] == [float(value) for value in one]
    assert np.isfinite(many.margin).all()


@pytest.fixture(scope="module")
def hanging() -> tuple[Array, Array, Array]:
    """x and z of the gripper and a point of the rod's sag, on an R-path until an L* before the snap, m."""
    strip = sf.Strip(length=0.45, eta_b=3780.0)
    found = strip.assess(sf.paths.r_path(strip), model="rod").to_dataset()
    curves = np.stack([found.x.values, found.z.values], axis=-1)
    highest = int(np.argmax(curves[:, 0, 1]))
    curves = curves[highest : highest + 8 : 2]
    points = np.array([curve[np.argmin(np.abs(curve[:100, 1] - 0.55 * curve[0, 1]))] for curve in curves])
    return curves[:, 0, 0], curves[:, 0, 1], points


def test_points_of_the_sag_say_which_eta_b_fits(hanging: tuple[Array, Array, Array]) -> None:
    """With noise of half a millimetre; the monitor's strip is too soft or too stiff by a third."""
    x, z, points = hanging
    random, inside = np.random.default_rng(20262811), []
    for eta_b in (2800.0, 5000.0):
        monitor = sf.Monitor(sf.Strip(length=0.45, eta_b=eta_b))
        exact = monitor.update(x, z, points, accuracy=1e-4)
        assert exact.eta_b == pytest.approx(3780.0, rel=0.01)
        light = sf.Strip(length=0.45, eta_b=3.0 * eta_b, gravity=9.81 / 3.0)  # of the same L*
        assert sf.Monitor(light).update(x, z, points, accuracy=1e-4).eta_b == pytest.approx(3.0 * exact.eta_b)
        for _ in range(3):
            fit = monitor.update(x, z, points + random.normal(0.0, 5e-4, points.shape), accuracy=5e-4)
            inside.append(fit.low <= 3780.0 <= fit.high)
    assert sum(inside) >= 5
    one = monitor.update(x[-1], z[-1], points[-1])
    assert one.low < 3780.0 < one.high
    assert one.high - one.low > 2.0 * (fit.high - fit.low)


def test_points_that_no_such_strip_has(hanging: tuple[Array, Array, Array]) -> None:
    x, z, points = hanging
    monitor = sf.Monitor(sf.Strip(length=0.45, eta_b=3780.0))
    with pytest.raises(sf.InvalidInputError, match=r"point = .3 of them. .* for each of 4 places"):
        monitor.update(x, z, points[:-1])
    with pytest.raises(sf.InvalidInputError, match=r"point .* within a factor of 4 of 3780 .* mm off"):
        monitor.update(x[:2], z[:2], points[:2] - np.array([0.03, 0.0]))
    with pytest.raises(sf.InvalidInputError, match=r"x = .* it snaps"):
        monitor.update(x[-1] + 0.05, z[-1], points[-1] + np.array([0.05, 0.0]))
    with pytest.raises(sf.InvalidInputError, match="accuracy"):
        monitor.update(x, z, points, accuracy=0.0)


def test_what_cannot_be() -> None:
    with pytest.raises(sf.InvalidInputError, match="length"):
        sf.Monitor(sf.Strip(length=0.1, eta_b=3780.0))
    with pytest.raises(sf.InvalidInputError, match="strip"):
        sf.Monitor(0.5)  # type: ignore[arg-type]


def test_lines_are_answered_while_they_come(monitor: sf.Monitor) -> None:
    """Each before the next one is sent."""
    command = [sys.executable, "-m", "stripfold", "monitor", "--length", str(STRIP.length), "--eta-b", str(STRIP.eta_b)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline() == "x,z,margin,x_near,z_near,energy\n"
        for sent, x, z in (("-0.05,0.09", -0.05, 0.09), ("0.01 0.1", 0.01, 0.1)):
            process.stdin.write(f"{sent}\n")
            process.stdin.flush()
            told = [float(value) for value in process.stdout.readline().split(",")]
            assert told == pytest.approx([x, z, *map(float, monitor(x, z))], rel=1e-5)
        process.stdin.write("0.01 up\n")
        process.stdin.close()
        assert "line 3 = '0.01 up'" in process.stderr.read()
        assert process.wait() == 2
