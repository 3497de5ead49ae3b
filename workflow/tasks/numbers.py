"""The numbers that the text quotes, and the tables in it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import xarray as xr

from evidence import ROOT, why_stale
from stripfold import store
from studies import accuracy, cold_run, effects, peers, profiling
from studies.hard_cases import run as hard_cases
from studies.summary import run


def summary(
    sources: dict[str, str],
    studies: dict[str, dict[str, Any]],
    output: Any,
    progress: Callable[[str], None],
    **data: xr.Dataset,
) -> None:
    """Evaluate all numbers and store them as JSON, each with the commit that made it and whether it is fresh.

    A number is fresh when the code, the configuration and the libraries that made it are today's; a stale one meets no
    criterion.

    Parameters
    ----------
    sources
        The files of ``data``, by the same names.
    studies
        Today's parameters of the studies among them.
    """
    stale = {name: why_stale(dataset, studies.get(name)) for name, dataset in data.items()}
    lines = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in (ROOT / "src").rglob("*.py"))
    project = {
        "stale": ", ".join(name for name in studies if stale[name]),
        "studies": len(studies),
        "package_lines": lines,
        "ci_seconds": data["ci_run"].attrs["wall"] if "ci_run" in data else float("nan"),
        "git_commit": store.running_commit(),
    }
    data, sources = data | {"project": xr.Dataset(attrs=project)}, sources | {"project": "src"}
    stale |= {"project": ""}
    found = run.summarise(data, sources)
    # The one of its numbers that is not counted here.
    if "ci_run" in data:
        found["ci_seconds"] |= {"source": sources["ci_run"], "datasets": ["ci_run"]}
    else:
        del found["ci_seconds"]
    for key, item in found.items():
        used = item.pop("datasets")
        item["fresh"] = not any(stale[name] for name in used)
        item["commit"] = data[used[0]].attrs["git_commit"]
        item["holds"] = item["holds"] and item["fresh"]
        progress(f"{key}: {item['value']:g} {item['unit']}; {item['criterion']}: {run.verdict(item)}")
    store.write_json(found, output[0])


def fill_tables(summary: Path, **data: xr.Dataset) -> None:
    """Bring the tables of the README and of docs in line with what is stored."""
    numbers = json.loads(summary.read_text(encoding="utf-8"))
    pages = {
        "README.md": {"presets": accuracy.presets(data["accuracy"]), "numbers": run.markdown(numbers)},
        "docs/numerics.md": {
            **{
                f"profile of {name}": profiling.table(data["profiling"].sel(subject=name))
                for name in profiling.SUBJECTS
            },
            "cold run": cold_run.table(data["cold_run"]),
        },
        "docs/hard-cases.md": {"hard cases": hard_cases.markdown(data["hard_cases"])},
        "docs/effects.md": {"effects": effects.markdown(data["effects"])},
        "docs/peers.md": {"times": peers.table(data["peers"])} if "peers" in data else {},
    }
    for name, tables in pages.items():
        text = Path(name).read_text(encoding="utf-8")
        for key, content in tables.items():
            text = run.fill_table(text, key, content)
        store.write_text(text, Path(name))
