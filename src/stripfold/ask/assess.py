"""A gripper path assessed: critical points, falls, touch, fold and forces, in SI, and how they depend on the mesh."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property
from math import inf, isfinite, isnan, nan
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from stripfold.ask.collapse import in_solver_units
from stripfold.ask.friction import refinement_of
from stripfold.ask.inputs import THIN_SOLID, PathInputs, Release
from stripfold.ask.second_gripper import SecondOnPath, second_on_path
from stripfold.ask.select_model import COARSER
from stripfold.base.arguments import checked, file_name
from stripfold.base.arrays import Array
from stripfold.base.errors import CrushedError, InvalidInputError, SolveError
from stripfold.base.material import Material
from stripfold.base.numerics import root
from stripfold.base.progress import AFTER, BEFORE, FALL, SLOW
from stripfold.elastica import folded_loop
from stripfold.files import schema
from stripfold.files.reporting import Progress, Result, Rows, metres
from stripfold.files.tables import read_table
from stripfold.follow.contact_branch import STEPS, BranchPoint, Planned
from stripfold.follow.fall import TIME_OPTIONS, Fall, assess_strip, size_of_fall
from stripfold.follow.memory import FIRST_WITH_FRICTION, STEP, Effects, effects_of, load_path
from stripfold.follow.slide import slide_of, slides_on
from stripfold.follow.statics import StripModel, branch, remeshed
from stripfold.follow.time import SPEED, Ridge, follow_in_time, rucks
from stripfold.follow.track import (
    BUMP,
    BUMP_ENERGY,
    COMPRESSION,
    WAVE,
    End,
    StripState,
    Track,
    first_landing,
    forces_of,
    friction_to_hold,
    grip_angles,
    hold_frictions,
    lying_length,
    mid_surfaces,
    on_mesh,
    peak_forces,
    peak_moment,
    peak_push,
    peak_speed,
    shape_error,
    tool_room,
)
from stripfold.paths import FoldPath
from stripfold.paths.curve import GripperPath
from stripfold.paths.motion import StampedPath
from stripfold.paths.rpath import half_fold
from stripfold.paths.table import SPACING, largest_miss
from stripfold.solve.dynamics import TimeState
from stripfold.solve.problem import Point
from stripfold.strip.effects import MomentCurvature, split_loop

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

NODES = 201
"""Nodes along the strip at which states on a path are stored: their own meshes differ."""
NOT_FOLLOWED, IN_TIME = "not followed: the statics end here", "the statics end here; the motion in time goes on"
SPEEDS = 1e-4, 10.0
"""Mean speeds of a table's own times that can be followed, m/s."""
HALVED = 0.5
"""Ratio of the lengths of the elements on the mesh that a thin solid is compared with: coarser ones lead to the same
side of a bifurcation."""


@dataclass(frozen=True, eq=False, repr=False)
class PathAssessment(Result):
    """A gripper path assessed for a strip; lengths in m, forces in N per m of width, nan where there is no such thing.

    Source: the paper's section IV; docs/physics.md, sections 5, 8 and 9.

    Attributes
    ----------
    stable
        Whether the strip follows all of the path.
    critical
        Its critical points: ``t``, ``x``, ``z`` of the gripper, ``kind``, the last ``row`` before it of a path from a
        file, the ``angle`` with the stability boundary in degrees, and how large the event is: ``drop``, the largest
        height that a point of the strip loses until it is at rest with the gripper at the same place, m, the ``energy``
        freed, J per m of width, and the largest ``speed`` of a point, m/s; nan without a fall.  ``outcome``: in words
        what the strip did; ``change``: by how much farther along the path it lies on another mesh, m; nan where that
        mesh has none.
    touch_x, planned_touch_x, touch_error
        Where the upper layer first touches, where that of the strip's planned R-path does (the accurate fold), and the
        difference.  The fold line is at x = 0, for a half fold.
    landing_x
        Where the folded state lands.
    shape_error
        Largest distance of the last state from the folded one; nan for a path that ends elsewhere.
    folded, end_error
        Whether the last state is the folded one: the path is at its end, the strip's end within 5 mm and 5 % of the
        length of its place, and all of the strip within the height of a fold, 0.907 L*, of its own.  ``end_error`` is
        the distance of the end from its place.
    lying_length
        Length that lies from the held end in the last state.
    peak_force, peak_hold
        Largest force of the gripper, and horizontal force of the held end, in the static states.
    hold_friction
        Coefficient of friction of the table that would hold what lies without the pin, in the static states; nan of a
        motion in time.
    slip_t, slip_x, slip_z
        Pseudo-time and place of the gripper where what lies begins to slide with the ``table_friction`` of the inputs;
        nan where it does not, or is pinned.
    slide, slide_t
        How far it has slid along x in the last state; 0 without a slip.  ``slide_t``: the pseudo-time up to which that
        was followed, where it was not to the last state: the strip is lost there, or slides at once, and is taken as
        pinned from there on, as it is in a fall; else nan.
    peak_moment
        Largest moment of a clamp on the strip's end in the static states, N (per width); 0 of a hinge.
    largest_angle, tool_room
        Largest rotation of a gripper that turns with the strip, degrees, in the static states, 180 on the finished
        fold; and the length behind the grasp up to which a tool along it stays above the table, m; inf for any length.
    peak_push, push_z
        Largest push of the gripper on what lies, and its height then; 0 and nan without one.
    bump
        Height of a bump that would grow under this push, of small slopes: in the flat strip that is followed there is
        none.  A height of more than L* says no more than that no lower one grows; nan without a push.
    bump_energy
        Energy that it takes to raise this bump against the push, J/m; nan without a push.
    flatness_ratio
        Height of the lowest waves of the table from which this push lifts the strip, half of the bump's, over the
        ``flatness`` of the inputs: below 1 a wrinkle may grow to a ruck; inf without a push or with flatness 0.
    rucked
        Whether what lies rucks in time on a ridge of that height, as wide as the bump, behind the lift-off under the
        largest static push; None where statics alone were asked for, or say that nothing grows.
    duration
        Of the gripper's motion along the path, s; nan where it was not followed in time.
    completed
        Whether the path was followed to its end.
    contact
        "moving" where the ends of the contact were unknowns, "nodal" where it was found node by node, in a motion.
    failure
        Why the fall, or what comes after it, could not be followed; empty where it could or was not asked for.
    second_gripper
        How far the strip follows with a second gripper; None where none is asked for or there is no critical point.
    touch_change, mesh_dependence
        By how much farther the first touch lies on another mesh, with elements half as long again; and in words what
        else is different there, empty where the verdict is the same.  A motion in time is of one mesh.
    path, asked, seconds
        The path, the other inputs, and the run time.
    states, falls
        The states followed, static or in time, in L*, each with the problem that it solves; and the falls between them,
        each with the number of states before it.
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
    hold_friction: float
    slip_t: float
    slip_x: float
    slip_z: float
    slide: float
    slide_t: float
    peak_moment: float
    largest_angle: float
    tool_room: float
    peak_push: float
    push_z: float
    bump: float
    bump_energy: float
    flatness_ratio: float
    rucked: bool | None
    folded: bool
    end_error: float
    duration: float
    completed: bool
    contact: str
    failure: str
    touch_change: float
    mesh_dependence: str
    seconds: float
    second_gripper: SecondOnPath | None
    path: FoldPath
    asked: PathInputs
    states: tuple[StripState, ...] = field(repr=False)
    falls: tuple[tuple[int, tuple[StripState, ...]], ...] = field(repr=False)
    title = "a gripper path assessed"
    shown = ("stable", "folded", "touch_x", "touch_error")

    def rows(self) -> Rows:
        return [
            ("stable", "yes" if self.stable else "no"),
            *(row for event in self.critical for row in self._event_rows(event)),
            ("folded", self._folded()),
            *([("failed", self.failure)] if self.failure else []),
            ("first touch", metres(self.touch_x, "x, origin mid-strip")),
            ("  planned", metres(self.planned_touch_x, "x of the first touch of the accurate fold, an R-path's")),
            ("  error", metres(self.touch_error, "beyond it" if self.touch_error > 0.0 else "short of it")),
            ("landing", metres(self.landing_x, "x where the folded state lands")),
            ("shape error", metres(self.shape_error, "largest distance of the last state from the folded one")),
            ("lying", metres(self.lying_length, "length from the held end in the last state")),
            ("peak force", f"{self.peak_force:.4g} N/m  (gripper, per width)"),
            ("peak hold", self._held()),
            *([] if self.asked.gripper == "hinge" else [("peak moment", self._clamped())]),
            ("gripper", self._turned()),
            ("peak push", self._push()),
            *([] if isnan(self.duration) else [("motion", self._motion())]),
            ("completed", self._completed()),
            *self._second_rows(),
            *([("model", f"rod: thinner than {THIN_SOLID:g} L*")] if self._is_thin() else []),
            ("mesh", self._mesh()),
            ("time", f"{self.seconds:.1f} s"),
        ]

    def _is_thin(self) -> bool:
        return self.asked.model is None and self.asked.kind == "rod"

    def _mesh(self) -> str:
        """What another mesh says."""
        if self.mesh_dependence:
            return f"the verdict depends on it: {self.mesh_dependence}"
        far = max((abs(event["change"]) for event in self.critical if isfinite(event["change"])), default=0.0)
        points = f"; critical points within {far:.2g} m" if self.critical else ""
        touch = f"; first touch within {abs(self.touch_change):.2g} m" if isfinite(self.touch_change) else ""
        return f"{_other_mesh(self.asked)} the verdict is the same{points}{touch}"

    def _second_rows(self) -> Rows:
        if self.second_gripper is not None:
            return self.second_gripper.rows()
        none = ("2nd gripper", "none is needed: a rod follows the path without a critical point")
        return [] if self.asked.second_gripper is None else [none]

    @staticmethod
    def _event_rows(event: Mapping[str, Any]) -> Rows:
        row, after = (f"row {event['row']}, ", " after the first") if event["row"] else ("", "")
        place = f"{row}t = {event['t']:.4g}{after}, gripper at x = {event['x']:.4g} m, z = {event['z']:.4g} m"
        size = ""
        if isfinite(event["drop"]):
            size = f"; {event['drop']:.3g} m down, {event['energy']:.3g} J/m freed, up to {event['speed']:.3g} m/s"
        kind = event["kind"]
        if kind == COMPRESSION:
            kind += " (what lies gives way to the push: at another place with another eta_m or wrinkles)"
        return [("critical", f"{place}: {kind}"), ("  there", f"{event['outcome']}{size}")]

    def _folded(self) -> str:
        place = f"the end is {1e3 * self.end_error:.1f} mm from its place"
        if isfinite(self.shape_error) and not self.folded:
            return f"no: the strip is {1e3 * self.shape_error:.1f} mm from its folded state, {place}"
        if isnan(self.landing_x):
            return f"no: no folded state is known of a strip of this length; {place}"
        return f"{'yes' if self.folded else 'no'}: {place}"

    @property
    def may_ruck(self) -> bool:
        """Whether wrinkles grow, in time where that was asked for."""
        return self.flatness_ratio < 1.0 if self.rucked is None else self.rucked

    @property
    def slips(self) -> bool:
        """Whether what lies slides with the ``table_friction`` of the inputs."""
        return isfinite(self.slip_t)

    @property
    def slide_known(self) -> bool:
        """Whether it was followed while it slides, to the last state."""
        return isnan(self.slide_t)

    def _held(self) -> str:
        """The force at the held end, and what the table would have to do without it."""
        said = f"{self.peak_hold:.4g} N/m  (horizontal, at the held end"
        if not isnan(self.hold_friction):
            said += f"; without a pin, friction of {self.hold_friction:.2g} on the table"
        if self.slips:
            place = f"t = {self.slip_t:.4g}, gripper at x = {self.slip_x:.4g} m, z = {self.slip_z:.4g} m"
            far = f"{1e3 * self.slide:.1f} mm along x"
            said += f": with {self.asked.table_friction:g} it slides by {far}, from {place} on"
        if not self.slide_known:
            said += f"; after t = {self.slide_t:.4g} it is lost or slides at once, and is taken as pinned"
        return f"{said})"

    def _clamped(self) -> str:
        how = {"fixed": "does not turn", "turning": "turns as the path says"}[self.asked.gripper]
        return f"{self.peak_moment:.4g} N  (of the clamp, per width; it {how})"

    def _turned(self) -> str:
        """How far the gripper turns, and which tool that allows."""
        room = "any tool" if self.tool_room == inf else f"a tool of up to {1e3 * self.tool_room:.0f} mm"
        return f"turns to {self.largest_angle:.0f} degrees with the strip; {room} behind it stays above the table"

    def _push(self) -> str:
        """The push on what lies, and the bump that would grow under it."""
        if not self.peak_push:
            return "none"
        unit = self.asked.gravity_length
        bump = f"a bump of {1e3 * self.bump:.2g} mm would grow under it, which takes {1e3 * self.bump_energy:.2g} mJ/m"
        flatness = f"{1e3 * self.asked.flatness:.2g} mm"
        if self.rucked is not None:
            bump += f"; on a ridge of {flatness} it {'rucks' if self.rucked else 'does not ruck'} in time"
        elif self.may_ruck:
            bump += f", and wrinkles may be {flatness} high: it may ruck"
        if self.bump > unit:
            bump = f"no bump lower than {1e3 * unit:.2g} mm grows under it"
        return f"{self.peak_push:.4g} N/m  (on what lies, gripper {1e3 * self.push_z:.1f} mm high; {bump})"

    def _motion(self) -> str:
        mean = self.path.curve.length / self.duration
        return f"{self.duration:.3g} s of the gripper, {mean:.3g} m/s in the mean, and on to rest"

    def _completed(self) -> str:
        if self.completed:
            return "yes"
        if self.failure:
            return "no: what follows the last state could not be computed"
        return "no: the statics end at the critical point" if self.critical and not self.asked.fall else "no"

    def to_dict(self) -> dict[str, Any]:
        left_out = ("second_gripper", "path", "asked", "states", "falls")
        values = {item.name: getattr(self, item.name) for item in fields(self) if item.name not in left_out}
        second = {} if self.second_gripper is None else {"second_gripper": asdict(self.second_gripper)}
        return values | {"critical": [dict(event) for event in self.critical]} | second

    def to_dataset(self) -> xr.Dataset:
        """Numbers and states as variables, truth values and texts as attributes."""
        found = {name: value for name, value in self.to_dict().items() if name != "seconds"}
        values: dict[str, Any] = {name: ((), value) for name, value in found.items() if isinstance(value, float)}
        states, unit = self._mid_surfaces(self.states), self.asked.gravity_length
        values |= {
            "pseudo_time": ("state", [self.path.curve.pseudo_time(unit * point.lam) for _, point in self.states]),
            "x": (("state", "node"), states[..., 0]),
            "z": (("state", "node"), states[..., 1]),
            "kind": ("event", [event["kind"] for event in self.critical]),
        }
        for key in ("t", "x", "z", "angle", "drop", "energy", "speed", "change"):
            values[f"critical_{key}"] = ("event", np.array([event[key] for event in self.critical], dtype=float))
        for key in ("s", "x", "z", "snap") if self.second_gripper else ():
            values[f"second_{key}"] = ((), float(getattr(self.second_gripper, key)))
        attrs = {name: int(said) if isinstance(said, bool) else said for name, said in found.items()}
        return schema.dataset(values, {name: said for name, said in attrs.items() if isinstance(said, int | str)})

    def _mid_surfaces(self, states: Sequence[StripState]) -> Array:
        """Shape (states, nodes, 2), m, where the table is: what lies has slid on it."""
        shapes = mid_surfaces(states, np.linspace(0.0, self.asked.length_star, NODES))
        shapes[..., 0] += np.array([slide_of(state) for state in states])[:, None]
        return self.asked.gravity_length * shapes

    def plot(self) -> Figure:
        """Draw the strip along the path; critical points are crosses, states after a fall green."""
        from stripfold.draw.results import draw_strip

        states = self._mid_surfaces(self.states)
        before = self.falls[0][0] if self.falls else len(states)
        parts = [
            [states[i] for i in np.unique(np.linspace(first, last - 1, 12).astype(int))] if last > first else []
            for first, last in ((0, before), (before, len(states)))
        ]
        marks = np.array([(event["x"], event["z"]) for event in self.critical]).reshape(-1, 2)
        return draw_strip(parts[0], self.path.places[:, 1:], marks, parts[1])

    @checked
    def film(self, file: str | os.PathLike[str], progress: Progress | None = None) -> None:
        """Draw it as an MP4 film, with the falls that were followed."""
        from stripfold.base.errors import require

        require("vision")
        from stripfold.draw import collapse_curve, film

        ordered = [(SLOW if isinstance(state[1], TimeState) else BEFORE, state) for state in self.states]
        if self.falls:
            first = self.falls[0][0]
            ordered[first:] = [(AFTER, state) for _, state in ordered[first:]]
        for before, motion in reversed(self.falls):
            ordered[before:before] = [(FALL, state) for state in motion]
        phase, states = (list(part) for part in zip(*ordered, strict=True))
        second = self.asked.material.scales["s"]
        followed = collapse_curve.Followed(
            phase=np.array(phase),
            time=np.array([second * state.t if isinstance(state, TimeState) else nan for _, state in states]),
            advance=self.asked.gravity_length * np.array([state.lam for _, state in states]),
            states=self._mid_surfaces(states),
        )
        film.draw(followed, file_name("file", file), "way", progress=progress)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PathAssessment) and self.path == other.path and super().__eq__(other)

    def config(self) -> dict[str, Any]:
        model, path = self.asked.kind, self.path
        return {**self.asked.model_dump(), "model": model, "path": path.name, "fold_at": path.fold_at}


def assess(
    asked: PathInputs,
    path: FoldPath,
    progress: Progress | None = None,
    *,
    yield_curvature: float | None = None,
    refinement: float = 1.0,
    compare: bool = True,
    tolerance: float = TIME_OPTIONS.tolerance,
) -> PathAssessment:
    """Assess a path: with friction in steps, without along the branch; with friction between the layers in time, too.

    ``yield_curvature``: kappa_y of the hysteresis, 1/m, or the usual one.  ``refinement``: factor on element lengths.
    ``compare``: whether to follow the path on another mesh, too.  ``tolerance``: error of a fall per step, L*.

    Raises InvalidInputError: bad input; SolveError: statics that could not be computed.  A fall or a motion that could
    not be is said in ``failure``.
    """
    began, material, unit = perf_counter(), asked.material, asked.gravity_length
    moved = _Moved.of(asked, path, yield_curvature, refinement, tolerance)
    strip, curve = moved.strip, moved.curve
    try:
        found = moved.followed(curve, progress=progress)
    except SolveError as error:
        error.args = (f"{_where(error, asked, curve)}{error}",)
        raise
    held = _Held(found, curve) if asked.layer_friction is not None else _on_table(moved, found, progress)
    found, way = held.found, held.way
    changes, touch_change, dependence = (nan,) * len(found.events), nan, ""
    if compare:
        if progress is not None:
            progress("on another mesh")
        changes, touch_change, dependence = _compared(moved, found, way)
    events, failure, rucked, duration = _events(found, material, curve, changes), found.failure, None, nan
    if asked.layer_friction is not None:
        if found.touch is not None:  # these statics know no friction between the layers
            events = []
        try:
            found, rucked = _in_time(moved, found, progress)
        except SolveError as error:
            failure = error
        else:
            touch_change = nan  # of the motion in time there is one run
            events = [event | {"outcome": IN_TIME} for event in events]
            duration = moved.duration
    second = None
    if asked.second_gripper is not None:
        second = second_on_path(material, asked.length, curve, asked.second_gripper)

    folded_length = strip.length if path.fold_at is None else 2.0 * path.fold_at / unit
    fold, fold_line = None, 0.5 * (folded_length - strip.length)
    with suppress(InvalidInputError):  # a strip too short or too long for one
        fold = half_fold(folded_length)
    planned, landing = (fold.first_touch + fold_line, fold.landing + fold_line) if fold else (nan, nan)
    states = found.static or found.states
    forces, (problem, last) = found.forces if found.static else forces_of(states), states[-1]
    laid_flat = found.end is End.FLAT
    completed = laid_flat or bool(abs(last.lam - curve.length) < 1e-6)
    end = np.array([fold_line + folded_length / 2.0, 0.0])
    end_error = float(np.linalg.norm(way.position(last.lam) - end))
    in_place = completed and end_error <= largest_miss(strip.length, unit)
    distance = shape_error(problem, last, fold) if fold and in_place else nan
    peak_force, peak_hold = peak_forces(forces)
    slip_x, slip_z = (nan, nan) if isnan(held.slip) else (unit * curve.position(held.slip)).tolist()
    angles = grip_angles(states)
    push, push_z = peak_push(states, forces)
    bump, bump_energy = (BUMP / push**2, BUMP_ENERGY / push**2.5) if push else (nan, nan)
    return PathAssessment(
        stable=not events,
        critical=tuple(events),
        touch_x=unit * found.touch_x,
        planned_touch_x=unit * planned,
        touch_error=unit * (found.touch_x - planned),
        landing_x=unit * landing,
        shape_error=unit * distance,
        lying_length=unit * lying_length(problem, last),
        peak_force=material.force_scale * peak_force,
        peak_hold=material.force_scale * peak_hold,
        hold_friction=held.friction,
        slip_t=nan if isnan(held.slip) else curve.pseudo_time(held.slip),
        slip_x=slip_x,
        slip_z=slip_z,
        slide=unit * slide_of(states[-1], way.length if laid_flat else None),
        slide_t=held.slide_t,
        largest_angle=float(np.degrees(angles.max())),
        tool_room=unit * tool_room(states, angles),
        peak_moment=material.scales["N"] * peak_moment(states),
        peak_push=material.force_scale * push,
        push_z=unit * push_z,
        bump=unit * bump,
        bump_energy=material.scales["J m-1"] * bump_energy,
        flatness_ratio=_flatness_ratio(push, asked),
        rucked=rucked,
        folded=bool(distance <= folded_loop().height),
        end_error=unit * end_error,
        duration=duration,
        completed=completed,
        contact=found.contact,
        failure="" if failure is None else material.in_si(" ".join(str(failure).split())),
        touch_change=unit * touch_change,
        mesh_dependence=material.in_si(dependence),
        seconds=perf_counter() - began,
        second_gripper=second,
        path=path,
        asked=asked,
        states=states,
        falls=tuple((_statics(found, part.start), found.states[part]) for part in found.falls),
    )


@dataclass(frozen=True, eq=False)
class _Moved:
    """What is moved, in solver units: the strip, the path of its gripper, and its effects, which may have a memory.

    ``moment``: M_0.  ``size``, ``begin``: of the steps with a memory, as for :func:`.load_path`.  ``refinement``:
    factor on the lengths of the elements.
    """

    asked: PathInputs
    strip: StripModel
    curve: GripperPath
    fall: Fall | None
    effects: Effects
    memory: bool
    moment: float
    size: float
    begin: float
    refinement: float

    @classmethod
    def of(
        cls, asked: PathInputs, path: FoldPath, yield_curvature: float | None, refinement: float, tolerance: float
    ) -> Self:
        """Arguments and errors of bad input as for :func:`assess`."""
        material, unit = asked.material, asked.gravity_length
        curve = replace(path.curve.scaled(1.0 / unit), gripper=asked.gripper)
        if asked.gripper == "turning" and not curve.turns:
            advice = "an R-path says how its gripper turns, and a table with a column angle, degrees"
            raise InvalidInputError("gripper", asked.gripper, "hinge or fixed on this path", advice)
        if asked.speed == "table":
            if curve.stamps is None:
                raise InvalidInputError("speed", asked.speed, "a speed in m/s: this path is from no table")
            took = float(curve.stamps[1][-1])
            if not SPEEDS[0] <= unit * curve.length / took <= SPEEDS[1]:
                said = f"read as s, they let it take {took:.4g} s for {unit * curve.length:.3g} m"
                raise InvalidInputError("speed", asked.speed, "times of the path in s", said)
        if asked.step is not None and asked.step > unit * curve.length:
            allowed = f"more than 0 and at most {unit * curve.length:.4g} m, the length of the path"
            raise InvalidInputError("step", asked.step, allowed)
        moment, bending = (asked.friction_moment or 0.0) / (material.force_scale * unit), None
        if asked.bending_test is not None:
            bending, width = _tested(Path(asked.bending_test), material)
            if width and asked.friction_moment is not None:
                allowed = "none with the unloading of a bending test"
                raise InvalidInputError("friction_moment", asked.friction_moment, allowed)
            moment = width or moment
        if asked.friction_moment is not None or bending is not None:
            refinement *= refinement_of(asked.kind, moment)
        law = ("hysteresis", moment) if asked.pull is None else ("pull", asked.pull * unit / material.gravity)
        return cls(
            asked=asked,
            strip=StripModel(
                asked.length_star, material.relative_thickness, material.nu, kind=asked.kind, curl=asked.curl_star
            ),
            curve=curve,
            fall=replace(in_solver_units(Release(), material), tolerance=tolerance) if asked.fall else None,
            effects=effects_of(*law, None if yield_curvature is None else yield_curvature * unit, bending),
            memory=asked.friction_moment is not None or asked.pull is not None or bending is not None,
            moment=moment,
            size=min(STEP, curve.length) if asked.step is None else asked.step / unit,
            begin=FIRST_WITH_FRICTION if moment else 0.0,
            refinement=refinement,
        )

    @cached_property
    def speed(self) -> float | StampedPath:
        """Of the gripper in time, or its motion as the path's own times say it."""
        asked, scales = self.asked, self.asked.material.scales
        if asked.speed != "table":
            return SPEED if asked.speed is None else asked.speed / scales["m s-1"]
        travelled, _ = self.curve.sampled(SPACING)
        t = np.array([self.curve.pseudo_time(float(s)) for s in travelled])
        return StampedPath(t / scales["s"], travelled)

    @property
    def duration(self) -> float:
        """Of the gripper's motion in time, s."""
        speed = self.speed
        took = float(speed.t[-1]) if isinstance(speed, StampedPath) else self.curve.length / speed
        return took * self.asked.material.scales["s"]

    def mesh(self, factor: float = 1.0) -> Planned:
        """Plan elements of the usual lengths times a factor."""
        clamped = self.asked.gripper != "hinge"
        return self.strip.contact_mesh(factor * self.refinement, memory=self.memory, clamped=clamped)

    def followed(self, way: GripperPath, factor: float = 1.0, progress: Progress | None = None) -> Track:
        """Follow a path; ``factor``: on the lengths of the elements."""
        if not self.memory:
            return assess_strip(self.strip, way, self.fall, factor * self.refinement, progress)
        return load_path(self.mesh(factor), way, self.effects, self.size, progress, begin=self.begin)


class _Held(NamedTuple):
    """How the table holds what lies: the track, the path as the strip sees it, and the friction that it takes.

    ``friction``: coefficient that would hold it without a pin.  ``slip``: length travelled to where less lets it slide,
    L*.  ``slide_t``: as in the result.
    """

    found: Track
    way: GripperPath
    friction: float = nan
    slip: float = nan
    slide_t: float = nan


def _on_table(moved: _Moved, found: Track, progress: Progress | None) -> _Held:
    """Find the friction that holds what lies, and how the strip moves on the table with what there is."""
    bound, length = moved.asked.table_friction, moved.strip.length
    friction = np.abs(hold_frictions(found.forces, length))
    needed = float(friction.max())
    if bound is None or needed <= bound:
        return _Held(found, moved.curve, needed)
    slip = _slip(found, friction, bound)
    way, known = slides_on(moved.mesh(), moved.curve, length, moved.effects, bound, moved.size, progress)
    found = moved.followed(way, progress=progress)
    after = np.array([at.lam for _, at in found.static]) > known
    lost = bool((np.abs(hold_frictions(found.forces[after], length)) > bound).any())
    return _Held(found, way, needed, slip, moved.curve.pseudo_time(known) if lost else nan)


def _compared(moved: _Moved, found: Track, way: GripperPath) -> tuple[tuple[float, ...], float, str]:
    """Follow a path on another mesh: :func:`mesh_change`, or in words why that could not be."""
    factor, mesh = _other_size(moved.asked), _other_mesh(moved.asked)
    try:
        other = moved.followed(way, factor) if moved.memory or factor < 1.0 else _again(found, moved, way, factor)
        return mesh_change(found, other, mesh)
    except SolveError as error:
        said = " ".join(f"{mesh} the strip could not be followed: {error}".split())
        return (nan,) * len(found.events), nan, said


def _in_time(moved: _Moved, statics: Track, progress: Progress | None) -> tuple[Track, bool | None]:
    """Follow the path in time with friction between the layers, and see whether what lies rucks where it may."""
    asked = moved.asked
    # Wrinkles are there where they may grow.
    wrinkled = _flatness_ratio(peak_push(statics.static, statics.forces)[0], asked) < 1.0
    found = follow_in_time(
        moved.strip,
        moved.curve,
        asked.layer_friction or 0.0,
        moved.moment,
        damping=in_solver_units(Release(), asked.material).damping,
        speed=moved.speed,
        refinement=moved.refinement,
        ridge=Ridge.worst(statics.static, asked.flatness / asked.gravity_length) if wrinkled else None,
        progress=progress,
    )
    return found, rucks(found) if wrinkled else None


def _tested(file: Path, material: Material) -> tuple[MomentCurvature, float]:
    """The law of a bending test, in solver units, and its M_0, rho_a g L*^2: 0 where only the bending is known.

    Raises InvalidInputError: no such table, or no law; the message names the row.
    """
    table = read_table("bending_test", file, "curvature,moment", (2, 10_000), more=("unloading",))
    # The law goes through 0, with a row there or without.
    if table.numbers()[0, 0] == 0.0:
        table = replace(table, rows=table.rows[1:])
    if len(table.rows) < 2:
        raise InvalidInputError("bending_test", str(file), "two rows or more with a curvature")
    curvature, *moments = table.numbers().T
    rise = "numbers that rise from 0"
    table.check_increasing(curvature, "curvature", rise, above=0.0)
    both = ", the mean of both ways" if len(moments) > 1 else ""
    table.check_increasing(np.mean(moments, axis=0), "moment", f"{rise}{both}", above=0.0)
    curvature, moments = material.gravity_length * curvature, [of / material.scales["N"] for of in moments]
    return split_loop(curvature, *moments) if len(moments) > 1 else (MomentCurvature(curvature, *moments), 0.0)


def _flatness_ratio(push: float, asked: PathInputs) -> float:
    """Height of the lowest waves from which a push, rho_a g L*, lifts the strip, over the flatness; inf for none."""
    if not (push and asked.flatness):
        return inf
    return WAVE / push**2 * asked.gravity_length / asked.flatness


def _slip(found: Track, friction: Array, bound: float) -> float:
    """Length travelled to where the static states need more than this friction of the table to hold, L*."""
    statics = [at for at in found.points if isinstance(at.point, Point)]
    last = int(np.argmax(friction > bound))
    if not last:
        return statics[0].lam
    before, after = statics[last - 1], statics[last]
    if not isinstance(before, BranchPoint) or before.problem.effects:
        # Steps with memory are short.
        return float(np.interp(bound, friction[last - 1 : last + 1], [before.lam, after.lam]))
    known = {before.lam: friction[last - 1], after.lam: friction[last]}

    def excess(travelled: float) -> float:
        if travelled not in known:
            *_, there = branch(before, travelled)
            assert isinstance(there, BranchPoint)
            known[travelled] = abs(friction_to_hold(*on_mesh(there)))
        return float(known[travelled]) - bound

    return root(excess, before.lam, after.lam, 1e-6)


def _events(found: Track, material: Material, path: GripperPath, changes: Sequence[float]) -> list[dict[str, Any]]:
    """Say where the critical points are, what the strip did there, and how large the fall was, in SI."""
    events, scales = [], material.scales
    for number, (event, change) in enumerate(zip(found.events, changes, strict=True)):
        x, z = (scales["m"] * path.position(event.travelled)).tolist()
        drop, energy, speed, outcome = nan, nan, nan, NOT_FOLLOWED
        if number < len(found.falls):
            part = found.falls[number]
            motion = found.states[part]
            with suppress(SolveError):
                drop, energy = size_of_fall(found.states[part.start - 1], motion)
            speed = peak_speed(motion)
            outcome = "at rest without a touch" if first_landing(motion) is None else "fell to a touch"
        elif number == len(found.falls) and found.failure is not None:
            outcome = "the fall could not be followed to rest"
        given: dict[str, Any] = {"t": path.pseudo_time(event.travelled), "row": path.row(event.travelled)}
        given |= {"x": x, "z": z, "kind": event.kind, "angle": event.angle}
        given |= {"drop": scales["m"] * drop, "energy": scales["J m-1"] * energy, "speed": scales["m s-1"] * speed}
        events.append(given | {"outcome": outcome, "change": scales["m"] * change})
    return events


def _where(error: SolveError, asked: PathInputs, path: GripperPath) -> str:
    """Say where on the path an error happened; empty where it does not say."""
    if not isfinite(error.parameter):
        return ""
    x, z = (asked.gravity_length * path.position(error.parameter)).tolist()
    row = "" if (number := path.row(error.parameter)) is None else f"row {number}, "
    crushed = any(isinstance(one, CrushedError) for one in (error, error.__cause__))
    bent = f", where the {asked.gripper} clamp may bend the strip's end too sharply"
    return f"{row}gripper at x = {x:.4g} m, z = {z:.4g} m{bent if crushed and asked.gripper != 'hinge' else ''}: "


def _statics(found: Track, count: int) -> int:
    """Number of static states among the first ``count``."""
    return sum(phase != FALL for phase in found.phases[:count])


def _again(found: Track, moved: _Moved, path: GripperPath, factor: float) -> Track:
    """Follow the path on another mesh, where it has a critical point from a step before the first event on."""
    first, piece = None, 0
    if found.events:
        begin = min(event.travelled for event in (*found.events, found.touch) if event is not None) - STEPS.largest
        near = [number for number, at in enumerate(found.points[found.parts[0]]) if at.point.lam < begin]
        if near and isinstance(at := found.points[near[-1]], BranchPoint):
            with suppress(SolveError):
                first = remeshed(at, moved.mesh(factor))
                piece = found.pieces[near[-1]]
    return assess_strip(moved.strip, path, moved.fall, factor * moved.refinement, first=first, piece=piece)


def _other_size(asked: PathInputs) -> float:
    """Ratio of the lengths of the elements on the mesh of the comparison."""
    return HALVED if asked.kind == "solid" and asked.material.relative_thickness < THIN_SOLID else COARSER


def _other_mesh(asked: PathInputs) -> str:
    return f"with elements {_other_size(asked):g} times as long"


def mesh_change(found: Track, other: Track, mesh: str) -> tuple[tuple[float, ...], float, str]:
    """Compare two meshes: how much farther each critical point and the touch lie, and in words what is not the same.

    ``mesh``: the other one, in words.  nan where one of them has none.  What follows a failure on one of them is no
    difference.
    """
    here, there = ([event.travelled for event in track.events] for track in (found, other))
    apart = [b - a for a, b in zip(here, there, strict=False)]
    touch, said = other.touch_x - found.touch_x, ""
    if (len(here) > len(there) and not other.failure) or (len(there) > len(here) and not found.failure):
        points = f"critical point{'s' * (len(there) != 1)}"
        said = f"{mesh} the strip has {len(there) or 'no'} {points}, not {len(here)}"
    elif (found.touch is None) != (other.touch is None) and not (found.failure or other.failure):
        said = f"{mesh} the strip {'does not touch' if other.touch is None else 'touches'}"
    return (*apart, *(nan for _ in here[len(apart) :])), touch, said
