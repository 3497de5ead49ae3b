"""The two post-critical branches of an R-path: the unstable planned state, disturbed with either sign.

Past the critical point of the R-path two equilibria exist for each place of the gripper: the planned one, which is
unstable, and another.  The planned one is computed along x, past the maximum of lambda at the same height.  In units
of L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from dataclasses import replace
from math import nan
from typing import TYPE_CHECKING

from stripfold.base.errors import SolveError
from stripfold.base.material import Material
from stripfold.files import schema
from stripfold.follow.contact_branch import STEPS, BranchPoint, clearance, solved
from stripfold.follow.contact_set import on_nodes
from stripfold.follow.fall import Fall, Progress, ReleaseState, at_rest, simulate_fall
from stripfold.follow.statics import StripModel, follow, solve_height
from stripfold.follow.track import Track
from stripfold.paths.rpath import RPath, plan_r_path
from stripfold.solve.continuation import step_to
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath
from tasks.assess_data import states

if TYPE_CHECKING:
    import xarray as xr

BEFORE_TOUCH = 0.15
"""Distance before the planned touch at which the strip is released, L*: there the two equilibria are farthest apart."""
PAST = 6.0
"""Arc length to follow past the maximum of lambda, L*."""
CARRY = 1
"""Index of the piece on which it happens."""


def follow_both_branches(
    strip: StripModel, plan: RPath, fall: Fall, refinement: float = 1.0, progress: Progress | None = None
) -> tuple[Track, Track]:
    """Release the planned state in both directions, gripper held, and follow the path from the states at rest.

    Each branch is a fall and statics, the one of the disturbance as given first.  Raises SolveError: there is no
    unstable planned state, or a part could not be computed.
    """
    say = progress or (lambda _: None)
    mesh = strip.contact_mesh(refinement)
    travelled = plan.path.pieces[CARRY].end - BEFORE_TOUCH
    say("looking for the unstable planned state")
    problem, start = on_nodes(planned_unstable(strip, plan, travelled, refinement), refinement)

    def branch(disturbance: float) -> Track:
        release = ReleaseState(problem, start, start.mode, 0.0)
        motion = simulate_fall(release, replace(fall, disturbance=disturbance), progress=say)
        return motion.then(follow(mesh, plan.path, strip.length, at_rest(mesh, motion), CARRY))

    return branch(abs(fall.disturbance)), branch(-abs(fall.disturbance))


def planned_unstable(strip: StripModel, plan: RPath, travelled: float, refinement: float = 1.0) -> BranchPoint:
    """The planned state at a length travelled, as an unstable equilibrium of the strip.

    Raises SolveError: when there is none: the path lies outside the stability boundary there.
    """
    x, height = plan.path.position(travelled)
    lam = float(x) + strip.length / 2.0
    near = _at(solve_height(strip, float(height), refinement, past=PAST), lam)
    motion = AlongPath(plan.path.pieces[CARRY], strip.length)
    at = solved(MovingContact(near.problem.mesh, motion), near.point.q, travelled)
    if at.point.negatives != 1 or clearance(at.problem, at.point.q)[0] < 0.0:
        raise SolveError("the planned state is not an unstable one that hangs free", parameter=travelled)
    return at


def _at(run: Track, lam: float) -> BranchPoint:
    """The point of the unstable branch at an advance."""
    ahead = [at for at in run.beyond if at.point.lam >= lam and at.point.tangent.lam < 0.0]
    if not ahead:
        words = "there is no unstable planned state: the path lies outside the stability boundary"
        raise SolveError(words, parameter=lam)
    last = ahead[-1]
    return BranchPoint(last.problem, step_to(last.problem, last.point, lam, STEPS))


def two_ways(
    material: Material, length: float, fall: Fall, refinement: float, progress: Progress | None = None
) -> xr.Dataset:
    """Both branches, over ``state`` and ``node`` as :func:`.assess_data.states`, with ``way``: 0 or 1.

    Where there is no unstable planned state the dataset is empty and its attribute ``reason`` says so.
    """
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu)
    plan = plan_r_path(strip.length)
    try:
        ways = follow_both_branches(strip, plan, fall, refinement, progress)
    except SolveError as error:
        return schema.dataset({}, {**material.attributes, "length": length, "reason": str(error)})
    first, second = ways
    data = states(first.then(second), plan.path, material)
    data = data.merge(schema.dataset({"way": ("state", data["part"].values // 2.0)}))
    touches = [track.touch for track in ways]
    return data.assign_attrs(
        length=length,
        reason="",
        signs=[1.0, -1.0],
        touch_x=[unit * touch.x if touch and touch.fell else nan for touch in touches],
        ends=[unit * track.points[-1].point.lam for track in ways],
        landing_x=unit * plan.landing,
        planned_touch_x=unit * plan.first_touch,
    )
