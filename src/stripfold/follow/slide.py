"""What lies slides on the table: a gripper's path as a strip sees it whose end is held by friction alone.

All that lies slides at once, as it is stiff along itself.  A strip that has slid by d is the pinned strip with its
gripper d farther back; while it slides, d is such that the force at the held end is the coefficient of friction times
the weight that the table carries.  Lengths in L*, forces in rho_a g L*.  Source: docs/robot.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from math import copysign
from typing import NamedTuple, Self

import numpy as np

from stripfold.base.arrays import Array, ByValue
from stripfold.base.errors import SolveError
from stripfold.base.numerics import Spline, root
from stripfold.base.progress import Percent
from stripfold.follow.contact_branch import BranchPoint, Planned, from_flat
from stripfold.follow.memory import STEP, Effects, load_incrementally_from, with_effects
from stripfold.follow.statics import FIRST
from stripfold.follow.track import StripState, friction_to_hold, on_mesh
from stripfold.paths.curve import GripperPath, Piece
from stripfold.solve import critical
from stripfold.strip.problem import AlongPath, Slipping

GROWTH = 1.3
"""Ratio of the lengths travelled at the ends of the first steps: a push falls with the square of the height."""
LEAST = 1e-4
"""Length travelled in a step that is not halved any more, L*."""
ACCURACY = 1e-6
"""Of where a slide begins, L*."""
SLIDES = 1e-3
"""Coefficient of friction by which less is needed of what stays than of what slides."""


@dataclass(frozen=True, eq=False)
class Slid(ByValue, Piece):
    """A part of a piece as a strip sees it that has slid by ``slides`` at ``travelled``, shape (n,) each."""

    piece: Piece
    travelled: Array
    slides: Array

    @cached_property
    def slide(self) -> Spline:
        """How far it has slid along x and z, over the length travelled."""
        return Spline.through(self.travelled, np.column_stack([self.slides, np.zeros_like(self.slides)]))

    def position(self, s: float) -> Array:
        return self.piece.position(s) - self.slide.at(s)

    def rate(self, s: float) -> Array:
        return self.piece.rate(s) - self.slide.rate(s)

    @property
    def turns(self) -> bool:
        return self.piece.turns

    def angle(self, s: float) -> tuple[float, float]:
        return self.piece.angle(s)

    def moved(self, factor: float, x: float) -> Self:
        at, slides = factor * self.travelled, factor * self.slides
        return replace(self, start=at[0], end=at[-1], piece=self.piece.moved(factor, x), travelled=at, slides=slides)


def slide_of(state: StripState, lam: float | None = None) -> float:
    """How far what lies has slid along x in a state, or at another lambda of its motion; 0 of a pinned strip."""
    motion = state.problem.motion
    if isinstance(motion, AlongPath) and isinstance(motion.path, Slid):
        return float(motion.path.slide.at(state.lam if lam is None else lam)[0])
    return 0.0


class Sliding(NamedTuple):
    """A path as a strip sees it, whose pieces are :class:`Slid`, and up to which length travelled that is known."""

    path: GripperPath
    known: float


def slides_on(
    mesh: Planned,
    path: GripperPath,
    length: float,
    effects: Effects,
    mu: float,
    size: float = STEP,
    progress: Callable[[str], None] | None = None,
) -> Sliding:
    """The path as a strip sees it whose end is held by friction on the table.

    ``mesh``, ``path``, ``effects``, ``size``: as in :func:`.load_path`.  ``length``: of the strip, L*.  ``mu``:
    coefficient of friction of the table.  It is known to where the strip is lost, slides at once, or cannot be
    followed.  Raises SolveError: a path that cannot be begun.
    """
    followed = Percent(progress, "finding how far what lies slides")

    motion = partial(AlongPath, length=length, gripper=path.gripper)
    at, slide = _first(mesh, motion, path.pieces[0], effects, mu)
    begin = at.lam
    nodes = [(0.0, 0.0), (begin, slide)]
    with suppress(SolveError):
        for piece in path.pieces:
            for end in _ends(piece, begin, size):
                for found in _step(at, slide, motion, piece, end, mu):
                    at, slide = found
                    nodes.append((at.lam, slide))
                followed(end / path.length)
    travelled, slides = np.array(nodes).T
    pieces = [part for piece in path.pieces for part in _parts(piece, travelled, slides)]
    return Sliding(replace(path, pieces=tuple(pieces)), float(travelled[-1]))


def _first(
    mesh: Planned, motion: Callable[[Piece], AlongPath], piece: Piece, effects: Effects, mu: float
) -> tuple[BranchPoint, float]:
    """A state near the beginning of the first piece, and the slide there.  Raises SolveError."""
    begin = min(FIRST, piece.end / 4.0)

    def begun(motion: AlongPath) -> BranchPoint:
        return with_effects(from_flat(mesh, motion, begin), effects)

    while True:
        try:
            return _held(begun(motion(piece)), 0.0, mu, begun)
        except SolveError:
            if begin < LEAST:
                raise
            # A thin strip that is pinned is pushed beyond what its table bears while it is almost flat.
            begin *= 0.5


def _part(piece: Piece, travelled: Array, slides: Array) -> Slid:
    return Slid(float(travelled[0]), float(travelled[-1]), piece.name, piece, travelled, slides)


def _parts(piece: Piece, travelled: Array, slides: Array) -> Iterator[Slid]:
    """The parts of a piece on which what lies slides or stays, in turn."""
    inside = travelled[(travelled > piece.start) & (travelled < piece.end)]
    at = np.array([piece.start, *inside, piece.end])
    moved = np.interp(at, travelled, slides)
    changes = np.flatnonzero(np.diff(np.diff(moved) == 0.0)) + 1
    for begin, end in pairwise([0, *changes.tolist(), len(at) - 1]):
        yield _part(piece, at[begin : end + 1], moved[begin : end + 1])


def _ends(piece: Piece, first: float, size: float) -> list[float]:
    """Lengths travelled at the ends of the steps on a piece; on the first one, of those after ``first``."""
    ends = list[float]()
    if piece.start == 0.0:
        while (GROWTH - 1.0) * first < size and GROWTH * first < piece.end:
            first *= GROWTH
            ends.append(first)
    begin = ends[-1] if ends else piece.start or first
    count = int(np.ceil((piece.end - begin) / size * (1.0 - 1e-12)))
    return [*ends, *np.linspace(begin, piece.end, count + 1)[1:].tolist()]


def _step(
    at: BranchPoint, slide: float, motion: Callable[[Piece], AlongPath], piece: Piece, end: float, mu: float
) -> Iterator[tuple[BranchPoint, float]]:
    """The state at the end of a step, and the slide there; before it, those within it that are needed to get there.

    ``motion``: on a piece.  Raises SolveError: a state cannot be computed, or nothing holds what lies.
    """
    try:
        found = list(_at_once(at, slide, motion, piece, end, mu))
    except SolveError:
        if end - at.lam < LEAST:
            raise
        half = list(_step(at, slide, motion, piece, 0.5 * (at.lam + end), mu))
        yield from half
        yield from _step(*half[-1], motion, piece, end, mu)
    else:
        yield from found


def _at_once(
    at: BranchPoint, slide: float, motion: Callable[[Piece], AlongPath], piece: Piece, end: float, mu: float
) -> Iterator[tuple[BranchPoint, float]]:
    """The state at the end of a step, and the slide there; before it, where it begins or ends to slide within it."""

    def stays(to: float) -> BranchPoint:
        seen = motion(_part(piece, np.array([at.lam, to]), np.array([slide, slide])))
        return next(load_incrementally_from(at, [(seen, to)], locate=False))

    def missing(to: float) -> float:
        return abs(friction_to_hold(*on_mesh(stays(to) if to > at.lam else at))) - mu

    begin, there = at.lam, stays(end)
    holds = abs(friction_to_hold(*on_mesh(there))) <= mu
    if not holds and missing(at.lam) < -SLIDES:
        at = stays(root(missing, at.lam, end, ACCURACY))
        yield at, slide
    elif holds and isinstance(slips := at.problem.motion, Slipping):
        ends = _end_of_slide(at, slips, piece, end)
        if ends is not None:
            at, slide = ends, slips.slid(ends.model, ends.u, ends.lam)
            yield at, slide
    yield _held(there if at.lam == begin else stays(end), slide, mu, partial(_slipping, at, end))


def _end_of_slide(at: BranchPoint, slips: Slipping, piece: Piece, end: float) -> BranchPoint | None:
    """The state from which on what lies would slide back, and stays; None where it stays from the step's begin on."""

    def further(to: float) -> float:
        """Rate at which it slides on; negative where there is no such state any more, too."""
        try:
            there = _slipping(at, to, slips) if to > at.lam else at
        except SolveError:
            return -1.0
        tangent, x = there.point.tangent, there.model.middle[0, 0]
        return float(np.sign(slips.ratio) * (tangent.q[x] - piece.rate(to)[0] * tangent.lam))

    if further(at.lam) <= 0.0 or further(end) >= 0.0:
        return None
    return _slipping(at, root(further, at.lam, end, ACCURACY), slips)


def _slipping(at: BranchPoint, end: float, motion: AlongPath) -> BranchPoint:
    """The state at the end of a step within which what lies slides.  Raises SolveError."""
    force = at.point.state.force.copy()
    # What the gripper's force lacks there, if anything, is replaced within the step.
    force[at.model.middle[0, 0]] = 0.0
    free = BranchPoint(at.problem, replace(at.point, state=replace(at.point.state, force=force)))
    return next(load_incrementally_from(free, [(motion, end)], locate=False))


def _held(
    stays: BranchPoint, slide: float, mu: float, slipping: Callable[[AlongPath], BranchPoint]
) -> tuple[BranchPoint, float]:
    """The state at the end of a step, and how far what lies has slid: no farther than until friction holds it.

    ``stays``: the state where it does not slide; ``slipping``: that with the motion of a strip that does.  Raises
    SolveError: it cannot be computed, or nothing holds what lies.
    """
    friction, motion = friction_to_hold(*on_mesh(stays)), stays.problem.motion
    if abs(friction) <= mu:
        return stays, slide
    assert isinstance(motion, AlongPath)
    piece = motion.path.piece if isinstance(motion.path, Slid) else motion.path
    slips = Slipping(piece, motion.length, motion.gripper, ratio=copysign(mu, friction))
    found = slipping(slips)
    slid = slips.slid(found.model, found.u, found.lam)
    if (slid - slide) * friction > 0.0 or critical.is_past(found.point):
        raise SolveError("what lies slides at once")
    return found, slid
