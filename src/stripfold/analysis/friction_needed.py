"""The least friction moment with which strips of several eta_b follow one path.

A search on coarse elements; what is chosen by it is to be checked on finer ones.  Source: docs/plan.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

from stripfold.analysis.path_friction import effects_of, load_incrementally
from stripfold.analysis.static import StripModel
from stripfold.effects.hysteresis import YIELD_CURVATURE
from stripfold.errors import LostStabilityError
from stripfold.material import Material
from stripfold.paths.curve import GripperPath

Followed = tuple[Material, float, GripperPath]
"""A strip, its length, m, and the path in its L*."""
SPARE = 1.25
"""Friction that is there over what is needed, at least: the search is accurate to a tenth, M_0 seldom known better."""
NARROW = 1.15
"""Ratio of the bracket's ends at which the search ends."""
MOST, LEAST = 2.0, 1e-3
"""Largest and least M_0 tried, rho_a g L*^2: beyond those of fabrics."""
COARSE, STEP = 2.0, 0.25
"""Factor on the elements' lengths, and size of the steps, L*."""


@dataclass(frozen=True)
class Needed:
    """The least friction moment found to suffice, and the largest found not to, N."""

    moment: float
    fails: float


def needed(strips: Sequence[Followed], moment: float, yield_curvature: float | None) -> Needed | str:
    """The least M_0, N, with which all strips follow their paths, or why none was found.

    Parameters
    ----------
    strips
        Of one width and weight, the given one in the middle.
    moment, yield_curvature
        M_0 from which to search, N, and kappa_y, 1/m.

    Raises
    ------
    SolveError
        A path could not be followed.
    """
    order = list(strips)
    given, _, _ = strips[len(strips) // 2]
    scale = given.force_scale * given.gravity_length
    fails, suffices, tried = 0.0, 0.0, min(moment, MOST * scale)
    while True:
        if tried > MOST * scale:
            return f"no friction moment up to {fails:.3g} N holds the strip"
        # One that is lost is tried first next time: it is likely to decide again.
        lost = next((strip for strip in order if not _holds(strip, tried, yield_curvature)), None)
        if lost is None:
            suffices = tried
        else:
            fails = tried
            order.sort(key=lambda strip: strip is not lost)
        if suffices and (suffices <= NARROW * fails or suffices <= LEAST * scale):
            return Needed(suffices, fails)
        tried = 2.0 * tried if not suffices else tried / 2.0 if not fails else sqrt(fails * suffices)


def _holds(strip: Followed, moment: float, yield_curvature: float | None) -> bool:
    """Whether the strip is followed to its first touch: from there on its layer is laid down."""
    material, length, path = strip
    unit = material.gravity_length
    kappa_y = YIELD_CURVATURE if yield_curvature is None else yield_curvature * unit
    effects = effects_of("hysteresis", moment / (material.force_scale * unit), kappa_y)
    mesh = StripModel(length / unit, material.relative_thickness, kind="rod").contact_mesh(COARSE, memory=True)
    try:
        for step in load_incrementally(mesh, path, effects, STEP):
            if step.touches:
                return True
    except LostStabilityError:
        return False
    return True
