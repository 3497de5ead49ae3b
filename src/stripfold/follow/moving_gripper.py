"""The snap of a strip with bending friction under a gripper that does not stop, as a camera would film it.

First statics with the memory of friction, in steps, up to the static limit, the last stable state; then motion in time
from a state well before it, through the snap and past the first touch.  In units of L*, sqrt(L*/g) and rho_a g L*.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from stripfold.base.errors import SolveError
from stripfold.follow.contact import touches
from stripfold.follow.contact_set import NODAL_SIZES, ROBUST_NEWTON
from stripfold.follow.path_friction import STEP, Step, effects_of, load_incrementally_from, until_lost, with_effects
from stripfold.follow.release import TIME_OPTIONS
from stripfold.follow.static import StripModel, lift, start_along_x
from stripfold.solve import dynamics, newton
from stripfold.solve.drive import Moving
from stripfold.solve.dynamics import TimeState
from stripfold.solve.schemes import Damping
from stripfold.strip.model import Model
from stripfold.strip.problem import StripProblem

MAX_STEPS = 20000
"""Steps in time within which a strip has to touch or fall."""
SIZES = replace(NODAL_SIZES, free=0.1)
"""Elements of the motion in time: friction delays the snap, and the lift-off passes more of the strip."""


@dataclass(frozen=True, eq=False)
class DynamicSnap:
    """A motion through a snap.

    ``model``: the strip.  ``static_limit``: largest lambda with a stable static state, friction included, L*.
    ``states``: the accepted states in time; their ``lam`` is the gripper's advance.  ``touch``: index of the first
    state at which the sag touches.
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

    ``strip``, ``height``: height in L*.  ``friction``: M_0 of the bending hysteresis, rho_a g L*^2; 0 for none.
    ``speed``: speed of the gripper, sqrt(g L*).  ``before``: distance before the static limit at which the motion in
    time begins, L*.  ``after``: duration after the first touch, sqrt(L*/g).  Raises SolveError: there is no snap at
    this height, or a part could not be computed; TimeStepError: the motion could not be followed.
    """
    steps, limit = static_limit(strip, height, friction, refinement)
    lams = np.array([step.lam for step in steps])
    at = int(np.clip(np.searchsorted(lams, limit - before, side="right") - 1, 1, len(steps) - 1))
    problem, first = set_in_motion(steps[at - 1], steps[at], speed, model_in_time(steps[-1], refinement))
    states: list[TimeState] = []
    touch: int | None = None
    for state in dynamics.march(problem, first, Moving(first.lam, speed), damping, options=TIME_OPTIONS):
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

    Raises SolveError: the sag touches before it, or the whole strip is lifted.
    """
    ((_, lifted),) = lift(strip.contact_mesh(refinement, memory=True), [height])
    first = with_effects(start_along_x(lifted, height), effects_of("hysteresis", friction))
    places = ((first.problem.motion, first.point.lam + STEP * n) for n in range(1, MAX_STEPS))

    def aloft() -> Iterator[Step]:
        for step in load_incrementally_from(first, places):
            if step.touches:
                raise SolveError("the sag touches before the strip snaps", parameter=step.lam)
            yield step

    steps, limit = until_lost(aloft())
    assert limit is not None  # the strip snaps, touches or is lifted
    return steps, limit


def model_in_time(last: Step, refinement: float) -> Model:
    """The strip on a fixed mesh, fine at the lift-off of the last static state: contact is node by node."""
    mesh = replace(last.at.problem.mesh, sizes=SIZES.scaled(refinement))
    return mesh.replanned(last.at.contact).model


def set_in_motion(before: Step, step: Step, speed: float, model: Model) -> tuple[StripProblem, TimeState]:
    """A static state on a fixed mesh, at the rate at which the strip moves from the step before to this one."""
    at = step.at
    held = at.problem.accepted(at.point.q).at(at.contact)
    problem = StripProblem(model, at.problem.motion, held.on(model))
    lies = problem.bounded[np.isin(problem.bounded, model.middle[model.s >= at.contact[-1], 1])]
    q, q_before = (state.model.resampled(state.u, model.s) for state in (at, before.at))
    state = newton.solve(problem, q, step.lam, lies, options=ROBUST_NEWTON)
    rate = (q - q_before) / (step.lam - before.lam)
    rate[state.active] = 0.0
    return problem, dynamics.start(problem, state.q, speed * rate, step.lam, state.active)
