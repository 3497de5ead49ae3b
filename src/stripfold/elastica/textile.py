"""Shapes that textile tests measure: the cantilever, the folded loop and loops that hang (docs/physics.md, section 4).

Folded: theta = pi, Z = 0 and k = 0 at landing; the first integral then forces F_x = 0.  A strip of thickness t lands on
itself at Z = t, with F_x = -t / 2.  The equations have more roots, with self-intersecting loops; the guess below leads
to the one that is a fold.

Hanging, with both ends held together (Peirce, J. Text. Inst. 21 (1930) T377, with the elastica in place of his
approximations): in a pear the ends point downwards, in a heart upwards.  Of one half, from the clamp to the lowest
point, where there is no vertical force, in units of its length, whose cube in L*^3 is ``a``::

    theta'' = F_x sin(theta) - a (s - 1) cos(theta),    X(1) = 0
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stripfold.base.arguments import number
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError, NewtonError, SolveError
from stripfold.base.material import GRAVITY
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._system import FORCE_X, LENGTH, end_angle, fixed, no_end_force, no_lift_off_moment, solve
from stripfold.elastica.state import State

MAX_LENGTH = 60.0


def cantilever(length: float) -> State:
    """A strip clamped horizontally at s = 0, free at s = l (1e-3 to 60 L*), drooping under its weight.

    Z is negative below the clamp; ``droop_angle`` is the angle of the chord.

    Raises InvalidInputError: ``length`` outside its range or not a number; SolveError: no convergence.

    Examples
    --------
    >>> round(float(np.degrees(cantilever(2.000350).droop_angle)), 4)
    41.5
    """
    length = number("length", length, ", in units of L*", (1e-3, MAX_LENGTH))
    l = min(length, 1.0)  # noqa: E741
    y = np.concatenate([np.zeros(24), [0.0, -l, l]])
    while True:
        e = solve(y, (fixed(FORCE_X, 0.0), no_end_force, fixed(LENGTH, l)))
        if l == length:
            return State._from(e)
        # Continuation in the length: from a straight strip Newton's method converges for short ones only.
        l, y = min(length, 1.5 * l), e.y  # noqa: E741


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
    return _loop(*GUESS, number("thickness", thickness, ", in units of L*", (0.0, 0.5)))


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
    length = number("height_m", height_m, ", in m") / folded_loop().height
    return 1.0 / (number("gravity", gravity, ", in m s^-2") * length**3)


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
    length = number("strip_length", strip_length, ", in units of L*", (loop.arc + loop.offset, 1e12))
    return (length - loop.arc + loop.offset) / 2.0


ENDS = {"heart": (0.5 * np.pi, -np.pi), "pear": (-0.5 * np.pi, -np.pi)}
"""Angles at the clamp and at the lowest point, rad."""
BULGE = {"heart": 0.0, "pear": 1.2}
"""Of the guess without weight: how far its angle bends back, rad."""
NODES = 96
STEP = 0.01
"""Change of the height over the half's length from one solution to the next; least one by the weight, below which it
says too little about L*."""
WEIGHTS = 0.02, 4000.0
"""Least and largest ``a``: a loop of half an L* is hardly bent by its weight, one of 32 L* is nearly a double strip
that hangs straight."""


def eta_b_from_hanging_loop(kind: str, length: float, height: float) -> float:
    """Weight-to-bending-stiffness ratio, m^-4 s^2, of a strip that hangs as a loop.

    ``kind``: "heart" or "pear"; ``length``, ``height``: of the strip between the clamp's edges, and from these to the
    loop's lowest point, m.  Raises InvalidInputError: another kind, or a height of a loop whose weight hardly bends it
    or lets it hang almost straight.

    Examples
    --------
    >>> round(eta_b_from_hanging_loop("heart", 0.2, 0.07), 1)
    13018.3
    """
    if kind not in ENDS:
        raise InvalidInputError("loop", kind, " or ".join(ENDS))
    half = 0.5 * number("length", length, ", in m")
    wanted = number("height", height, ", in m", (0.0, 2.0 * half)) / half
    return _weight(kind, wanted, half) / (GRAVITY * half**3)


def hanging_loop(kind: str, weight: float, gap: float = 0.0) -> Array:
    """x and z of one half of a loop that hangs, from the clamp to its lowest point, shape (201, 2), at equal distances.

    Lengths over the half's.  ``kind``: "heart" or "pear"; ``weight``: ``a``, from 0.02 to 4000; ``gap``: distance of
    the middle of an end from the axis, half of the strip's thickness.  Raises NewtonError: there is no such loop.
    """
    weights, known = _known(kind)
    guess = known[int(np.argmin(np.abs(np.log(weights / weight))))]
    g, angle = grid(NODES), _angle(kind, _solved(kind, guess, weight=weight, gap=gap))
    places = np.column_stack([gap + g.integral @ np.cos(angle), g.integral @ np.sin(angle)])
    return g.interpolate(places, np.linspace(0.0, 1.0, 201))


@lru_cache
def _known(kind: str) -> tuple[Array, Array]:
    """Values of ``a``, shape (n,), and the solutions with them, each found from the one before."""
    weights, values = np.geomspace(*WEIGHTS, 40), [_without_weight(kind)]
    for weight in weights:
        values.append(_solved(kind, values[-1], weight=float(weight)))
    return weights, np.array(values[1:])


def _without_weight(kind: str) -> Array:
    values = np.zeros(NODES + 2)
    values[:NODES] = -BULGE[kind] * np.pi**2 * np.sin(np.pi * grid(NODES).nodes)
    return _solved(kind, values)


def _weight(kind: str, wanted: float, half: float) -> float:
    """``a`` of the height over the half loop's length, in steps from the loop without weight."""
    height, values = round(wanted * half, 9), _without_weight(kind)
    depth = _depth(kind, values) + STEP
    if wanted < depth:
        raise InvalidInputError("height", height, f"at least {depth * half:.4g} m", "take a longer strip")
    while values[-1] <= WEIGHTS[1]:
        values = _solved(kind, values, depth)
        if depth == wanted:
            return float(values[-1])
        depth = min(depth + STEP, wanted)
    raise InvalidInputError("height", height, f"at most {depth * half:.4g} m", "take a shorter strip")


def _depth(kind: str, values: Array) -> float:
    """Of the lowest point below the clamp."""
    return -float(grid(NODES).integral[-1] @ np.sin(_angle(kind, values)))


def _angle(kind: str, values: Array) -> Array:
    g = grid(NODES)
    first, last = ENDS[kind]
    return first + (last - first) * g.nodes + _twice(values[:NODES])


def _twice(second: Array) -> Array:
    """The function with this second derivative that vanishes at both ends."""
    g = grid(NODES)
    twice = g.integral @ (g.integral @ second)
    return np.asarray(twice - np.multiply.outer(g.nodes, twice[-1]))


def _solved(kind: str, values: Array, depth: float | None = None, weight: float = 0.0, gap: float = 0.0) -> Array:
    """theta'' at the nodes, F_x and ``a``, by Newton's method: of a loop of this ``depth``, or of this ``weight``."""
    g = grid(NODES)
    matrix = _twice(np.eye(NODES))
    for _ in range(40):
        angle = _angle(kind, values)
        sin, cos, ahead = np.sin(angle), np.cos(angle), g.nodes - 1.0
        force, a = values[-2:]
        ends = [gap + g.integral[-1] @ cos, a - weight]
        right = np.concatenate([values[:NODES] - force * sin + a * ahead * cos, ends])
        slopes = np.zeros((NODES + 2, NODES + 2))
        slopes[:NODES, :NODES] = np.eye(NODES) - (force * cos + a * ahead * sin)[:, None] * matrix
        slopes[:NODES, -2], slopes[:NODES, -1] = -sin, ahead * cos
        slopes[-2, :NODES] = -(g.integral[-1] * sin) @ matrix
        slopes[-1, -1] = 1.0
        if depth is not None:
            right[-1] = -(g.integral[-1] @ sin) - depth
            slopes[-1] = np.append(-(g.integral[-1] * cos) @ matrix, [0.0, 0.0])
        change = np.linalg.solve(slopes, -right)
        turn = float(np.abs(matrix @ change[:NODES]).max())
        values = values + min(1.0, 0.5 / max(turn, 1e-12)) * change
        if turn < 1e-9:
            return np.asarray(values)
    raise NewtonError("Newton's method on a hanging loop did not converge", residuals=[turn])
