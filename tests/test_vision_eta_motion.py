"""eta_b from the motion of a strip: shapes against the finite-element rod, the fit against made-up tracks."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import MeasurementError
from stripfold.base.material import GRAVITY, Material
from stripfold.elastica import with_friction
from stripfold.elastica.branch import state_at_advance
from stripfold.film import eta_motion
from stripfold.film.camera import Camera
from stripfold.film.eta_motion import MotionEtaB
from stripfold.film.mapping import Mapping
from stripfold.film.recording import Entries, Recording
from stripfold.follow.statics import StripModel
from stripfold.follow.time import static_limit

ETA_B, LENGTH, FLAT_END = 3780.0, 0.45, -0.2
UNIT = Material(ETA_B).gravity_length
HEIGHT = 3.4 * UNIT
WIDTH = 0.03


@pytest.mark.parametrize("share", [0.5, 0.97])
def test_without_friction_shapes_are_those_of_the_elastica(share: float):
    """Between the heights of the stored branches."""
    z = 3.3
    advance = share * elastica.critical(z).advance
    state = state_at_advance(z, advance)
    distance = np.linspace(0.0, state.length, 50)
    at = state.at(state.length - distance)
    found = with_friction.branch(z).shapes(0.0, np.array([advance]), distance)[0]
    np.testing.assert_allclose(found, np.column_stack([state.length - at.x, at.z]), atol=1e-3)


def test_with_friction_shapes_are_those_of_the_rod():
    """Finite elements with the hysteresis itself, thin and hardly extensible: the friction shifts it by 0.19 L*."""
    z, moment, length = 4.0, 0.04, 24.0
    steps, limit = static_limit(StripModel(length, 0.005, kind="rod"), z, moment, 1.5)
    step = steps[-10]
    curve = step.at.model.mid_surface(step.at.point.q) + np.array([0.5 * length, 0.0])
    found, without = (with_friction.branch(z).shapes(m, curve[:1, 0], step.at.model.s)[0] for m in (moment, 0.0))
    np.testing.assert_allclose(found, curve, atol=8e-3)
    assert np.abs(without - curve).max() > 0.15
    assert limit == pytest.approx(elastica.critical(z).advance + elastica.friction_delay(z) * moment, abs=0.03)


def pinhole(depth: float, places: Array) -> Array:
    """Pixels of places, shape (n, 2), m, this far behind the folding plane: the camera looks 5 degrees down."""
    focal, tilt = 900.0, np.radians(5.0)
    x, z = places[:, 0] - 0.02, places[:, 1] - 0.15
    ahead = (0.8 + depth) * np.cos(tilt) - z * np.sin(tilt)
    up = z * np.cos(tilt) + (0.8 + depth) * np.sin(tilt)
    return np.column_stack([240.0 + focal * x / ahead, 180.0 - focal * up / ahead])


def mapping() -> Mapping:
    """Of that camera: the homography of four corners, no lens distortion."""
    corners = np.array([[-0.1, 0.0], [0.2, 0.0], [0.2, 0.15], [-0.1, 0.15]])
    matrix = np.array([[900.0, 0.0, 240.0], [0.0, 900.0, 180.0], [0.0, 0.0, 1.0]])
    rows = []
    for (u, v), (x, z) in zip(pinhole(0.0, corners), corners, strict=True):
        rows += [[u, v, 1, 0, 0, 0, -x * u, -x * v, -x], [0, 0, 0, u, v, 1, -z * u, -z * v, -z]]
    return Mapping(Camera(matrix, np.zeros(5), (480, 360)), np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3))


def seen(depth: float, count: int = 40, noise: float = 1e-4) -> SimpleNamespace:
    """Tracks of a strip without friction up to 0.35 L* before its snap, seen this far behind the folding plane."""
    last = elastica.critical(3.4).advance - 0.35
    advance = np.linspace(last - 1.0, last, count) * UNIT
    stations = np.linspace(0.0, 0.97 * LENGTH, 40)
    curves = []
    for a in advance:
        state = state_at_advance(3.4, a / UNIT)
        lifted = stations < state.length * UNIT
        at = state.at(state.length - stations[lifted] / UNIT)
        curve = np.column_stack([stations, np.zeros(40)])
        curve[lifted] = UNIT * np.column_stack([state.length - at.x, at.z])
        curves.append(mapping().to_robot(pinhole(depth, curve + np.array([FLAT_END, 0.0]))))
    t = 0.5 + np.linspace(0.0, 10.0, count)
    return SimpleNamespace(
        seen=np.ones(count, bool),
        grip_time=t,
        strip_time=t,
        gripped_end=np.column_stack([FLAT_END + advance, np.full(count, HEIGHT)]),
        points=np.array(curves) + np.random.default_rng(0).normal(0.0, noise, (count, 40, 2)),
        stations=stations,
    )


def recording(**strip: Any) -> Recording:
    board = {"type": "chessboard", "columns": 9, "rows": 6, "square": 0.025}
    marker = {"dictionary": "4x4_50", "id": 7, "size": 0.024, "offset": [0.0, -0.03]}
    entries = {
        "title": "made up",
        "strip": {"length": LENGTH, "eta_b": 2500.0, "width": WIDTH, **strip},
        "gripper": {"height": HEIGHT, "speed": 0.003, "flat_end": FLAT_END, "marker": marker},
        "video": "video.mkv",
        "camera": {"images": "camera", "board": board},
        "plane": {"image": "plane.png", "board": board},
        "robot": {"grid": "robot.csv"},
    }
    return Recording(Path(), Entries.of(entries))


def measured(
    tracks: Any, off: float = 0.0, by_hand: tuple[float, float] = (0.0, 0.0), **strip: Any
) -> MotionEtaB | MeasurementError:
    """With a flat end that is ``off`` in the description; ``by_hand``: standard deviations of it and of the offset."""
    asked, event = recording(**strip), elastica.critical(3.4).advance * UNIT - off
    gripper = asked.entries.gripper.model_copy(update={"flat_end": FLAT_END + off})
    asked = Recording(asked.folder, asked.entries.model_copy(update={"gripper": gripper}))
    return eta_motion.measure(asked, mapping(), tracks, event, event, True, (*by_hand, 1e-4))


def test_the_cameras_place_follows_from_its_calibration():
    np.testing.assert_allclose(eta_motion.camera_place(mapping()), [0.02, 0.15, 0.8], atol=1e-6)


@pytest.mark.parametrize("depth", [0.0, 0.5 * WIDTH, WIDTH])
def test_eta_b_and_depth_from_made_up_tracks(depth: float):
    """The described eta_b, which is two thirds of the true one, has no part in it."""
    known = measured(seen(depth), friction_moment=0.0, rho_a=0.2)
    assert isinstance(known, MotionEtaB)
    assert known.eta_b == pytest.approx(ETA_B, rel=4e-3)
    assert known.depth == pytest.approx(depth, abs=1e-3)
    assert known.low < ETA_B < known.high
    assert known.friction < 1e-3


@pytest.mark.parametrize("off", [-0.015, 0.015])
def test_a_wrong_flat_end_is_seen_in_the_shapes(off: float):
    tracks = seen(0.5 * WIDTH)
    assert not eta_motion.doubted(measured(tracks))
    wrong = measured(tracks, off)
    assert "are gripper.flat_end" in eta_motion.doubted(wrong)
    assert eta_motion.numbers(wrong)["misfit"] > 0.012 * UNIT


def test_the_interval_includes_an_error_of_the_flat_end():
    tracks = seen(0.5 * WIDTH)
    exact, by_hand = (measured(tracks, 0.002, sd, friction_moment=0.0, rho_a=0.2) for sd in ((0.0, 0.0), (1e-3, 1e-3)))
    assert exact.low > ETA_B
    assert by_hand.low < ETA_B < by_hand.high
    assert by_hand.eta_b == exact.eta_b


def test_friction_is_fitted_unless_it_is_described():
    """Described friction lowers the eta_b that shapes without any have, by more than twice its M_0."""
    tracks = seen(0.5 * WIDTH)
    fitted = measured(tracks)
    assert isinstance(fitted, MotionEtaB)
    assert not fitted.known
    assert fitted.friction < 5e-3
    assert fitted.low < ETA_B < fitted.high
    wrong = measured(tracks, friction_moment=0.02 * 0.2 * GRAVITY * UNIT**2, rho_a=0.2)
    assert isinstance(wrong, MotionEtaB)
    assert wrong.friction == pytest.approx(0.02, rel=0.1)
    assert 1.04 < wrong.eta_b / ETA_B < 1.08
    assert wrong.high - wrong.low < 0.6 * (fitted.high - fitted.low)


def test_another_described_eta_b_is_contradicted():
    found = measured(seen(0.0), friction_moment=0.0, rho_a=0.2)
    assert isinstance(found, MotionEtaB)
    strip = recording().entries.strip
    assert "described is 2500" in found.contradicts(strip)
    assert not found.contradicts(strip.model_copy(update={"eta_b_interval": (2400.0, 3770.0)}))
    assert not found.contradicts(strip.model_copy(update={"eta_b": ETA_B}))


def test_no_number_where_there_is_none():
    tracks = seen(0.0)
    few = SimpleNamespace(**{**vars(tracks), "seen": np.arange(40) < 4})
    assert "3 frames" in str(measured(few))
    bent = SimpleNamespace(**{**vars(tracks), "points": tracks.points * [1.0, 1.4]})
    other = measured(bent, friction_moment=0.0, rho_a=0.2)
    assert isinstance(other, MeasurementError)
    assert "off those of a strip with one eta_b" in str(other)
    numbers = eta_motion.numbers(other)
    assert numbers.pop("misfit") > 0.03 * UNIT
    assert all(np.isnan(value) for value in numbers.values())


def test_the_result_of_a_measurement_has_it():
    found = MotionEtaB(ETA_B, 3700.0, 3850.0, 0.01, True, 0.01, 1e-4, 40)
    assert eta_motion.numbers(found) == {
        "eta_b_motion": ETA_B,
        "eta_b_motion_low": 3700.0,
        "eta_b_motion_high": 3850.0,
        "friction_motion": 0.01,
        "misfit": 1e-4,
    }


@pytest.mark.parametrize("z", [1.8, 2.9, 4.1, 11.0, 52.0])
def test_the_start_of_the_fit_is_the_strip_that_snaps_there(z: float) -> None:
    advance = 0.1 / z * elastica.critical(z).advance
    assert eta_motion._unit_at_snap(0.1, advance) == pytest.approx(0.1 / z, rel=1e-3)
