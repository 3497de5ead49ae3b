"""A gripper path: smooth pieces between corners, parametrised by the length travelled.

Lengths in L* or m, in the frame of the model: origin mid-strip, z up, the flat strip grasped at x = -length/2 and held
at +length/2.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from stripfold.base.arrays import Array, ByValue
from stripfold.base.numerics import Spline
from stripfold.base.validation import Gripper

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


@dataclass(frozen=True)
class Piece(ABC):
    """A smooth part of a path.

    ``start``, ``end``: length travelled at its ends.  ``name``: name of the phase.
    """

    start: float
    end: float
    name: str

    @abstractmethod
    def position(self, s: float) -> Array:
        """Position (x, z) at the length travelled ``s``."""

    @abstractmethod
    def rate(self, s: float) -> Array:
        """Its derivative, of about unit length."""

    @property
    def turns(self) -> bool:
        """Whether it says how the gripper turns."""
        return False

    def angle(self, s: float) -> tuple[float, float]:
        """Rotation of the gripper at the length travelled ``s``, rad, and its derivative.

        It is 0 where the gripper grasps the flat strip, and pi on the folded one.
        """
        raise NotImplementedError

    def moved(self, factor: float, x: float) -> Self:
        """The same piece with all lengths multiplied, then shifted along the floor."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Interpolated(ByValue, Piece):
    """A line through two points or a cubic spline through more.

    ``points``: shape (n, 2).  ``travelled``: lengths travelled there, shape (n,).  ``above_floor``: whether what lies
    below the floor between the points is kept on it.  ``angles``: rotation of the gripper there, rad, shape (n,); None
    where it is not known.
    """

    points: Array
    travelled: Array
    above_floor: bool = False
    angles: Array | None = None

    @classmethod
    def through(cls, points: Array, start: float, name: str, angles: Array | None = None) -> Self:
        """Over :func:`polygon_length`."""
        travelled = polygon_length(points, start)
        return cls(float(travelled[0]), float(travelled[-1]), name, points, travelled, angles=angles)

    @cached_property
    def _spline(self) -> Spline:
        return Spline.through(self.travelled, self.points)

    @property
    def turns(self) -> bool:
        return self.angles is not None

    @cached_property
    def _angle(self) -> PPoly:
        """Monotonic where the angles are: a gripper does not swing to and fro between two of them."""
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(self.travelled, self.angles)

    def angle(self, s: float) -> tuple[float, float]:
        return float(self._angle(s)), float(self._angle(s, 1))

    def position(self, s: float) -> Array:
        found = self._spline.at(s)
        return np.maximum(found, [-np.inf, 0.0]) if self.above_floor else found

    def rate(self, s: float) -> Array:
        on_floor = self.above_floor and self._spline.at(s)[1] < 0.0
        return self._spline.rate(s) * (1.0, 0.0 if on_floor else 1.0)

    def moved(self, factor: float, x: float) -> Self:
        start, end, points = factor * self.start, factor * self.end, factor * self.points + np.array([x, 0.0])
        return replace(self, start=start, end=end, points=points, travelled=factor * self.travelled)


def pieces_through(parts: Iterable[tuple[str, Array] | tuple[str, Array, Array]]) -> tuple[Interpolated, ...]:
    """Pieces one after the other, from their names, points and, where they are known, angles at these."""
    pieces: list[Interpolated] = []
    for name, points, *angles in parts:
        pieces.append(Interpolated.through(points, pieces[-1].end if pieces else 0.0, name, *angles))
    return tuple(pieces)


def polygon_length(points: Array, start: float = 0.0) -> Array:
    """``start`` plus the length of the polygon through ``points``, shape (n, 2), up to each of them; shape (n,)."""
    return start + np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def turns(points: Array) -> Array:
    """Change of direction at the inner points of a polygon, shape (n, 2), rad; shape (n - 2,)."""
    direction = np.diff(points, axis=0) @ [1.0, 1j]
    return np.abs(np.angle(direction[1:] / direction[:-1]))


@dataclass(frozen=True, eq=False)
class GripperPath(ByValue):
    """A sequence of pieces; the direction may change abruptly between two of them.

    ``name``: name of the path.  ``pieces``: the first starts at 0, each at the end of the one before.  ``stamps``:
    lengths travelled, shape (n,), and the pseudo times there and the rows of the file; by default pseudo time is the
    share of the length.
    ``warnings``: what was changed in a path that was read.  ``gripper``: how it holds the strip.
    """

    name: str
    pieces: tuple[Piece, ...]
    stamps: tuple[Array, Array, Array] | None = None
    warnings: tuple[str, ...] = ()
    gripper: Gripper = "hinge"

    @property
    def length(self) -> float:
        """Length of the path."""
        return self.pieces[-1].end

    @property
    def corners(self) -> Array:
        """Length travelled at the ends of all pieces but the last."""
        return np.array([piece.end for piece in self.pieces[:-1]])

    def pseudo_time(self, s: float) -> float:
        """Pseudo time, the paper's lambda, at the length travelled ``s``."""
        return s / self.length if self.stamps is None else float(np.interp(s, *self.stamps[:2]))

    def row(self, s: float) -> int | None:
        """The row of the file, from 1, before the length travelled ``s``; None for a path from no file."""
        if self.stamps is None:
            return None
        travelled, _, rows = self.stamps
        return int(rows[max(int(np.searchsorted(travelled, s, side="right")) - 1, 0)])

    def position(self, s: float) -> Array:
        """Position (x, z) at the length travelled ``s``."""
        return self._piece(s).position(s)

    def rate(self, s: float) -> Array:
        """Its derivative; at a corner that of the piece that ends there."""
        return self._piece(s).rate(s)

    @property
    def turns(self) -> bool:
        """Whether it says how the gripper turns."""
        return all(piece.turns for piece in self.pieces)

    def angle(self, s: float) -> tuple[float, float]:
        """Rotation of the gripper and its derivative, as of the piece."""
        return self._piece(s).angle(s)

    def _piece(self, s: float) -> Piece:
        return next((piece for piece in self.pieces if s <= piece.end), self.pieces[-1])

    def scaled(self, factor: float, x: float = 0.0) -> GripperPath:
        """The same path with all lengths multiplied, as from L* to metres, then shifted by ``x`` along the floor."""
        stamps = None if self.stamps is None else (factor * self.stamps[0], *self.stamps[1:])
        return replace(self, pieces=tuple(piece.moved(factor, x) for piece in self.pieces), stamps=stamps)

    def sampled(self, spacing: float) -> tuple[Array, Array]:
        """Lengths travelled, shape (n,), and positions, shape (n, 2), at most ``spacing`` apart, with all corners.

        Examples
        --------
        >>> from stripfold.paths.geometric import triangular
        >>> s, positions = triangular(2.0).sampled(1.0)
        >>> len(s), positions[2].round(12).tolist()
        (5, [0.0, 1.0])
        """
        travelled: list[float] = [0.0]
        for piece in self.pieces:
            count = int(np.ceil((piece.end - piece.start) / spacing * (1.0 - 1e-12)))
            travelled += list(np.linspace(piece.start, piece.end, count + 1)[1:])
        s = np.array(travelled)
        return s, np.array([self.position(float(value)) for value in s])
