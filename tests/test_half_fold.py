"""States of a half fold against the elastica's equations as an initial-value problem."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.shooting import assert_equilibrium
from stripfold import elastica
from stripfold.base.errors import SolveError
from stripfold.elastica import half_fold, point_contact

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
    states = list(point_contact.states_point_contact(touch))
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
        list(point_contact.states_point_contact(lifted))
