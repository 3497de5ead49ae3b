"""The snap of a strip with bending friction under a gripper that does not stop, as a camera would film it.

First statics with the memory of friction, in steps, up to the static limit, the last stable state; then motion in time
from a state well before it, through the snap and past the first touch.  In units of L*, sqrt(L*/g) and rho_a g L*.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from stripfold.analysis import planning
from stripfold.analysis.collapse import SIZES
from stripfold.analysis.contact import LEAST_LYING, lift_off, touches
from stripfold.analysis.nodal import ROBUST_NEWTON, lift, no_horizontal_force, transfer
from stripfold.analysis.path_friction import Step, load_incrementally_from
from stripfold.analysis.path_statics import BEYOND
from stripfold.analysis.static import StripModel
from stripfold.effects import Hysteresis
from stripfold.errors import LostStabilityError, NewtonError, SolveError
from stripfold.models.model import Model
from stripfold.problem import AlongX, StripProblem
from stripfold.solve import continuation, dynamics, newton
from stripfold.solve.drive import Moving
from stripfold.solve.dynamics import TimeOptions, TimeState
from stripfold.solve.schemes import Damping

STEP = 0.1
"""Size of the static steps, L*."""
RESOLUTION = 1e-4
"""Smallest step by which the static limit is approached, L*."""
MAX_DISPLACEMENT = 0.3
"""Largest displacement of the mid-surface in a step, L*: a larger one is a snap to another state."""
MAX_STEPS = 20000
TIME_OPTIONS = TimeOptions(first=0.02, tolerance=1e-5)


@dataclass(frozen=True, eq=False)
class DynamicSnap:
    """A motion through a snap.

    Attributes
    ----------
    model
        The strip.
    static_limit
        Largest lambda with a stable static state, friction included, L*.
    states
        The accepted states in time; their ``lam`` is the gripper's advance.
    touch
        Index of the first state at which the sag touches.
    """

    model: Model
    static_limit: float
    states: tuple[TimeState, ...]
    touch: int


def run(
    strip: StripModel,
    height: float,
    friction: float,
    speed: float,
    before: float,
    after: float,
    damping: Damping,
    refinement: float = 1.0,
) -> DynamicSnap:
    """Advance the gripper through the snap.

    Parameters
    ----------
    strip, height
        Height in L*.
    friction
        M_0 of the bending hysteresis, rho_a g L*^2; 0 for none.
    speed
        Speed of the gripper, sqrt(g L*).
    before
        Distance before the static limit at which the motion in time begins, L*.
    after
        Duration after the first touch, sqrt(L*/g).

    Raises
    ------
    SolveError
        There is no snap at this height, or a part could not be computed.
    TimeStepError
        The motion could not be followed.
    """
    steps, limit = static_limit(strip, height, friction, refinement)
    # The last two states before the start give the rate at which the strip moves there.
    lams = np.array([step.point.lam for step in steps])
    at = int(np.clip(np.searchsorted(lams, limit - before, side="right") - 1, 1, len(steps) - 1))
    rate = (steps[at].point.q - steps[at - 1].point.q) / (lams[at] - lams[at - 1])
    point = steps[at].point
    problem = steps[at].problem.accepted(point.q)
    first = dynamics.start(problem, point.q, speed * rate, point.lam, point.state.active)
    states: list[TimeState] = []
    touch: int | None = None
    for state in dynamics.march(problem, first, Moving(point.lam, speed), damping, options=TIME_OPTIONS):
        states.append(state)
        if touch is None and touches(problem.model, state):
            touch = len(states) - 1
        if touch is not None and state.t > states[touch].t + after:
            return DynamicSnap(problem.model, limit, tuple(states), touch)
        if len(states) > MAX_STEPS:
            raise SolveError("the strip does not come down", parameter=state.lam)
    raise AssertionError("a motion does not end by itself")


@lru_cache(maxsize=1)  # gripper speeds at one height share it
def static_limit(strip: StripModel, height: float, friction: float, refinement: float) -> tuple[list[Step], float]:
    """The static steps along x up to the static limit, and its lambda.

    Raises
    ------
    SolveError
        The sag touches before it, or the whole strip is lifted.
    """
    (_, coarse, lifted) = next(lift(strip, [height]))
    model = strip.model(planning.boundaries(strip.length, planning.lift_off_sweep(height), refinement, SIZES))
    problem = StripProblem(model, AlongX(height))
    state = no_horizontal_force(problem, transfer(coarse, lifted.q, model), height)
    state = replace(state, lam=float(state.q[model.middle[0, 0]]))
    if friction:
        problem = replace(problem, effects=(Hysteresis.of(model, friction, slack=state.q),))
    steps: list[Step] = []
    while True:
        begin = state.lam
        places = ((0, begin + STEP * n) for n in range(1, MAX_STEPS))
        try:
            for step in load_incrementally_from(model, state, problem.effects, [problem.motion], places):
                if touches(model, step.point):
                    if step.moved > MAX_DISPLACEMENT and steps:
                        break  # it snapped in this step
                    raise SolveError("the sag touches before the strip snaps", parameter=step.point.lam)
                steps.append(step)
                if lift_off(model, step.point) > model.length - LEAST_LYING:
                    raise SolveError("the whole strip is lifted before it snaps", parameter=step.point.lam)
        except LostStabilityError:
            if not steps:
                raise
        last = _approach(steps[-1])
        beyond = next((new for size in BEYOND if (new := _step(last, size)) is not None), None)
        if beyond is None:
            return steps, last.point.lam
        # A spurious limit point: an active-set change of one contact, with a stable state behind (docs/method.md).
        steps.append(beyond)
        state, problem = beyond.point.state, beyond.problem.accepted(beyond.point.q)


def _approach(last: Step) -> Step:
    """The last stable state near a limit point, from the last step before it, in shorter and shorter steps.

    Incremental loading stops where the strip moves much faster than the gripper.  Next to a limit point it does so in
    any step that is not short enough.
    """
    size = STEP / 2.0
    while size > RESOLUTION:
        ahead = _step(last, size)
        if ahead is None:
            size /= 2.0
        else:
            last = ahead
    return last


def _step(last: Step, size: float) -> Step | None:
    """The stable state that is ``size`` ahead, if it is close by."""
    problem, state = last.problem.accepted(last.point.q), last.point.state
    try:
        new = newton.solve(problem, state.q, state.lam + size, state.active, options=ROBUST_NEWTON)
        point = continuation.evaluate(problem, new, last.point.tangent)
    except NewtonError:
        return None
    moved = problem.model.largest_move(state.q, new.q)
    if point.negatives or moved > MAX_DISPLACEMENT or touches(problem.model, point):
        return None
    return Step(point, last.piece, problem, moved)
