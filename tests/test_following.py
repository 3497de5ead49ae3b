"""Statics along a gripper path: corners, contacts, its end and its critical point, against the planned elastica and the
runs along x."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise, takewhile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stripfold import elastica
from stripfold.analysis import advance, contact, path_statics, static
from stripfold.analysis.assess import grip_and_hold, lying_length, mesh_for
from stripfold.analysis.path_statics import StaticSegment
from stripfold.analysis.static import StripModel
from stripfold.errors import CoarseMeshError, ContinuationError, NewtonError, SolveError
from stripfold.paths import rpath, table
from stripfold.paths.curve import GripperPath, Piece
from stripfold.paths.rpath import RPath
from stripfold.problem import StripProblem
from stripfold.solve import continuation, critical, newton
from stripfold.solve.events import Crossing
from stripfold.solve.problem import Point
from studies import random_paths

STRIP = StripModel(12.0, 0.06)
THIN = StripModel(20.0, 0.01)
CORNERS = [(-6.0, 0.0), (-5.2, 1.2), (5.0, 1.2), (6.0, 0.0)]
"""Lower than where anything snaps: the sag is laid down."""


def polygon(*corners: tuple[float, float]) -> GripperPath:
    """Straight from corner to corner."""
    pieces: list[Piece] = []
    for ends in pairwise(corners):
        pieces.append(Piece.through(np.array(ends), pieces[-1].end if pieces else 0.0, "side"))
    return GripperPath("polygon", tuple(pieces))


PATH = polygon(*CORNERS)


def split(path: GripperPath, *at: float) -> GripperPath:
    """The same path with a corner more at each of the lengths travelled."""
    pieces: list[Piece] = []
    for piece in path.pieces:
        inside = [s for s in at if piece.start < s < piece.end]
        ends = [piece.start, *inside, piece.end]
        pieces += [replace(piece, start=a, end=b) for a, b in pairwise(ends)]
    return replace(path, pieces=tuple(pieces))


def along_x_path(begin: float, height: float, length: float) -> GripperPath:
    """A straight path of one piece at a constant height, from ``begin``."""
    piece = Piece(0.0, length, lambda s: np.array([begin + s, height]), lambda s: np.array([1.0, 0.0]), "x")
    return GripperPath("along x", (piece,))


def distance(segment: StaticSegment, a: Point, b: Point) -> float:
    """Largest distance between two mid-surfaces."""
    middle = segment.model.mid_surface
    return float(np.linalg.norm(middle(a.q) - middle(b.q), axis=1).max())


@pytest.fixture(scope="module")
def followed() -> StaticSegment:
    """A low path on which the strip is laid down without a snap."""
    return path_statics.follow(mesh_for(STRIP, PATH, 2.0), PATH)


@pytest.fixture(scope="module")
def plan() -> RPath:
    return rpath.plan_r_path(THIN.length)


@pytest.fixture(scope="module")
def planned(plan: RPath) -> StaticSegment:
    """A strip that is nearly the elastica, on the path planned for it."""
    return path_statics.follow(mesh_for(THIN, plan.path, 2.0), plan.path)


@pytest.fixture(scope="module")
def x_run() -> static.XRun:
    """Along x at a height that snaps, and past it."""
    return static.solve_height(StripModel(13.0, 0.06), 3.0, 1.0)


def started(run: static.XRun, path: GripperPath) -> Point:
    """The first state of a run along x as one of a path."""
    problem = path_statics.problem_on(run.problem.model, path, 0)
    first = run.points[0]
    return continuation.start(problem, first.q, 0.0, first.active, 1.0, path_statics.STEPS)


def assert_points_are_equilibria(segment: StaticSegment) -> None:
    """Each of its own problem, the gripper where the path says, pushed by the floor only, stable."""
    half = segment.model.length / 2.0
    for i, point in enumerate(segment.points):
        problem = segment.problem(i)
        grip, held = segment.model.middle[[0, -1]]
        np.testing.assert_allclose(point.q[grip] - [half, 0.0], segment.path.position(point.lam), atol=1e-9)
        assert np.all(point.q[held] == 0.0)
        residual = problem.residual(point.q, point.lam)
        assert residual[point.active].min() > -1e-7
        residual[problem.prescribed] = residual[point.active] = 0.0
        assert np.abs(residual).max() < 1e-6
        assert point.q[problem.bounded].min() >= -1e-12
        assert point.negatives == 0


def test_it_goes_through_equilibria_to_the_end(followed: StaticSegment) -> None:
    assert followed.critical is None
    assert_points_are_equilibria(followed)
    lam = np.array([point.lam for point in followed.points])
    assert lam[0] == path_statics.FIRST_HEIGHT
    assert lam[-1] == PATH.length
    assert len(followed.points) == len(followed.pieces)
    assert np.all(np.diff(lam) >= 0.0)
    assert followed.spurious_limit_points == 0
    np.testing.assert_allclose(followed.points[-1].q[followed.model.middle[0]], [STRIP.length, 0.0], atol=1e-9)


def test_a_corner_is_a_state_with_two_directions(followed: StaticSegment) -> None:
    grip = followed.model.middle[0]
    for i, corner in enumerate(PATH.corners):
        at = [k for k, point in enumerate(followed.points) if point.lam == corner]
        assert [followed.pieces[k] for k in at] == [i, i + 1]
        before, after = (followed.points[k] for k in at)
        np.testing.assert_allclose(before.q, after.q, atol=1e-7)
        for point, piece in ((before, i), (after, i + 1)):
            side = np.subtract(CORNERS[piece + 1], CORNERS[piece])
            assert point.tangent.lam > 0.0
            way = point.tangent.q[grip] / point.tangent.lam
            np.testing.assert_allclose(way, side / np.linalg.norm(side), atol=1e-9)
        # The tangent is that of the branch: a short way behind the corner the strip has moved along it.
        ds = 1e-4
        near = newton.solve(path_statics.problem_on(followed.model, PATH, i + 1), after.q, corner + ds, after.active)
        moved = (near.q - after.q)[followed.model.middle] / ds
        expected = (after.tangent.q / after.tangent.lam)[followed.model.middle]
        assert np.abs(moved - expected).max() < 0.02 * np.abs(expected).max()


def test_corners_that_are_none_change_nothing(followed: StaticSegment, monkeypatch: pytest.MonkeyPatch) -> None:
    """One just behind the first state, one on either side."""
    path = split(PATH, 0.02, 3.0, 12.5)
    along_piece = path_statics._along_piece

    def one_spurious_more(*given: object) -> tuple[object, ...]:
        points, found, folds = along_piece(*given)  # type: ignore[arg-type]
        return points, found, folds + 1

    monkeypatch.setattr(path_statics, "_along_piece", one_spurious_more)
    other = path_statics.follow(followed.model, path)
    assert other.spurious_limit_points == 6
    assert other.points[0].lam == 0.005
    assert sorted(set(other.pieces)) == [0, 1, 2, 3, 4, 5]
    assert_points_are_equilibria(other)
    for s in (*PATH.corners, PATH.length):
        a, b = (next(p for p in x.points if p.lam == s) for x in (followed, other))
        assert distance(followed, a, b) < 1e-6
    for s in (3.0, 12.5):
        ends = [p for p in other.points if p.lam == s]
        assert len(ends) == 2
        np.testing.assert_allclose(ends[0].tangent.q, ends[1].tangent.q, atol=1e-6)
        before = max((p for p in followed.points if p.lam < s), key=lambda p: p.lam)
        problem = followed.problem(followed.points.index(before))
        there = continuation.step_to(problem, before, s, path_statics.STEPS)
        assert distance(followed, there, ends[0]) < 1e-6


def test_a_table_of_a_path_is_the_path(followed: StaticSegment, tmp_path: Path) -> None:
    """Written in metres by hand; with another pseudo time."""
    unit = 0.03
    file = tmp_path / "path.csv"
    file.write_text("t,x,z\n" + "".join(f"{t**2},{unit * x},{unit * z}\n" for t, (x, z) in enumerate(CORNERS)))
    path = table.read(file, STRIP.length, unit)
    other = path_statics.follow(followed.model, path)
    assert other.critical is None
    assert other.points[-1].lam == pytest.approx(PATH.length, abs=1e-9)
    assert distance(followed, other.points[-1], followed.points[-1]) < 1e-6
    assert path.pseudo_time(other.points[-1].lam) == pytest.approx(9.0)


@pytest.mark.slow
def test_a_thin_strip_follows_its_plan(plan: RPath, planned: StaticSegment) -> None:
    """Truth: the elastica's states, up to where two states meet: there any thickness opens a gap between them."""
    # Except at spurious limit points, which are passed.
    stable = [i for i, point in enumerate(planned.points[:-1]) if not point.negatives]
    assert len(stable) > 0.85 * len(planned.points)
    assert planned.spurious_limit_points
    pieces = tuple(planned.pieces[i] for i in stable)
    assert_points_are_equilibria(replace(planned, points=tuple(planned.points[i] for i in stable), pieces=pieces))
    assert planned.critical is not None
    meets = planned.critical.lam
    found = [p for p in planned.points if p.lam < meets - 0.4]
    away = [
        np.linalg.norm(planned.model.mid_surface(p.q) - plan.mid_surface(p.lam, planned.model.s), axis=1).max()
        for p in found
    ]
    assert np.max(away) < 0.012
    assert planned.pieces[-1] == 1
    # A path of states touches the boundary, and the thin strip with it.
    x, z = plan.path.position(meets)
    assert x + THIN.length / 2.0 - elastica.critical(float(z)).advance == pytest.approx(0.0, abs=2e-3)


@pytest.mark.slow
def test_forces_and_lying_length_are_the_plans(plan: RPath, planned: StaticSegment) -> None:
    """The held end carries what the elastica's horizontal force is, the gripper its reaction and the rest's weight."""
    checked = 0
    corner = plan.path.corners[0]
    for i, point in enumerate(planned.points):
        nearest = int(np.argmin(np.abs(plan.travelled - point.lam)))
        state = plan.states[nearest]
        if planned.pieces[i] == 1 and corner < point.lam < planned.points[-1].lam - 1.0:
            assert lying_length(planned.model, point) == pytest.approx(plan.lying_length, abs=0.1)
        if abs(plan.travelled[nearest] - point.lam) > 0.02 or point.lam > planned.points[-1].lam - 1.0 or not nearest:
            continue
        grip, hold = grip_and_hold(planned.problem(i), point)
        elastica_state = state.parts[0][0]
        vertical = elastica_state.length - elastica_state.reaction
        assert grip == pytest.approx([-state.force_x, vertical], abs=0.06)
        assert hold == pytest.approx(state.force_x, abs=0.06)
        checked += planned.pieces[i]
    assert checked > 1
    assert min(grip_and_hold(planned.problem(i), p)[1] for i, p in enumerate(planned.points)) < -0.5


def test_constant_height_is_the_run_along_x(x_run: static.XRun) -> None:
    begin = x_run.lambda_0 - 6.5
    path = along_x_path(begin, 3.0, 10.0)
    segment = path_statics.follow(x_run.problem.model, path, started(x_run, path))
    assert x_run.critical is not None
    assert segment.critical is not None
    assert segment.critical.lam + x_run.lambda_0 == pytest.approx(x_run.critical.lam, abs=2e-6)
    assert segment.critical.width <= advance.LAMBDA_TOLERANCE
    assert segment.points[-1] is segment.critical.before
    assert all(p.lam <= segment.critical.upper for p in segment.points)
    assert distance(segment, segment.points[-1], x_run.last) < 0.01
    assert_points_are_equilibria(segment)
    assert segment.spurious_limit_points == x_run.spurious_limit_points


def test_a_touch_right_behind_the_maximum_is_not_spurious(x_run: static.XRun) -> None:
    """At this height the floor stops the sag 0.2 L* of arc behind it, and lambda rises again, higher, in 0.1 more."""
    assert x_run.critical is not None
    problem, before = x_run.problem, x_run.points[x_run.points.index(x_run.last) - 1]
    ahead = continuation.follow(problem, before, path_statics.STEPS)
    branch = list(takewhile(lambda p: p.arc - x_run.last.arc < advance.LOOK_AHEAD, ahead))
    risen = [p for p in branch if p.lam > x_run.critical.upper and not p.negatives]
    assert risen
    assert all(contact.touches(problem.model, p) for p in risen)
    points, found, folds = path_statics._along_piece(
        problem, before, 12.0, path_statics.STEPS, path_statics.LARGEST_SPURIOUS_MOVE
    )
    assert found is not None
    assert found.lam == pytest.approx(x_run.critical.lam, abs=2e-6)
    assert folds == 0
    assert not any(contact.touches(problem.model, p) for p in points)


def test_a_path_that_ends_before_the_critical_point(x_run: static.XRun) -> None:
    """The step in which it lies may reach both; what lies behind the end is not on the path."""
    assert x_run.critical is not None
    way = x_run.critical.lam - x_run.lambda_0
    path = along_x_path(x_run.lambda_0 - 6.5, 3.0, way - 1e-3)
    segment = path_statics.follow(x_run.problem.model, path, started(x_run, path))
    assert segment.critical is None
    assert segment.points[-1].lam == pytest.approx(path.length, abs=1e-12)


def test_an_unstable_state_is_not_taken_round_a_corner(x_run: static.XRun) -> None:
    unstable = next(p for p in x_run.points if p.negatives)
    path = split(along_x_path(-6.5, 3.0, 15.0), unstable.lam)
    with pytest.raises(SolveError, match="not stable at a corner"):
        path_statics.follow(x_run.problem.model, path, unstable)


def test_step_to(x_run: static.XRun) -> None:
    """Forwards, back, nowhere; on the unstable branch too."""
    problem = x_run.problem
    i = len(x_run.points) // 3
    point = x_run.points[i]
    for lam in (point.lam + 0.05, point.lam - 0.05, point.lam, point.lam + 0.5 * continuation.AT_VALUE):
        there = continuation.step_to(problem, point, lam, path_statics.STEPS)
        assert there.lam == lam
        assert there.negatives == 0
        assert there.tangent.lam > 0.0
        solved = newton.solve(problem, point.q, lam, point.active)
        np.testing.assert_allclose(there.q, solved.q, atol=1e-6)
    assert x_run.critical is not None
    # Well behind the maximum: on its top lambda has spurious limit points.
    before = next(p for p in x_run.points if p.negatives and p.tangent.lam < 0.0 and p.lam < x_run.critical.lam - 2e-3)
    down = continuation.step_to(problem, before, before.lam - 1e-4, path_statics.STEPS)
    assert down.lam == before.lam - 1e-4
    assert down.negatives == 1
    assert down.tangent.lam < 0.0
    assert down.arc > before.arc
    with pytest.raises(SolveError):
        continuation.step_to(problem, x_run.critical.before, x_run.critical.upper + 0.05, path_statics.STEPS)


def test_step_to_goes_round_a_failure(x_run: static.XRun, monkeypatch: pytest.MonkeyPatch) -> None:
    """A step that fails is made as a part of the branch, half as long; backwards there is nothing to be gained."""
    problem, point = x_run.problem, x_run.points[len(x_run.points) // 3]
    expected = continuation.step_to(problem, point, point.lam + 0.1, path_statics.STEPS)
    step, tried = continuation.step, []

    def short(problem: StripProblem, at: Point, ds: float, options: continuation.StepOptions) -> Point:
        tried.append(ds)
        if abs(ds) > 0.03:
            raise NewtonError("planted")
        return step(problem, at, ds, options)

    monkeypatch.setattr(continuation, "step", short)
    there = continuation.step_to(problem, point, point.lam + 0.1, path_statics.STEPS)
    assert there.lam == expected.lam
    np.testing.assert_allclose(there.q, expected.q, atol=1e-7)
    assert tried[1] == tried[0] / 2.0
    with pytest.raises(NewtonError, match="planted"):
        continuation.step_to(problem, point, point.lam - 0.1, path_statics.STEPS)


@pytest.mark.parametrize(("again", "folds"), [(0.2, 1), (0.45, 1), (0.9, None)])
def test_a_spurious_limit_point_is_passed_and_a_maximum_is_not(
    x_run: static.XRun, monkeypatch: pytest.MonkeyPatch, again: float, folds: int | None
) -> None:
    """A branch made up: lambda falls at arc 1 and is higher again, and stable, at an arc of 1 + ``again``."""
    problem, first = x_run.problem, x_run.points[0]
    begin = first.lam

    def at(arc: float) -> Point:
        unstable = 1.0 <= arc < 1.0 + again
        lam = begin + (1.0 - 0.1 * (arc - 1.0) if unstable else arc)
        slope = -0.1 if unstable else 1.0
        state = replace(first.state, lam=lam)
        return replace(first, state=state, arc=arc, tangent=replace(first.tangent, lam=slope), negatives=int(unstable))

    monkeypatch.setattr(continuation, "step", lambda _, point, ds, options: at(0.05 * (round(point.arc / 0.05) + 1)))
    monkeypatch.setattr(path_statics, "step_to", lambda problem, point, lam, options: point)
    located: list[tuple[Point, Point]] = []

    def locate(problem: StripProblem, before: Point, after: Point, *_: object) -> critical.CriticalPoint:
        located.append((before, after))
        return critical.CriticalPoint(before.lam, 0.0, 0.0, 0.0, True, before, after, first.mode, 0)

    monkeypatch.setattr(critical, "locate", locate)
    points, found, passed = path_statics._along_piece(problem, at(0.0), begin + 2.5, path_statics.STEPS, 0.05)
    if folds is None:
        ((before, after),) = located
        assert (before.arc, after.arc) == pytest.approx((0.95, 1.0))
        assert found is not None
        assert points[-1] is before
        assert len(points) == 20
    else:
        assert not located
        assert found is None
        assert passed == folds
        assert points[-1].lam == pytest.approx(begin + 2.45)


@pytest.mark.parametrize(("moved", "passed"), [(0.04, True), (0.06, False)])
def test_a_large_move_is_not_spurious(
    x_run: static.XRun, monkeypatch: pytest.MonkeyPatch, moved: float, passed: bool
) -> None:
    """The same branch made up, with a strip that goes some way from the maximum to where lambda is above it again."""
    problem, first = x_run.problem, x_run.points[0]
    top = problem.model.middle[len(problem.model.middle) // 4, 1]

    def at(arc: float) -> Point:
        unstable = 1.0 <= arc < 1.2
        lam = first.lam + (1.0 - 0.1 * (arc - 1.0) if unstable else arc)
        q = first.q.copy()
        q[top] += moved if arc >= 1.2 else 0.0
        state = replace(first.state, lam=lam, q=q)
        tangent = replace(first.tangent, lam=-0.1 if unstable else 1.0)
        return replace(first, state=state, arc=arc, tangent=tangent, negatives=int(unstable))

    monkeypatch.setattr(continuation, "step", lambda _, point, ds, options: at(0.05 * (round(point.arc / 0.05) + 1)))
    monkeypatch.setattr(path_statics, "step_to", lambda problem, point, lam, options: point)
    if passed:
        assert path_statics._along_piece(problem, at(0.0), first.lam + 2.5, path_statics.STEPS, 0.05)[2] == 1
    else:
        with pytest.raises(CoarseMeshError, match="snaps locally"):
            path_statics._along_piece(problem, at(0.0), first.lam + 2.5, path_statics.STEPS, 0.05)


def test_a_fold_differs_from_a_contact_that_opens_by_where_its_eigenvalue_would_be_zero() -> None:
    """Its square falls linearly before a fold: how large it still is at the last state found does not matter."""

    def at(lam: float, value: float) -> Any:
        return SimpleNamespace(lam=lam, eigenvalues=np.array([value, 99.0]))

    def near_fold(lam: float) -> Any:
        return at(lam, np.sqrt(3.4e5 * (1.0 - lam)))

    assert path_statics._to_zero(near_fold(1.0 - 4e-7), [near_fold(0.9), near_fold(0.99)]) == pytest.approx(4e-7)
    # The point itself may be the last one.
    last = near_fold(0.995)
    assert path_statics._to_zero(last, [near_fold(0.9), last]) == pytest.approx(0.005)
    assert path_statics._to_zero(at(1.0, 59.7), [at(0.99, 59.9)]) > 1.0
    assert path_statics._to_zero(at(1.0, 60.0), [at(0.99, 50.0)]) == np.inf
    assert path_statics._to_zero(at(1.0, 0.01), []) == np.inf


@pytest.mark.parametrize(
    ("height", "eigenvalues", "nearly"),
    [
        (0.5, (56.0, 9.0, 4.3, 6.2, 10.6), True),
        (0.5, (30.0, 19.0, 7.8, 16.6), True),
        (0.5, (30.0, 19.0, 10.5, 22.0), False),  # not near
        (0.5, (46.0, 9.8, 9.1, 10.6, 12.3), False),  # shallow: how a long strip's varies
        (0.5, (9.0, 4.3, 2.0), False),  # on its way down
        (0.8, (56.0, 9.0, 4.3, 6.2, 10.6), False),  # higher up
    ],
)
def test_an_almost_flat_strip_near_its_critical_point(
    height: float, eigenvalues: tuple[float, ...], nearly: bool
) -> None:
    """Its least eigenvalue dips towards zero, early on the path."""
    model: Any = SimpleNamespace(mid_surface=lambda q: np.array([[0.0, 0.0], [1.0, q]]))
    points: list[Any] = [SimpleNamespace(q=height, eigenvalues=np.array([value, 99.0])) for value in eigenvalues]
    assert (path_statics._near_critical_dip(model, points) is points[2]) is nearly
    assert path_statics._near_critical_dip(model, points[:2]) is None


def test_a_near_snap_on_coarse_elements_is_a_snap_on_fine_ones() -> None:
    """A thick strip whose gripper sets out low over the floor: on coarse elements it nearly snaps and goes on."""
    case = random_paths.case(16, 20180701)
    path = random_paths.as_table(case)
    with pytest.raises(CoarseMeshError, match="nearly snaps"):
        path_statics.follow(mesh_for(case.strip, path, 2.0), path)


def test_a_branch_that_ends(x_run: static.XRun, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before its maximum that is an error; behind it the critical point is known all the same."""
    problem = x_run.problem
    stable, unstable = (next(p for p in x_run.points if bool(p.negatives) is which) for which in (False, True))

    def ending(*points: Point | Crossing) -> Callable[..., object]:
        def follow(*_: object) -> object:
            yield from points
            raise ContinuationError("planted")

        return follow

    monkeypatch.setattr(continuation, "follow", ending(stable, stable))
    with pytest.raises(ContinuationError, match="planted"):
        advance.follow_to_event(problem, stable, [advance.LIMIT], path_statics.STEPS)
    crossing = Crossing(advance.LIMIT, stable, unstable)
    monkeypatch.setattr(continuation, "follow", ending(stable, crossing, unstable))
    located = critical.CriticalPoint(stable.lam, 0.0, 0.0, 0.0, True, stable, unstable, stable.mode, 0)
    monkeypatch.setattr(critical, "locate", lambda *_: located)
    found = advance.follow_to_event(problem, stable, [advance.LIMIT], path_statics.STEPS)
    assert found.critical is located
    assert found.points == (stable, unstable)
