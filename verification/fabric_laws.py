"""Fabrics that soften, along warp and weft, with their own bending law: which eta_b stands best for them.

The law is that of the source, m = b_1 kappa + b_2 kappa^2 per width with b_2 < 0, followed to where its slope is a
given share of b_1, and straight on from there: a fitted parabola has a maximum, a fabric has none.  The law is
elastic; friction comes on top as a bending hysteresis.  Each strip is bent along warp or weft.  Units: L* of the eta_b
that the height of its own fold gives.  Source: docs/physics.md, section 11.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import LostStabilityError, SolveError
from stripfold.base.material import GRAVITY
from stripfold.files import tables
from stripfold.follow.contact_branch import BranchPoint, from_elastica, from_flat
from stripfold.follow.memory import load_incrementally_from, steps_on, with_effects
from stripfold.follow.statics import StripModel, to_the_end
from stripfold.follow.track import End
from stripfold.paths import rpath
from stripfold.paths.curve import GripperPath
from stripfold.strip.effects import BendingLaw, Hysteresis, MomentCurvature
from stripfold.strip.model import Model
from stripfold.strip.problem import AlongPath, AlongX
from verification.common import Progress, dataset, pooled
from verification.fabrics import COLUMNS, MAX_ROWS
from verification.numbers import Facts, Number
from verification.textile_law import FIRST, SHARES, bent

UNITS = {"m": "gravity_length"}

DIRECTIONS = ("warp", "weft")
ESTIMATES = ("mean slope", "slope", "secant", "fold")
"""Ways to an eta_b: b_1 averaged over warp and weft; b_1 along the strip; the secant at the largest curvature of the
critical state; the height of the strip's own fold."""
YIELD_CURVATURE = 0.05
"""kappa_y of the friction, 1/L*."""
MOMENTS = (0.1, 0.2, 0.4, 0.8)
"""M_0 tried on the R-path in turn, rho_a g L*^2: the four fabrics whose 2HB is published have 0.22 and more."""


class Fabric(NamedTuple):
    """A law, and the weight per area that it bends under: N m, N m^2, N m^-2.

    ``mean``: b_1 of both directions.  ``flattest``: least slope of the law over b_1.
    """

    slope: float
    curve: float
    mean: float
    weight: float
    flattest: float

    @property
    def units(self) -> dict[str, float]:
        """L* of each estimate, m."""
        stiffness = {"mean slope": self.mean, "slope": self.slope}
        lengths = {name: float(np.cbrt(of / self.weight)) for name, of in stiffness.items()}
        largest = elastica_curvature()

        def off(unit: float) -> float:
            kappa = largest / unit
            return unit**3 * self.weight - float(self.moment(np.array([kappa]))[0]) / kappa

        lengths["secant"] = brentq(off, 0.2 * lengths["slope"], 1.01 * lengths["slope"])
        return {**lengths, "fold": fold_height(self) / elastica.folded_loop().height}

    @property
    def end(self) -> float:
        """Curvature from which on the law is straight, 1/m."""
        return 0.5 * (self.flattest - 1.0) * self.slope / self.curve

    def moment(self, kappa: Array) -> Array:
        """Moment per width, N, at positive curvatures, 1/m."""
        inside = np.minimum(kappa, self.end)
        return inside * (self.slope + self.curve * inside) + self.flattest * self.slope * (kappa - inside)

    def curvature(self, moment: float) -> float:
        """Curvature, 1/m, at a moment of either sign."""
        size, last = abs(moment), float(self.moment(np.array([self.end]))[0])
        if size > last:
            kappa = self.end + (size - last) / (self.flattest * self.slope)
        else:
            kappa = (sqrt(max(self.slope**2 + 4.0 * self.curve * size, 0.0)) - self.slope) / (2.0 * self.curve)
        return kappa if moment >= 0.0 else -kappa


def elastica_curvature() -> float:
    """Largest curvature of the linear strip's critical state with the gripper at 3 L*, 1/L*."""
    state = elastica.critical(3.0).state
    return float(np.abs(state.at(np.linspace(0.0, state.length, 1001)).curvature).max())


def fold_height(fabric: Fabric) -> float:
    """Height of the folded strip's loop, m, by shooting: a strip without horizontal force and with its own law.

    theta' = kappa(M), M' = -(F_0 + w s) cos(theta) from the lift-off to where it lies folded: theta = pi, M = 0.  The
    law is bent from the linear one in small steps: another root intersects itself.

    Raises SolveError: no loop was found.
    """
    unknown = np.array([-3.745005, 4.683470])  # force and length of the linear strip's
    for share in SHARES:
        softer = fabric._replace(curve=share * fabric.curve)
        found = root(_missed, unknown, args=(softer,), tol=1e-8)
        if not found.success or np.abs(found.x - unknown).max() > 1.0:
            raise SolveError(f"no folded state of this law: {found.message}")
        unknown = found.x
    force, length = unknown
    return _unit(fabric) * float(_shot(fabric, force, length, np.linspace(0.0, length, 501))[2].max())


def _unit(fabric: Fabric) -> float:
    """L* of the slope, m."""
    return float(np.cbrt(fabric.slope / fabric.weight))


def _shot(fabric: Fabric, force: float, length: float, at: Array) -> Array:
    """theta, M and z, in L* of the slope, along the strip from its lift-off."""
    unit = _unit(fabric)
    load = fabric.weight * unit**2

    def rate(s: float, y: Array) -> list[float]:
        return [unit * fabric.curvature(load * y[1]), -(force + s) * cos(y[0]), sin(y[0])]

    return np.asarray(solve_ivp(rate, (0.0, length), [0.0] * 3, t_eval=at, rtol=1e-8, atol=1e-10).y)


def _missed(unknown: Array, fabric: Fabric) -> Array:
    force, length = unknown
    theta, moment, _ = _shot(fabric, force, length, np.array([length]))[:, -1]
    return np.array([theta - pi, moment])


def run(
    table: str = "data/fabrics.csv",
    height: float = 3.0,
    length_star: float = 20.0,
    thickness: float = 0.003,
    flattest: Sequence[float] = (0.1, 0.3),
    most: int = 2,
    step: float = 0.2,
    refinement: float = 0.7,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """lambda_c and the R-path of every fabric of ``table`` with a b_2, over ``fabric`` and ``direction``.

    ``height``, ``length_star``, ``thickness``: of gripper and strip, L*.  ``flattest``: least slopes of the law over
    b_1; the R-path is that of the first.  ``most``: fabrics, from the first.
    ``step``: steps along the R-path, L*.  ``refinement``: factor on the element
    lengths.  nan where a branch could not be followed.
    """
    path = Path(table)
    known = tables.read_table("table", path, COLUMNS, (1, MAX_ROWS))
    known = replace(known, rows=[row for row in known.rows if row[1][6]])
    known = replace(known, rows=known.rows[:most])
    rows = [row for _, row in known.rows]
    numbers = np.column_stack([known.numbers(slice(3, 4)), known.numbers(slice(6, 10))])
    fabrics = [
        Fabric(b1, b2, 0.5 * (warp + weft), GRAVITY * density, least)
        for density, warp, weft, *curves in numbers
        for b1, b2 in zip((warp, weft), curves, strict=True)
        for least in flattest
    ]
    along = partial(_advance, height, length_star, thickness, refinement)
    advances = pooled(along, fabrics, threads, progress)
    paths = pooled(
        partial(_r_path, length_star, thickness, step, refinement), fabrics[:: len(flattest)], threads, progress
    )
    shape = len(rows), len(DIRECTIONS)
    laws = ("fabric", "direction", "flattest")
    return dataset(
        {
            "fabric": ("fabric", [row[0] for row in rows]),
            "direction": ("direction", list(DIRECTIONS)),
            "flattest": ("flattest", flattest),
            "estimate": ("estimate", list(ESTIMATES)),
            **{
                name: (laws, np.array([getattr(one, name) for one in advances]).reshape(*shape, -1))
                for name in ("advance", "snap")
            },
            **{
                name: ((*laws, "estimate"), np.array([getattr(one, name) for one in advances]).reshape(*shape, -1, 4))
                for name in ("gravity_length", "predicted")
            },
            "followed": (laws[:2], np.array([one[0] for one in paths]).reshape(shape)),
            "friction": (laws[:2], np.array([one[1] for one in paths]).reshape(shape)),
        },
        {"height": height, "length_star": length_star, "step": step},
        units=UNITS,
    )


class _Advance(NamedTuple):
    advance: float
    snap: float
    gravity_length: list[float]
    predicted: list[float]


def _advance(height: float, length: float, thickness: float, refinement: float, fabric: Fabric) -> _Advance:
    """The end of the advance, and that of linear strips of each estimate, in L* of the fold."""
    try:
        units = fabric.units
    except SolveError:
        return _Advance(np.nan, np.nan, [np.nan] * 4, [np.nan] * 4)
    unit = units["fold"]
    predicted = [of / unit * elastica.critical(height * unit / of).advance for of in units.values()]
    try:
        lam, snap = advance(fabric, unit, height, length, thickness, refinement)
    except SolveError:
        lam, snap = np.nan, np.nan
    return _Advance(lam, snap, list(units.values()), predicted)


def _r_path(length: float, thickness: float, step: float, refinement: float, fabric: Fabric) -> tuple[float, float]:
    """Share of the R-path planned with the L* of the fold that is followed without friction; M_0 that suffices."""
    try:
        unit = fabric.units["fold"]
        follow = partial(on_r_path, fabric, unit, length, thickness, step, refinement)
        without = follow(0.0)
    except SolveError:
        return np.nan, np.nan
    if without == 1.0:
        return without, 0.0
    try:
        return without, next((moment for moment in MOMENTS if follow(moment) == 1.0), np.inf)
    except SolveError:
        return without, np.nan


def law(fabric: Fabric, unit: float) -> tuple[Array, Array]:
    """Curvature and moment in 1/L* and rho_a g L*^2, densely, to where the law is straight."""
    kappa = np.linspace(0.0, fabric.end, 401)[1:]
    return unit * kappa, fabric.moment(kappa) / (fabric.weight * unit**2)


def advance(
    fabric: Fabric, unit: float, height: float, length: float, thickness: float, refinement: float
) -> tuple[float, float]:
    """lambda / L* at the end of the advance, and whether that is a snap."""
    state = elastica.state_no_horizontal_force(height)
    mesh = StripModel(length, thickness, kind="rod").contact_mesh(refinement)
    found = to_the_end(bent(from_elastica(mesh, AlongX(height), state.advance, state), *law(fabric, unit)))
    return found.lam, float(found.end is End.SNAP)


def on_r_path(
    fabric: Fabric, unit: float, length: float, thickness: float, step: float, refinement: float, moment: float
) -> float:
    """Share of the R-path planned with this L* up to the loss of stability; 1 where the strip is followed to its touch.

    ``moment``: M_0, rho_a g L*^2.
    """
    path = rpath.plan_r_path(length).path
    first = _at_first(fabric, unit, path, length, thickness, refinement, moment)
    try:
        for state in load_incrementally_from(first, steps_on(path, length, step)):
            if state.touches:
                break
    except LostStabilityError as error:
        return float(error.parameter or np.nan) / path.length
    return 1.0


def _at_first(
    fabric: Fabric,
    unit: float,
    path: GripperPath,
    length: float,
    thickness: float,
    refinement: float,
    moment: float,
) -> BranchPoint:
    mesh = StripModel(length, thickness, kind="rod").contact_mesh(refinement, memory=bool(moment))
    curvature, moments = law(fabric, unit)
    first = bent(from_flat(mesh, AlongPath(path.pieces[0], length), FIRST), curvature, moments)
    if not moment:
        return first

    def effects(model: Model, q: Array) -> tuple[BendingLaw, Hysteresis]:
        friction = Hysteresis.of(model, moment, yield_curvature=YIELD_CURVATURE, slack=q)
        return BendingLaw.of(model, MomentCurvature(curvature, moments)), friction

    return with_effects(first, effects)


HELD = 0.2
"""M_0 / rho_a g L*^2 that the four fabrics with a published loop have at least."""


def facts(d: xr.Dataset) -> Facts:
    """lambda of strips with their fabric's law over that of linear strips, by the way to eta_b."""
    ratio = d.advance / d.predicted

    def within(estimate: str) -> str:
        low, high = ratio.sel(estimate=estimate).quantile([0.05, 0.95])
        return f"{float(low):.2f} to {float(high):.2f}"

    slope = d.gravity_length.sel(estimate="slope", flattest=d.flattest[0]) ** 3
    warp = slope.max("direction") / slope.min("direction")
    decided = d.friction.notnull()
    return {
        "height": d.attrs["height"],
        "strips": ratio.sel(estimate="fold").size,
        "fold": ratio.sel(estimate="fold").median(),
        "fold_range": within("fold"),
        "secant_range": within("secant"),
        "slope_range": within("slope"),
        "mean_range": within("mean slope"),
        "touch": int((d.snap == 0.0).sum()),
        "failed": int(d.advance.isnull().sum()),
        "ratio": warp.median(),
        "most": warp.max(),
        "tried": int(decided.sum()),
        "moment": HELD,
        "held": ((d.friction <= HELD) & decided).sum() / decided.sum(),
        "lost": f"{float(d.followed.min()):.2f} to {float(d.followed.max()):.2f}",
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("fabric_law_lambda", "fold", "1", "no criterion",
            "median of lambda at the end of the advance at {height:g} L* of {strips} strips with the bending law of "
            "their fabric over that of the linear strip whose eta_b is read from the height of their fold; 90 % lie "
            "within {fold_range}. With eta_b from the secant at the largest curvature {secant_range}, from the slope "
            "along the strip {slope_range}, from the slope averaged over warp and weft {mean_range}; {touch} land "
            "without a snap, {failed} were not followed"),
        Number("fabric_law_warp", "ratio", "1", "no criterion",
            "median of the larger over the smaller slope along warp and weft; the largest {most:.1f}"),
        Number("fabric_law_rpath", "held", "1", "no criterion",
            "share of these strips, of {tried} with a verdict, that follow the R-path planned with the eta_b of their "
            "fold with M_0 = {moment:g} rho_a g L*^2 or less; without friction they are lost at {lost} of it"),
    ),
}
# fmt: on
