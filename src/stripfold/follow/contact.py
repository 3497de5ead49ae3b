"""Where a strip with contact at its nodes lies on the floor."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from stripfold.base.arrays import Index, Mask
from stripfold.solve.dynamics import TimeState
from stripfold.solve.problem import Point
from stripfold.strip.model import Model

APART = 1.0
"""Distance along the strip beyond which two contacts are not of one lying part, L*."""
RUCK = 0.1
"""Height of a ruck, L*."""


def columns_on_floor(model: Model, point: Point | TimeState) -> Index:
    """Numbers of the nodes on the floor, ascending; the held end counts as one."""
    is_active = np.zeros(model.size, dtype=bool)
    is_active[point.active] = True
    on_floor = is_active[model.middle[:, 1]]
    on_floor[-1] = True
    return np.flatnonzero(on_floor)


def _are_apart(model: Model, columns: Index, apart: float = APART) -> Mask:
    """Whether there is a free part between neighbours on the floor, shape (len(columns) - 1,)."""
    return (np.diff(columns) > 1) & (np.diff(model.s[columns]) > apart)


def lying_parts(model: Model, point: Point | TimeState, apart: float = APART) -> list[Index]:
    """The nodes on the floor, part by part: between two parts a node farther than ``apart`` from both is free."""
    columns = columns_on_floor(model, point)
    return np.split(columns, np.flatnonzero(_are_apart(model, columns, apart)) + 1)


def lies_apart(model: Model, point: Point | TimeState) -> bool:
    """Whether a part lies apart from the one that ends at the held end, on it or in front of it.

    So ends the fall of a strip that was lifted: one that is tossed may land in front of what lies.
    """
    return bool(_are_apart(model, columns_on_floor(model, point)).any())


def touches(model: Model, point: Point | TimeState) -> bool:
    """Whether a part lies on the one that ends at the held end.

    A part in front of that is a strip not lifted yet, or one bent by friction beside its lift-off.
    """
    first, *more = lying_parts(model, point)
    if not more:
        return False
    x = model.mid_surface(point.q)[:, 0]
    return bool(x[first[-1]] > x[more[-1][0]])


def has_ruck(model: Model, point: Point | TimeState) -> bool:
    """Whether what lies has risen between its ends to more than :data:`RUCK`."""
    x, z = model.mid_surface(point.q).T
    parts = lying_parts(model, point)
    return any(x[a[-1]] < x[b[0]] and z[a[-1] : b[0]].max() > RUCK for a, b in pairwise(parts))


def lift_off(model: Model, point: Point | TimeState) -> float:
    """Distance along the strip from the grasped end to where the lying part begins, L*."""
    return float(model.s[lying_parts(model, point)[-1][0]])


def touch_position(model: Model, state: TimeState | Point) -> float:
    """x of the touch, origin mid-strip: the lowest point of a parabola through three nodes, L*."""
    column = int(lying_parts(model, state)[0][-1])
    near = slice(max(column - 1, 0), column + 2)
    position = model.mid_surface(state.q)[near]
    local = model.s[near] - model.s[column]
    curve, slope, _ = np.polyfit(local, position[:, 1], 2)
    lowest = float(np.clip(-slope / (2.0 * curve), local[0], local[-1])) if curve > 0.0 else 0.0
    return float(np.polyval(np.polyfit(local, position[:, 0], 2), lowest))
