"""Two runs compared: what counts as the same, and the profile's rules."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import yaml

from stripfold.files import store
from studies import slurm_run
from studies.common import dataset

ROOT = Path(__file__).parents[1]


def stored(path: Path, x: list[float], seconds: float = 1.0) -> None:
    data = dataset("order", {"error": ("node", np.array(x)), "seconds": ((), seconds)})
    store.write(data, path, title="made up")


def compared(folder: Path) -> dict[str, float]:
    data = slurm_run.compare(folder / "here", folder / "there", 10.0, 20.0, 5)
    assert data.attrs == {"wall_here": 10.0, "wall_there": 20.0, "jobs": 5}
    return dict(zip(data["file"].values, data["same"].values, strict=True))


def test_values_count_and_run_times_do_not(tmp_path: Path) -> None:
    for name, x in {"same": [1.0, np.nan], "other": [1.0, 2.0], "shorter": [1.0, 2.0], "logs/x": [1.0]}.items():
        stored(tmp_path / f"here/{name}.nc", x)
    stored(tmp_path / "there/same.nc", [1.0, np.nan], 3.0)
    stored(tmp_path / "there/other.nc", [1.0, 2.0 + 1e-15])
    stored(tmp_path / "there/shorter.nc", [1.0])
    stored(tmp_path / "there/sub/only.nc", [1.0])
    assert compared(tmp_path) == {"same.nc": 1.0, "other.nc": 0.0, "shorter.nc": 0.0, "sub/only.nc": 0.0}


def test_memory_and_times_by_any_name_do_not_count(tmp_path: Path) -> None:
    """The small run's benchmarks store these."""
    names = {"accuracy": "way_memory", "benchmark": "wall", "cli_benchmark": "solving", "order": "cost_order"}
    names |= {"effects": "clocked", "fall_benchmark": "memory"}
    for study, name in names.items():
        for number, side in enumerate(("here", "there")):
            data = dataset(study, {name: ("x", np.array([1.0 + number]))})
            store.write(data, tmp_path / side / f"{study}.nc", title="made up")
    assert set(compared(tmp_path).values()) == {1.0}


def test_the_profile_groups_rules_that_exist() -> None:
    profile = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text(encoding="utf-8"))
    rules = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "workflow/rules").glob("*.smk"))
    for group in profile["groups"]:
        name = group.partition("=")[0]
        assert re.search(rf'^(rule {name}:|    "{name}": )', rules, re.M), name
    # A rule that takes all cores would ask for those of all jobs together.
    greedy = re.findall(r"^rule (\w+):\n(?:(?!rule ).*\n)*?    threads: ALL_CORES$", rules, re.M)
    assert greedy
    assert profile["cores"] >= 1
    assert {name.partition("=")[0] for name in profile["set-threads"]} == set(greedy)
    default = yaml.safe_load((ROOT / "profiles/default/config.yaml").read_text(encoding="utf-8"))
    assert default.items() <= profile.items()
