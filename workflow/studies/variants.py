"""What each choice of the model changes: the end of the advance along x, and the first touch on the triangular path.

Poisson's ratio, the stretch, the width, the gripper's hinge and the pin that holds the strip, each changed alone.  The
gripper is clamped by prescribing the rod's slope there.  A pin that gives moves with the horizontal force: along x
its lambda_c is that of the elastica, whose branch is the same in the frame of the pin; on a path the gripper goes in
that frame along the path less the pin's displacement, taken from the force on the path of the fixed pin.
Lengths in L*, forces in rho_a g L*.  Source: docs/physics.md, section 12.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import cos, nan, pi, radians, sin, sqrt
from typing import Any, NamedTuple, cast

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq, minimize_scalar

from stripfold import elastica
from stripfold.analysis import contact_branch, contact_events
from stripfold.analysis.assess import grip_and_hold
from stripfold.analysis.contact_branch import STEPS, BranchCrossing, BranchPoint
from stripfold.analysis.path_statics import FIRST, LIMIT, follow
from stripfold.analysis.prediction import ElasticaPrediction, end_of_advance
from stripfold.analysis.release import Fall, ReleaseState, simulate_fall
from stripfold.analysis.static import End, StripModel
from stripfold.arrays import Array, Index
from stripfold.errors import SolveError
from stripfold.models.model import Model
from stripfold.moving_contact import MovingContact
from stripfold.paths.curve import GripperPath, Piece
from stripfold.paths.geometric import triangular
from stripfold.problem import AlongPiece, AlongX, Motion
from stripfold.solve.events import Event
from studies.common import NO_RESULT, Progress, attempted, pooled, table

FALL = Fall(to_rest=False)
TURN = 0.1
"""Largest step of the clamp's angle, rad."""
EARLIER = 1.6
"""Free length by which a state lies before the critical one of hinge and pin, and before those of the variants, L*."""
PRESSED = 4.0
"""Length travelled up to which a pin that gives is taken to move in proportion, L*."""


def run(
    height: float,
    length_star: float,
    thickness: float,
    refinement: float,
    poisson: Sequence[float],
    eta_m: Sequence[float],
    narrow: float,
    angles: Sequence[float],
    compliance: float,
    sliding: float,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """End of the advance and first touch over ``variant``, and their differences from those of the variant's ``base``.

    Parameters
    ----------
    height
        Of the gripper along x.
    length_star, thickness, refinement
        The strip that is changed.
    poisson
        Poisson's ratios.
    eta_m
        Factors on the stretch at the same eta_b.
    narrow
        Poisson's ratio of a strip whose eta_b is that of plane strain, but which is as narrow as a beam.
    angles
        Of the strip at a clamp along x, degrees; on the path the clamp turns with the gripper.
    compliance, sliding
        Of a pin that is a spring, L* per force; force at which a pin slides.
    """
    strip, solid = StripModel(length_star, thickness, kind="rod"), StripModel(length_star, thickness)
    along_x, on_path = partial(_along_x, height, refinement), partial(_on_path, refinement)
    cases = [
        Case(ROD, "", along_x(strip), on_path(strip)),
        Case(SOLID, "", along_x(solid), on_path(solid)),
    ]
    for nu in poisson:
        varied = StripModel(length_star, thickness, nu)
        cases.append(Case(f"Poisson's ratio {nu:g}", SOLID, along_x(varied), on_path(varied)))
    for factor in eta_m:
        varied = StripModel(length_star, thickness * sqrt(factor), kind="rod")
        cases.append(Case(f"eta_m times {factor:g}", ROD, along_x(varied), on_path(varied)))
    ratio = (1.0 - narrow**2) ** (1.0 / 3.0)
    name = f"narrow strip, Poisson's ratio {narrow:g}: D is that of a beam"
    as_beam = StripModel(length_star / ratio, thickness / ratio, kind="rod")
    cases.append(Case(name, ROD, partial(end_along_x, as_beam, height / ratio, refinement), on_path(as_beam), ratio))
    for angle in angles:
        of_angle = partial(clamped_along_x, strip, height, radians(angle), refinement)
        cases.append(Case(f"gripper clamps the strip at {angle:g} degrees", ROD, of_angle))
    turning = partial(clamped_on_path, strip, refinement)
    cases.append(Case("gripper clamps the strip and turns evenly by 180 degrees", ROD, None, turning))
    gives = partial(giving_along_x, height, compliance), partial(giving_on_path, strip, compliance, refinement)
    cases.append(Case(f"pin gives by {compliance:g} L* under rho_a g L*", ELASTICA, *gives))
    cases.append(Case(f"pin slides at {sliding:g} rho_a g L*", ELASTICA, partial(sliding_along_x, height, sliding)))
    cases.insert(0, Case(ELASTICA, "", partial(of_elastica, height), on_path(strip)))
    rows = {case.name: row for case, row in zip(cases, pooled(Case.found, cases, threads, progress), strict=True)}
    coarse, _ = attempted(_on_path(2.0 * refinement, strip))
    out = []
    for case in cases:
        row = rows[case.name]
        base = rows[case.base or case.name]
        shifts = {f"{name}_shift": row[name] - base[name] for name in ("lambda_end", "touch")}
        out.append({"variant": case.name, "base": case.base} | row | shifts)
    attrs = {"height": height, "length_star": length_star, "thickness": thickness, "refinement": refinement}
    attrs["touch_error"] = nan if coarse is None else abs(coarse - rows[ROD]["touch"])
    return table("variants", "variant", out, attrs)


ELASTICA, ROD, SOLID = "elastica", "rod", "solid"
"""The variants that others are compared with: hinge and pin, no Poisson's ratio."""


class Case(NamedTuple):
    """A variant: what finds the end of its advance and its first touch, if anything; ``ratio`` is their unit."""

    name: str
    base: str
    along_x: Callable[[], Advance] | None = None
    on_path: Callable[[], float] | None = None
    ratio: float = 1.0

    def found(self) -> dict[str, Any]:
        """The row of this variant."""
        end, no_end = attempted(self.along_x) if self.along_x else (None, "")
        touch, no_touch = attempted(self.on_path) if self.on_path else (None, "")
        return {
            "lambda_end": nan if end is None else self.ratio * end[0],
            "snap": nan if end is None else float(end[1]),
            "touch": nan if touch is None else self.ratio * touch,
            NO_RESULT: no_end + no_touch,
        }


def _along_x(height: float, refinement: float, strip: StripModel) -> Callable[[], Advance]:
    return partial(end_along_x, strip, height, refinement)


def _on_path(refinement: float, strip: StripModel) -> Callable[[], float]:
    return partial(touch_on_path, strip, refinement)


def markdown(data: xr.Dataset) -> str:
    """The table of the differences."""

    def shown(value: xr.DataArray) -> str:
        return f"{float(value):+.4f}" if np.isfinite(value) else "-"

    rows = [r"| changed | end of the advance / L\* | first touch / L\* |", "|---|---|---|"]
    for name in data["variant"].values[data["base"].values != ""]:
        one = data.sel(variant=name)
        laid = ", no snap: the sag touches" if one["snap"] == 0.0 else ""
        text = f"| {name} | {shown(one['lambda_end_shift'])}{laid} | {shown(one['touch_shift'])} |"
        rows.append(text.replace("L*", "L\\*"))
    return "\n".join(rows) + "\n"


@dataclass(frozen=True)
class Clamped:
    """A motion whose gripper also prescribes the rod's slope: its angle is a linear function of lambda.

    ``angle`` is that of the direction towards the held end at lambda = 0, rad, and ``turn`` its derivative.
    """

    motion: AlongX | AlongPiece
    angle: float
    turn: float = 0.0

    def grasped(self, model: Model) -> Index:
        # After the displacement of a node come the unknowns of its slope.
        return np.concatenate([self.motion.grasped(model), model.middle[0] + 2])

    def values(self, lam: float) -> Array:
        angle = self.angle + self.turn * lam
        return np.concatenate([self.motion.values(lam), [cos(angle) - 1.0, sin(angle)]])

    def rates(self, lam: float) -> Array:
        angle = self.angle + self.turn * lam
        return np.concatenate([self.motion.rates(lam), [-self.turn * sin(angle), self.turn * cos(angle)]])


Advance = tuple[float, bool]
"""lambda at the end of the advance, and whether the strip snaps there; else the sag touches."""


def end_along_x(strip: StripModel, height: float, refinement: float) -> Advance:
    """With hinge and pin."""
    run = end_of_advance(strip, ElasticaPrediction.at(height), refinement)
    return run.lam, run.end is End.SNAP


def touch_on_path(strip: StripModel, refinement: float) -> float:
    """x of the first touch on the triangular path, after a fall from the critical point, with hinge and pin."""
    path = triangular(strip.length)
    segment = follow(strip.contact_mesh(refinement), path, strip.length)
    if segment.critical is None or segment.last is None:
        raise SolveError("no critical point on the path", parameter=path.length)
    return _touch(segment.last, refinement)


def _touch(critical: BranchPoint, refinement: float) -> float:
    return simulate_fall(ReleaseState.at(critical, refinement), FALL).touch_x


def clamped_along_x(strip: StripModel, height: float, angle: float, refinement: float) -> Advance:
    """The end of the advance of a rod whose slope at the gripper has this angle, rad."""
    last = elastica.critical(height).state
    near = elastica.state_at(height, last.length - EARLIER, last)
    at = contact_branch.from_elastica(strip.contact_mesh(refinement), AlongX(height), near.advance, near)
    slope = at.u[at.model.middle[0] + 2]
    now = float(np.arctan2(slope[1], 1.0 + slope[0]))
    for step in np.linspace(now, angle, 2 + int(abs(angle - now) / TURN)):
        at = _moved_by(at, Clamped(AlongX(height), float(step)))
    return _to_the_end(at)


def clamped_on_path(strip: StripModel, refinement: float) -> float:
    """x of the first touch of a rod whose gripper turns evenly from 0 to 180 degrees along the triangular path."""
    path = triangular(strip.length)
    turn = -pi / path.length
    at: BranchPoint | None = None
    for piece in path.pieces:
        along = AlongPiece(piece, strip.length)
        if at is None:
            at = contact_branch.from_flat(strip.contact_mesh(refinement), along, FIRST)
        at = _moved_by(at, Clamped(along, 0.0, turn))
        for item in contact_branch.follow(at, STEPS, _stops, through_contact=False, end=piece.end):
            if isinstance(item, BranchCrossing):
                if item.event is LIMIT:
                    return _touch(item.before, refinement)
                raise SolveError(item.event.name, parameter=item.before.point.lam)
            at = item
    raise SolveError("no critical point on the path", parameter=path.length)


def _moved_by(at: BranchPoint, motion: Clamped) -> BranchPoint:
    """A state with another motion of its gripper."""
    problem = MovingContact(at.problem.mesh, cast("Motion", motion))
    return contact_branch.solved(problem, at.point.q, at.point.lam)


def _to_the_end(at: BranchPoint) -> Advance:
    for item in contact_branch.follow(at, STEPS, _stops, through_contact=False):
        if isinstance(item, BranchCrossing):
            return item.before.point.lam, item.event is LIMIT
    raise AssertionError("a branch ends in an event or raises")


def _stops(problem: MovingContact) -> list[Event]:
    return [contact_events.touch(problem), LIMIT]


def of_elastica(height: float) -> Advance:
    """With hinge and pin, infinitely thin."""
    found = elastica.critical(height)
    return found.state.advance, found.snap


def giving_along_x(height: float, compliance: float) -> Advance:
    """The critical point of the elastica with a pin that is a spring of this compliance.

    Under the tension F_x the pin moves by compliance * F_x towards the gripper, whose advance is less by as much.
    """
    last = elastica.critical(height).state

    def loss(length: float) -> float:
        state = elastica.state_at(height, length, last)
        return compliance * state.force_x - state.advance

    bounds = last.length - EARLIER, last.length
    found = minimize_scalar(loss, bounds=bounds, method="bounded", options={"xatol": 1e-7})
    return -float(found.fun), True


def sliding_along_x(height: float, force: float) -> Advance:
    """The critical point of the elastica with a pin that slides under a tension, less than that of the critical state.

    From there on the force cannot rise with the advance, as it does in equilibrium: the strip snaps.
    """
    last = elastica.critical(height).state

    def over(length: float) -> float:
        return elastica.state_at(height, length, last).force_x - force

    length = brentq(over, last.length - EARLIER, last.length, xtol=1e-12)
    return elastica.state_at(height, length, last).advance, True


def giving_on_path(strip: StripModel, compliance: float, refinement: float) -> float:
    """x of the first touch on that path with a pin that is a spring, in the frame of the ground."""
    path = triangular(strip.length)
    segment = follow(strip.contact_mesh(refinement), path, strip.length)
    reaction = {0.0: 0.0}
    # The first bit of the path, at 45 degrees, presses the flat strip on the pin; later the loop takes that up.
    reaction |= {state[1].lam: grip_and_hold(*state)[1] for state in segment.states if state[1].lam > PRESSED}
    # Against the pin's reaction it moves; behind the critical point it stays.
    reaction[2.0 * path.length] = reaction[segment.states[-1][1].lam]
    moves = make_interp_spline(list(reaction), -compliance * np.array(list(reaction.values())), k=1)
    pieces = tuple(_less(piece, moves) for piece in path.pieces)
    relative = follow(strip.contact_mesh(refinement), GripperPath("relative", pieces), strip.length)
    if relative.critical is None or relative.last is None:
        raise SolveError("no critical point on the path", parameter=path.length)
    return _touch(relative.last, refinement) + float(moves(relative.critical.lam))


def _less(piece: Piece, moves: Callable[[float], Array]) -> Piece:
    """A piece less a horizontal displacement, a function of the length travelled."""
    rate = moves.derivative()  # type: ignore[attr-defined]
    return Piece(
        piece.start,
        piece.end,
        lambda s: piece.position(s) - np.array([float(moves(s)), 0.0]),
        lambda s: piece.rate(s) - np.array([float(rate(s)), 0.0]),
        piece.name,
    )
