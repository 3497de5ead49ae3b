"""The stability boundary: critical points continued in the gripper's height or in the strip.  Lengths in L*."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from stripfold.ask.prediction import ElasticaPrediction, Snap, as_first, snap
from stripfold.base.errors import SolveError
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel
from stripfold.follow.track import Track
from stripfold.solve import critical
from stripfold.solve.problem import Tangent
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongX


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
