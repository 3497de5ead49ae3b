"""The study of malformed inputs: what counts as a failure, and that none of them ends the study."""

from __future__ import annotations

import mmap
import os
import signal
import sys
import time

import pytest

from stripfold.base.errors import InvalidInputError
from stripfold.cli import COMMANDS
from stripfold.film import recording
from stripfold.film.recording import ManualOnset
from studies import fuzz
from studies.fuzz import Case, Ending, Followed

ERROR = "stripfold: error: length = 3 cannot be used\n"
USAGE = "usage: stripfold eta [-h]\n  more\nstripfold eta: error: argument --length\n"


@pytest.mark.parametrize(
    ("code", "said", "errors", "kind"),
    [
        (0, "lambda_c 0.3 m", "", "answered"),
        (0, "lambda_c 0.3 m", "stripfold: warning: contact is off\n", "answered"),
        (0, "s,x,z", "stripfold: note: an eta_b 5 % too low moves the first touch by 13 mm\n", "answered"),
        (0, "lambda_c 0.3 m", "   0.082 s  model rod\n", "answered"),
        (2, "", "   0.082 s  model rod\n" + ERROR, "refused"),
        (0, "nanometre inflow --inf-x", "", "answered"),
        (0, "lambda_c nan m", "", "failed"),
        (0, "between -inf and 3", "", "failed"),
        (0, "lambda_c 0.3 m", "RuntimeWarning: overflow\n", "failed"),
        ("followed", "", "", "followed"),
        ("followed", "", "stripfold: warning: contact is off\n", "followed"),
        ("followed", "", "RuntimeWarning: overflow\n", "failed"),
        (2, "", ERROR, "refused"),
        (2, "", USAGE, "refused"),
        (2, "", "a library says\n" + ERROR, "failed"),
        (2, "", "", "failed"),
        (2, "", "stripfold: error: the memory does not suffice: 8 GB\n", "failed"),
        (5, "", ERROR, "failed"),
        (1, "", USAGE, "failed"),
        ("Traceback ... KeyError: 3", "", "", "failed"),
    ],
)
def test_what_counts_as_a_failure(code: int | str, said: str, errors: str, kind: str) -> None:
    assert fuzz.judged(code, said, errors).kind == kind


def _main(words: list[str]) -> int:
    """Does what its only word says."""
    match words[0]:
        case "hang":
            with open("pipe") as file:  # until somebody writes
                file.read()
        case "memory":
            # Of the system: what the process has freed before would not make it grow.
            with mmap.mmap(-1, 60_000_000) as taken:
                for _ in range(60):
                    taken.write(b"x" * 1_000_000)
        case "more memory":
            bytearray(b"x" * 300_000_000)
        case "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "raise":
            raise KeyError("phase")
        case "follow":
            raise Followed
        case "exit":
            sys.exit("usage")
    time.sleep(0.01)
    print("done")
    return 0


def test_hangs_crashes_and_memory_are_failures_and_the_rest_goes_on(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(fuzz, "main", _main)
    monkeypatch.setattr(fuzz, "LONGEST", 8)
    monkeypatch.setattr(fuzz, "MEMORY", 5e7)
    calls = ("fine", "hang", "memory", "fine", "more memory", "crash", "raise", "follow", "fine")
    found = fuzz.endings_of([Case((word,), {"pipe": b"a pipe"}) for word in calls], tmp_path)
    kinds = ["answered", "failed", "failed", "answered", "failed", "failed", "failed", "followed", "answered"]
    assert [ending.kind for ending in found] == kinds, found
    assert found[1] == Ending("failed", "no end within 8 s")
    assert found[2].why.startswith("takes ")
    assert "MemoryError" in found[4].why
    assert found[5] == Ending("failed", f"ended by {-signal.SIGSEGV}")
    assert "KeyError" in found[6].why


def test_a_few_inputs_of_each_kind(tmp_path) -> None:
    pytest.importorskip("hypothesis", reason="the environment is older than its lock")
    data = fuzz.run(inputs=40, seed=5)
    assert sum(int(data[name].sum()) for name in fuzz.ENDINGS) == 40
    assert data.attrs["failures"] == ""
    assert int(data["failed"].sum()) == 0


def test_the_same_seed_draws_the_same_inputs() -> None:
    pytest.importorskip("hypothesis", reason="the environment is older than its lock")
    from studies import fuzz_inputs

    first, again, other = (fuzz_inputs.drawn(fuzz_inputs.of_arguments(), 20, seed) for seed in (1, 1, 2))
    assert len(first) == 20
    assert first == again != other
    assert {call.split()[0] for call in fuzz_inputs.CALLS} == set(COMMANDS)


def test_the_files_of_a_recording_are_those_that_are_read(tmp_path) -> None:
    pytest.importorskip("hypothesis", reason="the environment is older than its lock")
    from studies import fuzz_inputs

    for name, content in (fuzz_inputs.recording() | {"manual_onset.yaml": b"sd: 1"}).items():
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InvalidInputError, match="event_time"):
        recording.read(tmp_path)
    for name, tree in fuzz_inputs.RECORDING.items():
        (tmp_path / name).write_text(fuzz_inputs._as_yaml(tree), encoding="utf-8")
    found = recording.read(tmp_path)
    assert found.manual_onset() is not None
    assert set(fuzz_inputs.RECORDING) == {recording.NAME, ManualOnset.file_name, found.entries.camera.intrinsics}
