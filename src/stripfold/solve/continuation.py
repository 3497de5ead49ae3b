"""Pseudo-arclength continuation: a generator of accepted points of a branch.

One function, :func:`step`, serves marching and bracketing.  Only points that pass the guards against jumping to
another branch are yielded; ``docs/method.md`` says what can still be missed.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf, sqrt
from typing import overload

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import ContinuationError, NewtonError, SolveError
from stripfold.solve import newton
from stripfold.solve.events import Crossing, Event, narrow
from stripfold.solve.problem import Equilibrium, Point, Problem, Tangent, inner
from stripfold.solve.stability import nearest_eigenvalues

logger = logging.getLogger(__name__)
CONTACT_CHANGE_RANGE = 1e-4
"""Arc length within which a contact must change for a branch to be continued with it switched."""


@dataclass(frozen=True, slots=True)
class StepOptions:
    """Step control and guards; lengths in the problem's metric."""

    first: float = 0.1
    smallest: float = 1e-6
    largest: float = 0.3
    target_iterations: int = 6
    """Newton iterations at which the step length is kept."""
    min_cosine: float = 0.9
    """Guard: smallest cosine between the tangents at both ends of a step."""
    max_correction: float = 0.3
    """Guard: largest distance between prediction and point, as a share of the step."""
    kink: float = 0.01
    """Distance below which the two guards above are off: where a contact opens the tangent jumps, however short the
    step, but no other branch is so close."""
    max_inertia_change: int = 1
    """Guard: largest change of the number of negative eigenvalues in one step."""
    max_attempts: int = 100_000
    """Largest number of steps along one branch, rejected ones included."""
    newton: newton.NewtonOptions = field(default_factory=newton.NewtonOptions)


def evaluate(problem: Problem, state: Equilibrium, towards: Tangent, arc: float = 0.0) -> Point:
    """Tangent, oriented along ``towards``, and stability of an equilibrium."""
    at = newton.Linearised.at(problem, state.q, state.lam, state.active)
    tangent = at.tangent(problem.metric, towards)
    return Point(state, tangent, at.kept.negatives(), partial(eigenvalues, problem, state), arc)


def eigenvalues(problem: Problem, state: Equilibrium) -> tuple[Array, Array]:
    """Eigenvalues of the tangent nearest zero, and the mode of the smallest: :func:`.nearest_eigenvalues`.

    They are those at fixed contact coordinates, where there are any.
    """
    at = newton.Linearised.at(problem, state.q, state.lam, state.active)
    block = at.kept.block
    return nearest_eigenvalues(problem.mass_at(state.q), block, block.factor(), at.held)


def start(problem: Problem, q: Array, lam: float, active: Index, sign: float, options: StepOptions) -> Point:
    """First point of a branch: the equilibrium at ``lam`` near ``q``, followed with lambda rising or falling."""
    state = newton.solve(problem, q, lam, active, options=options.newton)
    return evaluate(problem, state, Tangent(np.zeros(problem.size), sign))


def step(problem: Problem, point: Point, ds: float, options: StepOptions) -> Point:
    """The point at distance ``ds`` along the tangent of ``point``.

    Raises NewtonError: when Newton's method does not converge, or its result fails a guard: the step is too long.
    """
    t = point.tangent
    (q0, stress), lam0 = problem.stepped(point.q, ds * t.q), point.lam + ds * t.lam
    constraint = newton.Constraint(problem.metric * t.q, t.lam, q0, lam0)
    state = newton.solve(problem, q0, lam0, point.state.active, constraint, options.newton, stress)
    moved = Tangent(state.q - q0, state.lam - lam0)
    correction = sqrt(inner(problem.metric, moved, moved))
    if correction > max(options.max_correction * abs(ds), options.kink):
        raise NewtonError("guard: the point lies too far from its prediction", parameter=state.lam, step=ds)
    try:
        new = evaluate(problem, state, t, point.arc + ds)
    except SolveError as error:
        # The tangent is singular to rounding; with a slightly shorter step it is not.
        raise NewtonError(str(error), parameter=state.lam, step=ds) from error
    cosine = inner(problem.metric, t, new.tangent)
    if cosine < options.min_cosine and ds > options.kink:
        raise NewtonError(f"guard: the branch turns by a cosine of {cosine:.2f}", parameter=state.lam, step=ds)
    if abs(new.negatives - point.negatives) > options.max_inertia_change:
        raise NewtonError("guard: several eigenvalues changed sign at once", parameter=state.lam, step=ds)
    return new


@overload
def follow(problem: Problem, first: Point, options: StepOptions) -> Iterator[Point]: ...
@overload
def follow(
    problem: Problem, first: Point, options: StepOptions, events: Sequence[Event]
) -> Iterator[Point | Crossing]: ...
def follow(
    problem: Problem, first: Point, options: StepOptions, events: Sequence[Event] = ()
) -> Iterator[Point | Crossing]:
    """Yield ``first`` and then point after point along its branch; the caller decides when to stop.

    Each event that happens in a step is yielded as a :class:`.Crossing` before the point at the end of that step, in
    the order of the branch; where it cannot be told, in that of ``events``.

    Raises ContinuationError: when a step would have to be shorter than ``options.smallest``; carries the last residual
    history; SolveError: an event could not be located.
    """
    point, ds, beyond = first, options.first, None
    contact_switched = shortened = False
    pending = [event for event in events if not event.passed(first, None)]
    yield point
    for _ in range(options.max_attempts):
        try:
            new = beyond or step(problem, point, ds, options)
            crossings = _crossings(problem, point, new, pending, options)
        except NewtonError as error:
            if beyond is not None:
                raise
            ds, shortened = ds / 2.0, True
            if ds >= options.smallest:
                continue
            beyond = None if contact_switched else switch_contact(problem, point)
            if beyond is None:
                raise ContinuationError(
                    f"the branch could not be followed past lambda = {point.lam:.9g}: {error}",
                    parameter=point.lam,
                    step=ds,
                    residuals=error.residuals,
                    advice="refine the mesh or allow smaller steps",
                ) from error
            ds = options.kink
            continue
        iterations = len(new.state.residuals) - 1
        if beyond is None:
            # Where a step had to be shortened, the next would have to be as well.
            growth = 1.0 if shortened else 2.0
            ds = min(ds * min(growth, max(0.5, options.target_iterations / max(iterations, 1))), options.largest)
            shortened = False
        contact_switched, beyond = beyond is not None, None
        yield from crossings
        pending = [event for event in events if not event.passed(new, point)]
        point = new
        logger.debug("state at lambda = %.6g L*, %d unknowns, %d iterations", point.lam, problem.size, iterations)
        yield point
    raise ContinuationError(
        f"the branch was not followed to its end in {options.max_attempts} steps; it is at lambda = {point.lam:.9g}",
        parameter=point.lam,
        step=ds,
        advice="refine the mesh or allow longer steps",
    )


def _crossings(
    problem: Problem, before: Point, after: Point, events: Sequence[Event], options: StepOptions
) -> list[Crossing]:
    """The events in one step, in the order of the branch."""
    found = []
    for event in events:
        if event.passed(after, before):
            crossing = Crossing(event, before, after)
            if event.located(before):
                crossing = locate(problem, crossing, options)
                # Another event can only come first in the part before it.
                after = crossing.before
            found.append(crossing)
    return sorted(found, key=lambda crossing: crossing.before.arc)


def locate(problem: Problem, crossing: Crossing, options: StepOptions, max_evaluations: int = 60) -> Crossing:
    """An event located to its tolerance between two points of a branch.

    Raises NewtonError: the points lie on different branches; SolveError: the bracket cannot be made that narrow.
    """

    longest = inf

    def point_between(at: Crossing, ds: float) -> Point:
        nonlocal longest
        _check_one_branch(problem, at, options)
        ds = min(ds, longest)
        point = _point_between(problem, at, ds, options)
        taken = point.arc - at.before.arc
        # Where a step had to be shortened, the next would have to be as well.
        longest = 2.0 * taken if 0.0 < taken < 0.9 * ds else 2.0 * longest
        return point

    event = crossing.event
    if event.directly is not None and event.width(crossing.before, crossing.after) > event.tolerance:
        with suppress(SolveError):
            return Crossing(event, *event.directly(problem, crossing.before, crossing.after, options))
    found = narrow(crossing, point_between, max_evaluations)
    _check_one_branch(problem, found, options)
    return found


def _check_one_branch(problem: Problem, at: Crossing, options: StepOptions) -> None:
    """Where two branches nearly meet, a step can lead from one to the other without a turn of the tangent.

    A bracket of an event narrows then to the gap between them: its ends stay apart, however small their arc length.
    As for a step, no other branch is within ``options.kink``.
    """
    apart, width = Tangent(at.after.q - at.before.q, at.after.lam - at.before.lam), at.after.arc - at.before.arc
    if sqrt(inner(problem.metric, apart, apart)) > (1.0 + options.max_correction) * width + options.kink:
        raise NewtonError("guard: the step leads to another branch", parameter=at.before.lam, step=width)


def _point_between(problem: Problem, crossing: Crossing, ds: float, options: StepOptions) -> Point:
    """A point at most ``ds`` behind the first end of a bracket: the nearer, the shorter the way without a kink."""
    before = crossing.before
    while True:
        try:
            return step(problem, before, ds, options)
        except NewtonError as error:
            ds /= 4.0
            if ds >= options.smallest:
                continue
            # No point lies ahead: a contact changes here and the branch turns back.
            switched = switch_contact(problem, before)
            if switched is not None and crossing.event.passed(switched, None):
                return switched
            raise SolveError(
                f"a point between the bracket's ends was not found: {error}", parameter=before.lam
            ) from error


AT_VALUE = 1e-7
"""Distance from a value of lambda at which the equilibrium there is solved for."""


def step_to(problem: Problem, point: Point, lam: float, options: StepOptions) -> Point:
    """The point at ``lam`` in guarded steps from one shortly before it.

    Raises SolveError: it is not reached.
    """
    for _ in range(40):
        if abs(lam - point.lam) <= AT_VALUE:
            state = newton.solve(problem, point.q, lam, point.active, options=options.newton)
            return evaluate(problem, state, point.tangent, point.arc)
        ds = (lam - point.lam) / point.tangent.lam
        try:
            point = step(problem, point, ds, options)
        except NewtonError:
            if ds < 0.0:
                raise
            # A contact changes on the way, perhaps turning the branch: half the way as any other part of it.
            branch = follow(problem, point, replace(options, first=ds / 2.0, largest=ds / 2.0))
            next(branch)
            point = next(branch)
    raise SolveError(f"the point at lambda = {lam:.9g} was not reached", parameter=lam)


def switch_contact(problem: Problem, point: Point) -> Point | None:
    """The same state with the next contact opened or closed, and the tangent of the branch beyond.

    Where a contact opens or closes, a branch can turn back by more than a right angle: no point lies ahead in the
    direction it came, however short the step.  The contact that the tangent would violate first is opened or closed,
    and the new tangent points to where that contact is admissible.  None where no contact changes within
    :data:`CONTACT_CHANGE_RANGE`: then the branch ends, or Newton fails, for another reason.
    """
    if not len(problem.bounded):
        return None
    t, q, lam = point.tangent, point.q, point.lam
    bounded = problem.bounded
    is_active = np.isin(bounded, point.state.active)
    _, ahead = _contact_rates(problem, point.state, t)
    force = problem.residual(q, lam)[bounded]
    left = np.where(is_active, force, q[bounded] - problem.lower)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(ahead < 0.0, np.maximum(left, 0.0) / -ahead, np.inf)
    changed = int(np.argmin(distance))
    if distance[changed] > CONTACT_CHANGE_RANGE:
        return None
    is_active[changed] = ~is_active[changed]
    state = replace(point.state, active=bounded[is_active])
    new = evaluate(problem, state, t, point.arc)
    gap_rate, rate = _contact_rates(problem, state, new.tangent)
    admissible = rate[changed] if is_active[changed] else gap_rate[changed]
    if admissible < 0.0:
        new = replace(new, tangent=Tangent(-new.tangent.q, -new.tangent.lam))
    return new


def _contact_rates(problem: Problem, state: Equilibrium, t: Tangent) -> tuple[Array, Array]:
    """Along a direction: rates of the gaps, and of what must stay positive (force if active, else gap)."""
    _, k, load_rate = problem.linearise(state.q, state.lam)
    gap_rate = t.q[problem.bounded]
    force_rate = (k @ t.q + load_rate * t.lam)[problem.bounded]
    return gap_rate, np.where(np.isin(problem.bounded, state.active), force_rate, gap_rate)
