"""What Snakemake says of the workflow: its rules, and the report with all figures and their captions."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import plots
from studies.summary import run

ROOT = Path(__file__).parents[1]
OTHERS = {
    "figures/collapse.mp4": "film",
    "figures/low_path.mp4": "low_path_film",
    "figures/explorer.html": "explorer",
    "results/summary.html": "summary",
}
"""What the report shows beside the figures, by the name of its caption."""


def snakemake(*options: str) -> str:
    """What Snakemake prints; nobody says how many cores there are."""
    command = [sys.executable, "-m", "snakemake", *options]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def test_each_rule_says_what_it_does() -> None:
    rules = snakemake("--list-rules").splitlines()
    assert len(rules) > 60
    assert [line for line in rules if not re.fullmatch(r"\w+ \([\w\"].*[^.]\.\)", line)] == []


def test_a_figure_that_is_kept_is_redone_where_the_runs_are_missing(tmp_path: Path) -> None:
    """As in a fresh clone."""
    planned = snakemake("--dry-run", "figures/paths.png", "--config", f"results={tmp_path}")
    assert re.search(r"^critical_figures +1$", planned, re.MULTILINE)
    assert re.search(r"^x_axis +5$", planned, re.MULTILINE)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, str]]:
    """The results in a report of made-up files, by their paths in it."""
    folder = tmp_path_factory.mktemp("report")
    for name in (*OTHERS, *(f"figures/{name}.svg" for name in plots.FIGURES)):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("made up")
    places = [f"{name}={folder / name}" for name in ("figures", "results")]
    snakemake("--report", str(folder / "report.html"), "--config", *places)
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert not re.search(r'<(?:script|link|img)[^>]+(?:src|href)="http', page)  # it needs no network
    found, _ = json.JSONDecoder().raw_decode(page, re.search(r"\bresults = (?={)", page).end())  # type: ignore[union-attr]
    return {str(Path(name).relative_to(folder)): result for name, result in found.items()}


def test_the_report_has_each_figure_with_its_caption(results: dict[str, dict[str, str]]) -> None:
    captions = {f"figures/{name}.svg": caption for name, caption in plots.FIGURES.items()}
    assert set(results) == {*captions, *OTHERS}
    for name, caption in captions.items():
        shown = re.sub(r"</?cite>", "`", re.sub(r"</?p>", "", results[name]["caption"]))
        assert " ".join(shown.split()) == caption
    # The paths of the figures' captions have been found; these are beside them.
    assert all(len(results[name]["caption"]) > len("<p></p>\n") for name in OTHERS)


def test_the_numbers_are_a_page() -> None:
    item = {"value": 2.0, "unit": "mm", "statement": "a | b < c", "criterion": "< 3 mm", "holds": True, "fresh": True}
    page = run.page({"key": item | {"chapter": "The program"}, "first": item | {"chapter": "Statics"}}, "../figures")
    assert page.index("<h2>Statics") < page.index("<td>first") < page.index("../figures/motion.png")
    assert page.index("../figures/motion.png") < page.index("<td>key")
    cells = re.findall(r"<td>(.*?)</td>", page)
    assert cells[5:] == ["key", "2 mm", "a | b &lt; c", "&lt; 3 mm", "yes"]
    assert "| `key` | 2 mm | a \\| b < c | < 3 mm | yes |" in run.markdown({"key": item})
