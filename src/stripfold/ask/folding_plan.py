"""Result of :meth:`.Strip.plan`: a path that folds a strip whose eta_b is not well known, in time, for a robot."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from stripfold.ask.inputs import FoldingPlan as Asked
from stripfold.ask.path_choice import Choice, choose
from stripfold.base.arrays import Array
from stripfold.base.version import running_commit, version
from stripfold.files import schema, store
from stripfold.files.reporting import Progress, Result, Rows, metres
from stripfold.paths import FoldPath
from stripfold.paths.motion import timed

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

HEADER = "t,x,z,angle"
AT_GRIP = 0.02
"""Length of the strip from its end over which its direction there is taken, L*: it is straight at its end."""
SHOWN, NODES = 12, 201
"""Numbers of states that are drawn, and of points of each."""
FRAME = {
    "origin": "on the floor, below the middle of the flat strip",
    "x": "along the strip, from the grasped towards the held end, which is at +length/2",
    "y": "across the strip, z cross x",
    "z": "up",
}
UNITS = {
    "t": "s",
    "x": "m",
    "z": "m",
    "angle": "degree",
    "eta_b": "m^-4 s^2",
    "peak_force": "N/m",
    "peak_hold": "N/m",
    "peak_push": "N/m",
    "bump": "m",
    "kinetic": "J/m",
    "sufficient_moment": "N",
}
GRASP = {
    "point": "middle of the strip's thickness on the line up to which the gripper holds it; it starts at -length/2",
    "angle": "rotation of the gripper about y, 0 as it grasped the flat strip, 180 on the folded one",
}


@dataclass(frozen=True, eq=False, repr=False)
class FoldingPlan(Result):
    """A path that keeps a margin for every eta_b of an interval and ends in the accurate fold; SI.

    Source: docs/plan.md.

    Attributes
    ----------
    choice
        The path, its margin, the reasons, and the rod's verdicts with the least, the given and the largest eta_b.
    waypoints
        Shape (n, 4): time, x and z of the grasp, and the gripper's rotation in degrees.
    asked, seconds
        The inputs, and the run time.
    """

    choice: Choice
    waypoints: Array
    asked: Asked
    seconds: float
    title = "a gripper path for a strip whose eta_b is not well known"
    shown = ("path", "margin")

    @classmethod
    def of(cls, asked: Asked, progress: Progress | None = None) -> Self:
        """Choose and assess it."""
        began = perf_counter()
        choice = choose(asked, progress)
        return cls(choice, _waypoints(choice, asked), asked, perf_counter() - began)

    @property
    def path(self) -> FoldPath:
        """The path."""
        return self.choice.path

    @property
    def travelled(self) -> Array:
        """Length travelled at the waypoints, m."""
        return self.path.curve.sampled(self.path.spacing)[0]

    @property
    def margin(self) -> float:
        """Least distance of the gripper from where the strip snaps with the worst eta_b, m."""
        return self.choice.margin

    def as_text(self) -> str:
        """The waypoints as a table."""
        asked = self.asked
        comments = (
            f"{self.path.name} path, length {asked.length:g} m, eta_b {asked.eta_b:g} m^-4 s^2 +- "
            f"{asked.eta_b_uncertainty:.3g}, margin {self.margin:.4g} m",
            "t in s, x and z in m, angle in degrees; origin mid-strip on the floor (docs/plan.md)",
        )
        lines = [*(f"# {comment}" for comment in comments), HEADER]
        lines += [",".join(f"{value:.9g}" for value in row) for row in self.waypoints]
        return "\n".join(lines) + "\n"

    def to_csv(self, file: str | os.PathLike[str]) -> None:
        """Write the waypoints as a table that ``stripfold assess`` reads, too."""
        store.write_text(self.as_text(), file)

    def to_json(self, file: str | os.PathLike[str]) -> None:
        """Write :meth:`to_dict`."""
        store.write_json(self.to_dict(), file)

    def rows(self) -> Rows:
        asked, choice = self.asked, self.choice
        stiffest, _, softest = asked.strips
        friction, kept = [], "least distance of the gripper from where the strip snaps"
        if choice.sufficient_moment is not None:
            there = asked.friction_moment
            friction.append(("friction", f"M_0 = {choice.sufficient_moment:.3g} N suffices, there are {there:.3g} N"))
            kept = "by which the friction to spare delays the snap"
        return [
            ("path", f"{self.path.name}: {choice.reason}"),
            *(("  not", f"{one.path}: {one.reason}") for one in choice.refused),
            ("eta_b", f"{stiffest.eta_b:.4g} to {softest.eta_b:.4g} m^-4 s^2"),
            ("margin", metres(self.margin, kept)),
            *friction,
            *(
                (
                    f"  {strip.eta_b:.4g}",
                    f"stable; first touch at x = {verdict.touch_x:.4g} m, fold {1e3 * verdict.shape_error:.2f} mm off, "
                    f"push on what lies at most {verdict.peak_push:.3g} N/m",
                )
                for strip, verdict in zip(asked.strips, choice.verdicts, strict=True)
            ),
            ("motion", f"{self.waypoints[-1, 0]:.3g} s, {len(self.waypoints)} waypoints"),
            *self._in_time_rows(),
            ("time", f"{self.seconds:.2f} s"),
        ]

    def _in_time_rows(self) -> Rows:
        """What the strip does in time that deviates most."""
        if (found := self.choice.in_time) is None:
            return []
        worst, eta_b = found.motions[found.worst], self.asked.strips[found.worst].eta_b
        place = f"with eta_b = {eta_b:.4g}, gripper at x = {worst.x:.4g} m, z = {worst.z:.4g} m"
        return [
            ("in time", f"stays with its static states: at most {1e3 * worst.deviation:.1f} mm off, {place}"),
            ("  kinetic", f"energy at most {worst.kinetic:.3g} J/m"),
            ("  at rest", f"fold {1e3 * worst.shape_error:.2f} mm off"),
        ]

    def report(self, file: str | os.PathLike[str]) -> None:
        """Write a page with map, path, margin along it, worst case and reasons: one HTML file (docs/plan.md)."""
        from stripfold.draw import plan

        store.write_text(plan.html(self), file)

    def to_dict(self) -> dict[str, Any]:
        names = ("touch_x", "shape_error", "peak_force", "peak_hold", "peak_push", "bump")
        t, x, z, angle = self.waypoints.T.tolist()
        return {
            "stripfold_version": version(),
            "git_commit": running_commit(),
            "inputs": self.config(),
            "path": self.path.name,
            "reason": self.choice.reason,
            "refused": [asdict(one) for one in self.choice.refused],
            "margin": self.margin,
            "sufficient_moment": self.choice.sufficient_moment,
            "assessed": [
                {"eta_b": strip.eta_b} | {name: float(getattr(verdict, name)) for name in names}
                for strip, verdict in zip(self.asked.strips, self.choice.verdicts, strict=True)
            ],
            "in_time": self._in_time(),
            "frame": FRAME,
            "grasp": GRASP,
            "units": UNITS,
            "waypoints": {"t": t, "x": x, "z": z, "angle": angle},
        }

    def _in_time(self) -> dict[str, Any] | None:
        if (found := self.choice.in_time) is None:
            return None
        pairs = zip(self.asked.strips, found.motions, strict=True)
        return {"motions": [{"eta_b": strip.eta_b} | asdict(moved) for strip, moved in pairs]}

    def to_dataset(self) -> xr.Dataset:
        t, x, z, angle = self.waypoints.T
        verdicts = self.choice.verdicts
        values: dict[str, Any] = {
            "gripper_time": ("gripper_time", t),
            "gripper_x": ("gripper_time", x),
            "gripper_z": ("gripper_time", z),
            "gripper_angle": ("gripper_time", angle),
            "planned_eta_b": ("planned_eta_b", [strip.eta_b for strip in self.asked.strips]),
            "planned_touch": ("planned_eta_b", [verdict.touch_x for verdict in verdicts]),
            "planned_error": ("planned_eta_b", [verdict.shape_error for verdict in verdicts]),
        }
        if (moved := self.choice.in_time) is not None:
            values["planned_deviation"] = ("planned_eta_b", [motion.deviation for motion in moved.motions])
            values["planned_kinetic"] = ("planned_eta_b", [motion.kinetic for motion in moved.motions])
        attrs = {"path": self.path.name, "reason": self.choice.reason, "path_margin": self.margin}
        return schema.dataset(values, attrs)

    def plot(self) -> Figure:
        """The strip along the path with the given eta_b."""
        from stripfold.draw.results import draw_strip

        unit, states = self.asked.gravity_length, self.choice.verdicts[1].states
        arc = np.linspace(0.0, states[0][0].model.length, NODES)
        chosen = np.unique(np.linspace(0, len(states) - 1, SHOWN).astype(int))
        shapes = [unit * states[i][0].model.resampled_mid_surface(states[i][1].q, arc) for i in chosen]
        return draw_strip(shapes, self.waypoints[:, 1:3])

    def config(self) -> dict[str, Any]:
        return self.asked.model_dump()


def _waypoints(choice: Choice, asked: Asked) -> Array:
    """Time, x and z, and rotation of the gripper, shape (n, 4)."""
    travelled, places = choice.path.curve.sampled(choice.path.spacing)
    places = np.maximum(places, [-np.inf, 0.0])
    states = choice.verdicts[1].states
    grip = [problem.model.resampled_mid_surface(point.q, np.array([0.0, AT_GRIP])) for problem, point in states]
    direction = np.diff(grip, axis=1)[:, 0] @ [1.0, -1j]
    angle = np.degrees(np.unwrap(np.angle([1.0, *direction])))
    angles = np.interp(travelled / asked.gravity_length, [0.0, *(point.lam for _, point in states)], angle)
    return np.column_stack([timed(travelled, places, asked.gripper_speed, asked.acceleration).t, places, angles])
