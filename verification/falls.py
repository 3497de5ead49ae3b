"""Hard and easy falls: does the motion stay bounded, above the floor and free of energy gain, and where does it end?

The name of a case says how it differs from the base.  All in units of L*.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.follow.fall import (
    TIME_OPTIONS,
    Fall,
    ReleaseState,
    initial_state,
    simulate_fall,
    state_at_rest,
    to_critical_point,
)
from stripfold.follow.statics import StripModel
from stripfold.solve import dynamics
from stripfold.solve.dynamics import TimeEvent
from stripfold.solve.schemes import Damping
from verification.common import Progress, attempted, pooled, table
from verification.numbers import Facts, Number

FREE_RUN = 10.0
"""Time for which an undamped strip is followed past its first touch: it never comes to rest."""


BASE = {
    "length": 20.0,
    "thickness": 0.0594,
    "height": 5.0,
    "disturbance": 0.001,
    "air": 0.11,
    "stiffness": 0.05,
    "refinement": 1.0,
    "tolerance": 1e-05,
}
CASES = (
    {"name": "half the step", "tolerance": 1.25e-06},
    {"name": "double the step", "tolerance": 8e-05},
    {"name": "other sign", "disturbance": -0.001},
    {"name": "disturbance 1e-12", "disturbance": 1e-12},
    {"name": "disturbance 1e-2", "disturbance": 0.01},
    {"name": "disturbance -1e-2", "disturbance": -0.01},
    {"name": "no damping", "air": 0.0, "stiffness": 0.0},
    {"name": "strong damping", "air": 1.0, "stiffness": 0.5},
    {"name": "coarse mesh", "refinement": 2.0},
    {"name": "fine mesh", "refinement": 0.5},
    {"name": "thin, h = 1e-4", "thickness": 0.0001},
    {"name": "thick, h = 0.2", "thickness": 0.2},
    {"name": "low gripper, z = 1.7", "height": 1.7},
    {"name": "soft, z = 15", "length": 40.0, "height": 15.0},
    {"name": "stiff, z = 1.8", "length": 9.0, "height": 1.8},
)


def run(
    base: Mapping[str, float] = BASE,
    cases: Sequence[Mapping[str, Any]] = CASES,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Let strips fall.

    ``base``: ``length``, ``thickness``, ``height`` (L*), ``disturbance`` (sqrt(g L*)), ``air`` (sqrt(g/L*)),
    ``stiffness`` (sqrt(L*/g)), ``refinement``, ``tolerance`` (of a step, L*); ``cases``: what each further case changes
    of it, and its ``name``.

    Dataset over ``case``, the first being called "base"; a case that failed has nan and its error's message.
    """
    falls = {"base": dict(base)} | {case["name"]: {**base, **case} for case in cases}
    found = pooled(_measured, falls.values(), threads)
    rows: list[dict[str, Any]] = []
    for (name, given), (measured, message) in zip(falls.items(), found, strict=True):
        row, shape = measured or ({}, None)
        if shape is not None and found[0][0] is not None and given["length"] == base["length"]:
            row["distance"] = float(np.linalg.norm(shape - found[0][0][1], axis=1).max())
        rows.append({"case": name, **dict.fromkeys(VALUES, np.nan), "message": message, **row})
        if progress:
            progress(f"{name}: {message or 'done'}")
    return table("case", rows, {f"base_{key}": value for key, value in base.items()})


VALUES = (
    "closing",
    "distance",
    "end_time",
    "handed_over",
    "largest_gain",
    "minimal_gap",
    "numerical",
    "released",
    "steps",
    "touch_time",
    "touch_x",
)


def _measured(given: Mapping[str, float]) -> tuple[tuple[dict[str, float], Array] | None, str]:
    return attempted(partial(_measure, given))


def _measure(given: Mapping[str, float]) -> tuple[dict[str, float], Array]:
    """One fall: its numbers, and the end state's mid-surface at 400 places, shape (400, 2)."""
    strip = StripModel(given["length"], given["thickness"])
    release = ReleaseState.at(to_critical_point(strip, given["height"], given["refinement"]).last, given["refinement"])
    problem = release.problem
    damping = Damping(given["air"], given["stiffness"])
    damped = damping != Damping()
    fall = Fall(given["disturbance"], 0.0, damping, to_rest=damped)
    options = replace(TIME_OPTIONS, tolerance=given["tolerance"])
    motion = simulate_fall(release, fall, options)
    if motion.touch is None:
        raise SolveError("the strip came to rest without touching")
    states = list(motion.moments)
    if not damped:
        _, drive = initial_state(release, fall)
        later = TimeEvent(lambda state: state.t >= motion.moments[-1].t + FREE_RUN)
        rest = dynamics.march(problem, states[-1], drive, damping, options=options, until=[later])
        states += list(rest)[1:]
    model, end = problem.model, states[-1]
    closing = np.array([m.energy.closing for m in states])
    first = states[0].energy
    measured = {
        "touch_time": motion.moments[motion.touch.index].t,
        "touch_x": motion.touch_x,
        "end_time": end.t,
        "steps": float(len(states) - 1),
        "minimal_gap": min(float(np.min(m.q[problem.bounded])) for m in states),
        "largest_gain": float(np.max(np.diff(closing))),
        "closing": end.energy.closing,
        "released": first.elastic + first.gravity - end.energy.elastic - end.energy.gravity,
        "numerical": end.energy.numerical,
    }
    if damped:
        q = state_at_rest(problem, end).point.q
        measured["handed_over"] = model.largest_move(end.q, q)
    s = np.linspace(0.0, model.length, 400)
    return measured, np.stack([np.interp(s, model.s, at) for at in model.mid_surface(end.q).T], axis=1)


def facts(d: xr.Dataset) -> Facts:
    same = ["half the step", "other sign"]
    coarse, base, fine = d.touch_x.sel(case=["coarse mesh", "base", "fine mesh"]).values
    return {
        "cases": d.sizes["case"],
        "failed": np.isnan(d.touch_x).sum(),
        "penetration": np.maximum(-d.minimal_gap.min(), 0.0),
        "gain": d.closing.max(),
        "same": " and ".join(same),
        "spread": d.distance.sel(case=same).max(),
        "coarse": abs(coarse - base),
        "fine": abs(base - fine),
        "rest": d.handed_over.max(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("falls_failed", "failed", "count", "= 0", "falls, of {cases}, that end without a touch"),
        Number("falls_penetration", "penetration", "L*", "< 1e-4 L*", "deepest penetration of the floor, all falls",
            digits=4),
        Number("falls_energy_gain", "gain", "1", "< 1e-6", "largest energy gained, rho_a g L*^2, all falls"),
        Number("falls_end_state", "spread", "L*", "< 1e-3 L*",
            "largest distance of the end states of {same} from that of the first fall"),
        Number("touch_convergence", "fine", "L*", "< 5e-3 L*, and less than at the halving before",
            "change of the first touch's x when the elements are halved; at the halving before: {coarse:.1e} L*",
            lambda f: f.fine < f.coarse),
        Number("handed_over", "rest", "L*", "< 0.01 L*",
            "largest distance between a state at rest and the equilibrium that the static solver finds from it"),
    ),
}
# fmt: on
