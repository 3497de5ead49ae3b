"""Hard and easy falls: does the motion stay bounded, above the floor and free of energy gain, and where does it end?

Every case differs from the base in what its name says.  All in units of L*.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from stripfold.analysis.collapse import release_of, to_critical_point
from stripfold.analysis.release import TIME_OPTIONS, Fall, initial_state, simulate_fall, state_at_rest
from stripfold.analysis.static import StripModel, XRun
from stripfold.arrays import Array
from stripfold.errors import SolveError
from stripfold.solve import dynamics
from stripfold.solve.schemes import Damping

FREE_RUN = 10.0
"""Time for which an undamped strip is followed past its first touch: it never comes to rest."""


def run(
    base: Mapping[str, float], cases: Sequence[Mapping[str, Any]], progress: Callable[[str], None] | None = None
) -> xr.Dataset:
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
    columns: dict[str, list[float]] = {name: [] for name in _NAMES}
    messages: list[str] = []
    shapes: dict[str, Callable[[Array], Array]] = {}
    branches: dict[tuple[float, ...], XRun] = {}
    for name, given in falls.items():
        try:
            measured, shapes[name] = _measure(given, branches)
            messages.append("")
        except SolveError as error:
            measured = dict.fromkeys(_NAMES, np.nan)
            messages.append(f"{type(error).__name__}: {error}")
        if name in shapes and "base" in shapes and given["length"] == base["length"]:
            s = np.linspace(0.0, base["length"], 400)
            apart = shapes[name](s) - shapes["base"](s)
            measured["distance"] = float(np.linalg.norm(apart, axis=1).max())
        for key in _NAMES:
            columns[key].append(measured.get(key, np.nan))
        if progress:
            progress(f"{name}: {messages[-1] or 'done'}")
    data: dict[str, Any] = {
        key: ("case", np.array(columns[key]), {"units": units, "long_name": text})
        for key, (units, text) in _NAMES.items()
    }
    data["message"] = ("case", np.array(messages, dtype=object), {"units": "1", "long_name": "the error's message"})
    coords = {"case": ("case", np.array(list(falls), dtype=object), {"units": "1", "long_name": "name of the case"})}
    return xr.Dataset(data, coords=coords, attrs={f"base_{key}": value for key, value in base.items()})


_NAMES = {
    "touch_time": ("1", "time of the first touch / sqrt(L*/g)"),
    "touch_x": ("1", "where the falling part touches / L*, origin mid-strip"),
    "end_time": ("1", "time at the end / sqrt(L*/g)"),
    "steps": ("1", "time steps"),
    "minimal_gap": ("1", "smallest height over the floor / L*"),
    "largest_gain": ("1", "largest energy created in a step / rho_a g L*^2"),
    "closing": ("1", "what the energy balance lacks at the end / rho_a g L*^2"),
    "released": ("1", "elastic and gravity energy released / rho_a g L*^2"),
    "numerical": ("1", "dissipated by the time integration / rho_a g L*^2"),
    "handed_over": ("1", "distance between the state at rest and the equilibrium it is handed over to / L*"),
    "distance": ("1", "largest distance of the end state from that of the first case / L*"),
}


def _measure(
    given: Mapping[str, float], branches: dict[tuple[float, ...], XRun]
) -> tuple[dict[str, float], Callable[[Array], Array]]:
    """One fall: its numbers, and the end state's mid-surface as a function of the distance along the strip."""
    key = (given["length"], given["thickness"], given["height"], given["refinement"])
    if key not in branches:
        branches[key] = to_critical_point(StripModel(given["length"], given["thickness"]), given["height"], key[3])
    branch = branches[key]
    damping = Damping(given["air"], given["stiffness"])
    damped = damping != Damping()
    fall = Fall(given["disturbance"], 0.0, damping, to_rest=damped)
    options = replace(TIME_OPTIONS, tolerance=given["tolerance"])
    motion = simulate_fall(release_of(branch), fall, options)
    if motion.touch is None:
        raise SolveError("the strip came to rest without touching")
    states = list(motion.states)
    if not damped:
        _, drive = initial_state(release_of(branch), fall)
        rest = dynamics.march(branch.problem, states[-1], drive, damping, options=options)
        states += [next(rest)]
        while states[-1].t < motion.states[-1].t + FREE_RUN:
            states.append(next(rest))
    model, end = branch.problem.model, states[-1]
    closing = np.array([m.energy.closing for m in states])
    first = states[0].energy
    measured = {
        "touch_time": motion.states[motion.touch].t,
        "touch_x": motion.touch_x,
        "end_time": end.t,
        "steps": float(len(states) - 1),
        "minimal_gap": min(float(np.min(m.q[branch.problem.bounded])) for m in states),
        "largest_gain": float(np.max(np.diff(closing))),
        "closing": end.energy.closing,
        "released": first.elastic + first.gravity - end.energy.elastic - end.energy.gravity,
        "numerical": end.energy.numerical,
    }
    if damped:
        q = state_at_rest(branch.problem, end).q
        measured["handed_over"] = model.largest_move(end.q, q)
    shape = model.mid_surface(end.q)

    def at(s: Array) -> Array:
        return np.stack([np.interp(s, model.s, shape[:, i]) for i in range(2)], axis=1)

    return measured, at
