"""The rod against solid and elastica, over thickness and height; the solid as eta_m goes to zero.  All in L*."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from plots.pieces import entry, look
from stripfold import elastica
from stripfold.ask.prediction import ElasticaPrediction, from_near_the_end
from stripfold.ask.select_model import ROD, Section, exact, one_across
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.base.material import Material
from stripfold.draw.colours import GREY
from stripfold.draw.style import figure, legend_above, styled, text_at
from stripfold.follow.statics import StripModel
from stripfold.follow.track import End
from verification.common import Progress, dataset, grid
from verification.numbers import Facts, Number

UNITS = {"m-2 s2": "eta_m"}

MODELS = ("rod", "solid")
BESIDE = 1e-3
"""Distance in free length of the states from which a derivative by it is taken, L*."""
VALUES = ("lambda_c", "mesh_error")
PAPERS_THICKNESS = 0.06
"""Thicknesses up to the paper's, which is 0.0594 L* at eta_b = 3780 and less for softer strips, L*."""


def lambda_c(length: float, refinement: float, model: str, height: float, thickness: float) -> dict[str, float]:
    """lambda_c on one mesh, and its change from elements twice as long.

    Raises SolveError: a run cannot be computed, or ends without a snap.
    """
    strip, prediction = StripModel(length, thickness, kind=model), ElasticaPrediction.at(height)
    fine, coarse = (from_near_the_end(strip, prediction, r) for r in (refinement, 2.0 * refinement))
    if fine.end is not End.SNAP:
        raise SolveError(f"no snap of the {model}: {fine.end.reason}")
    return {"lambda_c": fine.lam, "mesh_error": abs(fine.lam - coarse.lam)}


def thickness_effect(section: Section, height: float, length: float) -> float:
    """Derivative of lambda_c by h^2 at h = 0, of a strip with this section: from the elastica's branch alone.

    What the thickness adds to the energy, V h^2, moves the maximum of lambda by -(dV/dl) / (dP/dl) h^2, with the free
    length l along the branch and the force P that moves the gripper.  nan where the sag touches before.
    """
    found = elastica.critical(height)
    if not found.snap:
        return np.nan
    critical = found.state

    def added(state: elastica.State) -> float:
        s, weights = np.polynomial.legendre.leggauss(60)
        at = state.at(0.5 * state.length * (1.0 + s))
        vertical, cos, sin = state.force_0 + at.s, np.cos(at.theta), np.sin(at.theta)
        force, k, shear = state.force_x * cos + vertical * sin, at.curvature, state.force_x * sin - vertical * cos
        free = -((force - section.a / 2.0 * k**2) ** 2) / 24.0 + section.c * k**4 - section.d * shear**2
        lying = -(state.force_x**2) / 24.0 * (length - state.length)
        return 0.5 * state.length * float(weights @ free) + lying

    short, long = (elastica.state_at(height, critical.length + dl, critical) for dl in (-BESIDE, BESIDE))
    # The force on the gripper is -F_x.
    return (added(long) - added(short)) / (long.force_x - short.force_x)


def run(
    length_star: float = 20.0,
    heights: Sequence[float] = (1.8, 3.0, 5.0, 9.0),
    thicknesses: Sequence[float] = (0.2, 0.1, 0.0594, 0.03, 0.015),
    refinement: float = 0.5,
    eta_b: float = 3780.0,
    height: float = 3.0,
    eta_m: Sequence[float] = (1e-3, 1e-4, 1e-5, 1e-6),
    limit_refinement: float = 0.125,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """lambda_c of rod and solid over ``heights`` and ``thicknesses``, of the solid at ``height`` over ``eta_m``.

    ``limit_refinement``: of the second; 0.25 leaves an error of 5e-5 L* at the smallest eta_m.
    """
    axes = {"model": MODELS, "gripper_height": heights, "thickness": thicknesses}
    values = grid(partial(lambda_c, length_star, refinement), VALUES, axes, threads, progress)
    rod, solid = values["lambda_c"][1]
    truth = np.array([elastica.critical(z).advance for z in heights])
    over = ("gripper_height", "thickness")
    sections = {"rod": ROD, "solid": one_across(0.0), "exact": exact(0.0)}
    derived = [[thickness_effect(section, z, length_star) for z in heights] for section in sections.values()]
    thin = [Material(eta_b, value).relative_thickness for value in eta_m]
    case = partial(lambda_c, length_star, limit_refinement, "solid", height)
    limit = {name: found for name, (_, found) in grid(case, VALUES, {"thickness": thin}, threads, progress).items()}
    difference, mesh = (x / elastica.critical(height).advance for x in (limit["lambda_c"], limit["mesh_error"]))
    off: Array = difference - 1.0
    return dataset(
        values
        | {
            "lambda_c_elastica": ("gripper_height", truth),
            "model_error": (over, rod / solid - 1.0),
            "thickness_effect": (over, solid / truth[:, None] - 1.0),
            "section": ("section", list(sections)),
            "derived": (("section", "gripper_height"), derived),
            "eta_m": ("eta_m", list(eta_m)),
            "limit_error": ("eta_m", off),
            "limit_mesh_error": ("eta_m", mesh),
            "limit_order": ("eta_m", [np.nan, *(np.diff(np.log(np.abs(off))) / np.diff(np.log(eta_m)))]),
        },
        {"length_star": length_star, "height": height},
        UNITS,
    )


def facts(d: xr.Dataset) -> Facts:
    thin, thickest = d.sel(thickness=d.thickness <= PAPERS_THICKNESS), d.sel(thickness=d.thickness.max())

    def derived(one: str, other: str) -> xr.DataArray:
        apart = d.derived.sel(section=one) - d.derived.sel(section=other)
        return apart * thin.thickness**2 / d.lambda_c_elastica

    return {
        "error": np.abs(thin.model_error).max(),
        "mesh": (thin.mesh_error / thin.lambda_c).max(),
        "papers": PAPERS_THICKNESS,
        "top": thickest.thickness,
        "thickest": np.abs(thickest.model_error).max(),
        "derived": np.abs(thin.model_error - derived("rod", "solid")).max(),
        "one_across": np.abs(derived("solid", "exact")).max(),
        "limit": np.abs(d.limit_error[-1]),
        "smallest": d.eta_m[-1],
    }


def each_eta_m(d: xr.Dataset) -> list[Facts]:
    """The largest has no order."""
    out = []
    for i, eta_m in enumerate(d.eta_m.values):
        order = float(d.limit_order[i])
        out.append(
            {
                "eta_m": eta_m,
                "error": np.abs(d.limit_error[i]),
                "mesh": d.limit_mesh_error[i],
                "order": f", order {order:.2f} in eta_m" if i else "",
                "rule": "order 1 in eta_m within 0.1" if i else "no criterion: the largest eta_m has no order",
                "first_order": not i or abs(order - 1.0) < 0.1,
            }
        )
    return out


# fmt: off
NUMBERS = {
    each_eta_m: (
        Number("solid_limit_error_{eta_m:.0e}", "error", "1", "{rule}",
            "|solid - elastica| / elastica in lambda_c at z = {d.attrs[height]:g} L*, eta_m = {eta_m:.0e}, mesh error "
            "{mesh:.0e}{order}", lambda f: f.first_order),
    ),
    facts: (
        Number("solid_limit_error", "limit", "1", "< 1e-5",
            "|solid - elastica| / elastica in lambda_c at the smallest eta_m, {smallest:.0e}"),
        Number("rod_model_error", "error", "1", "< 1e-3",
            "largest relative distance of the rod's lambda_c from the solid's up to h = {papers:g} L*, mesh errors "
            "up to {mesh:.0e}; at h = {top:g} L* it is {thickest:.0e}.  One number of the rod is fitted to the solid: "
            "their distance follows from the derived sections within {derived:.0e}, and the solid, with one element "
            "across, is {one_across:.0e} from the exact one"),
    ),
}
# fmt: on


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the distance of the rod from the solid at each height, and that of the solid from the elastica."""
    fig = figure(3.1)
    ax = fig.subplots()
    thickness = data["thickness"].values
    for i, height in enumerate(data["gripper_height"].values):
        one, how = data.sel(gripper_height=height), look(i + 3)  # not the colours of the models
        ax.plot(thickness, np.abs(one["model_error"]), **how._asdict(), label=f"$z = {height:g}\\,L^*$")
        ax.plot(thickness, np.abs(one["thickness_effect"]), color=how.color, ls=":", lw=0.8)
    # The orders that the two thickest strips have: of thin ones the rod's distance is that of the meshes.
    thick = np.argsort(thickness)[-2:]
    for name in ("model_error", "thickness_effect"):
        low, high = (float(np.abs(data[name].isel(thickness=int(i))).min()) for i in thick)
        order = np.log(high / low) / np.log(thickness[thick[1]] / thickness[thick[0]])
        guide = 0.5 * high * (thickness / thickness.max()) ** order
        ax.plot(thickness, guide, "--", color=GREY, lw=0.8, label="_guide")
        middle = len(guide) // 2
        text_at(ax, (thickness[middle], guide[middle]), f"$h^{{{order:.1f}}}$", (4, -3), ha="left", va="top", size=8.0)
    ax.set(xlabel="thickness $h\\,/\\,L^*$", ylabel=r"difference in $\lambda_c$, relative", xscale="log", yscale="log")
    ax.xaxis.set_major_locator(FixedLocator(list(thickness)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    handles = ax.get_legend_handles_labels()[0]
    legend_above(
        fig,
        [
            *handles,
            entry("rod from solid", GREY, marker="o"),
            entry("solid from elastica", GREY, ":", lw=0.8),
            entry("order of the two thickest", GREY, "--", lw=0.8),
        ],
        fontsize=7,
    )
    return fig
