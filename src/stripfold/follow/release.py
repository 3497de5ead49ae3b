"""A strip released from an unstable state: dynamics to the first touch and to rest, and back to statics.

All in units of L*, sqrt(L*/g) and rho_a g L*.  Source: docs/physics.md, section 6.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.follow.contact import lies_apart, touch_position
from stripfold.follow.contact_branch import BranchPoint, Planned
from stripfold.follow.contact_set import ROBUST_NEWTON, from_nodes, on_nodes
from stripfold.follow.rest import to_rest
from stripfold.solve import continuation, dynamics
from stripfold.solve.continuation import StepOptions
from stripfold.solve.drive import Drive, Moving, Nudge
from stripfold.solve.dynamics import TimeEvent, TimeOptions, TimeState
from stripfold.solve.problem import Point
from stripfold.solve.schemes import Damping, Scheme
from stripfold.strip.problem import StripProblem

Progress = Callable[[str], None]

NUDGE = 0.01
"""Distance by which a held gripper is moved past lambda_c, smoothly within one time unit, L*: there no equilibrium is
near, not even one between two spurious limit points (docs/method.md)."""
TIME_OPTIONS = TimeOptions(first=0.02, largest=1.0, tolerance=1e-5)
"""Error per step up to the first touch, L*: a tenth of what its place is stated to."""
AFTER_TOUCH = 10.0
"""Factor on the tolerance after the first touch: the state at rest is found by statics."""
TOUCH_TOLERANCE = 1e-3
"""Time to which the first touch is located."""
SAME_STATE = 0.1
"""Largest distance between the strip at rest and the equilibrium found from it, L*."""


@dataclass(frozen=True, slots=True)
class Fall:
    """How the strip is released.

    ``disturbance``: largest initial speed of the mid-surface, along the critical eigenvector; positive in the direction
    of the branch.  A velocity, because a displacement would stretch a thin strip by its square.  ``speed``: speed of
    the gripper; with 0 it is held just past lambda_c.  ``damping``: physical damping.  ``to_rest``: whether to continue
    from the first touch to rest.
    """

    disturbance: float = 1e-3
    speed: float = 0.0
    damping: Damping = field(default_factory=Damping)
    to_rest: bool = True


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion in time.

    ``problem``: what its states solve: the strip on a fixed mesh.  ``states``: all accepted states, from lambda_c on.
    ``touch``: index of the first state at which the falling part touches; None where it rests without a touch.
    ``touch_x``: x of the touch, origin mid-strip; nan without a touch.
    """

    problem: StripProblem
    states: tuple[TimeState, ...]
    touch: int | None
    touch_x: float


@dataclass(frozen=True, eq=False)
class ReleaseState:
    """The state from which a strip is released.

    ``problem``, ``point``, ``mode``: the state, its problem, and the eigenvector along which it is disturbed.
    ``nudge``: distance by which a held gripper is moved first, L*; 0 from an unstable state.
    """

    problem: StripProblem
    point: Point
    mode: Array
    nudge: float = NUDGE

    @classmethod
    def at(cls, at: BranchPoint, refinement: float = 1.0) -> ReleaseState:
        """Release in the last state before a critical point, on a fixed mesh."""
        problem, point = on_nodes(at, refinement, stable=True)
        return cls(problem, point, point.mode, NUDGE + at.point.lam - point.lam)


def initial_state(release: ReleaseState, fall: Fall) -> tuple[TimeState, Drive]:
    """The first state of a fall, and the motion of the gripper."""
    problem, point = release.problem, release.point
    middle = problem.model.middle
    mode = release.mode / np.linalg.norm(release.mode[middle], axis=1).max()
    if problem.mass @ mode @ point.tangent.q < 0.0:
        mode = -mode
    v = fall.disturbance * mode
    first = dynamics.start(problem, point.q, v, point.lam, point.state.active)
    drive = Moving(point.lam, fall.speed) if fall.speed else Nudge(point.lam, release.nudge)
    return first, drive


def simulate_fall(
    release: ReleaseState,
    fall: Fall,
    options: TimeOptions = TIME_OPTIONS,
    progress: Progress | None = None,
    scheme: Scheme | None = None,
) -> Motion:
    """From an unstable state to the first touch and, if asked for, to rest.

    The motion also ends where the strip rests elsewhere without a touch.

    Raises TimeStepError: as :func:`.rest.to_rest`.
    """
    say = progress or (lambda _: None)
    problem, model = release.problem, release.problem.model
    first, drive = initial_state(release, fall)
    touching = TimeEvent(lambda state: lies_apart(model, state), TOUCH_TOLERANCE)
    states = list(to_rest(problem, [first], drive, fall.damping, options, touching, scheme=scheme))
    if not lies_apart(model, states[-1]):
        say(f"at rest without a touch after {states[-1].t:.1f} sqrt(L*/g)")
        return Motion(problem, tuple(states), None, float("nan"))
    touch = len(states) - 1
    say(f"touch after {states[-1].t:.1f} sqrt(L*/g)")
    if fall.to_rest:
        loose = replace(options, tolerance=AFTER_TOUCH * options.tolerance)
        states += list(to_rest(problem, states, drive, fall.damping, loose, scheme=scheme))[1:]
    return Motion(problem, tuple(states), touch, touch_position(model, states[touch]))


def state_at_rest(problem: StripProblem, state: TimeState) -> Point:
    """The equilibrium of a strip at rest.

    Raises SolveError: it does not converge, is another state, or is not stable.
    """
    if problem.effects:
        # What they remember at the end is not in the problem.
        raise ValueError("a state at rest is found without effects")
    point = continuation.start(problem, state.q, state.lam, state.active, 1.0, StepOptions(newton=ROBUST_NEWTON))
    distance = problem.model.largest_move(state.q, point.q)
    if distance > SAME_STATE:
        raise SolveError(f"the strip at rest is {distance:.2g} L* from the equilibrium found from it")
    if point.negatives:
        raise SolveError("the state at rest is not stable")
    return point


def at_rest(mesh: Planned, motion: Motion) -> BranchPoint:
    """The equilibrium that a motion ended in.

    Raises SolveError: as :func:`state_at_rest` and :func:`.from_nodes`.
    """
    return from_nodes(mesh, motion.problem, state_at_rest(motion.problem, motion.states[-1]))
