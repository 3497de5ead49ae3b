"""Events on a branch: tests that turn true between two of its points, and the one search that brackets them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from stripfold.base.errors import SolveError
from stripfold.solve.problem import Point


def arc_length(before: Point, after: Point) -> float:
    """Arc length between two points of a branch."""
    return after.arc - before.arc


def half(before: Point, after: Point, evaluation: int) -> float:
    """Bisection."""
    return 0.5


def always(point: Point) -> bool:
    """True."""
    return True


def never(point: Point) -> bool:
    """False."""
    return False


@dataclass(frozen=True, eq=False)
class Event:
    """Something that happens along a branch, such as a limit point.

    Attributes
    ----------
    name
        What it is called in messages.
    passed
        Whether a point lies past it, given the point before as well.
    tolerance
        Width of the bracket to which it is located.
    width
        The width of a bracket.
    share
        Where in the bracket, from 0 to 1, to compute the next point; counts the evaluations.
    located
        Whether :func:`.continuation.follow` locates it in a step from this point; otherwise it reports the step.
    directly
        Solves for it, given the problem, both ends of a bracket and the options of a step: a bracket within its
        tolerance.  Without it, or where it raises :class:`.SolveError`, the bracket is narrowed.
    """

    name: str
    passed: Callable[[Point, Point | None], bool]
    tolerance: float = 1e-4
    width: Callable[[Point, Point], float] = arc_length
    share: Callable[[Point, Point, int], float] = half
    located: Callable[[Point], bool] = always
    directly: Callable[[Any, Point, Point, Any], tuple[Point, Point]] | None = None


@dataclass(frozen=True, eq=False)
class Crossing:
    """An event between two neighbouring points: the last before it and the first past it.

    ``evaluations`` points were computed to narrow the bracket down from a step of the branch.
    """

    event: Event
    before: Point
    after: Point
    evaluations: int = 0


def narrow(
    crossing: Crossing, point_between: Callable[[Crossing, float], Point], max_evaluations: int = 60
) -> Crossing:
    """The bracket narrowed to the event's tolerance.

    ``crossing``: the bracket to begin with; ``point_between``: computes a point at most this far, in arc length, behind
    the first end of a bracket.  Raises SolveError: the bracket stays wider than the tolerance.
    """
    event, before, after = crossing.event, crossing.before, crossing.after
    for evaluation in range(1, max_evaluations + 1):
        if event.width(before, after) <= event.tolerance:
            return Crossing(event, before, after, evaluation - 1)
        ds = event.share(before, after, evaluation) * (after.arc - before.arc)
        middle = point_between(Crossing(event, before, after), ds)
        if event.passed(middle, before):
            after = middle
        else:
            before = middle
    if event.width(before, after) <= event.tolerance:
        return Crossing(event, before, after, max_evaluations)
    raise SolveError(
        f"the {event.name} was only bracketed to {event.width(before, after):.1e}",
        parameter=before.lam,
        advice="refine the mesh",
    )
