"""States of a half fold against the elastica's equations as an initial-value problem."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from oracles.shooting import assert_equilibrium
from stripfold import elastica
from stripfold.base.errors import InvalidInputError, SolveError
from stripfold.base.material import GRAVITY
from stripfold.elastica import half_fold, textile

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
