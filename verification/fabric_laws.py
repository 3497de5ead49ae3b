"""Strips with their own bending law: the measured textile against its secant, fabrics that soften against an eta_b.

The laws are elastic, and go on straight beyond what was measured; friction comes on top as a bending hysteresis.  The
textile's is that of a first bending, in L* of the secant that stands in for it.  A fabric's, along warp or weft, is
that of its source, m = b_1 kappa + b_2 kappa^2 per width with b_2 < 0, to where the slope is a given share of b_1: a
fitted parabola has a maximum, a fabric has none.  Its unit is the L* of the eta_b that its own fold gives.
Source: docs/physics.md, section 11.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import cos, inf, nan, pi, sin, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

from plots.pieces import PATH_LOOKS, note
from stripfold import elastica
from stripfold.ask.fabric import TABLE
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.base.material import GRAVITY
from stripfold.draw.colours import BLACK, GREEN, GREY, SKY
from stripfold.draw.style import figure, styled
from stripfold.files import tables
from stripfold.follow import contact_branch
from stripfold.follow.contact_branch import BranchPoint, from_elastica
from stripfold.follow.memory import SHARES, bent, load, steps_on, with_effects
from stripfold.follow.statics import StripModel, to_the_end
from stripfold.follow.track import End, Track
from stripfold.paths import geometric
from stripfold.paths.curve import GripperPath
from stripfold.paths.rpath import plan_r_path
from stripfold.strip.effects import BendingLaw, Hysteresis, MomentCurvature
from stripfold.strip.problem import AlongPath, AlongX
from tasks import textile
from verification.common import Progress, attempted, dataset, pooled
from verification.fabrics import COLUMNS, MAX_ROWS
from verification.numbers import Facts, Number, share

UNITS = {"m": "unit"}
LAWS = ("secant", "measured")
DIRECTIONS = ("warp", "weft")
ESTIMATES = ("mean slope", "slope", "secant", "fold")
"""Ways to an eta_b: b_1 averaged over warp and weft; b_1 along the strip; the secant at the largest curvature of the
critical state; the height of the strip's own fold."""
LENGTH, THICKNESS, STEP = 20.0, 0.003, 0.2
"""Of the strips, and of the steps along R-paths, L*; the thickness is to have no effect."""
FIRST = 0.05
"""Length travelled at the first state on a path, L*."""
YIELD_CURVATURE = 0.05
"""kappa_y of the friction, 1/L*."""
MOMENTS = (0.1, 0.2, 0.4, 0.8)
"""M_0 tried on the R-path in turn, rho_a g L*^2."""
HELD = 0.2
"""M_0 / rho_a g L*^2 that the four fabrics with a published loop have at least."""
Law = tuple[Array, Array]
"""Curvature, 1/L*, and moment, rho_a g L*^2."""


def run(
    measured: str = "data/textile_moment_curvature.csv",
    areal_load: float = 13.6,
    heights: Sequence[float] = (3.0, 8.0),
    table: str = str(TABLE),
    most: int = 1,
    flattest: Sequence[float] = (0.1, 0.3),
    height: float = 3.0,
    refinement: float = 0.7,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The end of the advance and how far R-paths are followed, nan where a branch could not be followed.

    ``measured``, ``areal_load``, ``heights``: the textile's table, its weight per area, N m^-2, and its gripper's
    heights, L*.  ``table``, ``most``, ``flattest``: the fabrics, of which the first with a b_2, and least slopes of
    their law over b_1; on the R-path that of the first.  ``height``: of the fabrics' gripper, and at whose critical
    state secants are taken, L*.  ``refinement``: factor on element lengths.
    """
    rows = textile.read_table(measured)
    secant = textile.secant(rows, areal_load, textile.largest_curvature(elastica.critical(height).state))
    unit = float(np.cbrt(secant.stiffness / areal_load))
    curvature, moment = unit * rows[:, 0], rows[:, 1] / (areal_load * unit**2)
    laws: dict[str, Law] = {"secant": (curvature, curvature), "measured": (curvature, moment)}
    ends = np.array([[_textile_end(law, z, refinement) for z in heights] for law in laws.values()])
    known = tables.read_table("table", Path(table), COLUMNS, (1, MAX_ROWS))
    known = replace(known, rows=[row for row in known.rows if row[1][6]][:most])
    numbers = np.column_stack([known.numbers(slice(3, 4)), known.numbers(slice(6, 10))])
    fabrics = [
        Fabric(b1, b2, 0.5 * (warp + weft), GRAVITY * density, least)
        for density, warp, weft, *curves in numbers
        for b1, b2 in zip((warp, weft), curves, strict=True)
        for least in flattest
    ]
    advances = np.array(pooled(partial(_advance, height, refinement), fabrics, threads, progress))
    advances = advances.reshape(len(numbers), len(DIRECTIONS), len(flattest), 2 + 2 * len(ESTIMATES))
    paths = pooled(partial(_paths, refinement), fabrics[:: len(flattest)], threads, progress)
    dims = ("fabric", "direction", "flattest")
    return dataset(
        {
            "law": ("law", list(LAWS)),
            "gripper_height": ("gripper_height", heights),
            **{
                name: (("law", "gripper_height"), ends[..., i])
                for i, name in enumerate(("advance", "curvature", "leaves"))
            },
            "path_lost": ("law", [_followed(plan_r_path(LENGTH).path, law, refinement) for law in laws.values()]),
            "measured_curvature": ("row", curvature),
            "measured_moment": ("row", moment),
            "fabric": ("fabric", [row[0] for _, row in known.rows]),
            "direction": ("direction", list(DIRECTIONS)),
            "flattest": ("flattest", flattest),
            "estimate": ("estimate", list(ESTIMATES)),
            "strip_advance": (dims, advances[..., 0]),
            "strip_snap": (dims, advances[..., 1]),
            "unit": ((*dims, "estimate"), advances[..., 2:6]),
            "predicted": ((*dims, "estimate"), advances[..., 6:]),
            **{
                name: (dims[:2], np.reshape([one[i] for one in paths], (-1, len(DIRECTIONS))))
                for i, name in enumerate(("followed", "friction", "low", "triangular"))
            },
        },
        {"height": height},
        units=UNITS,
    )


def to_end(law: Law, height: float, refinement: float) -> Track:
    """The advance at a height, from the state without horizontal force on."""
    state = elastica.state_no_horizontal_force(height)
    mesh = StripModel(LENGTH, THICKNESS, kind="rod").contact_mesh(refinement)
    return to_the_end(bent(from_elastica(mesh, AlongX(height), state.advance, state), MomentCurvature(*law)))


def _textile_end(law: Law, height: float, refinement: float) -> tuple[float, float, float]:
    """lambda at the end of the advance, the largest curvature there, and lambda where it leaves the measured range."""
    found = to_end(law, height, refinement)
    lams, bends = np.array([at.point.lam for at in found.branch]), np.array([largest(at) for at in found.branch])
    out = np.flatnonzero(bends > law[0][-1])
    leaves = (
        nan
        if not len(out)
        else lams[0]
        if out[0] == 0
        else np.interp(law[0][-1], bends[: out[0] + 1], lams[: out[0] + 1])
    )
    return found.lam, float(bends[-1]), float(leaves)


def largest(at: BranchPoint) -> float:
    """The largest curvature of a strip with a law, 1/L*."""
    (effect,) = at.problem.at(at.contact).effects
    assert isinstance(effect, BendingLaw)
    return float(np.abs(effect.curvature(at.u)).max())


def _followed(path: GripperPath, law: Law, refinement: float, moment: float = 0.0) -> float:
    """Share of a path planned for the linear strip that is followed; 1 to the touch.  ``moment``: M_0."""
    mesh = StripModel(LENGTH, THICKNESS, kind="rod").contact_mesh(refinement, memory=bool(moment))
    first = bent(contact_branch.from_flat(mesh, AlongPath(path.pieces[0], LENGTH), FIRST), MomentCurvature(*law))
    if moment:
        first = with_effects(
            first,
            lambda model, q: (
                BendingLaw.of(model, MomentCurvature(*law)),
                Hysteresis.of(model, moment, yield_curvature=YIELD_CURVATURE, slack=q),
            ),
        )
    found = load(first, steps_on(path, LENGTH, STEP), "touch")
    return found.lam / path.length if found.end is End.SNAP else 1.0


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
        mean, slope = (float(np.cbrt(of / self.weight)) for of in (self.mean, self.slope))
        largest = textile.largest_curvature(elastica.critical(3.0).state)

        def off(unit: float) -> float:
            kappa = largest / unit
            return unit**3 * self.weight - float(self.moment(np.array([kappa]))[0]) / kappa

        secant, fold = brentq(off, 0.2 * slope, 1.01 * slope), fold_height(self) / elastica.folded_loop().height
        return dict(zip(ESTIMATES, (mean, slope, secant, fold), strict=True))

    @property
    def end(self) -> float:
        """Curvature from which on the law is straight, 1/m."""
        return 0.5 * (self.flattest - 1.0) * self.slope / self.curve

    def law(self, unit: float) -> Law:
        """In 1/L* and rho_a g L*^2, densely, to where the law is straight."""
        kappa = np.linspace(0.0, self.end, 401)[1:]
        return unit * kappa, self.moment(kappa) / (self.weight * unit**2)

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


def fold_height(fabric: Fabric) -> float:
    """Height of the folded strip's loop, m, by shooting: a strip without horizontal force and with its own law.

    theta' = kappa(M), M' = -(F_0 + w s) cos(theta) from the lift-off to where it lies folded: theta = pi, M = 0.  The
    law is bent from the linear one in small steps: another root intersects itself.

    Raises SolveError: no loop was found.
    """
    unit = float(np.cbrt(fabric.slope / fabric.weight))

    def shot(of: Fabric, force: float, length: float, at: Array) -> Array:
        """theta, M and z, in L* of the slope, along the strip from its lift-off."""

        def rate(s: float, y: Array) -> list[float]:
            return [unit * of.curvature(of.weight * unit**2 * y[1]), -(force + s) * cos(y[0]), sin(y[0])]

        return np.asarray(solve_ivp(rate, (0.0, length), [0.0] * 3, t_eval=at, rtol=1e-8, atol=1e-10).y)

    def missed(unknown: Array, of: Fabric) -> Array:
        return shot(of, unknown[0], unknown[1], unknown[1:])[:2, -1] - (pi, 0.0)

    unknown = np.array([-3.745005, 4.683470])  # force and length of the linear strip's
    for part in SHARES:
        found = root(missed, unknown, args=(fabric._replace(curve=part * fabric.curve),), tol=1e-8)
        if not found.success or np.abs(found.x - unknown).max() > 1.0:
            raise SolveError(f"no folded state of this law: {found.message}")
        unknown = found.x
    return unit * float(shot(fabric, unknown[0], unknown[1], np.linspace(0.0, unknown[1], 501))[2].max())


def _advance(height: float, refinement: float, fabric: Fabric) -> list[float]:
    """The end of the advance in L* of the fold, whether it snaps, L* by each estimate, and the end as each predicts."""
    units, _ = attempted(lambda: fabric.units)
    if units is None:
        return [nan] * (2 + 2 * len(ESTIMATES))
    unit = units["fold"]
    predicted = [of / unit * elastica.critical(height * unit / of).advance for of in units.values()]
    found, _ = attempted(lambda: to_end(fabric.law(unit), height, refinement))
    end = [nan, nan] if found is None else [found.lam, float(found.end is End.SNAP)]
    return [*end, *units.values(), *predicted]


def _paths(refinement: float, fabric: Fabric) -> tuple[float, float, float, float]:
    """Share of the R-path planned with the L* of the fold that is followed without friction; M_0 that suffices.

    Then the shares of the low path at 1 L* and of the triangular path.
    """
    path = plan_r_path(LENGTH).path
    law, _ = attempted(lambda: fabric.law(fabric.units["fold"]))
    if law is None:
        return nan, nan, nan, nan
    without, low, triangular = (
        nan if (found := attempted(partial(_followed, one, law, refinement))[0]) is None else found
        for one in (path, geometric.low(LENGTH, 1.0), geometric.lifted_triangular(LENGTH, 1.0))
    )
    if np.isnan(without):
        return nan, nan, low, triangular
    trials = (0.0,) if without == 1.0 else MOMENTS
    found, _ = attempted(lambda: next((m for m in trials if _followed(path, law, refinement, m) == 1.0), inf))
    return without, nan if found is None else found, low, triangular


def facts(d: xr.Dataset) -> Facts:
    """The textile's law against its secant; strips with their fabric's law over linear strips, by the way to eta_b."""
    measured, secant = (d.sel(law=law) for law in ("measured", "secant"))
    ratio, decided = d.strip_advance / d.predicted, d.friction.notnull()
    ranges = {}
    for estimate in ESTIMATES:
        low, high = ratio.sel(estimate=estimate).quantile([0.05, 0.95])
        ranges[f"{estimate.split()[0]}_range"] = f"{float(low):.2f} to {float(high):.2f}"
    return ranges | {
        "heights": f"{float(d.gripper_height.min()):g} to {float(d.gripper_height.max()):g}",
        "ratio": (measured.advance / secant.advance).max(),
        "least_ratio": (measured.advance / secant.advance).min(),
        "bend": measured.curvature.max() / d.measured_curvature.max(),
        "leaves": (measured.leaves / measured.advance).max(),
        "lost": measured.path_lost,
        "secant_lost": secant.path_lost,
        "height": d.attrs["height"],
        "strips": ratio.sel(estimate="fold").size,
        "fold": ratio.sel(estimate="fold").median(),
        "touch": int((d.strip_snap == 0.0).sum()),
        "failed": int(d.strip_advance.isnull().sum()),
        "tried": int(decided.sum()),
        "moment": HELD,
        "held": ((d.friction <= HELD) & decided).sum() / decided.sum(),
        "lost_at": f"{float(d.followed.min()):.2f} to {float(d.followed.max()):.2f}",
        "low": share(d.low.values[d.low.notnull().values] == 1.0),
        "low_tried": d.low.notnull().sum(),
        "triangular": share(d.triangular.values[d.triangular.notnull().values] == 1.0),
        "triangular_tried": d.triangular.notnull().sum(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("textile_law_ratio", "ratio", "1", "no criterion",
            "largest lambda_c of the textile with its measured bending law over that of its secant, gripper at "
            "{heights} L*; smallest {least_ratio:.3f}. The largest curvature there is {bend:.2f} of the largest one "
            "measured; it leaves the measured range at {leaves:.0%} of lambda_c or before"),
        Number("textile_law_path", "lost", "1", "no criterion",
            "share of the R-path planned with the secant that the textile with its measured law, without friction, "
            "follows before it snaps; with the secant {secant_lost:.2f}"),
        Number("fabric_law_lambda", "fold", "1", "no criterion",
            "median of lambda at the end of the advance at {height:g} L* of {strips} strips with the bending law of "
            "their fabric over that of the linear strip whose eta_b is read from the height of their fold; 90 % lie "
            "within {fold_range}. With eta_b from the secant at the largest curvature {secant_range}, from the slope "
            "along the strip {slope_range}, from the slope averaged over warp and weft {mean_range}; {touch} land "
            "without a snap, {failed} were not followed"),
        Number("fabric_law_rpath", "held", "1", "no criterion",
            "share of these strips, of {tried} with a verdict, that follow the R-path planned with the eta_b of their "
            "fold with M_0 = {moment:g} rho_a g L*^2 or less; without friction they are lost at {lost_at} of it"),
        Number("fabric_law_low", "low", "1", "= 1",
            "share of these strips, of {low_tried} with a verdict, that follow the low path at 1 L* to the touch by "
            "their own law, without friction; of the triangular path, of {triangular_tried}, {triangular:.2f}"),
    ),
}
# fmt: on

LOOKS = {"measured": ("measured law", BLACK), "secant": ("secant", SKY)}


def _look(path: str) -> tuple[str, str, str]:
    label, how = PATH_LOOKS[path]
    return label, how.color, how.marker


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) moment over curvature, with the sharpest bend of each critical state, (b) lambda_c over the height.

    Then (c) how far strips with the law of a fabric are followed on three paths.
    """
    fig = figure(6.6)
    top, bottom, fabrics = fig.subplots(3, 1)
    kappa, moment = data["measured_curvature"].values, data["measured_moment"].values
    laws = {"measured": MomentCurvature(kappa, moment), "secant": MomentCurvature(kappa, kappa)}
    for name, (label, color) in LOOKS.items():
        one, law = data.sel(law=name), laws[name]
        bends = one["curvature"].values
        inside, beyond = np.linspace(0.0, kappa[-1], 200), np.linspace(kappa[-1], max(bends.max(), kappa[-1]), 20)
        line: dict[str, Any] = {"color": color, "lw": 1.0}
        top.plot(inside, law.moment(inside), label=label, **line)
        top.plot(beyond, law.moment(beyond), ls="--", label=f"_{name}-beyond", **line)
        top.plot(bends, law.moment(bends), "|", color=color, ms=14, label=f"_{name}-critical")
        bottom.plot(data["gripper_height"], one["advance"], color=color, marker="o", label=f"snap, {label}")
    top.plot(kappa, moment, ".", color=BLACK, ms=4, label="measured points")
    top.plot([], [], color=BLACK, ls="--", lw=1.0, label="extrapolated")
    top.plot([], [], "|", color=GREY, ms=10, label=r"sharpest bends at $\lambda_c$")
    ends = data["leaves"].sel(law="measured")
    bottom.plot(data["gripper_height"], ends, color=BLACK, ls=":", marker="x", label="end of the measured curvatures")
    top.set(xlabel=r"curvature $\kappa L^*$", ylabel=r"moment $m\,/\,\rho_a g {L^*}^2$")
    top.set(xlim=(0.0, None), ylim=(0.0, 1.15 * laws["measured"].moment(data["curvature"].values).max()))
    bottom.set(xlabel=r"gripper height $z\,/\,L^*$", ylabel=r"advance $\lambda\,/\,L^*$", ylim=(0.0, None))
    order = np.argsort(data["followed"].values, axis=None)
    for name, label, color, marker in (
        ("low", "low path", GREEN, "s"),
        ("followed", *_look("r-path")),
        ("triangular", *_look("triangular")),
    ):
        fabrics.plot(data[name].values.ravel()[order], marker, color=color, ms=3.5, label=label)
    fabrics.set(xlabel="fabric along warp or weft", ylabel="followed share of the path", ylim=(0.0, 1.1), xticks=[])
    for ax, letter in ((top, "(a)"), (bottom, "(b)"), (fabrics, "(c)")):
        ax.legend(loc="lower right", fontsize=7)
        note(ax, letter)
    return fig
