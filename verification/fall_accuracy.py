"""Accuracy of a fall versus run time: the first touch over models, meshes, time steps and integrators.

Every way finds its own critical state and falls from there, undamped; only the fall is timed.  All in units of L*,
sqrt(L*/g).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from stripfold.base.errors import SolveError
from stripfold.follow.fall import TIME_OPTIONS, Fall, ReleaseState, simulate_fall, to_critical_point
from stripfold.follow.statics import StripModel
from stripfold.follow.track import Track
from stripfold.solve.schemes import EnergyMomentum, Scheme
from verification.common import Progress, dataset, grid, timed
from verification.integrators import GeneralisedAlpha

UNITS = {"s": "seconds"}

SCHEMES: dict[str, Scheme] = {
    "energy-momentum": EnergyMomentum(),
    "energy-momentum, conserving": EnergyMomentum(dissipation=0.0),
    "generalised-alpha": GeneralisedAlpha(),
}
"""The integrators; the first is the one that is used.  Bathe's method needs a gripper at rest throughout."""


class Way(NamedTuple):
    """One way to follow a fall: model, factor on its element lengths, integrator, allowed error of a time step (L*)."""

    model: str
    refinement: float = 1.0
    scheme: str = "energy-momentum"
    tolerance: float = TIME_OPTIONS.tolerance


WAYS = (
    {"model": "rod", "refinement": 2.0},
    {"model": "rod", "tolerance": 0.0001},
    {"model": "rod"},
    {"model": "rod", "tolerance": 1e-06},
    {"model": "rod", "refinement": 0.5},
    {"model": "rod", "refinement": 0.25},
    {"model": "rod", "scheme": "energy-momentum, conserving"},
    {"model": "rod", "scheme": "generalised-alpha"},
    {"model": "rod", "scheme": "generalised-alpha", "tolerance": 1e-06},
    {"model": "solid", "refinement": 2.0},
    {"model": "solid", "tolerance": 0.0001},
    {"model": "solid"},
    {"model": "solid", "refinement": 0.5},
)
REFERENCE = (
    {"model": "solid", "refinement": 0.25, "tolerance": 1e-06},
    {"model": "solid", "refinement": 0.5, "tolerance": 1e-06},
)


def run(
    length_star: float = 20.0,
    thickness: float = 0.0594,
    heights: Sequence[float] = (2.0, 3.0, 5.0),
    disturbance: float = 0.01,
    ways: Sequence[Mapping[str, Any]] = WAYS,
    reference: Sequence[Mapping[str, Any]] = REFERENCE,
    repeats: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Errors and times of all ways at all heights.

    ``length_star``, ``thickness``: of the strip, L*.  ``heights``: gripper heights that snap, L*, shape (n,).
    ``disturbance``: as in :class:`.Fall`, sqrt(g L*).  ``ways``: fields of :class:`Way`, each.  ``reference``: two
    more: the reference, and a cheaper one that estimates its error.  ``repeats``: falls of which the median time is
    taken.

    Over ``way`` and ``gripper_height``: numbers, and in ``no_result`` why there are none.
    """
    all_ways = [Way(**given) for given in ways]
    best, check = (Way(**given) for given in reference)
    fall = Fall(disturbance, to_rest=False)

    @cache
    def release(model: str, refinement: float, height: float) -> ReleaseState:
        strip = StripModel(length_star, thickness, kind=model)
        return ReleaseState.at(to_critical_point(strip, height, refinement).last, refinement)

    def followed(way: Way, height: float) -> Track:
        """The fall, from the model's critical state, which is found once."""
        options = replace(TIME_OPTIONS, tolerance=way.tolerance)
        start = release(way.model, way.refinement, height)
        motion = simulate_fall(start, fall, options, scheme=SCHEMES[way.scheme])
        if motion.touch is None:
            raise SolveError("the strip came to rest without touching")
        return motion

    truth = cache(partial(followed, best))

    def of_reference(height: float) -> dict[str, float]:
        finest, checked = truth(height), followed(check, height)
        uncertain = abs(checked.touch_x - finest.touch_x)
        return {"reference": finest.touch_x, "reference_time": finest.moments[-1].t, "uncertain": uncertain}

    def of_way(i: int, height: float) -> dict[str, float]:
        way, finest = all_ways[i], truth(height)
        # Found before the clock starts; the reference has compiled the kernels.
        release(way.model, way.refinement, height)
        seconds, motion = timed(partial(followed, way, height), repeats, first=False)
        lam, lambda_c = (release(one.model, one.refinement, height).point.lam for one in (way, best))
        return {
            "error": motion.touch_x - finest.touch_x,
            "time_error": motion.moments[-1].t - finest.moments[-1].t,
            "lambda_error": lam - lambda_c,
            "seconds": float(np.median(seconds)),
            "steps": len(motion.states) - 1.0,
        }

    known = grid(of_reference, ("reference", "reference_time", "uncertain"), {"gripper_height": heights}, 1, progress)
    names = ("error", "time_error", "lambda_error", "seconds", "steps")
    values = {**known, **grid(of_way, names, {"way": range(len(ways)), "gripper_height": heights}, 1, progress)}
    del values["way"]
    values |= {field: ("way", [getattr(way, field) for way in all_ways]) for field in Way._fields}
    attrs = {"length_star": length_star, "thickness_star": thickness, "disturbance": disturbance, "repeats": repeats}
    return dataset(values, attrs, units=UNITS)
