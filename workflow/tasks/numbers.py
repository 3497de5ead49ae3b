"""The numbers of the paper's runs and of the studies, beside those of the release, and the tables of the pages."""

from __future__ import annotations

import json
import os
import platform
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from datetime import date
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Any

import xarray as xr

from plots import FIGURES, SECTIONS, gallery_markdown
from stripfold.base.version import running_commit
from stripfold.files import store
from tasks import claims
from verification import CHAPTERS
from verification.common import markdown_table
from verification.numbers import Entry, evaluate, within

Summary = Mapping[str, Entry]

HOW_SURE = {
    "error": "the true error of lambda_c is within the stated one in a share of {estimate_coverage} of random scenes "
    "over all accepted inputs; {solid_limit_error} between solid and elastica for a thin strip",
    "speed": "{time_rod_1e-3} (rod), {time_solid_1e-3} (solid) for one lambda_c with its error, {time_assess} for a "
    "path with its fall, on one core",
    "no real film": "no recording of a real robot was there to compare with: in *synthetic* ones the true lambda is in "
    "a share of {lambda_coverage} of the 95 % intervals",
}
"""What the README says on how sure the numbers are."""
COLUMNS = ("key", "value", "what", "criterion", "holds")
SHOWN_IN = {
    "Statics": ("Motion along x", "Critical points"),
    "Folding paths and friction": ("Folding paths", "Folding paths of all materials"),
    "Recordings": ("Recordings",),
    "Accuracy and speed": ("Accuracy and performance",),
}
"""Sections of the gallery whose figures belong to a chapter."""


def summary(
    figures: str, release: str, output: Any, progress: Callable[[str], None], claims: Path, **data: xr.Dataset
) -> None:
    """Evaluate all numbers, store them, and show them beside those of the release.

    ``figures``: folder of the figures; ``release``: the file of the release's numbers; ``claims``: that of the claims;
    ``output``: ``data`` is the name of the JSON file, ``page`` that of the same for readers.
    """
    found = evaluated(data)
    found |= judged(found, claims)
    store.write_json(found, output.data)
    store.write_text(page(found, os.path.relpath(figures, Path(output.page).parent)), output.page)
    if Path(release).is_file():
        lines = beside(found, json.loads(Path(release).read_text(encoding="utf-8")))
        for line in lines:
            progress(line)
        print("\n".join(lines), flush=True)


def evaluated(data: Mapping[str, xr.Dataset]) -> dict[str, Entry]:
    """All numbers by key, chapter by chapter; ``data``: the stored datasets by name."""
    out: dict[str, Entry] = {}
    for chapter, names in CHAPTERS.items():
        for name in names.split():
            numbers = getattr(import_module(f"verification.{name}"), "NUMBERS", {})
            out |= {key: entry | {"chapter": chapter} for key, entry in evaluate(numbers, data, name).items()}
    return out


def judged(numbers: Summary, file: Path) -> dict[str, Entry]:
    """The number of the paper's claims that are open."""
    return {"claims_open": claims.count_open(claims.read(file).claims, numbers)}


def beside(mine: Summary, release: Summary) -> list[str]:
    """The lines of a table: number, release, yours, whether within the stated spread."""
    rows = [("number", "release", "yours", "within the spread")]
    for key, item in mine.items():
        if key in release:
            rows.append((key, quoted(release[key]), quoted(item), "yes" if within(item, release[key]) else "NO"))
        else:
            rows.append((key, "", quoted(item), "not in the release"))
    widths = [max(len(row[i]) for row in rows) for i in range(4)]
    out = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    known = [key for key in mine if key in release]
    agree = sum(within(mine[key], release[key]) for key in known)
    missing = len(set(release) - set(mine))
    return [
        *out,
        f"{agree} of {len(known)} numbers are within the spread of the release's; {missing} were not computed",
    ]


def release(numbers: Path, scale: str, release: str, **data: xr.Dataset) -> None:
    """Store the numbers as those of the release, and fill the tables of README and docs; ``data``: studies with one."""
    found = json.loads(numbers.read_text(encoding="utf-8"))
    if scale == "release":
        store.write_json(found, release)
    for name, tables in pages(found, data).items():
        text = Path(name).read_text(encoding="utf-8")
        for key, content in tables.items():
            text = fill_table(text, key, content)
        store.write_text(text, Path(name))
    store.write_text(gallery_markdown(), Path("docs/figures.md"))


def pages(numbers: Summary, data: Mapping[str, xr.Dataset]) -> dict[str, dict[str, str]]:
    """The generated tables of each page by name; ``data`` are the studies that have one."""
    from verification import accuracy, effects, hard_cases, low_paths, peers, physics_tables

    return {
        "README.md": {"verdicts": claims.counts(numbers), "how sure": how_sure(numbers)},
        "docs/replication.md": claims.tables(numbers),
        "docs/verification.md": {"numbers": f"{about()}\n\n{markdown(numbers)}"},
        "docs/performance.md": {"presets": accuracy.presets(data["accuracy"])},
        "docs/hard-cases.md": {"hard cases": hard_cases.markdown(data["hard_cases"])},
        "docs/effects.md": {"effects": effects.markdown(data["effects"])},
        "docs/low-path.md": {"low paths": low_paths.markdown(data["low_paths"])},
        "docs/physics.md": {name: table(data[study]) for name, (study, table) in physics_tables.TABLES.items()},
        "docs/peers.md": {"times": peers.table(data["peers"])} if "peers" in data else {},
    }


def how_sure(numbers: Summary) -> str:
    """The table of the README: errors, times, what no real film has confirmed, and which criteria are missed."""
    values = defaultdict(lambda: "(not computed)", {key: quoted(item) for key, item in numbers.items()})
    missed = [f"`{key}` {quoted(item)} ({item['criterion']})" for key, item in numbers.items() if not item["holds"]]
    rows = [(key, text.format_map(values)) for key, text in HOW_SURE.items()]
    return markdown_table(("", "how sure"), [*rows, ("does not hold", "; ".join(missed) or "every criterion is met")])


def about() -> str:
    """What the numbers of a release were made with."""
    model = re.search(r"^model name\s*: (.+)$", Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.M)
    machine = f"{os.cpu_count()} cores, {model[1] if model else platform.machine()}, Python {platform.python_version()}"
    return f"Commit {running_commit()}, {date.today():%d %B %Y}, {machine}. Sample sizes are in the statements."


def verdict(item: Entry) -> str:
    """Whether a number meets its criterion."""
    return "yes" if item["holds"] else "no"


def quoted(item: Entry) -> str:
    """A number with its error and unit."""
    if item["value"] is None:
        return "no number"
    error = f" +- {item['error']:g}" if "error" in item else ""
    return f"{item['value']:g}{error}" + ("" if item["unit"] in ("1", "count") else f" {item['unit']}")


def _rows(summary: Summary) -> Iterable[tuple[str, ...]]:
    return ((key, quoted(i), i["statement"], i["criterion"], verdict(i)) for key, i in summary.items())


def markdown(summary: Summary) -> str:
    """The numbers as a table in Markdown."""
    rows = ([f"`{key}`", *(cell.replace("|", "\\|") for cell in cells)] for key, *cells in _rows(summary))
    return markdown_table(COLUMNS, rows)


def page(summary: Summary, figures: str) -> str:
    """The numbers as a page in HTML, by chapter, each with its figures; ``figures``: their folder from the page."""
    blocks = [_HEAD]
    for chapter, sections in SHOWN_IN.items():
        rows = _rows({key: item for key, item in summary.items() if item["chapter"] == chapter})
        lines = ["".join(f"<th>{name}</th>" for name in COLUMNS)]
        lines += ["".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows]
        table = "".join(f"<tr>{line}</tr>\n" for line in lines)
        blocks.append(f"<h2>{chapter}</h2>\n<table>\n{table}</table>\n")
        for name in (name for section in sections for name in SECTIONS[section]):
            caption = escape(f"{name.replace('_', ' ')}: {FIGURES[name]}")
            picture = f'<img src="{escape(f"{figures}/{name}.png")}" alt="{name}" loading="lazy">'
            blocks.append(f"<figure>{picture}<figcaption>{caption}</figcaption></figure>\n")
    return "".join(blocks)


_HEAD = """<!doctype html>
<meta charset="utf-8">
<title>Numbers</title>
<style>
body {font-family: sans-serif; max-width: 75em; margin: 1em auto}
td, th {padding: 0.3em; text-align: left; vertical-align: top}
figure {display: inline-block; width: 22em; margin: 0.5em; vertical-align: top}
img {max-width: 100%}
</style>
"""


def fill_table(page: str, name: str, table: str) -> str:
    """A page with its table ``name``, between two comments, replaced."""
    begin, end = f"<!-- {name}: made by `make release` -->\n", f"<!-- end of {name} -->\n"
    head, rest = page.split(begin)
    return head + begin + table + end + rest.split(end)[1]
