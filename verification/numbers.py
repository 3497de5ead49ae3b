"""What a study says in numbers: each a value with unit, criterion and sentence, made of the facts about its dataset.

A study's ``NUMBERS`` lists them by the function that finds their facts.  That function takes datasets: a parameter with
the name of a study, or of one of the paper's tables, is that dataset, any other the study's own.  It returns one set of
facts, or a list of them, each of which then has its own numbers.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from inspect import signature
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from verification.common import NO_RESULT

Facts = dict[str, Any]
"""Numbers (also arrays without dimensions) and texts by name."""
Entry = dict[str, Any]
"""A number as stored: value, unit, statement, criterion, holds, chapter, spread, and error where one is known."""
BOUNDS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "=": operator.eq}


class Number(NamedTuple):
    """A number of a study.

    ``key``, ``criterion`` and ``sentence`` are templates of the facts, in which ``d`` is the dataset.  ``value``: name
    of the fact; the unit "count" makes it an integer.  A criterion that begins with a bound, ``< 1e-3``, bounds the
    value; ``also`` judges whatever else it says.  ``error``: fact that is the value's error.  ``digits``: kept.
    ``spread``: relative difference from the release's value that another sample or machine may make; by default 10 %,
    a factor of two for times.  A value that is better by its bound is always within it.
    """

    key: str
    value: str
    unit: str
    criterion: str
    sentence: str
    also: Callable[[SimpleNamespace], bool] = lambda f: True
    error: str = ""
    digits: int = 3
    spread: float | None = None


Numbers = Mapping[Callable[..., Facts | list[Facts]], Sequence[Number]]


def evaluate(numbers: Numbers, data: Mapping[str, xr.Dataset], own: str = "") -> dict[str, Entry]:
    """Evaluate numbers by key; those of which a dataset is missing are left out.

    ``data``: datasets by name; ``own``: the name of the study's own.
    """
    out: dict[str, Entry] = {}
    for facts, listed in numbers.items():
        names = [name if name in data else own for name in signature(facts).parameters]
        if own in names and own not in data:
            continue
        used = [data[name] for name in names]
        without = sum(int((d[NO_RESULT] != "").sum()) for d in used if NO_RESULT in d)
        found: dict[str, Entry] = {}
        for one in _each(facts(*used)):
            one["d"] = used[0]
            found |= {number.key.format(**one): _evaluated(number, one) for number in listed}
        for entry in found.values() if without else ():
            entry["statement"] += f"; {without} cases of the study have no result"
            entry["holds"] = False
        out |= found
    return out


def _each(found: Facts | list[Facts]) -> Iterator[Facts]:
    """With plain numbers for arrays without dimensions."""
    for facts in found if isinstance(found, list) else [found]:
        yield {key: value if isinstance(value, str) else np.asarray(value).item() for key, value in facts.items()}


def _evaluated(number: Number, facts: Facts) -> Entry:
    """What is not finite, or has such an error, as a share of no cases, is stored as None and meets no criterion."""
    criterion, statement = (text.format(**facts) for text in (number.criterion, number.sentence))
    value, error = facts[number.value], facts[number.error] if number.error else 0.0
    bound = _bound(criterion)
    known = bool(np.isfinite(value) and np.isfinite(error))
    rounded = (int(value) if number.unit == "count" else float(f"{value:.{number.digits}g}")) if known else None
    usual = 1.0 if number.unit in ("s", "1/s") else 0.1
    return {
        "value": rounded,
        **({"error": float(f"{error:.1g}")} if number.error and known else {}),
        "unit": number.unit,
        "statement": statement,
        "criterion": criterion,
        "holds": bool(known and (not bound or bound[0](value, bound[1])) and number.also(SimpleNamespace(**facts))),
        "spread": usual if number.spread is None else number.spread,
    }


def _bound(criterion: str) -> tuple[Callable[[float, float], bool], float] | None:
    found = re.match(r"([<>]?=?) (-?[0-9.e-]+)", criterion)
    return (BOUNDS[found[1]], float(found[2])) if found else None


def within(entry: Entry, release: Entry) -> bool:
    """Whether a number is within its spread of the release's, or better where its criterion is a bound."""
    mine, theirs = entry["value"], release["value"]
    if mine is None or theirs is None:
        return mine is theirs
    room = max(entry["spread"] * abs(theirs), 2.0 * release.get("error", 0.0))
    if abs(mine - theirs) <= room or mine == theirs:
        return True
    sense = release["criterion"][:1]
    return bool((sense == "<" and mine < theirs) or (sense == ">" and mine > theirs))


def seed_of(d: xr.Dataset) -> str:
    """How the sample of a study is named."""
    return f"seed {int(d.attrs['seed'])}" if "seed" in d.attrs else "seed not stored"


def share(chosen: np.ndarray) -> float:
    """Share of True; nan of nothing, which meets no criterion."""
    return float(np.mean(chosen)) if np.size(chosen) else float("nan")


def covers(share: float, cases: int, low: float, high: float) -> bool:
    """Whether a share of cases is between two bounds; of fewer than 200, within two binomial standard deviations."""
    room = 0.0 if cases >= 200 else 2.0 * np.sqrt(max(low * (1.0 - low), high * (1.0 - high)) / max(cases, 1))
    return bool(low - room <= share <= high + room)
