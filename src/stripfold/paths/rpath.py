"""The R-path: the gripper path that keeps the lying length of the folded state, planned on the heavy elastica.

Four phases (docs/physics.md, section 9): *lift* without horizontal force until the lying length is that of the folded
state; *carry* over with the lift-off point fixed, up to first contact of the sag; *roll* of the contact point until the
strip begins to lie flat there; *lay* down without horizontal force.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.elastica.half_fold import states_fixed_lift_off, states_no_horizontal_force, states_point_contact
from stripfold.elastica.state import State
from stripfold.paths.curve import GripperPath, pieces_through

LEAST_LAID = 0.1
"""Least length of a fold's upper layer that lies, L*: with less, the gripper is as low as the sag when that touches."""
LONGEST = 100.0
"""Longest strip for which the plan has been tested, L*."""


class Part(NamedTuple):
    """A part of the strip off the floor: its state, the x of the state's origin, the direction of its X axis."""

    state: State
    x: float
    direction: float


@dataclass(frozen=True, eq=False)
class PlannedState:
    """A state of the plan.

    ``parts``: the parts off the floor, from the held to the grasped end; ``gripper``: position (x, z) of the gripper;
    ``length``: length of the strip, L*.
    """

    parts: tuple[Part, ...]
    gripper: tuple[float, float]
    length: float

    @classmethod
    def of(cls, length: float, *parts: Part) -> PlannedState:
        """A state with at least one part off the floor."""
        last = parts[-1]
        x, z = last.state.gripper
        return cls(parts, (last.x + last.direction * x, z), length)

    @property
    def lying_length(self) -> float:
        """Length that lies from the held end to the first lift-off, L*."""
        return self.length / 2.0 - self.parts[0].x if self.parts else self.length

    @property
    def force_x(self) -> float:
        """Horizontal force in the strip and at the held end, positive for tension, rho_a g L*."""
        return self.parts[0].state.force_x if self.parts else 0.0

    @property
    def angle(self) -> float:
        """Rotation of the gripper with the end of the strip, rad: 0 on the flat strip, pi on the folded one."""
        if not self.parts:
            return 0.0
        *_, (state, _, direction) = self.parts
        end = float(state.theta[-1])
        return end if direction < 0.0 else np.pi - end

    @property
    def first_integral_error(self) -> float:
        """Largest error of the first integral in its parts (:attr:`.State.first_integral_error`)."""
        return max((part.state.first_integral_error for part in self.parts), default=0.0)

    def at(self, s: Array) -> Array:
        """Positions (x, z), shape (m, 2), at the distances ``s``, shape (m,), from the grasped end."""
        distance, positions = self.mid_surface()
        return np.stack([np.interp(s, distance[::-1], positions[::-1, i]) for i in range(2)], axis=1)

    def mid_surface(self, per_length: int = 20) -> tuple[Array, Array]:
        """Distances from the grasped end, descending, shape (n,), and positions (x, z), shape (n, 2)."""
        from_held, positions = [np.zeros(1)], [np.array([[self.length / 2.0, 0.0]])]
        for state, x, direction in self.parts:
            # The strip is straight between two parts.
            begin = from_held[-1][-1] + abs(x + direction * state.x[0] - positions[-1][-1, 0])
            profile = state.at(np.linspace(0.0, state.length, max(3, int(per_length * state.length))))
            from_held.append(begin + profile.s)
            positions.append(np.stack([x + direction * profile.x, profile.z], axis=1))
        from_held.append(np.array([self.length]))
        positions.append(np.array([self.gripper]))
        return self.length - np.concatenate(from_held), np.concatenate(positions)


@dataclass(frozen=True, eq=False)
class HalfFold:
    """The accurate half fold of a strip, and where its sag first touches on the way there; lengths in L*.

    ``folded``: the folded state; ``lying_length``: length that lies in it, from the held end to the lift-off;
    ``first_touch``, ``landing``: x of the first contact of layers, and of the landing point of the folded state;
    ``free``: states with this lying length and the sag off the lower layer, from the one without horizontal force to
    the first touch.
    """

    folded: PlannedState
    lying_length: float
    first_touch: float
    landing: float
    free: tuple[State, ...]


@dataclass(frozen=True, eq=False)
class RPath(HalfFold):
    """A planned R-path to a half fold.

    ``path``: the gripper's path; its pieces are the phases.  ``states``, ``travelled``: the planned states, in order,
    and the length travelled at each.
    """

    path: GripperPath
    states: tuple[PlannedState, ...]
    travelled: Array

    def mid_surface(self, travelled: float, s: Array) -> Array:
        """Planned positions (x, z), shape (m, 2), at the distances ``s``, shape (m,), from the grasped end.

        Linear interpolation between planned states, accurate to 1e-3 L*.
        """
        after = int(np.clip(np.searchsorted(self.travelled, travelled), 1, len(self.states) - 1))
        begin, end = self.travelled[after - 1], self.travelled[after]
        share = (travelled - begin) / (end - begin) if end > begin else 0.0
        return (1.0 - share) * self.states[after - 1].at(s) + share * self.states[after].at(s)


def shortest_half_fold() -> float:
    """Length, L*, of the strip of whose upper layer :data:`LEAST_LAID` lies on the lower one."""
    loop = elastica.folded_loop()
    return loop.arc + loop.offset + LEAST_LAID


def check_half_fold(length: float) -> None:
    """Refuse a strip that cannot be folded in half, or is longer than tested; ``length`` in L*."""
    if not shortest_half_fold() < length <= LONGEST:
        allowed = f"more than {shortest_half_fold():.6g} L* and at most {LONGEST:g} L*"
        why = "of a shorter strip hardly anything can lie folded with aligned edges"
        raise InvalidInputError("length", length, allowed, why)


@lru_cache(maxsize=4)
def half_fold(length: float) -> HalfFold:
    """The half fold of a strip of the given length, L*.

    Raises InvalidInputError: a strip too short to be folded in half, or longer than has been tested; SolveError: a
    state was not found.

    Examples
    --------
    >>> fold = half_fold(20.0)
    >>> round(fold.lying_length, 6), round(fold.landing, 6)
    (8.900575, 3.584045)
    """
    check_half_fold(length)
    loop, half, lying = elastica.folded_loop(), length / 2.0, elastica.half_fold_lying_length(length)
    lift_off = half - lying
    free = tuple(states_fixed_lift_off(length - lying))
    sag = free[-1].sag
    assert sag is not None  # it is in contact
    return HalfFold(
        folded=PlannedState((Part(loop.state, lift_off, -1.0),), (half, 0.0), length),
        lying_length=lying,
        first_touch=lift_off - float(free[-1].at(sag.s).x),
        landing=lift_off + loop.offset,
        free=free,
    )


@lru_cache(maxsize=4)
def plan_r_path(length: float) -> RPath:
    """Plan for a strip of the given length, L*; errors are those of :func:`half_fold`.

    Examples
    --------
    >>> [piece.name for piece in plan_r_path(20.0).path.pieces]
    ['lift', 'carry', 'roll', 'lay']
    """
    fold, half = half_fold(length), length / 2.0
    lift_off = half - fold.lying_length
    free = length - fold.lying_length

    def planned(*parts: Part) -> PlannedState:
        return PlannedState.of(length, *parts)

    flat = PlannedState((), (-half, 0.0), length)
    lifted = states_no_horizontal_force(free)
    lift = [flat, *(planned(Part(state, state.length - half, -1.0)) for state in lifted)]
    carry = [planned(Part(state, lift_off, -1.0)) for state in fold.free]
    contacts = states_point_contact(fold.free[-1])
    roll = [planned(Part(c.loop, lift_off, -1.0), Part(c.upper, lift_off, -1.0)) for c in contacts]
    (loop,) = fold.folded.parts
    upper = [Part(state, half - state.length, 1.0) for state in states_no_horizontal_force(free - loop.state.length)]
    # Each phase begins with the last state of the one before: here of `roll`, with the longest upper part.
    lay = [roll[-1], *(planned(loop, part) for part in upper[-2::-1]), fold.folded]
    phases = {"lift": lift, "carry": carry, "roll": roll, "lay": lay}
    pieces = pieces_through(
        (name, np.array([state.gripper for state in states]), np.array([state.angle for state in states]))
        for name, states in phases.items()
    )
    at_states = np.concatenate([piece.travelled for piece in pieces])
    at_states.flags.writeable = False  # the plan is cached
    return RPath(
        **vars(fold),
        path=GripperPath("r-path", pieces),
        states=tuple(state for states in phases.values() for state in states),
        travelled=at_states,
    )
