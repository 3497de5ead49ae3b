"""Where a path lays a strip, and what the way there does to it, for all that is uncertain about the strip; in SI.

The rod follows the path with the least and the largest eta_b, falls included.  A layer that comes down beyond the place
planned for it has to slide back, and friction between the layers may keep it (docs/plan.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from math import inf, isfinite, isnan, nan
from typing import Any

import numpy as np

from stripfold import elastica
from stripfold.ask.assess import PathAssessment, assess
from stripfold.ask.friction import SPARE, lost_with
from stripfold.ask.inputs import PathInputs, PlanInputs, Strip
from stripfold.ask.planned_motion import ACCURATE, at_speed
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.base.validation import Gripper
from stripfold.elastica.boundary import snap_boundary
from stripfold.follow.contact import columns_on_floor, touches
from stripfold.follow.track import StripState, first_landing, nodes
from stripfold.paths import FoldPath
from stripfold.paths.curve import GripperPath, polygon_length
from stripfold.paths.motion import timed
from stripfold.paths.rpath import half_fold

STEP = 0.25
"""Size of the steps with friction, L*: the finished fold is then within 2e-4 L* of that with steps of a tenth."""
FALL_TOLERANCE = 1e-4
"""Error of a fall per step up to its touch, L*, where that is then within 2e-3 L*, and its speed within 5 %."""
DELAY = 8.0
"""Distance by which friction delays a snap, L* per M_0 in rho_a g L*^2: the least at the heights of docs/physics.md."""
FRICTION_UNCERTAINTY = 0.1
"""Of M_0, relative, where it is not given: it is seldom known to better than that."""
SAMPLES = 4000
"""Of what is uncertain, from which the interval of the fold's error follows."""
FARTHEST, OFFSETS = 4.0, 17
"""Largest place of the gripper for which the fold's error is computed, standard deviations, and number of places."""
NORMAL_95 = 1.96
"""Standard deviations within which 95 % of a normal distribution lie."""
ROUNDING = 1e-9
"""Length by which a limit may be missed, m."""
NOT_SHOWN = ("candidate", "verdicts")
Bound = tuple[float, float]
"""Least and largest value, or median and 95 % quantile."""


@dataclass(frozen=True)
class Candidate:
    """A path, the gripper that it takes, and how it was made."""

    name: str
    path: FoldPath
    made: str
    gripper: Gripper = "hinge"


@dataclass(frozen=True)
class Outcome:
    """What comes of a path, for all eta_b of the interval; lengths in m, per width.

    Attributes
    ----------
    candidate
        The path.
    error
        Distance of the finished fold from the accurate one, the largest of a point of the strip, with the slide on the
        table and the gripper's accuracy: its median, and what 95 of 100 folds do not exceed.
    touch_error, layer_slide
        How far beyond its planned place the upper layer first touches, and the largest way of that point of it over the
        lower one until the fold is done.
    drop, energy, speed
        Of the largest snap: height that a point loses, energy freed, J/m, and largest speed, m/s; 0 without a snap, nan
        of one whose fall could not be measured.
    margin
        Least distance of the gripper from where the strip snaps; 0 where it does, nan of a clamp, which holds it there.
    flatness_ratio
        Height of the lowest waves of the flat strip that its push makes grow, over the flatness; inf without a push.
    hold_friction, table_slide
        Coefficient of friction of the table that holds the strip without a pin, and how far it slides on the table; nan
        of one that slips and was not followed.
    largest_angle, tool_room
        As of :class:`.PathAssessment`.
    sufficient_moment
        M_0 with which friction holds the strip where it would snap without, N; None where it need not.
    with_friction
        Whether it was followed with the friction in bending that is given.
    duration
        Of the motion, s.
    failure
        Why what the strip does could not be computed for one of the eta_b; empty where it could.
    excluded
        The limit that it does not keep, in words; empty where it keeps all.
    verdicts
        The rod's, with the least and the largest eta_b, for the best path with the given one, too, as far as they could
        be computed.
    """

    candidate: Candidate
    error: Bound
    touch_error: Bound
    layer_slide: float
    drop: float
    energy: float
    speed: float
    margin: float
    flatness_ratio: float
    hold_friction: float
    table_slide: float
    largest_angle: float
    tool_room: float
    duration: float
    sufficient_moment: float | None = None
    with_friction: bool = False
    failure: str = ""
    excluded: str = ""
    verdicts: tuple[PathAssessment, ...] = field(default=(), repr=False)

    @property
    def name(self) -> str:
        """That of the candidate."""
        return self.candidate.name

    @property
    def path(self) -> FoldPath:
        """The candidate's."""
        return self.candidate.path

    def lacks_friction(self, asked: PlanInputs) -> bool:
        """Whether its numbers are without the friction in bending that is given."""
        return asked.friction_moment is not None and not self.with_friction

    def costs(self, asked: PlanInputs) -> str:
        """What the path costs, in words."""
        if self.failure:
            return self.failure
        said = []
        if self.drop != 0.0:
            size = f": {_mm(self.drop)} down, {max(1e3 * self.energy, 0.0):.2g} mJ/m freed" if self.drop > 0.0 else ""
            said.append(f"it snaps{size}")
        else:
            said.append("nothing snaps" + (f" within {_mm(self.margin)} of the path" if self.margin > 0.0 else ""))
        if self.sufficient_moment is not None:
            said[-1] = f"held by friction: M_0 = {self.sufficient_moment:.2g} N suffices"
        late = self.touch_error[1]
        if late > ACCURATE * asked.gravity_length:
            said.append(f"the layer lands {_mm(late)} too far and has to slide back")
        elif self.layer_slide > ACCURATE * asked.gravity_length:
            said.append(f"the layers slide {_mm(self.layer_slide)} over each other")
        if self.flatness_ratio < 1.0:
            said.append(f"its push may make wrinkles of {_mm(self.flatness_ratio * asked.flatness)} ruck")
        if asked.table_friction is None or self.table_slide != 0.0:
            slides = f"it slides {_mm(self.table_slide)} on the table: " if self.table_slide > 0.0 else ""
            said.append(f"{slides}without a pin it takes table friction of {self.hold_friction:.2g}")
        if self.candidate.gripper == "turning":
            said.append("the gripper clamps and turns as the path says")
        if self.lacks_friction(asked):
            lost = ", with which it is lost or cannot be followed" if self.candidate.gripper == "hinge" else ""
            said.append(f"* all this without the friction in bending{lost}")
        if isfinite(self.tool_room):
            said.append(f"a tool of at most {1e3 * self.tool_room:.0f} mm clears the table")
        return "; ".join(said)

    def to_dict(self) -> dict[str, Any]:
        """The numbers by name."""
        of = self.candidate
        values = {item.name: getattr(self, item.name) for item in fields(self) if item.name not in NOT_SHOWN}
        # JSON knows neither nan nor inf.
        known = {name: None if isinstance(of, float) and not isfinite(of) else of for name, of in values.items()}
        bounds = {
            name: [value if isfinite(value) else None for value in values[name]] for name in ("error", "touch_error")
        }
        return {"path": of.name, "gripper": of.gripper, "made": of.made, **known, **bounds}


def worst(values: Iterable[float], of: Callable[[Array], Any] = np.max) -> float:
    """Largest, or what ``of`` takes, of the values that are known."""
    known = np.array([value for value in values if not isnan(value)])
    return float(of(known)) if len(known) else nan


def outcome_of(
    asked: PlanInputs,
    candidate: Candidate,
    strips: Sequence[Strip],
    say: Callable[[str], None] = lambda _: None,
    known: Outcome | None = None,
    slides: bool = False,
) -> Outcome:
    """Follow a path with strips of several eta_b, the stiffest first.

    ``known``: what came of it with some of them.  ``slides``: whether to follow, which takes seconds, how far a strip
    slides on its table; without, one that slips is not folded.
    """
    follower = _Follower(asked, candidate, slides)
    # Verdicts with friction are none without.
    there = {} if known is None or known.with_friction else {of.asked.eta_b: of for of in known.verdicts}
    verdicts: list[PathAssessment] = []
    moment, failure, error, hold_friction, slips = None, "", (nan, inf), nan, False
    rubbed = follower.with_friction(strips, say, known) if known is None or known.with_friction else None
    try:
        if rubbed is not None:
            moment, verdicts = rubbed
        for strip in strips[len(verdicts) :]:
            say(f"{candidate.name} path with eta_b = {strip.eta_b:.4g}")
            verdicts.append(there.get(strip.eta_b) or follower.verdict(strip))
        hold_friction = worst(verdict.hold_friction for verdict in verdicts)
        slips = asked.table_friction is not None and hold_friction > asked.table_friction
        error = (nan, inf) if slips and not slides else follower.error(verdicts, say, rubbed is not None)
    except SolveError as problem:
        failure = " ".join(str(problem).split())
    margin = worst(map(follower.margin, verdicts), np.min)
    if moment is not None and asked.friction_moment is not None:
        margin = follower.delay * (asked.friction_moment - moment)
    events = [event for verdict in verdicts for event in verdict.critical]

    def snap(key: str) -> float:
        return worst(event[key] for event in events) if events else 0.0

    touch = [verdict.touch_error for verdict in verdicts]
    found = Outcome(
        candidate,
        error=error,
        touch_error=(worst(touch, np.min), worst(touch)),
        layer_slide=worst(map(follower.layer_slide, verdicts)),
        drop=snap("drop"),
        energy=snap("energy"),
        speed=snap("speed"),
        margin=margin,
        flatness_ratio=worst((verdict.flatness_ratio for verdict in verdicts), np.min),
        hold_friction=hold_friction,
        table_slide=worst(abs(verdict.slide) for verdict in verdicts) if slides or not slips else nan,
        largest_angle=worst(verdict.largest_angle for verdict in verdicts),
        tool_room=worst((verdict.tool_room for verdict in verdicts), np.min),
        duration=follower.duration,
        sufficient_moment=moment,
        with_friction=rubbed is not None,
        failure=failure or next((verdict.failure for verdict in verdicts if verdict.failure), ""),
        verdicts=tuple(verdicts),
    )
    return replace(found, excluded=_excluded(asked, found))


def _excluded(asked: PlanInputs, found: Outcome) -> str:
    """The first limit that an outcome does not keep, in words; a number that is not known keeps none."""
    limits = (
        ("the drop of its snap", found.drop, asked.max_snap, 1.0),
        ("the slide of the layers over each other", found.layer_slide, asked.max_slide, 1.0),
        ("its distance from where the strip snaps", found.margin, asked.margin, -1.0),
        ("the longest tool that clears the table", found.tool_room, asked.tool, -1.0),
    )
    for what, value, limit, sign in limits:
        if limit is not None and not sign * value <= sign * limit + ROUNDING:
            return f"{what} is {_mm(value)}, {'at most' if sign > 0.0 else 'at least'} {_mm(limit)} is asked for"
    return ""


def _mm(value: float) -> str:
    if isnan(value):
        return "not known"
    return f"{1e3 * value:.2g} mm" if abs(value) < 0.01 else f"{1e3 * value:.0f} mm"


@dataclass(frozen=True)
class _Follower:
    asked: PlanInputs
    candidate: Candidate
    slides: bool

    def verdict(self, strip: Strip, moment: float | None = None, fall: bool = True) -> PathAssessment:
        """The rod's, with falls, or with a friction moment, N, which knows none."""
        asked = self.asked
        given: dict[str, Any] = {"flatness": asked.flatness, "gripper": self.candidate.gripper, "curl": asked.curl}
        if self.slides:
            given["table_friction"] = asked.table_friction
        inputs = PathInputs(**strip.model_dump(), **given, model="rod", fall=fall and moment is None)
        if moment is None:
            found = assess(inputs, self.candidate.path, compare=False, tolerance=FALL_TOLERANCE)
            # Of a fall a plan needs where the layer lands: all states of ten assessments take hundreds of megabytes.
            landed = ((before, motion, first_landing(motion)) for before, motion in found.falls)
            kept = ((before, (motion[0], motion[-1 if at is None else at])) for before, motion, at in landed)
            return replace(found, falls=tuple(kept))

        def in_steps(step: float | None) -> PathAssessment:
            rubbed = inputs.model_copy(update={"friction_moment": moment, "step": step})
            return assess(rubbed, self.candidate.path, yield_curvature=asked.yield_curvature, compare=False)

        # What is lost in long steps may not be in short ones.
        with suppress(SolveError):
            if (found := in_steps(STEP * strip.gravity_length)).stable:
                return found
        return in_steps(None)

    @property
    def delay(self) -> float:
        """Distance by which friction delays a snap, m per N of M_0."""
        return DELAY / self.asked.material.force_scale

    @property
    def friction_uncertainty(self) -> float:
        """Of M_0, relative."""
        given = self.asked.friction_uncertainty
        return FRICTION_UNCERTAINTY if given is None else given

    def with_friction(
        self, strips: Sequence[Strip], say: Callable[[str], None], known: Outcome | None
    ) -> tuple[float | None, list[PathAssessment]] | None:
        """What the strips do with the friction in bending that is given, and M_0 that holds them; None: they need none.

        ``known``: what some of them do.  M_0 is as much less than there is as the margin, its uncertainty and
        :data:`SPARE` say.  None of both where there is no friction, they do not follow with it, or cannot be followed:
        what is known without then stands, in which nothing is held.
        """
        asked, there = self.asked, self.asked.friction_moment
        if there is None or self.candidate.gripper != "hinge":
            return None
        least = min(1.0 / SPARE, 1.0 - self.friction_uncertainty) * there
        enough = min(least, there - (asked.margin or 0.0) / self.delay)
        found = {} if known is None else {verdict.asked.eta_b: verdict for verdict in known.verdicts}
        moment = None if known is None else known.sufficient_moment
        new = {strip.eta_b: strip for strip in strips if strip.eta_b not in found}
        followed = [(strip.material, strip.length, self._scaled(strip)) for strip in new.values()]
        try:
            say(f"{self.candidate.name} path with friction in bending")
            found |= {eta_b: self.verdict(strip, there) for eta_b, strip in new.items()}
            if not all(isfinite(verdict.shape_error) for verdict in found.values()):
                return None
            held = moment is not None or not all(self.verdict(strip, fall=False).stable for strip in new.values())
            if new and held and (enough <= 0.0 or lost_with(followed, enough, asked.yield_curvature, say) is not None):
                return None
        except SolveError:
            return None
        return enough if held else None, [found[strip.eta_b] for strip in strips]

    def _scaled(self, strip: Strip) -> GripperPath:
        return self.candidate.path.curve.scaled(1.0 / strip.gravity_length)

    def margin(self, verdict: PathAssessment) -> float:
        """Least distance from where this strip snaps, up to the touch; 0 where it does, nan of a clamp or a curl."""
        if not verdict.stable:
            return 0.0
        if self.candidate.gripper != "hinge" or self.asked.curl:
            return nan
        unit, places = verdict.asked.gravity_length, list[tuple[float, float]]()
        below = elastica.touch_limit() * unit - self.candidate.path.places[:, 2].max()
        if below > 0.0:
            return float(below)  # the gripper may be so much too high all along
        for problem, point in verdict.states:
            if touches(problem.model, point):
                break
            x, z = problem.model.mid_surface(point.q)[0]
            places.append((x + 0.5 * problem.model.length, z))
        advance, z = np.array(places).T
        return unit * float(_boundary(self.asked.strips[-1].length_star).distance(advance, z).min())

    def layer_slide(self, verdict: PathAssessment) -> float:
        """Way of the point of the upper layer that touches first, from there to the end; nan without a touch."""
        motions = (motion for _, motion in verdict.falls)
        landed = [motion[i] for motion in motions if (i := first_landing(motion)) is not None]
        laid = (state for state in verdict.states if touches(state.problem.model, state.point))
        first = next(iter(landed), None) or next(laid, None)
        if first is None:
            return nan
        s = first.problem.model.s[columns_on_floor(first.problem.model, first.point)][:1]
        before, after = (_place(state, s) for state in (first, verdict.states[-1]))
        return verdict.asked.gravity_length * abs(after - before)

    @property
    def duration(self) -> float:
        """Of the motion, s."""
        return float(times(self.asked, self.candidate.path)[-1])

    def error(self, verdicts: Sequence[PathAssessment], say: Callable[[str], None], with_friction: bool) -> Bound:
        """Median and 95 % quantile of the fold's error: eta_b, M_0, the gripper's place, and whether friction decides.

        Of the best path, with three verdicts, the fold that friction leaves is found in time; of others it is bounded.
        """
        asked, eta_b = self.asked, [verdict.asked.eta_b for verdict in verdicts]
        if not all(isfinite(verdict.shape_error) for verdict in verdicts):
            return nan, inf
        deviation = asked.gripper_accuracy / NORMAL_95
        offs = deviation * np.linspace(-FARTHEST, FARTHEST, OFFSETS) if deviation else np.zeros(1)
        slides = np.array([[abs(verdict.slide)] for verdict in verdicts])
        still = np.stack([_errors(verdict.states[-1], verdict.asked, offs) for verdict in verdicts]) + slides
        rubbed, late = still.copy(), int(np.argmax([verdict.touch_error for verdict in verdicts]))
        is_late = verdicts[late].touch_error > ACCURATE * verdicts[late].asked.gravity_length
        snapped = [i for i, verdict in enumerate(verdicts) if verdict.critical]
        if asked.layer_friction and len(verdicts) == len(asked.strips) and (is_late or snapped):
            say(f"{self.candidate.name} path with friction between the layers")
            at = late if is_late else snapped[-1]
            strip, moment = verdicts[at].asked, verdicts[at].asked.friction_moment or 0.0
            rubbed[at] = _errors(
                at_speed(asked, strip, self._scaled(strip), asked.layer_friction, moment).states[-1], strip, offs
            )
        elif asked.layer_friction and is_late:
            # A point that stays where it has touched is off by the way that it would have to slide back.
            rubbed[late] += self.layer_slide(verdicts[late])
        random = np.random.default_rng(0)
        drawn = random.uniform(eta_b[0], eta_b[-1], SAMPLES), random.normal(0.0, deviation, SAMPLES)
        holds = random.uniform(size=SAMPLES) < 0.5
        off = np.where(holds, *(_interpolated(eta_b, offs, of, *drawn) for of in (rubbed, still)))
        if with_friction:
            off = np.maximum(off + self._by_friction(verdicts, say) * random.uniform(-1.0, 1.0, SAMPLES), 0.0)
        median, most = np.quantile(off, (0.5, 0.95))
        return float(median), float(most)

    def _by_friction(self, verdicts: Sequence[PathAssessment], say: Callable[[str], None]) -> float:
        """How much farther a fold is off, m, with as much more friction in bending as may be.

        Of the best path, with three verdicts, that is followed; of others it is in proportion to the error.
        """
        asked, given, uncertain = self.asked, verdicts[len(verdicts) // 2], self.friction_uncertainty
        if asked.friction_moment and uncertain and len(verdicts) == len(asked.strips):
            say(f"{self.candidate.name} path with more friction in bending")
            with suppress(SolveError):
                more = self.verdict(asked.strips[1], (1.0 + uncertain) * asked.friction_moment)
                if isfinite(more.shape_error):
                    return more.shape_error - given.shape_error
        return uncertain * given.shape_error


def _errors(state: StripState, strip: Strip, offs: Array) -> Array:
    """Errors of a fold, m, with the gripper off by so much along x at the end, m: shape of ``offs``.

    The fold line is then off by half of it, and every point by what the fold is shifted and rolls: no other equilibrium
    is computed.
    """
    unit, length = strip.gravity_length, strip.length_star
    model, folded, s = state.problem.model, half_fold(length).folded, nodes(length)
    there = model.resampled_mid_surface(state.point.q, s)
    found = []
    for shift in 0.5 * offs / unit:
        # The layers end as straight lines.
        inside = np.clip(s - shift, 0.0, length)
        rolled = folded.at(inside) + np.column_stack([shift + np.where(s - shift < inside, shift, 0.0), 0.0 * s])
        found.append(np.linalg.norm(there + rolled - 2.0 * folded.at(s), axis=1).max())
    return unit * np.array(found)


def _interpolated(eta_b: Sequence[float], offs: Array, errors: Array, at: Array, off: Array) -> Array:
    """Errors, shape (strips, offsets), between these."""
    along = np.stack([np.interp(off, offs, row) for row in errors])
    if eta_b[0] == eta_b[-1]:
        return np.asarray(along[0])
    upper = np.clip(np.searchsorted(eta_b, at), 1, len(eta_b) - 1)
    low, high = np.array(eta_b)[[upper - 1, upper]]
    share = (at - low) / (high - low)
    drawn = np.arange(len(at))
    return np.asarray((1.0 - share) * along[upper - 1, drawn] + share * along[upper, drawn])


def times(asked: PlanInputs, path: FoldPath) -> Array:
    """When the gripper is at the places of a path, s."""
    _, places = path.curve.sampled(path.spacing)
    travelled = polygon_length(places)
    return timed(travelled, places, asked.gripper_speed, asked.acceleration, asked.jerk).when(travelled)


_boundary = lru_cache(maxsize=8)(snap_boundary)


def _place(state: StripState, s: Array) -> float:
    """x of a point of the mid-surface."""
    return float(state.problem.model.resampled_mid_surface(state.point.q, s)[0, 0])
