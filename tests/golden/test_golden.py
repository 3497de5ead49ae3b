"""Numbers and words that must not move: each by the public API or a command, within its stated error.

The values were stored once, from the paper's runs and the studies of a release; no test computes them anew.  Numbers of
numbers.csv, lambda at the snap in the films of films.csv, the paper's runs as ``make all`` stored them against
results.csv, and what each command prints, in transcripts.txt.
"""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
import yaml

import made_up
import stripfold as sf
from sessions import run_session
from stripfold import elastica
from stripfold.ask.inputs import PlanInputs
from stripfold.ask.outcome import outcome_of
from stripfold.ask.plan import candidates
from stripfold.cli import main

HERE = Path(__file__).parent
GRAVITY = 9.81
PAPER = {"820": (0.6, 1e-3), "3780": (0.6, 1e-3), "12700": (0.6, 1e-3), "30200": (0.6, 1e-3)}
SECANT = 94.929728208
"""eta_b of the paper's textile: the secant stiffness of its moment curve."""


@dataclass(frozen=True)
class Stored:
    """A value, its tolerance, and the group of numbers that one computation gives."""

    group: str
    name: str
    value: float
    tolerance: float


def stored() -> list[Stored]:
    with (HERE / "numbers.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [Stored(row["group"], row["name"], float(row["value"]), float(row["tolerance"])) for row in rows]


def unit_of(eta_b: float) -> float:
    """L*, m."""
    return float((eta_b * GRAVITY) ** (-1.0 / 3.0))


def strip_of(eta_b: float, length: float | None = None, thickness: float = 0.0594, **others: float) -> sf.Strip:
    """The strip of an eta_b; ``length`` and ``thickness`` in L*."""
    unit = unit_of(eta_b)
    eta_m = eta_b * (thickness * unit) ** 2 / 12.0
    return sf.Strip(length=0.6 if length is None else length * unit, eta_b=eta_b, eta_m=eta_m, **others)


def paper(name: str) -> sf.Strip:
    if name == "textile":
        return sf.Strip(length=2.05, eta_b=SECANT, eta_m=2e-4)
    length, eta_m = PAPER[name]
    return sf.Strip(length=length, eta_b=float(name), eta_m=eta_m)


Numbers = Iterator[tuple[str, float]]


def solid() -> Numbers:
    """lambda_c of the paper's strips, m; the heights in L*."""
    heights = {"820": (2.0, 6.9), "3780": (1.6, 3.0, 14.7), "12700": (9.5,), "30200": (32.0,), "textile": (3.0,)}
    for name, some in heights.items():
        strip = paper(name)
        for z in some:
            point = strip.critical(height=z * strip.gravity_length, accuracy=1e-5)
            assert point.snap
            yield f"{name}, z = {z:g}", point.lambda_c
    point = strip.critical(height=3.0 * strip.gravity_length, accuracy=1e-5)
    yield "free length", point.free_length
    yield "lambda_0", point.lambda_0
    strip = paper("3780")
    point = strip.critical(height=1.2 * strip.gravity_length, accuracy=1e-5)
    assert not point.snap
    yield "touch, z = 1.2", point.lambda_touch


def solid_variants() -> Numbers:
    """lambda_c of the solid at z = 3 L*, in L*: Poisson's ratio and small eta_m."""
    for nu in (0.3, 0.45):
        strip = strip_of(3780.0, 20.0, nu=nu)
        yield (
            f"nu = {nu:g}",
            strip.critical(height=3.0 * strip.gravity_length, accuracy=1e-5).lambda_c / unit_of(3780.0),
        )
    for eta_m in (1e-4, 1e-5):
        unit = unit_of(3780.0)
        strip = sf.Strip(length=16.0 * unit, eta_b=3780.0, eta_m=eta_m)
        yield f"eta_m = {eta_m:g}", strip.critical(height=3.0 * unit, accuracy=1e-5).lambda_c / unit


def rod() -> Numbers:
    """lambda_c of the rod, 20 L* long, in L*."""
    for z, thickness in ((1.8, 0.0594), (3.0, 0.1), (3.0, 0.03), (9.0, 0.0594)):
        strip = strip_of(3780.0, 20.0, thickness)
        point = strip.critical(height=z * strip.gravity_length, model="rod", accuracy=1e-5)
        yield f"z = {z:g}, h = {thickness:g}", point.lambda_c / strip.gravity_length


def thin() -> Numbers:
    """The elastica, in L*."""
    for z in (2.0, 3.0, 9.5, 32.0):
        yield f"lambda_c, z = {z:g}", elastica.critical(z).advance
    yield "touch limit", elastica.touch_limit()
    yield "fold height", elastica.folded_loop().height
    for z in (2.0, 5.0):
        yield f"friction delay, z = {z:g}", elastica.friction_delay(z)
    for z in (1.7, 3.0, 7.0):
        found = elastica.bistable_range(z)
        yield f"bistable width, z = {z:g}", found.width
        yield f"largest barrier, z = {z:g}", found.barrier(found.landing.advance)


def paths_followed() -> Numbers:
    """The paper's paths on the solid, in m: critical point, fall, first touch, forces."""
    strip = paper("3780")
    for name, path in (("triangular", sf.paths.triangular(strip)), ("circular", sf.paths.circular(strip))):
        found = strip.assess(path, fall=True)
        (event,) = found.critical
        yield f"{name}, critical x", event["x"]
        yield f"{name}, first touch", found.touch_x
        yield f"{name}, landing", found.landing_x
        yield f"{name}, drop", event["drop"]
        yield f"{name}, energy", event["energy"]
        yield f"{name}, gripper force", found.peak_force


def tangency() -> Numbers:
    """Where the R-path leaves the stable places, in m and degrees."""
    for name in ("820", "3780"):
        strip = paper(name)
        (event,) = strip.assess(sf.paths.r_path(strip)).critical
        assert event["kind"] == "bifurcation"
        yield f"{name}, x", event["x"]
        yield f"{name}, z", event["z"]
        yield f"{name}, angle", event["angle"]


def friction() -> Numbers:
    """First touch on the R-path with the least friction that suffices, m: less than 0.1 L* from the planned place.

    With the strength next below, which does not suffice, it is farther off or the strip is lost.
    """
    strip = paper("820")
    path = sf.paths.r_path(strip)
    moment = 1.404793780e-4
    found = strip.assess(path, friction_moment=moment)
    assert found.stable
    assert abs(found.touch_error) < 0.1 * strip.gravity_length
    yield "touch with M_0", found.touch_x
    lost = strip.assess(path, friction_moment=moment * 0.005250307 / 0.005749086)
    assert not (lost.stable and abs(lost.touch_error) < 0.1 * strip.gravity_length)


def low_path() -> Numbers:
    """Forces on a low path, rho_a g L*, and how far off the fold is, L*."""
    strip = strip_of(3780.0, 12.1106399791, 0.0359728578)
    unit = strip.gravity_length
    found = strip.assess(sf.paths.low(strip, height=0.96933101 * unit), model="rod")
    assert found.stable
    yield "grip", found.peak_force / (GRAVITY * unit)
    yield "hold", found.peak_hold / (GRAVITY * unit)
    yield "push", found.peak_push / (GRAVITY * unit)
    yield "shape error", found.shape_error / unit


def stability_map() -> Numbers:
    """Distance of gripper places to the snap boundary, and the touch limit, in L*."""
    strip = strip_of(3780.0, 20.0)
    unit, found = strip.gravity_length, strip.map()
    yield "touch limit", found.touch_limit / unit
    for advance, z in ((5.04, 2.5), (9.0, 5.0), (12.0, 9.0)):
        yield f"margin at {advance:g}, {z:g}", float(found.margin((advance - 10.0) * unit, z * unit)) / unit


def collapse() -> Numbers:
    """The collapse that the figures show, in s and m."""
    release = {"disturbance": 1e-3, "speed": 0.0, "air": 2.0, "stiffness": 3e-3, "until": "rest"}
    yield from paper("3780").collapse(height=0.15, release=release).to_dict().items()


def plans() -> Numbers:
    """Margins of paths, m: eta_b known to 20 %."""
    strips = {"low": (0.5, 3770.0), "lifted triangle": (0.37381678675981017, 1307.904715756177)}
    for name, (length, eta_b) in strips.items():
        asked = PlanInputs(length=length, eta_b=eta_b)
        path = next(candidate for candidate in candidates(asked) if candidate.name == name)
        yield name, outcome_of(asked, path, asked.strips[::2]).margin


def second_gripper() -> Numbers:
    """Advance gained by a second gripper where the critical mode moves most, and its place, in L*."""
    strip = strip_of(3780.0, 20.0)
    unit = strip.gravity_length
    second = strip.critical(height=3.0 * unit, model="rod", second_gripper="auto").second_gripper
    assert second is not None
    assert not second.snap
    yield "gain", second.gain / unit
    yield "place", second.s / unit


def stiffness() -> Numbers:
    """eta_b, m^-4 s^2, from a fold and from a bending test."""
    yield "fold height", sf.eta_b(fold_height=0.0272).eta_b
    yield "bending test", sf.eta_b(kes_b=0.15, gsm=180).eta_b


GROUPS: dict[str, Callable[[], Numbers]] = {
    function.__name__: function
    for function in (
        solid, solid_variants, rod, thin, paths_followed, tangency, friction, low_path, stability_map, collapse, plans,
        second_gripper, stiffness,
    )
}  # fmt: skip


@pytest.mark.parametrize("group", GROUPS)
def test_numbers(group: str):
    compare(group, dict(GROUPS[group]()))


def compare(group: str, found: dict[str, float]) -> None:
    """Every stored number of the group is found, within its tolerance."""
    expected = {one.name: one for one in stored() if one.group == group}
    assert set(found) == set(expected)
    wrong = [
        f"{name}: {value!r}, stored {expected[name].value!r} +- {expected[name].tolerance:g}"
        for name, value in found.items()
        if not abs(value - expected[name].value) <= expected[name].tolerance
    ]
    assert not wrong, "\n".join(wrong)


FRICTION = {"820": 0.04, "3780": 0.03, "12700": 0.02, "30200": 0.01}
"""M_0 of the strips, rho_a g L*^2."""
LENGTH = 20.0
"""Of the strips, L*."""


def scene(eta_b: str, height: float, speed: float, seed: int) -> dict[str, Any]:
    """The scene of a film; the height in L*, the speed in m/s."""
    unit = (float(eta_b) * 9.81) ** (-1.0 / 3.0)
    field = max(8.0, 1.6 * height * 480 / 360) * unit
    x = (-0.5 * LENGTH + elastica.critical(height).advance - 1.0) * unit
    share = field / 0.32
    return {
        "length": LENGTH * unit,
        "eta_b": float(eta_b),
        "height": height * unit,
        "speed": speed,
        "strip": {"width": 0.02 * share},
        "gripper": {"marker_size": 0.024 * share, "offset": [0.0, -0.032 * share], "finger": 0.003 * share},
        "filming": {
            "size": [480, 360],
            "target": [x, 0.8 * height * unit - 0.5 * unit],
            "field": field,
            "distance": 3.0 * field,
            "log_offset": 0.2,
            "codec": "mjpeg",
            "frame_rate": 20.0,
        },
        "generator": "dynamics",
        "motion": {
            "friction_moment_star": FRICTION[eta_b],
            "before": 0.25 * unit,
            "after": 0.8,
            "eta_m": 1e-3,
            "model": "rod",
            "refinement": 1.0,
        },
        "seed": seed,
    }


def films() -> list[Any]:
    """Rows of films.csv; one of them belongs to the quick tests."""
    with (Path(__file__).parent / "films.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    marks = {True: (), False: (pytest.mark.slow,)}
    return [pytest.param(row, marks=marks[row["quick"] == "1"], id=f"{row['eta_b']}-{row['seed']}") for row in rows]


@pytest.mark.parametrize("row", films())
def test_lambda_at_the_snap(row: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    made = scene(row["eta_b"], float(row["height"]), float(row["speed"]), int(row["seed"]))
    file, folder = tmp_path / "scene.yaml", tmp_path / "film"
    file.write_text(yaml.safe_dump(made), encoding="utf-8")
    assert main(["record", str(file), "--output", str(folder), "--quiet"]) == 0
    capsys.readouterr()
    found = sf.measure(folder).to_dict()
    assert found["snap"]
    assert found["lambda_event"] == pytest.approx(float(row["lambda_event"]), abs=float(row["sd"]))


RESULTS = Path(os.environ.get("STRIPFOLD_RESULTS", HERE.parents[1] / "results"))

with (HERE / "results.csv").open(encoding="utf-8", newline="") as _file:
    ROWS = {name: list(rows) for name, rows in groupby(csv.DictReader(_file), key=lambda row: row["file"])}


def selected(data: xr.Dataset, variable: str, where: str) -> float:
    """The value at the place that ``where`` names: labels of a material, path or law, or an index."""
    found = data[variable]
    for part in where.split():
        axis, label = part.split("=")
        labels = data.get(f"{axis}_label")
        index = int(label) if labels is None else [str(one) for one in labels.values].index(label)
        found = found.isel({axis: index})
    return float(found)


@pytest.mark.slow
@pytest.mark.parametrize("file", ROWS)
def test_results_of_the_paper(file: str):
    path = RESULTS / f"{file}.nc"
    if not path.exists():
        pytest.skip(f"{path} is not there: `make all` makes it")
    with xr.open_dataset(path) as data:
        found = [(row, selected(data, row["variable"], row["where"])) for row in ROWS[file]]
    wrong = [
        f"{row['variable']} {row['where']}: {value!r}, stored {row['value']} +- {row['tolerance']}"
        for row, value in found
        if not abs(value - float(row["value"])) <= float(row["tolerance"])
    ]
    assert not wrong, "\n".join(wrong)


TEXT = (Path(__file__).parent / "transcripts.txt").read_text(encoding="utf-8")
SESSIONS = {name: text for name, text in re.findall(r"^## (\w+)\n(.*?)(?=^## |\Z)", TEXT, re.M | re.S)}


@pytest.mark.parametrize("name", SESSIONS)
def test_transcript(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    for file, text in made_up.INPUTS.items():
        (tmp_path / file).write_text(text)
    run_session(SESSIONS[name], f"transcript {name}", capsys, 1e-3)
