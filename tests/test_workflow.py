"""The workflow as its user meets it: a run that was ended midway goes on, and nothing half written is left."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

from stripfold.files import store

ROOT = Path(__file__).resolve().parents[1]
TARGET = "results/critical_points.nc"
LINE = [sys.executable, "-m", "snakemake", "--cores", "1", "--configfile", "workflow/config/quick.yaml", "--"]


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_an_interrupted_run_goes_on(tmp_path: Path, number: signal.Signals) -> None:
    clone = tmp_path / "clone"
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
    run = subprocess.Popen([*LINE, TARGET], cwd=clone, stderr=subprocess.DEVNULL, start_new_session=True)
    while not list(clone.glob(".snakemake/scripts/*")):  # the first job has not begun
        assert run.poll() is None, "it ended before"
        time.sleep(0.1)
    os.killpg(run.pid, number)
    run.wait(timeout=60)
    assert run.returncode != 0
    assert not (clone / TARGET).exists()
    subprocess.run([*LINE[:-1], "--unlock"], cwd=clone, check=True, capture_output=True)
    done = subprocess.run([*LINE[:-1], "--rerun-incomplete", "--", TARGET], cwd=clone, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = store.read(clone / TARGET)  # with its digest
    assert int((found["snap"] == 1).sum()) == 2
    assert not [path for path in (clone / "results").rglob("*") if ".stripfold-" in path.name]


def test_the_claims_rest_on_numbers_of_the_release() -> None:
    """A number that no study has any more would leave its claim open in every run."""
    numbers = json.loads((ROOT / "results/summary.json").read_text(encoding="utf-8"))
    claims = yaml.safe_load((ROOT / "workflow/claims.yaml").read_text(encoding="utf-8"))["claims"]
    named = {condition.split()[0] for claim in claims for condition in claim.get("numbers", [])}
    assert len(named) > 50
    assert not named - set(numbers.get("numbers", numbers))
