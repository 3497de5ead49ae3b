"""What each effect does to a scene and what it costs: every scene with an effect on and off, the rest on"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import process_time
from typing import Any

import numpy as np
import xarray as xr

from stripfold.analysis import collapse_data
from stripfold.analysis.needed_effects import INERTIA, MEMBRANE, SELF_CONTACT, SOLID
from stripfold.errors import SolveError
from stripfold.inputs import Simulation

SWITCHED = (SELF_CONTACT, INERTIA, SOLID, MEMBRANE)
"""What can be on and off in a simulation: the floor is what the strip begins on, and internal friction it has none."""
TEXTS = {
    "needed": ("1", "whether the scene says that it needs the effect, 1 or 0"),
    "reported": ("1", "whether switching it off was reported as lacking, 1 or 0"),
    "matters": ("1", "whether the result without it is another one, beyond the accuracy or the tolerance, 1 or 0"),
    "change": ("1", "relative change of lambda_c when it is switched on"),
    "touch_change": ("1", "change of the first touch's x when it is switched on / L*; nan: no touch without it"),
    "cost": ("1", "time with it over time without, minus one"),
    "clocked": (
        "1",
        "time that it takes itself, what its monitor takes anyway left out, over all other; nan: not clocked",
    ),
    "seconds_on": ("s", "processor time with it, the least of the repeats"),
    "seconds_off": ("s", "processor time without it, the least of the repeats"),
}


def run(scenes: Sequence[Mapping[str, Any]], repeats: int, progress: Callable[[str], None] | None = None) -> xr.Dataset:
    """Simulate every scene with every effect on and off.

    Parameters
    ----------
    scenes
        Keys of :class:`.Simulation` without ``effects`` and ``model``, and a ``name``.
    repeats
        How often each pair is timed, with and without in turns: a machine's mood then meets both.

    Returns
    -------
    Dataset over ``scene`` and ``effect``.
    """
    names = [scene["name"] for scene in scenes]
    columns = {name: np.full((len(scenes), len(SWITCHED)), np.nan) for name in TEXTS}
    messages = np.full((len(scenes), len(SWITCHED)), "", dtype=object)
    for i, scene in enumerate(scenes):
        given = {key: value for key, value in scene.items() if key != "name"}
        for j, effect in enumerate(SWITCHED):
            try:
                measured = compare(given, effect, repeats)
            except SolveError as error:
                messages[i, j], measured = str(error), {}
            for name, value in measured.items():
                columns[name][i, j] = value
            if progress:
                progress(f"{scene['name']}, {effect}: {messages[i, j] or measured}")
    over = ("scene", "effect")
    data: dict[str, Any] = {
        name: (over, columns[name], {"units": units, "long_name": text}) for name, (units, text) in TEXTS.items()
    }
    data["message"] = (over, messages, {"units": "1", "long_name": "the error's message"})
    coords = {
        "scene": ("scene", np.array(names, dtype=object), {"units": "1", "long_name": "name of the scene"}),
        "effect": ("effect", np.array(SWITCHED, dtype=object), {"units": "1", "long_name": "effect"}),
    }
    return xr.Dataset(data, coords=coords, attrs={"repeats": repeats})


def compare(given: Mapping[str, Any], effect: str, repeats: int) -> dict[str, float]:
    """One scene with an effect on and off: the names of :data:`TEXTS`."""
    asked = {s: Simulation.of({**given, "effects": {effect: s}}) for s in ("on", "off")}
    seconds: dict[str, list[float]] = {s: [] for s in asked}
    found: dict[str, xr.Dataset] = {}
    for repeat in range(repeats):
        # In turns, and the other one first each time: what runs second finds a warmer or a hotter machine.
        for setting in sorted(asked, reverse=bool(repeat % 2)):
            began = process_time()
            found[setting] = collapse_data.run(asked[setting])
            seconds[setting].append(process_time() - began)
    on, off = found["on"], found["off"]
    unit = on.attrs["gravity_length"]
    change = abs(on.attrs["lambda_c"] / off.attrs["lambda_c"] - 1.0)
    touch = abs(on.attrs["touch_x"] - off.attrs["touch_x"]) / unit
    # What else the machine does makes a run longer, never shorter.
    least = {setting: min(taken) for setting, taken in seconds.items()}
    accuracy = asked["on"].accuracy
    return {
        "needed": float(on["needed"].sel(effect=effect)),
        "reported": float(effect in off.attrs["missing"].split(", ")),
        # What a model leaves out shows in lambda_c; what happens in the fall, in where it ends.
        "matters": float(change > accuracy if effect in (SOLID, MEMBRANE) else not touch <= accuracy),
        "change": change,
        "touch_change": touch,
        "cost": least["on"] / least["off"] - 1.0,
        "clocked": _clocked(on, off, effect),
        "seconds_on": least["on"],
        "seconds_off": least["off"],
    }


def _clocked(on: xr.Dataset, off: xr.Dataset, effect: str) -> float:
    """What an effect's own clock says, more with it than without, over the time of all else."""
    own, watched = (float(found["seconds"].sel(effect=effect)) for found in (on, off))
    return (own - watched) / (float(on["computing"]) - own)


def markdown(data: xr.Dataset) -> str:
    """The study as a table: a scene per row, an effect per column, with the time that leaving it out saves."""
    effects = list(data["effect"].values)
    rows = ["| scene | " + " | ".join(effects) + " |", "|---" * (len(effects) + 1) + "|"]
    for name in data["scene"].values:
        cells = [_cell(data.sel(scene=name, effect=effect)) for effect in effects]
        rows.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(rows) + "\n"


def _cell(one: xr.Dataset) -> str:
    if np.isnan(one["needed"]):
        return f"failed: {one['message'].item()}"
    saved = float(one["seconds_on"] - one["seconds_off"])
    needed = "needed" if one["needed"] else "not needed"
    if one["reported"]:
        needed += ", reported when off"
    clocked = "" if np.isnan(one["clocked"]) else f"; by its own clock {float(one['clocked']):+.1%}"
    return f"{needed}; off saves {saved:.2g} of {float(one['seconds_on']):.2g} s ({float(one['cost']):+.1%}{clocked})"
