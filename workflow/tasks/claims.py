"""The paper's claims with their verdicts: a verdict stands only while the numbers that it names meet their criteria."""

from __future__ import annotations

import operator
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from plots import FIGURES
from stripfold.base.errors import InvalidInputError
from stripfold.base.validation import Input, Text, Whole, read_yaml, within
from verification.common import markdown_table
from verification.numbers import Entry

FILE = Path(__file__).parents[1] / "claims.yaml"
OPEN, NOT_TESTABLE = "open", "not testable here"
Verdict = Literal["confirmed", "partly", "contradicted", "not testable here"]

_BOUNDS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
_CONDITION = re.compile(r"(?P<key>[\w.+-]+)(?: (?P<bound>[<>]=?) (?P<limit>\S+))?")
Condition = Annotated[str, Field(pattern=f"^{_CONDITION.pattern.replace('?P<', '?<')}$")]


class Claim(Input):
    """A claim of the paper, and what decides it.

    ``numbers`` are keys of the summary, which must meet their own criterion, or a bound given here, ``key < 0.1``, by
    more than the number's error.
    """

    place: Text
    claim: Text
    test: Text
    numbers: Annotated[list[Condition], Field(default_factory=list)]
    figures: Annotated[list[Text], Field(default_factory=list)]
    verdict: Verdict
    limits: str = ""

    @model_validator(mode="after")
    def _decided(self) -> Self:
        if self.verdict == NOT_TESTABLE and not self.limits:
            raise InvalidInputError("limits", self.limits, "the reason why it cannot be tested")
        if self.verdict != NOT_TESTABLE and not self.numbers:
            raise InvalidInputError("numbers", self.numbers, "at least one that decides the verdict")
        for i, name in enumerate(self.figures):
            if name not in FIGURES:
                raise InvalidInputError(f"figures[{i}]", name, "a figure of `plots.FIGURES`")
        return self


class PaperFigure(Input):
    """A figure of the paper, and those that show the same here."""

    number: Annotated[Whole, Field(ge=1)]
    shows: Text
    figures: Annotated[list[Text], Field(min_length=1)]
    difference: str = ""

    @model_validator(mode="after")
    def _drawn(self) -> Self:
        for i, name in enumerate(self.figures):
            if name not in FIGURES:
                raise InvalidInputError(f"figures[{i}]", name, "a figure of `plots.FIGURES`")
        return self


class Replication(Input):
    """All of them."""

    figures: list[PaperFigure]
    claims: list[Claim]


def read(path: Path = FILE) -> Replication:
    """The table of claims.

    Raises InvalidInputError: a row that is incomplete or names an unknown figure; the key says which.
    """
    with within(path.name):
        return Replication.of(read_yaml(path, "claims", "claims: [{place: ..., claim: ...}]"))


def judged(claim: Claim, summary: Mapping[str, Entry]) -> str:
    """Its verdict; open while a number that decides it is missing or does not meet its criterion."""
    return claim.verdict if all(_holds(condition, summary) for condition in claim.numbers) else OPEN


def _holds(condition: str, summary: Mapping[str, Entry]) -> bool:
    found = _parts(condition)
    item = summary.get(found["key"])
    if item is None or item["value"] is None:
        return False
    if found["bound"] is None:
        return bool(item["holds"])
    error = item.get("error", 0.0)
    worst = item["value"] + (error if found["bound"].startswith("<") else -error)
    return bool(_BOUNDS[found["bound"]](worst, float(found["limit"])))


def _parts(condition: str) -> re.Match[str]:
    found = _CONDITION.fullmatch(condition)
    assert found is not None  # the model has checked it
    return found


def count_open(claims: list[Claim], summary: Mapping[str, Entry]) -> Entry:
    """The number ``claims_open`` of the summary."""
    verdicts = [judged(claim, summary) for claim in claims]
    counts = {name: verdicts.count(name) for name in dict.fromkeys(verdicts)}
    each = ", ".join(f"{count} {name}" for name, count in counts.items())
    lacking = [f'"{c.claim}"' for c, v in zip(claims, verdicts, strict=True) if v == OPEN]
    return {
        "value": len(lacking),
        "unit": "count",
        "statement": f"claims of the paper, of {len(claims)} ({each}), without a verdict, since a number that decides "
        f"them is missing or does not meet its criterion: {'; '.join(lacking) or 'none'}",
        "criterion": "= 0",
        "holds": not lacking,
        "spread": 0.0,
        "chapter": "Folding paths and friction",
    }


def tables(summary: Mapping[str, Entry]) -> dict[str, str]:
    """The tables of the page ``docs/replication.md`` by name: the paper's figures, and the claims."""
    found = read()
    rows = [(f"Fig. {item.number}", item.shows, _linked(item.figures), item.difference) for item in found.figures]
    claims = []
    for c in found.claims:
        numbers = "<br>".join(_quoted(condition, summary) for condition in c.numbers)
        claims.append((c.place, c.claim, c.test, numbers, _linked(c.figures), judged(c, summary), c.limits))
    header = "place", "claim", "test", "numbers", "figures", "verdict", "limits"
    return {
        "figures of the paper": _table(("paper", "shows", "here", "difference"), rows),
        "claims": _table(header, claims),
    }


def counts(summary: Mapping[str, Entry]) -> str:
    """The line of the README: how many claims have which verdict."""
    verdicts = [judged(claim, summary) for claim in read().claims]
    each = (f"{verdicts.count(name)} {name}" for name in (*get_args(Verdict), OPEN) if name in verdicts)
    return f"Of {len(verdicts)} claims: {', '.join(each)}.\n"


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return markdown_table(header, rows).replace("L*", r"L\*")


def _linked(figures: list[str]) -> str:
    return ", ".join(f"[{name}](../figures/{name}.png)" for name in figures)


def _quoted(condition: str, summary: Mapping[str, Entry]) -> str:
    from tasks.numbers import quoted

    found = _parts(condition)
    item = summary.get(found["key"])
    bound = f" ({found['bound']} {found['limit']})" if found["bound"] else ""
    value = "no value" if item is None else quoted(item)
    return f"`{found['key']}` {value}{bound}"
