"""One strip past its critical point: statics to lambda_c, dynamics to rest, statics again (the paper's section IV).

In units of L*, sqrt(L*/g) and rho_a g L*; :func:`dataset` converts to SI.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stripfold.ask.simulation import Release, Simulation
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError, TimeStepError
from stripfold.base.material import Material
from stripfold.files import schema
from stripfold.follow import needed_effects
from stripfold.follow.contact import lift_off
from stripfold.follow.contact_events import longest_free
from stripfold.follow.path_statics import State, follow
from stripfold.follow.phases import AFTER, BEFORE, FALL
from stripfold.follow.release import (
    Fall,
    Motion,
    Progress,
    ReleaseState,
    at_rest,
    simulate_fall,
)
from stripfold.follow.static import End, StripModel, XRun, solve_height
from stripfold.paths.curve import GripperPath, Interpolated
from stripfold.solve.dynamics import Energy, TimeState
from stripfold.solve.problem import Point
from stripfold.solve.schemes import Damping
from stripfold.strip.effects import LayerFriction
from stripfold.strip.model import Model
from stripfold.strip.problem import StripProblem
from stripfold.strip.self_contact import SelfContact

if TYPE_CHECKING:
    import xarray as xr

SPACING = 0.1
"""Largest distance of the nodes at which states are stored or compared, L*."""
ABOVE = "the gripper is above the held end"
LAYERS_MEET = "layers meet above the floor: statics do not know that contact"
AT_REST = "rest after the fall: statics do not know the friction between the layers"


@dataclass(frozen=True, eq=False)
class Collapse:
    """The whole: static run, fall (None where it was not asked for), and the static states from the state at rest on
    (empty if they were not)."""

    height: float
    run: XRun
    motion: Motion | None
    after: tuple[State, ...]
    end: str

    @property
    def before(self) -> list[State]:
        """The static states up to the critical one."""
        points = self.run.points
        return [at.problem.on_mesh(at.point) for at in points[: points.index(self.run.last) + 1]]

    @property
    def model(self) -> Model:
        """The strip on the mesh of the fall, or of the critical state."""
        return self.motion.problem.model if self.motion else self.run.last.model


def simulate(
    strip: StripModel,
    height: float,
    fall: Fall | None,
    refinement: float = 1.0,
    progress: Progress | None = None,
    self_contact: float | None = None,
    layer_friction: float = 0.0,
) -> Collapse:
    """Lift the strip, move its gripper to lambda_c, let it fall, and move on until the gripper is above the held end.

    Without a ``fall`` it ends at lambda_c.  ``self_contact`` is the thickness, L*, of layers that meet above the floor;
    None lets them go through each other.  ``layer_friction`` is the coefficient of friction between the layers and on
    the floor; with it the end is the strip at rest after its fall, as statics do not know it.

    Raises SolveError: there is no snap at this height, a part could not be computed, or the strip did not fall;
    TimeStepError: the motion could not be followed; with the last good moment.
    """
    say = progress or (lambda _: None)
    say("following the branch to its critical point")
    run = to_critical_point(strip, height, refinement)
    if fall is None:
        return Collapse(height, run, None, (), "the critical point: statics alone do not lead past it")
    release = ReleaseState.at(run.last, refinement)
    if self_contact is not None:
        layers = SelfContact.of(release.problem.model, self_contact)
        release = replace(release, problem=replace(release.problem, self_contact=layers))
    if layer_friction:
        problem, q = release.problem, release.point.q
        friction = LayerFriction.of(problem.model, layer_friction, q, problem.reaction)
        release = replace(release, problem=replace(problem, effects=(friction,)))
    motion = simulate_fall(release, fall, progress=say)
    if motion.touch is None:
        raise SolveError("the strip came to rest without touching", parameter=motion.states[-1].lam)
    if not fall.to_rest:
        return Collapse(height, run, motion, (), "first touch")
    if layer_friction:
        return Collapse(height, run, motion, (), AT_REST)
    say("going on from the state at rest")
    after, end = go_on(strip, motion, height, refinement)
    return Collapse(height, run, motion, after, end)


def to_critical_point(strip: StripModel, height: float, refinement: float = 1.0) -> XRun:
    """The static run.

    Raises SolveError: it cannot be computed, or there is no snap at this height.
    """
    run = solve_height(strip, height, refinement)
    if run.critical is None:
        raise SolveError(f"there is no fall to follow: {run.end.reason}", advice="choose a height that snaps")
    return run


def go_on(strip: StripModel, motion: Motion, height: float, refinement: float = 1.0) -> tuple[tuple[State, ...], str]:
    """Follow the settled strip until its gripper is above the held end; the states, and what ended the motion."""
    length, begin = strip.length, motion.states[-1].lam
    x = np.array([begin, length]) - length / 2.0
    along_x = Interpolated.through(np.column_stack([x, [height, height]]), begin, "along x")
    mesh, path = strip.contact_mesh(refinement), GripperPath("along x", (along_x,))
    segment = follow(mesh, path, length, at_rest(mesh, motion))
    layers, model = motion.problem.self_contact, motion.problem.model
    for i, (problem, point) in enumerate(segment.states):
        if layers is not None and layers.gap(problem.model.resampled(point.q, model.s)) < 0.0:
            return segment.states[:i], LAYERS_MEET
        if lift_off(problem.model, point) > longest_free(problem.model):
            return segment.states[: i + 1], End.LIFTED.value
    return segment.states, ABOVE if segment.critical is None else "another critical point"


ENERGIES = ("kinetic", "elastic", "gravity", "work", "air", "viscous", "friction", "contact", "numerical", "closing")
"""Terms of the energy balance that are stored."""
IN_STATICS = ("kinetic", "elastic", "gravity")


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
    """Simulate and collect; see :func:`.collapse.simulate` for the errors raised."""
    return timed(simulation, progress)[0]


def timed(simulation: Simulation, progress: Progress | None = None) -> tuple[xr.Dataset, Clock]:
    """As :func:`run`, with the time taken beside the dataset, which is the same in every run."""
    asked, thickness = simulation.effects, simulation.material.relative_thickness
    strip = StripModel(simulation.length_star, thickness, simulation.nu, kind=simulation.model)
    fall = in_solver_units(simulation, simulation.material) if asked.inertia != "off" else None
    layers = thickness if asked.self_contact != "off" else None
    mu = simulation.layer_friction if asked.layer_friction != "off" else 0.0
    began = perf_counter()
    found = simulate(strip, simulation.height_star, fall, progress=progress, self_contact=layers, layer_friction=mu)
    whole = perf_counter() - began
    record, self_contact = needed_effects.record(simulation, found)
    return dataset(simulation, found).merge(record).assign_attrs(record.attrs), Clock(whole, self_contact)


def nodes(length: float) -> Array:
    """Distances from the grasped end at which states are stored or compared, :data:`SPACING` or less apart, L*."""
    return np.linspace(0.0, length, int(np.ceil(length / SPACING)) + 1)


def node_weights(s: Array) -> Array:
    """Length that each node stands for, shape of ``s``: the trapezoidal rule."""
    half = 0.5 * np.diff(s)
    return np.asarray(np.append(half, 0.0) + np.insert(half, 0, 0.0))


def dataset(simulation: Simulation, found: Collapse) -> xr.Dataset:
    """All states of a collapse.

    Returns
    -------
    Dataset over ``state`` and ``node``; ``phase`` says of each state whether it is static before lambda_c, in the fall,
    or static after it.
    """
    material, motion, run = simulation.material, found.motion, found.run
    length = found.model.length
    arc = nodes(length)
    # Each with its problem.
    states: list[tuple[str, StripProblem, Point | TimeState]] = [(BEFORE, *state) for state in found.before]
    states += [(FALL, motion.problem, m) for m in motion.states] if motion else []
    states += [(AFTER, *state) for state in found.after]

    def each(get: Callable[[Point | TimeState], float]) -> Array:
        return np.array([get(state) for *_, state in states], dtype=float)

    def energy_of(problem: StripProblem, state: Point | TimeState) -> Energy:
        return state.energy if isinstance(state, TimeState) else Energy(0.0, *problem.energies(state.q))

    def of_balance(phase: str, energy: Energy, name: str) -> float:
        return float(getattr(energy, name)) if phase == FALL or name in IN_STATICS else np.nan

    middle = np.stack([problem.model.resampled_mid_surface(state.q, arc) for _, problem, state in states])
    moved = np.sqrt(np.sum((middle - middle[0]) ** 2, axis=2) @ node_weights(arc) / length)
    energies = [(phase, energy_of(problem, state)) for phase, problem, state in states]
    columns = {
        "time": each(lambda s: s.t if isinstance(s, TimeState) else np.nan),
        "advance": each(lambda s: s.lam),
        "deflection": moved,
        "contacts": each(lambda s: len(s.active)),
        "minimal_gap": np.array([np.min(state.q[problem.bounded]) for _, problem, state in states]),
        "negatives": each(lambda s: s.negatives if isinstance(s, Point) else np.nan),
        **{name: np.array([of_balance(phase, e, name) for phase, e in energies]) for name in ENERGIES},
    }
    touched = ended = nan = float("nan")
    if motion:
        assert motion.touch is not None  # else there is no collapse
        touched, ended = motion.states[motion.touch].t, motion.states[-1].t
    scalars = {
        "gripper_height": simulation.height_star,
        "lambda_0": run.lambda_0,
        "lambda_c": run.lam,
        "touch_time": touched,
        "touch_x": motion.touch_x if motion else nan,
        "settle_time": ended if simulation.until == "rest" else nan,
    }
    attrs = {
        **material.attributes,
        "thickness": material.thickness,
        "length": simulation.length,
        "end": found.end,
    }
    on = ("state", "node")
    return schema.dataset(
        {
            **{name: ((), value) for name, value in scalars.items()},
            **{name: ("state", values) for name, values in columns.items()},
            **{"x": (on, middle[..., 0]), "z": (on, middle[..., 1]), "arc": ("node", arc)},
            "phase": ("state", [phase for phase, *_ in states]),
        },
        attrs,
        material.scales,
    )


def last_good(simulation: Simulation, error: TimeStepError) -> xr.Dataset:
    """The last good moment of a motion that could not be followed, for a look at what went wrong; SI."""
    last: TimeState = error.last
    x, z = error.details["mid_surface"].T
    values = {"x": ("node", x), "z": ("node", z), "time": ((), last.t), "advance": ((), last.lam)}
    return schema.dataset(values, {"error": str(error)}, simulation.material.scales)
