"""A command that is ended midway, or whose reader ends: an exit code, no traceback, and files are as they were."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from itertools import cycle
from pathlib import Path

import cv2
import pytest

import drawn_strips as drawn
from made_up import INPUTS
from stripfold.cli import main

STRIP = "--length 0.5 --eta-b 3780"
CRITICAL = ["critical", *STRIP.split(), "--height", "0.09", "--model", "elastica"]
SIGNALS = (signal.SIGINT, signal.SIGTERM)
SWEEP = "sweep grid.yaml --output o.nc --cores 2"
COMMANDS = {
    f"assess path.csv {STRIP} --fall --output o.nc --plot o.png --film o.mp4": "state at",
    f"critical {STRIP} --height 0.09 --accuracy 1e-6 --plot o.png": "limit point",
    "film fall.nc --output o.mp4": "drawing: 1 %",
    "measure filmed": "tracking: 1 %",
    "simulate scene.yaml --output o.nc --plot o.png": "state at",
}
"""With a part of the line on standard error at which it is ended."""
MEASURED = ("filmed/result/measurement.nc", "filmed/result/report.html")
GRID = "{length: 0.6, accuracy: 1.0e-6, height: {from: 0.06, to: 0.3, count: 4000}, eta_b: 3780}"


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the commands read, and old outputs."""
    folder = tmp_path_factory.mktemp("inputs")
    for name, text in {**INPUTS, "grid.yaml": GRID}.items():
        (folder / name).write_text(text)
    cv2.imwrite(str(folder / "fold.png"), drawn.picture(drawn.coverage(drawn.folded(150.0), 6.0, (640, 520))))
    assert main(["path", "triangular", *STRIP.split(), "--csv", str(folder / "path.csv")]) == 0
    assert main(["simulate", str(folder / "scene.yaml"), "--output", str(folder / "fall.nc")]) == 0
    assert main(["record", str(folder / "filmed.yaml"), "--output", str(folder / "filmed")]) == 0
    for name in {*re.findall(r"\bo\.\w+", " ".join((*COMMANDS, SWEEP))), *MEASURED}:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("old")
    return folder


def content(folder: Path) -> dict[Path, bytes]:
    """All files and folders, but not the parts of a sweep, from which it goes on."""
    paths = (path for path in folder.rglob("*") if "o.nc.parts" not in str(path) or ".stripfold-" in path.name)
    return {path.relative_to(folder): path.read_bytes() if path.is_file() else b"" for path in paths}


@pytest.mark.parametrize(
    ("command", "number"),
    [
        (SWEEP, signal.SIGINT),
        *(
            pytest.param(*case, marks=[] if case[0].startswith(("assess", "measure")) else [pytest.mark.slow])
            for case in zip(COMMANDS, cycle(SIGNALS))
        ),
    ],
)
def test_all_is_as_it_was(inputs: Path, tmp_path: Path, command: str, number: signal.Signals) -> None:
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)
    before, at = content(tmp_path), COMMANDS.get(command, "limit point")
    line = [sys.executable, "-m", "stripfold", *command.split(), "--verbose"]
    with subprocess.Popen(line, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert any(at in said for said in process.stderr), "it ended before"
        process.send_signal(number)
        out, err = process.communicate(timeout=20)
    assert (process.returncode, out) == (128 + number, "")
    assert not [fault for fault in ("Traceback", "Exception", "stripfold: error") if fault in err], err
    assert content(tmp_path) == before


@pytest.mark.parametrize(("closed", "option"), [("stdout", "--quiet"), ("stderr", "--verbose")])
def test_a_closed_pipe_is_no_fault(closed: str, option: str) -> None:
    read, write = os.pipe()
    os.close(read)
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | {closed: write}
    buffered = os.environ | {"PYTHONUNBUFFERED": ""}
    done = subprocess.run([sys.executable, "-m", "stripfold", *CRITICAL, option], text=True, env=buffered, **streams)
    os.close(write)
    assert (done.returncode, done.stdout or "", done.stderr or "") == (128 + signal.SIGPIPE, "", "")


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize(
    "there",
    [
        "end()",
        "try: end()\n        except BaseException as error: raise ValueError from error",
        "Ending()\n        time.sleep(20)",
    ],
)
def test_an_ended_process_leaves_no_temporary_file(tmp_path: Path, number: signal.Signals, there: str) -> None:
    """Nor an error, also where a library turns the signal into one of its own or ignores it in a destructor."""
    code = (
        "import os, signal, sys, time\nfrom stripfold import cli\nfrom stripfold.files import store\n"
        f"def end(*_): os.kill(os.getpid(), {int(number)})\n"
        "class Ending: __del__ = end\n"
        "def write(*_):\n"
        "    with store.atomic('out.nc') as temporary:\n"
        "        temporary.touch()\n"
        f"        {there}\n"
        "cli.COMMANDS['critical'] = cli.COMMANDS['critical']._replace(run=write)\n"
        f"sys.argv[1:] = {CRITICAL!r}\nsys.exit(cli.main())"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=15)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", "")
    assert os.listdir(tmp_path) == []


def test_an_interruption_while_the_command_line_is_imported_is_no_traceback() -> None:
    code = (
        "import os, signal, sys\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'stripfold.cli': os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "from stripfold.__main__ import main\nmain()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")


@pytest.mark.parametrize("number", SIGNALS)
def test_what_is_done_stays_done(number: signal.Signals) -> None:
    """A signal while Python ends, when its handlers are gone, does not take the place of the exit code."""
    line = [sys.executable, "-m", "stripfold", *CRITICAL]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline()
        process.send_signal(number)
        assert process.wait(timeout=20) in (0, 128 + number)
