"""The energy barrier between the stable and the unstable state of one gripper place, over the distance to lambda_c.

On the elastica from the energies of both states and from the difference of their horizontal forces, whose integral
over lambda it is; on the rod and the solid the coefficient of its law, from their limit point.
Lengths in L*, energies per width in rho_a g L*^2.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import nan, sqrt
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import MODEL_LOOKS, entry, note
from stripfold import elastica
from stripfold.ask.prediction import ElasticaPrediction, snap
from stripfold.base.errors import SolveError
from stripfold.draw.colours import BLACK, GREY
from stripfold.draw.style import figure, styled, text_at
from stripfold.elastica.barrier import BistableRange
from stripfold.follow.statics import StripModel
from verification.common import Progress, dataset, grid
from verification.numbers import Facts, Number

MODELS = {"rod": 5.0, "solid": 2.5}
"""Sizes of their markers: both nearly coincide."""
POINTS = 5
"""Gauss points of the integral of the forces."""
SHOWN = 3.0
"""Height whose numbers are quoted, L*."""
RANGE_HEIGHTS = (1.59, 1.6, 1.62, 1.65, 1.7, 1.8, 2.0, 2.3, 2.7, 3.2, 4.0, 5.0, 6.5, 8.0, 10.0, 13.0, 16.0, 20.0)


def run(
    heights: Sequence[float] = (1.7, 3.0, 7.0),
    distances: Sequence[float] = (1e-05, 0.0001, 0.001, 0.0097, 0.072),
    length_star: float = 20.0,
    thickness: float = 0.0594,
    refinement: float = 0.5,
    range_heights: Sequence[float] = RANGE_HEIGHTS,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Barriers over ``gripper_height`` and ``distance``, nan where the unstable state's sag would be below the floor.

    ``heights``: above the touch limit; ``distances``: lambda_c - lambda; ``length_star``, ``thickness``,
    ``refinement``: of the rod and the solid; ``range_heights``: where only the range of the elastica is found.
    """
    ranges, others = [_range(z) for z in heights], [_range(z) for z in range_heights]
    of_elastica = np.array([[_of_elastica(found, distance) for distance in distances] for found in ranges])
    case = partial(_coefficient, length_star, thickness, refinement)
    axes: dict[str, Sequence[Any]] = {"model": list(MODELS), "gripper_height": heights}
    return dataset(
        grid(case, ("model_coefficient",), axes, threads, progress)
        | {
            "distance": ("distance", list(distances)),
            "barrier": (("gripper_height", "distance"), of_elastica[..., 0]),
            "work": (("gripper_height", "distance"), of_elastica[..., 1]),
        }
        | _of_ranges("gripper_height", ranges)
        | {f"range_{name}": content for name, content in _of_ranges("range_height", others).items()}
        | {"range_height": ("range_height", list(range_heights))}
    )


def _range(z: float) -> BistableRange:
    found = elastica.bistable_range(z)
    if found is None:
        raise SolveError(f"no snap at z = {z:g}")
    return found


def _of_ranges(dim: str, ranges: Sequence[BistableRange]) -> dict[str, tuple[str, list[float]]]:
    """Coefficient, width, largest barrier and the speed that it stands for, over a dimension of heights."""
    largest = [found.barrier(found.landing.advance) for found in ranges]
    return {
        "coefficient": (dim, [found.coefficient for found in ranges]),
        "width": (dim, [found.width for found in ranges]),
        "largest": (dim, largest),
        "speed": (dim, [sqrt(2.0 * e / found.critical.length) for e, found in zip(largest, ranges, strict=True)]),
    }


def _of_elastica(found: BistableRange, distance: float) -> tuple[float, float]:
    """The barrier as the difference of the energies, and as the integral over lambda of that of the forces."""
    if distance > found.width:
        return nan, nan
    stable, unstable = found.pair(found.critical.advance - distance)
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    work = 0.0
    # Smooth in the root of the distance.
    for root, weight in zip(0.5 * sqrt(distance) * (points + 1.0), weights, strict=True):
        a, b = found.pair(found.critical.advance - root**2)
        # The gripper's force in the direction of its advance is -F_x.
        work += sqrt(distance) * weight * root * (b.force_x - a.force_x)
    return unstable.energy - stable.energy, work


def _coefficient(length: float, thickness: float, refinement: float, model: str, height: float) -> dict[str, float]:
    """The law's coefficient on a model, from the second derivative of lambda and the first of the gripper's force."""
    found = snap(StripModel(length, thickness, kind=model), ElasticaPrediction.at(height), refinement)
    limit, problem = found.limit, found.problem
    _, tangent, _ = problem.linearise(limit.state.q, limit.state.lam)
    force = (tangent @ limit.tangent.q)[problem.mesh.model.middle[0, 0]]
    return {"model_coefficient": 4.0 * sqrt(2.0) / 3.0 * abs(float(force)) / sqrt(-limit.bend.lam)}


def facts(d: xr.Dataset) -> Facts:
    """The law near the fold, its coefficient by several ways, and the end of the bistable range."""
    one = d.sel(gripper_height=SHOWN)
    least = d.distance.values.argmin()
    law = d.coefficient * d.distance**1.5
    models = d.model_coefficient.sel(gripper_height=SHOWN) / one.coefficient - 1.0
    return {
        "z": SHOWN,
        "measured": one.barrier[least] / one.distance[least] ** 1.5,
        "normal": one.coefficient,
        "apart": np.abs(one.barrier / law.sel(gripper_height=SHOWN) - 1.0)[least],
        "curved": np.abs(d.barrier / law - 1.0).max(),
        "work": np.abs(d.work / d.barrier - 1.0).max(),
        "rod": models.sel(model="rod"),
        "solid": models.sel(model="solid"),
        "models": np.abs(models).max(),
        "lowest": d.coefficient.min(),
        "highest": d.coefficient.max(),
        "width": one.width,
        "largest": one.largest,
        "speed": one.speed,
        "first_width": d.width[0],
        "last_width": d.width[-1],
        "first_z": d.gripper_height[0],
        "last_z": d.gripper_height[-1],
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("barrier_coefficient", "measured", "1",
            "within 1e-4 of the normal form; rod and solid within 1e-2; energy and work within 1e-6",
            "energy between the stable and the unstable state at z = {z:g} L* over (lambda_c - lambda)^(3/2), rho_a g "
            "L*^2 per width, elastica, at the smallest distance ({normal:.5g} by the normal form at the limit point, "
            "{rod:+.1%} on the rod, {solid:+.1%} on the solid; {lowest:.3g} to {highest:.3g} at other heights); the "
            "integral of the gripper's forces is the same energy to {work:.0e}, and the law holds to {curved:.1e} up "
            "to the touch", lambda f: f.apart < 1e-4 and f.models < 1e-2 and f.work < 1e-6, digits=5),
        Number("bistable_width", "width", "L*", "no criterion",
            "distance below lambda_c at z = {z:g} L* up to which the strip has a second state, with the sag on the "
            "floor ({first_width:.1e} L* at z = {first_z:g} L*, {last_width:.2g} L* at {last_z:g} L*); the barrier "
            "there is {largest:.2e} rho_a g L*^2 per width, the kinetic energy of an rms speed of {speed:.2g} "
            "sqrt(g L*) of the free part", digits=4),
    ),
}
# fmt: on


CURVES = {
    "width": (r"$\lambda_c-\lambda_t$ [$L^*$]", "-"),
    "largest": (r"barrier at $\lambda_t$ [$\rho_a g{L^*}^2$]", "--"),
    "speed": (r"its rms speed [$\sqrt{gL^*}$]", ":"),
}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the barrier over the distance and its law, (b) their ratio, (c) the end of the range over the height."""
    fig = figure(6.6)
    energy, ratio, ends = fig.subplots(3, 1, height_ratios=(1.2, 1.0, 1.0))
    distance = data["distance"].values
    color = MODEL_LOOKS["elastica"].color
    for height in data["gripper_height"].values:
        one = data.sel(gripper_height=height)
        width, largest = float(one["width"]), float(one["largest"])
        inside = np.isfinite(one["barrier"].values)
        x = np.append(distance[inside], width)
        y = np.append(one["barrier"].values[inside], largest)
        for ax, values in ((energy, y), (ratio, y / x**1.5)):
            ax.plot(x, values, color=color, lw=1.0, label="_elastica")
            ax.plot(width, values[-1], "x", color=color, ms=5, label="_touch")
        text_at(energy, (width, largest), f"$z = {height:g}\\,L^*$", (6, -3), ha="left", va="top", fontsize=7)
        text_at(ratio, (width, y[-1] / width**1.5), f"${height:g}\\,L^*$", (5, 0), ha="left", va="center", fontsize=7)
        for model, size in MODELS.items():
            found = one["model_coefficient"].sel(model=model)
            style = {"color": MODEL_LOOKS[model].color, "marker": MODEL_LOOKS[model].marker, "ls": "none", "ms": size}
            ratio.plot(distance.min(), found, **style, label=f"_{model}")
    shown = data.isel(gripper_height=data.sizes["gripper_height"] // 2)
    law = float(shown["coefficient"]) * distance**1.5
    energy.plot(distance, law, color=GREY, ls=":", lw=3.0, zorder=1)
    energy.set(xscale="log", yscale="log", ylabel=r"barrier$\,/\,\rho_a g{L^*}^2$")
    energy.set_ylim(top=1.0)
    handles = [entry("elastica", color), entry(r"$C\,(\lambda_c-\lambda)^{3/2}$", GREY, ":", lw=3.0)]
    energy.legend(handles=handles, loc="upper left", fontsize=7, bbox_to_anchor=(0.0, 0.92))
    ratio.set(xscale="log", ylabel=r"barrier$\,/\,(\lambda_c-\lambda)^{3/2}$")
    ratio.set_xlabel(r"distance $(\lambda_c-\lambda)\,/\,L^*$")
    low, high = ratio.get_ylim()
    ratio.set_ylim(low, high + 0.1 * (high - low))
    ratio.sharex(energy)
    energy.set_xlim(right=8.0 * distance.max())
    models = [
        entry(m, MODEL_LOOKS[m].color, "none", marker=MODEL_LOOKS[m].marker, ms=size) for m, size in MODELS.items()
    ]
    models.append(entry("sag touches", color, "none", marker="x", ms=5))
    ratio.legend(handles=models, loc="center right", fontsize=7, bbox_to_anchor=(1.0, 0.6))
    for name, (label, ls) in CURVES.items():
        ends.plot(data["range_height"], data[f"range_{name}"], color=BLACK, ls=ls, label=label)
    ends.set(xscale="log", yscale="log", xlabel="gripper height $z\\,/\\,L^*$", ylabel=r"at $\lambda_t$")
    ends.set_xticks([2, 3, 5, 10, 20], ["2", "3", "5", "10", "20"])
    ends.minorticks_off()
    ends.legend(loc="lower right", fontsize=7)
    for ax, letter in zip((energy, ratio, ends), "abc", strict=True):
        note(ax, f"({letter})")
    return fig
