"""What a path does to a strip: critical points and their kind, falls, first touch, end; and what is stored of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from stripfold import elastica
from stripfold.base.errors import InvalidInputError, SolveError, TimeStepError
from stripfold.base.material import Material
from stripfold.files import schema
from stripfold.follow import fall, statics
from stripfold.follow import track as assessing
from stripfold.follow.contact import columns_on_floor, touches
from stripfold.follow.contact_branch import BranchPoint
from stripfold.follow.contact_set import on_nodes
from stripfold.follow.fall import Fall, assess_strip
from stripfold.follow.statics import StripModel
from stripfold.follow.track import BIFURCATION, SNAP, Track
from stripfold.paths import geometric, low_path, rpath, table
from stripfold.paths.curve import GripperPath, pieces_through
from stripfold.paths.rpath import RPath
from stripfold.solve.schemes import Damping
from tasks import assess_data, post_critical
from tasks.post_critical import PostCriticalBranches
from tasks.states import rows_of_motion

THICKNESS = 0.0594
STRIP = StripModel(20.0, THICKNESS)
FALL = Fall(1e-2, damping=Damping(0.2, 0.1))
MATERIAL = Material(3780.0)
OTHER = Material(8.0 * 3780.0, eta_m=2e-3, rho_a=3.0)
"""L* half as long, and the same thickness / L*: in solver units the same strip."""
SHORT = 13.0
PATHS: dict[str, Callable[[], GripperPath]] = {
    "triangular": lambda: geometric.triangular(STRIP.length),
    "circular": lambda: geometric.circular(STRIP.length),
    "r-path": lambda: rpath.plan_r_path(STRIP.length).path,
}
PLACES = {"triangular": (3.392, 6.608), "circular": (5.289, 8.487), "r-path": (4.309, 7.518)}


@pytest.fixture(scope="module")
def statics() -> dict[str, Track]:
    """The paper's paths up to their critical points."""
    return {name: assess_strip(STRIP, make()) for name, make in PATHS.items()}


@pytest.fixture(scope="module")
def stored() -> tuple[xr.Dataset, Track]:
    """A circular path with its fall as it is stored, and what was found."""
    kept: list[Track] = []

    def keep(*given: object) -> Track:
        kept.append(assessing.assess_strip(*given))  # type: ignore[arg-type]
        return kept[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assess_data, "assess_strip", keep)
        data = assess_data.run(MATERIAL, SHORT * MATERIAL.gravity_length, "circular", FALL, 2.0)
    return data, kept[0]


@pytest.fixture(scope="module")
def low() -> tuple[StripModel, Track]:
    """A path too low for a snap."""
    strip = StripModel(12.0, 0.06)
    return strip, assess_strip(strip, low_path.low(strip.length, 1.2), FALL, 2.0)


WAYS_LENGTH = 17.0


@pytest.fixture(scope="module")
def ways() -> tuple[xr.Dataset, PostCriticalBranches, RPath]:
    """Both ways out of an R-path: stored, and as they were found."""
    kept: list[PostCriticalBranches] = []
    follow_both_branches = post_critical.follow_both_branches

    def keep(*given: object) -> PostCriticalBranches:
        kept.append(follow_both_branches(*given))  # type: ignore[arg-type]
        return kept[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(post_critical, "follow_both_branches", keep)
        data = post_critical.two_ways(MATERIAL, WAYS_LENGTH * MATERIAL.gravity_length, FALL, 1.0)
    return data, kept[0], rpath.plan_r_path(WAYS_LENGTH)


def elasticas_angle(path: GripperPath, travelled: float) -> float:
    """Angle between a path and the elastica's lambda_c(z), by differences of both, degrees."""
    d = 1e-3
    (x0, z0), (x1, z1) = path.position(travelled - d), path.position(travelled + d)
    slope = (elastica.critical(float(z1) + d).advance - elastica.critical(float(z1) - d).advance) / (2.0 * d)
    path_angle, boundary_angle = np.arctan2(z1 - z0, x1 - x0), np.arctan2(1.0, slope)
    apart = abs(np.degrees(path_angle - boundary_angle)) % 180.0
    return float(min(apart, 180.0 - apart))


class TestCriticalPoints:
    """Where, and of which kind."""

    @pytest.mark.parametrize("name", PATHS)
    def test_place_is_on_the_boundary(self, statics: dict[str, Track], name: str):
        """Truth: the elastica's lambda_c at this height; a thickness takes 6 (h/L*)^2 off it."""
        found = statics[name]
        (event,) = found.events
        assert event.place == pytest.approx(PLACES[name], abs=4e-3)
        np.testing.assert_allclose(PATHS[name]().position(event.travelled), event.place, atol=1e-12)
        x, z = (float(value) for value in event.place)
        off = x + STRIP.length / 2.0 - elastica.critical(z).advance
        assert off == pytest.approx(-6.0 * THICKNESS**2, abs=8e-3)
        assert event.travelled == event.found.lam
        assert not found.stable
        assert not found.at_end
        assert found.touch is None
        assert not found.motions
        assert len(found.segments) == 1
        assert found.last is found.segments[0].states[-1]

    @pytest.mark.parametrize("name", PATHS)
    def test_kind_by_the_angle(self, statics: dict[str, Track], name: str):
        """Truth: the elastica's boundary, by differences.  The R-path of the elastica meets its own at no angle."""
        (event,) = statics[name].events
        truth = elasticas_angle(PATHS[name](), event.travelled)
        assert event.angle == pytest.approx(truth, abs=2.5)
        if name == "r-path":
            assert event.kind == BIFURCATION
            assert event.angle == pytest.approx(8.2, abs=0.5)
        else:
            assert event.kind == SNAP
            assert event.angle == pytest.approx({"triangular": 89.0, "circular": 76.4}[name], abs=0.8)

    def test_angle_is_that_of_the_path(self, statics: dict[str, Track]):
        """The same critical state come upon along its boundary, across it, and in between."""
        found = statics["circular"]
        (event,) = found.events
        problem, point = found.last
        z = float(event.place[1])
        slope = (elastica.critical(z + 1e-3).advance - elastica.critical(z - 1e-3).advance) / 2e-3
        along = np.array([slope, 1.0]) / np.hypot(slope, 1.0)
        across = np.array([along[1], -along[0]])
        for angle in (0.0, 30.0, 60.0, 90.0):
            way = np.cos(np.radians(angle)) * along + np.sin(np.radians(angle)) * across
            for signed in (3.0 * way, -way):
                piece = SimpleNamespace(position=problem.motion.path.position, rate=lambda s, way=signed: way)
                turned = replace(problem, motion=replace(problem.motion, path=piece))
                assert assessing.boundary_angle(turned, point) == pytest.approx(angle, abs=2.0)

    def test_normal_by_differences(self, statics: dict[str, Track]):
        """At fixed other unknowns a move of the gripper changes the forces; what the mode feels of it is the normal."""
        found = statics["circular"]
        (event,) = found.events
        problem, before = found.last
        mode, grasp = before.mode, problem.model.middle[0]
        normal = []
        for unknown in grasp:
            q = before.q.copy()
            forces = []
            for d in (1e-6, -1e-6):
                q[unknown] = before.q[unknown] + d
                forces.append(problem.residual(q, before.lam))
            normal.append(float(mode @ (forces[0] - forces[1])) / 2e-6)
        way = problem.motion.rates(event.travelled)
        sine = abs(np.dot(normal, way)) / np.linalg.norm(normal) / np.linalg.norm(way)
        assert event.angle == pytest.approx(np.degrees(np.arcsin(sine)), abs=1e-2)

    @pytest.mark.parametrize(("angle", "kind"), [(14.9, BIFURCATION), (15.1, SNAP)])
    def test_threshold(self, statics: dict[str, Track], monkeypatch: pytest.MonkeyPatch, angle: float, kind: str):
        found = statics["r-path"]
        monkeypatch.setattr(assessing, "boundary_angle", lambda *_: angle)
        (event,) = found.events
        assert assessing._event(found.last, found.path, event.found).kind == kind

    def test_a_table_of_the_triangle_is_the_triangle(self, statics: dict[str, Track], tmp_path: Path):
        file = tmp_path / "triangle.csv"
        file.write_text("t,x,z\n0,-0.3,0\n0.2,0,0.3\n1,0.3,0\n")
        other = assess_strip(STRIP, table.read(file, 20.0, 0.03))
        (event,), (truth,) = other.events, statics["triangular"].events
        assert event.travelled == pytest.approx(truth.travelled, abs=2e-6)
        assert event.angle == pytest.approx(truth.angle, abs=0.01)
        assert event.kind == SNAP

    def test_off_the_boundary(self, statics: dict[str, Track], monkeypatch: pytest.MonkeyPatch):
        """Truth: the run along x at the same height; and how far that is from a place that is moved off."""
        (event,) = statics["r-path"].events
        assert abs(assess_data.off_the_boundary(STRIP, event)) < 1e-3
        asked: list[tuple[object, ...]] = []

        def run(*given: object, **_: object) -> SimpleNamespace:
            asked.append(given)
            return SimpleNamespace(critical=SimpleNamespace(lam=13.0))

        monkeypatch.setattr(assess_data, "solve_height", run)
        moved = replace(event, place=np.array([3.1, 5.0]))
        assert assess_data.off_the_boundary(STRIP, moved, 0.5) == pytest.approx(0.1)
        assert asked == [(STRIP, 5.0, 0.5)]
        monkeypatch.setattr(assess_data, "solve_height", lambda *_, **__: SimpleNamespace(critical=None))
        assert np.isnan(assess_data.off_the_boundary(STRIP, moved))


class TestLow:
    """A path on which nothing snaps."""

    def test_it_is_followed_to_its_end(self, low: tuple[StripModel, Track]):
        _, found = low
        assert found.stable
        assert found.at_end
        assert not found.motions
        assert found.last[1].lam == pytest.approx(found.path.length)
        assert not replace(found, segments=(replace(found.segments[0], states=found.segments[0].states[:-1]),)).at_end

    def test_first_touch(self, low: tuple[StripModel, Track]):
        """Truth: at this height the elastica's sag comes down at a known advance and place; located to 1e-4 L*."""
        strip, found = low
        assert found.touch is not None
        assert not found.touch.fell
        truth = elastica.critical(1.2).state
        assert truth.sag is not None
        half = strip.length / 2.0
        x, z = found.path.position(found.touch.travelled)
        assert z == pytest.approx(1.2)
        assert x + half == pytest.approx(truth.advance, abs=0.04)
        touch = x + truth.x[-1] - float(truth.at(truth.sag.s).x)
        assert found.touch.x == pytest.approx(touch, abs=0.06)
        # The state of the touch is one of them, upright over the floor at one point.
        at = next(i for i, (problem, point) in enumerate(found.states) if touches(problem.model, point))
        problem, point = found.states[at]
        assert point.lam == found.touch.travelled
        assert not touches(found.states[at - 1][0].model, found.states[at - 1][1])
        place, rest = problem.model.s[columns_on_floor(problem.model, point)][:2]
        assert rest - place > 2.0
        x = problem.model.resampled_mid_surface(point.q, np.array([place]))[0, 0]
        assert x == pytest.approx(found.touch.x, abs=1e-3)

    def test_a_strip_that_lies_from_the_first_does_not_touch_again(self, low: tuple[StripModel, Track]):
        _, found = low
        segment = found.segments[0]
        lying = next(i for i, (problem, p) in enumerate(segment.states) if touches(problem.model, p))
        assert assessing._static_touch(replace(segment, states=segment.states[lying:])) is None
        assert assessing._static_touch(replace(segment, states=segment.states[:lying])) is None

    def test_numbers(self, low: tuple[StripModel, Track]):
        """Where nothing is critical there is no number, and none is made up."""
        strip, found = low
        fine = replace(found, touch=replace(found.touch, x=found.touch.x + 0.2))  # type: ignore[type-var, union-attr]
        numbers = assess_data.numbers(found, fine, strip, "triangular", 2.0)
        assert set(numbers) == set(assess_data.NUMBERS)
        missing = {key for key, value in numbers.items() if np.isnan(value)}
        critical = {f"critical_{name}" for name in ("travelled", "x", "z", "angle")}
        assert missing == {*critical, "bifurcation", "boundary_error"}
        assert numbers["critical_points"] == numbers["fell"] == numbers["assumed_touch_x"] == 0.0
        assert numbers["completed"] == 1.0
        assert found.touch is not None
        assert numbers["touch_x"] == found.touch.x
        assert numbers["touch_uncertainty"] == pytest.approx(0.2)
        assert numbers["touch_travelled"] == found.touch.travelled

    def test_numbers_without_a_touch(self, statics: dict[str, Track]):
        found = statics["r-path"]
        numbers = assess_data.numbers(found, found, STRIP, "r-path", 2.0)
        missing = {key for key, value in numbers.items() if np.isnan(value)}
        assert missing == {"touch_x", "touch_travelled", "touch_error", "touch_uncertainty", "fell"}
        assert numbers["completed"] == 0.0
        assert numbers["critical_points"] == numbers["bifurcation"] == 1.0
        plan = rpath.plan_r_path(STRIP.length)
        assert numbers["assumed_touch_x"] == plan.first_touch
        assert numbers["planned_touch_x"] == plan.first_touch
        assert numbers["landing_x"] == plan.landing


class TestFailedFall:
    """What statics say is not lost with the fall."""

    def test_the_statics_are_kept(self, monkeypatch: pytest.MonkeyPatch):
        path = PATHS["circular"]()

        def fail(*_: object, **__: object) -> None:
            raise TimeStepError("no fall within 40 sqrt(L*/g)", last=None)

        monkeypatch.setattr(assessing, "simulate_fall", fail)
        found = assess_strip(STRIP, path, FALL)
        (event,) = found.events
        assert not found.stable
        assert not found.motions
        assert len(found.segments) == 1
        assert event.place == pytest.approx(PLACES["circular"], abs=4e-3)
        assert isinstance(found.failure, TimeStepError)
        with pytest.raises(TimeStepError, match="no fall"):
            found.complete()

    def test_a_failure_in_the_statics_is_an_error(self, monkeypatch: pytest.MonkeyPatch):
        def fail(*_: object, **__: object) -> None:
            raise SolveError("no state")

        monkeypatch.setattr(assessing, "follow", fail)
        with pytest.raises(SolveError, match="no state"):
            assess_strip(STRIP, PATHS["circular"](), FALL)


class TestFallen:
    """A path with a snap, to its end."""

    def test_size(self, stored: tuple[xr.Dataset, Track]):
        """Truth: what the motion lost on its way but for the start, and the fall of one node over a fine grid."""
        _, found = stored
        (motion,), (before, _) = found.motions, found.segments
        drop, energy = assessing.size_of_fall(before.states[-1], motion)
        lost = motion.states[-1].energy.lost
        # The gripper's start gives a little more.
        assert 0.5 * lost < energy < lost
        s = np.linspace(0.0, SHORT, 400)
        states = before.states[-1], (motion.problem, motion.states[-1])
        z = [problem.model.resampled_mid_surface(state.q, s)[:, 1] for problem, state in states]
        assert drop == pytest.approx((z[0] - z[1]).max(), rel=1e-2)
        assert found.failure is None
        assert found.complete() is found

    def test_the_parts_join(self, stored: tuple[xr.Dataset, Track]):
        _, found = stored
        before, after = found.segments
        (motion,), (event,) = found.motions, found.events
        assert event.kind == SNAP
        first, last = motion.states[0], motion.states[-1]
        # The same state on another mesh.
        assert first.lam == pytest.approx(event.travelled, abs=0.012)
        assert before.points[-1].lam == pytest.approx(event.travelled, abs=1e-6)
        s = np.linspace(0.0, SHORT, 100)
        model, (problem, critical) = motion.problem.model, before.states[-1]
        apart = model.resampled_mid_surface(first.q, s) - problem.model.resampled_mid_surface(critical.q, s)
        assert np.abs(apart).max() < 0.15
        assert last.lam == pytest.approx(event.travelled + 0.01)
        assert after.points[0].lam == last.lam
        problem, rest = after.states[0]
        moved = problem.model.resampled_mid_surface(fall.q, s) - model.resampled_mid_surface(last.q, s)
        assert np.abs(moved).max() < 0.02
        assert found.at_end
        assert not found.stable
        assert all(point.negatives == 0 for point in after.points)

    def test_it_fell_to_its_touch(self, stored: tuple[xr.Dataset, Track]):
        _, found = stored
        assert found.touch is not None
        assert found.touch.fell
        assert found.touch.travelled == found.events[0].travelled
        assert found.touch.x == found.motions[0].touch_x
        model, moment = found.motions[0].problem.model, found.motions[0].states[found.motions[0].touch]
        column = int(np.argmin(np.abs(model.s - model.s[columns_on_floor(model, moment)][0])))
        assert model.mid_surface(moment.q)[column, 0] == pytest.approx(found.touch.x, abs=0.3)

    def test_it_ends_folded(self, stored: tuple[xr.Dataset, Track]):
        """Truth: the elastica's folded state with aligned edges."""
        data, found = stored
        plan = rpath.plan_r_path(SHORT)
        assert assessing.lying_length(*found.last) == pytest.approx(plan.lying_length, abs=0.15)
        problem, last = found.last
        places = np.arange(0.0, SHORT, 0.1)
        folded = plan.states[-1].at(places)
        away = np.linalg.norm(problem.model.resampled_mid_surface(last.q, places) - folded, axis=1).max()
        assert away < 0.02
        unit = MATERIAL.gravity_length
        assert data.attrs["shape_error"] == pytest.approx(unit * away)
        assert data.attrs["lying_length"] == pytest.approx(unit * plan.lying_length, abs=0.15 * unit)
        _, hold = assessing.grip_and_hold(*found.last)
        assert abs(hold) < 0.02
        # Before, the held end takes what the gripper pushes.
        grip, hold = assessing.grip_and_hold(*found.segments[0].states[-1])
        assert hold == pytest.approx(-grip[0], abs=1e-6)
        assert abs(hold) > 0.01

    def test_no_more_falls_than_allowed(self, stored: tuple[xr.Dataset, Track], monkeypatch: pytest.MonkeyPatch):
        """A strip that would fall for ever is released five times."""
        _, found = stored
        first = found.segments[0]
        let_go: list[object] = []
        monkeypatch.setattr(assessing, "follow", lambda *_, **__: first)
        monkeypatch.setattr(assessing, "simulate_fall", lambda *given: let_go.append(given) or found.motions[0])
        monkeypatch.setattr(assessing, "at_rest", lambda *_: found.segments[1].states[0])
        endless = assess_strip(StripModel(SHORT, THICKNESS), found.path, FALL, 2.0)
        assert len(let_go) == len(endless.motions) == 5
        assert len(endless.events) == len(endless.segments) == 6
        assert not endless.at_end

    def test_without_rest_the_first_touch_is_the_end(self, stored: tuple[xr.Dataset, Track]):
        _, found = stored
        strip = StripModel(SHORT, MATERIAL.relative_thickness)
        ended = assess_strip(strip, found.path, replace(FALL, to_rest=False), 2.0).complete()
        assert ended.touch is not None
        assert found.touch is not None
        assert ended.touch.x == pytest.approx(found.touch.x, abs=1e-3)
        assert len(ended.segments) == len(ended.motions) == 1
        assert ended.motions[0].touch == len(ended.motions[0].states) - 1

    def test_a_touch_before_the_fall_is_the_first(
        self, stored: tuple[xr.Dataset, Track], monkeypatch: pytest.MonkeyPatch
    ):
        _, found = stored
        segments = iter(found.segments)
        pieces = []

        def follow(*given: object, options: object = None, progress: object = None) -> statics.StaticSegment:
            # After the mesh, the path and the length: the first state and its piece.
            pieces.append(given[4] if len(given) > 4 else 0)
            return next(segments)

        early = assessing.Touchdown(1.0, 2.0, False)
        monkeypatch.setattr(assessing, "follow", follow)
        monkeypatch.setattr(assessing, "simulate_fall", lambda *_: found.motions[0])
        touched = iter((early, assessing.Touchdown(3.0, 4.0, False)))
        monkeypatch.setattr(assessing, "_static_touch", lambda _: next(touched))
        strip = StripModel(SHORT, THICKNESS)
        assert assess_strip(strip, found.path, FALL, 2.0).touch is early
        # Fallen without a touch: the next static one is it.
        segments = iter([replace(s, pieces=tuple(p + 3 for p in s.pieces)) for s in found.segments])
        monkeypatch.setattr(
            assessing, "simulate_fall", lambda *_: replace(found.motions[0], touch=None, touch_x=float("nan"))
        )
        late = assessing.Touchdown(3.0, 4.0, False)
        touched = iter((None, late))
        assert assess_strip(strip, found.path, FALL, 2.0).touch is late
        # And on from the piece on which it fell.
        assert pieces == [0, 0, 0, 3]


class TestStored:
    """The dataset, in SI."""

    def test_layout(self, stored: tuple[xr.Dataset, Track]):
        data, found = stored
        assert all(v.attrs["units"] and v.attrs["long_name"] for v in data.variables.values())
        phase, part = data["phase"].values, data["part"].values
        assert part.tolist() == sorted(part)
        assert [str(phase[part == i][0]) for i in range(3)] == ["static", "fall", "static"]
        assert set(phase[part == 1]) == {"fall"}
        counts = [len(found.segments[0].points), np.sum(part == 1), len(found.segments[1].points)]
        assert [int(np.sum(part == i)) for i in range(3)] == counts
        fall = phase == "fall"
        assert np.all(np.isnan(data["time"].values) == ~fall)
        for name in ("force_x", "force_z", "hold_x", "eigenvalue", "negatives"):
            assert np.all(np.isnan(data[name].values) == fall), name
        for name in ("travelled", "pseudo_time", "x", "z", "gripper_x", "gripper_z"):
            assert np.isfinite(data[name].values).all(), name
        assert data.attrs["path"] == "circular"
        assert set(assess_data.NUMBERS) <= set(data.attrs)

    def test_what_the_stored_shapes_say(self, stored: tuple[xr.Dataset, Track]):
        data, _ = stored
        unit, length = MATERIAL.gravity_length, data.attrs["length"]
        assert data["arc"].values[[0, -1]] == pytest.approx([0.0, length])
        np.testing.assert_array_equal(data["gripper_x"], data["x"][:, 0])
        np.testing.assert_array_equal(data["gripper_z"], data["z"][:, 0])
        assert np.hypot(data["gripper_x"], data["gripper_z"]).values == pytest.approx(length / 2.0)
        angle = np.arctan2(np.abs(data["gripper_z"].values), -data["gripper_x"].values)
        np.testing.assert_allclose(data["travelled"], angle * length / 2.0, atol=1e-9)
        np.testing.assert_allclose(data["pseudo_time"], angle / np.pi, atol=1e-9)
        # The floor has no friction: what the gripper pushes along x the held end takes.
        static_ = data.isel(state=data["phase"].values == "static")
        np.testing.assert_allclose(static_["force_x"], -static_["hold_x"], atol=1e-6)
        size = np.hypot(static_["force_x"], static_["force_z"])
        assert data.attrs["peak_force"] == pytest.approx(float(size.max()))
        assert data.attrs["peak_hold"] == pytest.approx(float(np.abs(static_["hold_x"]).max()))
        assert data.attrs["peak_hold"] > 0.0
        critical = data.isel(state=int(np.sum(data["part"].values == 0)) - 1)
        for name, value in (("x", "gripper_x"), ("z", "gripper_z"), ("travelled", "travelled")):
            assert data.attrs[f"critical_{name}"] == pytest.approx(float(critical[value]), abs=1e-6 * unit)
        low_ = data["z"].values[data["part"].values == 1]
        # Under the touch the upper layer comes down.
        free = low_[0] > 0.1 * unit
        shape = data["x"].values[data["part"].values == 1][-1]
        assert low_[-1][free & (np.abs(shape - data.attrs["touch_x"]) < 0.5 * unit)].min() < 0.05 * unit
        assert data.attrs["touch_error"] == pytest.approx(data.attrs["touch_x"] - data.attrs["planned_touch_x"])

    def test_work_of_the_gripper(self, stored: tuple[xr.Dataset, Track]):
        """Truth, in SI and from what is stored: the gripper's work is the gain in height and in bending energy."""
        data, _ = stored
        first = data.isel(state=data["part"].values == 0)
        x, z, arc = first["x"].values, first["z"].values, first["arc"].values
        fx, fz = first["force_x"].values, first["force_z"].values
        work = np.trapezoid(fx, x[:, 0]) + np.trapezoid(fz, z[:, 0])
        slope = np.unwrap(np.arctan2(np.gradient(z, arc, axis=1), np.gradient(x, arc, axis=1)), axis=1)
        curvature = np.gradient(slope, arc, axis=1)
        stiffness = MATERIAL.rho_a / MATERIAL.eta_b
        energy = np.trapezoid(MATERIAL.rho_a * 9.81 * z + 0.5 * stiffness * curvature**2, arc, axis=1)
        assert energy[-1] - energy[0] == pytest.approx(work, rel=0.05)

    def test_fall_is_thinned_and_keeps_its_ends_and_touch(self, stored: tuple[xr.Dataset, Track]):
        data, found = stored
        (motion,) = found.motions
        second = np.sqrt(MATERIAL.gravity_length / 9.81)
        time = data["time"].values[data["part"].values == 1] / second
        assert time[0] == 0.0
        assert np.all(np.diff(time) > 0.0)
        assert time[-1] == pytest.approx(motion.states[-1].t)
        assert np.abs(time - motion.states[motion.touch].t).min() < 1e-9
        assert 20 < len(time) <= 63 < len(motion.states)
        rows = rows_of_motion(motion, 1)
        middle = motion.problem.model.mid_surface
        ways = [np.linalg.norm(middle(b.state.q) - middle(a.state.q), axis=1).max() for a, b in pairwise(rows)]
        assert max(ways) < 4.0 * np.sum(ways) / 60
        without = rows_of_motion(replace(motion, touch=None), 1)
        assert len(rows) - 1 <= len(without) <= len(rows)

    def test_another_material_of_the_same_ratios(
        self, stored: tuple[xr.Dataset, Track], monkeypatch: pytest.MonkeyPatch
    ):
        """The same numbers of another size: by hand L* is half, rho_a g L* is 3/2, a second 1/sqrt(2)."""
        data, found = stored
        given: list[tuple[object, ...]] = []
        monkeypatch.setattr(assess_data, "assess_strip", lambda *x: given.append(x) or found)
        other = assess_data.run(OTHER, SHORT * OTHER.gravity_length, "circular", FALL, 2.0)
        (strip, path, fall, refinement, _), fine = given
        assert (fine[0], fine[1], fine[3]) == (strip, path, 1.0)
        assert strip.length == pytest.approx(SHORT)  # type: ignore[attr-defined]
        assert strip.thickness == pytest.approx(found.last[0].model.thickness)  # type: ignore[attr-defined]
        assert refinement == 2.0
        assert path.length == pytest.approx(found.path.length)
        assert fall is FALL
        factors = {"m": 0.5, "N m-1": 1.5, "s": np.sqrt(0.5), "s-2": 2.0, "1": 1.0, "degree": 1.0}
        for name, variable in data.data_vars.items():
            factor = factors[variable.attrs["units"]]
            np.testing.assert_allclose(other[name], factor * variable, rtol=1e-6, atol=1e-9, err_msg=str(name))
        assert other.attrs["touch_uncertainty"] == 0.0  # the same twice
        for name in set(assess_data.NUMBERS) - {"touch_uncertainty"}:
            expected = factors[schema.variables()[name].unit] * data.attrs[name]
            assert other.attrs[name] == pytest.approx(expected, rel=1e-4, abs=1e-6), name
        assert other.attrs["length"] == pytest.approx(0.5 * data.attrs["length"])
        assert (other.attrs["rho_a"], other.attrs["eta_m"]) == (3.0, 2e-3)

        files = {
            (m, p): source.assign_attrs(touch_x=source.attrs["touch_x"] + i)
            for m, source in (("b", other), ("a", data))
            for i, p in enumerate(assess_data.PATHS)
        }
        table = assess_data.table(files, {"a": "A", "b": "B"})
        assert table["material"].values.tolist() == ["a", "b"]
        assert table["label"].values.tolist() == ["A", "B"]
        assert table["path"].values.tolist() == list(assess_data.PATHS)
        assert all(v.attrs["units"] and v.attrs["long_name"] for v in table.variables.values())
        for (m, p), file in files.items():
            cell = table.sel(material=m, path=p)
            for name in assess_data.NUMBERS:
                assert float(cell[name]) == file.attrs[name]
            assert float(cell["eta_b"]) == file.attrs["eta_b"]
            assert float(cell["gravity_length"]) == file.attrs["gravity_length"]

    def test_paths(self):
        for name in assess_data.PATHS:
            path = assess_data.path_of(name, 14.0)
            assert path.name == name
            np.testing.assert_allclose(path.position(path.length), [7.0, 0.0], atol=1e-9)
        with pytest.raises(InvalidInputError, match="length"):
            assess_data.path_of("r-path", 7.0)
        with pytest.raises(InvalidInputError, match="length"):
            assess_data.run(MATERIAL, 0.2, "r-path", FALL, 2.0)


class TestTwoWays:
    """Where the planned state is unstable it goes either way."""

    def test_it_starts_in_the_planned_unstable_state(self, ways: tuple[xr.Dataset, PostCriticalBranches, RPath]):
        _, found, plan = ways
        travelled = plan.path.pieces[1].end - 0.15
        problem, start = found.start
        model = problem.model
        assert start.lam == pytest.approx(travelled, abs=2e-3)
        assert start.negatives == 1
        assert not touches(model, start)
        grip = start.q[model.middle[0]] - [WAYS_LENGTH / 2.0, 0.0]
        np.testing.assert_allclose(grip, plan.path.position(start.lam), atol=1e-9)
        residual = problem.residual(start.q, start.lam)
        residual[problem.prescribed] = residual[start.active] = 0.0
        if model.slopes is None:
            assert np.abs(residual).max() < 1e-7
        s = np.linspace(0.0, WAYS_LENGTH, 200)
        away = model.resampled_mid_surface(start.q, s) - plan.mid_surface(travelled, s)
        assert np.linalg.norm(away, axis=1).max() < 0.2

    def test_the_strip_falls_to_either_side(self, ways: tuple[xr.Dataset, PostCriticalBranches, RPath]):
        """One touches near the planned place, the other comes to rest without a touch."""
        _, found, plan = ways
        down, up = found.branches
        assert (down.sign, up.sign) == (1.0, -1.0)
        for way in found.branches:
            assert {m.lam for m in way.motion.states} == {found.start[1].lam}
            np.testing.assert_array_equal(way.motion.states[0].q, found.start[1].q)
            last = way.motion.states[-1]
            assert last.energy.kinetic < 1e-6
            point = way.after.points[0]
            assert (point.lam, point.negatives) == (last.lam, 0)
            s = np.linspace(0.0, WAYS_LENGTH, 200)
            here, there = way.after.states[0][0].model, way.motion.problem.model
            moved = here.resampled_mid_surface(point.q, s) - there.resampled_mid_surface(last.q, s)
            assert np.abs(moved).max() < 0.04
            assert way.after.pieces[0] == 1
        np.testing.assert_allclose(down.motion.states[0].v, -up.motion.states[0].v, atol=1e-15)
        speed = np.linalg.norm(up.motion.states[0].v[up.motion.problem.model.middle], axis=1).max()
        assert speed == pytest.approx(FALL.disturbance)
        assert down.motion.touch is not None
        assert down.motion.touch_x == pytest.approx(2.71, abs=0.03)
        assert down.after.critical is None
        assert down.after.points[-1].lam == pytest.approx(plan.path.length)
        assert up.motion.touch is None
        assert np.isnan(up.motion.touch_x)
        model = up.motion.problem.model
        assert not any(touches(model, m) for m in up.motion.states)
        away = np.linalg.norm((up.motion.states[-1].q - found.start[1].q)[model.middle], axis=1).max()
        assert away > 0.1
        # It rested for a while, and its motion ended then.
        times = np.array([m.t for m in up.motion.states])
        quiet = times > times[-1] - fall.QUIET
        assert max(m.energy.kinetic for m, q in zip(up.motion.states, quiet, strict=True) if q) < 1e-6

    def test_a_strip_that_does_not_fall_rests_in_a_stable_state(self):
        """Newton's method went from the nodes on the floor to the unstable planned state, 1.4 L* away."""
        strip = StripModel(20.0, 0.05)
        plan = rpath.plan_r_path(strip.length)
        travelled = plan.path.pieces[1].end - 0.15
        problem, point = on_nodes(post_critical.planned_unstable(strip, plan, travelled))
        motion = fall.simulate_fall(
            fall.ReleaseState(problem, point, point.mode, 0.0), replace(FALL, disturbance=-1e-2)
        )
        rest_at = fall.at_rest(strip.contact_mesh(), motion)
        assert isinstance(rest_at, BranchPoint)
        assert rest_at.point.negatives == 0
        s = problem.model.s
        moved = rest_at.mid_surface(s) - problem.model.mid_surface(motion.states[-1].q)
        assert np.linalg.norm(moved, axis=1).max() < fall.SAME_STATE

    def test_a_slow_start_is_no_rest(self, ways: tuple[xr.Dataset, PostCriticalBranches, RPath]):
        """With damping that first takes nearly all of the disturbance the motion grows by 0.0018 per time unit."""
        _, found, _ = ways
        problem, point = found.start
        start = fall.ReleaseState(problem, point, point.mode, 0.0)
        motion = fall.simulate_fall(start, Fall(0.3, damping=Damping(5.0, 0.1), to_rest=False))
        assert motion.touch_x == pytest.approx(found.branches[0].motion.touch_x, abs=0.03)

    def test_stored(self, ways: tuple[xr.Dataset, PostCriticalBranches, RPath]):
        data, found, plan = ways
        unit = MATERIAL.gravity_length
        way, part, phase = (data[name].values for name in ("way", "part", "phase"))
        assert data["way"].attrs["units"] == "1"
        assert way.tolist() == sorted(way)
        for i, direction in enumerate(found.branches):
            assert set(part[way == i]) == {2 * i, 2 * i + 1}
            assert set(phase[part == 2 * i]) == {"fall"}
            assert set(phase[part == 2 * i + 1]) == {"static"}
            assert np.sum(part == 2 * i + 1) == len(direction.after.points)
            end = float(data["travelled"].values[way == i][-1])
            assert data.attrs["ends"][i] == pytest.approx(end)
        assert data.attrs["signs"] == [1.0, -1.0]
        assert data.attrs["reason"] == ""
        touch, no_touch = data.attrs["touch_x"]
        assert touch == pytest.approx(unit * found.branches[0].motion.touch_x)
        assert np.isnan(no_touch)
        assert data.attrs["landing_x"] == pytest.approx(unit * plan.landing)
        assert data.attrs["planned_touch_x"] == pytest.approx(unit * plan.first_touch)
        start = data.isel(state=0)
        place = plan.path.position(plan.path.pieces[1].end - 0.15) * unit
        assert [float(start["gripper_x"]), float(start["gripper_z"])] == pytest.approx(list(place), abs=1e-4)

    def test_a_short_strip_has_no_unstable_planned_state(self):
        data = post_critical.two_ways(MATERIAL, 13.0 * MATERIAL.gravity_length, FALL, 3.0)
        assert "no unstable planned state" in data.attrs["reason"]
        assert data.attrs["length"] == pytest.approx(13.0 * MATERIAL.gravity_length)
        assert data.attrs["eta_b"] == MATERIAL.eta_b
        assert not data.data_vars

    def test_a_state_that_is_not_the_planned_one_is_refused(
        self, ways: tuple[xr.Dataset, PostCriticalBranches, RPath], monkeypatch: pytest.MonkeyPatch
    ):
        _, _, plan = ways
        strip = StripModel(WAYS_LENGTH, MATERIAL.relative_thickness)
        travelled = plan.path.pieces[1].end - 0.15
        at = post_critical.planned_unstable(strip, plan, travelled)
        assert at.point.negatives == 1
        stable = post_critical.solve_height(strip, float(plan.path.position(travelled)[1]), 3.0)
        monkeypatch.setattr(post_critical, "_at", lambda *_: stable.points[0])
        monkeypatch.setattr(post_critical, "solved", lambda *_: stable.points[0])
        with pytest.raises(SolveError, match="not an unstable one"):
            post_critical.planned_unstable(strip, plan, travelled)


def test_a_pushed_strip_buckles_where_its_elements_are_to_be_planned_anew() -> None:
    """A gripper that rises by 6 degrees pushes the strip until it snaps; coarse elements are 0.02 L* late."""
    strip = StripModel(9.43299, 0.0950411, kind="solid")
    start = np.array([-0.5 * strip.length, 0.0])
    path = GripperPath("line", pieces_through([("line", np.array([start, start + np.array([3.0, 0.3149])]))]))
    found, finer = (assess_strip(strip, path, refinement=refinement) for refinement in (1.0, 0.7))
    assert [event.kind for event in found.events] == [SNAP]
    assert found.events[0].travelled == pytest.approx(finer.events[0].travelled, abs=0.05)


def test_a_pushed_strip_is_laid_down_without_a_snap() -> None:
    """At 45 degrees, on coarse elements as on fine ones."""
    for refinement in (2.0, 1.0):
        found = assess_strip(StripModel(9.0, THICKNESS), geometric.triangular(9.0), refinement=refinement)
        assert found.stable
        assert found.at_end
        assert found.contact == statics.MOVING
