"""The end of the gripper's advance from where the elastica predicts it: solved for, or followed to; and the boundary.

The stability boundary is critical points continued in the gripper's height or in the strip.  Lengths in L*.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stripfold import elastica
from stripfold.base.errors import SolveError
from stripfold.follow.contact_branch import STEPS, BranchPoint, as_elastica, clearance, from_elastica, longest_free
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel, static_track, to_the_end
from stripfold.follow.track import CriticalEvent, End, Track
from stripfold.solve import critical
from stripfold.solve.critical import LimitPoint
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Tangent
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongX, Lift

BEFORE = 0.25
"""Distance in free length before the elastica's end at which a run begins, L*: lambda is about 0.06 L* lower."""
SHORTER = (10.0, 0.05)
"""Thick strips begin earlier by up to this, (a + b z^2) h^2 L*: their advance ends earlier."""
ROOM = 0.05
"""Length that lies at least in a state from which the limit point is solved for, L*."""
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

    def end(self, length: float) -> End:
        """The event that ends the advance of a strip of this length, L*."""
        if self.last.length >= length:
            return End.LIFTED
        return End.SNAP if self.snap else End.TOUCH


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
    """The limit point near the elastica's, solved for directly.

    Raises SolveError: there is none, or the sag touches or the whole strip lifts before.
    """
    if not prediction.snap:
        raise SolveError("the elastica has no limit point at this height")
    last = _fitting(prediction, strip.length)
    problem, q = as_elastica(strip.contact_mesh(refinement), AlongX(prediction.height), last)
    # There lambda stands still and the lift-off moves.
    towards = Tangent(problem.metric, 0.0)
    limit = critical.limit_point(problem, q, last.advance, towards, problem.bounded, NEWTON)
    return as_first(Snap(problem, limit))


def as_first(found: Snap) -> Snap:
    """The same once it is certain that nothing ends the advance before; raises SolveError where something may."""
    problem, state = found.problem, found.limit.state
    if clearance(problem, state.q)[0] < 0.0:
        raise SolveError("the sag touches before lambda has a maximum", parameter=state.lam)
    if problem.contact(state.q)[-1] > longest_free(problem.mesh.model):
        raise SolveError("the whole strip lifts before lambda has a maximum", parameter=state.lam)
    return found


def _fitting(prediction: ElasticaPrediction, length: float) -> elastica.State:
    """The elastica's state at the end of the advance, or the one before it of which a strip of this length has room."""
    last = prediction.last
    if last.length < length - ROOM:
        return last
    return elastica.state_at(prediction.height, length - ROOM, last)


def end_of_advance(
    strip: StripModel, prediction: ElasticaPrediction, refinement: float = 1.0, tolerance: float = LAMBDA_TOLERANCE
) -> Track:
    """The end of the advance, solved for or, where that fails, followed to; raises SolveError where that fails, too."""
    with suppress(SolveError):
        return snap(strip, prediction, refinement).checked(tolerance)
    return from_near_the_end(strip, prediction, refinement, tolerance)


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


def without_horizontal_force(strip: StripModel, prediction: ElasticaPrediction, refinement: float = 1.0) -> float:
    """lambda_0."""
    at = from_elastica(strip.contact_mesh(refinement), Lift(), prediction.height, prediction.first)
    return float(at.point.q[at.problem.mesh.model.middle[0, 0]])


def stability_boundary(
    strips: Iterable[tuple[StripModel, float]], refinement: float = 1.0, tolerance: float = LAMBDA_TOLERANCE
) -> Iterator[Track]:
    """The critical points of strips and heights along a curve, each solved for from the last, and checked.

    The first, and each that is not found from the last, is solved for from the elastica's.

    ``strips``: strip and height of the gripper, neighbours so near that one critical state is a guess of the next.
    ``refinement``, ``tolerance``: factor on all element lengths, and width of the bracket of lambda_c.  Raises
    SolveError: the boundary ends: the sag touches or the whole strip lifts before lambda has a maximum.
    """
    last: Snap | None = None
    for strip, height in strips:
        try:
            found = _from(last, strip, height, refinement) if last else None
            run = found.checked(tolerance) if found else None
        except SolveError:
            run = None
        if found is None or run is None:
            found = snap(strip, ElasticaPrediction.at(height), refinement)
            run = found.checked(tolerance)
        yield run
        last = found


def _from(last: Snap, strip: StripModel, height: float, refinement: float) -> Snap:
    """The limit point near another strip's, on elements planned for that one's lift-off."""
    q, n = last.limit.state.q, last.problem.n
    contact = last.problem.contact(q)
    mesh, before = strip.contact_mesh(refinement)(contact), last.problem.at(contact).model
    problem = MovingContact(mesh, AlongX(height))
    guess = np.append(before.resampled(q[:n], mesh.model.s), contact)
    stress = before.resampled_stress(q[:n], mesh.model)
    towards = Tangent(problem.metric, 0.0)
    limit = critical.limit_point(problem, guess, last.lam, towards, problem.bounded, predicted_stress=stress)
    return as_first(Snap(problem, limit))
