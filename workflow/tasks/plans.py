"""The paper's three paths and the states they assume, as a dataset in SI for the figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.files import schema
from stripfold.paths.curve import GripperPath
from stripfold.paths.geometric import circular, triangular
from stripfold.paths.rpath import RPath, plan_r_path
from tasks.assess_data import PATHS

if TYPE_CHECKING:
    import xarray as xr

PLACES = 201
"""Gripper places on each path: as many segments on each of its pieces, so that every corner is among them."""
NODES = 401


def dataset(material: Material, length: float) -> xr.Dataset:
    """Gripper paths and assumed states over ``path``, ``place`` and ``node``; node 0 is the gripper's.

    Triangular: the strip hangs straight down from the gripper, no stiffness, and nothing slides.  Circular: two rigid
    halves with a hinge.  R-path: the elastica's states.  The first state is the flat strip, the R-path's last one the
    folded strip.

    ``material``, ``length``: the strip; m.  Raises InvalidInputError, SolveError: as in :func:`.plan_r_path`.
    """
    unit = material.gravity_length
    long = length / unit
    plan = plan_r_path(long)
    s = np.linspace(0.0, long, NODES)
    paths = {"r-path": plan.path, "triangular": triangular(long), "circular": circular(long)}
    travelled = np.array([_places(paths[name]) for name in PATHS])
    times = np.array([[paths[name].pseudo_time(t) for t in row] for name, row in zip(PATHS, travelled, strict=True)])
    states = np.array(
        [[assumed(name, plan, long, t, s) for t in row] for name, row in zip(PATHS, travelled, strict=True)]
    )
    on = ("path", "place")
    values = {
        "travelled": (on, travelled),
        "pseudo_time": (on, times),
        "x": ((*on, "node"), states[..., 0]),
        "z": ((*on, "node"), states[..., 1]),
        "arc": ("node", s),
        "path": ("path", PATHS),
    }
    attrs = {
        **material.attributes,
        "length": length,
        "lying_length": unit * plan.lying_length,
        "planned_touch_x": unit * plan.first_touch,
        "landing_x": unit * plan.landing,
    }
    return schema.dataset(values, attrs, material.scales)


def _places(path: GripperPath) -> Array:
    """Lengths travelled, L*: evenly spaced on each piece."""
    count = (PLACES - 1) // len(path.pieces)
    return np.concatenate([[0.0], *(np.linspace(piece.start, piece.end, count + 1)[1:] for piece in path.pieces)])


def assumed(name: str, plan: RPath, length: float, travelled: float, s: Array) -> Array:
    """Assumed places (x, z), shape (n, 2), of the distances ``s``, shape (n,), from the grasped end; L*."""
    if name == "r-path":
        return plan.mid_surface(travelled, s)
    flat = np.stack([s - length / 2.0, np.zeros_like(s)], axis=1)
    upper = s < length / 2.0
    if name == "circular":
        angle = travelled / (length / 2.0)
        arm = length / 2.0 - s
        turned = np.stack([-arm * np.cos(angle), arm * np.sin(angle)], axis=1)
        return np.where(upper[:, None], turned, flat)
    x, z = triangular(length).position(travelled)
    # The hanging part is as long as the gripper is high; the rest lies flat, or on the lower layer past the fold line.
    hanging = np.stack([np.full_like(s, x), np.maximum(z - s, 0.0)], axis=1)
    folded = np.stack([np.minimum(length / 2.0 - s, x), np.maximum(z - s, 0.0)], axis=1)
    return np.where(((s < z) if x <= 0.0 else upper)[:, None], hanging if x <= 0.0 else folded, flat)
