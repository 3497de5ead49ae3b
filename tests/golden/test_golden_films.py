"""lambda at the snap in films made as the paper's replication makes them: the values measured once, within one SD."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest
import yaml

import stripfold as sf
from stripfold import elastica
from stripfold.cli import main

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
