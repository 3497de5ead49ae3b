"""Which gripper path folds a strip best where its eta_b is uncertain, and that path for a robot (docs/plan.md).

Every known path is followed by the rod (:mod:`.outcome`); they are ranked by what they make of the fold, and by what
the way there costs.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import inf, isfinite
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from stripfold import elastica, paths
from stripfold.ask.inputs import PlanInputs
from stripfold.ask.map import gripper_map
from stripfold.ask.outcome import Candidate, Outcome, outcome_of, times
from stripfold.ask.planned_motion import InTime, in_time
from stripfold.base import processes
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError, NoPathError
from stripfold.base.progress import Percent
from stripfold.base.version import running_commit, version
from stripfold.elastica.boundary import snap_boundary
from stripfold.files import schema, store
from stripfold.files.reporting import Progress, Result, Rows, metres
from stripfold.follow.contact import touches
from stripfold.follow.track import WAVE, grip_angles, mid_surfaces
from stripfold.paths import FoldPath
from stripfold.paths.fold_path import lifted_triangular
from stripfold.paths.geometric import HIGHEST, LOWEST
from stripfold.paths.rpath import LONGEST, shortest_half_fold

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

USUAL = 1.0
"""Height of a low path where nothing else decides, and to which strips are lifted on a triangular path, L*."""
PUSH = 2.752
"""Push of a gripper at height z on what lies, times z^2, rho_a g L*^3: on low paths, at small heights the largest."""
SHARPEST = 0.25
"""Largest thickness over the height of a low path: in sharper bends the solid snaps where the rod does not."""
GIVING = 0.24
"""Factor of the lower limit of a low path by the stretch of what lies, (0.24 (length + 5.8 L*) h^2)^(1/3)."""
FREE = 5.8
"""Free length at the touch, L*, which gives beside what lies."""
ALIKE = 0.01
"""Difference of the errors of two folds that is none, L*: the paper's solid and the thin strip differ by as much."""
CLAMPED = 12.5
"""Length up to which a clamp that turns holds a strip on its R-path without friction, L* (docs/gripper.md)."""
HEADER = "t,x,z,angle"
SHOWN, NODES = 12, 201
"""Numbers of states that are drawn, and of points of each."""
FRAME = {
    "origin": "on the floor, below the middle of the flat strip",
    "x": "along the strip, from the grasped towards the held end, which is at +length/2",
    "y": "across the strip, z cross x",
    "z": "up",
}
UNITS = {"t": "s", "x": "m", "z": "m", "angle": "degree", "eta_b": "m^-4 s^2", "bump": "m", "kinetic": "J/m"}
UNITS |= {"peak_force": "N/m", "peak_hold": "N/m", "peak_push": "N/m", "sufficient_moment": "N", "energy": "J/m"}
GRASP = {
    "point": "middle of the strip's thickness on the line up to which the gripper holds it; it starts at -length/2",
    "angle": "rotation of the gripper about y, 0 as it grasped the flat strip, 180 on the folded one",
}
LIMITS = ("max_snap", "max_slide", "margin", "tool")
COLUMNS = ("fold off (95 %)", "first touch", "layers slide", "snap", "margin", "time")


@dataclass(frozen=True)
class Refusal:
    """A path that a limit excludes, or that cannot be computed: its name, and why."""

    path: str
    reason: str


def candidates(asked: PlanInputs, path: FoldPath | None = None) -> list[Candidate]:
    """Return the known paths of a half fold, the paper's among them, and the user's, if any."""
    height, made = _carried(asked)
    found = [] if path is None else [Candidate("given", path, path.name)]
    found += [] if height is None else [Candidate("low", paths.low(asked, height), made)]
    lift = USUAL * asked.gravity_length
    r_path = paths.r_path(asked)
    lifted = f"triangular, lifted up to {1e3 * lift:.1f} mm without horizontal force"
    found += [
        Candidate("lifted triangle", lifted_triangular(asked, lift), lifted),
        Candidate("triangular", paths.triangular(asked), "up and down at 45 degrees (Berg et al.)"),
        Candidate("circular", paths.circular(asked), "half a circle (Petrik et al.)"),
        Candidate("r-path", r_path, "with the lying length of the folded state (the paper's)"),
    ]
    if asked.length < CLAMPED * asked.strips[-1].gravity_length:
        found.append(Candidate("clamped r-path", r_path, "the R-path, clamped and turning with it", gripper="turning"))
    return found


def _carried(asked: PlanInputs) -> tuple[float | None, str]:
    """Height of the low path, m: as usual, within the limits for every eta_b; None for a strip too short for one."""
    stiffest, given, softest = (strip.gravity_length for strip in asked.strips)
    limit = elastica.touch_limit() * softest
    h = asked.strips[0].material.thickness
    stretch = (GIVING * (asked.length + FREE * stiffest) * h**2) ** (1.0 / 3.0)
    waves = (asked.flatness * PUSH**2 / WAVE * stiffest**3) ** 0.25
    lowest = max(waves, stretch, h / SHARPEST, LOWEST * given)
    highest = min(limit - (asked.margin or 0.0), HIGHEST * asked.length)
    if highest < LOWEST * given:
        return None, ""
    height = float(np.clip(USUAL * given, min(lowest, highest), highest))
    made = f"carried {1e3 * height:.1f} mm high"
    below = f"; below {1e3 * limit:.1f} mm nothing snaps with any eta_b of the interval"
    return height, made if asked.curl else made + below


def ranked(asked: PlanInputs, outcomes: list[Outcome]) -> list[Outcome]:
    """Sort outcomes: first those that keep the limits and were computed with all that is given, the best by the goal.

    Of the accurate ones those count as equal that differ by less than the gripper is off, or than a cloth differs from
    the model.
    """
    best = min(outcome.error[1] for outcome in outcomes)
    alike = max(asked.gripper_accuracy, ALIKE * asked.gravity_length)

    def worse(outcome: Outcome) -> float:
        over = outcome.error[1] - best if isfinite(outcome.error[1]) else inf
        return 0.0 if over < alike else over

    def key(outcome: Outcome) -> tuple[Any, ...]:
        unlike = asked.friction_moment is not None and not outcome.with_friction
        unusable = bool(outcome.excluded), bool(outcome.failure), unlike, outcome.flatness_ratio < 1.0
        gentle = np.nan_to_num(outcome.drop, nan=inf), outcome.candidate.gripper != "hinge", outcome.layer_slide
        by = {
            "accurate": (worse(outcome), *gentle),
            "gentle": (*gentle, worse(outcome)),
            "quick": (outcome.duration, worse(outcome)),
        }
        return (*unusable, *by[asked.goal])

    return sorted(outcomes, key=key)


def choose(
    asked: PlanInputs, progress: Progress | None = None, path: FoldPath | None = None, cores: int | None = 1
) -> tuple[list[Outcome], InTime | None]:
    """Rank what comes of all paths, the user's among them, and follow the best in time where a speed is given.

    ``cores``: most processes at a time; None for one on each core.

    Raises
    ------
    InvalidInputError
        A strip that with an eta_b of the interval cannot be folded in half, or is longer than tested.
    NoPathError
        No path keeps the limits that are given; it says of each why not.
    """
    say = progress or (lambda _: None)
    stiffest, _, softest = (strip.gravity_length for strip in asked.strips)
    shortest, longest = shortest_half_fold() * stiffest, LONGEST * softest
    if not shortest < asked.length <= longest:
        allowed = f"more than {shortest:.4g} m and at most {longest:.4g} m"
        raise InvalidInputError("length", asked.length, allowed, "a shorter strip has no fold with aligned edges")
    bounds = asked.strips[::2] if asked.eta_b_uncertainty else asked.strips[1:2]
    # The low path is the shortest run: last, it leaves the least to wait for.
    known, followed = candidates(asked, path)[::-1], Percent(progress, "following the paths")
    work = partial(outcome_of, asked, strips=bounds)
    found = ranked(asked, processes.in_order(work, known, processes.most(cores), followed)[::-1])
    # What slips on the table is no fold, unless all do: then how far the one slides that needs the least friction.
    slides = asked.table_friction is not None and all(outcome.table_slide != 0.0 for outcome in found)
    if slides:
        found.sort(key=lambda outcome: outcome.hold_friction)
        found[0] = outcome_of(asked, found[0].candidate, bounds, say, slides=True)
    for i, outcome in enumerate(found):
        if outcome.excluded or not isfinite(outcome.error[1]):
            continue
        found[i] = best = outcome_of(asked, outcome.candidate, asked.strips, say, outcome, slides)
        moved = None if asked.speed is None else _in_time(asked, best, say)
        if not isinstance(moved, str):
            return [best, *found[:i], *found[i + 1 :]], moved
        found[i] = replace(best, excluded=moved)
    refused = [Refusal(outcome.name, outcome.excluded or outcome.costs(asked)) for outcome in found]
    least, _, largest = (strip.eta_b for strip in asked.strips)
    raise NoPathError(f"folds the strip as asked for eta_b from {least:.4g} to {largest:.4g}", refused)


def _in_time(asked: PlanInputs, outcome: Outcome, say: Callable[[str], None]) -> InTime | str:
    if outcome.candidate.gripper != "hinge":
        return "a clamp that turns is not followed in time: leave out the speed"
    moment = asked.friction_moment or 0.0 if outcome.with_friction else 0.0
    states = [verdict.states for verdict in outcome.verdicts]
    return in_time(asked, outcome.path, states, moment, say, snaps=outcome.drop != 0.0)


@dataclass(frozen=True, eq=False, repr=False)
class FoldingPlan(Result):
    """What comes of each known path for every eta_b of an interval, and the best one as waypoints; SI.

    Source: docs/plan.md.

    Attributes
    ----------
    outcomes
        What comes of each path, the best first; those that a limit excludes last.
    in_time
        The best in time; None where no speed is given.
    waypoints
        Shape (n, 4): time, x and z of the grasp, and the gripper's rotation in degrees.
    asked, seconds
        The inputs, and the run time.
    """

    outcomes: tuple[Outcome, ...]
    in_time: InTime | None
    waypoints: Array
    asked: PlanInputs
    seconds: float
    title = "a gripper path for a strip whose eta_b is not well known"
    shown = ("path", "error")

    @classmethod
    def of(
        cls,
        asked: PlanInputs,
        progress: Progress | None = None,
        path: FoldPath | None = None,
        cores: int | None = None,
    ) -> Self:
        """Choose the best path, of the known ones and a user's, in at most ``cores`` processes, by default all."""
        began = perf_counter()
        outcomes, moved = choose(asked, progress, path, cores)
        return cls(tuple(outcomes), moved, _waypoints(outcomes[0], asked), asked, perf_counter() - began)

    @property
    def best(self) -> Outcome:
        """What comes of the chosen path."""
        return self.outcomes[0]

    @property
    def path(self) -> FoldPath:
        """The chosen path."""
        return self.best.path

    @property
    def error(self) -> tuple[float, float]:
        """Median of the error of its fold, and what 95 % of the folds do not exceed, m."""
        return self.best.error

    @property
    def travelled(self) -> Array:
        """Length travelled at the waypoints, m."""
        return self.path.curve.sampled(self.path.spacing)[0]

    @property
    def margin(self) -> float:
        """Least distance of the gripper from where the strip snaps with the worst eta_b, m; 0 where it snaps."""
        return self.best.margin

    def as_text(self) -> str:
        """The waypoints as a table."""
        asked = self.asked
        known = f"eta_b {asked.eta_b:g} m^-4 s^2 +- {asked.eta_b_uncertainty:.3g}"
        lines = [
            f"# {self.best.name} path, length {asked.length:g} m, {known}, margin {self.margin:.4g} m",
            "# t in s, x and z in m, angle in degrees; origin mid-strip on the floor (docs/plan.md)",
            HEADER,
        ]
        lines += [",".join(f"{value:.9g}" for value in row) for row in self.waypoints]
        return "\n".join(lines) + "\n"

    def to_csv(self, file: str | os.PathLike[str]) -> None:
        """Write the waypoints as a table that ``stripfold assess`` reads, too."""
        store.write_text(self.as_text(), file)

    def to_json(self, file: str | os.PathLike[str]) -> None:
        """Write :meth:`to_dict`."""
        store.write_json(self.to_dict(), file)

    def export(self, file: str | os.PathLike[str], base: Sequence[float] = (0.0, 0.0, 0.0, 0.0)) -> None:
        """Write the poses of the robot's tool, a ``.script``, ``.yaml``, ``.json`` or ``.csv`` (docs/robot.md).

        ``base``: x, y and z, m, of the middle of the flat strip in the frame of the robot's base, and the yaw of the
        direction of folding, degrees.  The tool centre point lies ``tool`` of the inputs behind the grasp.

        Raises InvalidInputError: another ending, or not such a base.
        """
        from stripfold.ask import export

        asked, tool = self.asked, self.asked.tool or 0.0
        title = f"stripfold {version()}: {self.best.name} path, length {asked.length:g} m, tool {tool:g} m"
        export.write(export.ToolPath.of(self.waypoints, base, tool, title), file)

    def rows(self) -> Rows:
        asked, best = self.asked, self.best
        cells = [COLUMNS, *(_cells(of, asked) for of in self.outcomes)]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        aligned = ["  ".join(f"{cell:>{width}}" for cell, width in zip(row, widths, strict=True)) for row in cells]
        names = ["", *(outcome.name for outcome in self.outcomes)]
        first = max(map(len, names))
        kept = "least distance of the gripper from where the strip snaps"
        if best.sufficient_moment is not None:
            kept = "by which the friction to spare delays the snap"
        return [
            ("path", f"{best.name}: {best.candidate.made}"),
            ("  costs", best.costs(asked)),
            ("eta_b", f"{asked.strips[0].eta_b:.4g} to {asked.strips[-1].eta_b:.4g} m^-4 s^2"),
            *((f"{name:<{first}}", row) for name, row in zip(names, aligned, strict=True)),
            *(("", f"{of.name}: {of.excluded or of.costs(asked)}") for of in self.outcomes[1:]),
            ("margin", metres(self.margin, kept)),
            ("motion", f"{self.waypoints[-1, 0]:.3g} s, {len(self.waypoints)} waypoints"),
            *(self.in_time.rows(asked) if self.in_time else []),
            ("time", f"{self.seconds:.2f} s"),
        ]

    def report(self, file: str | os.PathLike[str]) -> None:
        """Write a page with map, path, margin along it, worst case and reasons: one HTML file (docs/plan.md)."""
        from stripfold.draw import results, save

        best, asked, distances = self.best, self.asked, distances_along(self)
        with_friction = best.sufficient_moment is not None
        worst = int(np.nanargmin(np.nanmin(distances, axis=1)))
        nearest = [
            dict(zip(("distance", "t", "x", "z"), (float(one[at]), *map(float, self.waypoints[at, :3])), strict=True))
            for one in distances
            for at in (int(np.nanargmin(one)),)
        ]
        etas = [f"{strip.eta_b:.4g}" for strip in asked.strips]
        unit = asked.strips[worst].gravity_length
        places = gripper_map(asked.length / unit).drawn(unit, path=self.waypoints[:, 1:3])
        text = save.html(
            "plan.html",
            title=f"A gripper path for a strip of {asked.length:g} m",
            plan=self,
            asked=asked,
            highest=float(self.waypoints[:, 2].max()),
            with_friction=with_friction,
            worst=worst,
            cases=list(zip(asked.strips, best.verdicts, nearest, strict=True)),
            columns=COLUMNS,
            limits=[(name, of) for name in LIMITS if (of := getattr(asked, name)) is not None],
            cells=[(outcome, _cells(outcome, asked)) for outcome in self.outcomes],
            frame=FRAME,
            grasp=GRASP,
            map=save.as_svg(places),
            strip=save.as_svg(self.plot()),
            along=save.as_svg(
                results.draw_along(self.waypoints, distances, etas, None if with_friction else asked.margin)
            ),
        )
        store.write_text(text, file)

    def to_dict(self) -> dict[str, Any]:
        names = ("touch_x", "shape_error", "peak_force", "peak_hold", "peak_push", "bump")
        etas = [{"eta_b": strip.eta_b} for strip in self.asked.strips]
        numbers = [{name: float(getattr(verdict, name)) for name in names} for verdict in self.best.verdicts]
        moved = self.in_time
        return {
            "stripfold_version": version(),
            "git_commit": running_commit(),
            "inputs": self.config(),
            "path": self.best.name,
            "outcomes": [outcome.to_dict() | {"costs": outcome.costs(self.asked)} for outcome in self.outcomes],
            "assessed": [eta | one for eta, one in zip(etas, numbers, strict=True)],
            "in_time": moved and {"motions": [eta | asdict(one) for eta, one in zip(etas, moved.motions, strict=True)]},
            "frame": FRAME,
            "grasp": GRASP,
            "units": UNITS,
            "waypoints": dict(zip(("t", "x", "z", "angle"), self.waypoints.T.tolist(), strict=True)),
        }

    def to_dataset(self) -> xr.Dataset:
        verdicts, moved = self.best.verdicts, self.in_time
        values: dict[str, Any] = {}
        for name, column in zip(("time", "x", "z", "angle"), self.waypoints.T, strict=True):
            values[f"gripper_{name}"] = ("gripper_time", column)
        planned = {
            "eta_b": [strip.eta_b for strip in self.asked.strips],
            "touch": [verdict.touch_x for verdict in verdicts],
            "error": [verdict.shape_error for verdict in verdicts],
        }
        if moved is not None:
            planned["deviation"] = [motion.deviation for motion in moved.motions]
            planned["kinetic"] = [motion.kinetic for motion in moved.motions]
        values |= {f"planned_{name}": ("planned_eta_b", numbers) for name, numbers in planned.items()}
        values["outcome_path"] = ("outcome", [outcome.name for outcome in self.outcomes])
        values["outcome_error"] = (("outcome", "bound"), [outcome.error for outcome in self.outcomes])
        for name in ("layer_slide", "drop", "energy", "margin", "hold_friction", "duration"):
            values[f"outcome_{name}"] = ("outcome", [getattr(outcome, name) for outcome in self.outcomes])
        return schema.dataset(values, {"path": self.best.name, "path_margin": self.margin})

    def plot(self) -> Figure:
        """The strip along the path with the given eta_b."""
        from stripfold.draw.results import draw_strip

        states = self.best.verdicts[1].states
        shown = [states[i] for i in np.unique(np.linspace(0, len(states) - 1, SHOWN).astype(int))]
        shapes = self.asked.gravity_length * mid_surfaces(shown, np.linspace(0.0, self.asked.length_star, NODES))
        return draw_strip(list(shapes), self.waypoints[:, 1:3])

    def config(self) -> dict[str, Any]:
        return self.asked.model_dump()


def _cells(outcome: Outcome, asked: PlanInputs) -> tuple[str, ...]:
    """The numbers of an outcome in a row of the table, in the order of :data:`COLUMNS`; a star: without friction."""
    median, most = (1e3 * bound for bound in outcome.error)
    star = "*" if outcome.lacks_friction(asked) else ""
    off = f"{median:.1f}, at most {most:.1f} mm{star}" if isfinite(most) else "not folded"
    touches_at = f"{1e3 * sum(outcome.touch_error) / 2.0:+.0f} mm" if isfinite(sum(outcome.touch_error)) else "-"
    slide = f"{1e3 * outcome.layer_slide:.0f} mm" if isfinite(outcome.layer_slide) else "-"
    snap = f"{1e3 * outcome.drop:.1f} mm" if outcome.drop else "none"
    margin = f"{1e3 * outcome.margin:.1f} mm" if isfinite(outcome.margin) else "-"
    return off, touches_at, slide, snap, margin, f"{outcome.duration:.1f} s"


def _waypoints(best: Outcome, asked: PlanInputs) -> Array:
    """Time, x and z, and rotation of the gripper, shape (n, 4)."""
    travelled, places = best.path.curve.sampled(best.path.spacing)
    places = np.maximum(places, [-np.inf, 0.0])
    states = best.verdicts[1].states
    angle = np.degrees([0.0, *grip_angles(states)])
    angles = np.interp(travelled / asked.gravity_length, [0.0, *(point.lam for _, point in states)], angle)
    return np.column_stack([times(asked, best.path), places, angles])


def distances_along(plan: FoldingPlan) -> Array:
    """Distance of the waypoints from the frictionless snap boundaries with the three eta_b, shape (3, n), m.

    Negative behind the boundary; nan from the waypoint on at which the sag has come to lie.
    """
    found, (x, z) = [], plan.waypoints[:, 1:3].T
    for strip, verdict in zip(plan.asked.strips, plan.best.verdicts, strict=True):
        unit = strip.gravity_length
        away = unit * snap_boundary(strip.length_star).distance((x + strip.length / 2.0) / unit, z / unit)
        first = next(point.lam for problem, point in verdict.states if touches(problem.model, point))
        found.append(np.where(plan.travelled < unit * first, away, np.nan))
    return np.array(found)
