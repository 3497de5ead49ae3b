"""Motions of synthetic recordings from the project's own dynamics, with friction in bending and a moving gripper."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import sqrt

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from stripfold.analysis import moving_gripper
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from stripfold.material import Material
from stripfold.scene import checked_strip
from stripfold.simulation import MODELS
from stripfold.solve.schemes import Damping
from stripfold.synthetic.checking import checked
from stripfold.synthetic.history import STATIONS, History
from stripfold.synthetic.scene import Scene

RATE = 500.0
"""Stored moments per second."""


@dataclass(frozen=True, slots=True)
class Motion:
    """What the generator ``dynamics`` may be asked for.

    Parameters
    ----------
    friction
        M_0 of the bending hysteresis, rho_a g L*^2 per width (half of Kawabata's 2HB).
    air, stiffness
        Damping proportional to mass, 1/s, and to stiffness, s: those of ``stripfold simulate``.
    before
        How far before the loss of stability the motion begins, m.
    after
        How long it goes on after the first touch, s.
    eta_m
        Weight-to-membrane-stiffness ratio, m^-2 s^2.
    model
        Model of the strip, "solid" or "rod".
    refinement
        Factor on the lengths of the elements; a rod's have half the nodes, so that for one its factor is half as large.
    """

    friction: float = 0.01
    air: float = 2.0
    stiffness: float = 3e-3
    before: float = 0.01
    after: float = 0.4
    eta_m: float = 1e-3
    model: str = "solid"
    refinement: float = 2.0


_RANGES: Mapping[str, tuple[float, float]] = {
    "friction": (0.0, 0.1),
    "air": (0.0, 1e2),
    "stiffness": (0.0, 1.0),
    "before": (1e-3, 0.1),
    "after": (0.0, 5.0),
    "eta_m": (1e-8, 1.0),
    "refinement": (0.25, 4.0),
}


def from_dynamics(scene: Scene) -> History:
    """The motion of a scene whose generator is ``dynamics``.

    Raises
    ------
    InvalidInputError
        ``scene.motion`` has an unknown key, or a strip or motion that cannot be.
    SolveError
        There is no snap at this height, or a part could not be computed.
    """
    asked = checked(Motion, scene.motion, "motion", _RANGES, {"model": MODELS})
    material, length = checked_strip(Material(scene.strip.eta_b, asked.eta_m), scene.strip.length)
    unit = material.gravity_length
    clock = sqrt(unit / material.gravity)
    found = moving_gripper.run(
        StripModel(length / unit, material.relative_thickness, kind=asked.model),
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
            "motion": asdict(asked),
        },
    )
