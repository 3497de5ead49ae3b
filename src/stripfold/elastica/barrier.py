"""How stable a hanging strip is: the energy barrier against a fall at one height, and the smallest eigenvalue.

Past the maximum of the advance the branch goes back: at an advance below lambda_c the strip has a stable and an
unstable state.  The energy between them is the barrier.  Where the sag of the unstable state touches the lower layer
the branch ends in the landed states, whose advance grows from there: with less advance the strip has no other state to
fall into.  Energies per width in rho_a g L*^2, lengths in L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf, sqrt

import numpy as np

from stripfold.base.errors import InvalidInputError
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._continuation import (
    TOUCH,
    Point,
    advance_gradient,
    at_advance,
    at_height,
    length_gradient,
    located,
    march,
    point_at,
    slope,
    to_event,
    until,
)
from stripfold.elastica._system import FORCE_X, evaluate
from stripfold.elastica.critical_point import critical
from stripfold.elastica.state import State

FIRST_STEP, MAX_STEP = 0.02, 0.2  # in arc length, from the critical point


@dataclass(frozen=True, eq=False)
class BistableRange:
    """The advances at one gripper height at which a strip can hang or lie; make it with :func:`bistable_range`.

    Attributes
    ----------
    z
        Height of the gripper.
    critical
        The critical state, at the largest advance.
    landing
        The unstable state whose sag touches the lower layer, at the smallest advance.
    coefficient
        C of the law near the critical state, barrier = C (lambda_c - lambda)^(3/2).
    """

    z: float
    critical: State
    landing: State
    coefficient: float

    @property
    def width(self) -> float:
        """Difference of the largest and the smallest advance."""
        return self.critical.advance - self.landing.advance

    def pair(self, advance: float) -> tuple[State, State]:
        """The stable and the unstable state with this advance.

        Raises InvalidInputError: an advance outside this range.
        """
        if not self.landing.advance <= advance < self.critical.advance:
            allowed = f"from {self.landing.advance:.9g} to less than {self.critical.advance:.9g} L*"
            raise InvalidInputError("advance", advance, allowed)
        family, event = at_height(self.z), at_advance(advance)
        stable, unstable = (State._from(located(side, family, event, None).e) for side in self._sides)
        return stable, unstable

    def barrier(self, advance: float) -> float:
        """The energy between the two states; ``inf`` where there is no other stable state, 0 past the critical one."""
        if advance >= self.critical.advance:
            return 0.0
        if advance < self.landing.advance:
            return inf
        stable, unstable = self.pair(advance)
        return unstable.energy - stable.energy

    @cached_property
    def _sides(self) -> tuple[list[Point], list[Point]]:
        """The branch from the critical point to the advance of the landing state: stable, unstable."""
        family, lowest = at_height(self.z), at_advance(self.landing.advance)
        e = evaluate(self.critical._unknowns())
        stable, unstable = (
            list(until(march(point_at(e, family, way), family, step=FIRST_STEP, max_step=MAX_STEP), lowest))
            for way in (-length_gradient(e), length_gradient(e))
        )
        return stable, unstable


def bistable_range(z: float) -> BistableRange | None:
    """The bistable range at gripper height ``z`` (0.1 to 100 L*), or None where the strip does not snap.

    Raises InvalidInputError: ``z`` outside its range or not a number; SolveError: a state was not found.

    Examples
    --------
    >>> found = bistable_range(3.0)
    >>> round(found.coefficient, 6), round(found.width, 6)
    (1.080145, 0.009785)
    >>> round(found.barrier(found.critical.advance - 1e-3) / 1e-3**1.5, 3)
    1.08
    """
    point = critical(z)
    if not point.snap:
        return None
    family, e = at_height(point.z), evaluate(point.state._unknowns())
    first = point_at(e, family, length_gradient(e))
    landing = to_event(march(first, family, step=FIRST_STEP, max_step=MAX_STEP), family, TOUCH)[-1]
    return BistableRange(point.z, point.state, State._from(landing.e), barrier_coefficient(point.state))


def barrier_coefficient(critical: State) -> float:
    """C of the law of the barrier (:attr:`BistableRange.coefficient`) from the critical state."""
    e = evaluate(critical._unknowns())
    _, gradient, along = slope(e, advance_gradient, length_gradient)
    # By the free length, in which both are smooth: the advance falls as its square and the force grows in proportion.
    return 4.0 * sqrt(2.0) / 3.0 * abs(float(along[FORCE_X])) / sqrt(-float(gradient() @ along))


def smallest_eigenvalue(state: State) -> float:
    """Smallest eigenvalue of a stable state, g/L*; nan for an unstable one.

    Examples
    --------
    >>> from stripfold.elastica import state_at_advance
    >>> round(smallest_eigenvalue(state_at_advance(3.0, 8.0)), 4)
    0.5952
    """
    from scipy.linalg import LinAlgError, eigh

    g = grid(state.s.size)
    weights, integral = state.length * g.integral[-1], state.length * g.integral
    cos, sin = np.cos(state.theta), np.sin(state.theta)
    # Unknown is v' at the nodes, times the root of the weight: the stiffness is then near the identity.
    angle = integral / np.sqrt(weights)
    moved = [integral @ (part[:, None] * angle) for part in (-sin, cos)]
    tension = weights * (state.force_x * cos + (state.force_0 + state.s) * sin)
    stiffness = np.eye(weights.size) + angle.T @ (tension[:, None] * angle)
    mass = sum(part.T @ (weights[:, None] * part) for part in moved)
    held = np.linalg.qr(np.stack([part[-1] for part in moved], axis=1), mode="complete")[0][:, 2:]
    last = weights.size - 3
    try:
        # The largest of the inverse problem: the mass is nearly singular.
        found = eigh(held.T @ mass @ held, held.T @ stiffness @ held, eigvals_only=True, subset_by_index=(last, last))
    except LinAlgError:
        return float("nan")
    return 1.0 / float(found[0])
