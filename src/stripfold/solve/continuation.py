"""Branches of equilibria: pseudo-arclength continuation, and events along them.

:func:`follow` is a generator of accepted points; one function, :func:`step`, serves marching and bracketing.  Only
points that pass the guards against jumping to another branch are yielded; ``docs/method.md`` says what can still be
missed.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import inf, nan, sqrt
from typing import overload

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import ContinuationError, CrushedError, NewtonError, SolveError
from stripfold.solve import newton
from stripfold.solve.newton import Constraint, Linearised, NewtonOptions
from stripfold.solve.problem import Equilibrium, Point, Problem, Tangent, inner
from stripfold.solve.stability import nearest_eigenvalues

logger = logging.getLogger(__name__)
AT_VALUE = 1e-7
"""Distance from a value of lambda at which the equilibrium there is solved for."""
MAX_EVALUATIONS = 60
"""Largest number of points computed to narrow the bracket of an event."""


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
    """Distance below which the two guards above are off: where an element begins to slide the tangent jumps, however
    short the step, but no other branch is so close."""
    max_inertia_change: int = 1
    """Guard: largest change of the number of negative eigenvalues in one step."""
    max_attempts: int = 100_000
    """Largest number of steps along one branch, rejected ones included."""
    newton: NewtonOptions = field(default_factory=NewtonOptions)


@dataclass(frozen=True, eq=False)
class Event:
    """Something that happens along a branch, such as a limit point.

    ``name``: what it is called in messages.  ``passed``: whether a point lies past it, given the point before as well.
    ``tolerance``: arc length to which :func:`follow` locates it; infinite: the step in which it happens is reported.
    ``value``: what changes its sign there, to find it sooner than by bisection.
    """

    name: str
    passed: Callable[[Point, Point | None], bool]
    tolerance: float = 1e-4
    value: Callable[[Point], float] | None = None


@dataclass(frozen=True, eq=False)
class Crossing:
    """An event between two neighbouring points: the last before it and the first past it.

    ``evaluations`` points were computed to narrow the bracket down from a step of the branch.
    """

    event: Event
    before: Point
    after: Point
    evaluations: int = 0


def evaluate(problem: Problem, state: Equilibrium, towards: Tangent, arc: float = 0.0) -> Point:
    """Compute tangent, oriented along ``towards``, and stability of an equilibrium."""
    at = Linearised(problem, state.q, state.lam, state.active)
    tangent = at.tangent(problem.metric, towards)
    return Point(state, tangent, at.kept.negatives(), partial(eigenvalues, problem, state), arc)


def eigenvalues(problem: Problem, state: Equilibrium) -> tuple[Array, Array]:
    """Compute the eigenvalues of the tangent nearest zero, and the mode of the smallest: :func:`.nearest_eigenvalues`.

    They are those at fixed contact coordinates, where there are any.
    """
    at = Linearised(problem, state.q, state.lam, state.active)
    block = at.kept.block
    return nearest_eigenvalues(problem.mass_at(state.q), block, block.factor(), at.held)


def start(problem: Problem, q: Array, lam: float, active: Index, sign: float, options: StepOptions) -> Point:
    """Solve for the first point of a branch, at ``lam`` near ``q``, followed with lambda rising or falling."""
    state = newton.solve(problem, q, lam, active, options=options.newton)
    return evaluate(problem, state, Tangent(np.zeros(problem.size), sign))


def step(problem: Problem, point: Point, ds: float, options: StepOptions) -> Point:
    """Compute the point at distance ``ds`` along the tangent of ``point``.

    Raises NewtonError: when Newton's method does not converge, or its result fails a guard: the step is too long.
    """
    t = point.tangent
    (q0, stress), lam0 = problem.stepped(point.q, ds * t.q), point.lam + ds * t.lam
    constraint = Constraint(problem.metric * t.q, t.lam, q0, lam0)
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
    problem: Problem, first: Point, options: StepOptions, events: Sequence[Event], end: float = inf
) -> Iterator[Point | Crossing]: ...
def follow(
    problem: Problem, first: Point, options: StepOptions, events: Sequence[Event] = (), end: float = inf
) -> Iterator[Point | Crossing]:
    """Yield ``first`` and then point after point along its branch, up to lambda = ``end``.

    Each event that happens in a step is yielded as a :class:`Crossing` before the point at the end of that step, in
    the order of the branch; where it cannot be told, in that of ``events``.

    Raises ContinuationError: when a step would have to be shorter than ``options.smallest``; carries the last residual
    history; SolveError: an event could not be located.
    """
    point, ds, shortened = first, options.first, False
    pending = [event for event in events if not event.passed(first, None)]
    yield point
    for _ in range(options.max_attempts):
        try:
            new = step(problem, point, ds, options)
            if new.lam >= end:
                # What happens behind the end may hide what happens before it.
                new = step_to(problem, point, end, options)
            passed = [event for event in events if event.passed(new, point)]
            crossings = _crossings(problem, point, new, [event for event in pending if event in passed], options)
        except NewtonError as error:
            ds, shortened = ds / 2.0, True
            if ds >= options.smallest:
                continue
            raise ContinuationError(
                f"the branch could not be followed past lambda = {point.lam:.9g}: {error}",
                parameter=point.lam,
                step=ds,
                residuals=error.residuals,
                advice="" if isinstance(error, CrushedError) else "refine the mesh or allow smaller steps",
            ) from error
        iterations = len(new.state.residuals) - 1
        # Where a step had to be shortened, the next would have to be as well.
        growth = 1.0 if shortened else 2.0
        ds = min(ds * min(growth, max(0.5, options.target_iterations / max(iterations, 1))), options.largest)
        shortened = False
        yield from crossings
        pending = [event for event in events if event not in passed]
        point = new
        logger.debug("state at lambda = %.6g L*, %d unknowns, %d iterations", point.lam, problem.size, iterations)
        yield point
        if point.lam >= end:
            return
    raise ContinuationError(
        f"the branch was not followed to its end in {options.max_attempts} steps; it is at lambda = {point.lam:.9g}",
        parameter=point.lam,
        step=ds,
        advice="refine the mesh or allow longer steps",
    )


def step_to(problem: Problem, point: Point, lam: float, options: StepOptions) -> Point:
    """Reach the point at ``lam`` in guarded steps from one shortly before it.

    Raises SolveError: it is not reached.
    """
    share = 1.0
    for _ in range(40):
        if abs(lam - point.lam) <= AT_VALUE:
            state = newton.solve(problem, point.q, lam, point.active, options=options.newton)
            return evaluate(problem, state, point.tangent, point.arc)
        ds = (lam - point.lam) / point.tangent.lam
        try:
            point, share = step(problem, point, share * ds, options), min(2.0 * share, 1.0)
        except NewtonError:
            if ds < 0.0:
                raise
            share /= 2.0
    raise SolveError(f"the point at lambda = {lam:.9g} was not reached", parameter=lam)


def _crossings(
    problem: Problem, before: Point, after: Point, events: Sequence[Event], options: StepOptions
) -> list[Crossing]:
    """Locate the events passed in one step, in the order of the branch."""
    found = list[Crossing]()
    end = after
    for event in events:
        if end is after or event.passed(end, before):
            crossing = Crossing(event, before, end)
            if event.tolerance < inf:
                crossing = locate(problem, crossing, options)
                # Another event can only come first in the part before it.
                end = crossing.before
            found.append(crossing)
    return sorted(found, key=lambda crossing: crossing.before.arc)


def arc_length(before: Point, after: Point) -> float:
    """Arc length between two points of a branch."""
    return after.arc - before.arc


def locate(
    problem: Problem,
    crossing: Crossing,
    options: StepOptions,
    max_evaluations: int = MAX_EVALUATIONS,
    width: Callable[[Point, Point], float] = arc_length,
) -> Crossing:
    """Narrow the bracket of an event until its ``width`` is the event's tolerance.

    Raises NewtonError: the points lie on different branches; SolveError: the bracket cannot be made that narrow.
    """
    event, before, after = crossing.event, crossing.before, crossing.after
    value = event.value or (lambda _: nan)
    values = {at.arc: value(at) for at in (before, after)}
    widths, replaced = list[float](), None
    for evaluation in range(1, max_evaluations + 2):
        if width(before, after) <= event.tolerance:
            _check_one_branch(problem, before, after, options)
            return Crossing(event, before, after, evaluation - 1)
        if evaluation > max_evaluations:
            break
        _check_one_branch(problem, before, after, options)
        widths.append(after.arc - before.arc)
        if len(widths) > 2 and widths[-1] > 0.5 * widths[-3]:
            # It converges where the value jumps, too.
            share = 0.5
        else:
            ends = [at.arc for at in (before, after, replaced) if at]
            share = _next_share(ends, [values[arc] for arc in ends], event.tolerance)
        middle = _point_between(problem, before, share * (after.arc - before.arc), options)
        values[middle.arc] = value(middle)
        if event.passed(middle, before):
            replaced, after = after, middle
        else:
            replaced, before = before, middle
    raise SolveError(
        f"the {event.name} was only bracketed to {width(before, after):.1e}",
        parameter=before.lam,
        advice="refine the mesh",
    )


def _next_share(arcs: Sequence[float], values: Sequence[float], tolerance: float) -> float:
    """Choose where in a bracket, from 0 to 1, to compute the next point.

    ``arcs``, ``values``: of its ends, and of the end that it had before.  It is next to the zero of the value that they
    interpolate, as far as that is uncertain, on the side of the end that is farther.
    """
    (first, last), (a, b) = arcs[:2], values[:2]
    if not np.isfinite(a - b) or not b < 0.0 < a:
        return 0.5
    share, beside = a / (a - b), 0.02
    if len(values) > 2 and len(set(values)) == 3 and np.isfinite(values[2]):
        # The parabola for the place over the value.
        third, c = (arcs[2] - first) / (last - first), values[2]
        better = a * c / ((b - a) * (b - c)) + a * b / ((c - a) * (c - b)) * third
        if 0.0 < better < 1.0:
            share, beside = better, min(0.5 * abs(better - share), beside)
    least = 0.4 * tolerance / (last - first)
    beside = max(beside, least)
    return min(max(share + (beside if share < 0.5 else -beside), least), 1.0 - least)


def _check_one_branch(problem: Problem, before: Point, after: Point, options: StepOptions) -> None:
    """Refuse a bracket that leads from one branch to another, without a turn of the tangent, where two nearly meet.

    It narrows to the gap between them: its ends stay apart, however small their arc length.  As for a step, no other
    branch is within ``options.kink``.
    """
    apart, width = Tangent(after.q - before.q, after.lam - before.lam), after.arc - before.arc
    if sqrt(inner(problem.metric, apart, apart)) > (1.0 + options.max_correction) * width + options.kink:
        raise NewtonError("guard: the step leads to another branch", parameter=before.lam, step=width)


def _point_between(problem: Problem, before: Point, ds: float, options: StepOptions) -> Point:
    """Compute a point at most ``ds`` behind the first end of a bracket: the nearer, the smaller a step has to be."""
    while True:
        try:
            return step(problem, before, ds, options)
        except NewtonError as error:
            ds /= 4.0
            if ds < options.smallest:
                message = f"a point between the bracket's ends was not found: {error}"
                raise SolveError(message, parameter=before.lam) from error
