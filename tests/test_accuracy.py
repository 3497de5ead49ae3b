"""Accuracy against time: the choice of a model, the late start of the solid, estimates, times."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from plots import models, work_precision
from stripfold import elastica
from stripfold.ask import critical, select_model
from stripfold.ask.inputs import Scene
from stripfold.ask.model_error import ROD, exact, model_error, one_across, solid_error
from stripfold.ask.prediction import (
    ElasticaPrediction,
    end_of_advance,
    from_near_the_end,
    snap,
    without_horizontal_force,
)
from stripfold.files import store
from stripfold.follow import static
from stripfold.follow.static import End, StripModel
from stripfold.solve.linear import Band
from studies import accuracy, estimates, profiling
from studies.accuracy import Strategy, scene_of
from studies.models import thickness_effect

LENGTH, THICKNESS, HEIGHT = 12.0, 0.0594, 3.0


@pytest.fixture(scope="module")
def prediction() -> ElasticaPrediction:
    return ElasticaPrediction.at(HEIGHT)


class TestNearTheEnd:
    def test_same_end_as_the_whole_branch(self, prediction: ElasticaPrediction):
        strip = StripModel(LENGTH, THICKNESS)
        late = from_near_the_end(strip, prediction, 2.0)
        whole = static.solve_height(strip, HEIGHT, 2.0)
        assert late.end is whole.end is End.SNAP
        # The elements are planned anew on the way: the meshes are not the same.
        assert late.lam == pytest.approx(whole.lam, abs=2e-4)
        assert without_horizontal_force(strip, prediction, 2.0) == pytest.approx(whole.lambda_0, abs=1e-3)
        assert len(late.points) < len(whole.points)
        assert 0.0 < late.lam - late.points[0].point.lam < 0.2

    def test_touch(self):
        prediction = ElasticaPrediction.at(1.2)
        late = from_near_the_end(StripModel(LENGTH, 0.02), prediction, 2.0)
        assert late.end is End.TOUCH
        assert late.lam == pytest.approx(prediction.last.advance, abs=0.02)


class TestSelectModel:
    @pytest.mark.parametrize("thickness", [0.06, 0.1, 0.2])
    def test_bounds_hold_in_the_study_of_the_rod(self, thickness: float):
        with xr.open_dataset("results/studies/rod.nc") as stored:
            one = stored.sel(thickness=thickness, method="nearest")
            h = float(one["thickness"])
            for name, model in (("model_error", "rod"), ("thickness_effect", "elastica")):
                bounds = [model_error(model, h, 0.0, z, 20.0) for z in one["gripper_height"].values]
                share = np.abs(one[name].values) / bounds
                assert 0.3 < share.max() < 1.0

    @pytest.mark.parametrize("height", [0.8, HEIGHT, 9.0])
    @pytest.mark.parametrize(("thickness", "nu"), [(0.2, 0.0), (0.15, 0.3), (0.1, 0.45), (0.03, 0.49)])
    def test_bounds_hold_at_any_poisson_ratio(self, thickness: float, nu: float, height: float):
        """Against one element across the solid and, for that one's own bound, two."""
        at = ElasticaPrediction.at(height)
        length = at.last.length + 5.0

        def lam(**strip: Any) -> float:
            return end_of_advance(StripModel(length, thickness, **strip), at, 0.6).lam

        solid, exact = lam(nu=nu), lam(nu=nu, across=2)
        assert abs(solid / exact - 1.0) < solid_error(thickness, nu, height)
        assert abs(lam(kind="rod") / solid - 1.0) < model_error("rod", thickness, nu, height, length)
        assert abs(at.last.advance / solid - 1.0) < model_error("elastica", thickness, nu, height, length)

    @pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
    @pytest.mark.parametrize("height", [1.7, 9.0])
    def test_the_thickness_acts_as_derived(self, nu: float, height: float):
        """Rod, one element across and two against the sections' derived energies, which are free of any fit."""
        thickness, at = 0.03, ElasticaPrediction.at(height)
        length = at.last.length + 5.0
        models = {ROD: {"kind": "rod"}, one_across(nu): {"nu": nu}, exact(nu): {"nu": nu, "across": 2}}
        for section, given in models.items():
            lam = snap(StripModel(length, thickness, **given), at, 0.3).lam
            derived = thickness_effect(section, height, length)
            assert (lam - at.last.advance) / thickness**2 == pytest.approx(derived, rel=0.005)

    def test_cheapest_that_meets_it(self, prediction: ElasticaPrediction):
        def first(accuracy: float, thickness: float, nu: float = 0.0, length: float = LENGTH) -> str:
            return select_model.candidates(prediction, length, thickness, nu, accuracy)[0]

        assert first(1e-2, 0.06) == "elastica"
        assert first(1e-3, 0.06) == "rod"
        assert first(1e-3, 0.01) == "elastica"
        assert first(1e-5, 0.06) == "solid"
        assert first(1e-3, 0.06, nu=0.45) == "rod"
        assert first(1e-3, 0.2, nu=0.49) == "solid"
        # Hardly anything lies: only the solid says whether the strip is lifted.
        assert first(1e-2, 0.06, length=prediction.last.length + 0.05) == "solid"
        limit = ElasticaPrediction.at(1.6)
        assert select_model.candidates(limit, LENGTH, 0.06, 0.0, 1e-2) == ("solid",)

    def test_auto(self, prediction: ElasticaPrediction):
        for accuracy_asked, model in ((1e-2, "elastica"), (1e-3, "rod")):
            scene = scene_of(LENGTH, THICKNESS, HEIGHT, "auto", accuracy_asked)
            found = critical.find(scene)
            assert found.model == model
            stated = (found.error + found.model_error) / found.lambda_c
            truth = (
                from_near_the_end(StripModel(LENGTH, THICKNESS), prediction, 1.0).lam * scene.material.gravity_length
            )
            assert abs(found.lambda_c / truth - 1.0) <= stated <= accuracy_asked

    def test_a_failure_is_the_next_models(self, monkeypatch: pytest.MonkeyPatch):
        run = critical._run

        def fails(strip: StripModel, *given: object) -> static.XRun:
            if strip.kind == "rod":
                raise critical.SolveError("planted")
            return run(strip, *given)

        monkeypatch.setattr(critical, "_run", fails)
        assert critical.find(scene_of(LENGTH, THICKNESS, HEIGHT, "auto", 2e-3)).model == "solid"
        with pytest.raises(critical.SolveError, match="planted"):
            critical.find(scene_of(LENGTH, THICKNESS, HEIGHT, "rod", 2e-3))


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    ways = [{"kind": "elastica"}, {"kind": "rod"}, {"kind": "solid", "refinement": 2.0}]
    return accuracy.run(LENGTH, THICKNESS, [1.2, HEIGHT], ways, 1.4, [1e-2], 1)


@pytest.mark.slow
class TestStudy:
    def test_errors(self, found: xr.Dataset):
        error, apart = np.abs(found["error"].values), found["state_error"].values
        assert found["snaps"].values.tolist() == [0, 1]
        assert error[0, 1] == pytest.approx(2.1e-3, rel=0.1)  # of the elastica: the thickness
        assert np.all(error[1:] < 3e-4)
        assert np.all(apart[1:] < 0.1)
        assert np.all(apart > 0.0)
        assert np.all(found["seconds"].values > 0.0)

    def test_presets_and_elastica(self, found: xr.Dataset):
        snap = found.sel(gripper_height=HEIGHT, accuracy=1e-2)
        assert snap["preset_model"].values.tolist() == ["elastica", "solid"]
        assert np.all(np.abs(snap["preset_error"]) <= snap["preset_estimate"])
        assert np.all(np.abs(found["elastica_error"]) < 1e-9)
        assert 30.0 < float(found["memory"].sel(model="elastica")) < float(found["memory"].sel(model="solid"))

    def test_units_and_figure(self, found: xr.Dataset, tmp_path):
        for name, variable in found.variables.items():
            assert {"units", "long_name"} <= set(variable.attrs), name
        store.write(found, tmp_path / "a.nc", title="a", config={})
        fig = work_precision.draw(store.read(tmp_path / "a.nc"))
        assert len([ax for ax in fig.axes if ax.lines]) == 3


def test_pareto_front():
    seconds, error = np.array([1.0, 2.0, 3.0, 0.5, np.nan]), np.array([1e-2, 1e-3, 5e-3, 1e-1, np.inf])
    assert models.pareto(seconds, error).tolist() == [3, 0, 1]


def test_shapes_of_the_models_agree():
    """The same state by the elastica, the rod and a thin solid."""
    s = np.linspace(0.0, LENGTH, 50)
    shapes = [
        Strategy(kind, refinement=r).answer(LENGTH, 0.01, HEIGHT).shape(s)
        for kind, r in (("elastica", 1.0), ("rod", 0.5), ("solid", 2.0))
    ]
    # At a maximum of lambda the state is known to the square root of its error only.
    assert shapes[2] == pytest.approx(shapes[0], abs=0.08)
    assert shapes[1] == pytest.approx(shapes[0], abs=5e-3)


def test_a_finer_grid_is_finer_and_agrees():
    for z in (1.2, HEIGHT):
        found = elastica.critical(z)
        assert accuracy.advance_on_finer_grid(found) == pytest.approx(found.state.advance, abs=1e-9)


class TestEstimates:
    @pytest.mark.parametrize("case", range(8))
    def test_thin_solids_to_tight_accuracies(self, case: int):
        """Their error changes its sign with the mesh.  Truth: a fine rod, and the derived distance of the sections."""
        draw = np.random.default_rng([20263604, case])
        height, thickness = draw.uniform(1.7, 7.0), float(np.exp(draw.uniform(*np.log([5e-4, 1e-2]))))
        accuracy = float(np.exp(draw.uniform(*np.log([1e-5, 1e-4]))))
        at = ElasticaPrediction.at(height)
        length = at.last.length + draw.uniform(1.0, 10.0)
        apart = thickness_effect(one_across(0.0), height, length) - thickness_effect(ROD, height, length)
        truth = snap(StripModel(length, thickness, kind="rod"), at, 0.2).lam + apart * thickness**2
        scene = scene_of(length, thickness, height, "solid", accuracy)
        found = critical.find(scene)
        assert abs(found.lambda_c / scene.gravity_length - truth) < found.error / scene.gravity_length
        assert found.error < accuracy * found.lambda_c

    def test_cases_and_their_truth(self):
        found = estimates.run(3, 20181380)
        assert found["asked"].values.tolist() == list(estimates.MODELS)
        assert found["outcome"].values.tolist() == [estimates.NUMBER] * 3
        assert np.all(found["error"] <= found["estimate"])
        assert np.all(found["estimate"] <= found["accuracy"])
        assert estimates.case(2, 20181380)["error"] == float(found["error"][2])

    def test_a_failure_has_no_number(self, monkeypatch: pytest.MonkeyPatch):
        def fails(*_: object, **__: object) -> critical.CriticalPoint:
            raise critical.SolveError("planted")

        monkeypatch.setattr(estimates.critical_point, "find", fails)
        found = estimates.run(1, 1)
        assert np.isnan(found["error"][0])
        assert found["outcome"].values[0] == estimates.REFUSED
        assert "planted" in str(found["message"].values[0])

    def test_the_slowest_solids_take_a_few_times_as_long_as_usual(self):
        """As stored; once the slowest hundredth took 8 times, the slowest of all 18 times the median."""
        data = store.read(Path(__file__).parents[1] / "results" / "studies" / "estimates.nc")
        usual = (data["used"] == "solid") & (data["accuracy"] >= 3e-4) & (data["height"] < 9.0)
        seconds = data["seconds"].values[usual & np.isfinite(data["seconds"])]
        assert len(seconds) >= 20
        assert np.quantile(seconds, 0.95) < 5.0 * np.median(seconds)


class TestProfile:
    def test_own_and_whole_times(self):
        ticks = iter([0.0, 1.0, 3.0, 6.0, 10.0, 15.0])
        timer = profiling.Clock(now=lambda: next(ticks))
        inner = timer.timed("assembly", lambda: None)
        timer.timed("Newton", inner)()
        timer.stop()
        assert (timer.own["Newton"], timer.whole["Newton"]) == (2.0 + 4.0, 9.0)
        assert (timer.own["assembly"], timer.whole["assembly"], timer.calls["assembly"]) == (3.0, 3.0, 1)
        assert timer.own[profiling.REST] == 1.0 + 5.0

    def test_a_profile(self):
        before = Band.factor
        scene = Scene(length=0.4, height=0.09, eta_b=3780.0, accuracy=1e-2)
        found = profiling.profile(lambda: critical.find(scene), 1)
        assert Band.factor is before
        assert float(found["share"].sum()) == pytest.approx(1.0)
        calls = dict(zip(found["part"].values, found["calls"].values, strict=True))
        assert calls["mesh and model"] > 0 == calls["time step"]
        assert calls["factorisation"] > calls["limit point"] > 0
        one = found.sel(part=list(profiling.UNITS))
        assert float(one["ratio"].sum()) == pytest.approx(1.0)
        text = profiling.table(found)
        assert text.count("\n") == 3 + int(np.sum(found["calls"] > 0))

    def test_of_the_elastica(self):
        """One system for each Jacobian, another for the condition's gradient, which the solution does not need."""
        found = profiling.profile(lambda: elastica.critical(2.0), 1, profiling.OF_ELASTICA)
        calls = dict(zip(found["part"].values, found["calls"].values, strict=True))
        assert calls["assembly"] > calls["condition of the limit point"] == calls["residual"]
        assert calls["factorisation"] == calls["assembly"] + calls["condition of the limit point"] - 1
        assert calls["Newton"] >= calls["stored start"] == calls["place of the sag"] == 1
