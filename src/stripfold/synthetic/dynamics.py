"""Motions of synthetic recordings from the project's own dynamics, with friction in bending and a moving gripper."""

from __future__ import annotations

from math import sqrt

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from stripfold.ask.inputs import Strip
from stripfold.base.arrays import Array
from stripfold.follow.statics import StripModel
from stripfold.follow.time import through_snap
from stripfold.solve.dynamics import TimeState
from stripfold.solve.schemes import Damping
from stripfold.synthetic.history import RATE, STATIONS, History
from stripfold.synthetic.scene import DynamicsMotion, Scene


def history(scene: Scene) -> History:
    """The motion of a scene whose generator is ``dynamics``.

    Raises InvalidInputError: strip and eta_m do not go together; SolveError: there is no snap at this height, or a part
    could not be computed.
    """
    motion = scene.motion
    assert isinstance(motion, DynamicsMotion)  # the scene has checked it
    strip = Strip(length=scene.length, eta_b=scene.eta_b, eta_m=motion.eta_m)
    material, unit = strip.material, strip.gravity_length
    clock = sqrt(unit / material.gravity)
    found = through_snap(
        StripModel(strip.length_star, material.relative_thickness, kind=motion.model),
        scene.height / unit,
        motion.friction_moment_star,
        scene.speed * clock / unit,
        motion.before / unit,
        motion.after / clock,
        Damping(motion.air * clock, motion.stiffness / clock),
        motion.refinement,
    )
    assert found.touch is not None
    states = [state for _, state in found.states if isinstance(state, TimeState)]
    times = np.array([state.t for state in states]) * clock
    t = np.arange(0.0, times[-1], 1.0 / RATE)
    model = found.states[0].problem.model
    places = np.array([model.mid_surface(state.q) for state in states]) * unit
    rates = np.array([state.v[model.middle] for state in states]) * unit / clock
    # The mesh is much finer where the strip lifts off.
    even = np.linspace(0.0, float(model.s[-1]), STATIONS)
    places, rates = (CubicSpline(model.s, values, axis=1)(even) for values in (places, rates))
    curve: Array = CubicHermiteSpline(times, places, rates)(t)
    limit = found.events[0].travelled
    onset = (limit - states[0].lam) * unit / scene.speed
    return History(t, curve[:, 0], curve, limit * unit, onset, float(times[found.touch.index]))
