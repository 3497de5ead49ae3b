"""A second gripper: lambda_c with it against a boundary value problem, the place that the mode tells, the study."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import stripfold as sf
from stripfold import elastica
from stripfold.ask.second_gripper import before_snap, hold, second_on_path, stable_advance
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import Material
from stripfold.elastica.half_fold import states_no_horizontal_force
from stripfold.follow.statics import StripModel
from stripfold.follow.track import End, Track
from stripfold.paths.curve import GripperPath, pieces_through
from stripfold.paths.geometric import circular, triangular
from stripfold.strip.problem import AlongX, TwoGrippers


def advance(run: Track, free: float) -> float:
    """The advance with this free length: the elastica of two spans, forces and lambda as parameters.

    A span is angle, curvature, X and Z over the arc length, from lift-off to the held place and from there on.
    """
    motion = run.last.problem.motion
    assert isinstance(motion, TwoGrippers)
    assert isinstance(motion.first, AlongX)
    height = motion.first.height
    spans = (free - motion.s, motion.s)

    def rates(t: Array, y: Array, p: Array) -> Array:
        rows = []
        for i, (span, before) in enumerate(zip(spans, (0.0, spans[0]), strict=True)):
            theta, k = y[4 * i], y[4 * i + 1]
            force_x, force_z = p[2 * i], p[2 * i + 1] + before + span * t
            rows += [k, force_x * np.sin(theta) - force_z * np.cos(theta), np.cos(theta), np.sin(theta)]
            rows[-4:] = [span * row for row in rows[-4:]]
        return np.array(rows)

    def ends(a: Array, b: Array, p: Array) -> Array:
        lam = p[4]
        held, grasped = (free - lam - motion.ahead - motion.s, height + motion.up), (free - lam, height)
        return np.array([*a[:4], *(b[2:4] - held), *(a[4:] - b[:4]), *(b[6:] - grasped), b[5]])

    t, arc = np.linspace(0.0, 1.0, 100), np.linspace(0.0, run.free_length, 2000)
    x, z = run.last.mid_surface(arc[::-1]).T
    theta = np.unwrap(np.arctan2(np.gradient(z), -np.gradient(x)))
    shape = (theta, np.gradient(theta, arc), x[0] - x, z)
    lower = run.free_length - motion.s
    y = [np.interp(at, arc, values) for at in (lower * t, lower + motion.s * t) for values in shape]
    force = run.last.point.state.force[motion.grasped(run.last.model)] * [-1.0, 1.0, -1.0, 1.0]
    guess = [*(force[:2] + force[2:]), *force[:2], run.lam] - run.free_length * np.array([0.0, 1.0, 0.0, 1.0, 0.0])
    found = solve_bvp(rates, ends, t, np.array(y), guess, tol=1e-5)
    assert found.success
    return float(found.p[4])


def test_lambda_c_with_two_grippers() -> None:
    """The maximum of lambda over the free length, by three of them, on a rod that hardly stretches."""
    unheld = before_snap(StripModel(27.0, 0.003, kind="rod"), 10.0, refinement=0.5)
    run = hold(unheld, 7.0)
    assert run.end is End.SNAP
    change = np.array([-0.02, 0.0, 0.02])
    a, b, c = np.polyfit(change, [advance(run, run.free_length + more) for more in change], 2)
    assert a < 0.0
    assert run.lam == pytest.approx(c - b**2 / (4.0 * a), abs=5e-5)
    assert run.lam > unheld.lam + 0.5


def test_both_models_agree() -> None:
    rod, solid = (hold(before_snap(StripModel(22.0, 0.03, kind=kind), 5.0), 2.0) for kind in ("rod", "solid"))
    assert rod.lam == pytest.approx(solid.lam, rel=1e-4)


def test_held_places_move_along_and_keep_their_distance() -> None:
    unheld = before_snap(StripModel(20.0, 0.03, kind="rod"), 3.0)
    s = np.array([0.0, unheld.place])
    run = hold(unheld, unheld.place)
    assert run.end is End.TOUCH
    for at in run.points:
        moved = at.mid_surface(s) - unheld.at.mid_surface(s)
        np.testing.assert_allclose(moved, [[at.point.lam - unheld.at.point.lam, 0.0]] * 2, atol=1e-10)
    assert run.lam > unheld.lam + 5.0


def test_a_snap_behind_the_touch() -> None:
    """Just before the lift-off the sag touches, and the strip snaps nevertheless, on five meshes; elsewhere not."""
    unheld = before_snap(StripModel(20.0, 0.06, kind="rod"), 3.0)
    runs = [hold(unheld, s) for s in (6.3, 5.3)]
    assert [run.end for run in runs] == [End.TOUCH] * 2
    (snap, first), (end, last) = (stable_advance(run) for run in runs)
    assert (first, last) == (End.SNAP, End.TOUCH)
    assert snap - unheld.lam == pytest.approx(0.415, abs=0.01)
    assert end == 20.0


@pytest.mark.parametrize("place", [0.0, -0.01, 1.27e-61, 1e-6, 0.4, "middle", True, float("nan")])
def test_no_such_place(place: object) -> None:
    with pytest.raises(InvalidInputError) as refused:
        sf.Strip(length=0.6, eta_b=3780.0).critical(0.09, model="rod", second_gripper=place)  # type: ignore[arg-type]
    assert refused.value.key.startswith("second_gripper")


PAPER = Material(3780.0)
UNIT = PAPER.gravity_length
LONG = sf.Strip(length=0.6, eta_b=3780.0)


@pytest.mark.parametrize("s", [1.0, 5.3])
def test_along_x_it_is_that_of_the_motion_along_x(s: float) -> None:
    """Lifted and carried on at constant height, the strip ends where the advance of `critical` does."""
    length, z, half = 20.0, 5.0, 10.0
    unheld = before_snap(StripModel(length, PAPER.relative_thickness, kind="rod"), z)
    run = hold(unheld, s)
    free = elastica.state_no_horizontal_force(z).length
    line = [(state.advance - half, state.gripper[1]) for state in states_no_horizontal_force(free)]
    carry = np.array([line[-1], (line[-1][0] + 15.0, z)])
    path = GripperPath("along x", pieces_through([("lift", np.array([(-half, 0.0), *line])), ("carry", carry)]))
    found = second_on_path(PAPER, UNIT * length, path, UNIT * s)
    assert found is not None
    assert found.snap is (run.end is End.SNAP)
    assert found.end_x / UNIT + half == pytest.approx(run.lam, abs=1e-3)
    assert found.gain / UNIT == pytest.approx(run.lam - unheld.lam, abs=1e-3)


@pytest.mark.parametrize("path", [triangular, circular])
def test_the_place_of_the_mode_lays_the_strip_down_and_one_near_the_gripper_does_not(
    path: Callable[[float], GripperPath],
) -> None:
    curve = path(LONG.length / UNIT)
    auto, near = (second_on_path(PAPER, LONG.length, curve, place) for place in ("auto", 0.03))
    assert auto is not None
    assert near is not None
    assert not auto.snap
    assert near.snap
    assert auto.gain > 5.0 * near.gain > 0.0
