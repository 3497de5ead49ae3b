"""Effect and cost of each effect in a scene: every scene with an effect on and off, the others on demand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, partial
from time import process_time
from typing import Any

import numpy as np
import xarray as xr

from stripfold.ask import collapse_record
from stripfold.ask.collapse_record import INERTIA, SELF_CONTACT, SOLID
from stripfold.ask.simulation import Simulation
from studies.common import NO_RESULT, Progress, dataset, grid, markdown_table, variables

SWITCHED = (SELF_CONTACT, INERTIA, SOLID)
"""Effects that can be on or off in a simulation: the floor is always there, and it has no internal friction."""
NUMBERS = tuple(name for name in variables("effects") if name not in ("scene", "effect"))


def run(
    scenes: Sequence[Mapping[str, Any]], repeats: int, threads: int = 1, progress: Progress | None = None
) -> xr.Dataset:
    """Simulate every scene with every effect on and off.

    ``scenes``: keys of :class:`.Simulation` without ``effects`` and ``model``, and a ``name``.  ``repeats``: how often
    each pair is timed, with and without in turns, so that both see the same load of the machine; the times are those of
    the processor.

    Dataset over ``scene`` and ``effect``.
    """
    given = {scene["name"]: {key: value for key, value in scene.items() if key != "name"} for scene in scenes}
    case = partial(_case, given, repeats)
    values = grid(case, NUMBERS, {"scene": list(given), "effect": SWITCHED}, threads, progress)
    return dataset("effects", values, {"repeats": repeats})


def _case(given: Mapping[str, Mapping[str, Any]], repeats: int, scene: str, effect: str) -> dict[str, float]:
    return compare(given[scene], effect, repeats)


@cache
def _warm_up() -> None:
    """One short simulation that is not counted: the first in a process loads what all use."""
    strip = {"length": 0.48, "height": 0.09, "eta_b": 3780.0, "disturbance": 1e-2}
    collapse_record.run(Simulation.of({**strip, "until": "touch", "effects": {SOLID: "on"}}))


def compare(given: Mapping[str, Any], effect: str, repeats: int) -> dict[str, float]:
    """One scene with an effect on and off: the names of :data:`NUMBERS`."""
    _warm_up()
    asked = {s: Simulation.of({**given, "effects": {effect: s}}) for s in ("on", "off")}
    seconds: dict[str, list[float]] = {s: [] for s in asked}
    found: dict[str, tuple[xr.Dataset, collapse_record.Clock]] = {}
    for repeat in range(repeats):
        # In turns, and the other one first each time: the second run finds warm caches and a hotter processor.
        for setting in sorted(asked, reverse=bool(repeat % 2)):
            began = process_time()
            found[setting] = collapse_record.timed(asked[setting])
            seconds[setting].append(process_time() - began)
    (on, on_clock), (off, off_clock) = found["on"], found["off"]
    unit = on.attrs["gravity_length"]
    change = abs(float(on["lambda_c"] / off["lambda_c"]) - 1.0)
    touch = abs(float(on["touch_x"] - off["touch_x"])) / unit
    # Other load of the machine makes a run longer, never shorter.
    least = {setting: min(taken) for setting, taken in seconds.items()}
    accuracy = asked["on"].accuracy
    # Time by the effect's own clock, with it less without it, over the time of everything else.
    clocked = (on_clock.self_contact - off_clock.self_contact) / (on_clock.whole - on_clock.self_contact)
    return {
        "needed": float(on["needed"].sel(effect=effect)),
        "reported": float(effect in off.attrs["missing"].split(", ")),
        # An omission of the model shows in lambda_c; one during the fall shows in the first touch.
        "matters": float(change > accuracy if effect == SOLID else not touch <= accuracy),
        "change": change,
        "touch_change": touch,
        "cost": least["on"] / least["off"] - 1.0,
        "clocked": clocked if effect == SELF_CONTACT else np.nan,
        "seconds_on": least["on"],
        "seconds_off": least["off"],
    }


def markdown(data: xr.Dataset) -> str:
    """The study as a table: a scene per row, an effect per column, with the time that leaving it out saves."""
    effects = list(data["effect"].values)
    scenes = data["scene"].values
    return markdown_table(
        ["scene", *effects],
        ([name, *(_cell(data.sel(scene=name, effect=effect)) for effect in effects)] for name in scenes),
    )


def _cell(one: xr.Dataset) -> str:
    if np.isnan(one["needed"]):
        return f"failed: {one[NO_RESULT].item()}"
    saved = float(one["seconds_on"] - one["seconds_off"])
    needed = "needed" if one["needed"] else "not needed"
    if one["reported"]:
        needed += ", reported when off"
    clocked = "" if np.isnan(one["clocked"]) else f"; by its own clock {float(one['clocked']):+.1%}"
    return f"{needed}; off saves {saved:.2g} of {float(one['seconds_on']):.2g} s ({float(one['cost']):+.1%}{clocked})"
