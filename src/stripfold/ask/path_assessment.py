"""A gripper path assessed: the verdict with its numbers as text, JSON, dataset, figure and film."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from math import isfinite, isnan, nan
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from stripfold.ask import verdict
from stripfold.ask.inputs import PathAssessment as Asked
from stripfold.ask.mesh_comparison import WHERE
from stripfold.ask.second_on_path import SecondOnPath, second_on_path
from stripfold.ask.verdict import Verdict
from stripfold.base.arguments import checked, file_name
from stripfold.files import schema
from stripfold.files.reporting import Progress, Result, Rows, metres
from stripfold.follow.phases import AFTER, BEFORE, FALL, SLOW
from stripfold.follow.track import StripState
from stripfold.paths import FoldPath
from stripfold.solve.dynamics import TimeState

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

NODES = 201
"""Nodes along the strip at which states on a path are stored: their own meshes differ."""


@dataclass(frozen=True, eq=False, repr=False)
class PathAssessment(Result, Verdict):
    """A gripper path assessed for a strip; lengths in m, forces in N per m of width, nan where there is no such thing.

    Source: the paper's section IV; docs/physics.md, sections 5, 8 and 9.

    Attributes
    ----------
    stable
        Whether the strip follows all of the path.
    critical
        Its critical points: ``t``, ``x``, ``z`` of the gripper, ``kind``, the last ``row`` before it of a path from a
        file, the ``angle`` with the stability boundary in degrees, and how large the event is: ``drop``, the largest
        height that a point of the strip loses, m, the ``energy`` freed, J per m of width, and the largest ``speed`` of
        a point, m/s; nan without a fall.  ``outcome`` says in words what the strip did; ``change`` is by how much
        farther along the path it lies on another mesh, m; nan where that mesh has none.
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
    peak_push, push_z
        Largest push of the gripper on what lies, and its height then; 0 and nan without one.
    bump
        Height of a bump that would grow under this push, of small slopes: in the flat strip that is followed there is
        none.  A height of more than L* says no more than that no lower one grows; nan without a push.
    completed
        Whether the path was followed to its end.
    contact
        "moving" where the ends of the contact were unknowns in all static states, "nodal" where the contact was found
        node by node in some.
    failure
        Why the fall, or what comes after it, could not be followed; empty where it could or was not asked for.
    second_gripper
        How far the strip follows with a second gripper; None where none is asked for or there is no critical point.
    touch_change, mesh_dependence
        By how much farther the first touch lies on another mesh, with elements half as long again; and in words what
        else is different there, empty where the verdict is the same.  A motion in time is of one mesh.
    path, asked, seconds
        The path, the other inputs, and the run time.
    """

    second_gripper: SecondOnPath | None
    path: FoldPath
    asked: Asked
    seconds: float
    title = "a gripper path assessed"
    shown = ("stable", "folded", "touch_x", "touch_error")

    @classmethod
    def of(cls, asked: Asked, path: FoldPath, began: float, progress: Progress | None = None) -> Self:
        """Assess it; ``began`` is when that started."""
        curve = path.curve.scaled(1.0 / asked.gravity_length)
        found = verdict.assess_path(
            asked.material,
            asked.length,
            curve,
            friction_moment=asked.friction_moment,
            pull=asked.pull,
            layer_friction=asked.layer_friction,
            step=asked.step,
            fall=asked.fall,
            fold_at=path.fold_at,
            model=asked.model,
            progress=progress,
        )
        values = {item.name: getattr(found, item.name) for item in fields(found)}
        second, place = None, asked.second_gripper
        if place is not None:
            second = second_on_path(asked.material, asked.length, curve, place)
        return cls(**values, second_gripper=second, path=path, asked=asked, seconds=perf_counter() - began)

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
            ("peak hold", f"{self.peak_hold:.4g} N/m  (horizontal, at the held end)"),
            ("peak push", self._push()),
            ("completed", self._completed()),
            *([] if self.asked.second_gripper is None else self._second_rows(self.second_gripper)),
            ("mesh", self._mesh()),
            ("time", f"{self.seconds:.1f} s"),
        ]

    def _mesh(self) -> str:
        """What another mesh says."""
        if self.mesh_dependence:
            return f"the verdict depends on it: {self.mesh_dependence}"
        far = max((abs(event["change"]) for event in self.critical if isfinite(event["change"])), default=0.0)
        points = f"; critical points within {far:.2g} m" if self.critical else ""
        touch = f"; first touch within {abs(self.touch_change):.2g} m" if isfinite(self.touch_change) else ""
        return f"{WHERE} the verdict is the same{points}{touch}"

    @staticmethod
    def _second_rows(second: SecondOnPath | None) -> Rows:
        if second is None:
            return [("2nd gripper", "none is needed: a rod follows the path without a critical point")]
        taken = f"at t = {second.t:.4g}, x = {second.x:.4g} m, z = {second.z:.4g} m"
        end = f"t = {second.end_t:.4g}, gripper at x = {second.end_x:.4g} m, z = {second.end_z:.4g} m"
        return [
            ("2nd gripper", metres(second.s, f"along the strip from the first, taken {taken}")),
            ("  snap", f"{'yes' if second.snap else 'no'}: {second.reason}"),
            ("  stable to", f"{end}, {second.gain:.4g} m farther than with one gripper"),
        ]

    @staticmethod
    def _event_rows(event: Mapping[str, Any]) -> Rows:
        row, after = (f"row {event['row']}, ", " after the first") if event["row"] else ("", "")
        place = f"{row}t = {event['t']:.4g}{after}, gripper at x = {event['x']:.4g} m, z = {event['z']:.4g} m"
        size = ""
        if isfinite(event["drop"]):
            size = f"; {event['drop']:.3g} m down, {event['energy']:.3g} J/m freed, up to {event['speed']:.3g} m/s"
        return [("critical", f"{place}: {event['kind']}"), ("  there", f"{event['outcome']}{size}")]

    def _folded(self) -> str:
        place = f"the end is {1e3 * self.end_error:.1f} mm from its place"
        if isfinite(self.shape_error) and not self.folded:
            return f"no: the strip is {1e3 * self.shape_error:.1f} mm from its folded state, {place}"
        if isnan(self.landing_x):
            return f"no: no folded state is known of a strip of this length; {place}"
        return f"{'yes' if self.folded else 'no'}: {place}"

    def _push(self) -> str:
        """The push on what lies, and the bump that would grow under it."""
        if not self.peak_push:
            return "none"
        unit = self.asked.gravity_length
        bump = f"a bump of {1e3 * self.bump:.2g} mm would grow under it"
        if self.bump > unit:
            bump = f"no bump lower than {1e3 * unit:.2g} mm grows under it"
        return f"{self.peak_push:.4g} N/m  (on what lies, gripper {1e3 * self.push_z:.1f} mm high; {bump})"

    def _completed(self) -> str:
        if self.completed:
            return "yes"
        if self.failure:
            return "no: what follows the last state could not be computed"
        return "no: the statics end at the critical point" if self.critical and not self.asked.fall else "no"

    def to_dict(self) -> dict[str, Any]:
        names = [item.name for item in fields(Verdict) if item.name not in ("states", "falls")]
        values = {name: getattr(self, name) for name in (*names, "seconds")}
        second = {} if self.second_gripper is None else {"second_gripper": asdict(self.second_gripper)}
        return values | {"critical": [dict(event) for event in self.critical]} | second

    def to_dataset(self) -> xr.Dataset:
        touches = ("touch_x", "planned_touch_x", "touch_error", "landing_x")
        shape = ("touch_change", "shape_error", "end_error", "lying_length")
        numbers = (*touches, *shape, "peak_force", "peak_hold", "peak_push", "push_z", "bump")
        values: dict[str, Any] = {name: ((), getattr(self, name)) for name in numbers}
        states, unit = self._mid_surfaces(), self.asked.gravity_length
        values |= {
            "pseudo_time": ("state", [self.path.curve.pseudo_time(unit * point.lam) for _, point in self.states]),
            "x": (("state", "node"), states[..., 0]),
            "z": (("state", "node"), states[..., 1]),
            "kind": ("event", [event["kind"] for event in self.critical]),
        }
        values |= {
            f"critical_{key}": ("event", np.array([event[key] for event in self.critical], dtype=float))
            for key in ("t", "x", "z", "angle", "drop", "energy", "speed", "change")
        }
        if (second := self.second_gripper) is not None:
            given = {f"second_{key}": getattr(second, key) for key in ("s", "x", "z", "snap")}
            values |= {name: ((), float(value)) for name, value in given.items()}
        flags = {name: int(getattr(self, name)) for name in ("stable", "folded", "completed")}
        said = {"contact": self.contact, "failure": self.failure, "mesh_dependence": self.mesh_dependence}
        return schema.dataset(values, flags | said)

    def _mid_surfaces(self, states: Sequence[StripState] | None = None) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Shape (states, nodes, 2), m."""
        unit = self.asked.gravity_length
        arc = np.linspace(0.0, self.states[0][0].model.length, NODES)
        states = self.states if states is None else states
        return np.stack([unit * problem.model.resampled_mid_surface(point.q, arc) for problem, point in states])

    def plot(self) -> Figure:
        """Draw the strip along the path; critical points are crosses, states after a fall green."""
        from stripfold.draw.results import draw_strip

        states = self._mid_surfaces()
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
        from stripfold.base.extras import require

        require("vision")
        from stripfold.draw import film, readers

        ordered = [(SLOW if isinstance(state[1], TimeState) else BEFORE, state) for state in self.states]
        if self.falls:
            first = self.falls[0][0]
            ordered[first:] = [(AFTER, state) for _, state in ordered[first:]]
        for before, motion in reversed(self.falls):
            ordered[before:before] = [(FALL, state) for state in motion]
        phase, states = (list(part) for part in zip(*ordered, strict=True))
        second = self.asked.material.scales["s"]
        followed = readers.Followed(
            phase=np.array(phase),
            time=np.array([second * state.t if isinstance(state, TimeState) else nan for _, state in states]),
            advance=self.asked.gravity_length * np.array([state.lam for _, state in states]),
            states=self._mid_surfaces(states),
        )
        film.draw(followed, file_name("file", file), "way", progress=progress)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PathAssessment) and self.path == other.path and super().__eq__(other)

    def config(self) -> dict[str, Any]:
        return {**self.asked.model_dump(), "path": self.path.name, "fold_at": self.path.fold_at}
