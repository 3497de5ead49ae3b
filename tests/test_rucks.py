"""Rucks: a flat strip that is pushed on a ridge of the table, against what keeps it down."""

from __future__ import annotations

import numpy as np
import pytest

import stripfold as sf
from stripfold.follow.statics import StripModel, follow
from stripfold.follow.time import Ridge, follow_in_time, rucks
from stripfold.follow.track import BUMP, WAVE, peak_push
from stripfold.paths.curve import GripperPath, pieces_through
from stripfold.solve.schemes import Damping

LENGTH, THICKNESS, PLACE = 10.0, 0.08, 5.0


def straight() -> GripperPath:
    """A path that rises at 45 degrees to 0.6 L*: past its largest push."""
    places = np.array([[-LENGTH / 2.0, 0.0], [0.6 - LENGTH / 2.0, 0.6]])
    return GripperPath("straight", pieces_through([("up", places)]))


@pytest.mark.parametrize(
    ("height", "width", "ruck"),
    [
        pytest.param(0.95 * WAVE, 1.0, False, id="a wave as wide as the bump, below the bound of linear theory"),
        pytest.param(0.75 * BUMP, 1.0, True, id="the same, higher"),
        pytest.param(0.85 * BUMP, 0.4, False, id="a narrow ridge, on whose crest the strip rests"),
        pytest.param(1.1 * BUMP, 0.4, True, id="a narrow ridge higher than the bump"),
        pytest.param(1.5 * BUMP, 3.0, False, id="a wide one, whose slopes hold the strip"),
    ],
)
def test_which_ridges_grow(height: float, width: float, ruck: bool) -> None:
    """Heights are over the square of the largest push, widths over the bump's, 8.99 / sqrt(push)."""
    strip, path = StripModel(LENGTH, THICKNESS, kind="rod"), straight()
    push, _ = peak_push(follow(strip.contact_mesh(), path, LENGTH, until="touch").states)
    ridge = Ridge(height / push**2, width * 8.987 / np.sqrt(push), PLACE)
    moved = follow_in_time(strip, path, 0.0, damping=Damping(air=0.1, stiffness=0.06), speed=0.05, ridge=ridge)
    model = moved.states[0].problem.model
    lies = model.s > PLACE - 1.5
    rise = np.array([state.q[model.middle[lies, 1]] for _, state in moved.states]) - ridge.at(model.s[lies])
    assert (rise.max() > 0.1) == rucks(moved) == ruck


def test_the_ratio_is_that_of_the_lowest_waves() -> None:
    """8 L* over the square of the push in rho_a g L*; with a flatness of 0 nothing can ruck."""
    strip = sf.Strip(length=0.36, eta_b=3780)
    found = strip.assess(sf.paths.low(strip, 0.009), model="rod", flatness=2e-4)
    push = found.peak_push / (9.81 * strip.gravity_length * strip.rho_a)
    assert found.flatness_ratio == pytest.approx(8.0 * strip.gravity_length / push**2 / 2e-4, rel=1e-6)
    assert strip.assess(sf.paths.low(strip, 0.009), model="rod", flatness=0.0).flatness_ratio == np.inf


@pytest.mark.parametrize(
    ("share", "rucked"), [pytest.param(0.9, None, marks=pytest.mark.slow), (1.15, False), (1.7, True)]
)
def test_a_verdict_in_time_lays_the_strip_on_a_ridge_where_it_may_ruck(share: float, rucked: bool | None) -> None:
    """The flatness as a share of the lowest waves that the push lifts the strip from; a ridge grows from 1.3 on."""
    strip = sf.Strip(length=9.0 * sf.Strip(length=1.0, eta_b=5000.0).gravity_length, eta_b=5000.0)
    path = sf.paths.triangular(strip)
    waves = strip.assess(path, model="rod").flatness_ratio * 5e-4
    found = strip.assess(path, model="rod", layer_friction=0.0, flatness=share * waves)
    assert found.rucked is rucked
    assert found.may_ruck is bool(rucked)
