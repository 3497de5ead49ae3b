"""A gripper that does not stop at the critical point, on a strip with friction in bending: what a camera would film.

Statics with the friction's memory first, in steps, to where no stable state is left; then motion in time from a state
well before, through the snap and past the first touch.  All in units of L*, sqrt(L*/g) and rho_a g L*.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stripfold.analysis import planning
from stripfold.analysis.collapse import SIZES
from stripfold.analysis.path_friction import Step, load_incrementally_from
from stripfold.analysis.path_statics import BEYOND
from stripfold.analysis.static import ROBUST_NEWTON, StripModel, lift, lift_off, no_horizontal_force, touches, transfer
from stripfold.arrays import Array
from stripfold.effects import Effect, Hysteresis
from stripfold.errors import LostStabilityError, NewtonError, SolveError
from stripfold.models.model import Model
from stripfold.problem import AlongX, StripProblem
from stripfold.solve import continuation, dynamics, newton
from stripfold.solve.dynamics import Moving, TimeOptions, TimeState
from stripfold.solve.problem import Equilibrium
from stripfold.solve.schemes import Damping

STEP = 0.1
"""Size of the static steps, L*."""
NEAREST = 1e-4
"""How near the loss of stability is approached, L*."""
POPPED = 0.3
"""A strip of which a place moves farther than this in one of the last steps has gone to another state, L*."""
MOST_STEPS = 20000
TIME_OPTIONS = TimeOptions(first=0.02, tolerance=1e-5)


@dataclass(frozen=True, eq=False)
class Passage:
    """A snap that was passed.

    Attributes
    ----------
    model
        The strip.
    static
        Last lambda at which a stable state was found, friction included, L*.
    moments
        The motion, at accepted times; ``lam`` is the gripper's advance.
    touch
        Index of the first moment at which the sag touches.
    """

    model: Model
    static: float
    moments: tuple[TimeState, ...]
    touch: int


def run(
    strip: StripModel,
    height: float,
    moment: float,
    speed: float,
    before: float,
    after: float,
    damping: Damping,
    refinement: float = 1.0,
) -> Passage:
    """Advance the gripper past the snap.

    Parameters
    ----------
    strip, height
        L*.
    moment
        M_0 of the bending hysteresis, rho_a g L*^2; 0 for none.
    speed
        Of the gripper, sqrt(g L*).
    before
        How far before the loss of stability the motion in time begins, L*.
    after
        How long it goes on after the first touch, sqrt(L*/g).

    Raises
    ------
    SolveError
        There is no snap at this height, or a part could not be computed.
    TimeStepError
        The motion could not be followed.
    """
    steps, static = to_loss(strip, height, moment, refinement)
    # The step that is ``before`` ahead, and one before it: they tell how fast the strip moves there.
    places = np.array([step.point.lam for step in steps])
    at = int(np.clip(np.searchsorted(places, static - before, side="right") - 1, 1, len(steps) - 1))
    rate = (steps[at].point.q - steps[at - 1].point.q) / (places[at] - places[at - 1])
    point = steps[at].point
    problem = steps[at].problem.accepted(point.q)
    first = dynamics.start(problem, point.q, speed * rate, point.lam, point.state.active)
    moments: list[TimeState] = []
    touch: int | None = None
    for moment_ in dynamics.march(problem, first, Moving(point.lam, speed), damping, options=TIME_OPTIONS):
        moments.append(moment_)
        if touch is None and touches(problem.model, moment_):
            touch = len(moments) - 1
        if touch is not None and moment_.t > moments[touch].t + after:
            return Passage(problem.model, static, tuple(moments), touch)
        if len(moments) > MOST_STEPS:
            raise SolveError("the strip does not come down", parameter=moment_.lam)
    raise AssertionError("a motion does not end by itself")


def to_loss(strip: StripModel, height: float, moment: float, refinement: float) -> tuple[list[Step], float]:
    """The static steps along x to the loss of stability, and the last lambda before it.

    Raises
    ------
    SolveError
        The sag touches before, or the whole strip is lifted.
    """
    model, state = _start(strip, height, refinement)
    problem = StripProblem(model, AlongX(height), _friction(model, moment, state.q))
    state = replace(state, lam=float(state.q[model.middle[0, 0]]))
    steps: list[Step] = []
    while True:
        begin = state.lam
        places = ((0, begin + STEP * n) for n in range(1, MOST_STEPS))
        try:
            for step in load_incrementally_from(model, state, problem.effects, [problem.motion], places):
                if touches(model, step.point):
                    if step.moved > POPPED and steps:
                        break  # it fell there
                    raise SolveError("the sag touches before the strip snaps", parameter=step.point.lam)
                steps.append(step)
                if lift_off(model, step.point) > model.length - 0.5:
                    raise SolveError("the whole strip is lifted before it snaps", parameter=step.point.lam)
        except LostStabilityError:
            if not steps:
                raise
        last = _nearer(steps[-1])
        popped = _popped(last)
        if popped is None:
            return steps, last.point.lam
        # One contact of the mesh has opened and held the strip back: no loss of its own (docs/numerics.md).
        steps.append(popped)
        state, problem = popped.point.state, popped.problem.accepted(popped.point.q)


def _start(strip: StripModel, height: float, refinement: float) -> tuple[Model, Equilibrium]:
    """The strip lifted without horizontal force, on a mesh for all that follows."""
    (_, coarse, lifted) = next(lift(strip, [height]))
    model = strip.model(planning.boundaries(strip.length, planning.lift_off_sweep(height), refinement, SIZES))
    problem = StripProblem(model, AlongX(height))
    return model, no_horizontal_force(problem, transfer(coarse, lifted.q, model), height)


def _friction(model: Model, moment: float, slack: Array) -> tuple[Effect, ...]:
    return (Hysteresis.of(model, moment, slack=slack),) if moment else ()


def _nearer(last: Step) -> Step:
    """The last stable state, from a step in which the strip was not yet lost.

    A walk takes a strip for lost that moves much faster than its gripper.  At a fold it does so on the last bit of the
    way, and every step is as good as it is short.
    """
    size = STEP / 2.0
    while size > NEAREST:
        ahead = _ahead(last, size)
        if ahead is None:
            size /= 2.0
        else:
            last = ahead
    return last


def _popped(last: Step) -> Step | None:
    """A stable state a little behind the last one, not far from it; None where the strip has none, and snaps."""
    return next((ahead for size in BEYOND if (ahead := _ahead(last, size)) is not None), None)


def _ahead(last: Step, size: float) -> Step | None:
    """The stable state that is ``size`` ahead and near; None where there is none."""
    problem, state = last.problem.accepted(last.point.q), last.point.state
    try:
        new = newton.solve(problem, state.q, state.lam + size, state.active, options=ROBUST_NEWTON)
        point = continuation.evaluate(problem, new, last.point.tangent)
    except NewtonError:
        return None
    moved = problem.model.largest_move(state.q, new.q)
    if point.negatives or moved > POPPED or touches(problem.model, point):
        return None
    return Step(point, last.piece, problem, moved)
