"""Real fabrics in units of the strip's own weight and stiffness, from published measurements.

With the weight w per area and the bending rigidity B, L* = (B / w)^(1/3).  Kawabata's test also gives 2HB, the width of
the loop: M_0 is half of it.  A first bending, moment = M_0 + B kappa, gives B and M_0 by a straight line.
Source: docs/physics.md, section 8.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.friction_needed import MOMENT
from plots.pieces import LENGTH_TITLE, note
from stripfold import elastica
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import GRAVITY
from stripfold.draw.colours import BLACK, FRICTION, GREY, SKY, VERMILLION
from stripfold.draw.style import CM, figure, styled
from stripfold.files import tables
from tasks import textile
from verification.common import dataset
from verification.numbers import Facts, Number

UNITS = {
    "kg m^-2": "areal_density",
    "m^-4 s^2": "eta_b",
    "m": "gravity_length",
    "N": "loop_width textile_moment",
    "N m": "rigidity textile_rigidity",
}

COLUMNS = (
    "name,fibre,weave,areal_density_kg_per_m2,B_N_m,2HB_N,b_1_warp_N_m,b_1_weft_N_m,b_2_warp_N_m2,b_2_weft_N_m2,source"
)
MAX_ROWS = 1000


def run(
    table: str = "data/fabrics.csv",
    measured: str = "data/textile_moment_curvature.csv",
    areal_load: float = 13.6,
    height: float = 3.0,
) -> xr.Dataset:
    """L* of the fabrics of ``table``, over ``fabric``; friction of those with 2HB, over ``bent``, and of a textile.

    ``table``: path of the fabrics' table, with the header :data:`COLUMNS`; 2HB may be empty.  ``measured``,
    ``areal_load``: moment-curvature table of the textile as it is first bent, and its weight per area, N m^-2.
    ``height``: height of the gripper at whose critical state the textile's secant is taken, L*.  Raises
    InvalidInputError: a table that cannot be read, or a value that is not positive.
    """
    path = Path(table)
    known = tables.read_table("table", path, COLUMNS, (1, MAX_ROWS))
    rows = [row for _, row in known.rows]
    name, fibre, weave, *_, source = (list(column) for column in zip(*rows, strict=True))
    with_loop = np.array([row[5] != "" for row in rows])
    density, rigidity = known.numbers(slice(3, 5)).T
    loop = replace(known, rows=[row for row in known.rows if row[1][5]]).numbers(slice(5, 6))[:, 0]
    least = float(np.concatenate([density, rigidity, loop]).min())
    if least <= 0.0:
        raise InvalidInputError("table", least, "positive areal densities, rigidities and 2HB", f"see {path}")
    weight = GRAVITY * density
    unit = np.cbrt(rigidity / weight)
    bent = textile.read_table(measured)
    slope, moment = np.polyfit(bent[:, 0], bent[:, 1], 1)  # moment = M_0 + B kappa in a first bending
    secant = textile.secant(bent, areal_load, textile.largest_curvature(elastica.critical(height).state))
    units = {"": np.cbrt(slope / areal_load), "_secant": np.cbrt(secant.stiffness / areal_load)}
    return dataset(
        {
            "fabric": ("fabric", name),
            "fibre": ("fabric", fibre),
            "weave": ("fabric", weave),
            "source": ("fabric", source),
            "areal_density": ("fabric", density),
            "rigidity": ("fabric", rigidity),
            "gravity_length": ("fabric", unit),
            "eta_b": ("fabric", density / rigidity),
            "bent": ("bent", np.array(name)[with_loop]),
            "loop_width": ("bent", loop),
            "friction": ("bent", 0.5 * loop / (weight * unit**2)[with_loop]),
            "textile_rigidity": ((), slope),
            "textile_moment": ((), moment),
            **{f"textile_friction{of}": ((), moment / (areal_load * unit**2)) for of, unit in units.items()},
        },
        units=UNITS,
    )


def facts(d: xr.Dataset) -> Facts:
    """L* of fabrics and their friction."""
    lengths = 100.0 * d.gravity_length  # cm
    return {
        "count": d.sizes["fabric"],
        "shortest": lengths.min(),
        "length": lengths.median(),
        "longest": lengths.max(),
        "bent": d.sizes["bent"],
        "median": d.friction.median(),
        "least": d.friction.min(),
        "most": d.friction.max(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("fabric_friction_median", "median", "1", "no criterion",
            "median M_0 / rho_a g L*^2 of the fabrics with 2HB; smallest {least:.2f}, largest {most:.2f}"),
    ),
}
# fmt: on


KNOWN = (BLACK, SKY, VERMILLION, FRICTION)
"""Colours of the uncertainties of eta_b."""


@styled
def draw(data: xr.Dataset, needed: xr.Dataset) -> Figure:
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
    for color, (uncertainty, one) in zip(KNOWN, needed["suffices"].groupby("uncertainty"), strict=False):
        known = f"known to {100.0 * uncertainty:g} %" if uncertainty else "known exactly"
        bottom.plot(needed["length"], one.squeeze(), "o-", ms=4, color=color, label=rf"$\eta_b$ {known}")
    right = float(needed["length"].max())
    left = float(needed["length"].min())
    own = dict(zip(data["bent"].values, data["friction"].values, strict=True))
    own["dry textile (secant)"] = float(data["textile_friction_secant"])
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
