"""The collocated problem of the heavy elastica: operators, derivatives, resolution, continuation guards."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold import elastica
from stripfold.elastica import _system as system
from stripfold.elastica.state import State

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
