"""A claim's verdict stands only while the numbers that decide it hold."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from stripfold.base.errors import InvalidInputError
from studies.summary import claims

ROW = {"place": "IV", "claim": "It falls.", "test": "falls", "numbers": ["jump"], "verdict": "confirmed"}


def entry(value: float | None, **more: Any) -> dict[str, Any]:
    return {"value": value, "unit": "L*", "holds": True, "fresh": True} | more


def claim(**more: Any) -> claims.Claim:
    return claims.Claim.of(ROW | more)


@pytest.mark.parametrize(
    ("numbers", "summary", "verdict"),
    [
        (["jump"], {"jump": entry(1.0)}, "confirmed"),
        (["jump"], {}, "open"),
        (["jump"], {"jump": entry(1.0, fresh=False)}, "open"),
        (["jump"], {"jump": entry(1.0, holds=False)}, "open"),
        (["jump", "drop"], {"jump": entry(1.0)}, "open"),
        (["jump", "drop"], {"jump": entry(1.0), "drop": entry(2.0)}, "confirmed"),
        # A bound of the row's own replaces the number's criterion, not its being fresh.
        (["jump > 0.5"], {"jump": entry(1.0, holds=False)}, "confirmed"),
        (["jump > 0.5"], {"jump": entry(1.0, fresh=False)}, "open"),
        (["jump > 1.0"], {"jump": entry(1.0)}, "open"),
        (["jump >= 1.0"], {"jump": entry(1.0)}, "confirmed"),
        # A sign within the error is undecided.
        (["jump < 0"], {"jump": entry(-0.1, error=0.05)}, "confirmed"),
        (["jump < 0"], {"jump": entry(-0.1, error=0.2)}, "open"),
        (["jump > 0"], {"jump": entry(0.1, error=0.2)}, "open"),
        (["jump > 0"], {"jump": entry(None)}, "open"),
    ],
)
def test_verdict_needs_its_numbers(numbers: list[str], summary: dict[str, Any], verdict: str) -> None:
    assert claims.judged(claim(numbers=numbers), summary) == verdict


@pytest.mark.parametrize(
    ("more", "key"),
    [
        ({"verdict": "true"}, "verdict"),
        ({"numbers": []}, "numbers"),
        ({"numbers": ["jump about 1"]}, "numbers[0]"),
        ({"verdict": "not testable here"}, "limits"),
        ({"figures": ["no_such_figure"]}, "figures[0]"),
        ({"verdicts": "open"}, "verdicts"),
    ],
)
def test_a_row_that_cannot_be_judged_is_refused(tmp_path: Path, more: dict[str, Any], key: str) -> None:
    path = tmp_path / "claims.yaml"
    path.write_text(json.dumps({"figures": [], "claims": [ROW, ROW | more]}), encoding="utf-8")
    with pytest.raises(InvalidInputError) as error:
        claims.read(path)
    assert error.value.key == f"claims.yaml.claims[1].{key}"


def test_counts() -> None:
    rows = [claim(), claim(claim="It rests.", numbers=["rest"]), claim(verdict="not testable here", limits="no data")]
    found = claims.entries(rows, {"jump": entry(1.0)})
    assert (found["claims"]["value"], found["claims_open"]["value"]) == (3, 1)
    assert not found["claims"]["holds"]
    assert not found["claims_open"]["holds"]
    assert '"It rests."' in found["claims_open"]["statement"]
    assert claims.entries(rows, {"jump": entry(1.0), "rest": entry(1.0)})["claims_open"]["holds"]


def test_the_papers_figures_and_the_readmes_rows() -> None:
    found = claims.read()
    assert [item.number for item in found.figures] == list(range(1, 12))
    assert len(found.claims) >= claims.LEAST
    assert len({c.claim for c in found.claims}) == len(found.claims)
    assert sum(c.headline for c in found.claims) == 10
    assert len((claims.FILE.parents[1] / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


def test_tables() -> None:
    summary = {"first_touch_triangular": entry(-0.22, error=0.001)}
    (row,) = [line for line in claims.headlines(summary).splitlines() if "triangular" in line]
    assert row.endswith(r"| `first_touch_triangular` -0.22 +- 0.001 L\* | partly |")
    tables = claims.tables(summary)
    assert "[folding](../figures/folding.png)" in tables["figures of the paper"]
    widths = {line.count(" | ") for line in tables["claims"].splitlines() if line.startswith("| ")}
    assert widths == {6}
