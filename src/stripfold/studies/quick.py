"""One critical point of the rod in a fraction of a second: the branch is entered shortly before its end.

The elastica foretells a state on the way and where the lift-off will be; from there the rod finds its own equilibrium,
its own branch and its own maximum, with all guards.  Lengths in L*.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from .. import elastica, planning
from ..errors import SolveError
from ..models.model import Model
from ..problem import AlongX, StripProblem
from ..solve import continuation
from ..solve.continuation import StepOptions
from .static import Strip, XRun, no_horizontal_force, to_the_end, two_agree

Array = NDArray[np.float64]

BEFORE = 1.0
"""How far before the elastica's end of the advance the branch is entered: a rod as thick as is allowed is critical half
of that before."""
STEPS = StepOptions(first=0.1, largest=0.5, slow_below=0.2, wanted_iterations=10, corner=inf)
"""Each tooth of the contact is followed: there are few on the way that is left."""
FINEST = 0.2
"""Smallest factor on the element lengths to which close calls are refined."""
TOLERANCE = 1e-5
"""Width of the bracket of lambda_c, L*: far below what the mesh leaves open."""
MESH_ERROR = 0.3
"""Relative error of lambda_c over the square of the element length near the lift-off, L*^-2 (docs/numerics.md)."""
SAME_STATE = 0.3
"""Largest distance between the state that was foretold and the rod's own: other branches are farther."""


@dataclass(frozen=True)
class Foretold:
    """What the elastica says of a strip at a height.

    Attributes
    ----------
    first, entry
        The state without horizontal force, and the one at which the rod enters its branch.
    sweep
        Where the lift-off goes from there.
    """

    length: float
    height: float
    first: elastica.State
    entry: elastica.State
    sweep: planning.Sweep

    @classmethod
    def of(cls, length: float, height: float) -> Foretold:
        """Ask the elastica."""
        end = elastica.critical(height)
        last = end.state or (end.touch.state if end.touch else None)
        assert last is not None
        first = entry = elastica.state_no_horizontal_force(height)
        for state in elastica.x_axis_branch(height):
            if state.advance > last.advance - BEFORE:
                break
            entry = state
        return cls(length, height, first, entry, planning.Sweep(entry.length, last.length))

    def unknowns(self, model: Model, state: elastica.State) -> Array:
        """A state of the elastica as the model's unknowns."""
        free = model.s < state.length
        at = state.at(np.clip(state.length - model.s, 0.0, state.length))
        x = np.where(free, state.length - at.x, model.s) - self.length / 2.0
        position = np.stack([x, np.where(free, np.maximum(at.z, 0.0), 0.0)], axis=1)
        return model.unknowns_of(position, np.where(free, -at.theta, 0.0))


def lambda_0(model: Model, foretold: Foretold) -> float:
    """Advance of the gripper without horizontal force."""
    problem = StripProblem(model, AlongX(foretold.height))
    guess = foretold.unknowns(model, foretold.first)
    state = no_horizontal_force(problem, guess, foretold.height)
    return float(state.q[model.middle[0, 0]])


def run(strip: Strip, foretold: Foretold, refinement: float) -> XRun:
    """Follow the branch from shortly before its end to it, on a mesh planned for that; on finer ones for close calls.

    Raises
    ------
    SolveError
        When a state or the branch cannot be computed, or the state found is not the one that was foretold.
    """
    return two_agree(lambda r: _on_mesh(strip, foretold, r), refinement, FINEST)


def usual_error(found: XRun) -> float:
    """Error of lambda_c that a mesh like this usually has, L*: two meshes can agree by chance."""
    shortest = float(np.diff(found.problem.model.ends).min())
    return MESH_ERROR * shortest**2 * found.last.lam


def _on_mesh(strip: Strip, foretold: Foretold, refinement: float) -> XRun:
    model = strip.model(planning.boundaries(strip.length, foretold.sweep, refinement, strip.sizes))
    problem = StripProblem(model, AlongX(foretold.height))
    guess = foretold.unknowns(model, foretold.entry)
    lying = problem.bounded[guess[problem.bounded] <= 0.0]
    first = continuation.start(problem, guess, foretold.entry.advance, lying, 1.0, STEPS)
    if model.largest_move(guess, first.q) > SAME_STATE:
        raise SolveError("the state found is not the one that the elastica foretells", parameter=first.lam)
    return to_the_end(problem, first, 0.0, STEPS, TOLERANCE)
