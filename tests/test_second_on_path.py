"""A second gripper on a path: against the motion along x, places that help and do not, the command, bad input."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import stripfold as sf
from stripfold import elastica
from stripfold.ask.second_gripper import before_snap, hold, second_on_path
from stripfold.base.material import Material
from stripfold.elastica.half_fold import states_no_horizontal_force
from stripfold.follow.statics import StripModel
from stripfold.follow.track import End
from stripfold.paths.curve import GripperPath, pieces_through
from stripfold.paths.geometric import circular, triangular

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
