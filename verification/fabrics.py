"""Real fabrics in units of their own weight and stiffness, and their friction beside that which an R-path needs.

With the weight w per area and the bending rigidity B, L* = (B / w)^(1/3).  Kawabata's test also gives 2HB, the width of
the loop: M_0 is half of it.  A first bending, moment = M_0 + B kappa, gives B and M_0 by a straight line.  An R-path is
planned for the given eta_b and followed by rods with the least, the given and the largest one of an interval: M_0
suffices if all of them follow.  And with the friction of the fabrics rods are followed along paths to their folds, as
is a chain of point masses that shares no code with them.  Source: docs/physics.md, sections 8 and 10; docs/plan.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.all_materials import MOMENT
from plots.pieces import LENGTH_TITLE, note
from stripfold import elastica, paths
from stripfold.ask.assess import assess
from stripfold.ask.fabric import TABLE
from stripfold.ask.friction import bisected, lost_with
from stripfold.ask.inputs import PathInputs, PlanInputs
from stripfold.ask.plan import candidates
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import GRAVITY, Material
from stripfold.draw.colours import BLACK, FRICTION, GREY, SKY, VERMILLION
from stripfold.draw.style import CM, figure, styled
from stripfold.files import tables
from stripfold.paths.rpath import half_fold
from tasks import textile
from verification.chain import Chain
from verification.common import NO_RESULT, Progress, dataset, grid
from verification.numbers import Facts, Number

UNITS = {"m": "gravity_length"}
COLUMNS = (
    "name,fibre,weave,areal_density_kg_per_m2,B_N_m,2HB_N,b_1_warp_N_m,b_1_weft_N_m,b_2_warp_N_m2,b_2_weft_N_m2,source"
)
MAX_ROWS = 1000
ETA_B = 3780.0
"""Any: in units of L* a strip of one length is nearly one strip."""
NARROW, MOST = 1.15, 2.0
"""Ratio of the bracket's ends at which the search for M_0 ends; largest M_0 tried, rho_a g L*^2."""
EXACT = 0.02
"""M_0 with which strips of up to 20 L* follow R-paths planned for their own eta_b, rho_a g L*^2."""
UNCERTAIN = 2.2e-3
"""M_0 over (length / L*)^1.5 and the root of the relative uncertainty of eta_b, rho_a g L*^2: searches for strips of 14
to 40 L* and 5 to 20 % found 0.8 to 1.4 times as much."""
THICKNESS = 0.05
"""Of the strips that are folded, L*: of the thinner chain the waves along it are too fast."""
FOLDS = "rod", "chain", "snaps", "hurry"
PARTS = 500
"""How often the chain's speed is looked at."""
SPACING, SPEED, REST, DRAG = 0.06, 0.03, 40.0, 0.03
"""Distance of the chain's nodes, L*; speed of its gripper, sqrt(g L*), and for how long that stands at the end; air."""


def run(
    table: str = str(TABLE),
    measured: str = "data/textile_moment_curvature.csv",
    areal_load: float = 13.6,
    height: float = 3.0,
    lengths: Sequence[float] = (14.0,),
    uncertainties: Sequence[float] = (0.0, 0.2),
    folded: Sequence[float] = (11.0,),
    ways: Sequence[str] = ("low",),
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """L* of the fabrics of ``table``, over ``fabric``; M_0 of those with 2HB, over ``bent``, of a textile, and needed.

    ``table``: with the header :data:`COLUMNS`; 2HB may be empty.  ``measured``, ``areal_load``: moment-curvature table
    of the textile as it is first bent, and its weight per area, N m^-2.  ``height``: at whose critical state the
    textile's secant is taken, L*.  ``lengths``, ``uncertainties``: of strips on R-paths, L*; of eta_b, relative.
    ``folded``, ``ways``: lengths of strips that are folded with the friction of each fabric, L*, and their paths: ones
    that do not push what lies, as under a push the chain's flat strip may ruck.
    """
    path = Path(table)
    known = tables.read_table("table", path, COLUMNS, (1, MAX_ROWS))
    loops = replace(known, rows=[row for row in known.rows if row[1][5]])
    density, rigidity = known.numbers(slice(3, 5)).T
    numbers = loops.numbers(slice(3, 6))
    least = float(min(density.min(), rigidity.min(), numbers.min()))
    if least <= 0.0:
        raise InvalidInputError("table", least, "positive areal densities, rigidities and 2HB", f"see {path}")
    bent = textile.read_table(measured)
    moment = np.polyfit(bent[:, 0], bent[:, 1], 1)[1]  # moment = M_0 + B kappa in a first bending
    secant = textile.secant(bent, areal_load, textile.largest_curvature(elastica.critical(height).state))
    weight = GRAVITY * numbers[:, 0]
    friction = 0.5 * numbers[:, 2] / (weight * np.cbrt(numbers[:, 1] / weight) ** 2)
    folds = grid(fold, FOLDS, {"moment": friction, "way": ways, "folded": folded}, threads, progress)
    folds["fold_no_result"] = folds.pop(NO_RESULT)
    return dataset(
        {
            "fabric": ("fabric", [row[0] for _, row in known.rows]),
            "gravity_length": ("fabric", np.cbrt(rigidity / (GRAVITY * density))),
            "bent": ("bent", [row[0] for _, row in loops.rows]),
            "friction": ("bent", friction),
            "textile_friction": ((), moment / (areal_load * np.cbrt(secant.stiffness / areal_load) ** 2)),
            **grid(needed, ("suffices",), {"length": lengths, "uncertainty": uncertainties}, threads, progress),
            **folds,
        },
        units=UNITS,
    )


def needed(length: float, uncertainty: float) -> dict[str, float]:
    """The least M_0 found to suffice, rho_a g L*^2 of the given strip; raises SolveError: there is none."""
    unit = Material(ETA_B).gravity_length
    given = PlanInputs(length=length * unit, eta_b=ETA_B, eta_b_uncertainty=uncertainty)
    curve, scale = paths.r_path(given).curve, given.material.force_scale * unit
    strips = given.strips if uncertainty else given.strips[1:2]
    followed = [(strip.material, strip.length, curve.scaled(1.0 / strip.gravity_length)) for strip in strips]

    def holds_with(moment: float) -> bool | None:
        return True if lost_with(followed, moment * scale, None) is None else None

    return {"suffices": bisected(holds_with, estimate(length, uncertainty), 1.3, NARROW, MOST)[1]}


def estimate(length: float, uncertainty: float) -> float:
    """Estimate M_0, rho_a g L*^2, with which a strip, L*, follows an R-path for a relative ``uncertainty`` of eta_b."""
    return max(EXACT, UNCERTAIN * length**1.5 * sqrt(uncertainty))


def fold(moment: float, way: str, length: float) -> dict[str, float]:
    """Errors of the folds of a rod and of a chain with a friction moment, L*, on a path with a hinge.

    And whether the rod snaps on it, and the chain's largest speed over that of its gripper.
    """
    unit = Material(ETA_B).gravity_length
    asked = PlanInputs(length=length * unit, eta_b=ETA_B, eta_m=ETA_B * (THICKNESS * unit) ** 2 / 12.0)
    path = next(one.path for one in candidates(asked) if one.name == way)
    friction = moment * asked.material.force_scale * unit
    strip = PathInputs(length=asked.length, eta_b=asked.eta_b, eta_m=asked.eta_m, friction_moment=friction, model="rod")
    found = assess(strip, path, compare=False)
    chain = Chain.of(length, THICKNESS, SPACING, moment)
    travelled, places = path.curve.sampled(path.spacing)
    s = np.arange(0.0, travelled[-1] / unit + REST * SPEED, SPEED * chain.step)
    gripper = np.column_stack([np.interp(s, travelled / unit, of / unit) for of in places.T])
    state, speeds = chain.flat(), list[float]()
    for part in np.array_split(gripper, PARTS):
        chain.follow(state, part, DRAG)
        speeds.append(float(np.hypot(*state[2:4]).max()))
    exact = half_fold(length).folded.at(np.linspace(0.0, length, state.shape[1]))
    return {
        "rod": found.shape_error / unit,
        "chain": float(np.hypot(*(state[:2].T - exact).T).max()),
        "snaps": float(not found.stable),
        "hurry": max(speeds) / SPEED,
    }


def facts(d: xr.Dataset) -> Facts:
    """Friction of fabrics, and over what R-paths need, with the smallest and the largest uncertainty of eta_b."""
    least, median = float(d.friction.min()), float(d.friction.median())

    def each(needed: xr.DataArray) -> str:
        rows = zip(d.length.values, needed.values, strict=True)
        return ", ".join(f"{least / m:.2g} and {median / m:.2g} at {length:g} L*" for length, m in rows)

    exact, uncertain = (d.suffices.sel(uncertainty=u) for u in (d.uncertainty.min(), d.uncertainty.max()))
    return {
        "bent": d.sizes["bent"],
        "median": median,
        "least": least,
        "most": d.friction.max(),
        "uncertainty": d.uncertainty.max(),
        # A length for which none was found has no margin.
        "exact": (least / exact).fillna(0.0).min(),
        "uncertain": (least / uncertain).fillna(0.0).min(),
        "exact_each": each(exact),
        "uncertain_each": each(uncertain),
    }


def of_folds(d: xr.Dataset) -> list[Facts]:
    """None where nothing is folded."""
    if not d.rod.size:
        return []
    apart = np.abs(d.rod - d.chain)
    found = {"folds": d.rod.size, "snaps": d.snaps.fillna(1.0).sum(), "hurry": d.hurry.max()}
    found |= {"lengths": ", ".join(f"{length:g}" for length in d.folded.values), "ways": ", ".join(d.way.values)}
    return [
        found | {"apart": apart.max(skipna=False), "usual": apart.median(), "least": d.rod.min(), "most": d.rod.max()}
    ]


# fmt: off
NUMBERS = {
    facts: (
        Number("fabric_friction_median", "median", "1", "no criterion",
            "median M_0 / rho_a g L*^2 of the fabrics with 2HB; smallest {least:.2f}, largest {most:.2f}"),
        Number("friction_margin_exact", "exact", "1", "> 1",
            "least M_0 of the {bent} fabrics with 2HB over the M_0 that suffices on the R-path of a strip whose eta_b "
            "is known exactly, the least over the lengths; least and median fabric by length: {exact_each}",
            spread=0.2),
        Number("friction_margin_uncertain", "uncertain", "1", "> 1",
            "the same where eta_b is known to {uncertainty:.0%} and all of the interval must be followed: "
            "{uncertain_each}", spread=1.0),
    ),
    of_folds: (
        Number("fabric_folds_snap", "snaps", "count", "= 0",
            "of {folds} folds with the friction of these fabrics (paths: {ways}; strips of {lengths} L\\*) those on "
            "which the rod snaps or that could not be followed; an explicit chain of masses is nowhere faster than "
            "{hurry:.2g} times its gripper"),
        Number("fabric_fold_difference", "apart", "L*", "<= 0.02 L*",
            "largest difference between rod and chain in the errors of these folds, which are {least:.2g} to "
            "{most:.2g} L\\*; the median difference is {usual:.2g}", spread=1.0),
    ),
}
# fmt: on


KNOWN = (BLACK, SKY, VERMILLION, FRICTION)
"""Colours of the uncertainties of eta_b."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the share of fabrics up to each L*, (b) the M_0 that an R-path needs, beside that of fabrics."""
    fig = figure(5.4)
    top, bottom = fig.subplots(2, 1, height_ratios=(1.0, 1.6))
    lengths = data["gravity_length"].sortby(data["gravity_length"])
    share = (np.arange(len(lengths)) + 1.0) / len(lengths)
    tested = np.isin(lengths["fabric"].values, data["bent"].values)
    for chosen, label, fill in ((tested, "Kawabata's test", BLACK), (~tested, "cantilever", "white")):
        top.plot(CM * lengths.values[chosen], share[chosen], "o", ms=4, color=BLACK, mfc=fill, label=label)
    top.set(xlabel="$L^*$ [cm]", ylabel="share of fabrics", xlim=(0.0, None), ylim=(0.0, 1.05))
    top.legend(loc="lower right", fontsize=7)
    for color, (uncertainty, one) in zip(KNOWN, data["suffices"].groupby("uncertainty"), strict=False):
        known = f"known to {100.0 * uncertainty:g} %" if uncertainty else "known exactly"
        bottom.plot(data["length"], one.squeeze(), "o-", ms=4, color=color, label=rf"$\eta_b$ {known}")
    right = float(data["length"].max())
    left = float(data["length"].min())
    own = dict(zip(data["bent"].values, data["friction"].values, strict=True))
    own["dry textile (secant)"] = float(data["textile_friction"])
    # Alternately at either side: neighbours may be close.
    for i, (name, moment) in enumerate(sorted(own.items(), key=lambda item: item[1])):
        bottom.axhline(moment, color=GREY, lw=0.8, ls=":", zorder=0)
        x, side, below = (right, "right", "top") if i % 2 else (left, "left", "bottom")
        bottom.text(x, moment, name, ha=side, va=below, fontsize=7, color=GREY)
    bottom.set(yscale="log", xlabel=LENGTH_TITLE, ylabel=MOMENT.split(": ")[1])
    bottom.set_ylim(None, 1.6 * max(own.values()))
    bottom.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=7)
    note(top, "(a)")
    note(bottom, "(b)", "lower right")
    return fig
