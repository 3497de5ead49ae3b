"""Evaluate the table of numbers, and put tables into the pages that quote them."""

from __future__ import annotations

import operator
import re
from collections.abc import Iterator, Mapping
from html import escape
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

from plots import FIGURES, SECTIONS
from studies.common import NO_RESULT, markdown_table
from studies.summary.facts import Facts
from studies.summary.number import Number, Source
from studies.summary.table import CHAPTERS

Entry = dict[str, Any]

BOUNDS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "=": operator.eq}
OPTIONAL = ("kills", "peers", "project", "slurm_run", "wheels")
"""Datasets that may be missing; without them their numbers are left out."""


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """All numbers by key.

    ``data``: the stored datasets by the names that the table gives them; ``sources``: the files they were read from, by
    the same names.

    Returns for each number ``value``, ``unit``, ``statement``, ``criterion``, ``holds``, ``source`` (the file),
    ``chapter`` and ``datasets`` (the names of all datasets that it is from); ``error`` where one is known.  ``value``
    is None where there is no number.
    """
    out: dict[str, Entry] = {}
    for chapter, (of_chapter, _) in CHAPTERS.items():
        for source in of_chapter:
            names = source.names.split()
            if names[0] in data or names[0] not in OPTIONAL:
                about = {"source": sources[names[0]], "chapter": chapter, "datasets": names}
                found = evaluate(source, *(data[name] for name in names))
                out |= {key: entry | about for key, entry in found.items()}
    return out


def evaluate(source: Source, *data: xr.Dataset) -> dict[str, Entry]:
    """The numbers of one source by key, from its datasets."""
    out: dict[str, Entry] = {}
    without = sum(int((d[NO_RESULT] != "").sum()) for d in data if NO_RESULT in d)
    for facts in _each(source.facts(*data)):
        facts["d"] = data[0]
        out |= {number.key.format(**facts): _evaluate(number, facts) for number in source.numbers}
    for entry in out.values() if without else ():
        entry["statement"] += f"; {without} cases of the study have no result"
        entry["holds"] = False
    return out


def _each(found: Facts | list[Facts]) -> Iterator[Facts]:
    """With plain numbers for arrays without dimensions."""
    for facts in found if isinstance(found, list) else [found]:
        yield {key: value if isinstance(value, str) else np.asarray(value).item() for key, value in facts.items()}


def _evaluate(number: Number, facts: Facts) -> Entry:
    """What is not finite, or has such an error, as a share of no cases, is stored as None and meets no criterion."""
    criterion, statement = (text.format(**facts) for text in (number.criterion, number.statement))
    value, error = facts[number.value], facts[number.error] if number.error else 0.0
    bound = re.match(r"([<>]?=?) (-?[0-9.e-]+)", criterion)
    within = bound is None or BOUNDS[bound[1]](value, float(bound[2]))
    known = bool(np.isfinite(value) and np.isfinite(error))
    rounded = (int(value) if number.unit == "count" else float(f"{value:.{number.digits}g}")) if known else None
    return {
        "value": rounded,
        **({"error": float(f"{error:.1g}")} if number.error and known else {}),
        "unit": number.unit,
        "statement": statement,
        "criterion": criterion,
        "holds": bool(known and within and number.also(SimpleNamespace(**facts))),
    }


def verdict(item: Entry) -> str:
    """Whether a number meets its criterion; a stale one does not count."""
    return "stale" if not item["fresh"] else "yes" if item["holds"] else "no"


def quoted(item: Entry) -> str:
    """A number with its error and unit."""
    if item["value"] is None:
        return "no number"
    error = f" +- {item['error']:g}" if "error" in item else ""
    return f"{item['value']:g}{error}" + ("" if item["unit"] in ("1", "count") else f" {item['unit']}")


COLUMNS = ("key", "value", "what", "criterion", "holds")


def _rows(summary: Mapping[str, Entry]) -> list[tuple[str, ...]]:
    return [(key, quoted(i), i["statement"], i["criterion"], verdict(i)) for key, i in summary.items()]


def markdown(summary: Mapping[str, Entry]) -> str:
    """The summary as a table in Markdown."""
    rows = ([f"`{key}`", *(cell.replace("|", "\\|") for cell in cells)] for key, *cells in _rows(summary))
    return markdown_table(COLUMNS, rows)


def page(summary: Mapping[str, Entry], figures: str) -> str:
    """The summary as a page in HTML, by chapter, each with its figures.

    ``figures``: the folder of the figures, relative to the page.
    """
    blocks = [_HEAD]
    for chapter, (_, sections) in CHAPTERS.items():
        rows = _rows({key: item for key, item in summary.items() if item["chapter"] == chapter})
        lines = ["".join(f"<th>{name}</th>" for name in COLUMNS)]
        lines += ["".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows]
        table = "".join(f"<tr>{line}</tr>\n" for line in lines)
        blocks.append(f"<h2>{chapter}</h2>\n<table>\n{table}</table>\n")
        for name in (name for section in sections for name in SECTIONS[section]):
            caption = escape(f"{name.replace('_', ' ')}: {FIGURES[name]}")
            source = escape(f"{figures}/{name}.png")
            picture = f'<img src="{source}" alt="{name}" loading="lazy">'
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


def markers(name: str) -> tuple[str, str]:
    """The lines of a page between which its table ``name`` stands."""
    return f"<!-- {name}: made by `snakemake readme` -->\n", f"<!-- end of {name} -->\n"


def fill_table(page: str, name: str, table: str) -> str:
    """A page with its table ``name`` replaced."""
    begin, end = markers(name)
    head, rest = page.split(begin)
    return head + begin + table + end + rest.split(end)[1]
