"""Accuracy of a fall versus run time: the first touch over models, meshes, time steps and integrators.

Every way finds its own critical state and falls from there, undamped; only the fall is timed.  All in units of L*,
sqrt(L*/g).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from stripfold.analysis.collapse import release_of, to_critical_point
from stripfold.analysis.release import TIME_OPTIONS, Fall, Motion, ReleaseState, simulate_fall
from stripfold.analysis.static import StripModel
from stripfold.errors import SolveError
from stripfold.solve.schemes import EnergyMomentum, Scheme
from studies.common import Progress, blank, dataset, timed
from studies.integrators import GeneralisedAlpha

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


def run(
    length_star: float,
    thickness: float,
    heights: Sequence[float],
    disturbance: float,
    ways: Sequence[Mapping[str, Any]],
    reference: Sequence[Mapping[str, Any]],
    repeats: int,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Errors and times of all ways at all heights.

    Parameters
    ----------
    length_star, thickness
        Of the strip, L*.
    heights
        Gripper heights that snap, L*, shape (n,).
    disturbance
        As in :class:`.Fall`, sqrt(g L*).
    ways
        Fields of :class:`Way`, each.
    reference
        Two more: the reference, and a cheaper one that estimates its error.
    repeats
        Falls after an uncounted one of which the median time is taken.

    Raises
    ------
    SolveError
        When the reference fails.  A way that fails has nan and its error's message.
    """
    say = progress or (lambda _: None)
    all_ways = [Way(**given) for given in ways]
    truth, check = (Way(**given) for given in reference)
    fall = Fall(disturbance, to_rest=False)
    shape = (len(all_ways), len(heights))
    columns = {name: blank(*shape) for name in ("error", "time_error", "lambda_error", "seconds", "steps")}
    message = np.full(shape, "", dtype=object)
    known = {name: np.empty(len(heights)) for name in ("reference", "uncertain", "reference_time")}
    for j, height in enumerate(heights):
        releases: dict[tuple[str, float], ReleaseState] = {}

        def followed(way: Way, height: float = height, releases: dict[Any, ReleaseState] = releases) -> Motion:
            """The fall, from the model's critical state, which is found once."""
            key = way.model, way.refinement
            if key not in releases:
                strip = StripModel(length_star, thickness, kind=way.model)
                releases[key] = release_of(to_critical_point(strip, height, way.refinement), way.refinement)
            options = replace(TIME_OPTIONS, tolerance=way.tolerance)
            motion = simulate_fall(releases[key], fall, options, scheme=SCHEMES[way.scheme])
            if motion.touch is None:
                raise SolveError("the strip came to rest without touching")
            return motion

        finest, checked = followed(truth), followed(check)
        t, lambda_c = finest.states[-1].t, releases[truth.model, truth.refinement].point.lam
        known["reference"][j], known["reference_time"][j] = finest.touch_x, t
        known["uncertain"][j] = abs(checked.touch_x - finest.touch_x)
        say(f"z = {height:g} L*: touch at {finest.touch_x:.5f}, {t:.4f}; uncertain by {known['uncertain'][j]:.1e}")
        for i, way in enumerate(all_ways):
            try:
                seconds, motion = timed(partial(followed, way), repeats)
            except SolveError as error:
                message[i, j] = str(error)
                say(f"{way}: {error}")
                continue
            columns["error"][i, j] = motion.touch_x - finest.touch_x
            columns["time_error"][i, j] = motion.states[-1].t - t
            columns["lambda_error"][i, j] = releases[way.model, way.refinement].point.lam - lambda_c
            columns["seconds"][i, j] = np.median(seconds)
            columns["steps"][i, j] = len(motion.states) - 1
            say(f"{way}: {columns['error'][i, j]:.1e}, {columns['seconds'][i, j]:.2f} s")
    both = ("way", "height")
    return dataset(
        "fall_accuracy",
        {
            "height": ("height", heights),
            **{name: (both, values) for name, values in columns.items()},
            **{name: ("height", values) for name, values in known.items()},
            "message": (both, message),
            **{field: ("way", [getattr(way, field) for way in all_ways]) for field in Way._fields},
        },
        {"length_star": length_star, "thickness_star": thickness, "disturbance": disturbance, "repeats": repeats},
    )
