"""A path followed in steps of a given size, with effects that have a memory: internal friction.

Each step is one equilibrium; the effects update their memory after it.  With the paper's pull the result depends on the
step size, which is therefore never changed silently.  In units of L*; lambda is the length travelled.  Source:
docs/physics.md, section 8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from stripfold.analysis.nodal import ROBUST_NEWTON
from stripfold.analysis.path_statics import from_flat
from stripfold.arrays import Array
from stripfold.effects import Effect
from stripfold.errors import InvalidInputError, LostStabilityError, NewtonError
from stripfold.models.model import Model
from stripfold.paths.curve import GripperPath
from stripfold.problem import AlongPiece, Motion, StripProblem
from stripfold.solve import continuation, newton
from stripfold.solve.problem import Equilibrium, Point, Tangent

Effects = Callable[[Model, Array], tuple[Effect, ...]]
"""The effects on a strip, without force in the given state."""

SMALLEST_SHARE = 1.0 / 64.0
"""Smallest substep, as a share of the step."""
RATIO_TO_CHECK = 3.0
"""Ratio of the strip's largest displacement to the gripper's above which a step is checked with substeps."""
SUBSTEPS = 16
"""Number of substeps of that check."""
RATIO_OF_A_SNAP = 10.0
"""The same ratio in a substep above which the strip has snapped: a strip that follows moves less in shorter steps."""
SETTLING = 0.5
"""Largest displacement in the first substep, which also equilibrates the updated memory, L*."""


@dataclass(frozen=True, eq=False)
class Step:
    """An accepted step.

    Attributes
    ----------
    point
        The state; its eigenvalues include the effects' tangent, before they update their memory.
    piece
        Index of the path's piece.
    problem
        Its problem, with the memory of the previous state.
    moved
        Largest displacement of the mid-surface in this step.
    """

    point: Point
    piece: int
    problem: StripProblem
    moved: float


def steps_on(path: GripperPath, size: float) -> Iterator[tuple[int, float]]:
    """Pieces and lengths travelled, at equal steps of at most ``size`` within each piece, corners included."""
    for i, piece in enumerate(path.pieces):
        count = int(np.ceil((piece.end - piece.start) / size * (1.0 - 1e-12)))
        for travelled in np.linspace(piece.start, piece.end, count + 1)[1:]:
            yield i, float(travelled)


def load_incrementally(model: Model, path: GripperPath, effects: Effects, size: float) -> Iterator[Step]:
    """Follow a path from the flat strip in steps of ``size``, L*, to its end.

    Raises
    ------
    InvalidInputError
        A step size that cannot be used.
    LostStabilityError
        The strip did not follow; the steps before have been yielded.
    """
    if not 0.0 < size <= path.length:
        raise InvalidInputError("step", size, f"more than 0 and at most {path.length:g} L*")
    first = from_flat(model, path)
    places = [(piece, travelled) for piece, travelled in steps_on(path, size) if travelled > first.lam]
    motions = [AlongPiece(piece, model.length) for piece in path.pieces]
    return load_incrementally_from(model, first.state, effects(model, first.q), motions, places)


def load_incrementally_from(
    model: Model,
    state: Equilibrium,
    acting: tuple[Effect, ...],
    motions: Sequence[Motion],
    places: Iterable[tuple[int, float]],
) -> Iterator[Step]:
    """Steps from a state to each of ``places``: which of the motions of the gripper, and lambda, ascending.

    Raises
    ------
    LostStabilityError
        The strip did not follow; the steps before have been yielded.
    """
    change, last_piece = np.zeros(model.size), -1
    for piece, travelled in places:
        problem = StripProblem(model, motions[piece], acting)
        guess = state.q + change if piece == last_piece else state.q
        point = _step(problem, state, guess, travelled)
        moved = model.largest_move(state.q, point.q)
        if moved > RATIO_TO_CHECK * (travelled - state.lam):
            nearer = _in_substeps(problem, state, travelled)
            if nearer is not None:
                point = continuation.evaluate(problem, nearer, point.tangent)
            elif moved > RATIO_OF_A_SNAP * (travelled - state.lam):
                raise LostStabilityError("the strip does not follow its gripper: it snaps", parameter=travelled)
            moved = model.largest_move(state.q, point.q)
        if point.negatives:
            raise LostStabilityError("the strip does not follow its gripper: it is unstable", parameter=travelled)
        yield Step(point, piece, problem, moved)
        change, state, last_piece = point.q - state.q, point.state, piece
        acting = problem.accepted(state.q).effects


def _step(problem: StripProblem, before: Equilibrium, guess: Array, travelled: float) -> Point:
    """The state at ``travelled`` by one solve, or by several with the memory kept."""
    try:
        state = newton.solve(problem, guess, travelled, before.active)
    except NewtonError:
        state = _with_shorter_steps(problem, before, travelled)
    return continuation.evaluate(problem, state, Tangent(np.zeros(problem.size), 1.0))


def _in_substeps(problem: StripProblem, before: Equilibrium, travelled: float) -> Equilibrium | None:
    """The state at ``travelled`` in substeps; None where one of them does not converge.

    Raises
    ------
    LostStabilityError
        The strip moves too far in a substep: it snaps.
    """
    state, change = before, np.zeros(problem.size)
    for to in np.linspace(before.lam, travelled, SUBSTEPS + 1)[1:]:
        try:
            new = newton.solve(problem, state.q + change, float(to), state.active, options=ROBUST_NEWTON)
        except NewtonError:
            return None
        # The first substep also equilibrates the updated memory, by as much as a whole step.
        most = (
            RATIO_OF_A_SNAP * (new.lam - state.lam)
            if state is not before
            else max(RATIO_TO_CHECK * (travelled - before.lam), SETTLING)
        )
        if problem.model.largest_move(state.q, new.q) > most:
            raise LostStabilityError("the strip does not follow its gripper: it snaps", parameter=float(to))
        # The displacement of the first one does not predict the next.
        change = new.q - state.q if state is not before else change
        state = new
    return state


def _with_shorter_steps(problem: StripProblem, before: Equilibrium, travelled: float) -> Equilibrium:
    whole = travelled - before.lam
    q, active, at, share = before.q, before.active, before.lam, 0.5
    while at < travelled:
        to = min(at + share * whole, travelled)
        try:
            state = newton.solve(problem, q, to, active, options=ROBUST_NEWTON)
        except NewtonError as error:
            share /= 2.0
            if share < SMALLEST_SHARE:
                raise LostStabilityError(
                    f"no state was found past lambda = {at:.6g}: {error}", parameter=at, residuals=error.residuals
                ) from error
            continue
        q, active, at = state.q, state.active, to
    return state
