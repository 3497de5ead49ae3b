"""The end of the gripper's advance from where the elastica predicts it: solved for, or followed to.  Lengths in L*."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stripfold import elastica
from stripfold.base.errors import SolveError
from stripfold.follow.contact_branch import (
    STEPS,
    BranchPoint,
    as_elastica,
    clearance,
    from_elastica,
    longest_free,
    solved,
    transferred,
)
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel, solve_height, static_track, to_the_end
from stripfold.follow.track import CriticalEvent, End, Track
from stripfold.solve import critical
from stripfold.solve.critical import LimitPoint
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Tangent
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongX, Lift, end_angle

BEFORE = 0.25
"""Distance in free length before the elastica's end at which a run begins, L*: lambda is about 0.06 L* lower."""
SHORTER = (10.0, 0.05)
"""Thick strips begin earlier by up to this, (a + b z^2) h^2 L*: their advance ends earlier."""
ROOM = 0.05
"""Length that lies at least in a state from which the limit point is solved for, L*."""
ELEMENTS = "elements {:.2g} times the standard ones"
TURN = 0.1
"""Largest step of a clamp's angle, rad."""
NEWTON = NewtonOptions(max_iterations=15)
"""For the limit point from the elastica's: where more are needed, a march takes as long."""


class ElasticaPrediction(NamedTuple):
    """The elastica at a height: its states without horizontal force and at the end of the advance, and if it snaps."""

    height: float
    first: elastica.State
    last: elastica.State
    snap: bool

    @classmethod
    def at(cls, height: float) -> ElasticaPrediction:
        """From the elastica."""
        end = elastica.critical(height)
        return cls(height, elastica.state_no_horizontal_force(height), end.state, end.snap)


@dataclass(frozen=True, eq=False)
class Snap:
    """A limit point of an advance, not yet checked by the states beside it."""

    problem: MovingContact
    limit: LimitPoint
    end: End = End.SNAP

    @property
    def lam(self) -> float:
        """lambda_c."""
        return self.limit.state.lam

    def checked(self, tolerance: float = LAMBDA_TOLERANCE) -> Track:
        """The end of the advance, lambda_c to a bracket of ``tolerance``.

        Raises SolveError: see :func:`.critical.checked`.
        """
        found = critical.checked(self.problem, self.limit, tolerance, STEPS)
        before, after = (BranchPoint(self.problem, point) for point in (found.before, found.after))
        return static_track([before], End.SNAP, events=(CriticalEvent(found.lam, found, before),), beyond=(after,))


def snap(strip: StripModel, prediction: ElasticaPrediction, refinement: float = 1.0) -> Snap:
    """Solve for the limit point near the elastica's.

    Raises SolveError: there is none, or the sag touches or the whole strip lifts before.
    """
    if not prediction.snap:
        raise SolveError("the elastica has no limit point at this height")
    last = prediction.last
    if last.length >= strip.length - ROOM:
        last = elastica.state_at(prediction.height, strip.length - ROOM, last)
    problem, q = as_elastica(strip.contact_mesh(refinement), AlongX(prediction.height), last)
    # There lambda stands still and the lift-off moves.
    towards = Tangent(problem.metric, 0.0)
    limit = critical.limit_point(problem, q, last.advance, towards, problem.bounded, NEWTON)
    if clearance(problem, limit.state.q)[0] < 0.0:
        raise SolveError("the sag touches before lambda has a maximum", parameter=limit.state.lam)
    if problem.contact(limit.state.q)[-1] > longest_free(problem.mesh.model):
        raise SolveError("the whole strip lifts before lambda has a maximum", parameter=limit.state.lam)
    return Snap(problem, limit)


def end_of_advance(
    strip: StripModel,
    prediction: ElasticaPrediction,
    refinement: float = 1.0,
    tolerance: float = LAMBDA_TOLERANCE,
    say: Callable[[str], None] = lambda _: None,
    angle: float | None = None,
) -> Track:
    """Find the end of the advance: solved for or, where that fails, followed to; raises SolveError.

    ``angle``: at which a gripper clamps the strip, rad; None of a hinge.
    """
    say(ELEMENTS.format(refinement))
    if angle is not None:
        return clamped_end(strip, prediction, angle, refinement, tolerance)
    try:
        return snap(strip, prediction, refinement).checked(tolerance)
    except SolveError as error:
        say(f"not solved for: {error}")
    return _followed(strip, prediction, refinement, tolerance, say)


def unchecked_end(
    strip: StripModel,
    prediction: ElasticaPrediction,
    refinement: float,
    tolerance: float,
    say: Callable[[str], None],
    angle: float | None = None,
) -> Snap | Track:
    """As :func:`end_of_advance`, for an estimate of its error: a limit point is not checked."""
    if angle is not None:
        return end_of_advance(strip, prediction, refinement, tolerance, say, angle)
    say(ELEMENTS.format(refinement))
    with suppress(SolveError):
        return snap(strip, prediction, refinement)
    return _followed(strip, prediction, refinement, tolerance, say)


def _followed(
    strip: StripModel, prediction: ElasticaPrediction, refinement: float, tolerance: float, say: Callable[[str], None]
) -> Track:
    """Follow to the end from near it or, where a strip is so thick that no state is near the elastica's, from flat."""
    try:
        return from_near_the_end(strip, prediction, refinement, tolerance)
    except SolveError as error:
        say(f"followed from the flat strip: {error}")
        return solve_height(strip, prediction.height, refinement)


def from_near_the_end(
    strip: StripModel, prediction: ElasticaPrediction, refinement: float = 1.0, tolerance: float = LAMBDA_TOLERANCE
) -> Track:
    """The end of the advance from a state shortly before it, predicted by the elastica.

    Raises SolveError: no state of this strip is near the predicted one or it may not be the first end, or the branch
    cannot be followed from it.
    """
    z = prediction.height
    before = BEFORE + (SHORTER[0] + SHORTER[1] * z**2) * strip.thickness**2
    near = elastica.state_at(z, min(prediction.last.length, strip.length) - before, prediction.last)
    first = from_elastica(strip.contact_mesh(refinement), AlongX(z), near.advance, near)
    return to_the_end(first, tolerance=tolerance)


def clamped_end(
    strip: StripModel, prediction: ElasticaPrediction, angle: float, refinement: float, tolerance: float
) -> Track:
    """The end of the advance of a clamped strip: turned where it has no horizontal force, and followed from there.

    Raises SolveError: a state or the branch could not be computed.
    """
    z, first = prediction.height, prediction.first
    at = from_elastica(strip.contact_mesh(refinement), AlongX(z), first.advance, first)
    begin = end_angle(at.model, at.u)
    for turned in np.linspace(begin, angle, 2 + int(abs(angle - begin) / TURN)):
        at = transferred(solved(MovingContact(at.problem.mesh, AlongX(z, float(turned))), at.point.q, at.lam))
    return to_the_end(at, tolerance=tolerance)


def without_horizontal_force(strip: StripModel, prediction: ElasticaPrediction, refinement: float = 1.0) -> float:
    """lambda_0."""
    at = from_elastica(strip.contact_mesh(refinement), Lift(), prediction.height, prediction.first)
    return float(at.point.q[at.problem.mesh.model.middle[0, 0]])
