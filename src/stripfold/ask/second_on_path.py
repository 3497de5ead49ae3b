"""A second gripper that keeps a strip from snapping on a path, up to the touch of its sag.

As in :mod:`.second_gripper`: shortly before the first critical point it takes the strip where it is, and goes along
with the first one, at the same distance from it.  On a path both go up and down together.  In L* but for
:class:`SecondOnPath`.  Source: docs/second-gripper.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from stripfold.ask.second_gripper import BEFORE, SecondGripper, before_critical, checked_place, held
from stripfold.base.errors import SolveError
from stripfold.base.material import Material
from stripfold.follow.contact_branch import BranchPoint
from stripfold.follow.statics import StripModel, follow
from stripfold.follow.track import End
from stripfold.paths.curve import GripperPath

REASONS = {
    End.SNAP: "the path has a critical point with two grippers, too: the strip snaps through",
    End.TOUCH: "the sag touches the lower layer: it is laid down, no snap",
    End.DOWN: "the second gripper is down on the lower layer: it has laid the strip down, no snap",
    End.PATH: "the path ends",
}
"""What ends the part that is followed with two grippers, in words."""


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
    last, number = one.points[-1], one.pieces[-1]
    if not isinstance(last, BranchPoint) or last.touches:
        raise SolveError("the sag lies on the lower layer where the strip becomes unstable: no gripper can take it")
    model = last.problem.at(last.problem.contact(one.critical.before.q)).model
    mode = np.linalg.norm(one.critical.mode[model.middle], axis=1)
    # Where the path has a corner shortly before, half the way from there.
    lam = max(one.critical.lam - BEFORE, 0.5 * (path.pieces[number].start + one.critical.lam))
    at = before_critical(last.problem, one.critical, lam)
    s = checked_place(place, float(model.s[np.argmax(mode)]), float(at.contact[-1]), unit)
    x, z = unit * at.mid_surface(np.array([s]))[0]
    two = follow(strip.contact_mesh(), path, strip.length, held(at, s), number, until="touch")
    if two.end is End.LIFTED:
        raise SolveError("the whole strip leaves the floor", parameter=two.lam)
    end = two.lam
    end_x, end_z = unit * path.position(end)
    return SecondOnPath(
        s=unit * s,
        t=path.pseudo_time(lam),
        x=float(x),
        z=float(z),
        snap=two.end is End.SNAP,
        reason=REASONS[two.end],
        end_t=path.pseudo_time(end),
        end_x=float(end_x),
        end_z=float(end_z),
        gain=unit * float(end - one.critical.lam),
    )
