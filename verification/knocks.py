"""Knocks on a hanging strip in time: how much kinetic energy makes it fall, and whether it comes back.

The strip rests in its stable state and is struck along its softest mode, downwards, with the gripper held.  Without
damping the least energy that makes it fall is compared with the static barrier.  With damping a knock that throws the
sag on the floor is followed to rest: within the bistable range the sag stays there, with less advance the strip comes
back.  On the rod; lengths in L*, energies per width in rho_a g L*^2.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.ask.prediction import ElasticaPrediction, snap
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.follow import contact_branch
from stripfold.follow.contact import touches
from stripfold.follow.contact_set import on_nodes
from stripfold.follow.statics import StripModel
from stripfold.solve import dynamics
from stripfold.solve.dynamics import Moving, TimeEvent, TimeOptions, TimeState
from stripfold.solve.problem import Point
from stripfold.solve.schemes import Damping
from stripfold.strip.problem import StripProblem
from verification.common import Progress, table
from verification.numbers import Facts, Number

ROOM = 8.0
"""Length of the strip beyond the height of the gripper, L*."""
PERIODS = 2.0
"""Duration after which an undamped strip that has not touched is held, in periods of its mode."""
STRONG, SETTLED = 0.5, 150.0
"""Energy of a knock that throws the sag on the floor, and the time to rest with :data:`DAMPED`, sqrt(L*/g)."""
DAMPED = Damping(0.3, 0.02)


class Struck(NamedTuple):
    """A stable state of a strip and its softest mode, downwards."""

    problem: StripProblem
    point: Point
    mode: Array

    def knocked(self, energy: float, damping: Damping, tolerance: float, until: TimeEvent) -> tuple[float, bool]:
        """Distance of the last state after a knock of this energy from the first, and whether the sag has touched."""
        problem, point = self.problem, self.point
        v = sqrt(2.0 * energy / float(self.mode @ (problem.mass @ self.mode))) * self.mode
        first = dynamics.start(problem, point.q, v, point.lam, point.state.active)
        options = TimeOptions(first=0.02, largest=1.0, tolerance=tolerance)
        drive = Moving(point.lam, 0.0)
        states = list(dynamics.march(problem, first, drive, damping, None, options, [until]))
        touched = any(touches(problem.model, state) for state in states)
        return problem.model.largest_move(point.q, states[-1].q), touched

    def falls(self, energy: float) -> bool:
        """Whether the sag touches after a knock, without damping, before it comes back through the state at rest."""
        row = self.problem.mass @ self.mode
        duration = PERIODS * 2.0 * pi / sqrt(float(self.point.eigenvalues[0]))

        def ended(state: TimeState) -> bool:
            back = state.t > 1.0 and float(row @ (state.q - self.point.q)) < 0.0
            return touches(self.problem.model, state) or state.t > duration or back

        return self.knocked(energy, Damping(), 1e-6, TimeEvent(ended))[1]


def at_rest(height: float, distance: float, thickness: float, refinement: float) -> Struck:
    """The stable state at a distance from lambda_c; raises SolveError where there is none."""
    strip = StripModel(height + ROOM, thickness, kind="rod")
    found = snap(strip, ElasticaPrediction.at(height), refinement)
    guess, _ = found.limit.beside(-sqrt(2.0 * distance / -found.limit.bend.lam))
    at = contact_branch.solved(found.problem, guess, found.lam - distance)
    problem, point = on_nodes(at, refinement)
    if point.negatives:
        raise SolveError("the state is not stable on the mesh of the motion", parameter=point.lam)
    return Struck(problem, point, -np.sign(point.mode[problem.model.middle[:, 1]].sum()) * point.mode)


def run(
    height: float = 5.0,
    thickness: float = 0.0594,
    refinement: float = 1.0,
    distances: Sequence[float] = (0.01, 0.04, 0.1),
    bisections: int = 4,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Knock strips at ``distances`` from lambda_c, some within the bistable range and some not.

    Dataset over ``distance``: ``held`` and ``fell``, the bracket of the least energy that makes the strip fall over the
    static barrier, nan beyond the bistable range; ``away`` and ``touched`` after a strong knock with damping.
    """
    found = elastica.bistable_range(height)
    if found is None:
        raise SolveError(f"no snap at z = {height:g}")
    rows = []
    for distance in distances:
        struck = at_rest(height, distance, thickness, refinement)
        barrier = found.barrier(found.critical.advance - distance)
        held, fell = np.nan, np.nan
        if np.isfinite(barrier):
            held, fell = 0.5, 2.0
            if struck.falls(held * barrier) or not struck.falls(fell * barrier):
                raise SolveError("the energy that makes the strip fall is not near the barrier", parameter=distance)
            for _ in range(bisections):
                middle = sqrt(held * fell)
                held, fell = (held, middle) if struck.falls(middle * barrier) else (middle, fell)
        away, touched = struck.knocked(STRONG, DAMPED, 1e-4, TimeEvent(lambda state: state.t > SETTLED))
        rows.append({"distance": distance, "held": held, "fell": fell, "away": away, "touched": float(touched)})
        if progress:
            progress(str(rows[-1]))
    return table("distance", rows, {"height": height, "thickness": thickness, "width": found.width})


def facts(d: xr.Dataset) -> Facts:
    """The energy that makes a strip fall over the barrier, and where a strip comes to rest that was thrown down."""
    within = d.distance.values < d.attrs["width"]
    return {
        "z": d.attrs["height"],
        "threshold": np.sqrt(d.held * d.fell).max(),
        "held": d.held.min(),
        "fell": d.fell.max(),
        "back": d.away.values[~within].max(),
        "stays": d.away.values[within].min(),
        "touched": (d.touched == 1.0).all(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("knock_threshold", "threshold", "1", "brackets within 0.95 and 1.1",
            "least kinetic energy of a knock along the softest mode that makes a hanging strip fall in time, without "
            "damping, over its static energy barrier, rod, z = {z:g} L*: brackets from {held:.3f} to {fell:.3f}",
            lambda f: f.held > 0.95 and f.fell < 1.1),
        Number("knock_return", "back", "L*", "< 1e-3 L*; within the range the sag stays on the floor",
            "distance from its first state of a strip below its bistable range that comes to rest after a knock that "
            "threw its sag on the floor; within the range: {stays:.2g} L*", lambda f: f.stays > 0.1 and f.touched),
    ),
}
# fmt: on
