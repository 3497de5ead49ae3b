"""The heavy elastica through a measured centreline: a strip that hangs out of a clamp, all of its shape used.

From the free end inwards no force is unknown: at the distance u from it the moment is that of the weight of the piece
beyond.  So any visible piece that ends at the free end can be fitted, with whatever slope it starts; where the clamp
is does not matter.  With the angle phi of the tangent below the image's horizontal, lengths in the visible length and
``a = (length / L*)^3``::

    dm/du = a u cos(phi),    dphi/du = -m

A textile need not be linear.  The same shape with ``m ~ kappa^n`` asks it: n = 1 is a linear strip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from stripfold.arrays import Array
from stripfold.errors import TrackingError
from stripfold.vision.sections import tangents

LEVEL_SD = float(np.radians(0.25))
"""How well the picture's columns are plumb, rad: a levelled tripod."""
MISFIT = 0.02
"""Largest root mean square of the residuals that is still this shape, in the visible length."""
REPLICATES = 2000
RATIOS = np.geomspace(0.02, 3e4, 40)
"""(length / L*)^3 from which the fit starts: of the best of them."""
EXPONENTS = np.array([0.35, 0.6, 1.0, 1.6, 2.6])
# Of the unknowns: ln a, turn of the free end (rad), its place across (pixels), ln n.
LOWEST, HIGHEST = np.array([[-7.0, -1.5, -np.inf, -1.8], [13.0, 1.5, np.inf, 1.8]])
NEEDED = "a strip that hangs under its weight from a clamp to a free end below it"


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted shape.

    Parameters
    ----------
    ratio
        ``(length / L*)^3``, of the secant stiffness at the largest curvature where the law is not linear.
    exponent
        n of ``m ~ kappa^n``; 1 where it was not asked.
    ratios, exponents
        Shape (k,): drawn with resampled residuals.
    points
        Shape (n, 2), pixels: the fitted curve beside the measured points.
    residual
        Shape (n,), measured less fitted, normal to the curve, pixels.
    sd
        Shape (n,), of the fitted curve normal to itself, pixels.
    curvature
        Largest curvature of the fitted curve, 1 / pixel.
    effective
        How many residuals there are that know nothing of each other.
    """

    ratio: float
    exponent: float
    ratios: Array
    exponents: Array
    points: Array
    residual: Array
    sd: Array
    curvature: float
    effective: float

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, pixels."""
        return float(np.sqrt(np.mean(self.residual**2)))


def fit(points: Array, sd: Array, tip_sd: float, *, linear: bool = True, source: str = "picture") -> Fit:
    """Fit the shape of a strip whose free end is the last of ``points``.

    Parameters
    ----------
    points
        Shape (n, 2), pixels, equally spaced, y downwards, from the clamp to the free end.
    sd
        Shape (n,), their standard deviations: those that are worse known than most count less.
    tip_sd
        How well the free end is known along the strip, pixels.
    linear
        Whether n = 1; otherwise it is fitted.
    source
        Name for errors.

    Raises
    ------
    TrackingError
        No heavy elastica is like this shape.
    """
    weights = np.minimum(float(np.median(sd)) / sd, 1.0)
    problem = _Problem(points, weights, linear=True)
    values = _start(problem, np.column_stack([np.log(RATIOS), np.zeros((len(RATIOS), 2))]), source)
    if not linear:
        reference = max(float(problem.curves(values[None])[1][0]) * problem.length, 1e-3)
        problem = _Problem(points, weights, linear=False, reference=reference)
        grid = np.meshgrid(values[0] + np.linspace(-0.9, 0.9, 7), np.log(EXPONENTS))
        ratio, exponent = (axis.ravel() for axis in grid)
        other = np.tile(values[1:], (len(ratio), 1))
        values = _start(problem, np.column_stack([ratio, other, exponent]), source)
    bounds = (LOWEST[: len(values)], HIGHEST[: len(values)])
    found = least_squares(problem, values, jac=problem.jacobian, x_scale=problem.sizes, bounds=bounds, max_nfev=60)
    values = found.x
    if found.active_mask[:2].any():
        raise TrackingError(source, "no heavy elastica has this shape", NEEDED)
    residual = problem(values)
    if np.sqrt(np.mean(residual**2)) > MISFIT * problem.length:
        found_text = f"the best heavy elastica is {100 * np.sqrt(np.mean(residual**2)) / problem.length:.1f} % off"
        raise TrackingError(source, found_text, NEEDED)
    draws, effective = _draws(problem, values, found.jac, residual, tip_sd)
    curves, curvature = problem.curves(values[None])
    spread = np.std(draws @ found.jac.T, axis=0) / weights
    exponent = 1.0 if linear else float(np.exp(values[3]))
    exponents = np.ones(len(draws)) if linear else np.exp(np.clip(values[3] + draws[:, 3], -3.0, 3.0))
    # The law is written for a reference curvature; the secant at the largest one is what can be pictured.
    largest = (float(curvature[0]) * problem.length / problem.reference) ** (1.0 - exponent)
    ratios = largest * np.exp(np.clip(values[0] + draws[:, 0], -20.0, 20.0))
    return Fit(
        largest * float(np.exp(values[0])),
        exponent,
        ratios,
        exponents,
        curves[0],
        residual / weights,
        spread,
        float(curvature[0]),
        effective,
    )


class _Problem:
    """Residuals of the unknowns: ln a, turn of the free end, its place across it, ln n.

    Its place along the strip is given: what a shape says of it is less than what its picture does.
    """

    def __init__(
        self,
        points: Array,
        weights: Array,
        linear: bool,
        *,
        tilt: float = 0.0,
        moved: float = 0.0,
        reference: float = 1.0,
    ) -> None:
        self.points, self.weights, self.linear = points, weights, linear
        self.tilt, self.moved, self.reference = tilt, moved, reference
        steps = np.hypot(*np.diff(points, axis=0).T)
        self.length = float(steps.sum())
        # From the free end to the clamp, in the visible length.
        self.u = np.concatenate([[0.0], np.cumsum(steps[::-1])]) / self.length
        k = max(len(points) // 20, 2)
        way = points[-1] - points[-1 - k]
        self.angle = float(np.arctan2(way[1], way[0]))
        self.end = np.array([np.cos(self.angle), np.sin(self.angle)])
        self.sizes = np.array([0.1, 0.02, 1.0, 0.1])[: 3 if linear else 4]

    def __call__(self, values: Array) -> Array:
        """Distances normal to the curve, weighted, shape (n,), pixels."""
        return np.asarray(self.residuals(values[None])[0])

    def jacobian(self, values: Array) -> Array:
        """Forward differences, all columns at once; shape (n, p)."""
        steps = 1e-4 * self.sizes
        both = self.residuals(np.concatenate([values[None], values + np.diag(steps)]))
        return np.asarray(((both[1:] - both[0]) / steps[:, None]).T)

    def residuals(self, values: Array) -> Array:
        """Of several sets of unknowns, shape (k, p): shape (k, n)."""
        curves, _ = self.curves(values)
        rows = []
        for curve in curves:
            along, away = tangents(curve), self.points - curve
            rows.append(self.weights * (away[:, 1] * along[:, 0] - away[:, 0] * along[:, 1]))
        return np.array(rows)

    def curves(self, values: Array) -> tuple[Array, Array]:
        """Curves at the measured arc lengths, shape (k, n, 2), pixels, and their largest curvatures, shape (k,)."""
        ratio = np.exp(values[:, 0])
        power = np.ones(len(values)) if self.linear else np.exp(-values[:, 3])

        def bend(m: Array) -> Array:
            return m if self.linear else np.sign(m) * self.reference * (np.abs(m) / self.reference) ** power

        def rates(u: float, y: Array) -> Array:
            plumb = np.cos(y[1] + self.tilt)
            return np.array([ratio * u * plumb, -bend(y[0]), -np.cos(y[1]), -np.sin(y[1])])

        y = np.zeros((4, len(values)))
        y[1] = self.angle + values[:, 1]
        path = [y]
        # Runge and Kutta's fourth order from point to point: with a hundred points a is right to 2e-4 up to 7 L*.
        for before, after in zip(self.u[:-1], self.u[1:], strict=True):
            h = after - before
            k1 = rates(before, y)
            k2 = rates(before + 0.5 * h, y + 0.5 * h * k1)
            k3 = rates(before + 0.5 * h, y + 0.5 * h * k2)
            k4 = rates(after, y + h * k3)
            y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            path.append(y)
        states = np.array(path[::-1])
        across = np.array([-self.end[1], self.end[0]])
        places = self.points[-1] + self.moved * self.end + values[:, 2, None] * across
        curves = places[:, None] + self.length * states[:, 2:].transpose(2, 0, 1)
        return curves, np.max(np.abs(bend(states[:, 0])), axis=0) / self.length


def _start(problem: _Problem, values: Array, source: str) -> Array:
    """The best of many ratios (and exponents), shape (k, p), each with the best free end: shape (p,).

    The residual has more than one valley, and a narrow one where a long strip hangs.
    """
    k = len(values)
    for step in range(8):
        moved = [values + np.eye(values.shape[1])[i] * 1e-4 * problem.sizes[i] for i in (1, 2)]
        rows = problem.residuals(np.concatenate([values, *moved])).reshape(3, k, -1)
        slopes = (rows[1:] - rows[0]) / (1e-4 * problem.sizes[1:3, None, None])
        if step < 3:
            # First so that the curve leads to the measured clamp: from there Gauss and Newton find the rest.
            rows, slopes = rows[:, :, :1], slopes[:, :, :1]
        normal = np.einsum("ikn,jkn->kij", slopes, slopes) + 1e-6 * np.eye(2)
        change = np.linalg.solve(normal, -np.einsum("ikn,kn->ki", slopes, rows[0])[..., None])[..., 0]
        values = values.copy()
        values[:, 1:3] += np.clip(change, *(np.outer([-1.0, 1.0], [0.3, 0.1 * problem.length])))
        values[:, 1] = np.clip(values[:, 1], -1.4, 1.4)
    losses = np.mean(problem.residuals(values) ** 2, axis=1)
    best = int(np.argmin(losses))
    if not np.sqrt(losses[best]) < 0.1 * problem.length:
        raise TrackingError(source, "no heavy elastica is near this shape", NEEDED)
    return np.asarray(values[best])


def _draws(problem: _Problem, values: Array, jacobian: Array, residual: Array, tip_sd: float) -> tuple[Array, float]:
    """Deviations of the unknowns, shape (k, p), from residuals resampled in blocks; and the number of free ones.

    Neighbours on a strip are off together: blocks as long as that keep it so.  The free end's place along the strip
    and the plumb line are drawn too.
    """
    rng = np.random.default_rng(0)
    n, p = jacobian.shape
    block = _correlation(residual)
    effective = max(n / block, p + 1.0)
    centred = (residual - residual.mean()) * np.sqrt(effective / (effective - p + 0.5))
    count = int(np.ceil(n / block))
    # Circular blocks: the ends of the strip are drawn as often as its middle.  Either sign is as likely.
    index = (rng.integers(0, n, size=(REPLICATES, count, 1)) + np.arange(block)).reshape(REPLICATES, -1)[:, :n] % n
    sign = np.repeat(rng.choice([-1.0, 1.0], size=(REPLICATES, count)), block, axis=1)[:, :n]
    inverse = np.linalg.pinv(jacobian)
    draws = (centred[index] * sign) @ inverse.T
    for tilt, moved in ((LEVEL_SD, 0.0), (0.0, tip_sd)):
        other = _Problem(
            problem.points, problem.weights, problem.linear, tilt=tilt, moved=moved, reference=problem.reference
        )
        draws -= rng.normal(size=(REPLICATES, 1)) * (inverse @ (other(values) - residual))
    return np.asarray(draws), float(effective)


def _correlation(residual: Array) -> int:
    """Over how many points residuals are off together: twice the summed autocorrelation up to its first zero."""
    n = len(residual)
    centred = residual - residual.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return 1
    total = 1.0
    for lag in range(1, n // 2):
        rho = float(centred[lag:] @ centred[:-lag]) / power
        if rho <= 0.0:
            break
        total += 2.0 * rho
    return int(np.clip(np.ceil(total), 2, n // 4))
