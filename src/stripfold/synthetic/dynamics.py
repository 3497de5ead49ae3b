"""Motions of synthetic recordings from the project's own dynamics, with friction in bending and a moving gripper."""

from __future__ import annotations

from math import sqrt

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from stripfold.analysis import moving_gripper
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from stripfold.inputs import Strip
from stripfold.solve.schemes import Damping
from stripfold.synthetic.history import STATIONS, History
from stripfold.synthetic.scene import DynamicsMotion, Scene

RATE = 500.0
"""Stored moments per second."""


def from_dynamics(scene: Scene) -> History:
    """The motion of a scene whose generator is ``dynamics``.

    Raises
    ------
    InvalidInputError
        A strip that cannot be.
    SolveError
        There is no snap at this height, or a part could not be computed.
    """
    asked = scene.motion
    assert isinstance(asked, DynamicsMotion)  # the scene has checked it
    strip = Strip(length=scene.strip.length, eta_b=scene.strip.eta_b, eta_m=asked.eta_m)
    material, unit = strip.material, strip.gravity_length
    clock = sqrt(unit / material.gravity)
    found = moving_gripper.run(
        StripModel(strip.length_star, material.relative_thickness, kind=asked.model),
        scene.gripper.height / unit,
        asked.friction,
        scene.gripper.speed * clock / unit,
        asked.before / unit,
        asked.after / clock,
        Damping(asked.air * clock, asked.stiffness / clock),
        asked.refinement,
    )
    times = np.array([state.t for state in found.states]) * clock
    t = np.arange(0.0, times[-1], 1.0 / RATE)
    model = found.model
    places = np.array([model.mid_surface(state.q) for state in found.states]) * unit
    rates = np.array([state.v[model.middle] for state in found.states]) * unit / clock
    # The mesh is much finer where the strip lifts off.
    even = np.linspace(0.0, float(model.s[-1]), STATIONS)
    places, rates = (CubicSpline(model.s, values, axis=1)(even) for values in (places, rates))
    curve: Array = CubicHermiteSpline(times, places, rates)(t)
    first = found.states[0].lam * unit
    return History(
        t,
        curve[:, 0],
        curve,
        {
            "lambda_c": found.static_limit * unit,
            "onset": float((found.static_limit * unit - first) / scene.gripper.speed),
            "touch": float(times[found.touch]),
            "generator": "dynamics",
            "motion": asked.model_dump(),
        },
    )
