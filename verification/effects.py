"""Effect and cost of each effect in a scene: every scene with an effect on and off, the others on demand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, partial
from time import process_time
from typing import Any

import numpy as np
import xarray as xr

from stripfold.ask import collapse
from stripfold.ask.collapse import INERTIA, SELF_CONTACT, SOLID
from stripfold.ask.inputs import Simulation
from verification.common import NO_RESULT, Progress, dataset, grid, markdown_table
from verification.numbers import Facts, Number

UNITS = {"s": "seconds_off seconds_on"}

SWITCHED = (SELF_CONTACT, INERTIA, SOLID)
"""Effects that can be on or off in a simulation: the floor is always there, and it has no internal friction."""
VALUES = (
    "change",
    "clocked",
    "cost",
    "matters",
    "needed",
    "reported",
    "seconds_off",
    "seconds_on",
    "touch_change",
)


SCENES = ({"name": "paper's", "length": 0.48, "height": 0.09, "eta_b": 3780.0, "disturbance": 0.01, "until": "touch"},)


def run(
    scenes: Sequence[Mapping[str, Any]] = SCENES, repeats: int = 1, threads: int = 1, progress: Progress | None = None
) -> xr.Dataset:
    """Simulate every scene with every effect on and off.

    ``scenes``: keys of :class:`.Simulation` without ``effects`` and ``model``, and a ``name``.  ``repeats``: how often
    each pair is timed, with and without in turns, so that both see the same load of the machine; the times are those of
    the processor.

    Dataset over ``scene`` and ``effect``.
    """
    given = {scene["name"]: {key: value for key, value in scene.items() if key != "name"} for scene in scenes}
    case = partial(_case, given, repeats)
    values = grid(case, VALUES, {"scene": list(given), "effect": SWITCHED}, threads, progress)
    return dataset(values, {"repeats": repeats}, units=UNITS)


def _case(given: Mapping[str, Mapping[str, Any]], repeats: int, scene: str, effect: str) -> dict[str, float]:
    return compare(given[scene], effect, repeats)


@cache
def _warm_up() -> None:
    """One short simulation that is not counted: the first in a process loads what all use."""
    strip = {"length": 0.48, "height": 0.09, "eta_b": 3780.0, "disturbance": 1e-2}
    collapse.run(Simulation.of({**strip, "until": "touch", "effects": {SOLID: "on"}}))


def compare(given: Mapping[str, Any], effect: str, repeats: int) -> dict[str, float]:
    """One scene with an effect on and off: the names of :data:`VALUES`."""
    _warm_up()
    asked = {s: Simulation.of({**given, "effects": {effect: s}}) for s in ("on", "off")}
    seconds: dict[str, list[float]] = {s: [] for s in asked}
    found: dict[str, tuple[xr.Dataset, collapse.Clock]] = {}
    for repeat in range(repeats):
        # In turns, and the other one first each time: the second run finds warm caches and a hotter processor.
        for setting in sorted(asked, reverse=bool(repeat % 2)):
            began = process_time()
            found[setting] = collapse.timed(asked[setting])
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


def facts(d: xr.Dataset) -> Facts:
    needed, idle = d.needed == 1.0, d.needed == 0.0
    # The effect's own clock is more precise than the difference of two runs, which is mostly noise of the machine.
    # The solid is a model, not an effect on one: it has no cost on the same model.
    cost = d.clocked.fillna(d.cost).where(idle & (d.effect != collapse.SOLID))
    lacking = needed & (d.matters == 1.0)
    largest = [(name, float(cost.sel(effect=name).max())) for name in d.effect.values]
    return {
        "cost": cost.max(),
        "by_effect": ", ".join(f"{name} {value:+.1%}" for name, value in largest if np.isfinite(value)),
        "idle": idle.sum(),
        "changed": (idle & (d.matters != 0.0)).sum(),
        "lacking": lacking.sum(),
        "unseen": (lacking & (d.reported != 1.0)).sum(),
        "failed": (~(needed | idle)).sum(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("effects_overhead", "cost", "1", "< 0.05, and none changes the result",
            "largest relative cost of an effect that is on and not needed, on the same model, {d.sizes[scene]} scenes "
            "({by_effect}); {changed} of {idle} change the result by more than its tolerance",
            lambda f: f.changed == 0),
        Number("effects_undetected", "unseen", "count", "= 0 of at least one, and no comparison failed",
            "effects that are off, change the result and are not reported as missing, of {lacking}; {failed} "
            "comparisons failed", lambda f: f.failed == 0 and f.lacking > 0),
    ),
}
# fmt: on
