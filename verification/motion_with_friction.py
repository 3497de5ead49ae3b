"""A strip with bending friction, lifted from the floor and moved along x to its snap or to the touch of its sag.

The strip is lifted with friction and without horizontal force, then its gripper moves along x in steps to the first of:
no equilibrium ahead (snap), touch of the sag, lift-off of the whole strip.  Lengths in L*, M_0 in rho_a g L*^2.
Source: docs/physics.md, section 8.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from stripfold import elastica
from stripfold.ask.friction import LEAST_LYING
from stripfold.base.arrays import Array
from stripfold.base.errors import LostStabilityError
from stripfold.follow.contact_branch import BranchPoint, from_flat, solved
from stripfold.follow.contact_events import clearance
from stripfold.follow.memory import load_incrementally_from
from stripfold.follow.statics import StripModel
from stripfold.paths.curve import Interpolated
from stripfold.strip.contact_mesh import LYING, ContactMesh, Sizes
from stripfold.strip.effects import Hysteresis
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, AlongX, Lift, Motion

SIZES = Sizes(free=0.12, lying=0.15)
BEGIN = (1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1)
"""Heights at the first steps of the lift, L*."""
NEAR = 0.1
"""Smallest share of the step, taken where lambda hardly rises or the sag is that near the floor, L*."""
CLOSE, RISING = 0.05, 0.3
"""Height of the sag, L*, and lambda's component of the tangent, from which on the touch is extrapolated."""
SNAP, TOUCH, LIFTED = 1.0, 0.0, -1.0
"""Ends of the motion."""
OVER = 2.0
"""Height above the final one to which a strip is lifted first, L*."""


class Kept(ContactMesh):
    """Elements that are not planned anew.

    Between meshes a state is resampled, and the springs of friction, M_0 / kappa_y times stiffer than the strip, turn
    the differences into large forces.
    """

    def drifted(self, contact: Array) -> bool:
        return False


@dataclass(frozen=True)
class Case:
    """A strip, and how it is computed.

    ``history`` of the lifting: "lifted" with friction; "slack", friction begins at lambda_0; "over", lifted
    :data:`OVER` too high and lowered.  ``stiffest``: largest stiffness of the springs, M_0 / kappa_y.  Of what is
    followed in time: speed of the gripper, sqrt(g L*), and damping, sqrt(g/L*) and sqrt(L*/g).
    """

    length: float
    thickness: float
    yield_curvature: float
    step: float
    refinement: float = 1.0
    history: str = "lifted"
    stiffest: float = 10.0
    speed: float = 0.0
    air: float = 0.0
    stiffness: float = 0.0

    def friction(self, model: Model, moment: float, slack: Array | None) -> Hysteresis:
        """Friction that begins in the state ``slack``; kappa_y grows with M_0 so that Newton's method converges."""
        kappa_y = max(self.yield_curvature, moment / self.stiffest)
        return Hysteresis.of(model, moment, yield_curvature=kappa_y, slack=slack)


def limit(case: Case, height: float, moment: float) -> tuple[float, float, float, float]:
    """The end of the motion: :data:`SNAP`, :data:`TOUCH` or :data:`LIFTED`; lambda there, lambda_0, speed of the sag.

    The speed is the fall of the sag over the advance of the gripper, the largest of all steps.

    Raises SolveError: a step could not be computed.
    """
    at = _at_start(case, height, moment)
    start = at.point.lam
    # lambda and the height of the sag, to extrapolate the touch.
    sags = [(start, np.inf)]
    step: BranchPoint | None = None

    def places() -> Iterator[tuple[Motion, float]]:
        yield at.problem.motion, start + NEAR * case.step
        while step is not None:
            share = min(1.0, step.point.tangent.lam, sags[-1][1])
            yield at.problem.motion, step.lam + max(share, NEAR) * case.step

    try:
        for step in load_incrementally_from(at, places()):
            if step.touches:
                return TOUCH, _touch(sags, step.lam), start, _speed(sags)
            if step.contact[-1] > case.length - LEAST_LYING:
                return LIFTED, step.lam, start, _speed(sags)
            sags.append((step.lam, clearance(step.problem, step.point.q)[0]))
            if sags[-1][1] < CLOSE and step.point.tangent.lam > RISING:
                return TOUCH, _touch(sags, np.inf), start, _speed(sags)
    except LostStabilityError as error:
        return SNAP, float(error.parameter or np.nan), start, np.inf
    raise AssertionError("the strip snaps, touches or is lifted")


def _touch(sags: list[tuple[float, float]], reached: float) -> float:
    """Where the height of the sag, extrapolated linearly, is zero; at most ``reached``."""
    (a, first), (b, second) = sags[-2:]
    return min(b + (b - a) * second / (first - second), reached) if first > second else reached


def _speed(sags: list[tuple[float, float]]) -> float:
    """Largest fall of the sag over the gripper's advance, in a step."""
    lam, height = np.array([sag for sag in sags if np.isfinite(sag[1])]).T
    return float((-np.diff(height) / np.diff(lam)).max())


def _at_start(case: Case, height: float, moment: float) -> BranchPoint:
    """The state without horizontal force at this height, as one of a motion along x."""
    over = height + OVER if case.history == "over" else height
    at = _with(case, _lifting(case, over), moment if case.history != "slack" else 0.0)
    heights = [*BEGIN[1:], *np.linspace(BEGIN[-1], over, int(np.ceil(over / (0.5 * case.step))) + 1)[1:]]
    at = _last(at, Lift(), heights)
    if case.history == "slack":
        at = _with(case, at, moment)
    if over != height:
        x = float(at.mid_surface(np.zeros(1))[0, 0])
        down = Interpolated.through(np.array([[x, over], [x, height]]), 0.0, "down")
        places = np.linspace(0.0, down.end, int(np.ceil(down.end / (0.5 * case.step))) + 1)[1:]
        at = _last(_onto(at, AlongPath(down, case.length), 0.0), AlongPath(down, case.length), list(places))
    return _onto(at, AlongX(height), float(at.point.q[at.model.middle[0, 0]]))


def _lifting(case: Case, height: float) -> BranchPoint:
    """The strip at the first height, on elements planned for the critical state."""
    contact = np.array([elastica.critical(height).state.length])
    strip = StripModel(case.length, case.thickness, kind="rod")
    mesh = Kept.of(case.length, LYING, contact, SIZES.scaled(case.refinement), strip.model)
    return from_flat(lambda _: mesh, Lift(), BEGIN[0])


def _with(case: Case, at: BranchPoint, moment: float) -> BranchPoint:
    """The strip with friction that began when it was flat, or that begins in the state if it is far from flat."""
    if moment == 0.0:
        return at
    slack = None if at.point.lam <= BEGIN[0] else at.u
    friction = case.friction(at.model, moment, slack)
    return solved(MovingContact(at.problem.mesh, at.problem.motion, (friction,), at.contact), at.point.q, at.point.lam)


def _onto(at: BranchPoint, motion: Motion, lam: float) -> BranchPoint:
    """An accepted state as one of another motion of the gripper."""
    return solved(at.problem.accepted(at.point.q, motion), at.point.q, lam)


def _last(at: BranchPoint, motion: Motion, places: Sequence[float]) -> BranchPoint:
    for step in load_incrementally_from(at, ((motion, float(place)) for place in places)):
        at = step
    return at
