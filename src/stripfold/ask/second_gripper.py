"""A second gripper that keeps a strip from snapping: where to hold it, and what that gains.

Shortly before the critical point a second gripper takes a point of the strip where it is, as a hinge, and both go on at
the same distance from each other: along x, or on a path up to the touch of the sag.  It holds the place in the strip
that moves most in the critical mode.  Lengths in L* but for those of :class:`SecondGripper`.  Source:
docs/second-gripper.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Literal

import numpy as np

from stripfold.ask import select_model
from stripfold.ask.inputs import Scene
from stripfold.ask.prediction import ElasticaPrediction, end_of_advance
from stripfold.base.errors import InvalidInputError, SolveError
from stripfold.base.material import Material
from stripfold.files.reporting import Rows, metres
from stripfold.follow import contact_branch
from stripfold.follow.contact_branch import BranchPoint
from stripfold.follow.statics import StripModel, branch, follow, to_the_end
from stripfold.follow.track import End, Track
from stripfold.paths.curve import GripperPath
from stripfold.solve.critical import CriticalPoint
from stripfold.strip.contact_mesh import POINT
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, AlongX, TwoGrippers

TAKEN_BEFORE = 0.05
"""Distance before lambda_c at which the second gripper takes the strip, L*: 1 to 2 mm, which a robot can keep."""
NEAREST = 0.01
"""Least distance of the second gripper from the first, and from where the strip lies, L*: less than 1 mm, and less than
any gripper is wide.  A rod a hundred times as short is too stiff for the solver."""
REASONS = {
    End.SNAP: "the path has a critical point with two grippers, too: the strip snaps through",
    End.TOUCH: "the sag touches the lower layer: it is laid down, no snap",
    End.DOWN: "the second gripper is down on the lower layer: it has laid the strip down, no snap",
    End.PATH: "the path ends",
}
"""What ends the part that is followed with two grippers, in words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondGripper:
    """A strip held at a second place, m.

    ``s``: the place, as a distance along the strip from the first gripper.  ``x``, ``z``: where it is taken, origin
    mid-strip.  ``snap``, ``reason``: whether the strip snaps nevertheless, and what ends the part that was followed
    with two grippers.  ``gain``: how much farther the first gripper is then than at the critical point with one.
    """

    s: float
    x: float
    z: float
    snap: bool
    reason: str
    gain: float

    def held(self, when: str) -> Rows:
        """The place, where and when it is taken, and whether the strip snaps, in words."""
        place = f"taken at {when}, x = {self.x:.4g} m, z = {self.z:.4g} m"
        return [
            ("2nd gripper", metres(self.s, f"along the strip from the first, {place}")),
            ("  snap", f"{'yes' if self.snap else 'no'}: {self.reason}"),
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondAlongX(SecondGripper):
    """At constant height: the first gripper's advance where the strip is taken, and that up to which it is stable, m.

    It is followed until that is as large as the strip is long.
    """

    advance: float
    end: float

    def rows(self) -> Rows:
        """In words."""
        gain = f"stable up to there, {self.gain:.4g} m more than with one gripper"
        return [*self.held(f"lambda = {self.advance:.6g} m"), ("  lambda", metres(self.end, gain))]


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondOnPath(SecondGripper):
    """On a path: pseudo times where the strip is taken and where what was followed ends, and the first gripper there.

    Lengths in m; the gain is a length of the path.
    """

    t: float
    end_t: float
    end_x: float
    end_z: float

    def rows(self) -> Rows:
        """In words."""
        end = f"t = {self.end_t:.4g}, gripper at x = {self.end_x:.4g} m, z = {self.end_z:.4g} m"
        gain = f"{end}, {self.gain:.4g} m farther than with one gripper"
        return [*self.held(f"t = {self.t:.4g}"), ("  stable to", gain)]


@dataclass(frozen=True, eq=False)
class Unheld:
    """A strip with one gripper that is about to snap.

    ``lam``: lambda at the critical point.  ``at``: the state shortly before it.  ``place``: that to hold, which moves
    most in the critical mode; its displacement counts in any direction, as a held point moves in none.
    """

    lam: float
    at: BranchPoint
    place: float

    @classmethod
    def before(cls, problem: MovingContact, critical: CriticalPoint, lam: float) -> Unheld:
        """Go back to ``lam`` on the branch to a critical point of ``problem``, shortly before it.

        Raises SolveError: no state is near the parabola of the branch at the critical point.
        """
        near, ahead, width = critical.before, critical.after.tangent, critical.after.arc - critical.before.arc
        # Its second derivatives are those between the bracket's ends.
        ds = -sqrt(2.0 * (critical.lam - lam) * width / (near.tangent.lam - ahead.lam))
        guess = near.q + ds * near.tangent.q + 0.5 * ds**2 / width * (ahead.q - near.tangent.q)
        model = problem.at(problem.contact(near.q)).model
        moved = np.linalg.norm(critical.mode[model.middle], axis=1)
        return cls(critical.lam, contact_branch.solved(problem, guess, lam), float(model.s[np.argmax(moved)]))

    @property
    def free_length(self) -> float:
        """Length of the part that hangs free: of the places that can be held."""
        return float(self.at.contact[-1])

    def taken(self, s: float, unit: float) -> dict[str, float]:
        """A place in the strip, and where it is taken, m; ``unit``: L*, m."""
        x, z = (unit * self.at.mid_surface(np.array([s]))[0]).tolist()
        return {"s": unit * s, "x": x, "z": z}

    def checked(self, place: float | Literal["auto"], unit: float) -> float:
        """The place to hold, L*, from one in m or the one of the mode.

        Raises InvalidInputError: it is not on the part that hangs free.
        """
        s = self.place if place == "auto" else place / unit
        lowest, highest = NEAREST, self.free_length - NEAREST
        if not lowest <= s <= highest:
            allowed = f"auto, or from {unit * lowest:.3g} to {unit * highest:.4g} m, on the part that hangs free"
            advice = "it is a distance along the strip from the first one"
            raise InvalidInputError("second_gripper", place, allowed, advice)
        return s


def before_snap(strip: StripModel, height: float, before: float = TAKEN_BEFORE, refinement: float = 1.0) -> Unheld:
    """The state at a distance ``before`` lambda_c.

    Raises SolveError: the strip does not snap at this height.
    """
    run = end_of_advance(strip, ElasticaPrediction.at(height), refinement)
    if run.critical is None:
        raise SolveError(run.end.reason, parameter=run.lam)
    return Unheld.before(run.last.problem, run.critical, run.lam - before)


def hold(unheld: Unheld, s: float) -> Track:
    """The end of the advance of a strip held at ``s`` too, :data:`NEAREST` or more from the free length's ends.

    Raises SolveError: the branch could not be followed.
    """
    return to_the_end(held(unheld.at, s))


def held(at: BranchPoint, s: float) -> BranchPoint:
    """The same state with a second gripper at ``s`` that has taken the strip where it is."""
    first = at.problem.motion
    assert isinstance(first, AlongX | AlongPath)
    ahead, up = at.mid_surface(np.array([s]))[0] + (0.5 * at.model.length - s, 0.0) - first.values(at.point.lam)
    two = TwoGrippers(first, s, float(ahead), float(up))
    contact, same_lam = np.array([s, at.contact[-1]]), (np.zeros(2), 1.0)
    return contact_branch.transferred(at, contact, POINT, same_lam, two)


def stable_advance(run: Track) -> tuple[float, End]:
    """The advance up to which a held strip is stable, at most its length, and the end: a touch if no snap follows.

    Raises SolveError: the branch could not be followed.
    """
    if run.end is not End.TOUCH:
        return run.lam, run.end
    last = run.points[-2] if len(run.points) > 1 else run.last
    assert isinstance(last, BranchPoint)
    to = max(run.lam, run.last.model.length)
    for item in branch(last, to):
        if not isinstance(item, BranchPoint):
            return item.before.point.lam, End.SNAP
    return to, End.TOUCH


def second_gripper(scene: Scene, place: float | Literal["auto"]) -> SecondAlongX:
    """Hold a strip that snaps at a place, m, or at the one that its critical mode moves most.

    On the rod, whatever the model asked for.

    Raises InvalidInputError: a place where the strip does not hang free; SolveError: the branch could not be followed.
    """
    unit = scene.gravity_length
    strip = StripModel(scene.length_star, scene.material.relative_thickness, kind="rod")
    unheld = before_snap(strip, scene.height_star, refinement=select_model.refinement("rod", scene.accuracy))
    s = unheld.checked(place, unit)
    lam, end = stable_advance(hold(unheld, s))
    return SecondAlongX(
        **unheld.taken(s, unit),
        snap=end is End.SNAP,
        reason=end.reason,
        gain=unit * (lam - unheld.lam),
        advance=unit * unheld.at.point.lam,
        end=unit * lam,
    )


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
    # Where the path has a corner shortly before, half the way from there.
    lam = max(one.critical.lam - TAKEN_BEFORE, 0.5 * (path.pieces[number].start + one.critical.lam))
    unheld = Unheld.before(last.problem, one.critical, lam)
    s = unheld.checked(place, unit)
    two = follow(strip.contact_mesh(), path, strip.length, held(unheld.at, s), number, until="touch")
    if two.end is End.LIFTED:
        raise SolveError("the whole strip leaves the floor", parameter=two.lam)
    end_x, end_z = (unit * path.position(two.lam)).tolist()
    return SecondOnPath(
        **unheld.taken(s, unit),
        snap=two.end is End.SNAP,
        reason=REASONS[two.end],
        gain=unit * float(two.lam - one.critical.lam),
        t=path.pseudo_time(lam),
        end_t=path.pseudo_time(two.lam),
        end_x=end_x,
        end_z=end_z,
    )
