"""States of a half fold whose lying length is kept: the strip lifted, carried over, and laid down.

What the R-path is made of (docs/physics.md, section 5).  The free part is lifted without horizontal
force until it is as long as in the folded state; it keeps that length while the gripper carries it
over, first free, then touching the lower layer at a point that rolls on to where the folded state
lands; the rest is laid down without horizontal force.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import root

from stripfold.arrays import Array
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._checks import number
from stripfold.elastica._continuation import Family, Point, at_height, finer, locate, march, point_at, polish
from stripfold.elastica._system import (
    FORCE_X,
    LENGTH,
    NODE_COUNTS,
    SCALARS,
    TOLERANCE,
    fixed,
    no_lift_off_moment,
    solve,
)
from stripfold.elastica.branch import _guess
from stripfold.elastica.state import State
from stripfold.errors import NewtonError, SolveError

SHORTEST = 0.2
"""Free length, L*, below which a lifted strip is as good as flat: its gripper is 7e-5 L* high."""
SPACING = 0.1
"""Largest distance of neighbouring states, in free length or in the branch's arc length."""
LONGEST = 80.0
"""Longest free part that has been tried, L*."""


@dataclass(frozen=True, eq=False)
class Touching:
    """A free part that touches the lower layer at one point.

    Parameters
    ----------
    loop
        From lift-off to the touch; unlike in other states its curvature does not vanish at its end.
    upper
        From the touch to the gripper, arc length from the touch, position in the loop's frame.
    reaction
        Concentrated reaction of the floor at the touch.
    """

    loop: State
    upper: State
    reaction: float

    @property
    def gripper(self) -> tuple[float, float]:
        """Position (X, Z) of the gripper."""
        return self.upper.gripper


def lifting(length: float) -> Iterator[State]:
    """States without horizontal force, their free part growing from :data:`SHORTEST` to ``length``, L*.

    Raises
    ------
    InvalidInputError
        A length out of range.
    SolveError
        No convergence.
    """
    length = number("length", length, 0.0, LONGEST, ", in units of L*")
    if length <= SHORTEST:
        return
    count = int(np.ceil((length - SHORTEST) / SPACING)) + 1
    y: Array | None = None
    for free in np.linspace(SHORTEST, length, count):
        if y is None:
            y = _guess(free**4 / 24.0, 24)
        y = y.copy()
        y[LENGTH] = free
        e = solve(y, (no_lift_off_moment, fixed(FORCE_X, 0.0), fixed(LENGTH, free)))
        y = e.y
        yield State._from(e)


def carrying(length: float) -> Iterator[State]:
    """States with a free part of ``length``, L*, from no horizontal force to the first touch of the lower layer.

    Both are included.  Marched in the arc length of the branch: gripper and force turn on the way.

    Raises
    ------
    InvalidInputError, SolveError
        As in :func:`lifting`.
    """
    family, before = _first(length)
    yield State._from(before.e)
    for point in march(before, family, step=SPACING, max_step=SPACING, tolerance=TOLERANCE):
        if _clearance(point) <= 0.0:
            yield State._from(polish(locate(before, point, family, _clearance), family, _clearance).e)
            return
        yield State._from(point.e)
        before = point


def _first(length: float) -> tuple[Family, Point]:
    """The family of states with this free length, and its first point: no horizontal force yet."""
    length = number("length", length, SHORTEST, LONGEST, ", in units of L*")
    family = Family((no_lift_off_moment, fixed(LENGTH, length)), f"a free length of {length:g}")
    *_, first = lifting(length)
    force = np.zeros(first.s.size + SCALARS)
    force[FORCE_X] = -1.0  # carrying over pushes the strip
    e = solve(first._unknowns(), (*family.conditions, fixed(FORCE_X, 0.0)))
    return family, finer(point_at(e, family, force), family, TOLERANCE)


def critical_on_the_way(length: float) -> State:
    """The state of :func:`carrying` at which it becomes unstable: the gripper is at lambda_c of its height.

    There the family of states at this height (:func:`.x_axis_branch`) has its largest advance, found from this
    family's side: an independent way to lambda_c(z), and the point where the R-path meets the stability boundary.

    Raises
    ------
    InvalidInputError, SolveError
        As in :func:`lifting`, or the state stays stable up to its touch.
    """
    family, before = _first(length)
    way = np.sign(_advance_rate(before))

    def stable(point: Point) -> float:
        return float(way * _advance_rate(point))

    for point in march(before, family, step=SPACING, max_step=SPACING, tolerance=TOLERANCE):
        if stable(point) <= 0.0:
            return State._from(polish(locate(before, point, family, stable), family, stable).e)
        if _clearance(point) <= 0.0:
            break
        before = point
    raise SolveError(f"with a free length of {length:g} L* the strip touches before it becomes unstable")


def _advance_rate(point: Point) -> float:
    """Change of lambda along the branch of constant height through a point, up to a sign common to all points.

    The sign of the bordered determinant orients that branch alike at all its neighbours.
    """
    forward = np.zeros(point.e.y.size)
    forward[LENGTH] = 1.0
    along = point_at(point.e, at_height(State._from(point.e).gripper[1]), forward)
    return along.rate * along.orientation


def _clearance(point: Point) -> float:
    """Clearance that is continuous: a sag appears at the gripper, at its height."""
    state = State._from(point.e)
    return min(state.gripper[1], state.clearance)


def rolling(touch: State) -> Iterator[Touching]:
    """From the first touch to where the strip begins to lie flat: the curvature at the touch goes to zero.

    Parameters
    ----------
    touch
        The last of :func:`carrying`.

    Raises
    ------
    SolveError
        No convergence.
    """
    sag = touch.sag
    if sag is None:
        raise SolveError("the state does not sag: it cannot touch")
    start = float(touch.at(sag.s).curvature)
    count = int(np.ceil(abs(start) / SPACING)) + 1
    problem = _TwoParts(touch.length, 48)
    y = problem.guess(touch, sag.s)
    for share in np.linspace(1.0, 0.0, count):
        problem, y = problem.solve(y, share * start)
        yield problem.state(y)


@dataclass(frozen=True)
class _TwoParts:
    """The collocated problem of a free part with one touch.

    Unknowns: ``u = d^2 theta / d sigma^2`` at the nodes of loop and upper part, F_x, F_0, the reaction R, the
    loop's length.  At the touch theta = pi, Z = 0, and the curvature is continuous and given.
    """

    length: float
    n: int

    def split(self, y: Array) -> tuple[Array, Array, float, float, float, float]:
        n = self.n
        force_x, force_0, reaction, loop = (float(value) for value in y[2 * n :])
        return y[:n], y[n : 2 * n], force_x, force_0, reaction, loop

    def angles(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """theta and d theta / d sigma of both parts; the angles at the touch and the free end are built in."""
        g = grid(self.n)
        u, w, *_ = self.split(y)
        twice = g.integral @ (g.integral @ u)
        theta = twice + g.nodes * (np.pi - twice[-1])
        slope = g.integral @ u - twice[-1] + np.pi
        return theta, slope, np.pi + g.angle @ w, g.slope @ w

    def residual(self, y: Array, curvature: float) -> Array:
        g = grid(self.n)
        u, w, force_x, force_0, reaction, loop = self.split(y)
        upper = self.length - loop
        theta, slope, phi, phi_slope = self.angles(y)
        behind = force_0 + loop - reaction
        return np.concatenate(
            [
                u - loop**2 * (force_x * np.sin(theta) - (force_0 + loop * g.nodes) * np.cos(theta)),
                w - upper**2 * (force_x * np.sin(phi) - (behind + upper * g.nodes) * np.cos(phi)),
                [slope[0], loop * (g.integral[-1] @ np.sin(theta))],
                [slope[-1] / loop - curvature, phi_slope[0] / upper - curvature],
            ]
        )

    def jacobian(self, y: Array, _: float) -> Array:
        """Derivative of :meth:`residual`."""
        g, n = grid(self.n), self.n
        force_x, force_0, reaction, loop = self.split(y)[2:]
        upper = self.length - loop
        theta, slope, phi, phi_slope = self.angles(y)
        twice = g.integral @ g.integral
        angle, rate = twice - np.outer(g.nodes, twice[-1]), g.integral - twice[-1]
        vertical = force_0 + loop * g.nodes
        vertical_2 = force_0 + loop - reaction + upper * g.nodes
        sin, cos, sin2, cos2 = np.sin(theta), np.cos(theta), np.sin(phi), np.cos(phi)
        out = np.zeros((y.size, y.size))
        out[:n, :n] = np.eye(n) - loop**2 * (force_x * cos + vertical * sin)[:, None] * angle
        out[:n, -4], out[:n, -3] = -(loop**2) * sin, loop**2 * cos
        out[:n, -1] = -2.0 * loop * (force_x * sin - vertical * cos) + loop**2 * g.nodes * cos
        rows = slice(n, 2 * n)
        out[rows, rows] = np.eye(n) - upper**2 * (force_x * cos2 + vertical_2 * sin2)[:, None] * g.angle
        out[rows, -4], out[rows, -3], out[rows, -2] = -(upper**2) * sin2, upper**2 * cos2, -(upper**2) * cos2
        out[rows, -1] = 2.0 * upper * (force_x * sin2 - vertical_2 * cos2) + upper**2 * (1.0 - g.nodes) * cos2
        out[-4, :n] = rate[0]
        out[-3, :n], out[-3, -1] = loop * (g.integral[-1] * cos) @ angle, g.integral[-1] @ sin
        out[-2, :n], out[-2, -1] = rate[-1] / loop, -slope[-1] / loop**2
        out[-1, rows], out[-1, -1] = g.slope[0] / upper, phi_slope[0] / upper**2
        return out

    def guess(self, touch: State, at: float) -> Array:
        nodes = grid(self.n).nodes

        def second(start: float, length: float) -> Array:
            s = start + length * nodes
            theta = touch.at(np.minimum(s, touch.length)).theta
            change = touch.force_x * np.sin(theta) - (touch.force_0 + s) * np.cos(theta)
            return np.asarray(length**2 * change)

        parts = [second(0.0, at), second(at, touch.length - at)]
        return np.concatenate([*parts, [touch.force_x, touch.force_0, 0.0, at]])

    def solve(self, y: Array, curvature: float) -> tuple[_TwoParts, Array]:
        """Solve, with more nodes where they are needed."""
        found = root(self.residual, y, args=(curvature,), jac=self.jacobian, tol=1e-13)
        worst = float(np.abs(self.residual(found.x, curvature)).max())
        if not worst < 1e-9 * max(1.0, float(np.abs(found.x).max())):
            raise NewtonError(
                "the strip that touches the lower layer was not found",
                residuals=[worst],
                details={"length": self.length, "curvature": curvature},
            )
        g, n = grid(self.n), self.n
        if max(g.tail(found.x[:n]), g.tail(found.x[n : 2 * n])) < TOLERANCE or n >= NODE_COUNTS[-3]:
            return self, np.asarray(found.x)
        finer_nodes = NODE_COUNTS[NODE_COUNTS.index(n) + 1]
        g2 = grid(finer_nodes)
        parts = [g.interpolate(found.x[i : i + n], g2.nodes) for i in (0, n)]
        return replace(self, n=finer_nodes).solve(np.concatenate([*parts, found.x[2 * n :]]), curvature)

    def state(self, y: Array) -> Touching:
        _, _, force_x, force_0, reaction, loop = self.split(y)
        theta, slope, phi, phi_slope = self.angles(y)
        first = _state(theta, slope / loop, force_x, force_0, loop, (0.0, 0.0))
        upper = self.length - loop
        behind = force_0 + loop - reaction
        second = _state(phi, phi_slope / upper, force_x, behind, upper, first.gripper)
        return Touching(first, second, reaction)


def _state(
    theta: Array,
    curvature: Array,
    force_x: float,
    force_0: float,
    length: float,
    start: tuple[float, float],
) -> State:
    g = grid(theta.size)
    x = start[0] + length * (g.integral @ np.cos(theta))
    z = start[1] + length * (g.integral @ np.sin(theta))
    arrays = (length * g.nodes, x, z, theta, curvature)
    for array in arrays:
        array.flags.writeable = False
    return State(*arrays, force_x=force_x, force_0=force_0, length=length)
