"""A gripper path: smooth pieces between corners, each a function of the length travelled.

Lengths in L*, in the frame of the model: origin mid-strip, z up, the flat strip grasped at x = -length/2 and held at
+length/2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from stripfold.arrays import Array


@dataclass(frozen=True)
class Piece:
    """A smooth part of a path.

    Parameters
    ----------
    start, end
        Length travelled at its ends, L*.
    position, rate
        Functions of the length travelled: place (x, z), and its derivative, of about unit length.
    name
        Name of the phase.
    """

    start: float
    end: float
    position: Callable[[float], Array]
    rate: Callable[[float], Array]
    name: str

    @classmethod
    def through(cls, points: Array, start: float, name: str) -> Piece:
        """A spline through ``points``, shape (n, 2), by :func:`polygon_length`; a straight line through two."""
        travelled = polygon_length(points, start)
        spline = make_interp_spline(travelled, points, k=min(3, len(points) - 1))
        rate = spline.derivative()
        return cls(
            float(travelled[0]),
            float(travelled[-1]),
            lambda s: np.asarray(spline(s)),
            lambda s: np.asarray(rate(s)),
            name,
        )


def polygon_length(points: Array, start: float = 0.0) -> Array:
    """Length of the polygon through ``points``, shape (n, 2), up to each of them, plus ``start``; shape (n,)."""
    return start + np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


@dataclass(frozen=True)
class GripperPath:
    """Pieces one after the other; between two of them the direction may jump.

    Parameters
    ----------
    name
        What to call it.
    pieces
        The first starts at 0, each where the one before ends.
    stamps
        Lengths travelled, shape (n,), and the pseudo times there; without them it is the share of the length.
    """

    name: str
    pieces: tuple[Piece, ...]
    stamps: tuple[Array, Array] | None = None

    @property
    def length(self) -> float:
        """Length of the path, L*."""
        return self.pieces[-1].end

    @property
    def corners(self) -> Array:
        """Length travelled at the places where two pieces meet."""
        return np.array([piece.end for piece in self.pieces[:-1]])

    def pseudo_time(self, s: float) -> float:
        """Pseudo time after the length ``s``: the paper's lambda."""
        if self.stamps is None:
            return s / self.length
        return float(np.interp(s, *self.stamps))

    def piece_at(self, s: float) -> Piece:
        """The piece at a length travelled; at a corner the one that ends there."""
        for piece in self.pieces:
            if s <= piece.end:
                return piece
        return self.pieces[-1]

    def position(self, s: float) -> Array:
        """Place (x, z) after the length ``s``, L*."""
        return self.piece_at(s).position(s)

    def sampled(self, spacing: float) -> tuple[Array, Array]:
        """Lengths travelled, shape (n,), and places, shape (n, 2), at most ``spacing`` apart; corners are among them.

        Examples
        --------
        >>> from stripfold.paths import triangular
        >>> s, places = triangular(2.0).sampled(1.0)
        >>> len(s), places[2].round(12).tolist()
        (5, [0.0, 1.0])
        """
        travelled: list[float] = [0.0]
        for piece in self.pieces:
            count = int(np.ceil((piece.end - piece.start) / spacing * (1.0 - 1e-12)))
            travelled += list(np.linspace(piece.start, piece.end, count + 1)[1:])
        s = np.array(travelled)
        return s, np.array([self.position(float(value)) for value in s])
