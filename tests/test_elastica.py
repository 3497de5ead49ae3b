"""The heavy elastica against independent numbers, shooting and itself, half folds too (docs/physics.md, section 4)."""

from __future__ import annotations

from itertools import pairwise
from math import inf

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from oracles.elastica import assert_equilibrium, shoot
from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError, SolveError
from stripfold.base.material import GRAVITY, Material
from stripfold.elastica import _system as system
from stripfold.elastica import half_fold, textile
from stripfold.elastica._chebyshev import grid
from stripfold.elastica.state import State

HEIGHTS = (0.3, 1.0, 1.6, 3.0, 10.0, 30.0)


def crosses_itself(state: elastica.State) -> bool:
    """Whether two segments of a polygon through the curve cross."""
    profile = state.at(np.linspace(0.0, state.length, 401))
    points = profile.x + 1j * profile.z
    start, end = points[:-1, None], points[1:, None]
    side = np.sign(((end - start).conj() * (points - start)).imag)  # of each segment (row), each point (column)
    apart = side[:, :-1] * side[:, 1:] < 0
    return bool(np.triu(apart & apart.T, k=2).any())


class TestNumbers:
    """Values computed by an independent code."""

    def test_critical_point_at_three(self):
        point = elastica.critical(3.0)
        assert point.snap
        np.testing.assert_allclose(
            [point.advance, point.length, point.x], [9.856908, 7.133077, -2.723831], atol=1e-6, rtol=0
        )

    def test_touch_limit(self):
        limit = elastica.touch_limit()
        assert limit == pytest.approx(1.58617085, abs=1e-8)
        assert elastica.critical(limit + 1e-6).snap
        assert not elastica.critical(limit - 1e-6).snap

    def test_folded_loop(self):
        loop = elastica.folded_loop()
        found = [
            loop.height,
            loop.arc,
            loop.lift_off_reaction,
            loop.landing_reaction,
            loop.bulge,
            loop.offset,
        ]
        expected = [0.906597, 4.683470, 3.745005, 0.938465, 0.757252, 2.484620]
        np.testing.assert_allclose(found, expected, atol=1e-6, rtol=0)

    def test_folded_loop_by_shooting(self):
        loop = elastica.folded_loop()

        def vertical_tangent(s, y):
            return np.cos(y[2])

        def horizontal_tangent(s, y):
            return np.sin(y[2]) if s > 0.1 else 1.0

        run = shoot(loop.state, events=[vertical_tangent, horizontal_tangent])
        np.testing.assert_allclose(run.y[:, -1], [-loop.offset, 0.0, np.pi, 0.0], atol=1e-8)
        assert run.y_events[0][:, 0].max() == pytest.approx(loop.bulge, abs=1e-9)
        assert run.y_events[1][:, 1].max() == pytest.approx(loop.height, abs=1e-9)

    def test_the_folded_loop_is_the_root_without_self_intersection(self):
        second = textile._loop(1.732, 6.663)
        assert second.height == pytest.approx(1.5548, abs=1e-4)
        assert crosses_itself(second.state)
        assert not crosses_itself(elastica.folded_loop().state)

    def test_state_without_horizontal_force_when_high(self):
        for z in (15.0, 30.0, 100.0):
            state = elastica.state_no_horizontal_force(z)
            assert state.gripper[0] == pytest.approx(2.036812, abs=1e-6)
            assert state.reaction == pytest.approx(1.202702, abs=1e-6)
            assert state.force_x == 0.0

    def test_state_without_horizontal_force_when_low(self):
        # Beam theory; its relative error falls with the square of the slope, that is with z^1.5.
        errors = [elastica.state_no_horizontal_force(z).length / (24 * z) ** 0.25 - 1 for z in (4e-3, 1e-3)]
        assert abs(errors[1]) < 1e-4
        assert errors[0] / errors[1] == pytest.approx(8.0, rel=0.02)

    def test_cantilever(self):
        """Peirce's angle of the cantilever test of fabrics."""
        assert np.degrees(elastica.cantilever(2.000350).droop_angle) == pytest.approx(41.5, abs=1e-4)

    def test_material_from_the_fold(self):
        assert elastica.eta_b_from_fold_height(1.0) == pytest.approx(0.075958, abs=1e-6)
        for eta_b in (800.0, 1e5):
            height = elastica.folded_loop().height * Material(eta_b, gravity=9.7).gravity_length
            assert elastica.eta_b_from_fold_height(height, 9.7) == pytest.approx(eta_b, rel=1e-12)

    def test_half_fold(self):
        loop = elastica.folded_loop()
        lying = elastica.half_fold_lying_length(12.0)
        assert lying == pytest.approx(6.0 - 1.099425, abs=1e-6)
        # Aligned edges: lying layer = offset behind lift-off + upper layer.
        assert lying == pytest.approx(loop.offset + (12.0 - lying - loop.arc), abs=1e-12)


class TestState:
    @pytest.mark.parametrize("z", [0.3, 1.0, 1.6, 3.0, 5.0])
    def test_shooting_reproduces_the_gripper(self, z):
        state = elastica.critical(z).state
        assert_equilibrium(state)
        assert state.gripper[1] == pytest.approx(z, abs=1e-9)
        assert abs(state.curvature[-1]) < 1e-9

    @pytest.mark.parametrize("z", [10.0, 30.0, 100.0])
    def test_pieces_of_long_states_by_shooting(self, z):
        # Errors of shooting grow by exp(sqrt(F) l).
        state = elastica.critical(z).state
        places = np.linspace(0.0, state.length, int(state.length) + 1)
        assert state.gripper[1] == pytest.approx(z, abs=1e-9)
        assert abs(state.curvature[0]) + abs(state.curvature[-1]) < 1e-9
        for span in pairwise(places.tolist()):
            np.testing.assert_allclose(shoot(state, span).y[:, -1], state.at(span[1])[1:], atol=1e-7, rtol=0)

    def test_interpolation(self):
        state = elastica.critical(3.0).state
        s = np.linspace(0.0, state.length, 37)
        run = shoot(state, t_eval=s)
        found = state.at(s)
        np.testing.assert_allclose([found.x, found.z, found.theta, found.curvature], run.y, atol=1e-9)
        assert state.at([[0.0, 1.0]]).x.shape == (1, 2)
        assert state.at(1.0).z.shape == ()

    @pytest.mark.parametrize("z", [0.3, 1.6, 3.0, 20.0])
    def test_sag_is_the_lowest_point(self, z):
        state = elastica.critical(z).state
        s = np.linspace(0.0, state.length, 20001)
        profile = state.at(s)
        behind = int(np.argmax(profile.theta >= np.pi))
        lowest = behind + int(np.argmin(profile.z[behind:]))
        assert state.sag is not None
        assert state.clearance == pytest.approx(profile.z[lowest], abs=1e-6)
        assert state.sag.s == pytest.approx(s[lowest], abs=2 * s[1])
        assert np.sin(state.at(state.sag.s).theta) == pytest.approx(0.0, abs=1e-11)


class TestBranch:
    @pytest.mark.parametrize("z", HEIGHTS)
    def test_from_no_force_past_the_maximum(self, z):
        states = list(elastica.x_axis_branch(z))
        advance = np.array([state.advance for state in states])
        top = int(np.argmax(advance))
        assert states[0].force_x == 0.0
        assert np.all(np.diff(advance[: top + 1]) > 0)
        assert advance[-1] < advance[top] - 0.5 <= advance[-2]
        for state in states:
            assert state.gripper[1] == pytest.approx(z, abs=1e-10)
            assert state.reaction > 0
            assert state.first_integral_error < 1e-9

    def test_short_and_long_steps_follow_the_same_branch(self):
        for state in list(elastica.x_axis_branch(2.0, max_step=0.05))[20::6]:
            if state.length > 2.7:
                assert elastica.state_at(2.0, state.length).advance == pytest.approx(state.advance, abs=1e-9)


class TestCritical:
    @pytest.mark.parametrize("z", [1.6, 3.0, 10.0, 60.0])
    def test_advance_is_stationary_and_largest(self, z):
        point = elastica.critical(z)
        h = 1e-3
        sides = [elastica.state_at(z, point.length + d, guess=point.state).advance for d in (-h, h)]
        slope, bend = (sides[1] - sides[0]) / (2 * h), (sides[0] - 2 * point.advance + sides[1]) / h**2
        assert bend < -0.5
        assert abs(slope) < 1e-5
        # Richardson extrapolation of the central difference.
        wide = [elastica.state_at(z, point.length + d, guess=point.state).advance for d in (-2 * h, 2 * h)]
        assert abs((4 * slope - (wide[1] - wide[0]) / (4 * h)) / 3) < 1e-9

    def test_it_is_the_first_maximum(self):
        advance = np.array([state.advance for state in elastica.x_axis_branch(3.0, max_step=0.05)])
        assert elastica.critical(3.0).advance >= advance.max()
        assert elastica.critical(3.0).advance < advance.max() + 1e-2

    @pytest.mark.parametrize("z", [0.1, 0.3, 0.9, 1.5])
    def test_low_grippers_touch_first(self, z):
        point = elastica.critical(z)
        assert not point.snap
        assert np.isnan([point.advance, point.length, point.x, point.clearance]).all()
        state = point.state
        assert state.clearance == pytest.approx(0.0, abs=1e-10)
        contact = state.at(state.sag.s)
        assert contact.theta == pytest.approx(np.pi, abs=1e-9)
        assert contact.x < 0.0
        assert state.at(np.linspace(1e-3, 1.0, 500) * state.length).z.min() > -1e-9
        # On the branch, before the maximum.
        assert elastica.state_at(z, state.length).advance == pytest.approx(state.advance, abs=1e-8)
        longer = elastica.state_at(z, state.length + 1e-3, guess=state)
        assert longer.advance > state.advance
        assert longer.clearance < 0.0

    def test_over_the_height(self):
        low, *snaps = [elastica.critical(z) for z in (1.0, 1.6, 3.0, 20.0)]
        assert not low.snap
        assert np.isnan([low.advance, low.length, low.x]).all()
        for point in snaps:
            assert point.snap
            assert point.advance == pytest.approx(point.length - point.x, abs=1e-13)
        assert np.all(np.diff([point.advance for point in snaps]) > 0)


class TestErrors:
    @pytest.mark.parametrize("z", [0.0, -1.0, np.nan, np.inf, 0.05, 101.0, "three", None])
    def test_heights(self, z):
        for function in (elastica.critical, elastica.x_axis_branch, lambda v: elastica.state_at(v, 5.0)):
            with pytest.raises(InvalidInputError, match=r"^z = .* allowed: .* from 0.1 to 100"):
                function(z)

    @pytest.mark.parametrize(
        ("function", "key"),
        [
            (lambda: elastica.state_no_horizontal_force(0.0), "z"),
            (lambda: elastica.state_at(3.0, np.nan), "length"),
            (lambda: elastica.state_at(3.0, 2.0), "length"),
            (lambda: elastica.state_at(3.0, 50.0), "length"),
            (lambda: elastica.x_axis_branch(3.0, past=0.0), "past"),
            (lambda: elastica.x_axis_branch(3.0, max_step=-1.0), "max_step"),
            (lambda: elastica.cantilever(0.0), "length"),
            (lambda: elastica.cantilever(1e3), "length"),
            (lambda: elastica.eta_b_from_fold_height(0.0), "height_m"),
            (lambda: elastica.eta_b_from_fold_height(1.0, "g"), "gravity"),
            (lambda: elastica.half_fold_lying_length(7.1), "strip_length"),
            (lambda: elastica.state_no_horizontal_force(3.0).at(9.0), "s"),
            (lambda: elastica.state_no_horizontal_force(3.0).at(np.nan), "s"),
            (lambda: elastica.state_no_horizontal_force(3.0).at("a"), "s"),
        ],
    )
    def test_other_input(self, function, key):
        with pytest.raises(InvalidInputError, match=rf"^{key} = .* allowed: ") as caught:
            function()
        assert caught.value.key == key


CONDITIONS = {
    "lambda_0": (*system.gripper_at(2.0), system.fixed(system.FORCE_X, 0.0)),
    "length": (*system.gripper_at(2.0), system.fixed(system.LENGTH, 4.0)),
    "folded": (system.fixed(system.FORCE_X, 0.0), system.no_lift_off_moment, system.end_angle(np.pi)),
}


def residual(e, conditions):
    return system.residual(e, [condition(e)[0] for condition in conditions])


def jacobian(e, conditions):
    return system.jacobian(e, [condition(e)[1] for condition in conditions])


@pytest.mark.parametrize("conditions", CONDITIONS.values(), ids=CONDITIONS)
def test_jacobian_is_the_derivative_of_the_residual(conditions):
    rng = np.random.default_rng(7)
    y = np.concatenate([rng.normal(size=24), [0.4, -1.3, 3.1]])
    direction, h = rng.normal(size=27), 1e-5
    sides = [residual(system.evaluate(y + d * direction), conditions) for d in (-h, h)]
    slope = jacobian(system.evaluate(y), conditions) @ direction
    # Row by row: the norm is dominated by the equilibrium rows and would hide a wrong side condition.
    np.testing.assert_allclose((sides[1] - sides[0]) / (2 * h), slope, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("z", [0.3, 3.0, 30.0])
def test_refined_grid_gives_the_same_state(z):
    state = elastica.critical(z).state
    conditions = (*system.gripper_at(z), system.fixed(system.LENGTH, state.length))
    n = state.s.size
    finer = State._from(system.newton(system.refine(state._unknowns(), n + n // 3), conditions))
    s = np.linspace(0.0, state.length, 101)
    np.testing.assert_allclose(finer.at(s).theta, state.at(s).theta, atol=1e-9)
    np.testing.assert_allclose(finer.at(s).curvature, state.at(s).curvature, atol=1e-9)
    assert finer.advance == pytest.approx(state.advance, abs=1e-9)
    assert finer.force_x == pytest.approx(state.force_x, abs=1e-9)


def test_too_few_nodes_are_detected():
    state = elastica.critical(3.0).state
    conditions = (*system.gripper_at(3.0), system.fixed(system.LENGTH, state.length))
    coarse = system.newton(system.refine(state._unknowns(), 24), conditions)
    assert abs(State._from(coarse).advance - state.advance) > 1e-9
    assert coarse.tail > system.TOLERANCE
    assert system.solve(coarse.y, conditions).grid.n > 48


def test_newton_converges_quadratically():
    state = elastica.state_at(3.0, 6.0)
    conditions = (*system.gripper_at(3.0), system.fixed(system.LENGTH, 6.02))
    y = state._unknowns()
    solution = system.newton(y, conditions).y
    y[system.LENGTH] = 6.02
    errors = []
    for _ in range(3):
        errors.append(np.abs(system.angle_change(y - solution)).max())
        e = system.evaluate(y)
        y = y + system.solved(jacobian(e, conditions), -residual(e, conditions))
    assert errors[0] > 1e-3
    assert errors[2] < 10 * errors[1] ** 2 + 1e-13
    assert errors[1] < 10 * errors[0] ** 2


STEP = 0.02
THIRD = np.array([1.0, -8.0, 13.0, 0.0, -13.0, 8.0, -1.0]) / (8.0 * STEP**3)
"""Third derivative to fourth order, from seven places."""


def lagrangian(shape: Array, z: float, advance: float) -> float:
    """Energy of any angles and length with the gripper's forces as multipliers; stationary at an equilibrium."""
    *theta, force_x, force_0, length = shape
    g = grid(len(theta))
    slope = np.linalg.lstsq(length * (g.integral - g.integral[0]), np.array(theta) - theta[0], rcond=None)[0]
    x, rise = (length * g.integral @ f(theta) for f in (np.cos, np.sin))
    energy = length * g.integral[-1] @ (0.5 * slope**2 + rise)
    gaps = force_x * (x[-1] - length + advance) + (force_0 + length) * (rise[-1] - z)
    return float(energy - gaps)


@pytest.mark.parametrize("z", [2.0, 7.0])
def test_coefficient_by_the_third_derivative_of_the_energy(z: float) -> None:
    """The energy along the mode is c t^3 / 6 - d (lambda_c - lambda) t."""
    found = elastica.bistable_range(z)
    assert found is not None

    def unknowns(length: float) -> Array:
        state = elastica.state_at(z, length, found.critical)
        return np.array([*state.theta, state.force_x, state.force_0, state.length])

    length = found.critical.length
    at, ahead, behind = (unknowns(length + ds) for ds in (0.0, 1e-3, -1e-3))
    mode = (ahead - behind) / 2e-3
    c = THIRD @ [lagrangian(at + k * STEP * mode, z, found.critical.advance) for k in range(-3, 4)]
    d = mode[-3]
    assert found.coefficient == pytest.approx(4.0 * np.sqrt(2.0) / 3.0 * abs(d) ** 1.5 / np.sqrt(abs(c)), rel=1e-5)


def test_pairs_and_the_ends_of_the_range() -> None:
    found = elastica.bistable_range(3.0)
    assert found is not None
    assert found.landing.clearance == pytest.approx(0.0, abs=1e-9)
    top = found.critical.advance
    for distance in (1e-6, 1e-3, found.width):
        stable, unstable = found.pair(top - distance)
        assert stable.length < found.critical.length < unstable.length
        assert unstable.clearance > -1e-9
        for state in (stable, unstable):
            assert state.advance == pytest.approx(top - distance, abs=1e-10)
            assert state.gripper[1] == pytest.approx(3.0, abs=1e-10)
            assert state.first_integral_error < 1e-8
        assert found.barrier(top - distance) == pytest.approx(found.coefficient * distance**1.5, rel=3e-4)
    assert found.barrier(top) == 0.0
    assert found.barrier(top - 1.01 * found.width) == inf
    with pytest.raises(InvalidInputError, match="advance"):
        found.pair(top)
    assert elastica.bistable_range(1.2) is None


OFFSET = 1.099425
"""Free length of a half fold beyond half the strip, L*: docs/physics.md, section 4."""


def test_lift_without_horizontal_force() -> None:
    states = list(half_fold.states_no_horizontal_force(6.0))
    assert states[-1].length == pytest.approx(6.0, abs=1e-12)
    assert states[0].length == half_fold.SHORTEST
    assert all(state.force_x == pytest.approx(0.0, abs=1e-12) for state in states)
    assert np.all(np.diff([state.gripper[1] for state in states]) > 0.0)
    assert max(np.diff([state.length for state in states])) <= half_fold.SPACING + 1e-12
    for state in states[::7]:
        assert_equilibrium(state, atol=1e-8)
        assert state.curvature[-1] == pytest.approx(0.0, abs=1e-9)
    known = elastica.state_no_horizontal_force(states[-1].gripper[1])
    assert known.length == pytest.approx(6.0, abs=1e-9)


@pytest.mark.parametrize("length", [7.3, 12.0])
def test_fixed_lift_off_ends_at_first_contact(length: float) -> None:
    free = length / 2.0 + OFFSET
    states = list(half_fold.states_fixed_lift_off(free))
    assert states[0].force_x == pytest.approx(0.0, abs=1e-10)
    assert all(state.length == pytest.approx(free, abs=1e-12) for state in states)
    assert all(state.clearance > 0.0 for state in states[:-1])
    assert states[-1].clearance == pytest.approx(0.0, abs=1e-9)
    # The strip is compressed on the way.
    assert min(state.force_x for state in states) < -0.9
    for state in states[::5]:
        assert_equilibrium(state, atol=1e-8)


@pytest.mark.parametrize("length", [7.3, 12.0, 60.0])
def test_point_contact_ends_in_the_folded_loop(length: float) -> None:
    free = length / 2.0 + OFFSET
    *_, touch = half_fold.states_fixed_lift_off(free)
    states = list(half_fold.states_point_contact(touch))
    first, last = states[0], states[-1]
    assert first.reaction == pytest.approx(0.0, abs=1e-8)
    np.testing.assert_allclose(first.gripper, touch.gripper, atol=1e-8)
    loop = elastica.folded_loop()
    assert last.loop.length == pytest.approx(loop.arc, abs=1e-9)
    assert last.loop.gripper[0] == pytest.approx(-loop.offset, abs=1e-9)
    assert last.loop.force_x == pytest.approx(0.0, abs=1e-9)
    assert np.all(np.diff([state.reaction for state in states]) > 0.0)
    for state in states:
        assert state.loop.length + state.upper.length == pytest.approx(free, abs=1e-10)
        assert state.loop.z[-1] == pytest.approx(0.0, abs=1e-10)
        assert min(state.loop.z.min(), state.upper.z.min()) > -1e-9
    if length < 20.0:  # longer parts cannot be shot through
        for state in states[::4]:
            assert_equilibrium(state.loop, atol=1e-8)
            bend = float(state.upper.curvature[0])
            assert bend == pytest.approx(float(state.loop.curvature[-1]), abs=1e-9)
            assert_equilibrium(state.upper, (np.pi, bend), atol=1e-8)
            assert state.upper.curvature[-1] == pytest.approx(0.0, abs=1e-9)
            force = state.loop.force_0 + state.loop.length - state.reaction
            assert state.upper.force_0 == pytest.approx(force, abs=1e-10)


@pytest.mark.parametrize("length", [10.0, 15.0, 20.0, 30.0, 40.0])
def test_instability_on_the_stability_boundary(length: float) -> None:
    """The critical state of the family of constant lying length is that of the family of constant height."""
    free = length / 2.0 + OFFSET
    state = half_fold.critical_state_fixed_lift_off(free)
    known = elastica.critical(state.gripper[1])
    assert known.snap
    assert state.advance == pytest.approx(known.advance, abs=1e-9)
    assert state.gripper[0] == pytest.approx(known.x, abs=1e-6)


def test_a_short_strip_touches_before_it_becomes_unstable() -> None:
    with pytest.raises(SolveError, match="touches before"):
        half_fold.critical_state_fixed_lift_off(9.0 / 2.0 + OFFSET)


def test_without_sag_there_is_no_contact() -> None:
    *_, lifted = half_fold.states_no_horizontal_force(6.0)
    with pytest.raises(SolveError, match="sag"):
        list(half_fold.states_point_contact(lifted))


SLOPES = {"heart": 0.5 * np.pi, "pear": -0.5 * np.pi}


def height(kind: str, star: float) -> float:
    """Height over length of a loop of this length, L*, by other means: a force balance of the half in L*, solve_bvp."""

    def rates(s: np.ndarray, y: np.ndarray, p: np.ndarray) -> np.ndarray:
        below = 0.5 * star - s  # the weight of the part below, which its upper end carries
        return np.array([y[1], p[0] * np.sin(y[0]) + below * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
        return np.array([a[0] - SLOPES[kind], a[2], a[3], b[0] + np.pi, b[2]])

    s = np.linspace(0.0, 0.5 * star, 200)
    t = s / s[-1]
    bulge = {"heart": 0.0, "pear": 1.2}[kind]
    angle = SLOPES[kind] - (SLOPES[kind] + np.pi) * t + bulge * np.sin(np.pi * t)
    path = [np.cumsum(f(angle)) * s[1] for f in (np.cos, np.sin)]
    found = solve_bvp(rates, ends, s, np.array([angle, np.gradient(angle, s), *path]), [-10.0 / star**2], tol=1e-8)
    assert found.success
    return float(-found.y[3, -1] / star)


@pytest.mark.parametrize(
    ("kind", "star"), [("heart", 3.0), ("heart", 5.0), ("heart", 8.0), ("pear", 5.0), ("pear", 8.0)]
)
def test_eta_b_of_a_loop_whose_height_is_computed_otherwise(kind: str, star: float):
    unit = 0.025
    found = elastica.eta_b_from_hanging_loop(kind, star * unit, height(kind, star) * star * unit)
    assert found == pytest.approx(1.0 / (GRAVITY * unit**3), rel=1e-5)


@pytest.mark.parametrize(("kind", "share"), [("heart", 0.1337), ("pear", 0.4243)])
def test_without_weight_heights_are_peirces(kind: str, share: float):
    """His l_0 over the length."""
    values = np.zeros(textile.NODES + 2)
    guess = np.sin(np.pi * textile.grid(textile.NODES).nodes)
    values[:-2] = -textile.BULGE[kind] * np.pi**2 * guess
    assert 0.5 * textile._depth(kind, textile._solved(kind, values)) == pytest.approx(share, abs=2e-4)


@pytest.mark.parametrize("relative", [0.15, 0.2, 0.25, 0.3, 0.4])
def test_hearts_agree_with_peirces_formula(relative: float):
    """c = l_0 (cos(t) / tan(t))^(1/3) with t = 32.85 degrees (l - l_0) / l_0: his approximation."""
    angle = np.radians(32.85) * (relative / 0.1337 - 1.0)
    bending_length = 0.1337 * (np.cos(angle) / np.tan(angle)) ** (1.0 / 3.0)
    unit = (GRAVITY * elastica.eta_b_from_hanging_loop("heart", 1.0, relative)) ** (-1.0 / 3.0)
    assert bending_length == pytest.approx(unit, rel=0.05)


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        (("ring", 0.2, 0.07), "loop"),
        (("heart", 0.2, 0.027), "height"),
        (("heart", 0.2, 0.095), "height"),
        (("pear", 0.2, 0.0995), "height"),
        (("pear", 0.2, 0.2), "height"),
        (("pear", -1.0, 0.07), "length"),
    ],
)
def test_refused(arguments: tuple[str, float, float], key: str):
    with pytest.raises(InvalidInputError) as error:
        elastica.eta_b_from_hanging_loop(*arguments)
    assert error.value.key == key
