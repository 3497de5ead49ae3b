"""A planned path followed by the rod in time, at the speed asked for, beside its quasi-static branch; in SI.

Source: docs/plan.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stripfold.ask.collapse import in_solver_units
from stripfold.ask.inputs import PlanInputs, Release, Strip
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.elastica import folded_loop
from stripfold.files.reporting import Rows
from stripfold.follow import time
from stripfold.follow.statics import StripModel
from stripfold.follow.time import Ridge, follow_in_time
from stripfold.follow.track import StripState, Track, nodes, shape_error
from stripfold.paths import FoldPath
from stripfold.paths.curve import GripperPath
from stripfold.paths.motion import timed
from stripfold.paths.rpath import half_fold
from stripfold.paths.table import SPACING
from stripfold.solve.dynamics import TimeState

TIME_OPTIONS = replace(time.TIME_OPTIONS, tolerance=3e-4)
"""Error per step, L*: with a third of it the deviation changes by less than a per cent, in two thirds more steps.
Longer elements save as much, and where one leaves the floor or lands move the strip more than the gripper does."""
ACCURATE = 0.1
"""Largest distance of the finished fold from the accurate one, L*: a millimetre or two of the strip's edge."""


@dataclass(frozen=True)
class PlannedMotion:
    """How a strip with one eta_b moves along a planned path.

    ``deviation``, ``x``, ``z``: largest distance of the strip in time from its static state at the same place of the
    gripper, and that place, m.  ``kinetic``: largest kinetic energy, J per m of width.  ``shape_error``: distance of
    the strip at rest from the accurate fold, m.
    """

    deviation: float
    x: float
    z: float
    kinetic: float
    shape_error: float


@dataclass(frozen=True)
class InTime:
    """Planned motions with the least, the given and the largest eta_b, which stay with the static states."""

    motions: tuple[PlannedMotion, ...]

    @property
    def worst(self) -> int:
        """Index of the one with the largest deviation."""
        return max(range(len(self.motions)), key=lambda i: self.motions[i].deviation)

    def rows(self, asked: PlanInputs) -> Rows:
        """What the strip does that deviates most."""
        worst, eta_b = self.motions[self.worst], asked.strips[self.worst].eta_b
        place = f"with eta_b = {eta_b:.4g}, gripper at x = {worst.x:.4g} m, z = {worst.z:.4g} m"
        return [
            ("in time", f"stays with its static states: at most {1e3 * worst.deviation:.1f} mm off, {place}"),
            ("  kinetic", f"energy at most {worst.kinetic:.3g} J/m"),
            ("  at rest", f"fold {1e3 * worst.shape_error:.2f} mm off"),
        ]


def in_time(
    asked: PlanInputs,
    path: FoldPath,
    static: Sequence[Sequence[StripState]],
    moment: float,
    say: Callable[[str], None],
    ridge: Ridge | None = None,
    snaps: bool = False,
) -> InTime | str:
    """Follow a path in time with the three eta_b, or say what happens with one of them instead.

    ``asked``: the strips, their kappa_y, and speed and acceleration of the gripper.  ``static``: for each eta_b the
    static states, L*.  ``moment``: M_0 of the bending hysteresis, N; 0 for none.  ``say``: called with a line on how
    much is done.  ``ridge``: of the table under the flat strip, m.
    ``snaps``: whether it leaves its static states, which then is no reason against it.
    """
    found: list[PlannedMotion] = []
    for strip, states in zip(asked.strips, static, strict=True):
        unit, subject = strip.gravity_length, f"at {asked.gripper_speed:g} m/s with eta_b = {strip.eta_b:.4g} the rod"

        def said(line: str, eta_b: float = strip.eta_b) -> None:
            say(f"{line}, with eta_b = {eta_b:.4g}")

        try:
            moved = _moved(asked, strip, path.curve.scaled(1.0 / unit), states, moment, said, ridge)
        except SolveError as error:
            return f"{subject} cannot be followed: {error}"
        # A strip that has left its static state, as in a snap, is farther from it than its fold is high.
        if not snaps and moved.deviation > folded_loop().height * unit:
            place = f"x = {moved.x:.4g} m, z = {moved.z:.4g} m"
            return f"{subject} is {1e3 * moved.deviation:.0f} mm off its static state at {place}: move slower"
        if not moved.shape_error <= ACCURATE * unit:
            return f"{subject} comes to rest {1e3 * moved.shape_error:.1f} mm off its fold: move slower"
        found.append(moved)
    return InTime(tuple(found))


def _moved(
    asked: PlanInputs,
    strip: Strip,
    path: GripperPath,
    static: Sequence[StripState],
    moment: float,
    progress: Callable[[str], None],
    ridge: Ridge | None,
) -> PlannedMotion:
    """Follow a path, L*, with one eta_b; errors are those of :func:`.follow_in_time`."""
    material, unit = strip.material, strip.gravity_length
    found = at_speed(asked, strip, path, 0.0, moment, progress, ridge)
    # Up to the end of the path, where the strip goes on to rest.
    travelled = np.array([state.lam for _, state in found.states])
    count = int(np.argmax(travelled >= path.length)) + 1
    away = deviations(static, found.states[:count], travelled[:count])
    farthest = int(np.argmax(away))
    x, z = unit * path.position(static[farthest][1].lam)
    kinetic = max(state.energy.kinetic for _, state in found.states if isinstance(state, TimeState))
    error = shape_error(*found.states[-1], half_fold(strip.length_star))
    return PlannedMotion(
        unit * float(away[farthest]), float(x), float(z), material.scales["J m-1"] * kinetic, unit * error
    )


def at_speed(
    asked: PlanInputs,
    strip: Strip,
    path: GripperPath,
    mu: float,
    moment: float = 0.0,
    progress: Callable[[str], None] | None = None,
    ridge: Ridge | None = None,
) -> Track:
    """Follow a path, L*, by the rod in time, at the robot's speed; errors are those of :func:`.follow_in_time`.

    ``mu``: coefficient of friction between the layers and on the floor; the rest as for :func:`in_time`.
    """
    material, unit = strip.material, strip.gravity_length
    return follow_in_time(
        StripModel(strip.length_star, material.relative_thickness, kind="rod", curl=asked.curl * unit),
        path,
        mu,
        moment / material.scales["N"],
        damping=in_solver_units(Release(), material).damping,
        yield_curvature=None if asked.yield_curvature is None else asked.yield_curvature * unit,
        speed=timed(
            *path.sampled(SPACING),
            asked.gripper_speed / material.scales["m s-1"],
            asked.acceleration / strip.gravity,
            None if asked.jerk is None else asked.jerk * material.scales["s"] / strip.gravity,
        ),
        ridge=None if ridge is None else Ridge(*(of / unit for of in ridge)),
        options=TIME_OPTIONS,
        progress=progress,
    )


def deviations(static: Sequence[StripState], moving: Sequence[StripState], travelled: Array) -> Array:
    """Largest distance of a strip in time from each of its static states, L*, shape (number of static states,).

    ``travelled``, shape (n,), are the lengths travelled at the states in time, which are close to each other: between
    them the shape is linear.
    """
    s = nodes(moving[0][0].model.length)
    away = []
    for (problem, point), at in zip(
        static, np.interp([point.lam for _, point in static], travelled, np.arange(len(travelled))), strict=True
    ):
        before = min(int(at), len(moving) - 2)
        first, second = (one.model.resampled_mid_surface(state.q, s) for one, state in moving[before : before + 2])
        shape = (before + 1 - at) * first + (at - before) * second
        apart = shape - problem.model.resampled_mid_surface(point.q, s)
        away.append(np.linalg.norm(apart, axis=1).max())
    return np.array(away)
