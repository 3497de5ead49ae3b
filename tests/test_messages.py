"""How far a command is, in per cent: what takes long says it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import stripfold as sf
from stripfold.base.percent import Percent


def percents(said: list[str], what: str) -> list[int]:
    return [int(found[1]) for line in said if (found := re.fullmatch(rf"{what}: (\d+) %", line))]


def test_each_per_cent_is_said_once():
    said: list[str] = []
    assert list(Percent(said.append, "drawn").each(range(1000), 1000)) == list(range(1000))
    assert percents(said, "drawn") == list(range(100))


def test_it_never_goes_back():
    said: list[str] = []
    told = Percent(said.append, "followed")
    for share in (0.0, 0.29, 0.1, 0.58, 1.0):
        told(share)
    assert percents(said, "followed") == [0, 29, 58, 100]


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({}, "following the path"),
        ({"friction_moment": 1e-3, "step": 0.02}, "following the path with friction"),
        ({"layer_friction": 0.3}, "following the path in time"),
    ],
    ids=["statics", "friction", "in time"],
)
def test_an_assessment_says_how_far_it_is(options: dict[str, object], what: str):
    strip, said = sf.Strip(length=0.3, eta_b=3780), list[str]()
    strip.assess(sf.paths.low(strip, 0.036), model="rod", progress=said.append, **options)
    found = percents(said, what)
    assert len(found) > 5
    assert found[0] <= 10
    assert found[-1] == 100


def test_so_do_a_map_and_a_sweep(tmp_path: Path):
    said: list[str] = []
    sf.Strip(length=0.3, eta_b=3780).map(progress=said.append)
    assert percents(said, "eigenvalues")[0] == 0
    from stripfold.ask import sweep

    said.clear()
    sweep.run(
        {"length": 0.6, "model": "elastica", "eta_b": [3000, 4000], "height": 0.09}, tmp_path / "s.nc", 1, said.append
    )
    assert percents(said, "solved")[-1] == 100
