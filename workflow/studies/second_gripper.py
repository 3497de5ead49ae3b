"""A second gripper: the place that the critical mode tells against a scan of places along the strip, on the rod.

A strip counts as stable to the end where its gripper has gone as far as it is long.  Lengths in L*.
Source: docs/second-gripper.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from stripfold.ask.second_gripper import Unheld, before_snap, hold, stable_advance
from stripfold.base.errors import SolveError
from stripfold.follow.statics import StripModel
from studies.common import Progress, dataset, pooled


def run(
    heights: Sequence[float],
    places: int,
    distances: Sequence[float],
    beyond: float,
    thickness: float,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Gains of lambda by the place that the mode tells, and by others.

    ``heights``: above the touch limit.  ``places``: number of places at equal distances between the gripper and the
    lift-off.  ``distances``: from lambda_c, at which the strip is taken at the mode's place; the scan is at the
    command's distance.  ``beyond``, ``thickness``: length of the strip less the height, and its thickness.

    Dataset over ``gripper_height`` and ``place`` or ``distance``; nan where a strip could not be followed.
    """
    case = partial(_case, places=places, distances=distances, beyond=beyond, thickness=thickness)
    rows = pooled(case, heights, threads, progress)
    dims = {"s": "place", "up": "place", "gain": "place", "early_gain": "distance"}
    values: dict[str, Any] = {name: ("gripper_height", [row[name] for row in rows]) for name in rows[0].keys() - dims}
    values |= {name: (("gripper_height", dim), np.array([row[name] for row in rows])) for name, dim in dims.items()}
    axes = {"gripper_height": ("gripper_height", list(heights)), "distance": ("distance", list(distances))}
    return dataset("second_gripper", axes | values, {"beyond": beyond, "thickness": thickness})


def _case(height: float, places: int, distances: Sequence[float], beyond: float, thickness: float) -> dict[str, Any]:
    strip = StripModel(height + beyond, thickness, kind="rod")
    unheld = before_snap(strip, height)
    s = unheld.free_length * np.arange(1, places + 1) / (places + 1)
    chosen, *up = unheld.at.mid_surface(np.append(unheld.place, s))[:, 1]
    return {
        "lambda_c": unheld.lam,
        "possible": strip.length - unheld.lam,
        "chosen_s": unheld.place,
        "chosen_up": chosen,
        "chosen_gain": gain(unheld, unheld.place),
        "s": s,
        "up": up,
        "gain": [gain(unheld, place) for place in s],
        "early_gain": [gain(before_snap(strip, height, distance), unheld.place) for distance in distances],
    }


def gain(unheld: Unheld, s: float) -> float:
    """Advance up to which the strip is stable, at most its length, less lambda_c; nan where it cannot be followed."""
    try:
        return stable_advance(hold(unheld, s))[0] - unheld.lam
    except SolveError:
        return np.nan
