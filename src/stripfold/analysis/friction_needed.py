"""The least friction moment with which strips of several eta_b follow one R-path.  Source: docs/plan.md."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import sqrt

from stripfold.analysis.path_friction import effects_of, load_incrementally_from, steps_on, with_effects
from stripfold.analysis.path_statics import from_flat
from stripfold.analysis.static import StripModel
from stripfold.effects.hysteresis import YIELD_CURVATURE
from stripfold.errors import LostStabilityError
from stripfold.material import Material
from stripfold.paths.curve import GripperPath
from stripfold.problem import Motion

Followed = tuple[Material, float, GripperPath]
"""A strip, its length, m, and the path in its L*."""
SPARE = 1.25
"""Friction that is there over what is needed, at least: the search is accurate to a tenth, M_0 seldom known better."""
NARROW = 1.15
"""Ratio of the bracket's ends at which the search ends."""
USUAL = 0.037
"""M_0 first tried where there is not enough, rho_a g L*^2 per difference of the strips' lengths in their L*: what an
R-path for strips of 14 to 40 L* needs lies within a factor of 1.6."""
SHORT = 13.0
"""Length, L*, of strips of which the softest needs most, as it is pushed too far; of longer ones it is the stiffest,
whose sag comes down too late."""
MOST = 2.0
"""Largest M_0 tried, rho_a g L*^2: beyond that of fabrics."""
STEPS = {"lift": 1.0, "carry": 0.25, "roll": 0.05, "lay": 0.25}
"""Size of the steps in the phases of an R-path, L*: where the sag of a stiff strip comes down, a tenth of L* decides
between a touch and a snap."""
REFINEMENT = 0.7
"""Factor on the elements' lengths: with longer ones what is needed is a fifth off."""


@dataclass(frozen=True)
class Needed:
    """The least friction moment found to suffice, and the largest found not to, N: 0 where none was."""

    moment: float
    fails: float


def needed(
    strips: Sequence[Followed],
    yield_curvature: float | None,
    enough: float,
    say: Callable[[str], None] = lambda _: None,
) -> Needed | str:
    """The least M_0 of at least ``enough`` with which all strips follow their paths, or why none was found.

    Where ``enough`` does not suffice, the least one for the strip that needs most is looked for.

    Parameters
    ----------
    strips
        Of one width and weight, the stiffest first, the given one in the middle.
    yield_curvature
        kappa_y, 1/m.
    enough
        M_0 from which to search, N: where it suffices, it does not matter how much less would, too.
    say
        Called with a line on what is tried.

    Raises
    ------
    SolveError
        A path could not be followed.
    """
    given, _, _ = strips[len(strips) // 2]
    most = MOST * given.force_scale * given.gravity_length
    lengths = [length / material.gravity_length for material, length, _ in strips]
    usual = USUAL * (max(lengths) - min(lengths)) * given.force_scale * given.gravity_length
    # The one that needs most comes first: the others then hold with what it needs.
    for strip in strips if min(lengths) > SHORT else reversed(strips):
        say(f"r-path, friction with eta_b = {strip[0].eta_b:.4g}")
        if _holds(strip, enough, yield_curvature):
            continue
        fails, suffices, tried = enough, 0.0, max(usual, NARROW**2 * enough)
        while not 0.0 < suffices <= NARROW * fails:
            if tried > most:
                return f"no friction moment up to {fails:.3g} N holds the strip"
            say(f"r-path, would a friction moment of {tried:.3g} N hold the strip?")
            if _holds(strip, tried, yield_curvature):
                suffices = tried
            else:
                fails = tried
            tried = max(sqrt(fails * suffices), suffices / NARROW**2) if suffices else NARROW**2 * fails
        return Needed(suffices, fails)
    return Needed(enough, 0.0)


def _holds(strip: Followed, moment: float, yield_curvature: float | None) -> bool:
    """Whether the strip is followed to its first touch: from there on its layer is laid down."""
    material, length, path = strip
    unit = material.gravity_length
    kappa_y = YIELD_CURVATURE if yield_curvature is None else yield_curvature * unit
    effects = effects_of("hysteresis", moment / (material.force_scale * unit), kappa_y)
    model = StripModel(length / unit, material.relative_thickness, kind="rod")
    first = with_effects(from_flat(model.contact_mesh(REFINEMENT, memory=True), path, model.length), effects)
    try:
        for step in load_incrementally_from(first, _places(path, model.length), locate=False):
            if step.touches:
                break
    except LostStabilityError:
        return False
    return True


def _places(path: GripperPath, length: float) -> Iterator[tuple[Motion, float]]:
    """Where the steps end, with the gripper's motion there."""
    for piece in path.pieces:
        yield from steps_on(replace(path, pieces=(piece,)), length, STEPS[piece.name])
