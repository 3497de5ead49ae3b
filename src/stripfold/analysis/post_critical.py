"""The two post-critical branches of an R-path: the unstable planned state, disturbed with either sign.

Past the critical point of the R-path two equilibria exist for each place of the gripper: the planned one, which is
unstable, and another.  The planned one is computed along x, past the maximum of lambda at the same height.  In units
of L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf
from typing import TYPE_CHECKING

from stripfold import schema
from stripfold.analysis import planning
from stripfold.analysis.contact import touches
from stripfold.analysis.nodal import XRun, along_x, lift
from stripfold.analysis.path_statics import SIZES, STEPS, StaticSegment, follow, problem_on
from stripfold.analysis.release import Fall, Motion, Progress, ReleaseState, simulate_fall, state_at_rest
from stripfold.analysis.states import dataset, of_material, rows_of_motion, rows_of_segment
from stripfold.analysis.static import StripModel
from stripfold.errors import SolveError
from stripfold.material import Material
from stripfold.models.model import Model
from stripfold.paths.rpath import RPath, plan_r_path
from stripfold.solve import continuation
from stripfold.solve.continuation import step_to
from stripfold.solve.problem import Point

if TYPE_CHECKING:
    import xarray as xr

BEFORE_TOUCH = 0.15
"""Distance before the planned touch at which the strip is released, L*: there the two equilibria are farthest apart."""
PAST = 3.0
"""Arc length to follow past the maximum of lambda, L*."""
CARRY = 1
"""Index of the piece on which it happens."""


@dataclass(frozen=True, eq=False)
class PostCriticalBranch:
    """One branch: the fall, and the statics along the path from the state at rest."""

    sign: float
    motion: Motion
    after: StaticSegment


@dataclass(frozen=True, eq=False)
class PostCriticalBranches:
    """The unstable planned state and both branches."""

    model: Model
    start: Point
    branches: tuple[PostCriticalBranch, ...]


def follow_both_branches(
    model: Model, strip: StripModel, plan: RPath, fall: Fall, progress: Progress | None = None
) -> PostCriticalBranches:
    """Release the planned state in both directions, gripper held, and follow the path from the states at rest.

    Raises
    ------
    SolveError
        There is no unstable planned state, or a part could not be computed.
    """
    say = progress or (lambda _: None)
    travelled = plan.path.pieces[CARRY].end - BEFORE_TOUCH
    say("looking for the unstable planned state")
    start = planned_unstable(model, strip, plan, travelled)
    problem = problem_on(model, plan.path, CARRY)
    ways = []
    for sign in (1.0, -1.0):
        release = ReleaseState(problem, start, start.mode, 0.0)
        motion = simulate_fall(release, replace(fall, disturbance=sign * abs(fall.disturbance)), progress=say)
        # The plan is lost: local snaps on the rest of the path do not matter.
        rest = state_at_rest(problem, motion.states[-1])
        ways.append(PostCriticalBranch(sign, motion, follow(model, plan.path, rest, CARRY, max_spurious_move=inf)))
    return PostCriticalBranches(model, start, tuple(ways))


def model_for(strip: StripModel, plan: RPath, refinement: float) -> Model:
    """A mesh that is fine at the planned lift-off point."""
    free = strip.length - plan.lying_length
    return strip.model(planning.boundaries(strip.length, planning.Sweep(0.0, free), refinement, SIZES))


def planned_unstable(model: Model, strip: StripModel, plan: RPath, travelled: float) -> Point:
    """The planned state at a length travelled, as an unstable equilibrium of the solid.

    Raises
    ------
    SolveError
        When there is none: the path lies outside the stability boundary there.
    """
    x, height = plan.path.position(travelled)
    lam = float(x) + strip.length / 2.0
    _, coarse, state = next(lift(strip, [float(height)]))
    run = along_x(strip, float(height), (coarse, state), mesh=model.ends, past=PAST)
    unstable = _at(run, lam)
    problem = problem_on(model, plan.path, CARRY)
    point = continuation.start(problem, unstable.q, travelled, unstable.active, 1.0, STEPS)
    if point.negatives != 1 or touches(model, point):
        raise SolveError("the planned state is not an unstable one that hangs free", parameter=travelled)
    return point


def _at(run: XRun, lam: float) -> Point:
    """The point of the unstable branch at an advance."""
    points = [p for p in run.points if run.critical is not None and p.arc >= run.critical.after.arc]
    for before, after in pairwise(points):
        if before.lam >= lam >= after.lam and before.tangent.lam < 0.0:
            return step_to(run.problem, before, lam, STEPS)
    raise SolveError("there is no unstable planned state: the path lies outside the stability boundary", parameter=lam)


def two_ways(
    material: Material, length: float, fall: Fall, refinement: float, progress: Progress | None = None
) -> xr.Dataset:
    """Both branches, over ``state`` and ``node`` as :func:`.states.dataset`, with ``way``: 0 or 1.

    Where there is no unstable planned state the dataset is empty and its attribute ``reason`` says so.
    """
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu)
    plan = plan_r_path(strip.length)
    model = model_for(strip, plan, refinement)
    try:
        ways = follow_both_branches(model, strip, plan, fall, progress)
    except SolveError as error:
        return schema.dataset({}, {**of_material(material), "length": length, "reason": str(error)})
    rows, way, touches = [], [], []
    for i, direction in enumerate(ways.branches):
        new = rows_of_motion(direction.motion, direction.after.problem(0), 2 * i)
        new += rows_of_segment(direction.after, 2 * i + 1)
        rows += new
        way += [float(i)] * len(new)
        touches.append(direction.motion.touch_x)
    data = dataset(rows, model, plan.path, material)
    data["way"] = ("state", way, schema.variables()["way"].attributes)
    return data.assign_attrs(
        length=length,
        reason="",
        signs=[direction.sign for direction in ways.branches],
        touch_x=[unit * x for x in touches],
        ends=[unit * direction.after.points[-1].lam for direction in ways.branches],
        landing_x=unit * plan.landing,
        planned_touch_x=unit * plan.first_touch,
    )
