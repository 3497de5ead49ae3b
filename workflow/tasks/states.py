"""States of a strip that follows a path, static or falling, as one dataset in SI for the figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.files import schema
from stripfold.follow.collapse import nodes
from stripfold.follow.path_statics import StaticSegment
from stripfold.follow.release import Motion
from stripfold.paths.curve import GripperPath
from stripfold.solve.dynamics import TimeState
from stripfold.solve.problem import Point
from stripfold.strip.problem import StripProblem

if TYPE_CHECKING:
    import xarray as xr

STATIC, FALL = PHASES = "static", "fall"
"""Values of ``phase``."""
MAX_STATES = 60
"""States kept of one fall; the strip's way between two neighbours is about the same."""


@dataclass(frozen=True, eq=False)
class Row:
    """One state, its problem, and the part of the motion (0, 1, ...) it belongs to."""

    state: Point | TimeState
    problem: StripProblem
    part: int


def rows_of_segment(segment: StaticSegment, part: int) -> list[Row]:
    """The static states of a segment."""
    return [Row(point, problem, part) for problem, point in segment.states]


def rows_of_motion(motion: Motion, part: int) -> list[Row]:
    """States of a fall, the first, the touch and the last among them."""
    states, problem = motion.states, motion.problem
    moved = [problem.model.largest_move(a.q, b.q) for a, b in pairwise(states)]
    way = np.concatenate([[0.0], np.cumsum(moved)])
    kept = set(np.searchsorted(way, np.linspace(0.0, way[-1], MAX_STATES)).tolist()) | {0, len(states) - 1}
    if motion.touch is not None:
        kept.add(motion.touch)
    return [Row(states[i], problem, part) for i in sorted(kept)]


def dataset(rows: Sequence[Row], path: GripperPath, material: Material) -> xr.Dataset:
    """All rows over ``state`` and ``node``; energies and forces per metre of width.

    The states have their own meshes; they are stored at equal distances 0.1 L* or less along the strip.
    Forces are those of the gripper and of the held end on the strip; in a fall they are nan.
    """
    length = rows[0].problem.model.length
    arc = nodes(length)
    middle = np.array([row.problem.model.resampled_mid_surface(row.state.q, arc) for row in rows])
    residual = [row.problem.residual(row.state.q, row.state.lam) for row in rows]
    still = np.array([isinstance(row.state, Point) for row in rows])

    def static(values: Sequence[float] | Array) -> Array:
        return np.where(still, np.asarray(values, dtype=np.float64), np.nan)

    def of_point(get: Callable[[Point], float]) -> Array:
        return np.array([get(row.state) if isinstance(row.state, Point) else np.nan for row in rows], dtype=float)

    grip = np.array([r[row.problem.model.middle[0]] for row, r in zip(rows, residual, strict=True)])
    held = [r[row.problem.model.middle[-1, 0]] for row, r in zip(rows, residual, strict=True)]
    columns = {
        "travelled": np.array([row.state.lam for row in rows]),
        "pseudo_time": np.array([path.pseudo_time(row.state.lam) for row in rows]),
        "part": np.array([row.part for row in rows]),
        "time": np.array([row.state.t if isinstance(row.state, TimeState) else np.nan for row in rows]),
        "gripper_x": middle[:, 0, 0],
        "gripper_z": middle[:, 0, 1],
        "force_x": static(grip[:, 0]),
        "force_z": static(grip[:, 1]),
        "hold_x": static(held),
        "eigenvalue": of_point(lambda point: float(point.eigenvalues[0])),
        "negatives": of_point(lambda point: point.negatives),
    }
    axes = ("state", "node")
    return schema.dataset(
        {
            **{name: ("state", values) for name, values in columns.items()},
            **{"x": (axes, middle[..., 0]), "z": (axes, middle[..., 1]), "arc": ("node", arc)},
            "phase": ("state", np.where(still, STATIC, FALL)),
        },
        material.attributes,
        material.scales,
    )
