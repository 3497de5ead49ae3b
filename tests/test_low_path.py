"""The low path: stable below the touch limit, a snap above it, and what a too low gripper does."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold import Strip, elastica, paths
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel
from stripfold.follow.track import SNAP, End, peak_forces, shape_error
from stripfold.paths import low_path
from stripfold.paths.rpath import plan_r_path


def test_stable_up_to_the_fold_below_the_touch_limit() -> None:
    """The push is the elastica's, the fold that of the R-path, up to the square of the thickness."""
    strip = StripModel(14.0, 0.02, kind="rod")
    found = assess_strip(strip, low_path.low(strip.length, 0.7))
    assert found.stable
    assert found.end is End.PATH
    assert shape_error(*found.states[-1], plan_r_path(strip.length)) < 2e-3
    push = -min(state.force_x for state in elastica.x_axis_branch(0.7, max_step=0.05))
    assert peak_forces(found.states)[1] == pytest.approx(push, rel=0.02)


@pytest.mark.parametrize("eta_b", [2500.0, 3000.0, 3780.0])
def test_no_snap_of_the_mesh_below_the_touch_limit(eta_b: float) -> None:
    """At 1.22, 1.30 and 1.40 L*, on the default solid and its other mesh."""
    strip = Strip(length=0.5, eta_b=eta_b)
    found = strip.assess(paths.low(strip, 0.042))
    assert (found.stable, found.mesh_dependence) == (True, "")


def test_a_snap_above_the_touch_limit() -> None:
    strip = StripModel(14.0, 0.02, kind="rod")
    path = low_path.low(strip.length, 1.65)
    found = assess_strip(strip, path)
    (event,) = found.events
    assert event.kind == SNAP
    x, z = path.position(event.travelled)
    assert z == pytest.approx(1.65)
    assert x + 7.0 == pytest.approx(elastica.critical(1.65).advance, abs=0.01)
    slope = (elastica.critical(1.66).advance - elastica.critical(1.64).advance) / 0.02
    assert event.angle == pytest.approx(np.degrees(np.arctan(1.0 / slope)), abs=0.5)
