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
from verification.common import Progress, dataset, pooled
from verification.numbers import Facts, Number


def run(
    heights: Sequence[float] = (1.7, 5.0, 20.0),
    places: int = 20,
    distances: Sequence[float] = (0.02, 0.5),
    beyond: float = 17.0,
    thickness: float = 0.0594,
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
    return dataset(axes | values, {"beyond": beyond, "thickness": thickness})


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


def facts(d: xr.Dataset) -> Facts:
    """The place that the critical mode tells against the best of a scan, and against those that do not help."""
    best = np.fmax(d.gain.max("place"), d.chosen_gain)
    snaps = (d.gain < d.possible).where(d.gain.notnull(), 1.0)
    kept = (d.gain >= d.possible).sum("place")
    return {
        "still": (~(d.chosen_gain >= d.possible)).sum(),
        "heights": d.sizes["gripper_height"],
        "worst": (d.chosen_gain.fillna(0.0) / best).min(),
        "early": (d.early_gain.fillna(0.0) / best).min(),
        "earliest": d.distance.max(),
        "places": d.sizes["place"],
        "lowest_z": d.gripper_height.min(),
        "highest_z": d.gripper_height.max(),
        "lowest": d.chosen_up.min(),
        "highest": d.chosen_up.max(),
        "fewest": kept.min(),
        "most": kept.max(),
        "near": np.abs(d.s - d.chosen_s).where(snaps).min(),
        "without": (d.gain.where(snaps) / best).max(),
        "failed": d.gain.isnull().sum(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("second_gripper_snaps", "still", "count", "= 0, and >= 0.9 of the best of a scan, none failed",
            "strips that still snap with a second gripper at the place that moves most in the critical mode, of "
            "{heights} rods at heights of {lowest_z:g} to {highest_z:g} L*, followed until the gripper has gone as far "
            "as the strip is long; their gain is at least {worst:.2f} of the best of {places} places, {early:.2f} if "
            "they are taken up to {earliest:g} L* before lambda_c",
            lambda f: f.worst >= 0.9 and f.early >= 0.9 and f.places >= 20 and f.failed == 0),
        Number("second_gripper_places", "near", "L*", "no criterion",
            "distance along the strip from that place, {lowest:.2g} to {highest:.2g} L* above the floor, to the "
            "nearest of the scan that does not prevent the snap; {fewest} to {most} of {places} places do, the others "
            "gain up to {without:.0%} of it"),
    ),
}
# fmt: on
