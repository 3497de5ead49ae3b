"""Every result draws its figure, and every command with --plot writes one, without a warning."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import made_up
import stripfold as sf
from stripfold.cli import main
from stripfold.files import store

STRIP = sf.Strip(length=0.5, eta_b=3780.0)
LOW = sf.paths.low(STRIP, height=0.03)
RESULTS: dict[str, Callable[[], Any]] = {
    "a critical point": lambda: STRIP.critical(height=0.09, model="rod"),
    "a touch": lambda: STRIP.critical(height=0.04, model="elastica"),
    "a collapse": lambda: STRIP.collapse(height=0.09, model="rod"),
    "a path followed": lambda: STRIP.assess(LOW, model="rod"),
    "a fall on a path": lambda: STRIP.assess(sf.paths.triangular(STRIP), fall=True, model="rod"),
    "a map": STRIP.map,
    "a plan": lambda: STRIP.plan(layers_may_slide=True),
    "a path": lambda: LOW,
}


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_draws_itself(name: str, tmp_path: Path):
    figure = RESULTS[name]().plot()
    figure.savefig(tmp_path / "figure.png")
    assert any(axes.has_data() for axes in figure.axes)
    assert all(axes.get_xlabel() for axes in figure.axes if axes.axison and axes.get_visible() and axes.lines)


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_a_figure_is_the_same_file_again(suffix: str, tmp_path: Path):
    line = ["path", "triangular", "--length", "0.5", "--eta-b", "3780", "--csv", str(tmp_path / "path.csv"), "--quiet"]
    first, again = (tmp_path / f"{name}.{suffix}" for name in ("first", "again"))
    assert [main([*line, "--plot", str(file)]) for file in (first, again)] == [0, 0]
    assert first.read_bytes() == again.read_bytes()


def test_the_report_of_a_plan_is_one_file(tmp_path: Path):
    page = tmp_path / "plan.html"
    STRIP.plan(layers_may_slide=True).report(page)
    text = page.read_text(encoding="utf-8")
    assert text.count("<svg") + text.count("data:image/") >= 1
    assert 'src="http' not in text


def test_a_stored_collapse_draws_as_the_one_computed(tmp_path: Path):
    from stripfold.draw import collapse_curve

    file = tmp_path / "collapse.nc"
    made_up.collapse().to_netcdf(file)
    assert collapse_curve.draw(store.read(file)).axes
