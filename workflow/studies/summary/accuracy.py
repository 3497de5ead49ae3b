"""The numbers quoted about accuracy against time, and the README's table of presets."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from studies.summary.entry import Entry, entry

HEIGHT = 3.0
"""Gripper height at which a time is quoted, L*."""


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """Entries of ``accuracy`` and ``estimates``, read from the files ``sources``."""
    times, source = data["accuracy"], sources["accuracy"]
    solid = times.sel(asked="solid", accuracy=1e-3)
    here = solid.sel(height=HEIGHT)
    seconds, estimate = float(here["preset_seconds"]), float(here["preset_estimate"])
    off = float(np.abs(solid["preset_error"]).max())
    slowest = float(solid["preset_seconds"].max())
    elastica = times.sel(height=HEIGHT)
    of_elastica, apart = float(elastica["elastica_seconds"]), float(np.abs(times["elastica_error"]).max())
    slow_elastica = float(times["elastica_seconds"].max())
    cases, of_cases = data["estimates"], sources["estimates"]
    error, told = cases["error"].values, cases["estimate"].values
    judged = np.isfinite(error) & np.isfinite(told)
    within = judged & (error <= told)
    share = float(within.sum() / len(error))
    by_model = ", ".join(
        f"{name} {float(within[cases['asked'].values == name].mean()):.2f}" for name in np.unique(cases["asked"].values)
    )
    return {
        "time_solid_1e-3": entry(
            seconds,
            "s",
            f"median time of one solid lambda_c with its error estimate ({estimate:.0e} relative) at z = {HEIGHT:g} "
            f"L*, one core, warmed process; at all heights at most {slowest:.2g} s, true errors below {off:.0e}",
            "<= 1 s at 1e-3",
            seconds <= 1.0 and estimate <= 1e-3 and off <= 1e-3,
            source,
            3,
        ),
        "time_elastica": entry(
            of_elastica,
            "s",
            f"median time of the elastica's critical point at z = {HEIGHT:g} L*, one core, warmed process; at most "
            f"{slow_elastica:.2g} s at all heights of the study, within {apart:.0e} of a finer grid's",
            "<= 0.02 s at 1e-9",
            of_elastica <= 0.02 and apart <= 1e-9,
            source,
            3,
        ),
        "estimate_coverage": entry(
            share,
            "1",
            f"share of {len(error)} random scenes whose true error of lambda_c is within its estimate (asked for: "
            f"{by_model}); {int(np.sum(~judged))} without a number count as not",
            ">= 0.95, 300 scenes or more",
            share >= 0.95 and len(error) >= 300,
            of_cases,
            3,
        ),
    }


def presets(times: xr.Dataset) -> str:
    """One row per accuracy and model asked for, as a table in Markdown: what was chosen, its time and its error.

    Times and errors are the largest over the heights with a snap.
    """
    rows = ["| `--accuracy` | `--model` | chosen | time | estimated error | true error |", "|---|---|---|---|---|---|"]
    snaps = times.sel(height=times["snaps"] > 0)
    for accuracy in times["accuracy"].values:
        for asked in times["asked"].values:
            one = snaps.sel(accuracy=accuracy, asked=asked)
            chosen = ", ".join(dict.fromkeys(str(name) for name in one["preset_model"].values))
            told, error = (float(np.abs(one[name]).max()) for name in ("preset_estimate", "preset_error"))
            seconds = float(one["preset_seconds"].max())
            rows.append(f"| {accuracy:.0e} | `{asked}` | {chosen} | {seconds:.2g} s | {told:.0e} | {error:.0e} |")
    return "\n".join(rows) + "\n"
