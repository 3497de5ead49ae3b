"""Where a strip lies on the floor, and the events that follow: the sag touches, the whole strip lifts off."""

from __future__ import annotations

import numpy as np

from stripfold.arrays import Array, Index
from stripfold.models.model import Model
from stripfold.solve.critical import is_past
from stripfold.solve.dynamics import TimeState
from stripfold.solve.events import Event, never
from stripfold.solve.problem import Point

APART = 1.0
"""Distance along the strip beyond which two contacts are not of one lying part, L*."""
LEAST_LYING = 0.5
"""Length of the lying part below which the whole strip is taken to lift off, L*."""
TOUCH_TOLERANCE = 1e-4
"""Arc length to which the first touch of the sag is located, L*."""


def columns_on_floor(model: Model, point: Point | TimeState) -> Index:
    """Numbers of the nodes on the floor, ascending; the held end counts as one."""
    on_floor = np.isin(model.middle[:, 1], point.active)
    on_floor[-1] = True
    return np.flatnonzero(on_floor)


def contact_positions(model: Model, point: Point | TimeState) -> Array:
    """Distances from the grasped end of the nodes on the floor, ascending."""
    return np.asarray(model.s[columns_on_floor(model, point)])


def lying_parts(model: Model, point: Point | TimeState, apart: float = APART) -> list[Index]:
    """The nodes on the floor, part by part: between two parts a node farther than ``apart`` from both is free."""
    columns = columns_on_floor(model, point)
    gaps = (np.diff(columns) > 1) & (np.diff(model.s[columns]) > apart)
    return np.split(columns, np.flatnonzero(gaps) + 1)


def touches(model: Model, point: Point | TimeState) -> bool:
    """Whether something beside the lying part is on the floor."""
    return len(lying_parts(model, point)) > 1


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


def touch(model: Model, located: bool = True) -> Event:
    """The event that the sag touches the floor; past a limit point it is never located."""

    def locate_from(point: Point) -> bool:
        return located and not is_past(point)

    return Event("touch of the sag", lambda point, _: touches(model, point), TOUCH_TOLERANCE, located=locate_from)


def whole_strip_lifts(model: Model) -> Event:
    """The event that nothing but the held end is left lying."""
    most = model.length - LEAST_LYING
    return Event("lift-off of the whole strip", lambda point, _: lift_off(model, point) > most, located=never)
