"""The verdict on a path, in SI, as ``stripfold assess`` prints it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from stripfold.ask import select_model
from stripfold.ask.collapse_record import in_solver_units
from stripfold.ask.mesh_comparison import Events, MeshComparison, another_mesh, compared
from stripfold.ask.simulation import Release
from stripfold.base.errors import InvalidInputError, SolveError
from stripfold.base.material import Material
from stripfold.elastica import folded_loop
from stripfold.follow.contact_branch import STEPS, BranchPoint
from stripfold.follow.fall import Fall, assess_strip
from stripfold.follow.memory import STEP, effects_of, load_path
from stripfold.follow.phases import FALL
from stripfold.follow.statics import StripModel, remeshed
from stripfold.follow.time import follow_in_time
from stripfold.follow.track import (
    BUMP,
    StripState,
    Track,
    first_landing,
    lying_length,
    peak_forces,
    peak_push,
    peak_speed,
    shape_error,
    size_of_fall,
)
from stripfold.paths.curve import GripperPath
from stripfold.paths.rpath import HalfFold, half_fold
from stripfold.paths.table import largest_miss
from stripfold.strip.hysteresis import YIELD_CURVATURE

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
    states: tuple[StripState, ...] = field(repr=False)
    falls: tuple[tuple[int, tuple[StripState, ...]], ...] = field(default=(), repr=False, kw_only=True)
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
    moment = 0.0
    if friction_moment is None and pull is None:
        released = in_solver_units(Release(), material) if fall else None
        found = assess_strip(strip, path, released, refinement, progress)
        again = partial(_again, found, strip, path, released, coarser)
    else:
        law, strength = "pull", (pull or 0.0) * unit / material.gravity
        if friction_moment is not None:
            law, strength = "hysteresis", friction_moment / (material.force_scale * unit)
            moment = strength
        if step is not None and not 0.0 < step <= unit * path.length:
            allowed = f"more than 0 and at most {unit * path.length:.4g} m, the length of the path"
            raise InvalidInputError("step", step, allowed)
        size = min(STEP, path.length) if step is None else step / unit
        kappa_y = YIELD_CURVATURE if yield_curvature is None else yield_curvature * unit
        effects = effects_of(law, strength, kappa_y)
        found = load_path(strip.contact_mesh(refinement, memory=True), path, effects, size, progress)
        again = partial(load_path, strip.contact_mesh(coarser, memory=True), path, effects, size)
    events, failure, followed, touch = _events(found, material), found.failure, found, found.touch
    here = _summary(found)
    mesh = compared(here, another_mesh(lambda: _summary(again()), progress) if compare else here)
    if layer_friction is not None:
        if touch is not None:
            # These statics know no friction between the layers.
            events = []
        damping = in_solver_units(Release(), material).damping
        try:
            followed = follow_in_time(
                strip, path, layer_friction, moment, damping=damping, refinement=refinement, progress=progress
            )
        except SolveError as error:
            failure = error
        else:
            touch = followed.touch
            # Of the motion in time there is one run.
            mesh = replace(mesh, touch=float("nan"))
    said = "" if failure is None else material.in_si(" ".join(str(failure).split()))
    folded = strip.length if fold_at is None else 2.0 * fold_at / unit
    return _verdict(strip, material, path, events, touch.x if touch else float("nan"), followed, said, folded, mesh)


def _summary(found: Track) -> Events:
    """What is compared between meshes."""
    touch = found.touch.x if found.touch else float("nan")
    return Events(tuple(event.travelled for event in found.events), touch, found.failure is not None)


def _events(found: Track, material: Material) -> list[dict[str, Any]]:
    """The critical points, each with what the strip did there."""
    events, scales = [], material.scales
    for number, event in enumerate(found.events):
        given = event.travelled, event.kind, event.angle
        if number < len(found.falls):
            part = found.falls[number]
            motion = found.states[part]
            drop, energy = size_of_fall(found.states[part.start - 1], motion)
            outcome = "at rest without a touch" if first_landing(motion) is None else "fell to a touch"
            size = scales["m"] * drop, scales["J m-1"] * energy, scales["m s-1"] * peak_speed(motion)
            events.append(_event(*given, outcome, *size))
        elif number == len(found.falls) and found.failure is not None:
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


def _again(found: Track, strip: StripModel, path: GripperPath, fall: Fall | None, refinement: float) -> Track:
    """The path on another mesh; with a critical point from a step before the first event on."""
    first, piece = None, 0
    if found.events:
        begin = min(event.travelled for event in (*found.events, found.touch) if event is not None) - STEPS.largest
        near = [number for number, at in enumerate(found.points[found.parts[0]]) if at.point.lam < begin]
        if near and isinstance(at := found.points[near[-1]], BranchPoint):
            with suppress(SolveError):
                first = remeshed(at, strip.contact_mesh(refinement))
                piece = found.pieces[near[-1]]
    return assess_strip(strip, path, fall, refinement, first=first, piece=piece)


def _verdict(
    strip: StripModel,
    material: Material,
    path: GripperPath,
    events: list[dict[str, Any]],
    touch: float,
    found: Track,
    failure: str,
    folded_length: float,
    mesh: MeshComparison,
) -> Verdict:
    unit, force = material.gravity_length, material.force_scale
    states = found.static or found.states
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
        contact=found.contact,
        failure=failure,
        touch_change=unit * mesh.touch,
        mesh_dependence=material.in_si(mesh.said),
        states=states,
        falls=_falls(found),
    )


def _fold(length: float) -> HalfFold | None:
    """The accurate fold of a strip of this length, L*; none of one too short or too long for it."""
    try:
        return half_fold(length)
    except InvalidInputError:
        return None


def _falls(found: Track) -> tuple[tuple[int, tuple[StripState, ...]], ...]:
    """The falls, each with the static states before counted."""
    static = [phase != FALL for phase in found.phases]
    return tuple((sum(static[: part.start]), found.states[part]) for part in found.falls)
