"""Facts about the energy barrier and knocks, the eigenvalues, the explorer and the variants of the model."""

from __future__ import annotations

import numpy as np
import xarray as xr

from studies.summary.facts import Facts, seed_of

NEAREST, FARTHEST = 1e-6, 3e-3
"""Distances from the critical point between which the exponent of the eigenvalue is taken, L*."""
SHOWN = 3.0
"""Height whose numbers are quoted, L*."""


def barrier(d: xr.Dataset) -> Facts:
    """The law near the fold, its coefficient by several ways, and the end of the bistable range."""
    one = d.sel(gripper_height=SHOWN)
    least = d.distance.values.argmin()
    law = d.coefficient * d.distance**1.5
    models = d.model_coefficient.sel(gripper_height=SHOWN) / one.coefficient - 1.0
    return {
        "z": SHOWN,
        "measured": one.barrier[least] / one.distance[least] ** 1.5,
        "normal": one.coefficient,
        "apart": np.abs(one.barrier / law.sel(gripper_height=SHOWN) - 1.0)[least],
        "curved": np.abs(d.barrier / law - 1.0).max(),
        "work": np.abs(d.work / d.barrier - 1.0).max(),
        "rod": models.sel(model="rod"),
        "solid": models.sel(model="solid"),
        "models": np.abs(models).max(),
        "lowest": d.coefficient.min(),
        "highest": d.coefficient.max(),
        "width": one.width,
        "largest": one.largest,
        "speed": one.speed,
        "first_width": d.width[0],
        "last_width": d.width[-1],
        "first_z": d.gripper_height[0],
        "last_z": d.gripper_height[-1],
    }


def second_gripper(d: xr.Dataset) -> Facts:
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


def stability_map(d: xr.Dataset) -> Facts:
    """How far the boundaries are from states found alone and from the rod's, and the time of the whole."""
    apart = np.abs(d.rod / d.elastica - 1.0).max("rod_height").sortby("thickness")
    thin, thick = apart[0], apart[-1]
    return {
        "error": d.error.max(),
        "states": d.error.size,
        "seed": seed_of(d),
        "lengths": d.sizes["length"],
        "wall": d.wall.median(),
        "rod": thin,
        "thin": thin.thickness,
        "order": np.log(thick / thin) / np.log(thick.thickness / thin.thickness),
    }


def eigenvalues(d: xr.Dataset) -> Facts:
    """How far the eigenvalue goes down, its exponent at the snaps, and the distance to the second one."""
    rest, exponents = [], {}
    for motion in d.motion.values:
        one = d.sel(motion=motion).dropna("step", subset=["distance"])
        distance, first = one.distance.values, one.eigenvalue_1.values
        rest.append(abs(first[-1]) / one.eigenvalue_2.values[-1])
        near = (distance > NEAREST) & (distance < FARTHEST)
        exponents[motion] = np.polyfit(np.log(distance[near]), np.log(first[near]), 1)[0]
    snaps = [value for motion, value in exponents.items() if motion != "r-path"]
    return {
        "rest": max(rest),
        "snap": max(snaps, key=lambda value: abs(value - 0.5)),
        "off": max(abs(value - 0.5) for value in snaps),
        "motions": len(exponents),
    }


def explorer(d: xr.Dataset) -> Facts:
    """What the explorer's page draws against the solver, and its size."""
    return {
        "error": d.error.max(),
        "places": d.sizes["place"],
        "seed": seed_of(d),
        "bytes": d.bytes,
        "warns": d.warns,
        "falls": d.attrs["falls"],
        "keyboard": d.keyboard,
        "narrow": d.narrow,
    }


def variants(d: xr.Dataset) -> Facts:
    """Changes of the end of the advance by kind of variant."""
    names = d.variant.values.astype(str)
    shift = np.abs(d.lambda_end_shift.values)

    def of(*words: str) -> np.ndarray:
        return np.array([any(word in name for word in words) for name in names])

    def largest(*words: str) -> float:
        return float(np.nanmax(shift[of(*words)]))

    clamped = of("clamps") & np.isfinite(shift)
    return {
        "count": (d.base.values != "").sum(),
        "z": d.attrs["height"],
        "poisson": float(np.nanmax(shift[of("Poisson") & ~of("narrow")])),
        "stretch": largest("eta_m"),
        "narrow": largest("narrow"),
        "pin": largest("pin "),
        "clamp": largest("clamps"),
        "angles": clamped.sum(),
        "touching": (d.snap.values[clamped] == 0.0).sum(),
    }


def knocks(d: xr.Dataset) -> Facts:
    """The energy that makes a strip fall over the barrier, and where a strip comes to rest that was thrown down."""
    within = d.distance.values < d.attrs["width"]
    return {
        "z": d.attrs["height"],
        "threshold": np.sqrt(d.held * d.fell).max(),
        "held": d.held.min(),
        "fell": d.fell.max(),
        "back": d.away.values[~within].max(),
        "stays": d.away.values[within].min(),
        "touched": (d.touched == 1.0).all(),
    }
