"""Gripper paths: plans, geometry, and tables of a user's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.optimize import minimize_scalar

from stripfold import Strip, elastica, paths
from stripfold.ask.assess import PathAssessment
from stripfold.ask.inputs import Simulation
from stripfold.base.errors import InvalidInputError
from stripfold.follow.contact_branch import STEPS
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel
from stripfold.follow.track import SNAP, End, forces_of, peak_forces, shape_error
from stripfold.paths import geometric, rpath
from stripfold.paths import table as path_table
from stripfold.paths.curve import GripperPath, Interpolated, pieces_through
from stripfold.paths.motion import timed
from stripfold.paths.rpath import RPath, plan_r_path


@pytest.fixture(scope="module")
def plan() -> RPath:
    return rpath.plan_r_path(20.0)


def test_triangular() -> None:
    path = geometric.triangular(4.0)
    np.testing.assert_allclose(path.position(0.0), [-2.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(path.position(path.corners[0]), [0.0, 2.0], atol=1e-15)
    np.testing.assert_allclose(path.position(path.length), [2.0, 0.0], atol=1e-15)
    assert path.length == pytest.approx(4.0 * np.sqrt(2.0))
    np.testing.assert_allclose(path.pieces[0].rate(1.0), np.sqrt([0.5, 0.5]), atol=1e-12)
    assert path.pseudo_time(path.corners[0]) == pytest.approx(0.5)


def test_circular() -> None:
    path = geometric.circular(4.0)
    s, places = path.sampled(0.1)
    np.testing.assert_allclose(np.linalg.norm(places, axis=1), 2.0, atol=1e-12)
    assert path.length == pytest.approx(2.0 * np.pi)
    rates = np.array([path.pieces[0].rate(float(value)) for value in s])
    np.testing.assert_allclose(np.gradient(places, s, axis=0)[1:-1], rates[1:-1], atol=1e-3)
    np.testing.assert_allclose(path.position(path.length), [2.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("height", [0.1, 1.2, 5.0])
def test_low(height: float) -> None:
    """Lifted and laid down where there is no horizontal force, and straight between."""
    path = geometric.low(20.0, height)
    advance = elastica.state_no_horizontal_force(height).advance
    np.testing.assert_allclose(path.position(0.0), [-10.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(path.position(path.corners[0]), [advance - 10.0, height], atol=1e-9)
    np.testing.assert_allclose(path.position(path.corners[1]), [10.0 - advance, height], atol=1e-9)
    np.testing.assert_allclose(path.position(path.length), [10.0, 0.0], atol=1e-12)
    lower = elastica.state_no_horizontal_force(0.4 * height)
    x, z = path.sampled(1e-3)[1].T
    at = np.searchsorted(z[: z.argmax()], lower.gripper[1])
    assert x[at] == pytest.approx(lower.advance - 10.0, abs=2e-3)
    np.testing.assert_allclose(x, -x[::-1], atol=1e-9)


@pytest.mark.parametrize(("length", "first_touch"), [(7.3, 3.2541), (10.0, 2.6355), (20.0, 2.6255), (60.0, 2.6255)])
def test_r_path_ends_in_the_half_fold(length: float, first_touch: float) -> None:
    plan = rpath.plan_r_path(length)
    assert plan.lying_length == pytest.approx(length / 2.0 - 1.099425, abs=1e-6)
    assert plan.landing == pytest.approx(3.584045, abs=1e-6)
    np.testing.assert_allclose(plan.path.position(0.0), [-length / 2.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(plan.path.position(plan.path.length), [length / 2.0, 0.0], atol=1e-12)
    assert [piece.name for piece in plan.path.pieces] == ["lift", "carry", "roll", "lay"]
    assert plan.first_touch == pytest.approx(first_touch, abs=1e-4)
    assert plan.path.sampled(0.05)[1][:, 1].min() > -1e-9


def test_the_planned_states_are_on_the_path(plan: RPath) -> None:
    for s, state in zip(plan.travelled, plan.states, strict=True):
        np.testing.assert_allclose(plan.path.position(float(s)), state.gripper, atol=1e-9)
        if s <= plan.path.pieces[0].end and state.lying_length > plan.lying_length + 1e-9:
            assert state.force_x == pytest.approx(0.0, abs=1e-10)
        else:
            assert state.lying_length == pytest.approx(plan.lying_length, abs=1e-9)
    steps = np.diff([state.gripper for state in plan.states], axis=0)
    assert np.linalg.norm(steps, axis=1).max() < 0.7


def test_r_path_is_tangent_to_the_stability_boundary(plan: RPath) -> None:
    """It touches lambda_c(z) at one point and does not cross it."""
    carry = plan.path.pieces[1]

    def beyond(s: float) -> float:
        x, z = carry.position(s)
        return float(x + 10.0 - elastica.critical(float(z)).advance)

    s = np.linspace(carry.start, carry.end, 40)
    top = int(np.argmax([beyond(value) for value in s]))
    found = minimize_scalar(lambda s: -beyond(s), bounds=(s[top - 1], s[top + 1]), method="bounded")
    assert beyond(found.x) == pytest.approx(0.0, abs=1e-6)
    # Tangency: the distance grows quadratically, to both sides.
    for side in (-1.0, 1.0):
        near, far = (beyond(found.x + side * distance) for distance in (0.2, 0.4))
        assert near < 0.0
        assert near / far == pytest.approx(0.25, abs=0.03)


@pytest.mark.parametrize("length", [7.0, 7.23, -3.0, float("nan"), 101.0])
def test_no_r_path_of_this_length(length: float) -> None:
    with pytest.raises(InvalidInputError, match="length"):
        rpath.plan_r_path(length)


def test_corners(plan: RPath) -> None:
    s, places = plan.path.sampled(0.3)
    assert set(np.round(plan.path.corners, 9)) <= set(np.round(s, 9))
    assert np.diff(s).max() <= 0.3 + 1e-12
    assert len(places) == len(s)


def test_table_and_back(plan: RPath, tmp_path: Path) -> None:
    target = tmp_path / "r.csv"
    written, spacing = plan.path.scaled(0.03), 0.05 * 0.03
    target.write_text(path_table.as_text(written, spacing, ("R-path",)), encoding="utf-8")
    assert len(target.read_text(encoding="utf-8").splitlines()) == len(path_table.rows(written, spacing)) + 2
    found = path_table.read(target, 20.0, 0.03)
    assert len(found.pieces) == 3  # no change of direction between roll and lay
    s, places = plan.path.sampled(0.2)
    for travelled, place in zip(s, places, strict=True):
        t = plan.path.pseudo_time(float(travelled))
        back = float(np.interp(t, found.stamps[1], found.stamps[0]))  # type: ignore[index]
        np.testing.assert_allclose(found.position(back), place, atol=1e-5)
        assert found.pseudo_time(back) == pytest.approx(t)


def table(tmp_path: Path, *rows: str, header: str = "t,x,z") -> Path:
    path = tmp_path / "own.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("length", [8.3, 15.0, 26.0])
@pytest.mark.parametrize("make", [geometric.triangular, geometric.circular, lambda length: geometric.low(length, 1.0)])
def test_slopes_are_those_of_the_places_behind_the_end_too(make: Callable[[float], GripperPath], length: float) -> None:
    """A branch is followed through the end of a piece; on the floor a path is on it exactly."""
    path = make(length)
    for piece in path.pieces:
        for s in (piece.end - 0.01, piece.end + 0.01):
            slope = (piece.position(s + 1e-5) - piece.position(s - 1e-5)) / 2e-5
            np.testing.assert_allclose(piece.rate(s), slope, atol=1e-6)
    assert path.position(0.0)[1] == 0.0
    assert 0.0 <= path.position(path.length)[1] < 1e-14


@pytest.mark.parametrize("count", [2, 3, 4, 5, 40])
def test_spline_of_uneven_points(count: int) -> None:
    """As scipy's, between its knots and beyond them."""
    rng = np.random.default_rng(count)
    travelled, points = np.cumsum(rng.uniform(0.02, 1.0, count)), rng.normal(size=(count, 2))
    piece, expected = Interpolated.through(points, 0.0, "own"), make_interp_spline(travelled, points, min(3, count - 1))
    piece = replace(piece, travelled=travelled)
    for s in np.linspace(travelled[0] - 0.01, travelled[-1] + 0.01, 97):
        assert piece.position(s) == pytest.approx(expected(s), rel=1e-9, abs=1e-9)
        assert piece.rate(s) == pytest.approx(expected(s, 1), rel=1e-8, abs=1e-8)
    assert [list(piece.position(s)) for s in travelled] == points.tolist()


def test_a_spline_that_is_kept_above_the_floor_is_level_there() -> None:
    """Between rows at the floor a cubic dips below it, and behind its end, too."""
    points = np.array([[0.0, 0.3], [0.1, 0.1], [0.2, 0.0], [0.3, 0.0], [0.4, 0.2], [0.5, 0.0]])
    piece = replace(Interpolated.through(points, 0.0, "carry"), above_floor=True)
    s = np.linspace(0.0, piece.end + 0.05, 200)
    below = s[np.array([piece.position(float(at))[1] for at in s]) == 0.0]
    assert below.min() < piece.travelled[3] < piece.end < below.max()
    for s in below[1:-1].tolist():
        slope = (piece.position(s + 1e-5) - piece.position(s - 1e-5)) / 2e-5
        np.testing.assert_allclose(piece.rate(s), slope, atol=1e-6)


def test_own_path_with_times_and_a_pause(tmp_path: Path) -> None:
    path = path_table.read(
        table(tmp_path, "5,-0.30001,0", "6,-0.2,0.1", "7,-0.2,0.1", "9,0,0.2", "10,0.1,0.1"), 20.0, 0.03
    )
    assert len(path.pieces) == 3  # a slight turn at the second row, and the apex
    assert path.position(0.0).tolist() == [-10.0, 0.0]  # rounding at the start is removed
    assert path.pseudo_time(0.0) == 0.0  # after the first row
    assert path.pseudo_time(path.length) == 5.0
    np.testing.assert_allclose(path.position(path.corners[-1]), [0.0, 0.2 / 0.03], atol=1e-9)


@pytest.mark.parametrize(
    ("rows", "header", "key"),
    [
        ((), "t,x,z", "header t,x,z and 2"),
        (("0,-0.3,0",), "t,x,z", "2 to"),
        (("0,-0.3,0", "1,0,0.2"), "time,x,z", "header t,x,z"),
        (("0,-0.3,0", "1,0"), "t,x,z", "3 entries"),
        (("0,-0.3,0", "1,zero,0.2"), "t,x,z", "numbers"),
        (("0,-0.3,0", "1,nan,0.2"), "t,x,z", "finite numbers.*row 3"),
        (("0,-0.3,0", "1,0,5e156", "2,0.1,0.1"), "t,x,z", r"finite numbers from -1e\+30 to 1e\+30.*row 3"),
        (("-1.7e308,-0.3,0", "1.7e308,0,0.2"), "t,x,z", "row 2"),
        (("0,-0.3,0", "1,0,0.2", "1,0.1,0.1"), "t,x,z", "row 4"),
        (("0,-0.2,0", "1,0,0.2"), "t,x,z", r"start at \(-0.3, 0\) m"),
        (("0,-0.3,0", "1,0,0.2", "2,0.1,-0.01"), "t,x,z", "the floor"),
        (("0,-0.3,0", "1,-0.3,0.2"), "t,x,z", "the strip's length"),
        (("0,-0.3,0", "1,-0.3,0"), "t,x,z", "two different places"),
        (("0,-300,0", "1,0,200"), "t,x,z", "start at"),
    ],
)
def test_bad_tables(tmp_path: Path, rows: tuple[str, ...], header: str, key: str) -> None:
    with pytest.raises(InvalidInputError, match=key):
        path_table.read(table(tmp_path, *rows, header=header), 20.0, 0.03)


def test_path_below_the_floor_between_its_rows(tmp_path: Path) -> None:
    z = [0.0, 0.0005, 0.002, 0.0005, 0.0, 0.0, 0.0005, 0.003]
    rows = [f"{i},{-0.3 + 0.02 * i},{value}" for i, value in enumerate(z)]
    with pytest.raises(InvalidInputError, match="between the rows"):
        path_table.read(table(tmp_path, *rows), 20.0, 0.03)


def test_no_such_table(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="path"):
        path_table.read(tmp_path / "none.csv", 20.0, 0.03)


def test_stable_up_to_the_fold_below_the_touch_limit() -> None:
    """The push is the elastica's, the fold that of the R-path, up to the square of the thickness."""
    strip = StripModel(14.0, 0.02, kind="rod")
    found = assess_strip(strip, geometric.low(strip.length, 0.7))
    assert found.stable
    assert found.end is End.PATH
    assert shape_error(*found.states[-1], plan_r_path(strip.length)) < 2e-3
    push = -min(state.force_x for state in elastica.x_axis_branch(0.7, max_step=0.05))
    assert peak_forces(forces_of(found.states))[1] == pytest.approx(push, rel=0.02)


@pytest.mark.parametrize("eta_b", [2500.0, 3000.0, 3780.0])
def test_no_snap_of_the_mesh_below_the_touch_limit(eta_b: float) -> None:
    """At 1.22, 1.30 and 1.40 L*, on the default solid and its other mesh."""
    strip = Strip(length=0.5, eta_b=eta_b)
    found = strip.assess(paths.low(strip, 0.042))
    assert (found.stable, found.mesh_dependence) == (True, "")


def test_a_snap_above_the_touch_limit() -> None:
    strip = StripModel(14.0, 0.02, kind="rod")
    path = geometric.low(strip.length, 1.65)
    found = assess_strip(strip, path)
    (event,) = found.events
    assert event.kind == SNAP
    x, z = path.position(event.travelled)
    assert z == pytest.approx(1.65)
    assert x + 7.0 == pytest.approx(elastica.critical(1.65).advance, abs=0.01)
    slope = (elastica.critical(1.66).advance - elastica.critical(1.64).advance) / 0.02
    assert event.angle == pytest.approx(np.degrees(np.arctan(1.0 / slope)), abs=0.5)


class TestThinStrips:
    """What thickness hides: a strip that buckles where it is pushed, and branches that are near each other."""

    @pytest.mark.parametrize("kind", ["rod", "solid"])
    def test_a_path_that_pushes_from_its_start(self, kind: str) -> None:
        """A thin strip buckles at once, onto the branch of the thicker ones: it is lost where they are."""
        path = geometric.triangular(16.4)
        thick = assess_strip(StripModel(16.4, 0.01, kind="rod"), path)
        thin = assess_strip(StripModel(16.4, 1.5e-3, kind=kind), path, refinement=1.0 if kind == "solid" else 0.5)
        assert thin.events[0].travelled == pytest.approx(thick.events[0].travelled, abs=2e-3)

    def test_a_step_that_would_lead_to_another_branch_is_shortened(self) -> None:
        """On its R-path the sag of a solid as thin as its elements' error goes over to either side: both are lost."""
        path = rpath.plan_r_path(17.26).path
        lost = [
            assess_strip(StripModel(17.26, 5.5e-3, 0.06), path, refinement=refinement).events[0].travelled
            for refinement in (1.0, 0.5)
        ]
        assert lost[1] == pytest.approx(18.81, abs=0.02)
        assert lost[0] == pytest.approx(19.49, abs=0.02)

    def test_the_comparison_of_elements_sees_both_sides_of_a_bifurcation(self) -> None:
        strip = Strip(length=0.4266, eta_b=3780.0, eta_m=1.28e-5)
        (event,) = strip.assess(paths.r_path(strip), model="solid").critical
        assert 0.01 < abs(event["change"]) < 0.02

    def test_a_thin_strip_is_a_rod_unless_the_solid_is_asked_for(self) -> None:
        """The rod is where the solid comes to with finer elements."""
        given = {"length": 0.4266, "eta_b": 3780.0, "eta_m": 1.28e-5}
        strip = Strip(**given)
        path = paths.r_path(strip)
        (event,), (solid,) = strip.assess(path).critical, strip.assess(path, model="solid").critical
        assert event["z"] == pytest.approx(strip.assess(path, model="rod").critical[0]["z"], abs=1e-6)
        assert abs(event["change"]) < 1e-3 < abs(solid["change"])
        assert Simulation(**given, height=0.09).model == "rod"
        assert Simulation(**given, height=0.09, model="solid").model == "solid"
        assert Simulation(**given | {"eta_m": 1e-3}, height=0.09).model == "solid"


def pushed(folder: Path, table: str, **strip: float) -> PathAssessment:
    """A strip with its falls on a path whose low gripper pushes until what lies buckles."""
    (folder / "pushes.csv").write_text(f"t,x,z\n{table}", encoding="utf-8")
    made = Strip(eta_b=3780.0, **strip)
    found = made.assess(paths.read(folder / "pushes.csv", made), model="rod", fall=True)
    assert found.critical[0]["kind"] == "compression"
    return found


def test_a_ruck_that_ends_at_the_held_end_is_no_error(tmp_path: Path) -> None:
    """It runs to the pinned end and lifts the strip there."""
    table = "0,-0.183250,0\n0.333333,-0.150615,0.002572\n0.666667,-0.125799,0.112638\n1,-0.020857,0.011236\n"
    assert not pushed(tmp_path, table, length=0.3664993806260266, eta_m=8.637368334576566e-05).stable


def test_the_row_that_is_farthest_from_where_it_can_be_is_named(tmp_path: Path) -> None:
    """Straight up every row is beyond the strip's reach, by micrometres at first."""
    file = tmp_path / "up.csv"
    file.write_text("t,x,z\n" + "".join(f"{n},-0.2,{0.03 * n}\n" for n in range(8)) + "8,0,0.1\n", encoding="utf-8")
    with pytest.raises(InvalidInputError, match=r"within 0.4 m.* \(row 9 of up.csv\); it is 52 mm beyond"):
        paths.read(file, Strip(length=0.4, eta_b=3770.0))


def test_a_ruck_on_a_smooth_table_has_no_place(tmp_path: Path) -> None:
    """Without friction it is in balance wherever it lies: statics do not go on from there."""
    table = "0,-0.3524,0\n1,-0.2242,0.0283\n2,0.2095,0.0283\n3,0.2879,0.0006\n"
    found = pushed(tmp_path, table, length=0.7048, eta_m=1.3e-4)
    assert found.failure.startswith("the strip rests with a ruck")


class TestEndOfAPath:
    """Just before its end a path may come down: what happens in its last step counts."""

    def test_a_touch_in_the_last_step(self) -> None:
        """It is where shorter steps find it; behind the end the gripper would be below the sag."""
        path, strip = geometric.circular(7.5), StripModel(7.5, 0.0594, kind="rod")
        steps = STEPS, replace(STEPS, largest=0.06, max_attempts=1000)
        touches = [assess_strip(strip, path, options=options).touch for options in steps]
        assert all(touches)
        places = [touch.travelled for touch in touches if touch]
        assert places[0] == pytest.approx(places[1], abs=1e-4)
        assert 0.07 < path.length - places[0] < 0.1

    @pytest.mark.parametrize("kind", ["rod", "solid"])
    @pytest.mark.parametrize("back", [0.002, 0.1])
    def test_a_strip_that_is_laid_down_where_it_lay(self, kind: str, back: float) -> None:
        """Up and down again: what is off the floor shrinks to nothing, and the statics end before it is gone."""
        corners = np.array([[-4.0, 0.0], [-3.7, 0.36], [back - 4.0, 0.0]])
        path = GripperPath("up and down", pieces_through([("up", corners[:2]), ("down", corners[1:])]))
        found = assess_strip(StripModel(8.0, 0.036, kind=kind), path)
        assert found.end is End.FLAT
        problem, last = found.states[-1]
        assert problem.model.mid_surface(last.q)[:, 1].max() < 2e-3
        assert path.length - last.lam < 2e-3

    def test_a_gripper_that_dips_to_the_floor_as_it_starts_goes_on(self) -> None:
        """As in a robot's log with noise."""
        start = np.array([[-4.0, 0.0], [-3.999, 2e-3], [-3.998, 6e-4], [-3.997, 3e-3]])
        fold = np.array([start[-1], [0.0, 4.0], [4.0, 0.0]])
        path = GripperPath("log", pieces_through([("start", start), ("up", fold[:2]), ("down", fold[1:])]))
        found = assess_strip(StripModel(8.0, 0.036, kind="rod"), path)
        assert found.end is End.PATH
        assert found.touch

    @pytest.mark.parametrize(("kind", "refinement"), [("solid", 1.0), ("rod", 0.35)])
    def test_a_gripper_that_lands_beside_a_flat_layer_loses_nothing(self, kind: str, refinement: float) -> None:
        """The layer lies down when the gripper is nearly on the floor, and so up to it."""
        strip = StripModel(7.4 if kind == "solid" else 7.75, 0.0594 if kind == "solid" else 0.01, kind=kind)
        found = assess_strip(strip, geometric.circular(strip.length), refinement=refinement)
        assert found.end is End.PATH


class TestMotion:
    """When the gripper is where, within limits."""

    @pytest.mark.parametrize(("jerk", "reached"), [(2.0, 1.0), (0.1, 0.2**0.5)])
    def test_a_line_takes_the_least_time(self, jerk: float, reached: float) -> None:
        """Closed forms: with the full speed and acceleration S / v + v / a + a / j; short of both 4 (S / 2 j)^(1/3)."""
        s = np.linspace(0.0, 3.0, 301)
        motion = timed(s, np.column_stack([s, 0.0 * s]), speed=1.0, acceleration=1.0, jerk=jerk)
        least = 3.0 + 1.0 + 1.0 / jerk if jerk > 1.0 else 4.0 * (3.0 / (2.0 * jerk)) ** (1.0 / 3.0)
        assert least <= motion.t[-1] < least * (1.0002 if jerk > 1.0 else 1.6)
        assert motion.speed.max() <= reached or jerk < 1.0
        np.testing.assert_allclose(motion.lam(0.5 * float(motion.t[-1])), 1.5, atol=1e-6)
        rise = np.diff(motion.speed) / np.diff(motion.t)
        middle = 0.5 * (motion.t[1:] + motion.t[:-1])
        apart = np.linspace(0.0, motion.t[-1], 200)
        assert np.abs(np.diff(np.interp(apart, middle, rise)) / apart[1]).max() < 1.02 * jerk

    @pytest.mark.parametrize("jerk", [None, 1.0, 5.0, 50.0])
    def test_bends_and_corners(self, jerk: float | None) -> None:
        """Up, around a quarter of a circle of 5 cm, down, a corner, and on: each limit is kept, with the bend's."""
        turn = np.linspace(0.0, 0.5 * np.pi, 80)[1:-1]
        arc = np.column_stack([0.05 * (1.0 - np.cos(turn)), 0.2 + 0.05 * np.sin(turn)])
        up, on = np.linspace(0.0, 0.2, 200), np.linspace(0.05, 0.3, 200)
        down = np.linspace(0.25, 0.1, 200)[1:]
        rows = [[0.0 * up, up], arc.T, [on, 0.25 + 0.0 * on], [0.3 + 0.0 * down, down]]
        places = np.concatenate([np.column_stack(row) if i != 1 else arc for i, row in enumerate(rows)])
        s = np.append(0.0, np.cumsum(np.hypot(*np.diff(places, axis=0).T)))
        motion = timed(s, places, speed=0.2, acceleration=0.5, jerk=jerk)
        corner = s[np.flatnonzero((places == [0.3, 0.25]).all(axis=1))[0]]
        assert np.interp(corner, motion.travelled, motion.speed) == pytest.approx(0.0, abs=1e-12)
        assert motion.speed.max() <= 0.2 * (1.0 + 1e-9)
        middle = 0.5 * (motion.travelled[1:] + motion.travelled[:-1])
        along = np.diff(motion.speed) / np.diff(motion.t)
        towards = np.interp(middle, motion.travelled, motion.speed) ** 2 / 0.05
        in_bend = (middle > 0.2) & (middle < 0.2 + 0.025 * np.pi)
        assert np.hypot(along, np.where(in_bend, towards, 0.0)).max() <= 0.5 * (1.0 + 1e-3)
        assert motion.when(s) == pytest.approx([0.0, *(m for m in motion.when(s)[1:])])
        assert [motion.lam(float(t)) for t in motion.when(s)[::37]] == pytest.approx(s[::37].tolist(), abs=1e-9)
