"""Statics along a gripper path: corners, contacts, its end and its critical point, against the planned elastica and the
runs along x."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from stripfold import elastica
from stripfold.base.errors import SolveError
from stripfold.follow import contact_set, statics
from stripfold.follow.contact_branch import BranchPoint, solved
from stripfold.follow.contact_events import reaction
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel, follow
from stripfold.follow.track import SNAP, Track, grip_and_hold, lying_length
from stripfold.paths import rpath, table
from stripfold.paths.curve import GripperPath, Interpolated, Piece, pieces_through
from stripfold.paths.rpath import RPath
from stripfold.solve import continuation, newton
from stripfold.solve.problem import Point
from stripfold.strip.contact_mesh import FOLDED, LYING
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, StripProblem

STRIP = StripModel(12.0, 0.06)
ROD = replace(STRIP, kind="rod")
THIN = StripModel(20.0, 0.01)
CORNERS = [(-6.0, 0.0), (-5.2, 1.2), (5.0, 1.2), (6.0, 0.0)]
"""Lower than where anything snaps: the sag is laid down."""
S = np.linspace(0.0, 12.0, 241)


def polygon(*corners: tuple[float, float]) -> GripperPath:
    """Straight from corner to corner."""
    return GripperPath("polygon", pieces_through(("side", np.array(ends)) for ends in pairwise(corners)))


PATH = polygon(*CORNERS)


def split(path: GripperPath, *at: float) -> GripperPath:
    """The same path with a corner more at each of the lengths travelled."""
    pieces: list[Piece] = []
    for piece in path.pieces:
        inside = [s for s in at if piece.start < s < piece.end]
        ends = [piece.start, *inside, piece.end]
        pieces += [replace(piece, start=a, end=b) for a, b in pairwise(ends)]
    return replace(path, pieces=tuple(pieces))


def along(strip: StripModel, path: GripperPath) -> Track:
    """The path from the flat strip."""
    return follow(strip.contact_mesh(), path, strip.length)


def distance(a: tuple[StripProblem, Point], b: tuple[StripProblem, Point]) -> float:
    """Largest distance between two mid-surfaces of strips of 12 L*."""
    shapes = [problem.model.resampled_mid_surface(point.q, S) for problem, point in (a, b)]
    return float(np.linalg.norm(shapes[0] - shapes[1], axis=1).max())


@pytest.fixture(scope="module", params=["solid", "rod"])
def followed(request: pytest.FixtureRequest) -> Track:
    """A low path on which the strip is laid down without a snap."""
    return along(replace(STRIP, kind=request.param), PATH)


@pytest.fixture(scope="module")
def plan() -> RPath:
    return rpath.plan_r_path(THIN.length)


@pytest.fixture(scope="module")
def planned(plan: RPath) -> Track:
    """A strip that is nearly the elastica, on the path planned for it."""
    return along(THIN, plan.path)


@pytest.fixture(scope="module")
def x_run() -> statics.XRun:
    """Along x at a height that snaps, and past it."""
    return statics.solve_height(StripModel(13.0, 0.06, kind="rod"), 3.0, past=1.0)


def assert_points_are_equilibria(segment: Track, path: GripperPath) -> None:
    """The gripper where the path says, balanced off the floor, pushed by the floor in sum, nothing below it, stable."""
    for problem, point in segment.states:
        model = problem.model
        half = model.length / 2.0
        grip, held = model.middle[[0, -1]]
        np.testing.assert_allclose(point.q[grip] - [half, 0.0], path.position(point.lam), atol=1e-9)
        assert np.all(point.q[held] == 0.0)
        residual = problem.residual(point.q, point.lam)
        floor = np.isin(model.middle[:, 1], point.active)
        columns = np.repeat(floor | np.roll(floor, 1) | np.roll(floor, -1), model.size // len(floor))
        columns[problem.prescribed] = True
        assert np.abs(residual[~columns]).max() < 1e-6
        # Weight and forces of gripper, pin and floor are in balance.
        lifted = residual[model.middle[:, 1]]
        assert lifted.sum() == pytest.approx(model.length, abs=1e-4)
        assert point.q[problem.bounded].min() >= -2e-4
        assert point.negatives == 0


def test_it_goes_through_equilibria_to_the_end(followed: Track) -> None:
    assert followed.critical is None
    assert_points_are_equilibria(followed, PATH)
    lam = np.array([point.lam for point in followed.points])
    assert PATH.position(float(lam[0]))[1] == pytest.approx(statics.LOW, rel=1e-6)
    assert lam[-1] == PATH.length
    assert len(followed.points) == len(followed.pieces) < 100
    assert np.all(np.diff(lam) >= 0.0)
    problem, last = followed.states[-1]
    np.testing.assert_allclose(last.q[problem.model.middle[0]], [STRIP.length, 0.0], atol=1e-9)


def test_the_gripper_comes_down_to_the_folded_state(followed: Track) -> None:
    """Truth: the elastica's folded state, whose loop is the same at the end of every path."""
    assert followed.last is not None
    assert followed.last.topology == FOLDED
    end, lift_off = followed.last.contact
    loop = elastica.folded_loop()
    assert lift_off - end == pytest.approx(loop.arc, abs=1.3 * STRIP.thickness)
    grip, hold = grip_and_hold(*followed.states[-1])
    assert abs(hold) < 0.02
    assert abs(grip[0]) < 0.02
    # Shortly before, the part beside the gripper is a beam under its weight: (24 z)^(1/4) long.
    before = followed.points[-2]
    *_, height = PATH.position(before.lam)
    assert height == pytest.approx(statics.LOW, rel=1e-6)


def test_the_gripper_rises_again() -> None:
    """From the floor back to where it came from: without friction the states are those of the way down."""
    path = polygon(*CORNERS, CORNERS[2])
    there = along(ROD, path)
    assert there.critical is None
    ends = [i for i, point in enumerate(there.points) if point.lam == path.pieces[1].end]
    assert distance(there.states[-1], there.states[ends[0]]) < 1e-3


def test_a_corner_is_a_state_with_two_directions(followed: Track) -> None:
    for i, corner in enumerate(PATH.corners):
        at = [k for k, point in enumerate(followed.points) if point.lam == corner]
        assert [followed.pieces[k] for k in at] == [i, i + 1]
        before, after = (followed.states[k] for k in at)
        np.testing.assert_allclose(before[1].q, after[1].q, atol=1e-7)
        for (problem, point), piece in ((before, i), (after, i + 1)):
            side = np.subtract(CORNERS[piece + 1], CORNERS[piece])
            assert point.tangent.lam > 0.0
            way = point.tangent.q[problem.model.middle[0]] / point.tangent.lam
            np.testing.assert_allclose(way, side / np.linalg.norm(side), atol=1e-9)


def test_corners_that_are_none_change_nothing(followed: Track) -> None:
    """One just behind the first state, one on either side."""
    path = split(PATH, 0.02, 3.0, 12.5)
    kind = "solid" if followed.states[0][0].model.slopes is None else "rod"
    other = along(replace(STRIP, kind=kind), path)
    assert sorted(set(other.pieces)) == [0, 1, 2, 3, 4, 5]
    assert_points_are_equilibria(other, path)
    for s in (*PATH.corners, PATH.length):
        a, b = (next(state for state in x.states if state[1].lam == s) for x in (followed, other))
        assert distance(a, b) < 1e-3
    for s in (3.0, 12.5):
        ends = [p for p in other.points if p.lam == s]
        assert len(ends) == 2
        np.testing.assert_allclose(ends[0].point.tangent.q, ends[1].point.tangent.q, atol=1e-6)


def test_a_table_of_a_path_is_the_path(followed: Track, tmp_path: Path) -> None:
    """Written in metres by hand; with another pseudo time."""
    unit = 0.03
    file = tmp_path / "path.csv"
    file.write_text("t,x,z\n" + "".join(f"{t**2},{unit * x},{unit * z}\n" for t, (x, z) in enumerate(CORNERS)))
    path = table.read(file, STRIP.length, unit)
    kind = "solid" if followed.states[0][0].model.slopes is None else "rod"
    other = along(replace(STRIP, kind=kind), path)
    assert other.critical is None
    assert other.points[-1].lam == pytest.approx(PATH.length, abs=1e-9)
    assert distance(other.states[-1], followed.states[-1]) < 1e-6
    assert path.pseudo_time(other.points[-1].lam) == pytest.approx(9.0)


@pytest.mark.slow
def test_a_thin_strip_follows_its_plan(plan: RPath, planned: Track) -> None:
    """Truth: the elastica's states, up to where two states meet: there any thickness opens a gap between them."""
    assert_points_are_equilibria(planned, plan.path)
    assert planned.critical is not None
    meets = planned.critical.lam
    s = np.linspace(0.0, THIN.length, 401)
    away = [
        np.linalg.norm(problem.model.resampled_mid_surface(p.q, s) - plan.mid_surface(p.lam, s), axis=1).max()
        for problem, p in planned.states
        if p.lam < meets - 0.4
    ]
    assert np.max(away) < 0.012
    assert planned.pieces[-1] == 1
    # A path of states touches the boundary, and the thin strip with it.
    x, z = plan.path.position(meets)
    assert x + THIN.length / 2.0 - elastica.critical(float(z)).advance == pytest.approx(0.0, abs=2e-3)


@pytest.mark.slow
def test_forces_and_lying_length_are_the_plans(plan: RPath, planned: Track) -> None:
    """The held end carries what the elastica's horizontal force is, the gripper its reaction and the rest's weight."""
    checked = 0
    corner, last = plan.path.corners[0], planned.points[-1].lam
    for (problem, point), piece in zip(planned.states, planned.pieces, strict=True):
        nearest = int(np.argmin(np.abs(plan.travelled - point.lam)))
        state = plan.states[nearest]
        if piece == 1 and corner < point.lam < last - 1.0:
            assert lying_length(problem, point) == pytest.approx(plan.lying_length, abs=0.01)
        if abs(plan.travelled[nearest] - point.lam) > 0.02 or point.lam > last - 1.0 or not nearest:
            continue
        grip, hold = grip_and_hold(problem, point)
        elastica_state = state.parts[0][0]
        vertical = elastica_state.length - elastica_state.reaction
        assert grip == pytest.approx([-state.force_x, vertical], abs=0.06)
        assert hold == pytest.approx(state.force_x, abs=0.06)
        checked += piece
    assert checked
    assert min(grip_and_hold(*state)[1] for state in planned.states) < -0.5


def level(run: statics.XRun, end: float) -> tuple[BranchPoint, GripperPath]:
    """A run along x as a path: its first state, and the path."""
    half = run.last.model.length / 2.0
    first = run.branch[0]
    ends = np.array([[first.lam - half, 3.0], [end - half, 3.0]])
    piece = Interpolated.through(ends, first.lam, "x")
    problem = MovingContact(first.problem.mesh, AlongPath(piece, 2.0 * half))
    return solved(problem, first.point.q, first.lam), GripperPath("along x", (piece,))


def test_constant_height_is_the_run_along_x(x_run: statics.XRun) -> None:
    first, path = level(x_run, 12.0)
    segment = follow(StripModel(13.0, 0.06, kind="rod").contact_mesh(), path, 13.0, first)
    assert x_run.critical is not None
    assert segment.critical is not None
    assert segment.critical.lam == pytest.approx(x_run.critical.lam, abs=2e-4)
    assert segment.critical.width <= statics.LAMBDA_TOLERANCE
    assert segment.last.point is segment.critical.before
    assert segment.last.contact == pytest.approx(x_run.last.contact, abs=0.02)
    assert all(p.lam <= segment.critical.upper for p in segment.points)
    assert_points_are_equilibria(segment, path)


def test_a_path_that_ends_before_the_critical_point(x_run: statics.XRun) -> None:
    """However little: the step that finds the limit point passes the end."""
    assert x_run.critical is not None
    first, path = level(x_run, x_run.critical.lam - 0.01)
    segment = follow(StripModel(13.0, 0.06, kind="rod").contact_mesh(), path, 13.0, first)
    assert segment.critical is None
    assert segment.points[-1].lam == path.length
    assert segment.last.point.negatives == 0


def test_a_sag_between_two_contacts() -> None:
    """An upper layer that is let down twice: the strip touches in three places."""
    path = polygon(*CORNERS[:3], (4.0, 0.2), (5.0, 1.2), (2.0, 0.5))
    segment = along(ROD, path)
    assert segment.critical is None
    assert segment.points[-1].lam == path.length
    lam = np.array([p.lam for p in segment.points])
    assert np.all(np.diff(lam) >= 0.0)
    assert_points_are_equilibria(segment, path)


def test_a_whole_strip_off_the_floor() -> None:
    """Pulled up until nothing lies, and let down again."""
    path = polygon((-6.0, 0.0), (2.0, 10.9), (5.0, 11.2), (2.0, 9.0))
    segment = along(ROD, path)
    assert segment.critical is None
    assert segment.points[-1].lam == path.length
    lies = [lying_length(*state) for state in segment.states]
    assert min(lies) == 0.0
    assert lies[-1] > 0.3
    assert segment.last.topology == LYING
    assert_points_are_equilibria(segment, path)


@pytest.mark.parametrize("kind", ["rod", "solid"])
def test_a_strip_a_little_too_short_loses_its_stability_where_it_lifts(kind: str) -> None:
    """A run along x ends where nothing lies: that is the critical point."""
    strip = StripModel(6.5, 0.02, kind=kind)
    run = statics.solve_height(strip, 3.0)
    assert run.end is statics.End.LIFTED
    path = polygon((-3.25, 0.0), (-1.25, 3.0), (6.75, 3.0))
    segment = along(strip, path)
    assert segment.critical is not None
    x, _ = path.position(segment.critical.lam)
    assert x + 3.25 == pytest.approx(run.lam, abs=strip.thickness)


def test_a_state_at_nodes_and_back(followed: Track) -> None:
    """Truth: the state itself; its contact coordinates are found again from the nodes on the floor."""
    kind = "solid" if followed.states[0][0].model.slopes is None else "rod"
    strip = replace(STRIP, kind=kind)
    for end in (PATH.corners[1], PATH.length - 0.5):
        path = replace(PATH, pieces=(*PATH.pieces[:-1], replace(PATH.pieces[-1], end=end)))
        if end == PATH.corners[1]:
            path = replace(PATH, pieces=PATH.pieces[:-1])
        at = along(strip, path).last
        problem, point = contact_set.on_nodes(at)
        settled = newton.solve(problem, point.q, at.point.lam, point.active, options=contact_set.ROBUST_NEWTON)
        state = continuation.evaluate(problem, settled, point.tangent)
        back = contact_set.from_nodes(strip.contact_mesh(), problem, state)
        assert back.topology == at.topology
        assert back.contact == pytest.approx(at.contact, abs=0.01)


def test_a_stable_state_at_nodes_is_not_taken_for_the_unstable_one_beside_it(x_run: statics.XRun) -> None:
    """Just before a limit point the two are nearer to each other than to the same one on other elements."""
    problem, point = contact_set.on_nodes(x_run.last, stable=True)
    assert not point.negatives
    with pytest.raises(SolveError, match="no such state"):
        contact_set.from_nodes(ROD.contact_mesh(), problem, point)


def test_contacts_that_no_state_has_are_refused(x_run: statics.XRun) -> None:
    problem, point = x_run.points[0].problem.on_mesh(x_run.points[0].point)
    model = problem.model
    three = StripProblem(ROD.model(48), problem.motion)
    lying = three.model.middle[[10, 40, -2], 1]
    q = model.resampled(point.q, three.model.s)
    state = replace(point, state=replace(point.state, q=q, active=lying))
    with pytest.raises(SolveError):
        contact_set.from_nodes(ROD.contact_mesh(), three, state)


def test_the_tangent_on_fixed_nodes_is_the_way_of_the_strip(x_run: statics.XRun) -> None:
    """Nodes move with the lift-off; on a fixed mesh the direction is the difference of two states."""
    at = x_run.points[3]
    problem, point = contact_set.on_nodes(at)
    ahead = continuation.step_to(at.problem, at.point, at.point.lam + 1e-3, statics.STEPS)
    shapes = [
        state.model.resampled_mid_surface(state.u, problem.model.s) for state in (BranchPoint(at.problem, ahead), at)
    ]
    moved = (shapes[0] - shapes[1]) / 1e-3
    truth = (point.tangent.q / point.tangent.lam)[problem.model.middle]
    np.testing.assert_allclose(moved, truth, atol=0.02)


@pytest.mark.parametrize("kind", ["solid", "rod"])
def test_a_sag_lifted_off_the_floor_loses_its_stability(kind: str, tmp_path: Path) -> None:
    """Below the touch limit the floor holds the sag; higher up the strip is unstable without it.

    Truth: the floor's push is used up in the last state, and lambda is the other model's.  The boundary is where no
    push is left: it is normal to the gradient of the push by the gripper's place.
    """
    file = tmp_path / "path.csv"
    file.write_text("t,x,z\n0,-8,0\n1,-7.2,1.4\n2,1,1.4\n3,2,8\n")
    strip = StripModel(16.0, 0.05, kind=kind)
    path = table.read(file, strip.length, 1.0)
    found = assess_strip(strip, path)
    (event,) = found.events
    assert found.critical is not None
    assert found.critical.lam == pytest.approx(10.618, abs=1e-3)
    assert found.critical.width < 1e-6
    last = found.last
    lam = last.point.lam - 0.02
    piece = path.pieces[-1]

    def push(moved: np.ndarray) -> float:
        place = piece.position(lam) + moved
        held = Interpolated.through(place + np.array([[0.0, 0.0], [1.0, 0.0]]), 0.0, "from there on")
        problem = MovingContact(last.problem.mesh, AlongPath(held, strip.length))
        return reaction(problem, solved(problem, last.point.q, 0.0).point, 0)

    normal = [(push(d) - push(-d)) / 2e-3 for d in 1e-3 * np.eye(2)]
    sine = abs(normal @ piece.rate(lam)) / np.linalg.norm(normal)
    assert event.angle == pytest.approx(np.degrees(np.arcsin(sine)), abs=4.0)
    assert event.kind == SNAP
    for problem, point in found.states:
        floor = np.setdiff1d(point.active, problem.prescribed)
        assert problem.residual(point.q, point.lam)[floor].min(initial=0.0) > -0.02
        assert point.negatives == 0


def test_a_gripper_that_ends_just_above_the_floor_has_landed() -> None:
    """Below the lowest height at which a state is computed."""
    corners = np.array([(-7.0, 0.0), (-6.2, 1.2), (6.0, 1.2), (7.0, 0.5 * statics.LOW)])
    path = GripperPath("polygon", pieces_through(("side", np.array(ends)) for ends in pairwise(corners)))
    last = follow(StripModel(14.0, 0.05, kind="rod").contact_mesh(), path, 14.0).last
    assert last is not None
    assert last.topology == FOLDED
