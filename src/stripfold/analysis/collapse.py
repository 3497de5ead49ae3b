"""One strip past its critical point: statics to lambda_c, dynamics to rest, statics again (the paper's section IV).

All in units of L*, sqrt(L*/g) and rho_a g L*; :mod:`.collapse_data` stores it in SI.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from stripfold.analysis import planning
from stripfold.analysis.advance import LIMIT, follow_to_event
from stripfold.analysis.contact import whole_strip_lifts
from stripfold.analysis.release import Fall, Motion, Progress, ReleaseState, simulate_fall, state_at_rest
from stripfold.analysis.static import X_STEPS, End, StripModel, XRun, along_x, lift
from stripfold.effects.self_contact import SelfContact
from stripfold.errors import SolveError
from stripfold.problem import StripProblem
from stripfold.solve.dynamics import TimeState
from stripfold.solve.events import Event
from stripfold.solve.problem import Point

SIZES = planning.Sizes(free=0.15, lying=0.15)
"""The loop rolls over all of the strip: no part may be coarse."""
MAX_STEPS = 1500


@dataclass(frozen=True, eq=False)
class Collapse:
    """The whole: static run, fall (None where it was not asked for), and the static points from the state at rest on
    (empty if they were not)."""

    height: float
    run: XRun
    motion: Motion | None
    after: tuple[Point, ...]
    end: str


def simulate(
    strip: StripModel,
    height: float,
    fall: Fall | None,
    refinement: float = 1.0,
    progress: Progress | None = None,
    self_contact: float | None = None,
) -> Collapse:
    """Lift the strip, move its gripper to lambda_c, let it fall, and move on until the gripper is above the held end.

    Without a ``fall`` it ends at lambda_c.  ``self_contact`` is the thickness, L*, of layers that meet above the floor;
    None lets them go through each other.

    Raises
    ------
    SolveError
        There is no snap at this height, a part could not be computed, or the strip did not fall.
    TimeStepError
        The motion could not be followed; with the last good moment.
    """
    say = progress or (lambda _: None)
    say("following the branch to its critical point")
    run = to_critical_point(strip, height, refinement)
    if fall is None:
        return Collapse(height, run, None, (), "the critical point: statics alone do not lead past it")
    if self_contact is not None:
        problem = replace(run.problem, self_contact=SelfContact.of(run.problem.model, self_contact))
        run = replace(run, problem=problem)
    motion = simulate_fall(release_of(run), fall, progress=say)
    if motion.touch is None:
        raise SolveError("the strip came to rest without touching", parameter=motion.states[-1].lam)
    if not fall.to_rest:
        return Collapse(height, run, motion, (), "first touch")
    say("going on from the state at rest")
    after, end = go_on(run.problem, motion.states[-1])
    return Collapse(height, run, motion, after, end)


def to_critical_point(strip: StripModel, height: float, refinement: float = 1.0) -> XRun:
    """The static run, on a mesh on which the strip can also be laid down and rolled on.

    Raises
    ------
    SolveError
        It cannot be computed, or there is no snap at this height.
    """
    sweep = planning.lift_off_sweep(height)
    mesh = planning.boundaries(strip.length, sweep, refinement, SIZES)
    (_, model, state) = next(lift(strip, [height]))
    run = along_x(strip, height, (model, state), mesh, past=0.0)
    if run.critical is None:
        raise SolveError(f"there is no fall to follow: {run.end.reason}", advice="choose a height that snaps")
    return run


def release_of(run: XRun) -> ReleaseState:
    """The critical state of a run that ended in a snap."""
    assert run.critical is not None
    return ReleaseState.at(run.problem, run.critical)


def go_on(problem: StripProblem, rest: TimeState) -> tuple[tuple[Point, ...], str]:
    """Follow the settled strip until its gripper is above the held end; the points, and what ended the motion."""
    model = problem.model
    above = Event("the gripper is above the held end", lambda point, _: point.lam >= model.length, located=False)
    lifted = whole_strip_lifts(model)
    options = replace(X_STEPS, max_attempts=MAX_STEPS)
    found = follow_to_event(problem, state_at_rest(problem, rest), (above, lifted, LIMIT), options)
    if found.critical is not None:
        return found.points[: found.points.index(found.critical.after) + 1], "another critical point"
    return (*found.points, found.end.after), End.LIFTED.value if found.end.event is lifted else above.name
