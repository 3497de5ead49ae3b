"""A strip released from an unstable state: dynamics to the first touch and to rest, and back to statics.

With it a path is followed past its critical points, and a strip through its collapse.  All in units of L*, sqrt(L*/g)
and rho_a g L*.  Source: docs/physics.md, section 6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError, TimeStepError
from stripfold.base.progress import FALL
from stripfold.follow.contact import has_ruck, lies_apart, lift_off
from stripfold.follow.contact_branch import STEPS, BranchPoint, Planned, longest_free, solved
from stripfold.follow.contact_set import NEARBY_NEWTON, ROBUST_NEWTON, from_nodes, on_nodes
from stripfold.follow.statics import StripModel, follow, solve_height, static_track
from stripfold.follow.track import End, StripState, Track, grip_and_hold
from stripfold.paths.curve import GripperPath, Interpolated
from stripfold.solve import continuation, dynamics, newton
from stripfold.solve.continuation import StepOptions
from stripfold.solve.dynamics import Drive, Moving, Nudge, TimeEvent, TimeOptions, TimeState
from stripfold.solve.problem import Point
from stripfold.solve.schemes import Damping, Scheme
from stripfold.strip.layer_friction import LayerFriction
from stripfold.strip.problem import AlongPath, StripProblem
from stripfold.strip.self_contact import SelfContact

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
REST = 1e-6
"""Kinetic energy, as a share of the energy that weight, elasticity and gripper gave to the motion or took from it,
below which a strip is at rest; that of a disturbance is not counted, so that a slow start is not rest."""
QUIET = 2.0
"""Time for which it must stay below: longer than between two turning points of an oscillation."""
LONGEST = 400.0
"""Longest time to rest or to another event; longer with damping, which slows the start of a fall."""
SAME_STATE = 0.1
"""Largest distance between the strip at rest and the equilibrium found from it, L*."""
MAX_FALLS = 5
"""Falls along one path: a strip that falls more often is not being folded."""


@dataclass(frozen=True, slots=True)
class Fall:
    """How the strip is released.

    ``disturbance``: largest initial speed of the mid-surface, along the critical eigenvector; positive in the direction
    of the branch.  A velocity, because a displacement would stretch a thin strip by its square.  ``speed``: speed of
    the gripper; with 0 it is held just past lambda_c.  ``damping``: physical damping.  ``to_rest``: whether to continue
    from the first touch to rest.  ``tolerance``: error per step up to the first touch, L*.
    """

    disturbance: float = 1e-3
    speed: float = 0.0
    damping: Damping = field(default_factory=Damping)
    to_rest: bool = True
    tolerance: float = TIME_OPTIONS.tolerance


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
        if isinstance(problem.motion, AlongPath) and problem.motion.gripper == "turning":
            # It turns first, and is then moved.
            problem = replace(problem, motion=problem.motion.standing(at.point.lam))
            state = newton.solve(problem, point.q, point.lam, point.active, options=NEARBY_NEWTON)
            point = continuation.evaluate(problem, state, point.tangent, point.arc)
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


def to_rest(
    problem: StripProblem,
    so_far: Sequence[TimeState],
    drive: Drive,
    damping: Damping,
    options: TimeOptions,
    *until: TimeEvent,
    scheme: Scheme | None = None,
    moving: float = 0.0,
) -> Iterator[TimeState]:
    """Yield states from the last one so far to rest, or to an earlier event of ``until``.

    ``so_far``: the motion up to there, its first state at least.  ``moving``: time for which the gripper moves first:
    no rest.  Raises TimeStepError: none of this happens, or no time step succeeds; with the last good state and its
    ``mid_surface``.
    """
    disturbance, begin = so_far[0].energy.kinetic, max(so_far[-1].t, moving)
    longest = LONGEST * (1.0 + damping.air + damping.stiffness)
    quiet_since = inf

    def rests(state: TimeState) -> bool:
        nonlocal quiet_since
        still = state.t >= moving and state.energy.kinetic <= REST * abs(state.energy.lost - disturbance)
        quiet_since = min(quiet_since, state.t) if still else inf
        return state.t - quiet_since > QUIET

    ends, late = (*until, TimeEvent(rests)), TimeEvent(lambda state: state.t > begin + longest)
    try:
        for state in dynamics.march(problem, so_far[-1], drive, damping, scheme, options, (*ends, late)):
            yield state
            if late.happened(state) and not any(event.happened(state) for event in ends):
                raise TimeStepError(
                    f"the strip did not come to rest within {state.t - begin:.0f} sqrt(L*/g)",
                    parameter=state.lam,
                    advice="add damping, hold the gripper, or give a larger disturbance",
                    last=state,
                )
    except TimeStepError as error:
        error.details["mid_surface"] = problem.model.mid_surface(error.last.q)
        raise


def simulate_fall(
    release: ReleaseState,
    fall: Fall,
    progress: Progress | None = None,
    scheme: Scheme | None = None,
) -> Track:
    """From an unstable state to the first touch and, if asked for, to rest.

    The motion also ends where the strip rests elsewhere without a touch.

    Raises TimeStepError: as :func:`to_rest`.
    """
    say, options = progress or (lambda _: None), replace(TIME_OPTIONS, tolerance=fall.tolerance)
    problem, model = release.problem, release.problem.model
    first, drive = initial_state(release, fall)
    touching = TimeEvent(lambda state: lies_apart(model, state), TOUCH_TOLERANCE)
    states = list(to_rest(problem, [first], drive, fall.damping, options, touching, scheme=scheme))
    last, end = states[-1], End.REST
    if not lies_apart(model, last):
        say(f"at rest without a touch after {last.t:.1f} sqrt(L*/g)")
    else:
        say(f"touch after {last.t:.1f} sqrt(L*/g)")
        if fall.to_rest:
            loose = replace(options, tolerance=AFTER_TOUCH * options.tolerance)
            states += list(to_rest(problem, states, drive, fall.damping, loose, scheme=scheme))[1:]
        else:
            end = End.TOUCH
    points = tuple(StripState(problem, state) for state in states)
    return Track(points, end, (FALL,) * len(points))


def state_at_rest(problem: StripProblem, state: TimeState | Point) -> StripState:
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
    return StripState(problem, point)


def size_of_fall(before: StripState, fall: Sequence[StripState]) -> tuple[float, float]:
    """The largest height that a point of the strip loses in a fall, L*, and the energy that it frees, rho_a g L*^2.

    From the critical state ``before`` to the state at rest with the gripper at the same place, not past it, where the
    motion ended.  The energy is by the motion's mesh, on which the error of both states is the same.

    Raises SolveError: there is no such state at rest.
    """
    (critical, point), (problem, first), (_, last) = before, fall[0], fall[-1]
    rest = state_at_rest(problem, last).point
    landed = newton.solve(problem, rest.q, point.lam, rest.active, options=NEARBY_NEWTON)
    s = problem.model.s
    drop = critical.model.resampled_mid_surface(point.q, s) - problem.model.mid_surface(landed.q)
    here, begin = (
        float(grip_and_hold(each, at)[0] @ each.motion.rates(at.lam))
        for each, at in ((critical, point), (problem, first))
    )
    # Near a limit point the push changes with the root of the distance from it.
    work = (here / 3.0 + 2.0 * begin / 3.0) * (point.lam - first.lam)
    return float(drop[:, 1].max()), sum(problem.energies(first.q)) - sum(problem.energies(landed.q)) + work


def at_rest(mesh: Planned, fall: Track) -> BranchPoint:
    """Find the equilibrium that a motion ended in.

    Raises SolveError: as :func:`state_at_rest` and :func:`.from_nodes`; there is a ruck, of which statics without
    friction do not say where it is.
    """
    problem, last = fall.states[-1]
    try:
        return from_nodes(mesh, *state_at_rest(problem, last))  # type: ignore[arg-type]
    except SolveError as error:
        if not has_ruck(problem.model, last):
            raise
        said = "the strip rests with a ruck, which may lie anywhere on a smooth table"
        raise SolveError(said, advice="a table with friction holds it: give layer_friction") from error


def assess_strip(
    strip: StripModel,
    path: GripperPath,
    fall: Fall | None = None,
    refinement: float = 1.0,
    progress: Progress | None = None,
    options: StepOptions = STEPS,
    first: BranchPoint | None = None,
    piece: int = 0,
) -> Track:
    """Follow a path through its falls, from a state on one of its pieces or from the flat strip.

    At critical points the strip is released as ``fall`` says; without it the first one is the end.  Where the fall is
    not to rest, its first touch is the end.  After :data:`MAX_FALLS` falls the next critical point is the end.

    Raises SolveError: the statics up to the first critical point could not be computed; what fails after that is a part
    of the result.
    """
    say = progress or (lambda _: None)
    mesh = strip.contact_mesh(refinement, clamped=path.gripper != "hinge")
    found = follow(mesh, path, strip.length, first, piece, options=options, progress=say)
    while fall is not None and found.end is End.SNAP and len(found.events) <= MAX_FALLS:
        try:
            say(f"falling at {found.lam / path.length:.0%} of the path")
            motion = simulate_fall(ReleaseState.at(found.last, refinement), fall)
            found = found.then(motion)
            if found.touch is not None and not fall.to_rest:
                break
            say("following the path from the state at rest")
            rest, piece = at_rest(mesh, motion), found.pieces[-1]
            if path.gripper == "turning":
                goes_on = AlongPath(path.pieces[piece], strip.length, path.gripper)
                rest = solved(replace(rest.problem, motion=goes_on), rest.point.q, rest.lam)
            found = found.then(follow(mesh, path, strip.length, rest, piece, options=options, progress=say))
        except SolveError as error:
            # What statics say of the path holds without the fall.
            return replace(found, failure=error)
    return found


def collapse(
    strip: StripModel,
    height: float,
    fall: Fall | None,
    refinement: float = 1.0,
    progress: Progress | None = None,
    self_contact: float | None = None,
    layer_friction: float = 0.0,
    run: Track | None = None,
) -> Track:
    """Lift the strip, move its gripper to lambda_c, let it fall, and move on until the gripper is above the held end.

    Without a ``fall`` it ends at lambda_c.  ``self_contact`` is the thickness, L*, of layers that meet above the floor;
    None lets them go through each other.  ``layer_friction`` is the coefficient of friction between the layers and on
    the floor; with it the end is the strip at rest after its fall, as statics do not know it.  ``run``: the statics to
    lambda_c, by default those of a hinge.

    Raises SolveError: there is no snap at this height, a part could not be computed, or the strip did not fall;
    TimeStepError: the motion could not be followed; with the last good moment.
    """
    say = progress or (lambda _: None)
    say("following the branch to its critical point")
    run = to_critical_point(strip, height, refinement, run)
    if fall is None:
        return run
    release = ReleaseState.at(run.last, refinement)
    if self_contact is not None:
        layers = SelfContact.of(release.problem.model, self_contact)
        release = replace(release, problem=replace(release.problem, self_contact=layers))
    if layer_friction:
        problem, q = release.problem, release.point.q
        friction = LayerFriction.of(problem.model, layer_friction, q, problem.reaction)
        release = replace(release, problem=replace(problem, effects=(friction,)))
    motion = simulate_fall(release, fall, progress=say)
    if motion.touch is None:
        raise SolveError("the strip came to rest without touching", parameter=motion.lam)
    found = run.then(motion)
    if not fall.to_rest or layer_friction:
        # Statics do not know the friction between the layers.
        return found
    say("going on from the state at rest")
    return found.then(_go_on(strip, motion, height, refinement))


def to_critical_point(strip: StripModel, height: float, refinement: float = 1.0, run: Track | None = None) -> Track:
    """The static run, that given or a hinge's.

    Raises SolveError: it cannot be computed, or there is no snap at this height.
    """
    run = run or solve_height(strip, height, refinement)
    if run.critical is None:
        raise SolveError(f"there is no fall to follow: {run.end.reason}", advice="choose a height that snaps")
    return run


def _go_on(strip: StripModel, motion: Track, height: float, refinement: float) -> Track:
    """Follow the settled strip until its gripper is above the held end, the whole strip is lifted, or layers meet."""
    length, begin, (problem, _) = strip.length, motion.lam, motion.states[-1]
    x = np.array([begin, length]) - length / 2.0
    along_x = Interpolated.through(np.column_stack([x, [height, height]]), begin, "along x")
    mesh, path = strip.contact_mesh(refinement), GripperPath("along x", (along_x,))
    found = follow(mesh, path, length, at_rest(mesh, motion))
    layers, model = problem.self_contact, problem.model
    for i, (p, at) in enumerate(found.states):
        if layers is not None and layers.gap(p.model.resampled(at.q, model.s)) < 0.0:
            return static_track(found.points[:i], End.LAYERS)
        if lift_off(p.model, at) > longest_free(p.model):
            return static_track(found.points[: i + 1], End.LIFTED)
    return found
