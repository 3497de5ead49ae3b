"""The numbers that the text quotes, and the tables in it."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import xarray as xr

import documented
from evidence import ROOT, why_stale
from plots import gallery_markdown
from stripfold.files import store
from studies import FRESH_CLONE
from studies.summary import claims, run


def summary(
    sources: dict[str, str],
    studies: dict[str, dict[str, Any]],
    figures: str,
    output: Any,
    progress: Callable[[str], None],
    **data: xr.Dataset,
) -> None:
    """Evaluate all numbers and store them, each with the commit that made it and whether it is fresh.

    A number is fresh when the code, the configuration and the libraries that made it are today's; a stale one meets no
    criterion.

    ``sources``: the files of ``data``, by the same names; ``studies``: today's parameters of the studies among them;
    ``figures``: the folder of the figures; ``output``: ``data`` is the name of the JSON file, ``page`` that of the same
    for readers.
    """
    stale = {name: why_stale(dataset, studies.get(name)) for name, dataset in data.items()}
    lines = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in (ROOT / "src").rglob("*.py"))
    project = {
        "stale": ", ".join(name for name in studies if stale[name]),
        "studies": len(studies),
        "package_lines": lines,
        "docs_examples": sum(len(documented.examples(page)) for page in documented.pages()),
        "studies_seconds": sum(float(data[name].attrs.get("seconds", 0.0)) for name in studies),
        "untimed": sum("seconds" not in data[name].attrs for name in studies if name not in FRESH_CLONE),
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
    for item in found.values():
        used = item.pop("datasets")
        item["fresh"] = not any(stale[name] for name in used)
        item["commit"] = data[used[0]].attrs["git_commit"]
        item["holds"] = item["holds"] and item["fresh"]
    counted = claims.entries(claims.read().claims, found)
    about = {"commit": project["git_commit"], "chapter": "The program"}
    found |= {key: item | about for key, item in counted.items()}
    for key, item in found.items():
        progress(f"{key}: {run.quoted(item)}; {item['criterion']}: {run.verdict(item)}")
    store.write_json(found, output.data)
    store.write_text(run.page(found, os.path.relpath(figures, Path(output.page).parent)), output.page)


HEADLINES = ("claims_open", "branch_jumps", "estimate_coverage", "time_solid_1e-3", "lambda_coverage")
"""Numbers that the README quotes."""


def pages(numbers: Mapping[str, run.Entry], data: Mapping[str, xr.Dataset]) -> dict[str, dict[str, str]]:
    """The generated tables of each page by name; ``data`` are the studies that have one."""
    from studies import accuracy, cold_run, constants, effects, low_paths, peers, physics_tables, profiling
    from studies.hard_cases import run as hard_cases

    profiles = {
        f"profile of {name}": profiling.table(data["profiling"].sel(subject=name)) for name in profiling.SUBJECTS
    }
    headlines = {key: numbers[key] for key in HEADLINES if key in numbers}
    return {
        "README.md": {"claims": claims.headlines(numbers), "headline numbers": run.markdown(headlines)},
        "docs/replication.md": claims.tables(numbers),
        "docs/verification.md": {"numbers": run.markdown(numbers)},
        "docs/performance.md": {
            "presets": accuracy.presets(data["accuracy"]),
            **profiles,
            "cold run": cold_run.table(data["cold_run"]),
        },
        "docs/hard-cases.md": {"hard cases": hard_cases.markdown(data["hard_cases"])},
        "docs/constants.md": (
            {"constants": constants.markdown(data["solver_constants"])} if "solver_constants" in data else {}
        ),
        "docs/effects.md": {"effects": effects.markdown(data["effects"])},
        "docs/low-path.md": {"low paths": low_paths.markdown(data["low_paths"])} if "low_paths" in data else {},
        "docs/physics.md": {
            name: table(data[study]) for name, (study, table) in physics_tables.TABLES.items() if study in data
        },
        "docs/peers.md": {"times": peers.table(data["peers"])} if "peers" in data else {},
    }


def fill_tables(summary: Path, **data: xr.Dataset) -> None:
    """Bring the generated tables and pages of the documentation in line with what is stored."""
    numbers = json.loads(summary.read_text(encoding="utf-8"))
    for name, tables in pages(numbers, data).items():
        text = Path(name).read_text(encoding="utf-8")
        for key, content in tables.items():
            text = run.fill_table(text, key, content)
        store.write_text(text, Path(name))
    store.write_text(gallery_markdown(), Path("docs/figures.md"))
    store.write_text(examples_markdown(), Path("docs/examples.md"))


def examples_markdown() -> str:
    """The page ``docs/examples.md``: the programs of ``examples``, in the order of their own page."""
    blocks = [
        "# Examples\n\n<!-- Made by `snakemake readme` from `examples/`. -->\n\n"
        "Each program runs alone and in seconds, in any folder; those that need an extra say so.\n\n"
        "Notebooks, shown with what they print and draw:"
    ]
    listed = (ROOT / "examples/README.md").read_text(encoding="utf-8")
    shown = re.findall(r"^\| \[(\w+)\.ipynb\]\(\1\.ipynb\) \| (.+) \|$", listed, re.M)
    blocks.append("\n".join(f"* [{name}](../examples/{name}.ipynb): {use}" for name, use in shown))
    for name, question in re.findall(r"^\| \[(\w+\.py)\]\(\1\) \| (.+) \|$", listed, re.M):
        code = (ROOT / "examples" / name).read_text(encoding="utf-8")
        blocks.append(f"## {question}\n\n[{name}](../examples/{name})\n\n```python\n{code}```")
    return "\n\n".join(blocks) + "\n"
