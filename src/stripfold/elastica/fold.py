"""The folded state: a loop between the lying layer and the landed one; what its height tells.

docs/physics.md, section 4: theta = pi, Z = 0 and k = 0 at landing; the first integral then forces
F_x = 0.  The equations have more than one root; only one of them does not run through itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from stripfold.arrays import Array
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._checks import number, positive
from stripfold.elastica._system import FORCE_X, end_angle, fixed, no_lift_off_moment, solve
from stripfold.elastica.state import State
from stripfold.errors import SolveError

STANDARD_GRAVITY = 9.81
"""Gravitational acceleration used by default, m s^-2."""

# Lift-off reaction and arc from which the two roots are sought.
_GUESSES = ((3.745, 4.683), (1.732, 6.663))


@dataclass(frozen=True, eq=False)
class FoldedLoop:
    """A folded state, dimensionless; lengths in L*, reactions per width in the weight of a length L*.

    Parameters
    ----------
    height
        Largest height H of the loop.
    arc
        Arc length from lift-off to landing.
    lift_off_reaction, landing_reaction
        Concentrated reactions at the two ends of the loop.
    bulge
        How far the loop reaches beyond the lift-off point.
    offset
        How far the landing point is behind the lift-off point.
    self_intersecting
        Whether the loop runs through itself: then it is a root of the equations, but no fold.
    state
        The loop as a state.
    """

    height: float
    arc: float
    lift_off_reaction: float
    landing_reaction: float
    bulge: float
    offset: float
    self_intersecting: bool
    state: State


def _highest(state: State, values: Array, slope: Array, name: str) -> float:
    """Largest value of X or Z: at the nodes, or between them where its slope vanishes."""
    best = float(values.max())
    wave = {"x": np.cos, "z": np.sin}[name]
    # The slope vanishes to rounding at the ends, with either sign: leave them out.
    for i in np.flatnonzero(slope[:-1] * slope[1:] < -1e-12):
        s = brentq(lambda s: float(wave(state.at(s).theta)), state.s[i], state.s[i + 1], xtol=1e-13)
        best = max(best, float(getattr(state.at(s), name)))
    return best


def _crosses_itself(state: State, segments: int = 400) -> bool:
    """Whether two segments of the polygon through the curve cross, neighbours left out."""
    profile = state.at(np.linspace(0.0, state.length, segments + 1))
    points = profile.x + 1j * profile.z
    start, end = points[:-1, None], points[1:, None]

    def side(p: NDArray[np.complex128]) -> Array:
        # Cross product of each segment (row) with the way from its start to each p (column).
        return np.asarray(np.sign(((end - start).conj() * (p[None, :] - start)).imag))

    apart = side(points[:-1]) * side(points[1:]) < 0
    crossing = np.triu(apart & apart.T, k=2)
    return bool(crossing.any())


@lru_cache(maxsize=1)
def fold_roots() -> tuple[FoldedLoop, ...]:
    """The first two roots of the equations of the folded state, valid or not.

    Raises
    ------
    SolveError
        No convergence.

    Examples
    --------
    >>> [(round(root.height, 4), root.self_intersecting) for root in fold_roots()]
    [(0.9066, False), (1.5548, True)]
    """
    return tuple(_root(*guess) for guess in _GUESSES)


def _shape(reaction: float, arc: float, steps: int = 400) -> Array:
    """Tangent angle at ``steps`` + 1 equal distances, marched from lift-off: good enough to start from."""
    h = arc / steps
    theta, k = np.zeros(steps + 1), 0.0
    for i in range(steps):
        k += h * (reaction - i * h) * np.cos(theta[i])
        theta[i + 1] = theta[i] + h * k
    return theta


def _root(reaction: float, arc: float) -> FoldedLoop:
    nodes = grid(48).nodes
    theta = np.interp(nodes, np.linspace(0.0, 1.0, 401), _shape(reaction, arc))
    second = arc**2 * (reaction - arc * nodes) * np.cos(theta)
    guess = np.concatenate([second, [0.0, -reaction, arc]])
    # With F_x = 0, Z = 0 at landing follows from the first integral; asking for it too would make the
    # equations dependent.  It is a check instead.
    state = State._from(solve(guess, (fixed(FORCE_X, 0.0), no_lift_off_moment, end_angle(np.pi))))
    if abs(state.z[-1]) > 1e-10:
        raise SolveError("the folded state does not land on the floor", details={"z": float(state.z[-1])})
    return FoldedLoop(
        height=_highest(state, state.z, np.sin(state.theta), "z"),
        arc=state.length,
        lift_off_reaction=state.reaction,
        landing_reaction=state.force_0 + state.length,
        bulge=_highest(state, state.x, np.cos(state.theta), "x"),
        offset=-state.gripper[0],
        self_intersecting=_crosses_itself(state),
        state=state,
    )


def folded_loop() -> FoldedLoop:
    """The folded state: the root that does not run through itself.

    Raises
    ------
    SolveError
        No convergence, or no root without self-intersection.

    Examples
    --------
    >>> loop = folded_loop()
    >>> round(loop.height, 6), round(loop.arc, 6), round(loop.offset, 6)
    (0.906597, 4.68347, 2.48462)
    """
    for root in fold_roots():
        if not root.self_intersecting:
            return root
    raise SolveError("every root of the folded state runs through itself")


def gravity_length(eta_b: float, gravity: float = STANDARD_GRAVITY) -> float:
    """Gravity-bending length L* = (eta_b g)^(-1/3), m (docs/physics.md, section 1).

    Parameters
    ----------
    eta_b
        Weight-to-bending-stiffness ratio, m^-4 s^2.
    gravity
        Gravitational acceleration, m s^-2.

    Raises
    ------
    InvalidInputError
        A value that is not a positive finite number.

    Examples
    --------
    >>> round(gravity_length(3780.0), 5)
    0.02999
    """
    return float((positive("eta_b", eta_b, ", in m^-4 s^2") * positive("gravity", gravity, ", in m s^-2")) ** (-1 / 3))


def eta_b_from_fold_height(height_m: float, gravity: float = STANDARD_GRAVITY) -> float:
    """Weight-to-bending-stiffness ratio from the height of the loop of a folded strip, m^-4 s^2.

    ``eta_b = H^3 / (g h^3)`` with the dimensionless height H of :func:`folded_loop`, so a relative
    error of the measured height counts three times.

    Parameters
    ----------
    height_m
        Height h of the loop's mid-surface above that of the lower layer, m.
    gravity
        Gravitational acceleration, m s^-2.

    Raises
    ------
    InvalidInputError
        A value that is not a positive finite number.

    Examples
    --------
    >>> round(eta_b_from_fold_height(1.0), 6)
    0.075958
    """
    length = positive("height_m", height_m, ", in m") / folded_loop().height
    return 1.0 / (positive("gravity", gravity, ", in m s^-2") * length**3)


def half_fold_lying_length(strip_length: float) -> float:
    """Length that lies flat under a half fold with aligned edges, up to lift-off, in L*.

    Equal to ``strip_length / 2 - 1.099425``: the lower layer, the loop and the upper layer add up to
    the strip, and the layers end at the same place.

    Parameters
    ----------
    strip_length
        Length of the strip in L*; at least 7.168090, where the upper layer has no length left.

    Raises
    ------
    InvalidInputError
        Not a number, or a strip too short for such a fold.

    Examples
    --------
    >>> round(half_fold_lying_length(10.0), 6)
    3.900575
    """
    loop = folded_loop()
    shortest = loop.arc + loop.offset
    length = number("strip_length", strip_length, shortest, 1e12, ", in units of L*")
    return (length - loop.arc + loop.offset) / 2.0
