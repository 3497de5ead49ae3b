"""A second gripper that keeps a strip from snapping on a path, up to the touch of its sag.

As in :mod:`.second_gripper`: shortly before the first critical point it takes the strip where it is, and goes along
with the first one, at the same distance from it.  On a path both go up and down together.  In L* but for
:class:`SecondOnPath`.  Source: docs/second-gripper.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stripfold.ask.second_gripper import BEFORE, SecondGripper, before_critical, checked_place, held
from stripfold.base.errors import SolveError
from stripfold.base.material import Material
from stripfold.follow import contact_branch
from stripfold.follow.contact_branch import STEPS, BranchPoint
from stripfold.follow.contact_events import LIFTED, lift_off_of_all, touch, zero
from stripfold.follow.path_statics import follow
from stripfold.follow.static import LAMBDA_TOLERANCE, LIMIT, StripModel
from stripfold.paths.curve import GripperPath
from stripfold.solve import critical
from stripfold.solve.continuation import Event
from stripfold.strip.contact_mesh import LYING
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, TwoGrippers

SNAPS = "the path has a critical point with two grippers, too: the strip snaps through"
TOUCHES = "the sag touches the lower layer: it is laid down, no snap"
DOWN = "the second gripper is down on the lower layer: it has laid the strip down, no snap"
ENDS = "the path ends"


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondOnPath(SecondGripper):
    """On a path: pseudo times where the strip is taken and where what was followed ends, and the first gripper there.

    Lengths in m; the gain is a length of the path.
    """

    t: float
    end_t: float
    end_x: float
    end_z: float


def second_on_path(
    material: Material, length: float, path: GripperPath, place: float | Literal["auto"]
) -> SecondOnPath | None:
    """Hold a strip that has a critical point on its path at a place, m, or at the one that the mode moves most.

    On the rod, whatever the model asked for; ``path`` in L*, ``length`` in m.  None where there is no critical point.

    Raises InvalidInputError: a place where the strip does not hang free; SolveError: the path could not be followed.
    """
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, kind="rod")
    one = follow(strip.contact_mesh(), path, strip.length)
    if one.critical is None:
        return None
    last, number = one.last, one.pieces[-1]
    if last is None or last.topology != LYING:
        raise SolveError("the sag lies on the lower layer where the strip becomes unstable: no gripper can take it")
    model = last.problem.at(last.problem.contact(one.critical.before.q)).model
    mode = np.linalg.norm(one.critical.mode[model.middle], axis=1)
    # Where the path has a corner shortly before, half the way from there.
    lam = max(one.critical.lam - BEFORE, 0.5 * (path.pieces[number].start + one.critical.lam))
    at = before_critical(last.problem, one.critical, lam)
    s = checked_place(place, float(model.s[np.argmax(mode)]), float(at.contact[-1]), unit)
    x, z = unit * at.mid_surface(np.array([s]))[0]
    end, reason = _end(held(at, s), path, number)
    end_x, end_z = unit * path.position(end)
    return SecondOnPath(
        s=unit * s,
        t=path.pseudo_time(lam),
        x=float(x),
        z=float(z),
        snap=reason is SNAPS,
        reason=reason,
        end_t=path.pseudo_time(end),
        end_x=float(end_x),
        end_z=float(end_z),
        gain=unit * float(end - one.critical.lam),
    )


def _end(at: BranchPoint, path: GripperPath, number: int) -> tuple[float, str]:
    """The length travelled up to which the strip follows two grippers from a state on, and what ends it."""
    down = "second gripper on the floor"

    def stops(problem: MovingContact) -> list[Event]:
        height = zero(down, lambda point: float(problem.motion.values(point.lam)[-1]))
        return [touch(problem), height, lift_off_of_all(problem), LIMIT]

    for piece in path.pieces[number:]:
        motion = at.problem.motion
        assert isinstance(motion, TwoGrippers)
        if piece is not path.pieces[number]:
            onward = replace(motion, first=AlongPath(piece, at.model.length))
            at = contact_branch.solved(replace(at.problem, motion=onward), at.point.q, piece.start)
        if critical.is_past(at.point):
            # It does not follow the new direction.
            return at.point.lam, SNAPS
        for item in contact_branch.follow(at, STEPS, stops, through_contact=False, end=piece.end):
            if isinstance(item, BranchPoint):
                at = item
                continue
            if item.event.name == LIFTED:
                raise SolveError("the whole strip leaves the floor", parameter=item.before.point.lam)
            before, after = item.before.point, item.after.point
            if item.event is LIMIT:
                return critical.locate(item.before.problem, before, after, LAMBDA_TOLERANCE, STEPS).lam, SNAPS
            return before.lam, DOWN if item.event.name == down else TOUCHES
    return path.length, ENDS
