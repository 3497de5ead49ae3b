"""The study of falls: what it reports of each, and that a failure is reported and not hidden."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from stripfold.follow.collapse import to_critical_point
from stripfold.follow.release import TIME_OPTIONS, Fall, ReleaseState, simulate_fall
from stripfold.follow.static import StripModel
from stripfold.solve.schemes import Damping
from studies import falls

BASE = {
    "length": 10.0,
    "thickness": 0.0594,
    "height": 1.8,
    "disturbance": 1e-2,
    "air": 0.2,
    "stiffness": 0.1,
    "refinement": 2.0,
    "tolerance": 4e-5,
}
CASES = [
    {"name": "other sign", "disturbance": -1e-2},
    {"name": "no damping", "air": 0.0, "stiffness": 0.0},
    {"name": "another height", "height": 2.0},
    {"name": "another mesh", "refinement": 1.5},
    {"name": "too low to snap", "height": 1.2},
]


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    return falls.run(BASE, CASES)


def test_every_case_is_there(found: xr.Dataset) -> None:
    assert list(found["case"].values) == ["base", *(case["name"] for case in CASES)]
    assert all(variable.attrs["units"] and variable.attrs["long_name"] for variable in found.variables.values())


def test_a_failure_is_reported(found: xr.Dataset) -> None:
    failed = found.sel(case="too low to snap")
    assert "no fall to follow" in str(failed["message"].values)
    assert np.isnan(float(failed["touch_x"]))
    assert np.isnan(float(failed["minimal_gap"]))
    assert not any(found.drop_sel(case="too low to snap")["message"].values)


def test_falls_are_bounded(found: xr.Dataset) -> None:
    good = found.drop_sel(case="too low to snap")
    assert (good["minimal_gap"] > -1e-10).all()
    assert (good["minimal_gap"] < 1e-10).all()  # the strip lies on the floor
    assert (np.abs(good["largest_gain"]) < 1e-9).all()
    assert (good["largest_gain"] != 0.0).all()
    assert (good["released"] > 1e-4).all()
    assert (good["numerical"] > 0.0).all()


def test_end_states_are_compared(found: xr.Dataset) -> None:
    distance = found["distance"]
    assert float(distance.sel(case="base")) == 0.0
    assert 0.0 < float(distance.sel(case="other sign")) < 1e-3
    assert float(distance.sel(case="another height")) > 0.1


def test_undamped_is_followed_past_the_touch(found: xr.Dataset) -> None:
    free = found.sel(case="no damping")
    assert float(free["end_time"] - free["touch_time"]) == pytest.approx(falls.FREE_RUN, abs=0.5)
    assert np.isnan(float(free["handed_over"]))
    assert 0.0 <= float(found["handed_over"].sel(case="base")) < 1e-2


def test_the_numbers_are_those_of_the_motion(found: xr.Dataset) -> None:
    """The base and its other sign once more, measured from the energies and shapes of their moments."""
    strip = StripModel(BASE["length"], BASE["thickness"])
    run = ReleaseState.at(to_critical_point(strip, BASE["height"], BASE["refinement"]).last, BASE["refinement"])
    options = replace(TIME_OPTIONS, tolerance=BASE["tolerance"])
    fall = Fall(BASE["disturbance"], damping=Damping(air=BASE["air"], stiffness=BASE["stiffness"]))
    motion, other = (simulate_fall(run, replace(fall, disturbance=v), options) for v in (1e-2, -1e-2))
    moments, energy = motion.states, [m.energy for m in motion.states]
    lacking = np.array([e.total - e.work + e.lost for e in energy]) - energy[0].total
    wanted = {
        "touch_time": moments[motion.touch].t,
        "touch_x": motion.touch_x,
        "end_time": moments[-1].t,
        "steps": len(moments) - 1,
        "released": sum(run.problem.energies(moments[0].q)) - sum(run.problem.energies(moments[-1].q)),
        "numerical": energy[-1].numerical,
    }
    base = found.sel(case="base")
    for name, value in wanted.items():
        assert float(base[name]) == pytest.approx(value, rel=1e-6), name
    assert float(base["closing"]) == pytest.approx(lacking[-1], abs=1e-14)
    assert float(base["largest_gain"]) == pytest.approx(np.diff(lacking).max(), abs=1e-14)
    shapes = [run.problem.model.mid_surface(one.states[-1].q) for one in (motion, other)]
    apart = np.linalg.norm(shapes[0] - shapes[1], axis=1).max()
    assert float(found["distance"].sel(case="other sign")) == pytest.approx(apart, rel=0.05)
    assert float(found["touch_time"].sel(case="other sign")) == pytest.approx(other.states[other.touch].t, rel=1e-6)


def test_another_mesh_is_another_computation(found: xr.Dataset) -> None:
    change = abs(float(found["touch_x"].sel(case="another mesh") - found["touch_x"].sel(case="base")))
    assert 1e-6 < change < 0.1
