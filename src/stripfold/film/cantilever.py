"""The heavy elastica through a measured centreline: a strip that hangs out of a clamp, all of its shape used.

From the free end inwards no force is unknown: at the distance u from it the moment is that of the weight of the piece
beyond.  So any visible piece that ends at the free end can be fitted, whatever its slope at the start; where the clamp
is does not matter.  A known slope at the clamp can be given: a strip whose law is not linear then has another eta_b, as
by Peirce's method, for which the strip is clamped horizontally.

With the angle phi of the tangent below the image's horizontal, lengths relative to the visible length and
``a = (length / L*)^3``::

    dm/du = a u cos(phi),    dphi/du = -m

A textile need not be linear: ``m ~ kappa^n`` is fitted to the same shape; n = 1 is a linear strip.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import TrackingError
from stripfold.base.material import GRAVITY
from stripfold.files.reporting import Rows, metres
from stripfold.film.fitted import LAW_SD, WIDTH_SD
from stripfold.film.line import Centreline, find
from stripfold.film.line_kernels import arc_length, normals, tangents
from stripfold.film.segmentation import enclosed_share, piece_along, second_edge
from stripfold.film.shape import Depth, ShapeFit, correlation_length

POINTS = 100
MIN_SAG = 0.0075
"""Least distance of a hanging strip from the straight line through its ends, relative to its length: what is straighter
can be the edge of anything."""
SHORTEST = 0.6
"""Least length of a hanging strip, L*, by its own fit: a shorter one is straight, and what is bent is an edge's end."""
STRAIGHT = "let 1 to 4 L* of it hang; is it a ruler or an edge? take it out of the picture"
MAX_ENCLOSED = 0.25
"""Largest share of a hanging strip along which its two sides are different pieces of the background: a clamp may close
off some of it, but both are connected around the free end."""
CLAMP, MAX_BESIDE = 0.2, 0.25
"""Share of a hanging strip that may be held by something of its tone; largest share of the rest of what is connected
with the strip that is not a part of it: 0.11 in a photograph with hairs, 0.38 in a shadow that halves eta_b."""
SLACK, MAX_SLANT = (0.1, 0.5), 0.6
"""Deviation of a band's width from that of a section with both edges, as shares of the face that is seen and of its own
width, and the largest share of a strip that may begin with such ones."""
SLOPE_SD = float(np.radians(0.5))
"""Uncertainty of a slope that is given, rad."""
HOLD = 10.0
"""Weight of a slope that is given: an error of a radian counts as this many lengths at a point."""
MAX_MISFIT = 0.0125
"""Largest root mean square of the residuals over the visible length: just above that of a strip far from linear."""
REPLICATES, PERCENTILES = 2000, (2.5, 97.5)
RATIOS = np.geomspace(0.02, 3e4, 40)
"""Initial values of ``(length / L*)^3``; the fit continues from the best."""
EXPONENTS = np.array([0.35, 0.6, 1.0, 1.6, 2.6])
# Unknowns: ln a, rotation of the free end (rad), its displacement across the strip (pixels), ln n.
LOWER, UPPER = np.array([[-7.0, -1.5, -np.inf, -1.8], [13.0, 1.5, np.inf, 1.8]])
SCALES = np.array([0.1, 0.02, 1.0, 0.1])
NEEDED = "a strip that hangs under its weight from a clamp to a free end below it"


@dataclass(frozen=True, eq=False, kw_only=True)
class Cantilever(ShapeFit):
    """A fitted shape, whose curve has the measured points' arc lengths; pixels.

    ``unit``: L* of the secant stiffness at the largest curvature where the law is not linear.  ``exponent``,
    ``exponents``: n of ``m ~ kappa^n``, 1 where it was not fitted, and the ends of its 95 % interval.  ``sd``: standard
    deviation of the curve, normal to it, shape (n,).  ``curvature``, ``slope``: largest curvature of the curve, 1 /
    pixel, and its angle below the horizontal at the clamp, rad.  ``line``, ``power``: the measured centreline from the
    clamp, and the fit of ``m ~ kappa^n``, where a picture was measured.
    """

    method = "cantilever"
    exponent: float
    exponents: tuple[float, float]
    sd: Array
    curvature: float
    slope: float
    line: Centreline | None = None
    power: Cantilever | None = None

    @property
    def law(self) -> tuple[float, float, float]:
        """n of ``M ~ kappa^n`` and its 95 % interval."""
        assert self.power is not None
        return self.power.exponent, *self.power.exponents

    @property
    def linear(self) -> bool:
        """Whether the shape is that of a linear strip."""
        _, low, high = self.law
        return low <= 1.0 <= high

    def secant(self, share: float, scale: float) -> float:
        """Compute eta_b of the secant stiffness at ``share`` of the largest curvature, m^-4 s^2.

        The stiffness ``M / kappa`` is proportional to ``kappa^(n - 1)``.
        """
        assert self.power is not None
        return share ** (1.0 - self.power.exponent) / (GRAVITY * (self.power.unit * scale) ** 3)

    def rows(self, scale: float) -> Rows:
        assert self.line is not None
        n, lower, upper = self.law
        where = "more at the clamp and less" if n < 1.0 else "less at the clamp and more"
        no = f"no: one eta_b does not describe it, it bends {where} towards its end than a linear strip, or is twisted"
        slope = "below the horizontal at the clamp; eta_b depends on it where the strip is not linear"
        secant = "from a quarter of the largest curvature to all of it"
        law = f"M ~ curvature^n with n = {n:.3g} ({lower:.3g} to {upper:.3g})"
        softest, stiffest = self.secant(0.25, scale), self.secant(1.0, scale)
        return [
            ("length", metres(self.line.length * scale, "that hangs in the picture")),
            ("slope", f"{np.degrees(self.slope):.1f} degrees {slope}"),
            ("linear", f"{'yes' if self.linear else no}; {law}"),
            ("  secant", f"eta_b {softest:.6g} to {stiffest:.6g} m^-4 s^2, {secant}"),
        ]

    def numbers(self, scale: float) -> dict[str, Any]:
        assert self.line is not None
        n, lower, upper = self.law
        return {
            "length": self.line.length * scale,
            "linear": self.linear,
            "exponent": n,
            "exponent_lower": lower,
            "exponent_upper": upper,
            "eta_b_secant": self.secant(1.0, scale),
            "curvature": self.curvature / scale,
            "slope": float(np.degrees(self.slope)),
        }


def measure(image: Picture, source: str, slope: float | None, roll: float, depth: Depth | None = None) -> Cantilever:
    """Fit a hanging strip in an upright picture, grey values of shape (h, w); ``slope`` and ``roll`` as in :func:`fit`.

    ``depth``: what is known of it; without it the strip is taken as seen edge-on.  Raises TrackingError: no strip that
    hangs, or a shape that hardly depends on eta_b.
    """
    face = depth is not None
    line = find(image, points=POINTS, source=source, sag=MIN_SAG, face=face)
    # The free end hangs below the clamp.
    if line.points[0, 1] > line.points[-1, 1]:
        line = line.reversed()
    if line.open_ends[1]:
        found = "the strip's lower end is cut by the picture's border"
        raise TrackingError(source, found, NEEDED, "show all of the strip that hangs")
    enclosed = enclosed_share(image, line.points, line.width, line.bright, face)
    if enclosed > MAX_ENCLOSED:
        found = f"a closed outline: {enclosed:.0%} of the line divide what is enclosed from what is not"
        raise TrackingError(source, found, NEEDED, "let nothing touch the free end, nor the strip itself")
    _, nearest, beside = piece_along(image, line.points, line.width, line.bright, face=face)
    beside = beside[nearest > CLAMP * POINTS]
    if beside.mean() > MAX_BESIDE:
        raise second_edge(float(beside.sum() / (~beside).sum()), source, NEEDED)
    chord = line.points - line.points[0]
    sag = float(np.abs(chord @ normals(line.points[[0, -1]])[0]).max())
    if sag < MIN_SAG * line.length:
        found = f"a line that is bent by {sag / line.length:.1%} of its length"
        raise TrackingError(source, found, f"{MIN_SAG:.2%} or more; {NEEDED}", STRAIGHT)
    own = float(np.median(line.width))
    if depth is not None:
        line, own, depth = _middle(line, depth, source)
    # A frayed or slanted end is known to half of the strip's thickness.
    tip_sd = max(0.5 * own, 1.0)
    shape, power = (
        fit(line.points, line.sd, tip_sd, roll, linear=linear, slope=slope, source=source) for linear in (True, False)
    )
    if line.length < SHORTEST * shape.unit:
        found = f"a line that, as a strip, would be {line.length / shape.unit:.2f} L* long, too short to bend like this"
        raise TrackingError(source, found, f"{SHORTEST:g} L* or more; {NEEDED}", STRAIGHT)
    if depth is not None:
        n = power.exponent
        below, above = (float(np.hypot(np.log(end / n), 1.96 * LAW_SD * depth.share)) for end in power.exponents)
        power = replace(power, exponents=(n * float(np.exp(-below)), n * float(np.exp(above))))
    return replace(shape, line=line, power=power, depth=depth)


def _middle(line: Centreline, depth: Depth, source: str) -> tuple[Centreline, float, Depth]:
    """The middle between both edges of a strip whose face is seen, by the middle of the band; its own width, and what
    is known of the depth with the band's width.
    """
    whole = line
    while True:
        across = normals(line.points)
        aside = depth.aside(line.points, across)
        lower = slice(POINTS // 2, None)
        own, known = depth.fitted(line.width[lower], aside[lower], WIDTH_SD)
        # Where the far edge comes out of the clamp later than the near one, the band begins with a slant.
        expected = own + known.widening * aside
        slack = SLACK[0] * known.widening * aside + SLACK[1] * own + 1.0
        cut = np.flatnonzero((np.abs(line.width - expected) > slack)[: lower.start])
        if not cut.size:
            break
        line = line.between(float(line.arc[cut[-1]] + 0.5 * expected[cut[-1]]), line.length)
        if line.length < (1.0 - MAX_SLANT) * whole.length:
            found = f"both edges of the strip along {line.length / whole.length:.0%} of it"
            raise TrackingError(source, found, f"{1.0 - MAX_SLANT:.0%} or more", "hold the camera in front of it")
    near, far = known.edges(whole.points, line.points, across)
    shift = 0.5 * (near + far)
    crossed = np.flatnonzero(np.isfinite(shift))
    shift = np.interp(np.arange(POINTS), crossed, shift[crossed]) if crossed.size else np.zeros(POINTS)
    return replace(line, points=line.points - shift[:, None] * across), own, known


def fit(
    points: Array,
    sd: Array,
    tip_sd: float,
    roll: float = 0.0,
    *,
    linear: bool = True,
    slope: float | None = None,
    source: str = "picture",
) -> Cantilever:
    """Fit the shape of a strip; ``linear`` sets n = 1, otherwise n is fitted.

    ``points``, ``sd``: equally spaced points from the clamp to the free end, y downwards, shape (n, 2), and their
    standard deviations, shape (n,), pixels; a point's weight is reduced where ``sd`` is above its median.  ``tip_sd``:
    uncertainty of the free end along the strip, pixels; ``roll``: largest error of the vertical, rad.  ``slope``: angle
    below the horizontal at the clamp, rad; None: as the shape has it.  Raises TrackingError: no heavy elastica has this
    shape.
    """
    weights = np.minimum(float(np.median(sd)) / sd, 1.0)
    problem = _Problem(points, weights, linear=True, slope=slope)
    values = _initial(problem, np.column_stack([np.log(RATIOS), np.zeros((len(RATIOS), 2))]), source)
    if not linear:
        reference = max(float(problem.curves(values[None])[1][0]) * problem.length, 1e-3)
        problem = _Problem(points, weights, linear=False, reference=reference, slope=slope)
        grid = np.meshgrid(values[0] + np.linspace(-0.9, 0.9, 7), np.log(EXPONENTS))
        ratio, exponent = (axis.ravel() for axis in grid)
        values = _initial(problem, np.column_stack([ratio, np.tile(values[1:], (len(ratio), 1)), exponent]), source)
    p = len(values)
    found = least_squares(
        problem.residual, values, problem.jacobian, (LOWER[:p], UPPER[:p]), x_scale=SCALES[:p], max_nfev=60
    )
    values = found.x
    of = "" if slope is None else f" with a slope of {np.degrees(slope):.3g} degrees"
    if found.active_mask[:2].any():
        raise TrackingError(source, f"no heavy elastica{of} has this shape", NEEDED)
    n = len(points)
    residual = found.fun[:n]
    misfit = float(np.sqrt(np.mean(residual**2))) / problem.length
    if misfit > MAX_MISFIT:
        raise TrackingError(source, f"the best heavy elastica{of} is {100.0 * misfit:.1f} % off", NEEDED)
    deviations = _bootstrap(problem, values, found.jac, residual, tip_sd, roll)
    curves, curvature, slopes = problem.curves(values[None])
    exponent = 1.0 if linear else float(np.exp(values[3]))
    exponents = np.ones(REPLICATES) if linear else np.exp(np.clip(values[3] + deviations[:, 3], -3.0, 3.0))
    # The law is written for a reference curvature; the secant at the largest one is easier to picture.
    secant = (float(curvature[0]) * problem.length / problem.reference) ** (1.0 - exponent)
    ratios = secant * np.exp(np.clip(values[0] + np.append(deviations[:, 0], 0.0), -20.0, 20.0))
    units = problem.length / np.cbrt(ratios)
    return Cantilever(
        unit=float(units[-1]),
        interval=_interval(units[:-1]),
        exponent=exponent,
        exponents=_interval(exponents),
        curve=curves[0],
        residual=residual / weights,
        sd=np.std(deviations @ found.jac[:n].T, axis=0) / weights,
        curvature=float(curvature[0]),
        slope=float(slopes[0]),
    )


def _interval(samples: Array) -> tuple[float, float]:
    low, high = np.percentile(samples, PERCENTILES)
    return float(low), float(high)


@dataclass(eq=False)
class _Problem:
    """Weighted residuals of the unknowns; ``tilt`` of the vertical, rad, ``shift`` of the free end along the strip.

    That the picture shows better than the shape.  ``reference`` is the curvature at which ``a`` is that of the secant.
    """

    points: Array
    weights: Array
    linear: bool
    tilt: float = 0.0
    shift: float = 0.0
    reference: float = 1.0
    slope: float | None = None
    u: Array = field(init=False)
    length: float = field(init=False)

    def __post_init__(self) -> None:
        self.u = arc_length(self.points[::-1])
        self.length = float(self.u[-1])
        self.u = self.u / self.length

    def residual(self, values: Array) -> Array:
        """Weighted distances normal to the curve, shape (n,), and the error of a slope that is given; pixels."""
        return np.asarray(self.residuals(values[None])[0])

    def jacobian(self, values: Array) -> Array:
        """Forward differences, all columns at once; shape (n, p)."""
        steps = 1e-4 * SCALES[: len(values)]
        both = self.residuals(np.concatenate([values[None], values + np.diag(steps)]))
        return np.asarray(((both[1:] - both[0]) / steps[:, None]).T)

    def residuals(self, values: Array) -> Array:
        """Of several sets of unknowns, shape (k, p): shape (k, n)."""
        rows = []
        curves, _, slopes = self.curves(values)
        for curve in curves:
            along, away = tangents(curve), self.points - curve
            rows.append(self.weights * (away[:, 1] * along[:, 0] - away[:, 0] * along[:, 1]))
        if self.slope is None:
            return np.array(rows)
        return np.column_stack([np.array(rows), HOLD * self.length * (slopes - self.slope)])

    def curves(self, values: Array) -> tuple[Array, Array, Array]:
        """Curves at the measured arc lengths, shape (k, n, 2), pixels; largest curvatures, 1 / pixel, and slopes at the
        clamp, rad, shape (k,).
        """
        ratio = np.exp(values[:, 0])
        power = np.ones(len(values)) if self.linear else np.exp(-values[:, 3])
        end = self.points[-1] - self.points[-1 - max(len(self.points) // 20, 2)]
        end = end / np.hypot(*end)

        def curvature(m: Array) -> Array:
            return m if self.linear else np.sign(m) * self.reference * (np.abs(m) / self.reference) ** power

        def rates(u: float, y: Array) -> Array:
            return np.array([ratio * u * np.cos(y[1] + self.tilt), -curvature(y[0]), -np.cos(y[1]), -np.sin(y[1])])

        y = np.zeros((4, len(values)))
        y[1] = np.arctan2(end[1], end[0]) + values[:, 1]
        path = [y]
        # Fourth-order Runge-Kutta from point to point: with a hundred points a is right to 2e-4 up to 7 L*.
        for before, after in zip(self.u[:-1], self.u[1:], strict=True):
            h = after - before
            k1 = rates(before, y)
            k2 = rates(before + 0.5 * h, y + 0.5 * h * k1)
            k3 = rates(before + 0.5 * h, y + 0.5 * h * k2)
            k4 = rates(after, y + h * k3)
            y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            path.append(y)
        states = np.array(path[::-1])
        free_ends = self.points[-1] + self.shift * end + values[:, 2, None] * np.array([-end[1], end[0]])
        curves = free_ends[:, None] + self.length * states[:, 2:].transpose(2, 0, 1)
        slopes = np.arcsin(np.sin(states[0, 1] + self.tilt))
        return curves, np.max(np.abs(curvature(states[:, 0])), axis=0) / self.length, slopes


def _initial(problem: _Problem, values: Array, source: str) -> Array:
    """The best of many ratios (and exponents), shape (k, p), each with the free end fitted to it: shape (p,).

    The residual has more than one minimum, and a narrow one where a long strip hangs.
    """
    k = len(values)
    steps = 1e-4 * SCALES[1:3]
    for iteration in range(8):
        moved = [values + np.eye(values.shape[1])[i + 1] * steps[i] for i in range(2)]
        rows = problem.residuals(np.concatenate([values, *moved])).reshape(3, k, -1)
        slopes = (rows[1:] - rows[0]) / steps[:, None, None]
        if iteration < 3:
            # First only so that the curve leads to the measured clamp: from there Gauss-Newton finds the rest.
            rows, slopes = rows[:, :, :1], slopes[:, :, :1]
        normal = np.einsum("ikn,jkn->kij", slopes, slopes) + 1e-6 * np.eye(2)
        change = np.linalg.solve(normal, -np.einsum("ikn,kn->ki", slopes, rows[0])[..., None])[..., 0]
        limit = np.array([0.3, 0.1 * problem.length])
        values = values.copy()
        values[:, 1:3] += np.clip(change, -limit, limit)
        values[:, 1] = np.clip(values[:, 1], -1.4, 1.4)
    losses = np.mean(problem.residuals(values)[:, : len(problem.points)] ** 2, axis=1)
    best = int(np.argmin(losses))
    if not np.sqrt(losses[best]) < 0.1 * problem.length:
        raise TrackingError(source, "no heavy elastica is near this shape", NEEDED)
    return np.asarray(values[best])


def _bootstrap(problem: _Problem, values: Array, jacobian: Array, residual: Array, tip_sd: float, roll: float) -> Array:
    """Deviations of the unknowns, shape (replicates, p), by residuals resampled in blocks: neighbours are correlated.

    The free end's place is drawn too; the vertical is off by the largest ``roll``, so the percentiles hold whatever it
    is.
    """
    rng = np.random.default_rng(0)
    n, p = len(residual), jacobian.shape[1]
    block = correlation_length(residual)
    effective = max(n / block, p + 1.0)
    centred = (residual - residual.mean()) * np.sqrt(effective / (effective - p + 0.5))
    count = int(np.ceil(n / block))
    index = (rng.integers(0, n, size=(REPLICATES, count, 1)) + np.arange(block)).reshape(REPLICATES, -1)[:, :n] % n
    sign = np.repeat(rng.choice([-1.0, 1.0], size=(REPLICATES, count)), block, axis=1)[:, :n]
    inverse = np.linalg.pinv(jacobian)
    deviations = (centred[index] * sign) @ inverse[:, :n].T
    if problem.slope is not None:
        error = HOLD * problem.length * SLOPE_SD
        deviations += error * rng.normal(size=(REPLICATES, 1)) * inverse[:, n]
    either_side = rng.choice([-1.0, 1.0], size=(REPLICATES, 1))
    for other, share in (
        (replace(problem, tilt=roll), either_side),
        (replace(problem, shift=tip_sd), rng.normal(size=(REPLICATES, 1))),
    ):
        deviations -= share * (inverse @ (other.residual(values) - problem.residual(values)))
    return np.asarray(deviations)
