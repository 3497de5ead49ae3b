"""After a kill the next run goes on by itself; a lock that is held is kept; damaged files are named."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep

import pytest
import yaml

import evidence
import unlock
from stripfold.base.errors import InvalidInputError
from studies import kills

ROOT = Path(__file__).parents[1]
PROFILE = ROOT / "profiles" / "default"
SNAKEFILE = """
rule whole:
    output: "whole.txt"
    shell: "echo half > {output}; touch begun; test -e again || sleep 60; echo whole > {output}"
"""


@pytest.fixture
def locked(tmp_path: Path) -> Path:
    """A folder with the lock of a run that is no more."""
    locks = tmp_path / unlock.LOCKS
    locks.mkdir(parents=True)
    (locks / "0.output.lock").write_text("whole.txt\n")
    return tmp_path


def test_a_stale_lock_is_removed(locked: Path):
    assert "removed" in unlock.unlock(locked)
    assert not (locked / unlock.LOCKS).exists()
    assert unlock.unlock(locked) == ""


@pytest.mark.parametrize("name", ["snakemake", ".snakemake/scripts/tmp1.script.py"])
def test_a_lock_is_kept_while_a_run_works_there(locked: Path, name: str):
    program = locked / name
    program.parent.mkdir(parents=True, exist_ok=True)
    program.write_text("import time; print(flush=True); time.sleep(60)")
    elsewhere = locked / "elsewhere"
    elsewhere.mkdir()
    holder = subprocess.Popen([sys.executable, str(program)], cwd=locked, stdout=subprocess.PIPE)
    assert holder.stdout is not None
    holder.stdout.readline()  # it runs
    try:
        with pytest.raises(RuntimeError, match=rf"process {holder.pid}\)"):
            unlock.unlock(locked)
        assert (locked / unlock.LOCKS / "0.output.lock").exists()
        done = subprocess.run([sys.executable, ROOT / "workflow/unlock.py", locked], capture_output=True, text=True)
        assert done.returncode == 1
        assert str(holder.pid) in done.stderr
        assert unlock.running(elsewhere) == []
    finally:
        holder.kill()
        holder.communicate()
    assert "removed" in unlock.unlock(locked)


def test_a_killed_run_goes_on(tmp_path: Path):
    """Its lock and its half-written file stand in the way of nothing."""
    (tmp_path / "Snakefile").write_text(SNAKEFILE)
    command = [sys.executable, "-m", "snakemake", "whole", "--cores", "1", "--profile", str(PROFILE)]
    run = subprocess.Popen(command, cwd=tmp_path, start_new_session=True, stderr=subprocess.DEVNULL)
    end = monotonic() + 60.0
    while not (tmp_path / "begun").exists() and monotonic() < end and run.poll() is None:
        sleep(0.1)
    os.killpg(run.pid, signal.SIGKILL)
    run.wait()
    assert (tmp_path / "whole.txt").read_text() == "half\n"
    (tmp_path / "again").touch()
    locked = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert "lock" in (locked.stdout + locked.stderr).lower()
    assert locked.returncode != 0
    end = monotonic() + 10.0
    while unlock.running(tmp_path.resolve()) and monotonic() < end:
        sleep(0.1)
    assert "removed" in unlock.unlock(tmp_path)
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "whole.txt").read_text() == "whole\n"


def test_every_run_of_the_makefile_unlocks_first():
    lines = (ROOT / "Makefile").read_text().splitlines()
    assert "SNAKEMAKE = $(IN_VENV) python workflow/unlock.py && $(IN_VENV) snakemake" in lines
    assert [line for line in lines if "snakemake " in line and line.startswith("\t")] == []
    assert yaml.safe_load((PROFILE / "config.yaml").read_text())["rerun-incomplete"] is True


def test_what_a_killed_run_left_half_written_is_removed(tmp_path: Path):
    for name in ("results/x/.stripfold-1/y.nc", "figures/.stripfold-2/y.png", "results/y.nc"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    unlock.remove_half_written(tmp_path / "results", tmp_path / "figures", tmp_path / "none")
    assert [str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()] == ["results/y.nc"]
    assert list(tmp_path.rglob(".stripfold-*")) == []
    begun = (ROOT / "Snakefile").read_text().partition("onstart:\n")[2]
    assert begun.startswith("    remove_half_written(RESULTS, FIGURES)")


SCRIPTED = """
rule whole:
    output: "made/whole.txt"
    log: "whole.log"
    params: call="task:write", evidence="0"
    script: "{script}"
"""
TASK = """
import time
from stripfold import store

def write(output):
    with store.atomic(output[0]):
        open("begun", "w").close()
        time.sleep(60)
"""


@pytest.mark.parametrize(("number", "left"), [(signal.SIGTERM, 0), (signal.SIGKILL, 1)])
def test_a_terminated_job_leaves_nothing_half_written(
    tmp_path: Path, number: signal.Signals, left: int, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "Snakefile").write_text(SCRIPTED.format(script=ROOT / "workflow/script.py"))
    (tmp_path / "task.py").write_text(TASK)
    command = [sys.executable, "-m", "snakemake", "whole", "--cores", "1"]
    run = subprocess.Popen(command, cwd=tmp_path, start_new_session=True, stderr=subprocess.DEVNULL)
    end = monotonic() + 60.0
    while not (tmp_path / "begun").exists() and monotonic() < end and run.poll() is None:
        sleep(0.1)
    assert len(list(tmp_path.rglob(".stripfold-*"))) == 1
    kills.end(run, number)
    assert len(list(tmp_path.rglob(".stripfold-*"))) == left


def test_a_damaged_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    half = tmp_path / "results" / "studies" / "order.nc"
    half.parent.mkdir(parents=True)
    half.write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(InvalidInputError, match=r"order\.nc.*delete it"):
        evidence.input_digest(half)
    monkeypatch.setattr(evidence, "ROOT", tmp_path)
    assert "damaged" in evidence.stale_studies({"studies": {}})["order"]
