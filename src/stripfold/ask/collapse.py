"""A strip through its collapse, with all states, and which effects the strip had, needed, and what they cost.

Source: docs/effects.md.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from stripfold.ask.inputs import Release, Simulation
from stripfold.ask.prediction import ElasticaPrediction, clamped_end
from stripfold.base.arguments import checked, file_name
from stripfold.base.errors import TimeStepError
from stripfold.base.material import Material
from stripfold.base.progress import FALL
from stripfold.files import schema
from stripfold.files.reporting import Progress, Result, Rows, metres
from stripfold.follow.fall import Fall, collapse
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel
from stripfold.follow.time import collapse_with_friction
from stripfold.follow.track import End, StripState, Track, mid_surfaces, node_weights, nodes
from stripfold.solve.dynamics import Energy, TimeState
from stripfold.solve.schemes import Damping
from stripfold.strip.layer_friction import LayerFriction
from stripfold.strip.self_contact import SelfContact

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

ENERGIES = ("kinetic", "elastic", "gravity", "work", "air", "viscous", "friction", "contact", "numerical", "closing")
"""Terms of the energy balance that are stored."""
IN_STATICS = ("kinetic", "elastic", "gravity")
ENDS = {
    End.SNAP: "another critical point",
    End.TOUCH: "first touch",
    End.REST: "rest after the fall: with friction no statics go on from it",
    End.LIFTED: End.LIFTED.value,
    End.LAYERS: "layers meet above the floor: statics do not know that contact",
    End.PATH: "the gripper is above the held end",
}
"""What ended a simulation, in words."""
CONTACT, SELF_CONTACT, INERTIA = "contact", "self_contact", "inertia"
FRICTION, LAYER_FRICTION, SOLID = "friction", "layer_friction", "solid"
"""Effects, as in :class:`.inputs.Effects`."""


@dataclass(frozen=True, eq=False, repr=False)
class StripCollapse(Result):
    """A strip through its collapse: statics to lambda_c, the fall, statics again.  Source: docs/physics.md, section 6.

    Attributes
    ----------
    dataset
        All states over ``state`` and ``node``, with their ``phase``, energies and contacts.
    simulation
        The inputs.
    """

    dataset: xr.Dataset
    simulation: Simulation
    title = "a strip through its collapse"
    shown = ("lambda_c", "touch", "rest_time")

    @classmethod
    def of(cls, simulation: Simulation, progress: Progress | None = None) -> Self:
        """Simulate it."""
        return cls(run(simulation, progress), simulation)

    @property
    def lambda_c(self) -> float:
        """Advance of the gripper past the flat end at the snap, m."""
        return float(self.dataset["lambda_c"])

    @property
    def touch(self) -> tuple[float, float]:
        """Time of the first touch after the release, s, and its x, m; nan where there is none."""
        return float(self.dataset["touch_time"]), float(self.dataset["touch_x"])

    @property
    def rest_time(self) -> float:
        """Time from the release to rest, s; nan where the fall was not followed so far."""
        return float(self.dataset["settle_time"])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Effects that the scene needs and that were switched off."""
        missing = filter(None, self.dataset.attrs["missing"].split(", "))
        reasons = self.dataset["reason"]
        in_si = self.simulation.material.in_si
        return tuple(f"{name} is off and needed: {in_si(reasons.sel(effect=name).item())}" for name in missing)

    def rows(self) -> Rows:
        time, x = self.touch
        active = self.dataset["effect"].values[self.dataset["active"].values == 1.0]
        return [
            ("lambda_c", metres(self.lambda_c, "advance of the gripper past the flat end at the snap")),
            ("touch", f"after {time:.4g} s at x = {x:.4g} m" if isfinite(time) else "-"),
            ("rest", f"after {self.rest_time:.4g} s" if isfinite(self.rest_time) else "-"),
            ("effects", ", ".join(map(str, active))),
            ("end", self.dataset.attrs["end"]),
        ]

    def to_dict(self) -> dict[str, Any]:
        time, x = self.touch
        return {"lambda_c": self.lambda_c, "touch_time": time, "touch_x": x, "rest_time": self.rest_time}

    def to_dataset(self) -> xr.Dataset:
        return self.dataset

    def plot(self) -> Figure:
        """lambda over the deflection, through the collapse."""
        from stripfold.draw import collapse_curve

        return collapse_curve.draw(self.dataset)

    @checked
    def film(self, file: str | os.PathLike[str], progress: Progress | None = None) -> None:
        """Draw it as an MP4 film."""
        from stripfold.base.errors import require

        require("vision")
        from stripfold.draw.film import film

        film(self.dataset, file_name("file", file), progress=progress)

    def config(self) -> dict[str, Any]:
        return self.simulation.as_config()


def in_solver_units(release: Release, material: Material) -> Fall:
    """How a strip of a material is released, in units of L* and sqrt(L*/g)."""
    time = float(np.sqrt(material.gravity_length / material.gravity))
    speed = material.gravity_length / time
    return Fall(
        disturbance=release.disturbance / speed,
        speed=release.speed / speed,
        damping=Damping(release.air * time, release.stiffness / time),
        to_rest=release.until == "rest",
    )


class Clock(NamedTuple):
    """Time that a whole simulation took, and self-contact in it with its monitor, s."""

    whole: float
    self_contact: float


def run(simulation: Simulation, progress: Progress | None = None) -> xr.Dataset:
    """Simulate and collect; see :func:`.fall.collapse` for the errors raised."""
    return timed(simulation, progress)[0]


def timed(simulation: Simulation, progress: Progress | None = None) -> tuple[xr.Dataset, Clock]:
    """As :func:`run`, with the time taken beside the dataset, which is the same in every run."""
    asked, thickness = simulation.effects, simulation.material.relative_thickness
    curl = simulation.curl_star
    strip = StripModel(simulation.length_star, thickness, simulation.nu, kind=simulation.model, curl=curl)
    fall = in_solver_units(simulation, simulation.material) if asked.inertia != "off" else None
    layers = thickness if asked.self_contact != "off" else None
    mu = simulation.layer_friction if asked.layer_friction != "off" else 0.0
    began = perf_counter()
    with_these: dict[str, Any] = {"progress": progress, "self_contact": layers, "layer_friction": mu}
    if simulation.friction_star and asked.friction != "off":
        found = collapse_with_friction(strip, simulation.height_star, simulation.friction_star, fall, **with_these)
    else:
        if (angle := simulation.clamp_angle) is not None:
            prediction = ElasticaPrediction.at(simulation.height_star)
            with_these["run"] = clamped_end(strip, prediction, angle, 1.0, LAMBDA_TOLERANCE)
        found = collapse(strip, simulation.height_star, fall, **with_these)
    whole = perf_counter() - began
    effects, self_contact = record(simulation, found)
    return _dataset(simulation, found).merge(effects).assign_attrs(effects.attrs), Clock(whole, self_contact)


def _dataset(simulation: Simulation, found: Track) -> xr.Dataset:
    """All states over ``state`` and ``node``; ``phase`` says of each where in the collapse it is."""
    material, states = simulation.material, found.states
    length = states[0].problem.model.length
    arc = nodes(length)
    middle = mid_surfaces(states, arc)
    columns: dict[str, list[float]] = {name: [] for name in ("time", "negatives", *ENERGIES)}
    for (problem, point), phase in zip(states, found.phases, strict=True):
        if isinstance(point, TimeState):
            time, negatives, energy = point.t, nan, point.energy
        else:
            time, negatives, energy = nan, float(point.negatives), Energy(0.0, *problem.energies(point.q))
        columns["time"].append(time)
        columns["negatives"].append(negatives)
        for name in ENERGIES:
            columns[name].append(getattr(energy, name) if phase == FALL or name in IN_STATICS else nan)
    falling, touch = _fall_of(found), found.touch
    scalars = {
        "gripper_height": simulation.height_star,
        "lambda_0": states[0].point.lam,
        "lambda_c": found.events[0].travelled,
        "touch_time": _time(states[touch.index]) if touch else nan,
        "touch_x": touch.x if touch else nan,
        "settle_time": _time(falling[-1]) if falling and simulation.until == "rest" else nan,
    }
    end = ENDS[found.end]
    if found.end is End.SNAP and not falling:
        end = "the critical point: statics alone do not lead past it"
    on = ("state", "node")
    return schema.dataset(
        {
            **{name: ((), value) for name, value in scalars.items()},
            **{name: ("state", values) for name, values in columns.items()},
            "advance": ("state", [state.lam for state in states]),
            "deflection": ("state", np.sqrt(np.sum((middle - middle[0]) ** 2, axis=2) @ node_weights(arc) / length)),
            "contacts": ("state", np.array([len(point.active) for _, point in states], dtype=float)),
            "minimal_gap": ("state", [np.min(point.q[problem.bounded]) for problem, point in states]),
            "phase": ("state", list(found.phases)),
            **{"x": (on, middle[..., 0]), "z": (on, middle[..., 1]), "arc": ("node", arc)},
        },
        {**material.attributes, "thickness": material.thickness, "length": simulation.length, "end": end},
        material.scales,
    )


def _fall_of(found: Track) -> Sequence[StripState]:
    """The states of the fall; none where it was not asked for."""
    return found.states[found.falls[0]] if found.falls else ()


def _time(state: StripState) -> float:
    assert isinstance(state.point, TimeState)
    return state.point.t


class Effect(NamedTuple):
    """An effect in a scene: whether it is needed, by two numbers compared (L*) and in words; whether and since when
    it acted, s after the release."""

    needed: bool
    value: float
    threshold: float
    reason: str
    active: bool
    since: float = nan


def record(simulation: Simulation, found: Track) -> tuple[xr.Dataset, float]:
    """The record over ``effect``, whose attribute ``missing`` names what is needed and was off; and the time that
    self-contact took, its monitor included, s."""
    asked, accuracy, unit = simulation.effects, simulation.accuracy, simulation.time_unit
    falling, touch, mu = _fall_of(found), found.touch, simulation.layer_friction
    gap, met, looked = _layers(found, simulation.material.relative_thickness)
    near = f"{gap:.2g} L* more than the thickness is the smallest distance of layers above the floor"
    if gap == inf:
        near = "no two layers come near each other above the floor"
    problem, first = found.states[0]
    lowest = float(first.q[problem.bounded].min())
    maximum = "lambda has a maximum: no equilibrium is near behind it"
    if falling:
        maximum += f"; up to {_kinetic_share(falling):.0%} of what it had and released is in motion"
    contact = falling[0].problem.self_contact if falling else None
    rubs = bool(falling) and any(isinstance(effect, LayerFriction) for effect in falling[0].problem.effects)
    rubbing = f"the layers {'touch' if touch else 'do not touch'}, with a coefficient of friction of {mu:g}"
    rod = simulation.distance_from_solid("rod")
    by_rod = f"a rod's lambda_c is up to {rod:.1e} of itself away from the solid's"
    effects = {
        CONTACT: Effect(lowest <= 0.0, lowest, 0.0, f"the lowest point is {lowest:.2g} L* over the floor", True),
        # Ready from the beginning of the fall; it acts from where layers first meet.
        SELF_CONTACT: Effect(
            gap < 0.0,
            gap,
            0.0,
            near,
            contact is not None and (gap < 0.0 or asked.self_contact == "on"),
            unit * met if contact is not None else nan,
        ),
        # At lambda_c its slope is zero and falls.
        INERTIA: Effect(True, -1.0, 0.0, maximum, bool(falling), 0.0 if falling else nan),
        FRICTION: Effect(
            simulation.friction_star > 0.0,
            simulation.friction_star,
            0.0,
            f"the fabric's friction moment is {simulation.friction_star:.2g} rho_a g L*^2",
            simulation.friction_star > 0.0 and asked.friction != "off",
            0.0 if simulation.friction_star and asked.friction != "off" and falling else nan,
        ),
        # It acts on the upper layer from the first touch on.
        LAYER_FRICTION: Effect(
            touch is not None and mu > 0.0,
            mu,
            0.0,
            rubbing,
            rubs,
            unit * _time(found.states[touch.index]) if rubs and touch else nan,
        ),
        SOLID: Effect(rod > accuracy, rod, accuracy, by_rod, simulation.model == "solid"),
    }
    numbers = ("needed", "value", "threshold", "active", "since")
    table = schema.dataset(
        {
            **{name: ("effect", [float(getattr(one, name)) for one in effects.values()]) for name in numbers},
            "asked": ("effect", list(asked.model_dump().values())),
            "reason": ("effect", [one.reason for one in effects.values()]),
            "effect": ("effect", tuple(effects)),
        },
        {"missing": ", ".join(name for name, one in effects.items() if one.needed and not one.active)},
    )
    return table, looked if contact is None else looked + sum(contact.spent)


def _kinetic_share(falling: Sequence[StripState]) -> float:
    """The largest kinetic energy of a fall, as a share of what it began with and what was released in all of it."""
    energies = [point.energy for _, point in falling if isinstance(point, TimeState)]
    potential = np.array([e.elastic + e.gravity for e in energies])
    there = energies[0].kinetic + float(potential[0] - potential.min())
    return max(e.kinetic for e in energies) / there if there > 0.0 else 0.0


def _layers(found: Track, thickness: float) -> tuple[float, float, float]:
    """The smallest gap of layers above the floor, L*; when they first met, sqrt(L*/g), nan for never; seconds taken."""
    began = perf_counter()
    falling = _fall_of(found)
    model = falling[0].problem.model if falling else found.states[-1].problem.model
    monitor = SelfContact.of(model, thickness)
    smallest, met = np.inf, np.nan
    for problem, state in found.states:
        gap = monitor.gap(state.q if problem.model is model else problem.model.resampled(state.q, model.s))
        if gap < 0.0 and np.isnan(met):
            met = state.t if isinstance(state, TimeState) else np.nan
        smallest = min(smallest, gap)
    return float(smallest), met, perf_counter() - began


def last_good(simulation: Simulation, error: TimeStepError) -> xr.Dataset:
    """The last good moment of a motion that could not be followed, for a look at what went wrong; SI."""
    last: TimeState = error.last
    x, z = error.details["mid_surface"].T
    values = {"x": ("node", x), "z": ("node", z), "time": ((), last.t), "advance": ((), last.lam)}
    return schema.dataset(values, {"error": str(error)}, simulation.material.scales)
