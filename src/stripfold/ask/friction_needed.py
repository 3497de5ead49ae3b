"""Whether strips of several eta_b follow one R-path with a given friction moment.  Source: docs/plan.md."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from math import inf, sqrt
from typing import TypeVar

from stripfold.base.errors import SolveError
from stripfold.base.material import Material
from stripfold.follow.memory import effects_of, load, steps_on, with_effects
from stripfold.follow.statics import StripModel, from_flat
from stripfold.follow.track import End
from stripfold.paths.curve import GripperPath
from stripfold.strip.hysteresis import YIELD_CURVATURE

Followed = tuple[Material, float, GripperPath]
"""A strip, its length, m, and the path in its L*."""
SPARE = 1.25
"""Friction that is there over what is needed, at least: M_0 is seldom known to better than a tenth."""
EXACT = 0.02
"""M_0 with which strips of up to 20 L* follow R-paths planned for their own eta_b, rho_a g L*^2."""
UNCERTAIN = 2.2e-3
"""M_0 over (length / L*)^1.5 and the root of the relative uncertainty of eta_b, rho_a g L*^2: searches for strips of 14
to 40 L* and 5 to 20 % found 0.8 to 1.4 times as much."""
SHORT = 13.0
"""Length, L*, of strips of which the softest needs most, as it is pushed too far; of longer ones it is the stiffest,
whose sag comes down too late."""
STEPS = {"lift": 1.0, "carry": 0.25, "roll": 0.05, "lay": 0.25}
"""Size of the steps in the phases of an R-path, L*: where the sag of a stiff strip comes down, a tenth of L* decides
between a touch and a snap."""
MOST_TRIALS = 30
"""Strengths that are tried in a search."""
Held = TypeVar("Held")
REFINEMENT = 0.7
"""Factor on the elements' lengths: with longer ones what is needed is a fifth off."""


def lost_with(
    strips: Sequence[Followed],
    moment: float,
    yield_curvature: float | None,
    say: Callable[[str], None] = lambda _: None,
) -> Followed | None:
    """Find a strip that does not follow its path with a friction moment; None where all do.

    Parameters
    ----------
    strips
        Of one width and weight, the stiffest first.
    moment, yield_curvature
        M_0, N, and kappa_y, 1/m.
    say
        Called with a line on what is tried.

    Raises
    ------
    SolveError
        A path could not be followed.
    """
    # The one that needs most comes first: it decides about nearly all.
    stiffest, length, _ = strips[0]
    for strip in strips if length / stiffest.gravity_length > SHORT else reversed(strips):
        say(f"r-path, friction with eta_b = {strip[0].eta_b:.4g}")
        if not holds(strip, moment, yield_curvature):
            return strip
    return None


def estimate(length: float, uncertainty: float) -> float:
    """Estimate M_0 with which a strip follows an R-path, rho_a g L*^2.

    ``length``: in L*.  ``uncertainty``: of eta_b, relative.
    """
    return max(EXACT, UNCERTAIN * length**1.5 * sqrt(uncertainty))


def holds(strip: Followed, moment: float, yield_curvature: float | None) -> bool:
    """Whether a strip is followed to its first touch: from there on its layer is laid down.

    Raises
    ------
    SolveError
        The path could not be followed.
    """
    material, length, path = strip
    unit = material.gravity_length
    kappa_y = YIELD_CURVATURE if yield_curvature is None else yield_curvature * unit
    effects = effects_of("hysteresis", moment / (material.force_scale * unit), kappa_y)
    model = StripModel(length / unit, material.relative_thickness, kind="rod")
    first = with_effects(from_flat(model.contact_mesh(REFINEMENT, memory=True), path, model.length), effects)
    places = chain.from_iterable(
        steps_on(replace(path, pieces=(piece,)), model.length, STEPS[piece.name]) for piece in path.pieces
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
