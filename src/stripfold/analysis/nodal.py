"""Statics with contact node by node: to be deleted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stripfold.analysis import planning
from stripfold.analysis.advance import LIMIT, follow_to_event
from stripfold.analysis.contact import lift_off, touch, touches, whole_strip_lifts
from stripfold.analysis.static import LAMBDA_TOLERANCE, End, StripModel
from stripfold.arrays import Array
from stripfold.errors import SolveError
from stripfold.models.model import Model
from stripfold.problem import AlongX, Lift, StripProblem
from stripfold.solve import continuation, critical, newton
from stripfold.solve.continuation import StepOptions
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.problem import Equilibrium, Point

LIFT_STEPS = StepOptions(first=0.05, largest=1.0, target_iterations=12)
X_STEPS = StepOptions(first=0.1, largest=0.5, slow_below=0.4, target_iterations=10)
ROBUST_NEWTON = replace(LIFT_STEPS.newton, max_iterations=100)
"""For guesses with a wrong contact set, which is corrected node by node."""
NEARBY_NEWTON = replace(ROBUST_NEWTON, max_distance=0.3)
"""For states known from another mesh; at a larger distance lies another state (L*)."""
CLOSE = 0.15
"""Arc length between a maximum and a touch (L*), or slope of lambda at a touch, below which the mesh may decide."""
FINEST_FOR_ORDER = 0.3
"""Smallest factor on the element lengths to which the mesh is then refined."""
ROD_SIZES = planning.Sizes(free=0.2, sweep=0.2, critical=0.03, lying=0.3)
"""Element lengths of the rod at refinement one, L* (docs/method.md)."""


@dataclass(frozen=True)
class XRun:
    """A run along x at one height.

    Attributes
    ----------
    problem
        The problem solved.
    points
        Accepted points, from lambda_0; those before the end are ``points[:n_before]``.
    end
        The end of the advance.
    critical
        The located critical point where ``end`` is a snap.
    last
        The state at the end of the advance: critical, at first touch, or just before lift-off of the whole strip.
    spurious_limit_points
        Number of those before ``critical``; 0 on a mesh fine enough.
    close
        Whether maximum and touch of the sag are such near neighbours that the mesh may have decided between them.
    fallback
        Of a run that was to start near its end: why it started at lambda_0 instead; empty if it did not.
    """

    problem: StripProblem
    points: tuple[Point, ...]
    end: End
    critical: CriticalPoint | None
    last: Point
    spurious_limit_points: int
    close: bool = False
    fallback: str = ""

    @property
    def lambda_0(self) -> float:
        return self.points[0].lam

    @property
    def lam(self) -> float:
        """Advance at its end: lambda_c where it is a snap."""
        return self.last.lam

    @property
    def slack(self) -> float:
        """Uncertainty of lambda at the end of the advance on this mesh, L*.

        The bracket's width, plus the rise of lambda above a maximum split by a spurious limit point.
        """
        width = self.critical.width if self.critical else 0.0
        return width + max(p.lam for p in self.points) - self.last.lam

    @property
    def free_length(self) -> float:
        """Length of the part that hangs free at the end of the advance, L*."""
        return lift_off(self.problem.model, self.last)


def lift(strip: StripModel, heights: Sequence[float]) -> Iterator[tuple[float, Model, Equilibrium]]:
    """Lift the flat strip and yield its state at each height, ascending: the gripper is free along x (lambda_0)."""
    # Good enough as a start: each run along x has its own mesh.
    model = strip.model(max(24, round(4 * strip.length)))
    problem = StripProblem(model, Lift())
    flat = continuation.start(
        problem,
        np.zeros(model.size),
        min(0.01, heights[0] / 4),
        problem.bounded,
        1.0,
        replace(LIFT_STEPS, newton=ROBUST_NEWTON),
    )
    branch = continuation.follow(problem, flat, LIFT_STEPS)
    point = next(branch)
    for height in heights:
        before = point
        while point.lam < height:
            before, point = point, next(branch)
        # From the nearer side, with the tangent as a guess.
        near = min(before, point, key=lambda p: abs(p.lam - height))
        share = (height - near.lam) / near.tangent.lam
        guess = near.q + share * near.tangent.q
        yield (
            height,
            model,
            newton.solve(problem, guess, height, near.state.active, options=LIFT_STEPS.newton),
        )


def transfer(model: Model, q: Array, to: Model) -> Array:
    """Unknowns on another mesh of the same strip: the mid-surface by cubic splines, sections normal to it."""
    from scipy.interpolate import CubicSpline

    middle = model.mid_surface(q)
    spline = CubicSpline(model.s, middle)
    position = spline(to.s)
    slope = spline(to.s, 1)
    # A spline overshoots at the lift-off point; the lying part stays flat.
    lying = to.s >= model.s[np.flatnonzero(middle[:, 1] > 0.0).max(initial=0) + 1]
    position[lying] = np.stack([to.s[lying] - to.length / 2.0, np.zeros(lying.sum())], axis=1)
    position[:, 1] = np.maximum(position[:, 1], 0.0)
    angle = np.where(lying, 0.0, np.arctan2(slope[:, 1], slope[:, 0]))
    return to.unknowns_of(position, angle)


def no_horizontal_force(problem: StripProblem, q: Array, height: float) -> Equilibrium:
    """The state at ``height`` with the gripper free along x, near ``q``."""
    free = StripProblem(problem.model, Lift())
    touching = free.bounded[q[free.bounded] - free.lower <= 1e-12]
    return newton.solve(free, q, height, touching, options=NEARBY_NEWTON)


def along_x(
    strip: StripModel,
    height: float,
    start: tuple[Model, Equilibrium],
    mesh: float | Array = 1.0,
    past: float = 1.0,
    options: StepOptions = X_STEPS,
) -> XRun:
    """Follow the x-axis branch from lambda_0 to its end and, after a snap, ``past`` in arc length beyond it.

    Where the maximum and the touch of the sag are close neighbours, the mesh is refined until two in a row agree.

    Parameters
    ----------
    strip, height
        What is folded and the gripper's height, L*.
    start
        Model and state with no horizontal force at this height, as :func:`lift` yields.
    mesh
        Factor on all element lengths of the planned mesh, or the element boundaries themselves.
    past
        Arc length to follow the unstable branch, L*; 0 for none.

    Raises
    ------
    SolveError
        When a state or the branch cannot be computed to its tolerance.
    """

    def on_mesh(boundaries: Array) -> XRun:
        problem, first = begin(strip.model(boundaries), height, start, options)
        return to_the_end(problem, first, past, options)

    if np.ndim(mesh):
        return on_mesh(np.asarray(mesh))
    sweep = planning.lift_off_sweep(height)
    return two_agree(
        lambda refinement: on_mesh(
            planning.boundaries(
                strip.length, sweep, refinement, (ROD_SIZES if strip.kind == "rod" else planning.Sizes())
            )
        ),
        float(mesh),
        FINEST_FOR_ORDER,
    )


def two_agree(on_mesh: Callable[[float], XRun], refinement: float, finest: float) -> XRun:
    """A run with this refinement; where the mesh may decide between maximum and touch, until two meshes agree."""
    run = on_mesh(refinement)
    while run.close and refinement > finest:
        refinement /= 2.0
        last, run = run, on_mesh(refinement)
        if run.end is last.end:
            break
    return run


def begin(
    model: Model, height: float, start: tuple[Model, Equilibrium], options: StepOptions = X_STEPS
) -> tuple[StripProblem, Point]:
    """The problem of a motion along x on a mesh, and its first point, from a state as :func:`lift` yields.

    Raises
    ------
    SolveError
        There is no such state on this mesh near that one.
    """
    problem = StripProblem(model, AlongX(height))
    state = no_horizontal_force(problem, transfer(start[0], start[1].q, model), height)
    lambda_0 = float(state.q[model.middle[0, 0]])
    return problem, continuation.start(problem, state.q, lambda_0, state.active, 1.0, options)


def to_the_end(
    problem: StripProblem, first: Point, past: float, options: StepOptions, tolerance: float = LAMBDA_TOLERANCE
) -> XRun:
    """Follow a branch along x from a state on it, lambda_c to a bracket of ``tolerance``; see :func:`along_x`."""
    model = problem.model
    if critical.is_past(first) or touches(model, first):
        raise SolveError("the branch does not start stable: no state with no horizontal force to start from")
    sag, lifted = touch(model), whole_strip_lifts(model)
    found = follow_to_event(
        problem, first, (sag, lifted, LIMIT), options, confirm=(sag,), past=past, tolerance=tolerance
    )
    points, at = found.points, found.critical
    if at is not None:
        close = found.confirmed and points[-1].arc - at.after.arc < CLOSE
        return XRun(problem, points, End.SNAP, at, at.before, found.spurious, close)
    end, last = End.TOUCH if found.end.event is sag else End.LIFTED, found.end.after
    close = end is End.TOUCH and points[-1].tangent.lam < CLOSE
    return XRun(problem, (*points, last), end, None, last, found.spurious, close)


def solve_height(strip: StripModel, height: float, refinement: float, **options: Any) -> XRun:
    """Lift to one height and run along x from there."""
    (_, model, state) = next(lift(strip, [height]))
    return along_x(strip, height, (model, state), refinement, **options)
