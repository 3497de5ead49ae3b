"""The folded state: a loop between the lying layer and the landed one, and the material its height reveals.

docs/physics.md, section 4: theta = pi, Z = 0 and k = 0 at landing; the first integral then forces F_x = 0.  A strip of
thickness t lands on itself at Z = t, with F_x = -t / 2.  The equations have more roots, with self-intersecting loops;
the guess below leads to the one that is a fold.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stripfold.base.errors import SolveError
from stripfold.base.material import GRAVITY
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._checks import number, positive
from stripfold.elastica._system import FORCE_X, end_angle, fixed, no_lift_off_moment, solve
from stripfold.elastica.state import State

GUESS = 3.745, 4.683
"""Guess of the lift-off reaction and the arc length of the loop."""


@dataclass(frozen=True, eq=False)
class FoldedLoop:
    """The folded state, dimensionless; lengths in L*, reactions per width in the weight of a length L*.

    The X axis points from the lying layer to the loop.
    """

    height: float
    """Largest height H of the loop."""
    arc: float
    """Arc length from lift-off to landing."""
    lift_off_reaction: float
    landing_reaction: float
    bulge: float
    """Largest X of the loop."""
    offset: float
    """Distance of the landing point behind the lift-off point."""
    state: State


@lru_cache(maxsize=16)
def folded_loop(thickness: float = 0.0) -> FoldedLoop:
    """The folded state; its upper layer lands ``thickness`` (0 to 0.5 L*) above the lower one.

    Raises InvalidInputError: ``thickness`` outside its range or not a number; SolveError: no convergence.

    Examples
    --------
    >>> loop = folded_loop()
    >>> round(loop.height, 6), round(loop.arc, 6), round(loop.offset, 6)
    (0.906597, 4.68347, 2.48462)
    """
    return _loop(*GUESS, number("thickness", thickness, 0.0, 0.5, ", in units of L*"))


def _loop(reaction: float, arc: float, thickness: float = 0.0) -> FoldedLoop:
    """The root reached from a guess of the lift-off reaction and the arc length."""
    # An initial-value problem from lift-off by the semi-implicit Euler method is good enough for a guess.
    steps = 400
    step = arc / steps
    theta, k = np.zeros(steps + 1), 0.0
    for i in range(steps):
        k += step * (reaction - i * step) * np.cos(theta[i])
        theta[i + 1] = theta[i] + step * k
    nodes = grid(48).nodes
    second = arc**2 * (reaction - arc * nodes) * np.cos(np.interp(nodes, np.linspace(0.0, 1.0, steps + 1), theta))
    y = np.concatenate([second, [0.0, -reaction, arc]])
    # With F_x = -Z / 2 the first integral implies the height at landing: as a condition it would make the system
    # singular where it is zero, so it serves as a check.
    state = State._from(solve(y, (fixed(FORCE_X, -0.5 * thickness), no_lift_off_moment, end_angle(np.pi))))
    if abs(state.z[-1] - thickness) > 1e-10:
        raise SolveError("the folded state does not land on the floor", details={"z": float(state.z[-1])})
    extremes_x, extremes_z = (state.at(state.zeros(wave(state.theta))) for wave in (np.cos, np.sin))
    return FoldedLoop(
        height=float(extremes_z.z.max()),
        arc=state.length,
        lift_off_reaction=state.reaction,
        landing_reaction=state.force_0 + state.length,
        bulge=float(extremes_x.x.max()),
        offset=-state.gripper[0],
        state=state,
    )


def eta_b_from_fold_height(height_m: float, gravity: float = GRAVITY) -> float:
    """Weight-to-bending-stiffness ratio, m^-4 s^2, of a folded strip: ``eta_b = H^3 / (g h^3)``.

    H is the dimensionless height of :func:`folded_loop`, h = ``height_m`` that of the loop's mid-surface above that of
    the lower layer, m; ``gravity`` is in m s^-2. The relative error is three times that of h.

    Raises InvalidInputError: a value that is not a positive finite number.

    Examples
    --------
    >>> round(eta_b_from_fold_height(1.0), 6)
    0.075958
    """
    length = positive("height_m", height_m, ", in m") / folded_loop().height
    return 1.0 / (positive("gravity", gravity, ", in m s^-2") * length**3)


def half_fold_lying_length(strip_length: float) -> float:
    """Lying length of a half fold with aligned edges, up to lift-off, in L*: ``strip_length / 2 - 1.099425``.

    The strip is at least 7.168090 L* long, where nothing is left for the upper layer.

    Raises InvalidInputError: not a number, or a strip too short for such a fold.

    Examples
    --------
    >>> round(half_fold_lying_length(10.0), 6)
    3.900575
    """
    loop = folded_loop()
    length = number("strip_length", strip_length, loop.arc + loop.offset, 1e12, ", in units of L*")
    return (length - loop.arc + loop.offset) / 2.0
