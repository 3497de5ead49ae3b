"""A path followed in time by a slow gripper, with friction between the layers.

From the flat strip to rest at the path's end and, if asked for, to rest after the gripper has opened.  In units of L*,
sqrt(L*/g) and rho_a g L*.  Source: docs/physics.md, section 8.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.percent import Percent
from stripfold.follow.contact import touch_position, touches
from stripfold.follow.contact_set import ROBUST_NEWTON
from stripfold.follow.path_statics import FIRST
from stripfold.follow.rest import to_rest
from stripfold.follow.static import StripModel
from stripfold.paths.curve import GripperPath
from stripfold.paths.motion import TimedPath
from stripfold.solve import dynamics, newton
from stripfold.solve.drive import Drive, Moving
from stripfold.solve.dynamics import TimeOptions, TimeState
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.schemes import Damping
from stripfold.strip.effects import Hysteresis, LayerFriction
from stripfold.strip.hysteresis import YIELD_CURVATURE
from stripfold.strip.problem import AlongPath, Opened, StripProblem
from stripfold.strip.self_contact import SelfContact

SPEED = 0.2
"""Speed of the gripper, sqrt(g L*): 0.1 m/s with L* = 2.5 cm."""
ELEMENT = 0.1
"""Length of the elements, L*."""
TIME_OPTIONS = TimeOptions(first=0.02, tolerance=1e-4, newton=NewtonOptions(max_iterations=25))
"""Error per step, L*: that of a fall behind its first touch, as the state at rest counts.  Layers that begin to slide
need more iterations."""


@dataclass(frozen=True, eq=False)
class PathInTime:
    """A path followed in time.

    ``states``: all accepted states, each with what it solves: the memory of friction is that of the state before.
    ``problem``: the strip, with what friction remembers in the last state.  ``touch``: index of the first state in
    which the upper layer touches; None if it never does.
    """

    states: tuple[tuple[StripProblem, TimeState], ...]
    problem: StripProblem
    touch: int | None

    @property
    def last(self) -> TimeState:
        """The last state, at rest."""
        return self.states[-1][1]

    @property
    def touch_x(self) -> float:
        """x of the first touch, origin mid-strip, L*; nan without one."""
        return np.nan if self.touch is None else touch_position(self.problem.model, self.states[self.touch][1])

    @property
    def dissipated(self) -> Array:
        """Energy dissipated by the friction between the layers before each state and in the end, (states + 1,)."""
        problems = (*(problem for problem, _ in self.states), self.problem)
        return np.array([sum(e.dissipated for e in p.effects if isinstance(e, LayerFriction)) for p in problems])


def follow_in_time(
    strip: StripModel,
    path: GripperPath,
    mu: float,
    moment: float = 0.0,
    *,
    damping: Damping,
    yield_curvature: float = YIELD_CURVATURE,
    speed: float | TimedPath = SPEED,
    refinement: float = 1.0,
    options: TimeOptions = TIME_OPTIONS,
    progress: Callable[[str], None] | None = None,
) -> PathInTime:
    """Follow a path to its end and wait for rest.

    Parameters
    ----------
    strip, path
        The strip and the gripper's path, L*.
    mu
        Coefficient of friction between the layers and on the floor.
    moment
        M_0 of the bending hysteresis, rho_a g L*^2.
    damping
        Physical damping.
    yield_curvature
        kappa_y of that hysteresis, 1/L*.
    speed
        Of the gripper, sqrt(g L*), or where it is when.
    refinement
        Factor on the element lengths.
    progress
        Called with a line on how much of the path is done.

    Raises
    ------
    SolveError
        The first state cannot be computed.
    TimeStepError
        As :func:`.rest.to_rest`.
    """
    model = strip.model(ceil(strip.length / (ELEMENT * refinement)))
    problem = StripProblem(model, AlongPath(path, strip.length), self_contact=SelfContact.of(model, strip.thickness))
    lies = np.setdiff1d(problem.bounded, model.middle[model.s < 1.0, 1])
    q = newton.solve(problem, np.zeros(model.size), FIRST, lies, options=ROBUST_NEWTON).q
    hysteresis = (Hysteresis.of(model, moment, yield_curvature=yield_curvature, slack=q),) if moment else ()
    layers = (LayerFriction.of(model, mu, q, problem.reaction),) if mu else ()
    problem = replace(problem, effects=(*hysteresis, *layers))
    on_floor = problem.bounded[q[problem.bounded] <= 0.0]
    first = dynamics.start(problem, q, np.zeros(model.size), FIRST, on_floor)
    if isinstance(speed, TimedPath):
        drive: Drive = (timing := speed.starting_at(FIRST))
        moving = float(timing.t[-1])
    else:
        drive, moving = Moving(FIRST, speed, path.length), (path.length - FIRST) / speed
    return _followed(problem, first, drive, damping, options, moving, Percent(progress, "following the path in time"))


def opened(found: PathInTime, damping: Damping, options: TimeOptions = TIME_OPTIONS) -> PathInTime:
    """The strip at rest after its gripper has opened at the end of the path; errors as :func:`follow_in_time`."""
    last, problem = found.last, replace(found.problem, motion=Opened())
    on_floor = problem.bounded[last.q[problem.bounded] <= 0.0]
    return _followed(problem, replace(last, t=0.0, active=on_floor), Moving(last.lam, 0.0), damping, options, 0.0)


def _followed(
    problem: StripProblem,
    first: TimeState,
    drive: Drive,
    damping: Damping,
    options: TimeOptions,
    moving: float,
    moved: Percent | None = None,
) -> PathInTime:
    """To rest after the gripper has moved for some time."""
    states: list[tuple[StripProblem, TimeState]] = []
    touch: int | None = None
    for state in to_rest(problem, [first], drive, damping, options, moving=moving):
        if moved is not None:
            moved(min(state.t / moving, 1.0))
        if touch is None and touches(problem.model, state):
            touch = len(states)
        states.append((problem, state))
        # The march updates a problem of its own in the same way.
        problem = problem.accepted(state.q)
    return PathInTime(tuple(states), problem, touch)
