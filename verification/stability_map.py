"""The stability map: its boundaries against critical points found one by one, on the elastica and the rod; its time.

Lengths in L*, eigenvalues in g/L*, energies per width in rho_a g L*^2.  Source: docs/map.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import PATH_LOOKS, PATH_STYLES, note
from stripfold import elastica
from stripfold.ask.map import GripperMap, gripper_map
from stripfold.ask.prediction import ElasticaPrediction, end_of_advance
from stripfold.draw.colours import CRITICAL, GREEN, HANGING
from stripfold.draw.results import CURVES, draw_map
from stripfold.draw.style import figure, legend_above, styled
from stripfold.follow.statics import StripModel
from stripfold.paths.geometric import low
from tasks.assess_data import PATHS, path_of
from verification.common import Progress, command, dataset, timed_process
from verification.numbers import Facts, Number, seed_of

UNITS = {"s": "wall"}
COMMAND = ("map", "--length", "0.5", "--eta-b", "3780", "--json")
"""A strip of 16.7 L*."""
LENGTH, LOW, POINTS = 20.0, 1.2, 201
"""The strip whose map is drawn, the height of its low path, and the places of each path."""
PLACES = 121, 81
"""Places of the grid that is drawn, along the advance and the height."""
HEIGHT, DISTANCES = 5.0, np.array([0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.07, 0.2, 0.5, 1.0, 2.0])
"""Where the margins are compared: height, and distances from lambda_c there."""


def run(
    lengths: Sequence[float] = (7.5, 20.0),
    checked: int = 20,
    seed: int = 1,
    rod_heights: Sequence[float] = (1.7, 3.0, 5.5, 10.0),
    thicknesses: Sequence[float] = (0.0594, 0.0297, 0.01485),
    refinement: float = 0.5,
    repeats: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Errors of the boundaries, and the map of one strip with four paths on it.

    ``lengths``, ``checked``: strips whose boundaries are compared with critical points at as many random heights each.
    ``rod_heights``, ``thicknesses``, ``refinement``: of the rod.  ``repeats``: of the timed command.
    """
    draw = np.random.default_rng(seed)
    maps = [gripper_map(length) for length in lengths]
    errors = [[_error(one, z) for z in draw.uniform(0.1, one.snap.z[-1], checked)] for one in maps]
    strips = [StripModel(LENGTH, h, kind="rod") for h in thicknesses]
    predicted = [ElasticaPrediction.at(z) for z in rod_heights]
    rod = [[end_of_advance(strip, one, refinement).lam for one in predicted] for strip in strips]
    found = gripper_map(LENGTH)
    on, at = elastica.critical(HEIGHT).advance - DISTANCES, np.full(DISTANCES.size, HEIGHT)
    advance = np.linspace(0.0, found.lifted_landed[-1, 0], PLACES[0])
    heights = np.linspace(0.0, found.lifted[:, 1].max(), PLACES[1])
    curves = {
        "snap": np.stack([found.snap.advance, found.snap.z], axis=1),
        "sag_touch": np.stack([found.touch.advance, found.touch.z], axis=1),
        "lifted": found.lifted,
        "lifted_landed": found.lifted_landed,
    }
    paths = [path_of(name, LENGTH) for name in PATHS] + [low(LENGTH, LOW)]
    places = np.stack([[path.position(s) for s in np.linspace(0.0, path.length, POINTS)] for path in paths])
    places[..., 0] += LENGTH / 2.0
    return dataset(
        {
            "length": ("length", list(lengths)),
            "error": (("length", "case"), errors),
            "thickness": ("thickness", list(thicknesses)),
            "rod": (("thickness", "rod_height"), rod),
            "elastica": ("rod_height", found.snap.at(np.array(rod_heights))),
            "distance": ("distance", DISTANCES),
            "margin_there": ("distance", found.margin(on, at)),
            "eigenvalue_there": ("distance", found.eigenvalues(on, HEIGHT)),
            "barrier_there": ("distance", found.barrier(on, at)),
            "wall": ("repeat", timed_process(command(*COMMAND), repeats)[0]),
            **{name: ((f"on_{name}", "axis"), rows) for name, rows in curves.items()},
            "advance": ("advance", advance),
            "z": ("z", heights),
            "margin": (("z", "advance"), found.margin(*np.meshgrid(advance, heights))),
            "path": ("path", [*PATHS, "low"]),
            "places": (("path", "point", "axis"), places),
            "path_margin": (("path", "point"), found.margin(places[..., 0], places[..., 1])),
        },
        {"seed": seed},
        units=UNITS,
    )


def _error(found: GripperMap, z: float) -> float:
    """Distance of a boundary from the end of the advance found at this height alone."""
    alone = elastica.critical(z)
    return abs(float((found.snap if alone.snap else found.touch).at(z)) - alone.state.advance)


def facts(d: xr.Dataset) -> Facts:
    """How far the boundaries are from states found alone and from the rod's, and the time of the whole."""
    apart = np.abs(d.rod / d.elastica - 1.0).max("rod_height").sortby("thickness")
    thin, thick = apart[0], apart[-1]
    return {
        "error": d.error.max(),
        "states": d.error.size,
        "seed": seed_of(d),
        "lengths": d.sizes["length"],
        "wall": d.wall.median(),
        "rod": thin,
        "thin": thin.thickness,
        "order": np.log(thick / thin) / np.log(thick.thickness / thin.thickness),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("map_boundary_error", "error", "L*", "< 1e-6 L*",
            "largest distance along x of the boundaries of the stability map, snap and touch continued in the height, "
            "from {states} critical and touching states of the elastica found alone, at random heights ({seed}), "
            "{lengths} lengths of the strip"),
        Number("map_rod_difference", "rod", "1", "< 1e-3; falls with the thickness squared, exponent 2 within 0.1",
            "largest relative distance of the snap boundary of a rod {thin:.3g} L* thick, continued in the height, "
            "from the map's; its exponent in the thickness is {order:.3g}", lambda f: abs(f.order - 2.0) < 0.1),
        Number("map_seconds", "wall", "s", "<= 5 s, one core",
            "time of one `stripfold map`, the whole process, strip of 16.7 L*: median"),
    ),
}
# fmt: on

LEVELS = [1.0, 3.0, 5.0]
"""Margins that are drawn, L*."""
STYLES: dict[str, tuple[str, dict[str, Any]]] = {
    name: (label, {"color": look.color, "ls": PATH_STYLES[name]}) for name, (label, look) in PATH_LOOKS.items()
} | {"low": ("low path", {"color": GREEN, "ls": "-."})}
THERE = {
    "margin_there": ("margin$\\,/\\,L^*$", {"color": HANGING, "ls": "-"}),
    "eigenvalue_there": ("eigenvalue$\\,/\\,(g/L^*)$", {"color": CRITICAL, "ls": "--"}),
    "barrier_there": ("barrier$\\,/\\,\\rho_a g{L^*}^2$", {"color": CRITICAL, "ls": ":"}),
}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the map with the paths, (b) the margin along the paths, (c) three margins over the distance along x."""
    fig = figure(6.5)
    plane, along, there = fig.subplots(3, 1, height_ratios=(1.75, 1.0, 1.0))
    curves = {name: data[name].values for name in CURVES}
    draw_map(plane, curves, data["advance"].values, data["z"].values, data["margin"].values, LEVELS, "$L^*$")
    travelled = np.linspace(0.0, 1.0, data.sizes["point"])
    for path, (label, style) in STYLES.items():
        one = data.sel(path=path)
        plane.plot(*one["places"].values.T, lw=1.1, zorder=4, label=label, **style)
        along.plot(travelled, one["path_margin"].values, label=f"_{path}", **style)
    plane.set(aspect="equal", xlabel="advance of the gripper$\\,/\\,L^*$", ylabel="gripper height$\\,/\\,L^*$")
    plane.set(xlim=(-0.5, 1.3 * LENGTH), ylim=(0.0, None))
    plane.grid(visible=False)
    handles = plane.get_legend_handles_labels()[0]
    legend_above(fig, handles[: -len(STYLES)], fontsize=7)
    along.legend(handles=handles[-len(STYLES) :], fontsize=7, loc="upper right")
    highest = 1.25 * float(data["path_margin"].max())  # room for the letter
    along.set(xlabel="part of the path", ylabel="margin$\\,/\\,L^*$", xlim=(0.0, 1.0), ylim=(0.0, highest))
    for name, (label, style) in THERE.items():
        there.plot(data["distance"], data[name], label=label, **style)
    there.set(xscale="log", yscale="log", xlabel="$(\\lambda_c-\\lambda)\\,/\\,L^*$")
    there.set_xlim(right=10.0 * float(data["distance"].max()))  # room for the legend
    there.legend(fontsize=7, loc="lower right")
    for ax, text in ((plane, "(a)"), (along, "(b)"), (there, f"(c) at $z={HEIGHT:g}\\,L^*$")):
        note(ax, text)
    return fig
