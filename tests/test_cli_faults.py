"""Whatever the system refuses: one line, an exit code, nothing half-written, and nothing computed in vain."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from io import BytesIO
from pathlib import Path

import netCDF4
import pytest
from PIL import Image

from stripfold import cli, cli_commands, store
from stripfold.cli import main
from stripfold.errors import InvalidInputError, SolveError
from stripfold.vision.pictures import MAX_SCANS, read_grey

STRIP = ["critical", "--length", "0.4", "--eta-b", "3780", "--height", "0.09", "--model", "elastica"]


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    code, captured = main(arguments), capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("stripfold: error: ")
    assert captured.err.count("\n") == 1
    return code, captured.err


@pytest.mark.parametrize(
    ("plot", "part"),
    [
        ("", "ends in .png"),
        ("folder.png", "remove the folder"),
        ("/proc/strip.png", "a file that can be written"),
        (f"{'a' * 300}.png", "name too long"),
        ("nowhere/strip.png", "make nowhere first"),
    ],
)
def test_output_that_cannot_be_written_is_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], plot: str, part: str
) -> None:
    from stripfold.analysis import critical_point

    monkeypatch.chdir(tmp_path)
    Path("folder.png").mkdir()
    monkeypatch.setattr(critical_point, "find", lambda *_: pytest.fail("computed in vain"))
    code, said = refused(capsys, *STRIP, "--plot", plot)
    assert (code, os.listdir()) == (2, ["folder.png"])
    assert part in said


@pytest.mark.parametrize(
    ("error", "code", "parts"),
    [
        (OSError(28, "No space left on device", "out.nc"), 2, ("out.nc", "No space left", "check")),
        (MemoryError("Unable to allocate 8 GiB"), 2, ("8 GiB", "accuracy")),
        (RecursionError("too deep"), 5, ("RecursionError in test_cli_faults.py, line", "too deep", "report")),
        (KeyError("phase"), 5, ("KeyError", "'phase'")),
        (SolveError("0.3 L* from\nthe floor"), 3, ("0.008996 m from the floor",)),
    ],
)
def test_other_errors_are_one_line_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: Exception, code: int, parts: tuple[str]
) -> None:
    def fail(*_: object) -> str:
        raise error

    monkeypatch.setitem(cli.COMMANDS, "critical", cli.COMMANDS["critical"]._replace(run=fail))
    got, said = refused(capsys, *STRIP)
    assert got == code
    assert all(part in said for part in parts), said


def test_a_closed_pipe_is_no_fault() -> None:
    line = [sys.executable, "-m", "stripfold", *STRIP]
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(line, stdout=write, stderr=subprocess.PIPE, text=True)
    os.close(write)
    assert (done.returncode, done.stderr) == (128 + signal.SIGPIPE, "")


def test_a_terminated_process_leaves_no_temporary_file(tmp_path: Path) -> None:
    code = (
        "import os, signal, sys\nfrom stripfold import cli, store\n"
        "def write(*_):\n"
        "    with store.atomic('out.nc') as temporary:\n"
        "        temporary.touch()\n        os.kill(os.getpid(), signal.SIGTERM)\n        return 'written'\n"
        "cli.COMMANDS['critical'] = cli.COMMANDS['critical']._replace(run=write)\n"
        f"sys.exit(cli.main({STRIP!r}))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (128 + signal.SIGTERM, "", "")
    assert os.listdir(tmp_path) == []


def test_a_pipe_for_a_scene_does_not_block(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "scene.yaml")
    line = [sys.executable, "-m", "stripfold", "sweep", "scene.yaml"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=20)
    assert done.returncode == 2
    assert "not a file" in done.stderr


def test_a_file_that_declares_too_much_is_refused(tmp_path: Path) -> None:
    with netCDF4.Dataset(tmp_path / "large.nc", "w") as file:
        file.createDimension("state", 100_000_000_000)
        file.createVariable("x", "f8", ("state",), chunksizes=(1000,), zlib=True)
    with pytest.raises(InvalidInputError, match=r"declares 8e\+11 bytes"):
        store.read(tmp_path / "large.nc")


def test_a_jpeg_of_many_scans_is_refused(tmp_path: Path) -> None:
    written = BytesIO()
    Image.linear_gradient("L").save(written, "JPEG", progressive=True)
    usual, path = written.getvalue(), tmp_path / "strip.jpg"
    path.write_bytes(usual)
    assert read_grey(path).shape == (256, 256)
    scan = usual[usual.rindex(b"\xff\xda") : -2]
    path.write_bytes(usual[:-2] + MAX_SCANS * scan + usual[-2:])
    with pytest.raises(InvalidInputError, match="scans"):
        read_grey(path)


def test_the_output_may_have_no_name_but_not_an_empty_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli_commands._output(None, "some/scene.v2.yaml", ".nc") == Path("scene.v2.nc")
    with pytest.raises(InvalidInputError, match=r"ends in \.nc"):
        cli_commands._output("", "scene.yaml", ".nc")
