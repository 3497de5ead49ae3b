"""Whether a film notices that a number given beside it is wrong, and whether it lets those pass that are right.

A gripper's place, a height, a length, a speed and an eta_b are given with errors: of each as large as its standard
deviation says, which nothing may complain of, then one of them by several standard deviations more.  These are those of
the given number and of what the film says of it together, as the result states them; where it states none, by
:data:`SD` and :data:`SEEN`.  All films lack a robot's log; every second one is of the second generator.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from itertools import count, islice
from math import exp, hypot, log
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold.film import measure, recording
from stripfold.film.calibration import calibrate_folder
from stripfold.film.eta_motion import MotionEtaB
from stripfold.film.measure import RecordingMeasurement
from stripfold.film.recording import HAND, SD_95, Entries, Recording
from stripfold.film.tracking import Tracks, track
from verification.common import Progress, attempted, pooled, table
from verification.films import Film, film
from verification.numbers import Facts, Number, seed_of, share

BY_HAND = SD_95 * HAND
SD = {"flat_end": BY_HAND, "offset": BY_HAND, "height": BY_HAND, "length": BY_HAND, "speed": 0.03, "eta_b": 0.1}
"""Standard deviation of each given number: m, or as a share of it."""
SEEN = 0.02
"""Standard deviation of the length that is seen, as a share: bends hide some of it, and what holds it looks alike."""
NAMED = {
    "flat_end": "flat_end = ",
    "offset": "offset = ",
    "height": "gripper.height = ",
    "length": "of the strip are seen",
    "speed": "described are",
    "eta_b": "by the strip's motion eta_b is",
}
"""What a message says that complains of it."""
TRIED = 3.0, 5.0
"""By how many standard deviations a number is wrong."""
NONE_WRONG = "none"
"""In place of the number that is wrong."""


def run(cases: int = 2, seed: int = 61, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Give wrong numbers beside so many films; a dataset over ``case``: one number, wrong by so much, of one film."""
    rows = pooled(partial(given_wrongly, seed=seed), list(islice(_films(seed), cases)), threads, progress)
    return table("case", [row for some in rows for row in some], {"seed": seed})


def _films(seed: int) -> Iterator[tuple[int, Film]]:
    """Those whose strip moves by mechanics behind a slow gripper, with their numbers."""
    films = ((number, film(number, seed, 1.0, number % 2 == 1)) for number in count())
    return ((number, asked) for number, asked in films if np.isfinite(asked.moment))


def given_wrongly(case: tuple[int, Film], seed: int) -> list[dict[str, Any]]:
    """One film with right numbers, then with wrong ones."""
    number, asked = case
    random = np.random.default_rng([seed, number])
    row: dict[str, Any] = {"film": number, "generator": asked.generator, "given": NONE_WRONG, "deviations": 0.0}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "recording"
        _, message = attempted(lambda: asked.write(path, Path(folder)))
        if message:
            return []
        told = _told(recording.read(path))
        calibration = calibrate_folder(told.folder, told.entries)

        def measured(of: Recording, tracks: Tracks | None = None) -> RecordingMeasurement:
            return measure.evaluate(of, calibration, tracks or track(of, calibration))

        right = {name: float(random.normal(0.0, sd)) for name, sd in SD.items()}
        said = _said(partial(measured, _with(told, right)))
        rows = [row | {"noticed": "; ".join(_complained(said)), "said": said}]
        exact, _ = attempted(lambda: measured(told))
        if exact is None or not isinstance(exact.eta_b, MotionEtaB) or len(exact.eta_b.pulls) < 2:
            return rows
        known = {pull.name: pull.sd for pull in exact.eta_b.pulls}
        known["length"] = hypot(BY_HAND, SEEN * told.entries.strip.length)
        known["height"] = hypot(BY_HAND, BY_HAND)
        known["eta_b"] = hypot(SD["eta_b"], SD_95 * log(exact.eta_b.high / exact.eta_b.low) / 2.0)
        for name in SD:
            for deviations in TRIED:
                off = deviations * float(random.choice([-1.0, 1.0])) * known.get(name, SD[name])
                wrong = _with(told, {name: off})
                # What is tracked depends on these two only.
                tracks = None if name in ("offset", "length") else exact.tracks
                said = _said(partial(measured, wrong, tracks))
                row |= {"given": name, "deviations": deviations}
                rows.append(row | {"noticed": "; ".join(_complained(said)), "said": said})
    return rows


def _said(measured: Callable[[], RecordingMeasurement]) -> str:
    """The flags of a measurement, or its error."""
    found, message = attempted(measured)
    return message if found is None else "; ".join(flag.text for flag in found.flags)


def _told(of: Recording) -> Recording:
    """Without a log, and with the numbers as uncertain as :data:`SD` says."""
    entries = of.entries.model_dump(mode="json", exclude_unset=True)
    gripper, strip = entries["gripper"], entries["strip"]
    del entries["robot_log"]
    for uncertain, key in ((gripper, "flat_end"), (gripper["marker"], "offset"), (gripper, "height")):
        uncertain.pop(f"{key}_uncertainty", None)
    spread = exp(SD["eta_b"] / SD_95)
    strip["eta_b_interval"] = [strip["eta_b"] / spread, strip["eta_b"] * spread]
    return Recording(of.folder, Entries.of(entries))


def _with(of: Recording, errors: dict[str, float]) -> Recording:
    """With these errors of the given numbers, m or as a share."""
    entries = of.entries.model_dump(mode="json", exclude_unset=True)
    gripper, strip = entries["gripper"], entries["strip"]
    for name in {"flat_end", "height"} & {*errors}:
        gripper[name] += errors[name]
    strip["length"] += errors.get("length", 0.0)
    gripper["marker"]["offset"][0] += errors.get("offset", 0.0)
    gripper["speed"] *= exp(errors.get("speed", 0.0))
    ratio = exp(errors.get("eta_b", 0.0))
    strip |= {"eta_b": ratio * strip["eta_b"], "eta_b_interval": [ratio * end for end in strip["eta_b_interval"]]}
    return Recording(of.folder, Entries.of(entries))


def _complained(said: str) -> list[str]:
    """The given numbers that a message or a flag complains of."""
    return [name for name, words in NAMED.items() if words in said]


def facts(d: xr.Dataset) -> Facts:
    """Shares of the wrong numbers that are noticed, of all kinds together and of each."""
    given, deviations = d.given.values, d.deviations.values
    noticed = np.array([name in some.split("; ") for name, some in zip(given, d.noticed.values, strict=True)])
    right = given == NONE_WRONG
    found: Facts = {"seed": seed_of(d), "films": right.sum(), "judged": len(np.unique(d.film.values[~right]))}
    found["alarms"] = share(d.noticed.values[right] != "")
    for number in TRIED:
        of = deviations == number
        each = (f"{name} {share(noticed[of & (given == name)]):.2f}" for name in SD)
        found |= {f"noticed_{number:.0f}": share(noticed[of]), f"each_{number:.0f}": ", ".join(each)}
    return found


# fmt: off
NUMBERS = {
    facts: (
        Number("given_noticed", "noticed_3", "1", ">= 0.95",
            "share noticed of numbers given beside {judged} films without a log ({seed}), each wrong by 3 standard "
            "deviations of what is given and what the film says of it together: {each_3}; the limit is 3 such "
            "deviations, so that half of them are to be expected, and with one that notices 95 % of them every sixth "
            "right number would be refused; by 5 deviations {noticed_5:.3f}: {each_5}"),
        Number("given_false_alarms", "alarms", "1", "<= 0.02",
            "share of {films} films ({seed}) in which one of six numbers is complained of that are all as far off as "
            "their standard deviations say"),
    ),
}
# fmt: on
