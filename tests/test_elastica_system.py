"""The collocated problem of the heavy elastica: operators, derivatives, resolution, continuation guards."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from stripfold import elastica
from stripfold.base.errors import ContinuationError, NewtonError
from stripfold.elastica import _continuation as continuation
from stripfold.elastica import _events as events
from stripfold.elastica import _system as system
from stripfold.elastica._chebyshev import grid, resample
from stripfold.elastica.branch import points
from stripfold.elastica.state import State


class TestOperators:
    @pytest.mark.parametrize("n", [24, 64, 384])
    def test_integration_is_exact_for_polynomials(self, n):
        g = grid(n)
        # Polynomials of degree p are rational functions of the grid's parameter with a pole of order p.
        for power in (0, 1, 2, 7, 20) if n > 24 else (0, 1, 2):
            np.testing.assert_allclose(g.integral @ g.nodes**power, g.nodes ** (power + 1) / (power + 1), atol=2e-15)

    def test_angle_operator_fulfils_both_end_conditions(self):
        # theta'' = 1 with theta(0) = 0, theta'(1) = 0.
        g = grid(24)
        np.testing.assert_allclose(g.angle @ np.ones(24), g.nodes**2 / 2 - g.nodes, atol=1e-15)
        np.testing.assert_allclose(g.slope @ np.ones(24), g.nodes - 1, atol=1e-15)

    def test_interpolation_and_resampling(self):
        g = grid(32)
        at = np.linspace(0.0, 1.0, 9)
        np.testing.assert_allclose(g.interpolate(np.exp(g.nodes), at), np.exp(at), atol=1e-14)
        # At a node, and several columns at once.
        assert g.interpolate(np.exp(g.nodes), g.nodes[5]) == np.exp(g.nodes)[5]
        columns = np.stack([g.nodes, np.exp(g.nodes)], axis=1)
        np.testing.assert_allclose(g.interpolate(columns, at), np.stack([at, np.exp(at)], axis=1), atol=1e-14)
        np.testing.assert_allclose(resample(np.exp(g.nodes), 48), np.exp(grid(48).nodes), atol=1e-14)

    def test_tail(self):
        g = grid(48)
        assert g.tail(np.exp(g.nodes)) < 1e-14
        assert g.tail(np.abs(g.nodes - 0.4)) > 1e-4


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


def test_rate_is_the_derivative_of_the_advance():
    rng = np.random.default_rng(3)
    y = np.concatenate([rng.normal(size=32), [0.4, -1.3, 3.1]])
    v = rng.normal(size=35)
    h = 1e-5
    sides = [State._from(system.evaluate(y + d * v)).advance for d in (-h, h)]
    rate = events.advance_gradient(system.evaluate(y)) @ v
    assert rate == pytest.approx((sides[1] - sides[0]) / (2 * h), rel=1e-7)


@pytest.mark.parametrize("event", [events.TOUCH, events.SNAP, events.SHORTEST], ids=["touch", "snap", "shortest"])
def test_gradient_of_an_event(event):
    y = elastica.state_at(3.0, 6.0)._unknowns()
    v, h = np.random.default_rng(5).normal(size=y.size), 1e-6
    sides = [event.condition(system.evaluate(y + d * v))[0] for d in (-h, h)]
    row = event.condition(system.evaluate(y))[1]
    assert system.computed(row) @ v == pytest.approx((sides[1] - sides[0]) / (2 * h), rel=1e-6)


def test_slope_is_that_along_the_branch():
    near = elastica.critical(3.0)
    lengths = near.length + np.array([-0.1 - 1e-4, -0.1, -0.1 + 1e-4])
    before, state, after = (elastica.state_at(3.0, length, guess=near.state) for length in lengths)
    slope = events.SNAP_AT_HEIGHT.sign(system.evaluate(state._unknowns()), None)
    assert slope == pytest.approx((after.advance - before.advance) / 2e-4, rel=1e-6)


def test_critical_points_are_those_of_the_branch():
    rng = np.random.default_rng(11)
    for z in np.exp(rng.uniform(*np.log([0.1, 100.0]), size=30)).tolist():
        found = elastica.critical(z)
        event = events.SNAP if found.snap else events.TOUCH
        *branch, after = continuation.until(points(z), event)
        before = branch[-1]
        state = State._from(continuation.between(before, after, continuation.at_height(z), event).e)
        assert found.state.length == pytest.approx(state.length, rel=1e-9)
        assert found.state.advance == pytest.approx(state.advance, rel=1e-11)
        other = (events.TOUCH if found.snap else events.SNAP).sign
        assert all(other(point.e, point.tangent) > 0.0 for point in branch)


@pytest.mark.parametrize("drift", [0.3, -0.3])
def test_clearance_of_several_sags(drift):
    # A shape, not an equilibrium: theta oscillates about pi, and the curve drifts up or down.
    g = grid(96)
    theta = np.pi - drift - np.sin(6 * np.pi * g.nodes)
    curvature = -6 * np.pi * np.cos(6 * np.pi * g.nodes)
    x, height = g.integral @ np.cos(theta), g.integral @ np.sin(theta)
    shape = State(g.nodes, x, height, theta, curvature, force_x=0.0, force_0=0.0, length=1.0)
    z = shape.at(np.linspace(0.0, 1.0, 20001)).z
    inner = z[1:-1][(z[1:-1] < z[:-2]) & (z[1:-1] <= z[2:])]
    assert inner.size == 3
    assert shape.clearance == pytest.approx(inner.min(), abs=1e-7)


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


def test_unresolved_states_raise():
    with pytest.raises(NewtonError, match="not resolved"):
        system.next_count(system.NODE_COUNTS[-1])


def test_bordered_determinant_keeps_its_sign():
    signs = set()
    for point in points(3.0, 0.2):
        signs.add(point.orientation)
        # The minimum of the length and the critical point are regular points of the branch.
        if events.SNAP.sign(point.e, point.tangent) < -1.0:
            break
    assert len(signs) == 1
    assert 0.0 not in signs


def test_another_branch_is_refused():
    # All points in reach have the opposite orientation.
    point = next(points(3.0))
    flipped = continuation.Point(point.e, point.tangent, point.normal, -point.orientation)
    with pytest.raises(ContinuationError, match="could not be followed"):
        list(islice(continuation.march(flipped, continuation.at_height(3.0), step=0.1, max_step=0.2), 2))


def test_a_singular_system_has_no_solution():
    assert np.isnan(system.solved(np.ones((2, 2)), np.ones(2))).all()
