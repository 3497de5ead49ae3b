"""A gripper path: smooth pieces between corners, parametrised by the length travelled.

Lengths in L*, in the frame of the model: origin mid-strip, z up, the flat strip grasped at x = -length/2 and held at
+length/2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from stripfold.arrays import Array


@dataclass(frozen=True)
class Piece:
    """A smooth part of a path.

    ``start``, ``end``: length travelled at its ends, L*.  ``position``, ``rate``: functions of the length travelled:
    position (x, z), and its derivative, of about unit length.  ``name``: name of the phase.
    """

    start: float
    end: float
    position: Callable[[float], Array]
    rate: Callable[[float], Array]
    name: str

    @classmethod
    def through(cls, points: Array, start: float, name: str) -> Piece:
        """A cubic spline through ``points``, shape (n, 2), over :func:`polygon_length`; a line through two."""
        travelled = polygon_length(points, start)
        ends = float(travelled[0]), float(travelled[-1])
        if len(points) == 2:
            along = (points[1] - points[0]) / (ends[1] - ends[0])
            return cls(*ends, lambda s: points[0] + (s - ends[0]) * along, lambda _: along, name)
        from scipy.interpolate import make_interp_spline

        spline = make_interp_spline(travelled, points, k=min(3, len(points) - 1))
        rate = spline.derivative()
        return cls(*ends, lambda s: np.asarray(spline(s)), lambda s: np.asarray(rate(s)), name)


def pieces_through(parts: Iterable[tuple[str, Array]]) -> tuple[Piece, ...]:
    """Pieces one after the other, from their names and points."""
    pieces: list[Piece] = []
    for name, points in parts:
        pieces.append(Piece.through(points, pieces[-1].end if pieces else 0.0, name))
    return tuple(pieces)


def polygon_length(points: Array, start: float = 0.0) -> Array:
    """``start`` plus the length of the polygon through ``points``, shape (n, 2), up to each of them; shape (n,)."""
    return start + np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


@dataclass(frozen=True)
class GripperPath:
    """A sequence of pieces; the direction may change abruptly between two of them.

    ``name``: name of the path.  ``pieces``: the first starts at 0, each at the end of the one before.  ``stamps``:
    lengths travelled, shape (n,), and the pseudo times there and the rows of the file; by default pseudo time is the
    share of the length.
    ``warnings``: what was changed in a path that was read.
    """

    name: str
    pieces: tuple[Piece, ...]
    stamps: tuple[Array, Array, Array] | None = None
    warnings: tuple[str, ...] = ()

    @property
    def length(self) -> float:
        """Length of the path, L*."""
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
        """Position (x, z) at the length travelled ``s``, L*."""
        return self._piece(s).position(s)

    def rate(self, s: float) -> Array:
        """Its derivative; at a corner that of the piece that ends there."""
        return self._piece(s).rate(s)

    def _piece(self, s: float) -> Piece:
        return next((piece for piece in self.pieces if s <= piece.end), self.pieces[-1])

    def scaled(self, factor: float) -> GripperPath:
        """The same path with all lengths multiplied: of one path in metres, that in another L*."""

        def piece(of: Piece) -> Piece:
            def position(s: float) -> Array:
                return factor * of.position(s / factor)

            return Piece(factor * of.start, factor * of.end, position, lambda s: of.rate(s / factor), of.name)

        stamps = None if self.stamps is None else (factor * self.stamps[0], *self.stamps[1:])
        return GripperPath(self.name, tuple(piece(of) for of in self.pieces), stamps, self.warnings)

    def shifted(self, x: float) -> GripperPath:
        """The same path elsewhere on the floor, L*."""

        def piece(of: Piece) -> Piece:
            return replace(of, position=lambda s: of.position(s) + np.array([x, 0.0]))

        return replace(self, pieces=tuple(piece(of) for of in self.pieces))

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
