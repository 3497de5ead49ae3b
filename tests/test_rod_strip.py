"""The rod on the floor: lambda_c against the elastica and the solid, a fall, friction, and the command line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stripfold import elastica
from stripfold.analysis import (
    critical_point as critical,
)
from stripfold.analysis import (
    nodal,
    path_friction,
    planning,
    release,
    static,
)
from stripfold.analysis.prediction import ElasticaPrediction, from_near_the_end, without_horizontal_force
from stripfold.analysis.release import Fall, ReleaseState
from stripfold.analysis.static import End, StripModel
from stripfold.cli import main
from stripfold.effects import Effect, Hysteresis, Pull
from stripfold.errors import InvalidInputError
from stripfold.inputs import Scene
from stripfold.models.rod import Rod
from stripfold.simulation import Simulation
from stripfold.solve.schemes import Damping

LENGTH, THICKNESS, HEIGHT = 16.0, 0.0594, 3.0


def rod(thickness: float = THICKNESS, length: float = LENGTH) -> StripModel:
    return StripModel(length, thickness, kind="rod")


@pytest.fixture(scope="module")
def run() -> nodal.XRun:
    """From lambda_0 to the critical point, on the standard mesh."""
    return nodal.solve_height(rod(), HEIGHT, 1.0, past=0.0)


class TestCriticalPoint:
    def test_the_thin_limit_is_the_elastica(self):
        """Truth: the elastica's lambda_c; the distance falls as h^2 (as eta_m), the strip's length plays no part."""
        truth = elastica.critical(HEIGHT).advance
        prediction = ElasticaPrediction.at(HEIGHT)
        thickness = (0.2, 0.1, 0.05)
        # On one mesh, whose own error is that without thickness.
        thin = from_near_the_end(rod(1e-3), prediction, 1.0).lam
        distance = np.array([from_near_the_end(rod(h), prediction, 1.0).lam - thin for h in thickness])
        print("distance", distance, "of the mesh", thin - truth)
        assert thin == pytest.approx(truth, rel=2e-4)
        assert np.log2(distance[:-1] / distance[1:]) == pytest.approx(2.0, abs=0.2)
        assert distance / np.square(thickness) == pytest.approx(-5.7, abs=0.7)

    def test_the_solid(self, run: nodal.XRun):
        """The paper's thickness at eta_b = 3780: within 2e-4 of the solid on a mesh of the same nodes."""
        solid = static.solve_height(replace(rod(), kind="solid"), HEIGHT, 1.0, past=0.0)
        assert isinstance(run.problem.model, Rod)
        assert run.end is solid.end is End.SNAP
        assert run.lambda_0 == pytest.approx(solid.lambda_0, abs=2e-3)
        fine = from_near_the_end(rod(), ElasticaPrediction.at(HEIGHT), 1.0)
        assert fine.lam == pytest.approx(solid.lam, rel=1e-4)

    def test_the_moving_lift_off_agrees_with_contact_at_nodes(self, run: nodal.XRun):
        """With the lift-off as an unknown the rod ends where it does with contact node by node, to that mesh."""
        short = from_near_the_end(rod(), ElasticaPrediction.at(HEIGHT), 1.0)
        assert short.end is run.end
        assert short.lam == pytest.approx(run.lam, rel=5e-4)
        assert without_horizontal_force(rod(), ElasticaPrediction.at(HEIGHT)) == pytest.approx(run.lambda_0, abs=2e-3)
        assert short.free_length == pytest.approx(run.free_length, abs=0.1)

    @pytest.mark.parametrize(("height", "end"), [(1.3, End.TOUCH), (1.75, End.SNAP), (5.0, End.SNAP)])
    def test_found(self, height: float, end: End):
        """``find`` on the rod: the elastica's verdict, and its value within the estimate and the thickness's share."""
        scene = Scene(length=0.6, height=height * 0.029988, eta_b=3780.0, eta_m=1e-4, model="rod")
        found, truth = critical.find(scene), elastica.critical(scene.height_star)
        unit = scene.material.gravity_length
        assert found.model == "rod"
        assert found.snap == truth.snap == (end is End.SNAP)
        assert found.lambda_0 / unit == pytest.approx(
            elastica.state_no_horizontal_force(scene.height_star).advance, abs=2e-3
        )
        if found.snap:
            thickness = 8.0 * scene.material.relative_thickness**2
            assert found.error <= 1e-3 * found.lambda_c
            assert abs(found.lambda_c / unit - truth.advance) < found.error / unit + thickness
        else:
            assert np.isnan(found.lambda_c)

    def test_a_strip_that_is_lifted(self):
        """Too short for the height: no snap, and the reason; nothing is solved for."""
        found = critical.find(Scene(length=0.15, height=0.09, eta_b=3780.0, model="rod"))
        assert (found.snap, found.reason) == (False, End.LIFTED.reason)


def test_lowest_advance_over_height_used_in_planning():
    """lambda_c - z is above what planning takes for certain; the least of it is near z = 5.6."""
    curve = elastica.master_curve(np.array([1.6, 3.0, 5.0, 5.6, 6.2, 9.0, 25.0, 60.0]))
    assert planning.LOWEST < (curve.advance - curve.z).min() < planning.LOWEST + 0.2


class TestMotion:
    def test_it_falls_to_rest(self, run: nodal.XRun):
        """From lambda_c to the touch and to rest, on a mesh that can be rolled on; the balance closes all the way."""
        sizes = planning.Sizes(free=0.15, lying=0.15)
        mesh = planning.boundaries(12.0, planning.lift_off_sweep(HEIGHT), 1.5, sizes)
        strip = rod(length=12.0)
        (_, model, state) = next(nodal.lift(strip, [HEIGHT]))
        found = nodal.along_x(strip, HEIGHT, (model, state), mesh, past=0.0)
        assert found.critical is not None
        fall = Fall(disturbance=2e-3, damping=Damping(0.4, 0.05))
        motion = release.simulate_fall(ReleaseState.at(found.problem, found.critical), fall)
        assert motion.touch is not None
        energy = [moment.energy for moment in motion.states]
        balance = np.array([e.total - e.work + e.lost - e.closing for e in energy])
        assert np.abs(balance - balance[0]).max() < 1e-9
        assert np.abs([e.closing for e in energy]).max() < 1e-6
        assert all(m.q[found.problem.bounded].min() >= -1e-12 for m in motion.states)
        assert release.state_at_rest(found.problem, motion.states[-1]).negatives == 0


class TestFriction:
    @pytest.mark.parametrize("law", ["pull", "hysteresis"])
    def test_steps_along_x(self, run: nodal.XRun, law: str):
        """Each step is an equilibrium with its friction; without it the state at the same place is another."""
        model, start = run.problem.model, run.points[0].state
        with_friction = Pull(model, 1.0, start.q) if law == "pull" else Hysteresis.of(model, 0.02, slack=start.q)

        def steps_with(*effects: Effect) -> list[path_friction.Step]:
            places = [(0, start.lam + 0.1 * n) for n in range(1, 9)]
            return list(path_friction.load_incrementally_from(model, start, effects, [run.problem.motion], places))

        last, bare = steps_with(with_friction)[-1], steps_with()[-1]
        free = np.ones(model.size, dtype=bool)
        free[last.problem.prescribed] = free[last.point.active] = False
        assert np.abs(last.problem.residual(last.point.q, last.point.lam)[free]).max() < 1e-7
        assert bare.point.lam == last.point.lam
        assert 1e-4 < model.largest_move(bare.point.q, last.point.q) < 0.5


class TestCommand:
    def test_critical(self, capsys: pytest.CaptureFixture[str]):
        arguments = ["--length", "0.6", "--eta-b", "3780", "--height", "0.09", "--model", "rod", "--json"]
        assert main(["critical", *arguments]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["model"] == "rod"
        assert found["lambda_c"] == pytest.approx(0.2951, rel=1e-3)

    def test_assess(self, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
        """The option reaches the strip; a low triangle is followed to its end without a fall."""
        asked = []
        true = StripModel.model

        def model(self, elements):
            asked.append(self.kind)
            return true(self, elements)

        monkeypatch.setattr(StripModel, "model", model)
        table = tmp_path / "path.csv"
        table.write_text("t,x,z\n0,-0.18,0\n0.5,-0.15,0.02\n1,-0.1,0.02\n")
        arguments = ["--length", "0.36", "--eta-b", "3780", "--model", "rod", "--json"]
        assert main(["assess", str(table), *arguments]) == 0
        assert json.loads(capsys.readouterr().out)["stable"]
        assert set(asked) == {"rod"}

    def test_what_is_not_possible(self):
        """The printed law on the rod, and a motion in time of the elastica."""
        strip = {"length": 0.6, "height": 0.09, "eta_b": 3780.0}
        with pytest.raises(InvalidInputError, match="only the solid has another law"):
            Scene(**strip, model="rod", law="printed")
        with pytest.raises(InvalidInputError, match="no motion in time"):
            Simulation(**strip, model="elastica")
        assert Simulation(**strip, model="rod").as_config()["model"] == "rod"
