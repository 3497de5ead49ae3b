"""Where a strip with friction in bending snaps or lands, at many heights of its gripper, for one history.

What such a strip does at a place depends on the way there.  Here the flat strip is lifted along the line on which it
would have no horizontal force without friction, then its gripper advances at constant height to the first snap or
touch.  On the rod, in steps as a path with friction is followed; in units of L*.  Source: docs/map.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from stripfold.base.arrays import Array, Mask
from stripfold.base.percent import Percent
from stripfold.elastica.half_fold import states_no_horizontal_force
from stripfold.follow.contact_branch import BranchPoint
from stripfold.follow.contact_events import clearance
from stripfold.follow.memory import STEP, effects_of, load, load_incrementally_from, with_effects
from stripfold.follow.statics import StripModel, from_flat
from stripfold.follow.track import End
from stripfold.paths.curve import GripperPath, Interpolated, pieces_through
from stripfold.strip.problem import AlongPath, Motion

HISTORY = "lifted on the line of no horizontal force without friction, then advanced at constant height"
"""The way to each place of the boundary."""
LOWEST, RATIO = 0.5, 1.2
"""Lowest height, L*, and ratio of neighbouring ones: some fifteen heights for a strip of 16 L*."""
THICKNESS = 0.02
"""Of the rod, L*: it moves the ends of the advance by less than 1e-3 of themselves, thinner ones do not converge."""
MOST = 0.25
"""Largest M_0, rho_a g L*^2: with more, at low heights, the elements decide whether a step is followed."""
LEAST_LYING = 0.5
"""Length of the lying part below which the whole strip counts as lifted, L*."""


@dataclass(frozen=True, eq=False)
class FrictionBoundary:
    """The ends of the advance of a strip with friction, up to the height at which all of it is lifted.

    ``z``, ``advance``: shape (n,): heights, ascending, and advances past the flat end at which the strip snaps or its
    sag touches.  ``snaps``: shape (n,): whether it snaps.
    """

    z: Array
    advance: Array
    snaps: Mask


def friction_boundary(length: float, moment: float, progress: Callable[[str], None] | None = None) -> FrictionBoundary:
    """The ends of the advance of a strip of ``length`` with the friction moment ``moment``, M_0 in rho_a g L*^2.

    Raises SolveError: a step could not be computed.
    """
    strip, done = StripModel(length, THICKNESS, kind="rod"), Percent(progress, "with friction")
    rows: list[tuple[float, float, bool]] = []
    for lifted, height in _lifted(strip, moment):
        done(height / length)
        end, advance = _advanced(strip, lifted)
        if end is End.LIFTED:
            break
        rows.append((height, advance, end is End.SNAP))
    heights, advances, snaps = zip(*rows, strict=True)
    return FrictionBoundary(np.array(heights), np.array(advances), np.array(snaps))


def _lifted(strip: StripModel, moment: float) -> Iterator[tuple[BranchPoint, float]]:
    """The states at the heights, each with its own, from which the gripper advances."""
    half = strip.length / 2.0
    line = [
        (state.advance - half, state.gripper[1]) for state in states_no_horizontal_force(strip.length - LEAST_LYING)
    ]
    path = GripperPath("lift", pieces_through([("lift", np.array([(-half, 0.0), *line]))]))
    motion = AlongPath(path.pieces[0], strip.length)
    flat = from_flat(strip.contact_mesh(memory=True), path, strip.length)
    first = with_effects(flat, effects_of("hysteresis", moment))
    # The lifted part grows with the fourth root of the height: the first steps double.
    lam = first.point.lam
    doubled = lam * 2.0 ** np.arange(1.0, max(np.log2(STEP / lam), 1.0))
    places = [*doubled, *np.arange(doubled[-1] + STEP, path.length, STEP)]
    least = LOWEST
    for at in load_incrementally_from(first, ((motion, float(place)) for place in places)):
        if at.contact[-1] > strip.length - LEAST_LYING:
            return
        height = float(path.position(at.point.lam)[1])
        if height >= least:
            least = RATIO * height
            yield at, height


def _advanced(strip: StripModel, lifted: BranchPoint) -> tuple[End, float]:
    """The end of the advance from a lifted state, and the advance there."""
    lam = lifted.point.lam
    x, z = lifted.problem.motion.values(lam)
    ends = np.array([(x, z), (x + strip.length, z)]) - (strip.length / 2.0, 0.0)
    motion: Motion = AlongPath(Interpolated.through(ends, lam, "carry"), strip.length)
    now = [lifted]

    def places() -> Iterator[tuple[Motion, float]]:
        while True:
            at = now[-1]
            sag, _ = clearance(at.problem, at.point.q)
            # Shorter ones near the touch, which is known to a step.
            yield motion, at.point.lam + STEP * min(max(sag, STEP), 1.0)

    found = load(lifted, places(), "touch", lifted=strip.length - LEAST_LYING, progress=now.append)
    return found.end, float(motion.values(found.lam)[0])
