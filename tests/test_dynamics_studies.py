"""The studies of motion in time: schemes, frequencies, lag; and the numbers quoted from them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ai_zeros

from stripfold.base.errors import SolveError
from stripfold.follow.static import StripModel, XRun, solve_height
from stripfold.solve import dynamics
from stripfold.solve.schemes import EnergyMomentum
from studies import lag, modes, schemes
from studies.integrators import GeneralisedAlpha


def complete(data: xr.Dataset) -> None:
    for name, variable in data.variables.items():
        assert variable.attrs["units"], name
        assert variable.attrs["long_name"], name


@pytest.fixture(scope="module")
def compared() -> Iterator[xr.Dataset]:
    """Two of the schemes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            schemes, "SCHEMES", {name: schemes.SCHEMES[name] for name in (schemes.DEFAULT, schemes.CONSERVING)}
        )
        yield schemes.run(12.0, 0.0594, 5.0, 2.0, [0.1, 0.05, 0.025], 4.0, [0.4, 0.2], 4.0)


def test_the_schemes_are_of_second_order(compared: xr.Dataset) -> None:
    assert np.abs(compared["oscillator_order"].values - 2.0).max() < 0.1
    assert np.abs(compared["swing_order"].values - 2.0).max() < 0.2
    assert compared["oscillator_error"].values[:, -1].max() < 3e-3
    assert compared["swing_error"].values[:, -1].max() < 2e-4


def test_the_conserving_scheme_conserves(compared: xr.Dataset) -> None:
    chosen, conserving = (compared.sel(scheme=name) for name in (schemes.DEFAULT, schemes.CONSERVING))
    assert np.abs(conserving["swing_energy"].values).max() < 1e-6
    assert np.all(chosen["swing_energy"].values < 0.0)
    assert 0.0 < abs(float(conserving["drift"])) < 1e-6  # zero it would not be measured
    assert (compared["touch_iterations"] > 1.2 * compared["touch_steps"]).all()
    assert float(conserving["numerical_share"]) == 0.0
    assert 0.0 < float(chosen["numerical_share"]) < 0.05
    for one in (chosen, conserving):
        assert float(one["lost_share"]) == pytest.approx(float(one["numerical_share"] + one["contact_share"]), abs=1e-6)
    complete(compared)


def test_failures_are_reported(compared: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    assert not compared["failure"].sel(scheme=schemes.DEFAULT).item()
    monkeypatch.setattr(schemes, "SCHEMES", {schemes.CONSERVING: EnergyMomentum(0.0), "bad": GeneralisedAlpha(0.8)})

    class Explodes:
        def step(self, *_: object) -> None:
            raise SolveError("planted")

    schemes.SCHEMES["bad"] = Explodes()
    monkeypatch.setattr(schemes, "oscillator_error", lambda *_: 1.0)
    data = schemes.run(12.0, 0.0594, 5.0, 2.0, [0.2], 0.2, [0.4], 0.4)
    assert "planted" in data["failure"].sel(scheme="bad").item()
    assert np.isnan(data.sel(scheme="bad")[["swing_error", "drift", "touch_time"]].to_array()).all()


def test_beam_without_gravity_and_a_long_hanging_one() -> None:
    """Against ``1 + cos x cosh x = 0``, and against a chain's ``J_0(2 omega sqrt(l)) = 0`` stiffened little."""
    roots = [brentq(lambda x: np.cos(x) * np.cosh(x) + 1.0, a, a + 1.0) for a in (1.5, 4.2, 7.4)]
    assert roots == pytest.approx([1.8751, 4.6941, 7.8548], abs=1e-4)
    length = 3.0
    assert modes.beam_frequencies(length, 0.0, 3) == pytest.approx((np.array(roots) / length) ** 2, rel=1e-9)
    # With much gravity the beam is a chain, but for a boundary layer of length (g l)^(-1/2).
    chain = 0.5 * 2.404826 * np.sqrt(1e4 / length)
    assert modes.beam_frequencies(length, 1e4, 1)[0] == pytest.approx(
        chain * (1.0 + 0.5e-2 / np.sqrt(length)), rel=6e-3
    )


def test_frequencies_of_the_motion_are_the_beams() -> None:
    data = modes.run(3.0, 0.02, 16, 2, 3, [25, 50])
    complete(data)
    assert data["solid_error"].values.max() < 5e-4
    error = data["motion_error"].values
    print(error)
    assert error[..., 1].max() < 2.5e-3
    # What is left falls with the square of the step.
    assert np.all((error[..., 0] / error[..., 1] > 3.0) & (error[..., 0] / error[..., 1] < 5.0))


def test_crossings_give_the_frequency() -> None:
    t = np.arange(0.0, 40.0, 0.05)
    assert modes.crossing_frequency(t, np.sin(1.7 * t + 0.2)) == pytest.approx(1.7, rel=1e-5)


def test_constants_of_the_passage() -> None:
    assert pytest.approx(-ai_zeros(1)[1][0], abs=1e-6) == lag.OVERDAMPED_PASSAGE
    start = -80.0
    y = [-np.sqrt(-start), 0.5 / np.sqrt(-start)]

    def zero(_: float, state: np.ndarray) -> float:
        return float(state[0])

    motion = solve_ivp(lambda t, y: [y[1], y[0] ** 2 + t], (start, 2.0), y, rtol=1e-10, atol=1e-12, events=zero)
    assert motion.t_events[0][0] == pytest.approx(lag.INERTIAL_PASSAGE, abs=2e-4)


@pytest.fixture(scope="module")
def run() -> XRun:
    return solve_height(StripModel(12.0, 0.0594), 5.0)


@pytest.fixture(scope="module")
def fold(run: XRun) -> lag.Fold:
    return lag.Fold.of(run, 0.25)


def test_normal_form_predicts_the_eigenvalue(fold: lag.Fold, run: XRun) -> None:
    """Another way to b c: near lambda_c the smallest eigenvalue is ``2 sqrt(b c (lambda_c - lambda))``.

    From the branch whose contact coordinates are unknowns: contact at nodes makes the eigenvalue jump.
    """
    assert fold.lam == pytest.approx(run.lam, abs=2e-4)
    near = [at.point for at in run.points if 0.005 < run.lam - at.point.lam < 0.5 and not at.point.negatives]
    distance = np.sqrt([run.lam - point.lam for point in near])
    rate = [0.5 * (point.eigenvalues[0] - run.last.point.eigenvalues[0]) for point in near] / distance
    at_fold = np.polyfit(distance, rate, len(near) - 1)[-1]
    print(len(near), fold.push * fold.curvature / at_fold**2)
    assert len(near) >= 2
    assert fold.push * fold.curvature == pytest.approx(at_fold**2, rel=0.1)


@pytest.mark.parametrize(("air", "speed", "share"), [(0.0, 4e-3, 0.9), (1.0, 2e-4, 0.97)])
def test_lag_is_the_normal_forms(fold: lag.Fold, air: float, speed: float, share: float) -> None:
    snap, touch, steps = lag.passage(fold, speed, air)
    delay = snap - fold.lam
    print(delay / fold.expected(speed, air))
    assert delay / fold.expected(speed, air) == pytest.approx(share, abs=0.08)
    assert fold.lam < snap < touch
    assert steps > 20


def test_exponent_and_limit_of_a_known_law() -> None:
    v = np.array([1e-4, 3e-4, 1e-3, 3e-3, 1e-2])
    noise = np.array([1.01, 0.99, 1.02, 0.98, 1.0])
    slope, half_width = lag.exponent(v, 3.0 * v**0.8)
    assert (slope, half_width) == (pytest.approx(0.8), pytest.approx(0.0, abs=1e-6))
    slope, half_width = lag.exponent(v, 3.0 * v**0.8 * noise)
    # By hand: the residual's standard deviation over the spread of log v, times Student's 3.182 (3 degrees of freedom).
    x, y = np.log(v) - np.log(v).mean(), np.log(3.0 * v**0.8 * noise)
    residual = y - y.mean() - slope * x
    assert half_width == pytest.approx(3.18245 * np.sqrt(residual @ residual / 3.0 / (x @ x)), rel=1e-4)
    assert lag.limit(v, 7.0 + 2.0 * v**0.8, 0.8) == pytest.approx(7.0, abs=1e-12)


def test_a_fall_without_end_has_failed(run: XRun, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schemes, "LATEST", 0.5)
    with pytest.raises(SolveError, match="no touch"):
        schemes.fall_to_touch(run, 1.0, EnergyMomentum())


def test_a_failed_step_leaves_no_order() -> None:
    assert schemes.observed_order([0.2, 0.1], np.array([4e-3, 1e-3])) == pytest.approx(2.0)
    assert np.isnan(schemes.observed_order([0.2, 0.1], np.array([np.nan, 1e-3])))
    assert np.isnan(schemes.observed_order([0.2], np.array([1e-3])))


def test_lag_needs_a_fold_and_a_branch(fold: lag.Fold) -> None:
    with pytest.raises(SolveError, match="too short"):
        lag.passage(fold, 10.0, 0.0)
    with pytest.raises(SolveError, match="no critical point"):
        lag.Fold.of(solve_height(StripModel(12.0, 0.05), 1.2, 2.0), 2.0)


def test_a_strip_that_does_not_fall_ends(fold: lag.Fold, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lag, "MOST_STEPS", 3)
    with pytest.raises(SolveError, match="does not come down"):
        lag.passage(fold, 1e-3, 0.0)


def test_lag_dataset_is_complete(monkeypatch: pytest.MonkeyPatch) -> None:
    def passage(fold: lag.Fold, speed: float, air: float) -> tuple[float, float, int]:
        late = fold.lam + fold.expected(speed, air)
        return late, late + 0.1, 5

    monkeypatch.setattr(lag, "passage", passage)
    data = lag.run(12.0, 0.0594, 5.0, 2.0, [1e-4, 1e-3, 1e-2], 1.0, [1e-5, 1e-4, 1e-3])
    complete(data)
    assert float(data["exponent"]) == pytest.approx(0.8)
    assert float(data["exponent_damped"]) == pytest.approx(2.0 / 3.0)
    assert float(data["limit"]) == pytest.approx(float(data["lambda_c"]))
    np.testing.assert_allclose(data["lag_damped"], data["expected_damped"], rtol=1e-9)
    assert dynamics.TimeOptions().largest < lag.STEPS.largest
