"""Synthetic recordings of the configured materials, and the tables of what was measured."""

from __future__ import annotations

import json
from collections import Counter
from contextlib import nullcontext
from math import sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.interpolate import CubicSpline

from second_generator import recording as chain
from stripfold import elastica
from stripfold.ask import critical
from stripfold.ask.critical import CriticalPoint
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import Material
from stripfold.film import eta_motion
from stripfold.follow import moving_gripper
from stripfold.synthetic import dynamics
from stripfold.synthetic.history import History
from stripfold.synthetic.scene import DynamicsMotion, Scene
from stripfold.synthetic.view import View
from studies import recordings, recordings_accuracy, recordings_common
from studies import recordings_design as design
from tasks import recordings as tasks_recordings

MATERIAL = {"name": "a", "eta_b": 3780.0, "eta_m": 1e-3}
UNIT = Material(3780.0).gravity_length


@pytest.mark.parametrize("eta_b", [820.0, 30200.0])
@pytest.mark.parametrize("height", [4.0, 8.0])
def test_all_that_is_measured_is_in_the_picture(eta_b: float, height: float):
    """Marker and loop, from the beginning of the film to its end; the height of the picture is used."""
    scene = recordings.scene_of(MATERIAL | {"eta_b": eta_b}, height, 0.002, 0.01, 20.0, 1)
    unit = Material(eta_b).gravity_length
    state = elastica.critical(height)
    x = (-10.0 + state.advance) * unit
    offset = scene.gripper.offset[1]
    top = height * unit - offset + 0.8 * scene.gripper.marker_size
    # The loop reaches as far back as the free part is long, less than four L* behind the gripper's way.
    corners = np.array([[x - 0.3 * unit, top], [x + 0.5 * unit, top], [x - 3.5 * unit, 0.0], [x + 0.5 * unit, 0.0]])
    pixels = View.of(scene.filming).in_plane(corners)
    width, tall = scene.filming.size
    assert np.all((pixels > 2.0) & (pixels < np.array([width, tall]) - 2.0))
    assert np.ptp(pixels[:, 1]) > 0.6 * tall
    assert scene.length == pytest.approx(20.0 * unit)


@pytest.mark.slow
def test_a_motion_from_dynamics_in_metres_and_seconds():
    """The same passage, run by hand in the solver's units."""
    scene = Scene(
        length=16.0 * UNIT,
        height=5.0 * UNIT,
        speed=0.005,
        generator="dynamics",
        motion={"friction_moment_star": 0.02, "before": 0.2 * UNIT, "after": 0.1, "refinement": 3.0},
    )
    found = dynamics.history(scene)
    assert isinstance(found, History)
    clock = sqrt(UNIT / 9.81)
    from stripfold.follow.static import StripModel
    from stripfold.solve.schemes import Damping

    strip = StripModel(16.0, Material(3780.0).relative_thickness)
    damping = Damping(2.0 * clock, 3e-3 / clock)
    by_hand = moving_gripper.run(strip, 5.0, 0.02, 0.005 * clock / UNIT, 0.2, 0.1 / clock, damping, 3.0)
    assert found.lambda_c == pytest.approx(by_hand.static_limit * UNIT)
    touch = by_hand.states[by_hand.touch]
    assert found.touch == pytest.approx(touch.t * clock)
    curve, gripper = found.at(np.array([touch.t * clock]))
    arc = np.linspace(0.0, 16.0 * UNIT, curve.shape[1])
    at = by_hand.model.s * UNIT
    for axis in range(2):
        fine = CubicSpline(arc, curve[0, :, axis])(at)
        np.testing.assert_allclose(fine, by_hand.model.mid_surface(touch.q)[:, axis] * UNIT, atol=3e-5)
    # Points at equal lengths of the strip: the nodes of the mesh crowd where it lifts off.
    steps = np.linalg.norm(np.diff(found.curve, axis=1), axis=2)
    assert np.ptp(steps) < 0.02 * steps.mean()
    np.testing.assert_allclose(gripper[0], [-8.0 * UNIT + touch.lam * UNIT, 5.0 * UNIT], atol=1e-6)
    assert np.all(np.diff(found.t) < 2.1e-3)
    onset = found.at(np.array([found.onset]))[1][0, 0] - scene.flat_end
    assert onset == pytest.approx(found.lambda_c, abs=1e-5)


@pytest.mark.parametrize(
    "motion", [{"frictoin": 0.1}, {"friction_moment_star": -1.0}, {"before": 0.0}, {"model": "beam"}]
)
def test_a_motion_outside_the_limits_is_refused(motion: dict[str, Any]):
    with pytest.raises(InvalidInputError, match=rf"^motion\.{next(iter(motion))} "):
        Scene(length=0.5, generator="dynamics", motion=motion)


def measured(eta_b: float, height: float, speed: float, event: float, snapped: bool = True) -> xr.Dataset:
    """What a table takes of a measured recording."""
    t = np.linspace(0.0, 2.0, 41)
    scalars = {
        "eta_b": eta_b,
        "gripper_height": height,
        "length": 0.6,
        "gripper_speed": speed,
        "lambda_event": event,
        "lambda_low": event - 1e-4,
        "lambda_high": event + 1e-4,
        "event_time": 1.0,
        "snapped": float(snapped),
    }
    data: dict[str, Any] = {name: ((), value) for name, value in scalars.items()}
    data |= {"x": ("t", 0.05 + speed * t), "z": ("t", np.full(41, height))}
    return xr.Dataset(data, {"t": t}, {"synthetic": 1, "flags": ""})


@pytest.fixture
def model(monkeypatch: pytest.MonkeyPatch) -> None:
    """lambda_c of the model is three times the height."""

    def find(scene: Any) -> CriticalPoint:
        result = object.__new__(CriticalPoint)
        object.__setattr__(result, "lambda_c", 3.0 * scene.height)
        return result

    monkeypatch.setattr(critical, "find", find)


def test_table(model: None):
    runs = [measured(3780.0, 0.1, 0.001, 0.31), measured(3780.0, 0.1, 0.002, 0.32), measured(3780.0, 0.15, 0.001, 0.5)]
    found = recordings.table(runs, ["a", "b", "c"], {"m": MATERIAL})
    np.testing.assert_allclose(found["lambda_model"], [0.3, 0.3, 0.45])
    np.testing.assert_allclose(found["lambda_event"], [0.31, 0.32, 0.5])
    np.testing.assert_allclose(found["track"][0, [0, -1]], [[0.309, 0.1], [0.311, 0.1]])
    for variable in found.variables.values():
        assert variable.attrs["units"]
        assert variable.attrs["long_name"]
    zero = found["lambda_zero"].values
    assert np.isnan(zero[2])
    assert zero[0] == zero[1] < 0.31
    # Between the extrapolations with either exponent.
    limits = [np.polyfit(np.array([0.001, 0.002]) ** p, [0.31, 0.32], 1)[1] for p in recordings.EXPONENTS]
    assert min(limits) < zero[0] < max(limits)


def test_no_snap_takes_no_part_in_the_extrapolation(model: None):
    runs = [measured(3780.0, 0.1, 0.001, 0.31), measured(3780.0, 0.1, 0.002, 0.32, snapped=False)]
    assert np.isnan(recordings.table(runs, ["a", "b"], {})["lambda_zero"].values).all()


class TestAccuracy:
    def test_cases_take_turns(self):
        generators = [design.case(n, 1, 0.25).scene.generator for n in range(8)]
        assert generators.count("dynamics") == 2
        assert {design.case(n, 1, 1.0).scene.motion.friction_moment_star for n in range(3)} == set(design.FRICTIONS)

    def test_a_case_that_cannot_be_measured_is_refused_with_its_reason(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ):
        def write(self: design.Case, folder: Path, calibrations: Path) -> None:
            folder.mkdir()

        monkeypatch.setattr(design.Case, "write", write)
        monkeypatch.setattr(design.Case, "write_calibration", lambda *_: None)
        data = recordings_accuracy.run(1, 1, 0.0)
        assert list(data["outcome"].values) == [recordings_accuracy.REFUSED]
        assert "recording.yaml" in data["message"].values[0]
        assert len(recordings_accuracy.error(data)) == 0
        for variable in data.variables.values():
            assert variable.attrs["units"]


def test_the_clocks_offset_and_eta_b_are_stored_with_their_truths() -> None:
    """A case of each generator; the chain's film file begins later than its motion, and the truth knows."""
    data = recordings_accuracy.run(2, 20181110, 0.25)
    off = data["clock_offset"] - data["clock_truth"]
    assert list(data["generator"].values) == ["shapes", "chain"]
    assert np.all(data["clock_sd"] > 0.0)
    assert np.all(np.abs(off) < 3.0 * data["clock_sd"])
    assert np.abs(data["seconds_off"]).max() < 0.1
    known, fitted = (data[[kind + name for name in recordings_accuracy.ETA]] for kind in ("", "fitted_"))
    assert np.isnan([known.isel(case=0).to_array(), fitted.isel(case=0).to_array()]).all()
    # What is described, wrongly, takes no part; the friction makes the interval narrower.
    eta, low, high = known.isel(case=1).to_array().values
    assert low < eta < high
    assert eta == pytest.approx(1.0, abs=0.03)
    assert high - low < 0.5 * np.ptp(fitted.isel(case=1).to_array().values)


def test_a_damaged_truth_is_refused(tmp_path: Path) -> None:
    (tmp_path / "truth.nc").write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(InvalidInputError, match=r"truth\.nc.*delete it"):
        recordings_common.event_of(tmp_path)


@pytest.mark.parametrize("generator", ["own", "chain"])
def test_the_peak_of_the_true_motion_may_come_after_the_touch(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, generator: str
) -> None:
    """The touch brakes a part of the strip, the rest goes on; what moves after the strip has rested does not count."""
    t = np.arange(0.0, 6.0, 1e-3)
    u = np.interp(t, [0.0, 3.0, 3.4, 3.401, 3.6, 3.7, 4.5, 4.6, 4.7], [0.1, 0.1, 0.9, 0.7, 1.1, 0.2, 0.2, 3.0, 0.1])
    raised = np.stack([np.cumsum(u) * 1e-3, np.full_like(t, 0.05)], axis=1)
    lying = np.zeros((len(t), 2, 2))
    onset, touch = 3.25, 3.4
    if generator == "own":
        curve = np.concatenate([raised[:, None], lying], axis=1)
        truth = xr.Dataset({"advance": ("time", 0.1 * t), "curve": (("time", "point", "axis"), curve), "time": t})
        monkeypatch.setattr(recordings_common.store, "read", lambda *_: truth)
        (tmp_path / "truth.json").write_text(json.dumps({"events": {"touch": {"t": touch}}}), encoding="utf-8")
        assert recordings_common.event_of(tmp_path) == pytest.approx((onset, 0.1 * onset), abs=2e-3)
        return
    nodes = np.concatenate([raised[:, None], lying], axis=1) - np.array([0.0, chain.TARGET[1]])
    assert chain.truth(chain.Motion(t, nodes[:, 0], nodes, touch), 0.05)["onset"] == pytest.approx(onset, abs=2e-3)


def test_design() -> None:
    cases = [design.case(number, 0) for number in range(2 * design.BLOCK)]
    assert design.case(7, 0).scene == cases[7].scene
    assert design.case(7, seed=1).scene != cases[7].scene
    assert len({case.scene.seed for case in cases}) == len(cases)
    for name, values in design.FACTORS.items():
        counts = Counter(case.factors[name] for case in cases)
        for value, count in Counter(values).items():
            assert abs(counts[value] - 2 * design.BLOCK * count / len(values)) <= 2 * len(values), name
    other = design.case(3, 0, dynamics=1.0).scene
    assert other.motion == DynamicsMotion(friction_moment_star=0.0, before=0.01, after=0.5)
    assert other.filming == cases[3].scene.filming


def test_frames_are_the_first_that_at_the_onset_and_the_last(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    film = [SimpleNamespace(time=0.1 * i, image=np.full((2, 3), i, dtype=np.uint8)) for i in range(20)]
    monkeypatch.setattr("stripfold.film.video.read", lambda path: nullcontext(film))
    measured = xr.Dataset({"event_time": 1.22}, attrs={"recording": "a"})
    found = tasks_recordings.frames(tmp_path, measured)
    assert found["frame"].values[:, 1, 2].tolist() == [0, 12, 19]
    np.testing.assert_allclose(found["instant"], [-1.22, -0.02, 0.68])


def test_slow_strips_whose_motion_gives_eta_b_are_filmed_early_enough():
    cases = [design.case(number, 7, 1.0) for number in range(2 * design.BLOCK)]
    slow = [case for case in cases if not np.isnan(case.moment)]
    assert {case.scene.speed for case in slow} == {0.002, 0.004}
    for case in slow:
        motion, unit = case.scene.motion, case.scene.gravity_length
        assert motion.before > (eta_motion.MARGIN + 0.3) * unit  # type: ignore[union-attr]
        assert case.moment == motion.friction_moment_star  # type: ignore[union-attr]
    assert np.isnan(design.case(0, 7, 0.0).moment)
