"""A path followed in steps of a given size, with effects that have a memory: internal friction.

Within a step the memory is fixed.  The step follows the branch of that problem from the last state to the step's end;
the effects update their memory there.  With the paper's pull the result depends on the step size, which is therefore
never changed silently.  In units of L*; lambda is the length travelled.  Source: docs/physics.md, section 8.

The update leaves the force of the bending hysteresis as it is, but takes the paper's pull away: the last state is no
equilibrium of the next step.  The force taken away is therefore replaced by a dead force that falls to zero in
proportion to lambda within the step.  Either way the strip is lost exactly where the branch of a step has a limit
point before the step's end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import inf

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import ContinuationError, InvalidInputError, LostStabilityError, SolveError
from stripfold.base.progress import Percent
from stripfold.follow import contact_branch
from stripfold.follow.contact_branch import (
    LIFTED,
    STEPS,
    UNHELD,
    BranchCrossing,
    BranchPoint,
    Planned,
    contact_changes,
    follow,
    is_unheld,
    lift_off_of_all,
    solved,
    transferred,
    zero,
)
from stripfold.follow.statics import (
    FIRST,
    LAMBDA_TOLERANCE,
    Until,
    static_track,
)
from stripfold.follow.track import CriticalEvent, End, Track
from stripfold.paths.curve import GripperPath
from stripfold.solve import continuation, critical, newton
from stripfold.solve.continuation import Event
from stripfold.solve.critical import LIMIT
from stripfold.solve.linear import Bordered
from stripfold.solve.problem import Equilibrium, Point, Tangent, inner
from stripfold.strip.effects import BendingLaw, Effect, Hysteresis, MomentCurvature, Pull
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, Motion

Effects = Callable[[Model, Array], tuple[Effect, ...]]
"""The effects on a strip, without force in the given state but for a law of bending."""

STEP = 0.1
"""Usual size of the steps, L*."""
FIRST_WITH_FRICTION = 1e-4
"""Length travelled, L*, from which the first steps with friction in bending are to double up to their size.
What is lifted grows with the fourth root of the height, and elements that stick are lost in longer steps where a thin
strip is pushed."""
LET_GO, TURNS_BACK = "what held it has left the floor", "the branch has a limit point"
REACHED = "end of the step"
SHARES = tuple(i / 8.0 for i in range(1, 9))
"""Shares of a law of bending with which the first state is found from that of the linear strip."""
AT_ONCE = newton.NewtonOptions(max_iterations=12)
"""Of the solve that goes to a step's end at once: where it converges, it takes half as many iterations."""
WITHIN_STEP = replace(STEPS, first=0.02, largest=0.3)
"""Steps of the continuation where one solve does not reach a step's end."""


def effects_of(
    law: str, strength: float, yield_curvature: float | None = None, bending: MomentCurvature | None = None
) -> Effects:
    """The effects of a law, "pull" or "hysteresis", this with kappa_y, 1/L*, or the usual one; none for strength 0.

    ``bending``: law of bending in place of the linear one.
    """

    def effects(model: Model, q: Array) -> tuple[Effect, ...]:
        own = () if bending is None else (BendingLaw.of(model, bending),)
        if strength == 0.0:
            return own
        if law == "pull":
            return (*own, Pull(model, strength, q))
        return (*own, Hysteresis.of(model, strength, yield_curvature=yield_curvature, slack=q))

    return effects


@dataclass(frozen=True, eq=False, kw_only=True)
class _StepProblem(MovingContact):
    """A step from ``start`` to ``end``: a dead force, shape (size,), replaces in part what the update took away."""

    start: float
    end: float
    taken: Array

    @classmethod
    def after(cls, at: BranchPoint, end: float) -> _StepProblem:
        """The step from an accepted state to lambda = ``end``."""
        q, start = at.point.q, at.point.lam
        new = at.problem.accepted(q)
        taken = at.point.state.force - new.residual(q, start)
        return cls(new.mesh, new.motion, new.effects, new.remembered, start=start, end=end, taken=taken)

    def _share(self, lam: float) -> float:
        return (self.end - lam) / (self.end - self.start)

    def residual(self, q: Array, lam: float) -> Array:
        return super().residual(q, lam) + self._share(lam) * self.taken

    def linearise(self, q: Array, lam: float, predicted_stress: Array | None = None) -> tuple[Array, Bordered, Array]:
        residual, matrix, rate = super().linearise(q, lam, predicted_stress)
        rate = rate - self.taken / (self.end - self.start)
        return residual + self._share(lam) * self.taken, matrix, rate


def steps_on(path: GripperPath, length: float, size: float, begin: float = 0.0) -> Iterator[tuple[Motion, float]]:
    """Motions of the gripper and lengths travelled, at equal steps of at most ``size`` within each piece.

    ``begin``: length travelled from which steps double up to the path's first one; 0: they do not.
    """
    for piece in path.pieces:
        motion = AlongPath(piece, length, path.gripper)
        count = int(np.ceil((piece.end - piece.start) / size * (1.0 - 1e-12)))
        ends = np.linspace(piece.start, piece.end, count + 1)[1:]
        if begin and piece is path.pieces[0]:
            doubled = begin * 2.0 ** np.arange(1.0, np.log2(ends[0] / begin))
            ends = np.concatenate([doubled, ends])
        for travelled in ends:
            yield motion, float(travelled)


def start_on_path(mesh: Planned, path: GripperPath, effects: Effects, size: float, begin: float = FIRST) -> BranchPoint:
    """The first state of a path that is followed in steps of ``size``, L*, from the flat strip, at most at ``begin``.

    Raises InvalidInputError: a step size that cannot be used.
    """
    if not 0.0 < size <= path.length:
        raise InvalidInputError("step", size, f"more than 0 and at most {path.length:g} L*")
    travelled = min(begin, path.pieces[0].end / 4.0, size / 4.0)
    length = mesh(np.array([1.0])).length
    motion = AlongPath(path.pieces[0], length, path.gripper)
    at = contact_branch.from_flat(mesh, motion, travelled)
    laws = [effect.law for effect in effects(at.model, at.u) if isinstance(effect, BendingLaw)]
    return with_effects(bent(at, laws[0]) if laws else at, effects)


def bent(at: BranchPoint, law: MomentCurvature) -> BranchPoint:
    """The state of a strip with a law of bending, at the lambda of one of the linear strip.

    The law changes in small steps.  Raises SolveError: a state could not be computed.
    """
    for share in SHARES:
        effects = (BendingLaw.of(at.model, law.partly(share)),)
        at = solved(MovingContact(at.problem.mesh, at.problem.motion, effects, at.contact), at.point.q, at.lam)
        if at.problem.mesh.drifted(at.contact):
            at = transferred(at)
    return at


def load_path(
    mesh: Planned,
    path: GripperPath,
    effects: Effects,
    size: float,
    progress: Callable[[str], None] | None = None,
    until: Until = "end",
    begin: float = 0.0,
) -> Track:
    """Follow a path from the flat strip in steps of ``size``, L*; errors as :func:`start_on_path` and :func:`load`.

    ``begin``: as for :func:`steps_on`.
    """
    first = start_on_path(mesh, path, effects, size, begin or FIRST)
    loaded = Percent(progress, "following the path in steps")
    places = steps_on(path, first.problem.mesh.length, size, first.lam if begin else 0.0)
    return load(first, places, until, progress=lambda at: loaded(at.point.lam / path.length))


def with_effects(at: BranchPoint, effects: Effects) -> BranchPoint:
    """The same state with effects that have no force there."""
    problem = MovingContact(at.problem.mesh, at.problem.motion, effects(at.model, at.u), at.contact)
    return BranchPoint(problem, at.point)


def load_incrementally_from(
    first: BranchPoint, places: Iterable[tuple[Motion, float]], locate: bool = True
) -> Iterator[BranchPoint]:
    """Steps from a state to each of ``places``: the motion of the gripper, and lambda, ascending.

    ``locate``: whether the error says where the strip was lost, or only the last state before.

    Raises LostStabilityError: the strip did not follow; the steps before have been yielded; SolveError: a step could
    not be computed.
    """
    at = first
    for motion, end in places:
        at = _turned(at, motion)
        at = _at_once(at, end) or _along_branch(at, end, locate)
        # A copy without the meshes that were tried: steps are many.
        problem, state = replace(at.problem), at.point.state
        point = replace(at.point, solve_eigenvalues=partial(continuation.eigenvalues, problem, state))
        yield BranchPoint(problem, point)


def load(
    first: BranchPoint,
    places: Iterable[tuple[Motion, float]],
    until: Until = "end",
    locate: bool = True,
    lifted: float = inf,
    progress: Callable[[BranchPoint], None] = lambda _: None,
) -> Track:
    """Follow the steps of :func:`load_incrementally_from` to their end or an earlier one.

    ``until``: whether to end at the first touch.  ``lifted``: length off the floor from which the whole strip counts as
    lifted, L*.  ``progress``: called with each state.  A strip that does not follow ends in a snap, and lambda
    there is the track's event.  Raises SolveError: a step could not be computed.
    """
    points: list[BranchPoint] = []
    try:
        for at in load_incrementally_from(first, places, locate):
            points.append(at)
            progress(at)
            if until == "touch" and at.touches:
                return static_track(points, End.TOUCH)
            if at.contact[-1] > lifted:
                return static_track(points, End.LIFTED)
    except LostStabilityError as error:
        if error.parameter is None:
            raise
        return static_track(points or [first], End.SNAP, events=(CriticalEvent(error.parameter),))
    return static_track(points, End.PATH)


def _turned(at: BranchPoint, motion: Motion) -> BranchPoint:
    """The same state where the gripper goes on by ``motion``, on elements planned anew if they have drifted."""
    problem, point = at.problem, at.point
    if motion != problem.motion:
        problem = MovingContact(problem.mesh, motion, problem.effects, problem.remembered)
        at = BranchPoint(problem, _rising(problem, point.state, point.arc))
    if problem.mesh.drifted(at.contact):
        return transferred(at)
    return at


def _at_once(at: BranchPoint, end: float) -> BranchPoint | None:
    """The state at a step's end by one solve; None where the branch may have a limit point or another contact before.

    The guards are those of the continuation.
    """
    problem, point, before = _StepProblem.after(at, end), at.point, at.point.tangent
    if before.lam <= 0.0:
        return None
    ds = (end - point.lam) / before.lam
    try:
        q, stress = problem.stepped(point.q, ds * before.q)
        state = newton.solve(problem, q, end, problem.bounded, None, AT_ONCE, stress)
        new = continuation.evaluate(problem, state, before, point.arc + ds)
    except SolveError:
        return None
    correction = np.linalg.norm(problem.contact(state.q) - problem.contact(q))
    jumps = (
        correction > max(WITHIN_STEP.max_correction * ds, WITHIN_STEP.kink)
        or inner(problem.metric, before, new.tangent) < WITHIN_STEP.min_cosine
        or critical.is_past(new)
        or any(event.passed(new, None) for event in contact_changes(problem))
    )
    return None if jumps else BranchPoint(problem, new)


def _along_branch(at: BranchPoint, end: float, locate: bool) -> BranchPoint:
    """The state at a step's end along the branch of the step's problem, through changes of the contact.

    Raises LostStabilityError: the branch has a limit point before; SolveError: the branch could not be followed.
    """
    problem = _StepProblem.after(at, end)
    residual = problem.residual(at.point.q, at.point.lam)
    state = Equilibrium(at.point.q, at.point.lam, at.point.active, at.point.state.residuals, residual)
    point = _rising(problem.sliding, state, at.point.arc)
    if point.negatives > 0:
        # It is about to be lost: as long as all sticks there is an event ahead.
        point = _rising(problem, state, at.point.arc)
    first = BranchPoint(problem, point)

    def stops(problem: MovingContact) -> list[Event]:
        return [zero(REACHED, lambda point: end - point.lam), lift_off_of_all(problem), LIMIT]

    last = first = _changed(first, end)
    turned: BranchCrossing | None = None
    for item in _followed(first, stops):
        if isinstance(item, BranchPoint):
            last = item if item.point.lam < end else last
            if last is item:
                continue
            # A change of contact went beyond the end.
        elif item.event in (UNHELD, LIMIT) and _layer_comes_down(item.after):
            turned = turned or item
            continue
        elif item.event in (UNHELD, LIMIT):
            raise _lost_at(item, locate)
        elif item.event.name == LIFTED:
            advice = "keep the gripper lower; without friction it is followed through the air"
            raise SolveError("the whole strip leaves the floor", parameter=item.before.point.lam, advice=advice)
        else:
            last = item.before
        new = BranchPoint(last.problem, continuation.step_to(last.problem, last.point, end, WITHIN_STEP))
        break
    if turned is not None and critical.is_past(new.point):
        raise _lost_at(turned, locate)
    return new


def _layer_comes_down(after: BranchPoint) -> bool:
    """Whether behind a limit point it is the contact of an upper layer that moves most, and not the lift-off.

    Nothing falls there if the branch rises again: friction has left the strip bent down and the layer has touched in a
    second place, or one element slides before the next, and an end of the contact goes on.  Source: docs/method.md.
    """
    moves = np.abs(after.point.tangent.q[after.problem.n :])
    return int(np.argmax(moves)) < len(moves) - 1


def _followed(
    first: BranchPoint, stops: Callable[[MovingContact], list[Event]]
) -> Iterator[BranchPoint | BranchCrossing]:
    """The branch; where an element begins to slide it may turn by a sharp angle, and back at a limit point."""
    last = first
    try:
        for item in follow(first, WITHIN_STEP, stops):
            if isinstance(item, BranchPoint):
                last = item
            yield item
    except ContinuationError as error:
        point = _rising(last.problem.sliding, last.point.state, last.point.arc)
        if point.negatives > 0:
            raise _lost("it is unstable once another element slides", point.lam) from error
        if last is first:
            raise
        yield from _followed(BranchPoint(last.problem, point), stops)


def _rising(problem: MovingContact, state: Equilibrium, arc: float) -> Point:
    """The point of a state, its branch followed with lambda rising.

    Where an element begins to slide or the gripper turns, the direction that it came in does not say how it goes on.
    """
    return continuation.evaluate(problem, state, Tangent(np.zeros(problem.size), 1.0), arc)


def _changed(at: BranchPoint, end: float) -> BranchPoint:
    """The state with the contact that follows where a change of contact has been passed.

    An interval of contact that begins beyond the step's end is left to the next step.
    """
    for event, change in contact_changes(at.problem).items():
        if event.passed(at.point, None):
            changed = change(at)
            if changed.point.lam >= end:
                return at
            if is_unheld(at, changed):
                raise _lost(LET_GO, changed.point.lam)
            return changed
    return at


def _lost(why: str, lam: float) -> LostStabilityError:
    return LostStabilityError(f"the strip does not follow its gripper: {why}", parameter=lam)


def _lost_at(crossing: BranchCrossing, locate: bool) -> LostStabilityError:
    """That at a change of the contact, whose sides have different elements, or at a limit point."""
    if crossing.event is UNHELD:
        return _lost(LET_GO, crossing.after.point.lam)
    return _lost(TURNS_BACK, _limit(crossing) if locate else crossing.before.point.lam)


def _limit(crossing: BranchCrossing) -> float:
    """lambda at a limit point."""
    before, after = crossing.before.point, crossing.after.point
    try:
        return critical.locate(crossing.before.problem, before, after, LAMBDA_TOLERANCE, WITHIN_STEP).lam
    except SolveError as error:
        # An element begins to slide and the branch turns back by more than a right angle: no point lies ahead.
        return before.lam if error.parameter is None else error.parameter
