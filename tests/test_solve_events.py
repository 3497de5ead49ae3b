"""Events on a branch: where they are found, in which order, how often."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from math import inf, sqrt

import numpy as np
import pytest

from oracles.branches import check_branch
from oracles.toys import NONE, Truss
from stripfold.solve import continuation
from stripfold.solve.continuation import Crossing, Event, StepOptions
from stripfold.solve.critical import LIMIT
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Point

TRUSS = Truss(1.0, 0.3)
STEPS = StepOptions(first=0.02, largest=0.05, newton=NewtonOptions(force_tolerance=1e-12))
LONG = StepOptions(first=0.2, largest=0.2, min_cosine=-1.0, max_correction=np.inf)


def sinks(depth: float, tolerance: float = 1e-6) -> Event:
    """The event that the loaded point is this far down."""
    return Event(f"depth {depth}", lambda point, _: point.q[1] < -depth, tolerance)


def followed(events: Sequence[Event], options: StepOptions = STEPS, depth: float = 0.7) -> list[Point | Crossing]:
    problem = TRUSS.problem()
    out: list[Point | Crossing] = []
    first = continuation.start(problem, np.zeros(2), 0.0, NONE, 1.0, options)
    for item in continuation.follow(problem, first, options, events):
        out.append(item)
        if isinstance(item, Point) and item.q[1] < -depth:
            break
    check_branch(problem, [item for item in out if isinstance(item, Point)])
    return out


def test_each_is_found_once_where_it_is() -> None:
    """Truth: the depth given; the first limit point of the truss at a depth of b - b / sqrt(3), at its limit load."""
    limit = replace(LIMIT, tolerance=1e-5)
    deep = sinks(0.5)
    crossings = [item for item in followed([deep, limit]) if isinstance(item, Crossing)]
    assert [crossing.event for crossing in crossings] == [limit, deep]
    at_limit, at_depth = crossings
    assert at_limit.before.lam == pytest.approx(TRUSS.limit_load, abs=1e-8)
    assert -at_limit.before.q[1] == pytest.approx(TRUSS.b * (1.0 - 1.0 / sqrt(3.0)), abs=1e-4)
    assert at_depth.after.q[1] < -0.5 <= at_depth.before.q[1]
    assert at_depth.after.arc - at_depth.before.arc <= 1e-6
    assert at_depth.evaluations <= 16


@pytest.mark.parametrize(
    ("value", "most"),
    [
        pytest.param(lambda point: point.q[1] + 0.5, 5, id="smooth"),
        pytest.param(lambda point: 1e3 if point.q[1] > -0.5 else -1e-3, 40, id="jumps"),
        pytest.param(lambda point: np.inf if point.q[1] > -0.5 else -1e-3, 16, id="infinite before it"),
    ],
)
def test_a_value_leads_to_it(value: Callable[[Point], float], most: int) -> None:
    (crossing,) = (item for item in followed([replace(sinks(0.5), value=value)]) if isinstance(item, Crossing))
    assert crossing.after.q[1] < -0.5 <= crossing.before.q[1]
    assert crossing.after.arc - crossing.before.arc <= 1e-6
    assert crossing.evaluations <= most


def test_the_order_is_that_of_the_branch() -> None:
    """Two in one long step, asked for in the other order; each comes before the point at the step's end."""
    found = followed([sinks(0.01), sinks(0.005), sinks(0.02)], LONG, depth=0.03)
    names = [item.event.name for item in found if isinstance(item, Crossing)]
    assert names == ["depth 0.005", "depth 0.01", "depth 0.02"]
    arcs = [item.arc if isinstance(item, Point) else item.before.arc for item in found]
    assert all(a <= b for a, b in pairwise(arcs))
    assert isinstance(found[1], Crossing)
    assert isinstance(found[2], Crossing)


def test_what_is_not_located_is_reported_with_its_step() -> None:
    found = followed([sinks(0.1, tolerance=inf)], depth=0.2)
    at = next(i for i, item in enumerate(found) if isinstance(item, Crossing))
    crossing = found[at]
    assert isinstance(crossing, Crossing)
    assert (crossing.before, crossing.after) == (found[at - 1], found[at + 1])
    assert crossing.evaluations == 0
