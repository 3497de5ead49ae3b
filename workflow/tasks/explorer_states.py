"""States of a long strip on grids of gripper positions, for tables from which any state is interpolated.

The shape of each part off the floor is given by the angles at the nodes of one grid and the part's length, so that
shapes can be interpolated and are inextensible all the same.  All in units of L*.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold.base.arrays import Array
from stripfold.elastica._chebyshev import grid, resample
from stripfold.elastica._continuation import SNAP, TOUCH, Point, at_height, to_event
from stripfold.elastica._system import FORCE_X
from stripfold.elastica.branch import checked_height, points
from stripfold.elastica.critical_point import touch_limit
from stripfold.elastica.half_fold import PointContact, states_no_horizontal_force, states_point_contact
from stripfold.elastica.state import State

NODES = 48
"""Angles by which a part is given."""
TAUT = 30.0
"""Horizontal force at the first state of a height, rho_a g L*: the strip is pulled nearly straight."""
MAX_STEP = 0.03
"""Of the branch in arc length: by cubic splines between its points lambda is accurate to 2e-7."""


@dataclass(frozen=True)
class Row:
    """States at one height, in the order of growing advance.

    ``advance``: shape (n,).  ``lengths``: shape (n, parts): lengths of the parts off the floor, from the held to the
    grasped end.  ``angles``: shape (n, parts, :data:`NODES`): their angles at ``grid(NODES).nodes`` times the length,
    counted from the lower end, rad; the X axis points from the lying part to the free one.
    """

    advance: Array
    lengths: Array
    angles: Array


def free_states(z: float, count: int) -> Row:
    """States of a free part at one height, equally spaced along the branch, from a taut strip to the branch's end.

    The end is the maximum of the advance or, below :func:`touch_limit`, the touch of the sag.

    Raises InvalidInputError, ContinuationError: ``z`` outside 0.1 to 100 L*; the branch could not be followed.
    """
    z = checked_height(z)
    event, family = (SNAP if z > touch_limit() else TOUCH), at_height(z)
    branch = to_event(points(z, MAX_STEP), family, event)
    pulled: list[Point] = []
    for point in points(z, 3.0 * MAX_STEP, way=-1.0):
        pulled.append(point)
        if point.e.y[FORCE_X] > TAUT:
            break
    arcs = np.array([*(-point.arc for point in pulled[:0:-1]), *(point.arc for point in branch)])
    states = [State._from(point.e) for point in [*pulled[:0:-1], *branch]]
    return _row(arcs, [(state,) for state in states], [state.advance for state in states], count)


def contact_states(z: float, count: int) -> Row:
    """States with the sag on the lower layer in one point at one height: from the touch to an interval of contact.

    Two parts: the loop, and what is between the contact and the gripper, whose angles are in the loop's frame.

    Raises InvalidInputError, SolveError: ``z`` outside 0.1 to 60 L*; a state was not found.
    """
    z = checked_height(z)
    first = State._from(to_event(points(z), at_height(z), TOUCH)[-1].e)
    found: list[PointContact] = list(states_point_contact(first, z))
    advances = [one.loop.length + one.upper.length - one.gripper[0] for one in found]
    return _row(np.linspace(0.0, 1.0, len(found)), [(one.loop, one.upper) for one in found], advances, count)


def lifted_states(length: float) -> tuple[Array, Array, Array]:
    """States without horizontal force, the free length growing to ``length``: heights, lengths, angles (n, NODES)."""
    states = [*states_no_horizontal_force(length)]
    heights, lengths = (np.array(values) for values in zip(*((s.gripper[1], s.length) for s in states), strict=True))
    return heights, lengths, np.array([resample(state.theta, NODES) for state in states])


def nodes_and_integral() -> tuple[Array, Array]:
    """The nodes of a part as shares of its length, and the matrix from values there to the integrals up to them."""
    nodes = grid(NODES)
    return nodes.nodes, nodes.integral


def _row(places: Array, parts: list[tuple[State, ...]], advances: list[float], count: int) -> Row:
    """Interpolated at equally spaced places."""
    from scipy.interpolate import CubicSpline

    lengths = np.array([[part.length for part in state] for state in parts])
    angles = np.array([[resample(part.theta, NODES) for part in state] for state in parts])
    at = np.linspace(places[0], places[-1], count)

    def spline(values: Array) -> Array:
        return np.asarray(CubicSpline(places, values)(at))

    return Row(spline(np.array(advances)), spline(lengths), spline(angles))
