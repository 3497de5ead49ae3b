"""Which effects a simulated collapse had, which it needed, and what they cost: the record that its dataset carries."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr

from stripfold.analysis.collapse import Collapse
from stripfold.effects import demand
from stripfold.effects.demand import Need
from stripfold.effects.self_contact import SelfContact
from stripfold.simulation import Simulation
from stripfold.solve.problem import Point

COLUMNS = {
    "needed": ("1", "whether the scene needs the effect, 1 or 0"),
    "active": ("1", "whether it was computed with, 1 or 0"),
    "since": ("s", "time since the fall began at which it came in; nan: active from the first state on, or never"),
    "seconds": ("s", "computing time it took, its monitor included; nan: not separable from the rest"),
    "value": ("1", "what was compared: of contacts the gap / L*, of models the relative error of lambda_c"),
    "threshold": ("1", "with what"),
}
TEXTS = {"asked": "what the scene asks: auto, on or off", "reason": "why it is needed or not"}


def record(simulation: Simulation, found: Collapse, seconds: float) -> xr.Dataset:
    """The record, over ``effect``; its attribute ``missing`` names what is needed and was switched off.

    Parameters
    ----------
    simulation, found, seconds
        What was asked for, what came of it, and how long that took, s.
    """
    scene, asked = simulation.scene, simulation.effects
    thickness, nu = scene.material.relative_thickness, scene.material.nu
    gap, met, looked = _layers(found, thickness)
    motion = found.motion
    share = None if motion is None else kinetic_share(found)
    slope = -1.0 if found.run.critical else found.run.last.tangent.lam
    lowest = float(found.run.points[0].q[found.run.problem.bounded].min())
    contact = found.run.problem.self_contact
    needs: dict[str, Need] = {
        demand.CONTACT: demand.need_of_contact(lowest),
        demand.SELF_CONTACT: demand.need_of_self_contact(gap),
        demand.INERTIA: demand.need_of_inertia(slope, share),
        demand.FRICTION: demand.need_of_friction(),
        demand.SOLID: demand.need_of_solid(thickness, nu, scene.accuracy),
        demand.MEMBRANE: demand.need_of_membrane(thickness, scene.accuracy),
    }
    rows: dict[str, dict[str, float]] = {
        demand.CONTACT: {"active": 1.0},
        demand.SELF_CONTACT: {
            # Ready from the beginning of the fall; it acts from where layers first meet.
            "active": float(contact is not None and (gap < 0.0 or asked.self_contact == demand.ON)),
            "since": simulation.time_unit * met if contact is not None else np.nan,
            "seconds": looked if contact is None else looked + sum(contact.spent),
        },
        demand.INERTIA: {"active": float(motion is not None), "since": 0.0 if motion else np.nan},
        demand.FRICTION: {"active": 0.0, "seconds": 0.0},
        demand.SOLID: {"active": float(scene.model == "solid")},
        demand.MEMBRANE: {"active": float(asked.membrane != demand.OFF)},
    }
    for name, need in needs.items():
        rows[name] |= {"needed": float(need.needed), "value": need.value, "threshold": need.threshold}
    data: dict[str, Any] = {
        name: ("effect", np.array([rows[e].get(name, np.nan) for e in demand.EFFECTS]), {"units": u, "long_name": text})
        for name, (u, text) in COLUMNS.items()
    }
    texts = {"asked": list(asked.as_config().values()), "reason": [needs[e].reason for e in demand.EFFECTS]}
    for name, column in texts.items():
        data[name] = ("effect", np.array(column, dtype=object), {"units": "1", "long_name": TEXTS[name]})
    missing = [e for e in demand.EFFECTS if rows[e]["needed"] and not rows[e]["active"]]
    coords = {"effect": ("effect", np.array(demand.EFFECTS, dtype=object), {"units": "1", "long_name": "effect"})}
    data["computing"] = ((), seconds, {"units": "s", "long_name": "computing time of all of it"})
    return xr.Dataset(data, coords=coords, attrs={"missing": ", ".join(missing)})


def kinetic_share(found: Collapse) -> float:
    """The largest kinetic energy of the fall, as a share of what it began with and what was released in all of it."""
    assert found.motion is not None
    energies = [m.energy for m in found.motion.states]
    potential = np.array([e.elastic + e.gravity for e in energies])
    released = float(potential[0] - potential.min())
    there = energies[0].kinetic + released
    return max(e.kinetic for e in energies) / there if there > 0.0 else 0.0


def _layers(found: Collapse, thickness: float) -> tuple[float, float, float]:
    """The smallest gap of layers above the floor, L*; when they first met, sqrt(L*/g), nan for never; seconds taken."""
    began = perf_counter()
    monitor = SelfContact.of(found.run.problem.model, thickness)
    smallest, met = np.inf, np.nan
    states: list[tuple[float, Any]] = [(np.nan, p) for p in _stable(found)]
    states += [(m.t, m) for m in found.motion.states] if found.motion else []
    states += [(np.nan, p) for p in found.after]
    for t, state in states:
        gap = monitor.gap(state.q)
        if gap < 0.0 and np.isnan(met):
            met = t
        smallest = min(smallest, gap)
    return float(smallest), met, perf_counter() - began


def _stable(found: Collapse) -> tuple[Point, ...]:
    points = found.run.points
    return points[: points.index(found.run.last) + 1]
