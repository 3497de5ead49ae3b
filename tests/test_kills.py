"""The study of a chain that is killed: on made-up chains that go on, that do not, and that give something else."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

from stripfold.files import store
from studies import kills
from studies.common import dataset

PRINTED = """Building DAG of jobs...
Job 3: x_axis: Critical points.
    input: a
Job 2: friction eta820: Smallest internal friction.
    output: b
Job 3: x_axis: Critical points.
Finished jobid: 3 (Rule: x_axis)
"""
GOES_ON = "\t@mkdir -p results figures; test -e figures/a.txt || { sleep 0.4; echo a > figures/a.txt; }\n"
STUCK = "\t@mkdir -p results figures; test ! -e begun || { echo it is locked; exit 1; }; touch begun\n\t@sleep 0.4\n"
OTHERWISE = "\t@mkdir -p results figures; test ! -e begun || echo b > results/b.txt; touch begun\n\t@sleep 0.4\n"


def begun_first(start: Callable[..., kills.Start]) -> Callable[..., kills.Start]:
    """Kills that wait until the recipe has begun, whatever else the machine does."""

    def started(command: list[str], folder: Path, moment: float | None = None, *signals: signal.Signals) -> kills.Start:
        if moment is None:
            return start(command, folder)
        (folder / "begun").touch()
        return start(command, folder, 0.0, *signals)

    return started


def made_up(folder: Path, recipe: str) -> Path:
    """A clone with a chain of one recipe."""
    (folder / "workflow/config").mkdir(parents=True)
    (folder / "workflow/config/quick.yaml").write_text("gravity: 9.81\nstudies: {order: {parts: 3}}\n")
    (folder / "Makefile").write_text("env:\n\t@rm -f begun\n\nall:\n" + recipe)
    for made in kills.MADE:
        (folder / made).mkdir()
        (folder / made / "kept.txt").write_text("kept")
    user = ("-c", "user.name=x", "-c", "user.email=x@example.org")
    for git in (["init", "-q"], ["add", "-A"], [*user, "commit", "-qm", "made up"]):
        subprocess.run(["git", *git], cwd=folder, check=True)
    return folder


def test_jobs_under_way() -> None:
    assert kills.under_way(PRINTED) == "friction, x_axis"
    assert kills.under_way("Building DAG of jobs...\n") == "no job"


def test_a_chain_that_goes_on(tmp_path: Path) -> None:
    clone = made_up(tmp_path, GOES_ON)
    data = kills.run(clone, 1, kills=4, seed=2)
    assert data.sizes["kill"] == 4
    assert data["went_on"].values.tolist() == [1.0] * 4
    assert data["differs"].values.tolist() == [""] * 4
    assert set(data["signal"].values) == {"SIGKILL", "SIGTERM"}
    assert (data["moment"].values < 0.4).all()
    assert yaml.safe_load((clone / "workflow/config/paper.yaml").read_text())["studies"] == {"order": None}
    assert data.attrs["files"] == 3


@pytest.mark.parametrize(
    ("recipe", "went_on", "differs"),
    [(STUCK, 0.0, "it is locked"), (OTHERWISE, 1.0, "results/b.txt")],
)
def test_a_chain_that_does_not_recover(
    tmp_path: Path, recipe: str, went_on: float, differs: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kills, "start", begun_first(kills.start))
    clone = made_up(tmp_path, recipe)

    def told(line: str) -> None:
        if " files in " in line:  # the undisturbed run is complete
            (clone / "begun").unlink()

    data = kills.run(clone, 1, told, kills=1, seed=2)
    assert data["went_on"].values.tolist() == [went_on]
    assert differs in str(data["differs"].values[0])


def test_run_times_and_logs_are_no_differences(tmp_path: Path) -> None:
    folders = [tmp_path / "one", tmp_path / "other"]
    for number, folder in enumerate(folders):
        values = {"error": ("node", np.array([1.0, np.nan])), "seconds": ((), float(number))}
        for name in ("results/a.nc", "results/logs/a.nc"):
            store.write(dataset("order", values, {"seconds": float(number)}), folder / name, title="made up")
        (folder / "results/benchmarks").mkdir()
        (folder / "results/benchmarks/a.tsv").write_text(str(number))
        (folder / "figures").mkdir()
        (folder / "figures/a.png").write_bytes(b"same")
    one, other = (kills.contents(folder) for folder in folders)
    assert set(one) == {"results/a.nc", "figures/a.png"}
    assert kills.differences(one, other) == ""
    (folders[1] / "figures/a.png").write_bytes(b"not the same")
    (folders[1] / "results/.stripfold-1").mkdir()
    (folders[1] / "results/.stripfold-1/b.nc").touch()
    found = kills.contents(folders[1])
    assert kills.differences(one, found) == "figures/a.png, results/.stripfold-1/b.nc"
    changed = dataset("order", {"error": ("node", np.array([np.nextafter(1.0, 2.0), np.nan]))})
    store.write(changed, folders[1] / "results/a.nc", title="made up")
    assert "results/a.nc" in kills.differences(one, kills.contents(folders[1]))


def test_half_written_files_are_counted_and_the_last_lines_kept(tmp_path: Path) -> None:
    command = ["bash", "-c", "mkdir -p results/.stripfold-1; echo begun; sleep 60"]
    done = kills.start(command, tmp_path, 0.5, signal.SIGTERM)
    assert (done.code, done.left, done.running, done.said) == (None, 1, "no job", "begun")
    assert done.seconds < 10.0
