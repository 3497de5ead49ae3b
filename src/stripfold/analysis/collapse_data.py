"""A collapse as one dataset, in SI: statics, fall and statics again along one dimension, told apart by ``phase``."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np
import xarray as xr

from stripfold.analysis import needed_effects
from stripfold.analysis.collapse import Collapse, simulate
from stripfold.analysis.diagnostics import node_weights
from stripfold.analysis.phases import AFTER, BEFORE, FALL
from stripfold.analysis.release import Fall, Progress
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from stripfold.errors import TimeStepError
from stripfold.inputs import Release, Simulation
from stripfold.material import Material
from stripfold.models.model import Model
from stripfold.solve.dynamics import Energy, TimeState
from stripfold.solve.problem import Point
from stripfold.solve.schemes import Damping

LEDGER = {
    "kinetic": "kinetic energy per width",
    "elastic": "elastic energy per width",
    "gravity": "gravity energy per width",
    "work": "work of the gripper since the fall began",
    "air": "lost to mass-proportional damping since the fall began",
    "viscous": "lost to stiffness-proportional damping since the fall began",
    "contact": "lost in impacts since the fall began",
    "numerical": "dissipated by the time integration since the fall began",
    "closing": "what the energy balance lacks since the fall began",
}
IN_STATICS = ("kinetic", "elastic", "gravity")


def fall_of(simulation: Simulation) -> Fall:
    """How the strip is released, in solver units."""
    return in_solver_units(simulation, simulation.material)


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


def run(simulation: Simulation, progress: Progress | None = None) -> xr.Dataset:
    """Simulate and collect; see :func:`.collapse.simulate` for the errors raised."""
    asked, thickness = simulation.effects, simulation.material.relative_thickness
    stretched = thickness if asked.membrane != "off" else min(thickness, needed_effects.UNSTRETCHED)
    strip = StripModel(simulation.length_star, stretched, simulation.nu, kind=simulation.model)
    fall = fall_of(simulation) if asked.inertia != "off" else None
    layers = thickness if asked.self_contact != "off" else None
    began = perf_counter()
    found = simulate(strip, simulation.height_star, fall, progress=progress, self_contact=layers)
    record = needed_effects.record(simulation, found, perf_counter() - began)
    return dataset(simulation, found).merge(record).assign_attrs(record.attrs)


def dataset(simulation: Simulation, found: Collapse) -> xr.Dataset:
    """All states of a collapse.

    Returns
    -------
    Dataset over ``state`` and ``node``; ``phase`` says of each state whether it is static before lambda_c, in the fall,
    or static after it.
    """
    material, problem = simulation.material, found.run.problem
    model = problem.model
    unit, time, force = material.gravity_length, simulation.time_unit, material.force_scale
    run = found.run
    stable = run.points[: run.points.index(run.last) + 1]
    states: list[tuple[str, Point | TimeState]] = [(BEFORE, p) for p in stable]
    motion = found.motion
    states += [(FALL, m) for m in motion.states] if motion else []
    states += [(AFTER, p) for p in found.after]

    def each(get: Callable[[str, Point | TimeState], float]) -> Array:
        return np.array([get(phase, state) for phase, state in states], dtype=float)

    def energy_of(state: Point | TimeState) -> Energy:
        return state.energy if isinstance(state, TimeState) else Energy(0.0, *problem.energies(state.q))

    middle = np.stack([model.mid_surface(state.q) for _, state in states])
    moved = np.sqrt(_mean(model, np.sum((middle - middle[0]) ** 2, axis=2)))
    where = ("state",)
    columns: dict[str, tuple[tuple[str, ...], Array, str, str]] = {
        "time": (
            where,
            time * each(lambda _, s: s.t if isinstance(s, TimeState) else np.nan),
            "s",
            "time since the fall began",
        ),
        "lambda": (where, unit * each(lambda _, s: s.lam), "m", "advance of the gripper past the flat end"),
        "deflection": (where, unit * moved, "m", "root mean square displacement of the mid-surface from lambda_0"),
        "contacts": (where, each(lambda _, s: len(s.active)), "1", "nodes on the floor"),
        "minimal_gap": (
            where,
            unit * each(lambda _, s: float(np.min(s.q[problem.bounded]))),
            "m",
            "smallest height over the floor",
        ),
        "negatives": (
            where,
            each(lambda _, s: s.negatives if isinstance(s, Point) else np.nan),
            "1",
            "number of negative eigenvalues",
        ),
        "x": (("state", "node"), unit * middle[..., 0], "m", "mid-surface, horizontal; origin mid-strip"),
        "z": (("state", "node"), unit * middle[..., 1], "m", "mid-surface, height over the floor"),
        "arc": (("node",), unit * model.s, "m", "distance along the strip from the grasped end"),
    }
    ledger = [(phase, energy_of(state)) for phase, state in states]
    for name, long_name in LEDGER.items():
        known = [getattr(energy, name) if phase == FALL or name in IN_STATICS else np.nan for phase, energy in ledger]
        values = np.array(known, dtype=float)
        columns[name] = (where, force * unit * values, "J m-1", long_name)
    data = {name: (dims, values, {"units": u, "long_name": t}) for name, (dims, values, u, t) in columns.items()}
    phase = np.array([phase for phase, _ in states], dtype=object)
    attrs = {
        "eta_b": material.eta_b,
        "eta_m": material.eta_m,
        "nu": material.nu,
        "rho_a": material.rho_a,
        "gravity_length": unit,
        "thickness": material.thickness,
        "length": simulation.length,
        "height": simulation.height,
        "lambda_0": unit * run.lambda_0,
        "lambda_c": unit * run.last.lam,
        "touch_time": float("nan"),
        "touch_x": float("nan"),
        "settle_time": float("nan"),
        "end": found.end,
    }
    if motion:
        assert motion.touch is not None  # else there is no collapse
        attrs |= {"touch_time": time * motion.states[motion.touch].t, "touch_x": unit * motion.touch_x}
        if simulation.until == "rest":
            attrs["settle_time"] = time * motion.states[-1].t
    coords = {"phase": ("state", phase, {"units": "1", "long_name": "before lambda_c, fall, or after it"})}
    return xr.Dataset(data, coords=coords, attrs=attrs)


def _mean(model: Model, values: Array) -> Array:
    """Mean along the strip of nodal values, shape (..., columns)."""
    return np.asarray(values @ node_weights(model.s) / model.length)


def last_good(simulation: Simulation, error: TimeStepError) -> xr.Dataset:
    """The last good moment of a motion that could not be followed, for a look at what went wrong; SI."""
    unit, time = simulation.material.gravity_length, simulation.time_unit
    last: TimeState = error.last
    x, z = error.details["mid_surface"].T
    node = {"units": "m"}
    return xr.Dataset(
        {
            "x": ("node", unit * x, {**node, "long_name": "mid-surface, horizontal; origin mid-strip"}),
            "z": ("node", unit * z, {**node, "long_name": "mid-surface, height over the floor"}),
            "time": ((), time * last.t, {"units": "s", "long_name": "time since the fall began"}),
            "lambda": ((), unit * last.lam, {"units": "m", "long_name": "advance of the gripper past the flat end"}),
        },
        attrs={"error": str(error)},
    )
