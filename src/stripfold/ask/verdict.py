"""The verdict on a path, in SI, as ``stripfold assess`` prints it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import accumulate
from typing import Any

import numpy as np

from stripfold.ask import select_model
from stripfold.ask.inputs import Release
from stripfold.ask.mesh_comparison import Events, MeshComparison, another_mesh, compared
from stripfold.base.errors import InvalidInputError, SolveError
from stripfold.base.material import Material
from stripfold.base.percent import Percent
from stripfold.elastica import folded_loop
from stripfold.follow.assess import (
    BUMP,
    SNAP,
    Assessment,
    Followed,
    assess_strip,
    lying_length,
    peak_forces,
    peak_push,
    peak_speed,
    shape_error,
    size_of_fall,
)
from stripfold.follow.collapse import in_solver_units
from stripfold.follow.contact import touch_position, touches
from stripfold.follow.contact_branch import STEPS
from stripfold.follow.contact_set import from_nodes
from stripfold.follow.path_friction import STEP, Effects, Step, effects_of, load_incrementally, until_lost
from stripfold.follow.path_in_time import follow_in_time
from stripfold.follow.path_statics import MOVING, NODAL
from stripfold.follow.release import Fall, Motion
from stripfold.follow.static import StripModel
from stripfold.paths.curve import GripperPath
from stripfold.paths.rpath import HalfFold, half_fold
from stripfold.paths.table import largest_miss
from stripfold.solve.problem import Point
from stripfold.strip.hysteresis import YIELD_CURVATURE
from stripfold.strip.problem import StripProblem

NOT_FOLLOWED = "not followed: the statics end here"


@dataclass(frozen=True, eq=False)
class Verdict:
    """The assessment of a path; lengths in m, forces in N per m of width, nan where undefined.

    :class:`.PathAssessment` describes the attributes; ``states`` are the states followed, static or in time, in L*,
    each with the problem that it solves; ``falls`` are those between them, each with the states before counted.
    """

    stable: bool
    critical: tuple[Mapping[str, Any], ...]
    touch_x: float
    planned_touch_x: float
    touch_error: float
    landing_x: float
    shape_error: float
    lying_length: float
    peak_force: float
    peak_hold: float
    peak_push: float
    push_z: float
    bump: float
    folded: bool
    end_error: float
    completed: bool
    contact: str
    failure: str
    states: tuple[Followed, ...] = field(repr=False)
    falls: tuple[tuple[int, Motion], ...] = field(default=(), repr=False, kw_only=True)
    touch_change: float = field(default=float("nan"), kw_only=True)
    mesh_dependence: str = field(default="", kw_only=True)


def assess_path(
    material: Material,
    length: float,
    path: GripperPath,
    *,
    fall: bool = False,
    friction_moment: float | None = None,
    pull: float | None = None,
    yield_curvature: float | None = None,
    layer_friction: float | None = None,
    step: float | None = None,
    refinement: float = 1.0,
    model: str = "solid",
    fold_at: float | None = None,
    compare: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Verdict:
    """Assess a path; with friction in steps, without along the branch; with friction between the layers in time, too.

    Parameters
    ----------
    material, length
        The strip; m.
    path
        The gripper's path, in L*.
    fall
        Whether to simulate falls at critical points, without friction; else the first of them is the end.
    friction_moment
        The bending hysteresis' M_0, N.
    yield_curvature
        Its kappa_y, 1/m; 0.05 / L* where it is not given.
    pull
        The paper's k_f, s^-2.
    layer_friction
        Coefficient of friction between the layers and on the floor.  The critical points are then those of statics
        before the first touch, all else is of a motion in time with a slow gripper.
    step
        Size of the steps with either, m.
    refinement
        Factor on all element lengths.
    model
        "solid" or "rod".
    fold_at
        Distance of the fold line from the gripped end, m; by default half the length.
    compare
        Whether to follow the path on another mesh, too.

    Raises
    ------
    InvalidInputError, SolveError
        Bad input; statics that could not be computed.  A fall or a motion that could not be is said in ``failure``.
    """
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu, kind=model)
    coarser = select_model.COARSER * refinement
    if friction_moment is None and pull is None:
        released = in_solver_units(Release(), material) if fall else None
        found = assess_strip(strip, path, released, refinement, progress)
        events, failure = _events(found, material), found.failure
        again: Callable[[], Events] = partial(_again, found, strip, path, released, coarser)
        touch = found.touch.x if found.touch else float("nan")
        states, contact = list[Followed](found.states), found.contact
        ends = accumulate(len(segment.states) for segment in found.segments)
        falls = tuple(zip(ends, found.motions, strict=False))
    else:
        law, strength = "pull", (pull or 0.0) * unit / material.gravity
        if friction_moment is not None:
            law, strength = "hysteresis", friction_moment / (material.force_scale * unit)
        if step is not None and not 0.0 < step <= unit * path.length:
            allowed = f"more than 0 and at most {unit * path.length:.4g} m, the length of the path"
            raise InvalidInputError("step", step, allowed)
        size = min(STEP, path.length) if step is None else step / unit
        kappa_y = YIELD_CURVATURE if yield_curvature is None else yield_curvature * unit
        effects = effects_of(law, strength, kappa_y)
        stepped, lost, touch = _with_friction(strip, path, effects, size, refinement, progress)
        events = [_event(lost, SNAP, float("nan"))] if lost is not None else []

        def stepped_again() -> Events:
            _, lost, touch = _with_friction(strip, path, effects, size, coarser, None)
            return Events(() if lost is None else (lost,), touch)

        again = stepped_again
        states, contact, failure = list[Followed](stepped), MOVING, None
        falls = ()
    here = Events(tuple(event["travelled"] for event in events), touch, failure is not None)
    mesh = compared(here, another_mesh(again, progress) if compare else here)
    if layer_friction is not None:
        if not np.isnan(touch):
            # These statics know no friction between the layers.
            events = []
        damping = in_solver_units(Release(), material).damping
        moment = 0.0 if friction_moment is None else strength
        try:
            moved = follow_in_time(
                strip, path, layer_friction, moment, damping=damping, refinement=refinement, progress=progress
            )
        except SolveError as error:
            failure = error
        else:
            states, touch, contact = list(moved.states), moved.touch_x, NODAL
            falls = ()
            # Of the motion in time there is one run.
            mesh = replace(mesh, touch=float("nan"))
    said = "" if failure is None else material.in_si(" ".join(str(failure).split()))
    folded = strip.length if fold_at is None else 2.0 * fold_at / unit
    return _verdict(strip, material, path, events, touch, states, falls, contact, said, folded, mesh)


def _events(found: Assessment, material: Material) -> list[dict[str, Any]]:
    """The critical points, each with what the strip did there."""
    events = []
    for number, event in enumerate(found.events):
        given = event.travelled, event.kind, event.angle
        if number < len(found.motions):
            motion = found.motions[number]
            drop, energy = size_of_fall(found.segments[number].states[-1], motion)
            outcome = "at rest without a touch" if motion.touch is None else "fell to a touch"
            scales = material.scales
            size = scales["m"] * drop, scales["J m-1"] * energy, scales["m s-1"] * peak_speed(motion)
            events.append(_event(*given, outcome, *size))
        elif number == len(found.motions) and found.failure is not None:
            events.append(_event(*given, outcome="the fall could not be followed to rest"))
        else:
            events.append(_event(*given))
    return events


def _event(
    travelled: float,
    kind: str,
    angle: float,
    outcome: str = NOT_FOLLOWED,
    drop: float = float("nan"),
    energy: float = float("nan"),
    speed: float = float("nan"),
) -> dict[str, Any]:
    given = {"travelled": travelled, "kind": kind, "angle": angle}
    return {**given, "drop": drop, "energy": energy, "speed": speed, "outcome": outcome}


def _with_friction(
    strip: StripModel,
    path: GripperPath,
    effects: Effects,
    size: float,
    refinement: float,
    progress: Callable[[str], None] | None,
) -> tuple[list[tuple[StripProblem, Point]], float | None, float]:
    """The states with friction, the length travelled at which the strip was lost, if it was, and x of the touch."""
    mesh = strip.contact_mesh(refinement, memory=True)
    loaded = Percent(progress, "following the path with friction")

    def told() -> Iterator[Step]:
        for step in load_incrementally(mesh, path, effects, size):
            loaded(step.lam / path.length)
            yield step

    steps, lost = until_lost(told())
    states = [step.on_mesh for step in steps]
    touch = next((touch_position(p.model, point) for p, point in states if touches(p.model, point)), float("nan"))
    return states, lost, touch


def _again(found: Assessment, strip: StripModel, path: GripperPath, fall: Fall | None, refinement: float) -> Events:
    """The events on another mesh; of a path with a critical point from a step before the first event on."""
    segment, first, piece = found.segments[0], None, 0
    if found.events:
        begin = min(event.travelled for event in (*found.events, found.touch) if event is not None) - STEPS.largest
        near = [number for number, point in enumerate(segment.points) if point.lam < begin]
        with suppress(SolveError):
            if near:
                first = from_nodes(strip.contact_mesh(refinement), *segment.states[near[-1]])
                piece = segment.pieces[near[-1]]
    other = assess_strip(strip, path, fall, refinement, first=first, piece=piece)
    return Events(
        tuple(event.travelled for event in other.events),
        other.touch.x if other.touch else float("nan"),
        other.failure is not None,
    )


def _verdict(
    strip: StripModel,
    material: Material,
    path: GripperPath,
    events: list[dict[str, Any]],
    touch: float,
    states: list[Followed],
    falls: tuple[tuple[int, Motion], ...],
    contact: str,
    failure: str,
    folded_length: float,
    mesh: MeshComparison,
) -> Verdict:
    unit, force = material.gravity_length, material.force_scale
    problem, last = states[-1]
    peak_force, peak_hold = peak_forces(states)
    completed = abs(last.lam - path.length) < 1e-6
    fold, fold_line = _fold(folded_length), 0.5 * (folded_length - strip.length)
    planned, landing = (fold.first_touch, fold.landing) if fold else (float("nan"), float("nan"))
    planned, landing = planned + fold_line, landing + fold_line
    end = np.array([fold_line + folded_length / 2.0, 0.0])
    end_error = float(np.linalg.norm(path.position(last.lam) - end))
    in_place = completed and end_error <= largest_miss(strip.length, unit)
    distance = shape_error(problem, last, fold) if fold and in_place else float("nan")
    push, push_z = peak_push(states)
    critical = []
    for number, event in enumerate(events):
        x, z = unit * path.position(event["travelled"])
        travelled = event["travelled"]
        place = {"t": path.pseudo_time(travelled), "row": path.row(travelled), "x": float(x), "z": float(z)}
        known = {key: value for key, value in event.items() if key != "travelled"}
        critical.append(place | known | {"change": unit * mesh.critical[number]})
    return Verdict(
        stable=not events,
        critical=tuple(critical),
        touch_x=unit * touch,
        planned_touch_x=unit * planned,
        touch_error=unit * (touch - planned),
        landing_x=unit * landing,
        shape_error=unit * distance,
        lying_length=unit * lying_length(problem, last),
        peak_force=force * peak_force,
        peak_hold=force * peak_hold,
        peak_push=force * push,
        push_z=unit * push_z,
        bump=unit * BUMP / push**2 if push else float("nan"),
        folded=bool(distance <= folded_loop().height),
        end_error=unit * end_error,
        completed=completed,
        contact=contact,
        failure=failure,
        touch_change=unit * mesh.touch,
        mesh_dependence=material.in_si(mesh.said),
        states=tuple(states),
        falls=falls,
    )


def _fold(length: float) -> HalfFold | None:
    """The accurate fold of a strip of this length, L*; none of one too short or too long for it."""
    try:
        return half_fold(length)
    except InvalidInputError:
        return None
