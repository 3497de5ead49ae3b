"""Which effects a simulated collapse had, which it needed, and their cost: the record in its dataset.

Each test of a need is a pure function of numbers that the simulation has anyway, and says what it compared with what.
Source: ``docs/effects.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from stripfold.ask.inputs import Simulation
from stripfold.files import schema
from stripfold.strip.effects import LayerFriction
from stripfold.strip.problem import StripProblem
from stripfold.strip.self_contact import SelfContact

if TYPE_CHECKING:
    import xarray as xr

    from stripfold.follow.collapse import Collapse

CONTACT, SELF_CONTACT, INERTIA = "contact", "self_contact", "inertia"
FRICTION, LAYER_FRICTION, SOLID = "friction", "layer_friction", "solid"
EFFECTS = (CONTACT, SELF_CONTACT, INERTIA, FRICTION, LAYER_FRICTION, SOLID)
"""As in :class:`.inputs.Effects`."""

COLUMNS = ("needed", "active", "since", "value", "threshold")


@dataclass(frozen=True, slots=True)
class Need:
    """Whether a scene needs an effect: what was compared with what, in units of L*, and why, in words."""

    needed: bool
    value: float
    threshold: float
    reason: str


def need_of_contact(lowest: float) -> Need:
    """From the lowest height over the floor, L*."""
    return Need(lowest <= 0.0, lowest, 0.0, f"the lowest point is {lowest:.2g} L* over the floor")


def need_of_self_contact(gap: float) -> Need:
    """From the smallest distance of layers above the floor less the thickness, L*."""
    if gap == float("inf"):
        return Need(False, gap, 0.0, "no two layers come near each other above the floor")
    words = f"{gap:.2g} L* more than the thickness is the smallest distance of layers above the floor"
    return Need(gap < 0.0, gap, 0.0, words)


def need_of_inertia(slope: float, kinetic_share: float | None) -> Need:
    """From the slope of lambda where the smooth advance ends, and the largest share of what is released that moves."""
    words = "lambda has a maximum: no equilibrium is near behind it"
    if kinetic_share is not None:
        words += f"; up to {kinetic_share:.0%} of what it had and released is in motion"
    return Need(slope <= 0.0, slope, 0.0, words if slope <= 0.0 else "lambda has no maximum: statics go on")


def need_of_friction() -> Need:
    """Nothing in a scene tells that a fabric has internal friction: it has to be named."""
    return Need(False, 0.0, 0.0, "the scene names no internal friction")


def need_of_layer_friction(mu: float, touch: bool) -> Need:
    """From the coefficient of friction, and whether the upper layer comes down on the lower one."""
    words = f"the layers {'touch' if touch else 'do not touch'}, with a coefficient of friction of {mu:g}"
    return Need(touch and mu > 0.0, mu, 0.0, words)


def need_of_solid(error: float, accuracy: float) -> Need:
    """From the rod's relative distance from the solid, and the wanted relative accuracy of lambda_c."""
    return Need(
        error > accuracy, error, accuracy, f"a rod's lambda_c is up to {error:.1e} of itself away from the solid's"
    )


def record(simulation: Simulation, found: Collapse) -> tuple[xr.Dataset, float]:
    """The record, over ``effect``; its attribute ``missing`` names what is needed and was switched off.

    Parameters
    ----------
    simulation, found
        What was asked for, and what came of it.

    Returns
    -------
    The record, and the time that self-contact took, its monitor included, s: no part of the record, which is the same
    in every run.
    """
    asked, thickness = simulation.effects, simulation.material.relative_thickness
    gap, met, looked = _layers(found, thickness)
    motion = found.motion
    share = None if motion is None else kinetic_share(found)
    slope = -1.0 if found.run.critical else found.run.last.point.tangent.lam
    problem, first = found.before[0]
    lowest = float(first.q[problem.bounded].min())
    contact = motion.problem.self_contact if motion else None
    needs: dict[str, Need] = {
        CONTACT: need_of_contact(lowest),
        SELF_CONTACT: need_of_self_contact(gap),
        INERTIA: need_of_inertia(slope, share),
        FRICTION: need_of_friction(),
        LAYER_FRICTION: need_of_layer_friction(
            simulation.layer_friction, motion is not None and motion.touch is not None
        ),
        SOLID: need_of_solid(simulation.distance_from_solid("rod"), simulation.accuracy),
    }
    rows: dict[str, dict[str, float]] = {
        CONTACT: {"active": 1.0},
        SELF_CONTACT: {
            # Ready from the beginning of the fall; it acts from where layers first meet.
            "active": float(contact is not None and (gap < 0.0 or asked.self_contact == "on")),
            "since": simulation.time_unit * met if contact is not None else np.nan,
        },
        INERTIA: {"active": float(motion is not None), "since": 0.0 if motion else np.nan},
        FRICTION: {"active": 0.0},
        LAYER_FRICTION: _layer_friction(simulation, found),
        SOLID: {"active": float(simulation.model == "solid")},
    }
    for name, need in needs.items():
        rows[name] |= {"needed": float(need.needed), "value": need.value, "threshold": need.threshold}
    missing = [e for e in EFFECTS if rows[e]["needed"] and not rows[e]["active"]]
    table = schema.dataset(
        {
            **{name: ("effect", [rows[e].get(name, np.nan) for e in EFFECTS]) for name in COLUMNS},
            "asked": ("effect", list(asked.model_dump().values())),
            "reason": ("effect", [needs[e].reason for e in EFFECTS]),
            "effect": ("effect", EFFECTS),
        },
        {"missing": ", ".join(missing)},
    )
    return table, looked if contact is None else looked + sum(contact.spent)


def _layer_friction(simulation: Simulation, found: Collapse) -> dict[str, float]:
    """The row of the friction between the layers: it acts on the upper layer from the first touch on."""
    motion = found.motion
    if motion is None or not any(isinstance(effect, LayerFriction) for effect in motion.problem.effects):
        return {"active": 0.0}
    since = np.nan if motion.touch is None else motion.states[motion.touch].t
    return {"active": 1.0, "since": simulation.time_unit * since}


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
    model = found.model
    monitor = SelfContact.of(model, thickness)
    smallest, met = np.inf, np.nan
    states: list[tuple[float, StripProblem, Any]] = [(np.nan, *state) for state in found.before]
    if found.motion:
        states += [(m.t, found.motion.problem, m) for m in found.motion.states]
    states += [(np.nan, *state) for state in found.after]
    for t, problem, state in states:
        same = problem.model is model
        gap = monitor.gap(state.q if same else problem.model.resampled(state.q, model.s))
        if gap < 0.0 and np.isnan(met):
            met = t
        smallest = min(smallest, gap)
    return float(smallest), met, perf_counter() - began
