"""Hard and easy falls: does the motion stay bounded, above the floor and free of energy gain, and where does it end?

The name of a case says how it differs from the base.  All in units of L*.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from stripfold.analysis.collapse import release_of, to_critical_point
from stripfold.analysis.release import TIME_OPTIONS, Fall, ReleaseState, initial_state, simulate_fall, state_at_rest
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from stripfold.errors import SolveError
from stripfold.solve import dynamics
from stripfold.solve.dynamics import TimeEvent
from stripfold.solve.schemes import Damping
from studies.common import Progress, table, variables

FREE_RUN = 10.0
"""Time for which an undamped strip is followed past its first touch: it never comes to rest."""


def run(base: Mapping[str, float], cases: Sequence[Mapping[str, Any]], progress: Progress | None = None) -> xr.Dataset:
    """Let strips fall.

    Parameters
    ----------
    base
        ``length``, ``thickness``, ``height`` (L*), ``disturbance`` (sqrt(g L*)), ``air`` (sqrt(g/L*)), ``stiffness``
        (sqrt(L*/g)), ``refinement``, ``tolerance`` (of a step, L*).
    cases
        What each further case changes of it, and its ``name``.

    Returns
    -------
    Dataset over ``case``, the first being called "base"; a case that failed has nan and its error's message.
    """
    falls = {"base": dict(base)} | {case["name"]: {**base, **case} for case in cases}
    rows: list[dict[str, Any]] = []
    shapes: dict[str, Callable[[Array], Array]] = {}
    branches: dict[tuple[float, ...], ReleaseState] = {}
    for name, given in falls.items():
        row: dict[str, Any] = {"case": name, **dict.fromkeys(NUMBERS, np.nan), "message": ""}
        try:
            measured, shapes[name] = _measure(given, branches)
            row |= measured
        except SolveError as error:
            row["message"] = f"{type(error).__name__}: {error}"
        if name in shapes and "base" in shapes and given["length"] == base["length"]:
            s = np.linspace(0.0, base["length"], 400)
            apart = shapes[name](s) - shapes["base"](s)
            row["distance"] = float(np.linalg.norm(apart, axis=1).max())
        rows.append(row)
        if progress:
            progress(f"{name}: {row['message'] or 'done'}")
    return table("falls", "case", rows, {f"base_{key}": value for key, value in base.items()})


NUMBERS = tuple(name for name in variables("falls") if name not in ("case", "message"))


def _measure(
    given: Mapping[str, float], branches: dict[tuple[float, ...], ReleaseState]
) -> tuple[dict[str, float], Callable[[Array], Array]]:
    """One fall: its numbers, and the end state's mid-surface as a function of the distance along the strip."""
    key = (given["length"], given["thickness"], given["height"], given["refinement"])
    if key not in branches:
        strip = StripModel(given["length"], given["thickness"])
        branches[key] = release_of(to_critical_point(strip, given["height"], key[3]), key[3])
    release = branches[key]
    problem = release.problem
    damping = Damping(given["air"], given["stiffness"])
    damped = damping != Damping()
    fall = Fall(given["disturbance"], 0.0, damping, to_rest=damped)
    options = replace(TIME_OPTIONS, tolerance=given["tolerance"])
    motion = simulate_fall(release, fall, options)
    if motion.touch is None:
        raise SolveError("the strip came to rest without touching")
    states = list(motion.states)
    if not damped:
        _, drive = initial_state(release, fall)
        later = TimeEvent(lambda state: state.t >= motion.states[-1].t + FREE_RUN)
        rest = dynamics.march(problem, states[-1], drive, damping, options=options, until=[later])
        states += list(rest)[1:]
    model, end = problem.model, states[-1]
    closing = np.array([m.energy.closing for m in states])
    first = states[0].energy
    measured = {
        "touch_time": motion.states[motion.touch].t,
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
        q = state_at_rest(problem, end).q
        measured["handed_over"] = model.largest_move(end.q, q)
    shape = model.mid_surface(end.q)

    def at(s: Array) -> Array:
        return np.stack([np.interp(s, model.s, shape[:, i]) for i in range(2)], axis=1)

    return measured, at
