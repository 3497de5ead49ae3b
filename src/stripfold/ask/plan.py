"""A gripper path that folds a strip with a margin, for a robot, where eta_b is uncertain (docs/plan.md).

Paths are tried in turn: what the elastica says about a path with the worst eta_b of the interval decides whether it
can have the margin, and the rod with the least, the given and the largest eta_b whether it is stable and folds well.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from stripfold import elastica, paths
from stripfold.ask.assess import PathAssessment, assess
from stripfold.ask.friction import REFINEMENT, SPARE, estimate, lost_with
from stripfold.ask.inputs import PathInputs, PlanInputs, Strip
from stripfold.ask.map import GripperMap, gripper_map
from stripfold.ask.planned_motion import ACCURATE, InTime, in_time
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError, NoPathError, SolveError
from stripfold.base.roots import root
from stripfold.base.version import running_commit, version
from stripfold.elastica.boundary import snap_boundary
from stripfold.files import schema, store
from stripfold.files.reporting import Progress, Result, Rows, metres
from stripfold.follow.contact import touches
from stripfold.follow.track import WAVE, grip_angles, mid_surfaces
from stripfold.paths import FoldPath
from stripfold.paths.curve import GripperPath
from stripfold.paths.fold_path import lifted_triangular
from stripfold.paths.geometric import HIGHEST, layer_slide
from stripfold.paths.motion import timed
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
SPACING = 0.02
"""Spacing of places on a path at which its margin is taken, L*: half of it is a margin's error, at most."""
HEIGHT = 1e-4
"""Accuracy of the height at which a path snaps, L*."""
STEP = 0.25
"""Size of the steps with friction, L*: the finished fold is then within 2e-4 L* of that with steps of a tenth."""
CLEAR = 0.05
"""Margin from which a path is not followed on a second mesh, L*: several times what a mesh moves a snap."""
DELAY = 8.0
"""Distance by which friction delays a snap, L* per M_0 in rho_a g L*^2: the least at the heights of docs/physics.md."""
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
UNITS |= {"peak_force": "N/m", "peak_hold": "N/m", "peak_push": "N/m", "sufficient_moment": "N"}
GRASP = {
    "point": "middle of the strip's thickness on the line up to which the gripper holds it; it starts at -length/2",
    "angle": "rotation of the gripper about y, 0 as it grasped the flat strip, 180 on the folded one",
}


@dataclass(frozen=True)
class Refusal:
    """A path that is not possible: its name, why not, and what is missing, m; None where not a length."""

    path: str
    reason: str
    shortfall: float | None = None


@dataclass(frozen=True)
class Choice:
    """The path chosen, for the given eta_b, with the worst eta_b's ``margin``, m, and the ``reason`` for it.

    ``sufficient_moment``: M_0 that suffices on it with the worst eta_b, N; None where it needs none.  ``refused``:
    those tried before.  ``verdicts``: the rod's, with the least, the given and the largest eta_b.  ``in_time``: the
    rod in time; None where no speed is given.
    """

    path: FoldPath
    margin: float
    reason: str
    sufficient_moment: float | None = None
    refused: tuple[Refusal, ...] = ()
    verdicts: tuple[PathAssessment, ...] = ()
    in_time: InTime | None = None


@dataclass(frozen=True)
class _Chooser:
    asked: PlanInputs
    say: Callable[[str], None]

    @cached_property
    def units(self) -> tuple[float, float, float]:
        """L* of the stiffest, the given and the softest strip, m."""
        stiffest, given, softest = (strip.gravity_length for strip in self.asked.strips)
        return stiffest, given, softest

    def low(self) -> Choice | Refusal:
        """As high as usual, within the limits for every eta_b."""
        asked, (stiffest, given, softest) = self.asked, self.units
        limit = elastica.touch_limit() * softest
        h = asked.strips[0].material.thickness
        stretch = (GIVING * (asked.length + FREE * stiffest) * h**2) ** (1.0 / 3.0)
        waves = (asked.flatness * PUSH**2 / WAVE * stiffest**3) ** 0.25
        lowest = max(waves, stretch, h / SHARPEST)
        highest = min(limit - asked.margin, HIGHEST * asked.length)
        if lowest > highest:
            most = f"with the margin, at most {1e3 * max(highest, 0.0):.1f} mm high"
            why = f"the gripper would have to be at least {1e3 * lowest:.1f} and, {most}"
            return Refusal("low", why, lowest - highest)
        if not asked.layers_may_slide:
            least = softest * layer_slide(asked.length / softest, elastica.touch_limit() * (1.0 - 1e-9))
            bound = f": without friction by at least {1e3 * least:.0f} mm on any path" if least > 0.0 else ""
            return Refusal("low", f"the upper layer slides over the lower one, which is not allowed{bound}")
        height = float(np.clip(USUAL * given, lowest, highest))
        why = f"{1e3 * height:.1f} mm high, below {1e3 * limit:.1f} mm nothing snaps with any eta_b of the interval"
        return Choice(paths.low(asked, height), limit - height, why)

    def triangular(self) -> Choice | Refusal:
        """Where the softest strip, relative to L* the longest, touches before it can snap."""
        asked, unit = self.asked, self.units[-1]
        above = unit * snaps_above(asked.length / unit)
        if above > 0.0:
            why = f"it leaves the stable places {1e3 * above:.0f} mm above the touch limit"
            return Refusal("triangular", why, asked.margin + above)
        height = USUAL * self.units[1]
        path = lifted_triangular(asked, height)
        margin = unit * margin_on(scaled(path, unit), gripper_map(asked.length / unit))
        if margin < asked.margin:
            return Refusal("triangular", f"its margin is {1e3 * margin:.1f} mm", asked.margin - margin)
        why = "the strip is so short that its sag lands before it can snap"
        lift = f"up to {1e3 * height:.1f} mm it is lifted without horizontal force, not to push what lies into a ruck"
        return Choice(path, margin, f"{why}; {lift}")

    def r_path(self) -> Choice | Refusal:
        """Along the snap boundary, where internal friction has to hold the strip."""
        asked, unit = self.asked, self.units[1]
        per_moment = DELAY / asked.material.force_scale
        holds = estimate(asked.length / unit, asked.eta_b_uncertainty) * asked.material.force_scale * unit
        advice = f"about {max(SPARE * holds, holds + asked.margin / per_moment):.2g} N would do"
        if (there := asked.friction_moment) is None:
            why = "it needs internal friction, and no friction moment of the fabric is given"
            return Refusal("r-path", f"{why}; {advice}")
        enough = min(there / SPARE, there - asked.margin / per_moment)
        if enough <= 0.0:
            most = per_moment * there
            why = f"a friction moment of {there:.3g} N delays a snap by {1e3 * most:.1f} mm; {advice}"
            return Refusal("r-path", why, asked.margin - most)
        path = paths.r_path(asked)
        strips = [(strip.material, strip.length, scaled(path, strip.gravity_length)) for strip in asked.strips]
        try:
            lost = lost_with(strips, enough, asked.yield_curvature, self.say)
        except SolveError as error:
            return Refusal("r-path", f"whether friction holds the strip could not be found: {error}")
        if lost is not None:
            kept = f"{enough:.3g} N, what the margin leaves of {there:.3g} N"
            why = f"with eta_b = {lost[0].eta_b:.4g} the strip is lost with a friction moment of {kept}"
            return Refusal("r-path", f"{why}; {advice}" if holds > enough else why)
        why = f"a friction moment of {enough:.3g} N holds the strip, and there are {there:.3g} N"
        return Choice(path, per_moment * (there - enough), why, enough)

    def checked(self, candidate: Choice) -> Choice | Refusal:
        """Follow it on the rod with the three eta_b, in time, too, where a speed is given."""
        asked, verdicts = self.asked, list[PathAssessment]()
        moment = None if candidate.sufficient_moment is None else asked.friction_moment
        for strip in asked.strips:
            self.say(f"{candidate.path.name} path, statics with eta_b = {strip.eta_b:.4g}")
            verdict = self.verdict(candidate, strip, moment)
            if isinstance(verdict, str):
                return Refusal(candidate.path.name, f"with eta_b = {strip.eta_b:.4g} the rod {verdict}")
            verdicts.append(verdict)
        found = replace(candidate, verdicts=tuple(verdicts))
        if asked.speed is None:
            return found
        moved = in_time(asked, candidate.path, [verdict.states for verdict in verdicts], moment or 0.0, self.say)
        return Refusal(candidate.path.name, moved) if isinstance(moved, str) else replace(found, in_time=moved)

    def verdict(self, candidate: Choice, strip: Strip, moment: float | None) -> PathAssessment | str:
        """The rod's verdict on a path, or what is wrong with it."""
        of, unit = self.asked, strip.gravity_length
        table = {"flatness": of.flatness, "table_friction": of.table_friction}
        inputs = PathInputs(**strip.model_dump() | table, model="rod")
        # A strip so far from where it snaps is lost on no mesh.
        how: dict[str, Any] = {"compare": candidate.margin < CLEAR * unit}
        if moment is not None:
            inputs = inputs.model_copy(update={"friction_moment": moment, "step": STEP * unit})
            # With longer elements strips are lost where one of them begins to slide.  To its touch this one was
            # followed before, with less friction and by other steps.
            how = {"yield_curvature": self.asked.yield_curvature, "refinement": REFINEMENT, "compare": False}
        try:
            verdict = assess(inputs, candidate.path, **how)
        except SolveError as error:
            return f"cannot be followed: {error}"
        if verdict.stable and verdict.mesh_dependence:
            return f"has no certain verdict: {verdict.mesh_dependence}"
        if not verdict.stable:
            event = verdict.critical[0]
            return f"is lost at x = {event['x']:.4g} m, z = {event['z']:.4g} m"
        if not verdict.slide_known or not abs(verdict.slide) <= ACCURATE * unit:
            place = f"x = {verdict.slip_x:.4g} m, z = {verdict.slip_z:.4g} m"
            far = f"by {1e3 * verdict.slide:.1f} mm" if verdict.slide_known else "at once"
            return (
                f"slides {far} on the table from {place} on: to hold it takes friction of {verdict.hold_friction:.2g}"
            )
        if not verdict.shape_error <= ACCURATE * unit:
            return f"is folded {1e3 * verdict.shape_error:.1f} mm off"
        if verdict.may_ruck:
            height = f"{1e3 * verdict.flatness_ratio * self.asked.flatness:.2g} mm"
            return f"pushes what lies with {verdict.peak_push:.3g} N/m, which lifts it from waves of {height}"
        return verdict


def choose(asked: PlanInputs, progress: Callable[[str], None] | None = None) -> Choice:
    """The first path that has the margin for every eta_b of the interval, and that the rod follows.

    Raises
    ------
    InvalidInputError
        A strip that with an eta_b of the interval cannot be folded in half, or is longer than tested.
    NoPathError
        There is none; it says of each path by how much it fails.
    """
    say = progress or (lambda _: None)
    chooser = _Chooser(asked, say)
    shortest, longest = shortest_half_fold() * chooser.units[0], LONGEST * chooser.units[-1]
    if not shortest < asked.length <= longest:
        allowed = f"more than {shortest:.4g} m and at most {longest:.4g} m"
        raise InvalidInputError("length", asked.length, allowed, "a shorter strip has no fold with aligned edges")
    refused: list[Refusal] = []
    for attempt in (chooser.low, chooser.triangular, chooser.r_path):
        tried = attempt()
        found = tried if isinstance(tried, Refusal) else chooser.checked(tried)
        if isinstance(found, Choice):
            return replace(found, refused=tuple(refused))
        refused.append(found)
    least, _, largest = (strip.eta_b for strip in asked.strips)
    raise NoPathError(f"keeps {1e3 * asked.margin:g} mm for eta_b from {least:.4g} to {largest:.4g}", refused)


def scaled(path: FoldPath, unit: float) -> GripperPath:
    """The curve of a path in units of an L*, m."""
    return path.curve.scaled(1.0 / unit)


def snaps_above(length: float) -> float:
    """Height over the touch limit at which a strip snaps on its triangular path, L*; 0 where it lands before."""

    def beyond(z: float) -> float:
        """How far the second edge is past the snap boundary at a height."""
        return length - z - elastica.critical(z).state.advance

    limit = elastica.touch_limit()
    # At the limit itself the critical state is as near to a snap as to a touch.
    lowest = limit * (1.0 + 1e-9)
    return root(beyond, lowest, length / 2.0, HEIGHT) - limit if beyond(lowest) > 0.0 else 0.0


def margin_on(path: GripperPath, places: GripperMap) -> float:
    """Least distance of a path, which lands, from the snap boundary up to there, L*."""
    _, positions = path.sampled(SPACING)
    # The end of a path may lie below the floor by rounding.
    advance, z = positions[:, 0] + places.length / 2.0, np.maximum(positions[:, 1], 0.0)
    beyond = advance > places.hanging(z)[1]
    end = int(np.argmax(beyond)) if beyond.any() else len(z)
    return float(np.nanmin(places.margin(advance[:end], z[:end])))


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
    asked: PlanInputs
    seconds: float
    title = "a gripper path for a strip whose eta_b is not well known"
    shown = ("path", "margin")

    @classmethod
    def of(cls, asked: PlanInputs, progress: Progress | None = None) -> Self:
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
        known = f"eta_b {asked.eta_b:g} m^-4 s^2 +- {asked.eta_b_uncertainty:.3g}"
        lines = [
            f"# {self.path.name} path, length {asked.length:g} m, {known}, margin {self.margin:.4g} m",
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

    def rows(self) -> Rows:
        asked, choice = self.asked, self.choice
        friction, kept = [], "least distance of the gripper from where the strip snaps"
        if choice.sufficient_moment is not None:
            there = asked.friction_moment
            friction.append(("friction", f"M_0 = {choice.sufficient_moment:.3g} N suffices, there are {there:.3g} N"))
            kept = "by which the friction to spare delays the snap"
        each = []
        for strip, verdict in zip(asked.strips, choice.verdicts, strict=True):
            fold = f"first touch at x = {verdict.touch_x:.4g} m, fold {1e3 * verdict.shape_error:.2f} mm off"
            push = f"push on what lies at most {verdict.peak_push:.3g} N/m"
            each.append((f"  {strip.eta_b:.4g}", f"stable; {fold}, {push}"))
        return [
            ("path", f"{self.path.name}: {choice.reason}"),
            *(("  not", f"{one.path}: {one.reason}") for one in choice.refused),
            ("eta_b", f"{asked.strips[0].eta_b:.4g} to {asked.strips[-1].eta_b:.4g} m^-4 s^2"),
            ("margin", metres(self.margin, kept)),
            *friction,
            *each,
            ("motion", f"{self.waypoints[-1, 0]:.3g} s, {len(self.waypoints)} waypoints"),
            *(choice.in_time.rows(asked) if choice.in_time else []),
            ("time", f"{self.seconds:.2f} s"),
        ]

    def report(self, file: str | os.PathLike[str]) -> None:
        """Write a page with map, path, margin along it, worst case and reasons: one HTML file (docs/plan.md)."""
        from stripfold.draw import results, save

        choice, asked, distances = self.choice, self.asked, distances_along(self)
        with_friction = choice.sufficient_moment is not None
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
            cases=list(zip(asked.strips, choice.verdicts, nearest, strict=True)),
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
        names, moved = ("touch_x", "shape_error", "peak_force", "peak_hold", "peak_push", "bump"), self.choice.in_time
        etas = [{"eta_b": strip.eta_b} for strip in self.asked.strips]
        numbers = [{name: float(getattr(verdict, name)) for name in names} for verdict in self.choice.verdicts]
        return {
            "stripfold_version": version(),
            "git_commit": running_commit(),
            "inputs": self.config(),
            "path": self.path.name,
            "reason": self.choice.reason,
            "refused": [asdict(one) for one in self.choice.refused],
            "margin": self.margin,
            "sufficient_moment": self.choice.sufficient_moment,
            "assessed": [eta | one for eta, one in zip(etas, numbers, strict=True)],
            "in_time": moved and {"motions": [eta | asdict(one) for eta, one in zip(etas, moved.motions, strict=True)]},
            "frame": FRAME,
            "grasp": GRASP,
            "units": UNITS,
            "waypoints": dict(zip(("t", "x", "z", "angle"), self.waypoints.T.tolist(), strict=True)),
        }

    def to_dataset(self) -> xr.Dataset:
        verdicts, moved = self.choice.verdicts, self.choice.in_time
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
        attrs = {"path": self.path.name, "reason": self.choice.reason, "path_margin": self.margin}
        return schema.dataset(values, attrs)

    def plot(self) -> Figure:
        """The strip along the path with the given eta_b."""
        from stripfold.draw.results import draw_strip

        states = self.choice.verdicts[1].states
        shown = [states[i] for i in np.unique(np.linspace(0, len(states) - 1, SHOWN).astype(int))]
        shapes = self.asked.gravity_length * mid_surfaces(shown, np.linspace(0.0, self.asked.length_star, NODES))
        return draw_strip(list(shapes), self.waypoints[:, 1:3])

    def config(self) -> dict[str, Any]:
        return self.asked.model_dump()


def _waypoints(choice: Choice, asked: PlanInputs) -> Array:
    """Time, x and z, and rotation of the gripper, shape (n, 4)."""
    travelled, places = choice.path.curve.sampled(choice.path.spacing)
    places = np.maximum(places, [-np.inf, 0.0])
    states = choice.verdicts[1].states
    angle = np.degrees([0.0, *grip_angles(states)])
    angles = np.interp(travelled / asked.gravity_length, [0.0, *(point.lam for _, point in states)], angle)
    return np.column_stack([timed(travelled, places, asked.gripper_speed, asked.acceleration).t, places, angles])


def distances_along(plan: FoldingPlan) -> Array:
    """Distance of the waypoints from the frictionless snap boundaries with the three eta_b, shape (3, n), m.

    Negative behind the boundary; nan from the waypoint on at which the sag has come to lie.
    """
    found, (x, z) = [], plan.waypoints[:, 1:3].T
    for strip, verdict in zip(plan.asked.strips, plan.choice.verdicts, strict=True):
        unit = strip.gravity_length
        away = unit * snap_boundary(strip.length_star).distance((x + strip.length / 2.0) / unit, z / unit)
        first = next(point.lam for problem, point in verdict.states if touches(problem.model, point))
        found.append(np.where(plan.travelled < unit * first, away, np.nan))
    return np.array(found)
