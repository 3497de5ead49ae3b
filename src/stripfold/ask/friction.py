"""Friction in bending: how much a strip needs to follow a path, and where one with friction snaps or lands.

The friction that strips of several eta_b need on one R-path is that of docs/plan.md.

What a strip with friction does at a place depends on the way there.  For the boundary the flat strip is lifted along
the line on which it would have no horizontal force without friction, then its gripper advances at constant height to
the first snap or touch.  On the rod, in steps as a path with friction is followed; in units of L*.  Source:
docs/map.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from math import inf, sqrt
from typing import TypeVar

import numpy as np

from stripfold.base.arrays import Array, Mask
from stripfold.base.errors import SolveError
from stripfold.base.material import Material
from stripfold.base.progress import Percent
from stripfold.elastica.half_fold import states_no_horizontal_force
from stripfold.follow.contact_branch import BranchPoint, clearance
from stripfold.follow.memory import (
    FIRST_WITH_FRICTION,
    STEP,
    effects_of,
    load,
    load_incrementally_from,
    start_on_path,
    steps_on,
    with_effects,
)
from stripfold.follow.statics import StripModel, from_flat
from stripfold.follow.track import End
from stripfold.paths.curve import GripperPath, Interpolated, pieces_through
from stripfold.strip.problem import AlongPath, Motion

PlannedStrip = tuple[Material, float, GripperPath]
"""A strip, its length, m, and the path in its L*."""
SPARE = 1.25
"""Friction that is there over what is needed, at least: M_0 is seldom known to better than a tenth."""
SHORT = 13.0
"""Length, L*, of strips of which the softest needs most, as it is pushed too far; of longer ones it is the stiffest,
whose sag comes down too late."""
STEPS = {"lift": 1.0, "carry": 0.25, "roll": 0.05, "lay": 0.25}
"""Size of the steps in the phases of an R-path, L*: where the sag of a stiff strip comes down, a tenth of L* decides
between a touch and a snap."""
USUAL_STEP = 0.25
"""On other paths."""
MOST_TRIALS = 30
"""Strengths that are tried in a search."""
Held = TypeVar("Held")
STRONG = 0.1
"""M_0, rho_a g L*^2, above which elements are short."""
REFINEMENT = {"rod": (0.7, 0.25), "solid": (1.0, 0.5)}
"""Factors on the lengths of elements with friction: with longer ones of a rod what is needed is a fifth off; and with
the strong friction of real cloth, with which strips are lost where a longer element begins to slide."""

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


def refinement_of(model: str, moment: float) -> float:
    """Factor on the lengths of a model's elements with a friction moment, rho_a g L*^2."""
    return REFINEMENT[model][moment > STRONG]


def lost_with(
    strips: Sequence[PlannedStrip],
    moment: float,
    yield_curvature: float | None,
    say: Callable[[str], None] = lambda _: None,
) -> PlannedStrip | None:
    """Find a strip that does not follow its path with a friction moment; None where all do.

    ``strips``: of one width and weight, the stiffest first.  ``moment``, ``yield_curvature``: M_0, N, and kappa_y, 1/m.
    ``say``: called with a line on what is tried.

    Raises SolveError: a path could not be followed.
    """
    # The one that needs most comes first: it decides about nearly all.
    stiffest, length, _ = strips[0]
    for strip in strips if length / stiffest.gravity_length > SHORT else reversed(strips):
        say(f"r-path, friction with eta_b = {strip[0].eta_b:.4g}")
        if not holds(strip, moment, yield_curvature):
            return strip
    return None


def holds(strip: PlannedStrip, moment: float, yield_curvature: float | None) -> bool:
    """Whether a strip is followed to its first touch: from there on its layer is laid down; raises SolveError."""
    material, length, path = strip
    unit = material.gravity_length
    kappa_y = None if yield_curvature is None else yield_curvature * unit
    strength = moment / (material.force_scale * unit)
    effects = effects_of("hysteresis", strength, kappa_y)
    model = StripModel(length / unit, material.relative_thickness, kind="rod")
    mesh = model.contact_mesh(refinement_of(model.kind, strength), memory=True)
    first = start_on_path(mesh, path, effects, USUAL_STEP, FIRST_WITH_FRICTION)
    places = chain.from_iterable(
        steps_on(
            replace(path, pieces=(piece,)),
            model.length,
            STEPS.get(piece.name, USUAL_STEP),
            0.0 if piece.start else first.lam,
        )
        for piece in path.pieces
    )
    return load(first, places, until="touch", locate=False).end is not End.SNAP


def bisected(
    holds_with: Callable[[float], Held | None], first: float, ratio: float = 1.1, narrow: float = 1.1, most: float = inf
) -> tuple[float, float, Held]:
    """Find the smallest friction that suffices: one that fails, one within ``narrow`` times it, and what it yields.

    ``holds_with``: follows a path with a friction; None where it fails.  ``first``, ``ratio``: the one tried first, and
    that of the second to it, whose square is the next.  ``most``: the largest that is tried.  Raises SolveError: none
    is found.
    """
    fails, suffices, found, tried = 0.0, inf, None, first
    for _ in range(MOST_TRIALS):
        if (held := holds_with(tried)) is not None:
            suffices, found = tried, held
        else:
            fails = tried
        if found is not None and suffices <= narrow * fails:
            return fails, suffices, found
        if fails and found is not None:
            tried = sqrt(fails * suffices)
        else:
            tried = tried / ratio if found is not None else tried * ratio
            ratio *= ratio
        if tried > most:
            break
    raise SolveError(f"no friction between {fails:.3g} and {suffices:.3g} was found with which the plan is followed")


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
    """Find the ends of the advance of a strip of ``length`` with M_0 = ``moment``, rho_a g L*^2; raises SolveError."""
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
    flat = from_flat(strip.contact_mesh(memory=True), path, strip.length)
    first = with_effects(flat, effects_of("hysteresis", moment))
    least = LOWEST
    for at in load_incrementally_from(first, steps_on(path, strip.length, STEP, first.lam)):
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
