"""The planned states of a half fold against the elastica's equations, integrated anew from one end."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from stripfold import elastica
from stripfold.elastica import carrying
from stripfold.elastica.state import State
from stripfold.errors import InvalidInputError, SolveError

OFFSET = 1.099425
"""Free length of a half fold beyond half the strip, L*: docs/physics.md, section 4."""


def integrated(state: State, curvature: float = 0.0, angle: float = 0.0) -> np.ndarray:
    """Place, angle and curvature at the state's end, from its beginning by a Runge-Kutta method."""

    def rate(s: float, y: np.ndarray) -> list[float]:
        _, _, theta, k = y
        vertical = state.force_0 + s
        return [np.cos(theta), np.sin(theta), k, state.force_x * np.sin(theta) - vertical * np.cos(theta)]

    start = [state.x[0], state.z[0], angle, curvature]
    return solve_ivp(rate, (0.0, state.length), start, rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]


def assert_equilibrium(state: State, curvature: float = 0.0, angle: float = 0.0) -> None:
    end = integrated(state, curvature, angle)
    found = [state.x[-1], state.z[-1], state.theta[-1], state.curvature[-1]]
    np.testing.assert_allclose(found, end, atol=1e-8)


def test_lifting_has_no_horizontal_force() -> None:
    states = list(carrying.lifting(6.0))
    assert states[-1].length == pytest.approx(6.0, abs=1e-12)
    assert states[0].length == carrying.SHORTEST
    assert all(state.force_x == pytest.approx(0.0, abs=1e-12) for state in states)
    assert np.all(np.diff([state.gripper[1] for state in states]) > 0.0)
    assert max(np.diff([state.length for state in states])) <= carrying.SPACING + 1e-12
    for state in states[::7]:
        assert_equilibrium(state)
        assert state.curvature[-1] == pytest.approx(0.0, abs=1e-9)
    known = elastica.state_no_horizontal_force(states[-1].gripper[1])
    assert known.length == pytest.approx(6.0, abs=1e-9)


@pytest.mark.parametrize("length", [7.3, 12.0])
def test_carrying_keeps_the_lying_length_up_to_the_touch(length: float) -> None:
    free = length / 2.0 + OFFSET
    states = list(carrying.carrying(free))
    assert states[0].force_x == pytest.approx(0.0, abs=1e-10)
    assert all(state.length == pytest.approx(free, abs=1e-12) for state in states)
    assert all(state.clearance > 0.0 for state in states[:-1])
    assert states[-1].clearance == pytest.approx(0.0, abs=1e-9)
    # It pushes on its way over.
    assert min(state.force_x for state in states) < -0.9
    for state in states[::5]:
        assert_equilibrium(state)


@pytest.mark.parametrize("length", [7.3, 12.0, 60.0])
def test_rolling_ends_in_the_folded_loop(length: float) -> None:
    free = length / 2.0 + OFFSET
    *_, touch = carrying.carrying(free)
    states = list(carrying.rolling(touch))
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
            assert_equilibrium(state.loop)
            bend = float(state.upper.curvature[0])
            assert bend == pytest.approx(float(state.loop.curvature[-1]), abs=1e-9)
            assert_equilibrium(state.upper, bend, np.pi)
            assert state.upper.curvature[-1] == pytest.approx(0.0, abs=1e-9)
            force = state.loop.force_0 + state.loop.length - state.reaction
            assert state.upper.force_0 == pytest.approx(force, abs=1e-10)


def test_the_touching_strips_jacobian() -> None:
    rng = np.random.default_rng(1)
    problem = carrying._TwoParts(9.0, 24)
    y = np.concatenate([rng.normal(size=48), [0.3, -3.5, 0.7, 3.9]])
    step = 1e-6
    columns = [
        (problem.residual(y + step * e, 0.0) - problem.residual(y - step * e, 0.0)) / (2 * step) for e in np.eye(52)
    ]
    np.testing.assert_allclose(problem.jacobian(y, 0.0), np.column_stack(columns), atol=1e-6)


@pytest.mark.parametrize("length", [10.0, 15.0, 20.0, 30.0, 40.0])
def test_it_becomes_unstable_on_the_stability_boundary(length: float) -> None:
    """Found on the way of constant lying length, and found on the way of constant height: the same state."""
    free = length / 2.0 + OFFSET
    state = carrying.critical_on_the_way(free)
    known = elastica.critical(state.gripper[1])
    assert known.snap
    assert state.advance == pytest.approx(known.advance, abs=1e-9)
    assert state.gripper[0] == pytest.approx(known.x, abs=1e-6)


def test_a_short_strip_touches_before_it_becomes_unstable() -> None:
    with pytest.raises(SolveError, match="touches before"):
        carrying.critical_on_the_way(9.0 / 2.0 + OFFSET)


@pytest.mark.parametrize("length", [-1.0, float("nan"), 1e3, "long"])
def test_bad_lengths(length: object) -> None:
    with pytest.raises(InvalidInputError, match="length"):
        list(carrying.lifting(length))  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="length"):
        list(carrying.carrying(length))  # type: ignore[arg-type]


def test_what_does_not_sag_does_not_touch() -> None:
    *_, lifted = carrying.lifting(6.0)
    with pytest.raises(SolveError, match="sag"):
        list(carrying.rolling(lifted))
