"""The R-path: the path that keeps the lying length of the folded state, planned on the heavy elastica.

Source: docs/physics.md, section 5.  Four phases: the strip is lifted without horizontal force until what lies is what
lies in the folded state; carried over with that length lying; rolled from the first touch to where it begins to lie
flat; laid down without horizontal force.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from stripfold import elastica
from stripfold.arrays import Array
from stripfold.elastica.half_fold import states_fixed_lift_off, states_no_horizontal_force
from stripfold.elastica.point_contact import PointContact, states_point_contact
from stripfold.elastica.state import State
from stripfold.errors import InvalidInputError
from stripfold.paths.curve import GripperPath, Piece, polygon_length
from stripfold.paths.geometric import circular, triangular

PHASES = ("lift", "carry", "roll", "lay")
LONGEST = 100.0
"""Longest strip for which the plan has been tested, L*."""


@dataclass(frozen=True, eq=False)
class PlannedState:
    """A state the plan assumes.

    Parameters
    ----------
    phase
        One of :data:`PHASES`.
    parts
        The parts off the floor, from the held to the grasped end, each with the place x of its lift-off and the
        direction of its X axis: -1 for the loop, +1 for the laid-down layer's end.
    gripper
        Place (x, z) of the gripper.
    length
        Length of the strip, L*.
    """

    phase: str
    parts: tuple[tuple[State | PointContact, float, float], ...]
    gripper: tuple[float, float]
    length: float

    @property
    def lying_length(self) -> float:
        """Length that lies from the held end to the first lift-off, L*."""
        return self.length / 2.0 - self.parts[0][1] if self.parts else self.length

    @property
    def force_x(self) -> float:
        """Horizontal force in the strip, positive for tension, rho_a g L*: what the held end carries."""
        if not self.parts:
            return 0.0
        part = self.parts[0][0]
        return part.loop.force_x if isinstance(part, PointContact) else part.force_x

    @property
    def first_integral_error(self) -> float:
        """Largest error of the first integral in its parts (:attr:`.State.first_integral_error`)."""
        parts = [part for part, _, _ in self.parts]
        states = [s for part in parts for s in ((part.loop, part.upper) if isinstance(part, PointContact) else (part,))]
        return max((state.first_integral_error for state in states), default=0.0)

    def at(self, s: Array) -> Array:
        """Places (x, z), shape (m, 2), of the distances ``s``, shape (m,), from the grasped end."""
        distance, places = self.mid_surface()
        return np.stack([np.interp(s, distance[::-1], places[::-1, i]) for i in range(2)], axis=1)

    def mid_surface(self, per_length: int = 20) -> tuple[Array, Array]:
        """Distances from the grasped end, descending, shape (n,), and places (x, z), shape (n, 2)."""
        half = self.length / 2.0
        from_held, places = [np.zeros(1)], [np.array([[half, 0.0]])]
        for part, place, way in self.parts:
            states = (part.loop, part.upper) if isinstance(part, PointContact) else (part,)
            for state in states:
                # What lies between two parts is straight.
                begin = from_held[-1][-1] + abs(place + way * state.x[0] - places[-1][-1, 0])
                profile = state.at(np.linspace(0.0, state.length, max(3, int(per_length * state.length))))
                from_held.append(begin + profile.s)
                places.append(np.stack([place + way * profile.x, profile.z], axis=1))
        from_held.append(np.array([self.length]))
        places.append(np.array([self.gripper]))
        return self.length - np.concatenate(from_held), np.concatenate(places)


@dataclass(frozen=True, eq=False)
class RPath:
    """A planned R-path.

    Parameters
    ----------
    path
        The gripper's path; its pieces are the phases.
    states
        The planned states, in order; ``travelled`` of the path at each.
    lying_length
        Length that lies from the end of the first phase on, L*.
    first_touch, landing
        x where the strip first touches, and where the folded state lands.
    """

    path: GripperPath
    states: tuple[PlannedState, ...]
    travelled: Array
    lying_length: float
    first_touch: float
    landing: float

    def mid_surface(self, travelled: float, s: Array) -> Array:
        """Planned places (x, z), shape (m, 2), of the distances ``s``, shape (m,), from the grasped end.

        Between two planned states the straight line, to 1e-3 L*.
        """
        after = int(np.clip(np.searchsorted(self.travelled, travelled), 1, len(self.states) - 1))
        begin, end = self.travelled[after - 1], self.travelled[after]
        share = (travelled - begin) / (end - begin) if end > begin else 0.0
        return (1.0 - share) * self.states[after - 1].at(s) + share * self.states[after].at(s)


def shortest_half_fold() -> float:
    """Length, L*, of the strip whose upper layer only just reaches the lower one."""
    loop = elastica.folded_loop()
    return loop.arc + loop.offset


@lru_cache(maxsize=4)
def plan_r_path(length: float) -> RPath:
    """Plan for a strip of the given length, L*.

    Raises
    ------
    InvalidInputError
        A strip too short to be folded in half, or longer than has been tested.
    SolveError
        A state was not found.

    Examples
    --------
    >>> plan = plan_r_path(20.0)
    >>> round(plan.lying_length, 6), round(plan.landing, 6)
    (8.900575, 3.584045)
    """
    loop = elastica.folded_loop()
    shortest = shortest_half_fold()
    if not shortest < length <= LONGEST:
        raise InvalidInputError(
            "length",
            length,
            f"more than {shortest:.6g} L* and at most {LONGEST:g} L*",
            "a shorter strip has no folded state with aligned edges",
        )
    half, free = length / 2.0, length - elastica.half_fold_lying_length(length)
    place = free - half

    def planned(phase: str, *parts: tuple[State | PointContact, float, float]) -> PlannedState:
        part, begin, way = parts[-1]
        x, z = part.gripper
        return PlannedState(phase, parts, (begin + way * x, z), length)

    lift = [PlannedState("lift", (), (-half, 0.0), length)]
    lift += [planned("lift", (state, state.length - half, -1.0)) for state in states_no_horizontal_force(free)]
    free_states = list(states_fixed_lift_off(free))
    carry = [planned("carry", (state, place, -1.0)) for state in free_states]
    roll = [planned("roll", (state, place, -1.0)) for state in states_point_contact(free_states[-1])]
    folded = (loop.state, place, -1.0)
    lay = [
        planned("lay", folded, (state, half - state.length, 1.0))
        for state in states_no_horizontal_force(free - loop.arc)
    ][::-1]
    # The first state of a phase is the last of the one before; the shortest free parts are left out.
    lay = [replace(roll[-1], phase="lay"), *lay[1:], PlannedState("lay", (folded,), (half, 0.0), length)]
    pieces: list[Piece] = []
    travelled: list[Array] = []
    for phase, states in zip(PHASES, (lift, carry, roll, lay), strict=True):
        points, start = np.array([state.gripper for state in states]), pieces[-1].end if pieces else 0.0
        pieces.append(Piece.through(points, start, phase))
        travelled.append(polygon_length(points, start))
    touch = carry[-1].gripper[0] + free_states[-1].gripper[0] - free_states[-1].at(_sag(free_states[-1])).x
    at_states = np.concatenate(travelled)
    at_states.flags.writeable = False  # the plan is kept for the next who asks
    return RPath(
        GripperPath("r-path", tuple(pieces)),
        (*lift, *carry, *roll, *lay),
        at_states,
        half - place,
        float(touch),
        place + loop.offset,
    )


def _sag(state: State) -> float:
    assert state.sag is not None  # the last state that is carried touches with its sag
    return state.sag.s


def path_of(name: str, length: float) -> GripperPath:
    """One of the paper's paths for a strip of this length, L*.

    Raises
    ------
    InvalidInputError
        A length that does not allow it.
    """
    if name == "r-path":
        return plan_r_path(length).path
    return {"triangular": triangular, "circular": circular}[name](length)
