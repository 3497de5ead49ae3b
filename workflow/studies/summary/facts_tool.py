"""Facts about the command line as a program, from its studies."""

from __future__ import annotations

import xarray as xr

from stripfold.cli import COMMANDS
from studies.summary.facts import Facts


def slurm_run(d: xr.Dataset) -> Facts:
    different = d.file.values[d.same.values == 0]
    return {
        "share": d.same.mean(),
        "files": d.sizes["file"],
        "different": f"; not: {', '.join(different)}" if different.size else "",
    }


def kills(d: xr.Dataset) -> Facts:
    recovered = (d.went_on == 1.0) & (d.differs == "")
    terminated = d.signal == "SIGTERM"
    differs = sorted(set(d.differs.values[~recovered.values]))
    return {
        "kills": d.sizes["kill"],
        "recovered": recovered.sum(),
        "terminated": terminated.sum(),
        "in_jobs": (d.running != "no job").sum(),
        "left": d.left.where(terminated, 0.0).sum(),
        "differs": f"; not: {', '.join(differs)}"[:500] if differs else "",
    }


def commands(d: xr.Dataset) -> Facts:
    same = d.differs == ""
    differing = d.command.values[~same.values]
    return {
        "share": same.mean(),
        "cases": d.sizes["command"],
        "commands": len({line.split()[0] for line in d.command.values}),
        "known": len(COMMANDS),
        "files": d["files"].sum(),
        "different": f"; not: {', '.join(differing)}" if differing.size else "",
    }


def fuzz(d: xr.Dataset) -> Facts:
    counts = {name: d[name].sum() for name in ("answered", "followed", "refused", "failed")}
    by_kind = {kind: sum(int(d[name].sel(kind=kind)) for name in counts) for kind in d.kind.values}
    return {
        **counts,
        "inputs": sum(by_kind.values()),
        "by_kind": ", ".join(f"{kind} {count}" for kind, count in by_kind.items()),
        "failures": f": {d.attrs['failures']}" if d.attrs["failures"] else "",
    }


def wheels(d: xr.Dataset) -> Facts:
    ran, versions = d.failed == "", dict(zip(d.environment.values, d.versions.values, strict=True))
    failed = [f"{c} in {e}" for c in d.command.values for e in d.environment.values[~ran.sel(command=c).values]]
    decisive = {e: [v for v in v.split(", ") if v.startswith(("numpy ", "numba ", "av "))] for e, v in versions.items()}
    return {
        "ran": ran.all("environment").sum(),
        "calls": d.sizes["command"],
        # Where a Python has the same versions twice the lowest were not tried.
        "distinct": all(versions[e] != versions[e.replace("lowest", "newest")] for e in versions if "lowest" in e),
        "where": "; ".join(f"{e}: {', '.join(decisive[e])}" for e in versions),
        "absent": f"; not there: Python {d.attrs['absent']}" if d.attrs["absent"] else "",
        "failed": f"; not: {', '.join(failed)}" if failed else "",
    }
