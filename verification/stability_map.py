"""The stability map: its boundaries against critical points found one by one, on the elastica and the rod; its time.

Lengths in L*, eigenvalues in g/L*, energies per width in rho_a g L*^2.  Source: docs/map.md.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.ask.map import GripperMap, gripper_map
from stripfold.ask.prediction import stability_boundary
from stripfold.base.arrays import Array
from stripfold.follow.statics import StripModel
from stripfold.paths.low_path import low
from tasks.assess_data import PATHS, path_of
from verification.common import Progress, command, dataset, timed_process
from verification.numbers import Facts, Number, seed_of

UNITS = {"s": "solving wall"}

COMMAND = ("map", "--length", "0.5", "--eta-b", "3780", "--json")
"""A strip of 16.7 L*."""
LOW = "low"
POINTS = 201
"""Places of each path."""
PLACES = 121, 81
"""Places of the grid that is drawn, along the advance and the height."""


def run(
    lengths: Sequence[float] = (7.5, 20.0),
    checked: int = 20,
    seed: int = 1,
    rod_heights: Sequence[float] = (1.7, 3.0, 5.5, 10.0),
    thicknesses: Sequence[float] = (0.0594, 0.0297, 0.01485),
    refinement: float = 0.5,
    length_star: float = 20.0,
    low_height: float = 1.2,
    height: float = 5.0,
    distances: Sequence[float] = (0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.07, 0.2, 0.5, 1.0, 2.0),
    repeats: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Errors of the boundaries, and the map of one strip with four paths on it.

    Parameters
    ----------
    lengths, checked, seed
        Strips whose boundaries are compared with critical points at as many random heights each.
    rod_heights, thicknesses, refinement
        Of the rod, whose critical points are continued over the heights.
    length_star, low_height
        The strip whose map is stored, and the height of its low path.
    height, distances
        Height at which the margins are compared, and distances from lambda_c there.
    repeats
        Of the timed command.
    """
    say = progress or (lambda _: None)
    draw = np.random.default_rng(seed)
    errors = []
    for length in lengths:
        say(f"length {length:g}")
        found = gripper_map(length)
        heights = draw.uniform(0.1, found.snap.z[-1], checked)
        errors.append([_error(found, z) for z in heights])
    say("rod")
    strips = [StripModel(length_star, h, kind="rod") for h in thicknesses]
    rod = [[r.lam for r in stability_boundary(((strip, z) for z in rod_heights), refinement)] for strip in strips]
    say("map")
    found = gripper_map(length_star)
    on = np.array([elastica.critical(z).advance for z in (height,)]) - np.array(distances)
    walls, answers, _ = timed_process(command(*COMMAND), repeats)
    return dataset(
        {
            "length": ("length", list(lengths)),
            "error": (("length", "case"), errors),
            "thickness": ("thickness", list(thicknesses)),
            "rod_height": ("rod_height", list(rod_heights)),
            "rod": (("thickness", "rod_height"), rod),
            "elastica": ("rod_height", found.snap.at(np.array(rod_heights))),
            "distance": ("distance", list(distances)),
            "margin_there": ("distance", found.margin(on, np.full(on.size, height))),
            "eigenvalue_there": ("distance", found.eigenvalues(on, height)),
            "barrier_there": ("distance", found.barrier(on, np.full(on.size, height))),
            "wall": ("repeat", walls),
            "solving": ("repeat", [json.loads(answer)["seconds"] for answer in answers]),
        }
        | _drawn(found)
        | _paths(found, low_height),
        {"seed": seed, "length_star": length_star, "low": low_height, "height": height, "command": " ".join(COMMAND)},
        units=UNITS,
    )


def _error(found: GripperMap, z: float) -> float:
    """Distance of a boundary from the end of the advance found at this height alone."""
    alone = elastica.critical(z)
    return abs(float((found.snap if alone.snap else found.touch).at(z)) - alone.state.advance)


def _drawn(found: GripperMap) -> dict[str, tuple[object, Array]]:
    columns, rows = PLACES
    advance = np.linspace(0.0, found.lifted_landed[-1, 0], columns)
    heights = np.linspace(0.0, found.lifted[:, 1].max(), rows)
    curves = {
        "snap": np.stack([found.snap.advance, found.snap.z], axis=1),
        "sag_touch": np.stack([found.touch.advance, found.touch.z], axis=1),
        "lifted": found.lifted,
        "lifted_landed": found.lifted_landed,
    }
    values: dict[str, tuple[object, Array]] = {name: ((f"on_{name}", "axis"), rows) for name, rows in curves.items()}
    margin = found.margin(*np.meshgrid(advance, heights))
    return values | {"advance": ("advance", advance), "z": ("z", heights), "margin": (("z", "advance"), margin)}


def _paths(found: GripperMap, low_height: float) -> dict[str, tuple[object, object]]:
    """Places and margins of the paths, over the part of their length that has been travelled."""
    paths = [path_of(name, found.length) for name in PATHS] + [low(found.length, low_height)]
    places = np.stack([[path.position(s) for s in np.linspace(0.0, path.length, POINTS)] for path in paths])
    places[..., 0] += found.length / 2.0
    return {
        "path": ("path", [*PATHS, LOW]),
        "places": (("path", "point", "axis"), places),
        "path_margin": (("path", "point"), found.margin(places[..., 0], places[..., 1])),
    }


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
