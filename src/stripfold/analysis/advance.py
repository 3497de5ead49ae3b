"""Statics of a strip along a branch, up to the first event that ends it.

A limit point of lambda may be spurious: the floor holds nodes, and a single node that is about to lift off can hold
the strip back (docs/method.md).  So the branch is followed a little further before a limit point is believed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from stripfold.analysis.static import LAMBDA_TOLERANCE
from stripfold.errors import ContinuationError, SolveError
from stripfold.problem import StripProblem
from stripfold.solve import continuation, critical
from stripfold.solve.continuation import StepOptions
from stripfold.solve.critical import CriticalPoint, is_past
from stripfold.solve.events import Crossing, Event, never
from stripfold.solve.problem import Point

LOOK_AHEAD = 0.6
"""Arc length followed past a maximum of lambda before it is taken for the strip's own, L*."""
LIMIT = critical.critical_point(LAMBDA_TOLERANCE, located=never)
"""The event that ends an advance when it is not spurious.  It is located only then."""


@dataclass(frozen=True, eq=False)
class Advance:
    """A branch followed to an event.

    Attributes
    ----------
    points
        Accepted points, those of the located event included; with a critical point those past it as well.
    end
        The event.
    critical
        The critical point, where that is the event.
    spurious
        Spurious limit points passed on the way.
    confirmed
        Whether an event right behind the critical point confirmed it.
    """

    points: tuple[Point, ...]
    end: Crossing
    critical: CriticalPoint | None
    spurious: int
    confirmed: bool = False


def follow_to_event(
    problem: StripProblem,
    first: Point,
    events: Sequence[Event],
    options: StepOptions,
    *,
    confirm: Sequence[Event] = (),
    past: float = 0.0,
    tolerance: float = LAMBDA_TOLERANCE,
    watch: Callable[[list[Point]], None] = lambda points: None,
    on_spurious: Callable[[Point, Point], None] = lambda before, after: None,
) -> Advance:
    """Follow a branch to the first event that ends it.

    Parameters
    ----------
    problem, first, options
        As of :func:`.continuation.follow`.
    events
        Those that end the advance, :data:`LIMIT` among them.
    confirm
        Events that, happening within the look-ahead, confirm a limit point.
    past
        Arc length to follow past a critical point, if more than the look-ahead.
    tolerance
        Width of the bracket of lambda_c.
    watch
        Called with all points whenever one before a limit point is added.
    on_spurious
        Called with the last point before a spurious limit point and the first above it.

    Raises
    ------
    SolveError
        The branch could not be followed, or the event not located.
    """
    points: list[Point] = [first]
    limit: Crossing | None = None
    behind: Crossing | None = None  # the event to end at should the limit point be spurious
    spurious, confirmed = 0, False
    looked_for = [*events, *(event for event in confirm if event not in events)]
    try:
        for item in continuation.follow(problem, first, options, looked_for):
            if isinstance(item, Crossing):
                if item.event is LIMIT:
                    limit = limit or item
                    _add(points, item.after)
                elif limit is not None and item.event in confirm:
                    confirmed = True
                    break
                elif limit is not None:
                    behind = item
                elif item.event in events:
                    _add(points, item.before)
                    return Advance(tuple(points), item, None, spurious)
                continue
            if limit is not None and item.arc - limit.after.arc > max(past, LOOK_AHEAD):
                break
            _add(points, item)
            if limit is None:
                watch(points)
            elif not is_past(item) and item.lam > max(p.lam for p in points[:-1]):
                on_spurious(limit.before, item)
                spurious, limit = spurious + 1, None
                if behind is not None:
                    return Advance((*points[: points.index(behind.before) + 1],), behind, None, spurious)
    except ContinuationError:
        # Past the limit point the critical point is known: less of the unstable branch is there to show.
        if limit is None:
            raise
    if limit is None:
        raise SolveError("the branch ends before an event", parameter=points[-1].lam)
    found = critical.locate(problem, limit.before, limit.after, tolerance, options)
    at = points.index(limit.before) + 1
    located = [p for p in (found.before, found.after) if p not in (limit.before, limit.after)]
    return Advance((*points[:at], *located, *points[at:]), limit, found, spurious, confirmed)


def _add(points: list[Point], point: Point) -> None:
    if point is not points[-1]:
        points.append(point)
