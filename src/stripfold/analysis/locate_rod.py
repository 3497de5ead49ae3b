"""The end of the rod's advance from the elastica's state, with the lift-off as an unknown.

Near the end lambda is a smooth function of the free length l; lambda_c is where its derivative vanishes, unless the
clearance of the sag does so first.  Lengths in L*.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np

from stripfold import elastica
from stripfold.analysis.static import End, StripModel
from stripfold.arrays import Array
from stripfold.errors import SolveError
from stripfold.models.free_rod import FreeRod, FreeState, Guess
from stripfold.roots import root

SIZE = 0.1
"""Element length at refinement one, L*."""
MESH_ERROR = 4e-5
"""Usual relative error of lambda_c with these elements (docs/method.md)."""
LEFT = 0.2
"""Error estimate as a share of the change from a mesh half as fine; a fifteenth at order four."""
LEAST = 8
"""Smallest number of elements."""
STEP = 0.1
"""Steps of the free length in the search for the end, L*."""
FARTHEST = 2.0
"""Largest distance of the free length from the elastica's, L*; twice that of the thickest strip allowed."""
TOLERANCE = 1e-5
"""Tolerance of the free length at the end, L*: the error of lambda_c is about its square."""
THICKER = 0.05
"""Thickness up to which the elastica's state is a good guess, L*; thicker rods are computed in such steps."""
SHORTER = (8.0, 0.05)
"""The rod's free length at the end is less than the elastica's by up to (a + b z^2) h^2, L*."""


class ElasticaPrediction(NamedTuple):
    """The elastica at a height: its states without horizontal force and at the end of the advance, and if it snaps."""

    height: float
    first: elastica.State
    last: elastica.State
    snap: bool

    @classmethod
    def at(cls, height: float) -> ElasticaPrediction:
        """From the elastica."""
        end = elastica.critical(height)
        return cls(height, elastica.state_no_horizontal_force(height), end.state, end.snap)

    def end(self, length: float) -> End:
        """The event that ends the advance of a strip of this length, L*."""
        if self.last.length >= length:
            return End.LIFTED
        return End.SNAP if self.snap else End.TOUCH


@dataclass(frozen=True)
class Found:
    """The end of the advance; lengths in L*.

    Attributes
    ----------
    end
        How it ends.
    lam
        Advance there: lambda_c where ``end`` is a snap.
    upper
        Upper bound of lambda_c, from the slope beside the maximum: lambda is concave there.
    lambda_0
        Advance without horizontal force.
    free_length
        Of the part off the floor, at the end.
    size
        Length of its elements.
    free_part
        Its state there, shape (m, 3): distance from the grasped end, x, z; the last is the lift-off.
    """

    end: End
    lam: float
    upper: float
    lambda_0: float
    free_length: float
    size: float
    free_part: Array = field(repr=False)

    @property
    def slack(self) -> float:
        """Width of the bracket of lambda on this mesh, L*."""
        return self.upper - self.lam


def run(strip: StripModel, prediction: ElasticaPrediction, refinement: float) -> Found:
    """Find where the advance ends, on elements of ``refinement`` times :data:`SIZE`.

    Raises
    ------
    SolveError
        When a state cannot be computed, as for rods thicker than about a quarter of L*, or no end is near the
        predicted one.
    """
    count = max(round(prediction.last.length / (SIZE * refinement)), LEAST)
    ends = np.linspace(0.0, 1.0, count + 1)

    def rod_of(thickness: float) -> FreeRod:
        return FreeRod.of(strip.length, thickness, prediction.height, ends)

    rod = rod_of(strip.thickness)
    shorter = SHORTER[0] + SHORTER[1] * prediction.height**2
    start = _thickened(
        rod_of, prediction.last, strip.thickness, lambda h: {"length": prediction.last.length - shorter * h**2}
    )
    first = _thickened(rod_of, prediction.first, strip.thickness, lambda _: {"force": 0.0})
    branch = _Branch(rod, start)
    at = branch.zero(branch.slope, start.length)
    if branch.clearance(at) <= 0.0:
        end, at = End.TOUCH, branch.zero(branch.clearance, min(start.length, at))
    else:
        end = End.LIFTED if at >= strip.length else End.SNAP
    ended = branch.state(at)
    lam = rod.advance(ended)
    beside = at - TOLERANCE
    upper = rod.advance(branch.state(beside)) + 2.0 * TOLERANCE * branch.slope(beside)
    return Found(end, lam, max(lam, upper), rod.advance(first), at, at / count, rod.bent(ended))


def _thickened(
    rod_of: Callable[[float], FreeRod],
    prediction: elastica.State,
    thickness: float,
    given: Callable[[float], dict[str, float]],
) -> FreeState:
    """The state of a rod with this free length or force, from the elastica's through those of thinner rods."""
    guess: Guess | None = None
    for h in (*np.arange(THICKER, thickness, THICKER), thickness):
        rod = rod_of(h)
        state = rod.solve(guess or rod.from_elastica(prediction), **given(h))
        guess = rod.guess(state)
    return state


class _Branch:
    """States by their free length, each computed from the previous one."""

    def __init__(self, rod: FreeRod, state: FreeState) -> None:
        self._rod, self._state = rod, state

    def state(self, length: float) -> FreeState:
        if length != self._state.length:
            self._state = self._rod.solve(self._rod.moved(self._state, length), length=length)
        return self._state

    def slope(self, length: float) -> float:
        """d lambda / d l."""
        return self._rod.slope(self.state(length))

    def clearance(self, length: float) -> float:
        """Height of the sag; a sag appears at the gripper, at its height."""
        return min(self._rod.clearance(self.state(length)), self._rod.height)

    def zero(self, falling: Callable[[float], float], start: float) -> float:
        """The zero of a falling function of the length, searched for from ``start``."""
        # Evaluate each length once: computed from another state, the sign next to the zero may differ.
        falling = cache(falling)
        sign = 1.0 if falling(start) > 0.0 else -1.0
        length = start
        while abs(length - start) < FARTHEST:
            before, length = length, length + sign * STEP
            if sign * falling(length) <= 0.0:
                return root(falling, before, length, TOLERANCE)
        raise SolveError("the advance does not end near where that of the elastica does", parameter=start)
