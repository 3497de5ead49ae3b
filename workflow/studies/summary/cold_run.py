"""The number quoted about a whole run from cold."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

from studies.summary.entry import Entry, entry

LONGEST = 300.0
"""Wanted time of a whole run, s."""


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """``time_all`` from ``cold_run``."""
    cold = data["cold_run"]
    wall, cores = float(cold.attrs["wall"]), int(cold.attrs["cores"])
    longest = cold.isel(rule=slice(3))
    most = ", ".join(
        f"{name} {share:.0%}"
        for name, share in zip(longest["rule"].values, (longest["seconds"] / cold["seconds"].sum()).values, strict=True)
    )
    return {
        "time_all": entry(
            wall,
            "s",
            f"`snakemake all` from cold in a fresh clone on {cores} cores, the studies kept in it not redone "
            f"({int(cold['jobs'].sum())} jobs; most time: {most})",
            f"<= {LONGEST:g} s",
            wall <= LONGEST,
            sources["cold_run"],
            3,
        )
    }
