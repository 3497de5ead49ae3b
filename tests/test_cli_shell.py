"""``stripfold doctor`` finds what is missing; ``stripfold completion`` completes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib import metadata, util
from pathlib import Path

import pytest

from stripfold import cli
from stripfold.ask.strip import Strip


def test_all_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["numpy"] == {"state": metadata.version("numpy"), "fault": ""}
    assert {"scipy", "scikit-fem", "extra vision", "small film", "compiled code", "small run"} <= found.keys()
    assert not any(finding["fault"] for finding in found.values())


def test_an_old_package_is_a_fault(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    found = metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: "1.26.4" if name == "numpy" else found(name))
    assert cli.main(["doctor"]) == 2
    assert "1.26.4; too old" in capsys.readouterr().out


def test_a_missing_extra_is_none(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    found = util.find_spec
    monkeypatch.setattr(util, "find_spec", lambda name: None if name == "cv2" else found(name))
    assert cli.main(["doctor"]) == 0
    assert 'pip install "stripfold[vision]"' in capsys.readouterr().out


def test_a_film_that_cannot_be_read_is_a_fault(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where the decoder process ends with an error: by an option that a new version of PyAV no longer has."""
    monkeypatch.setattr(sys, "executable", "/bin/false")
    assert cli.main(["doctor"]) == 2
    assert "small film       does not work" in capsys.readouterr().out


def test_variables_of_other_programs_change_no_result(tmp_path: Path) -> None:
    """One names a window system that is not there, the other switches the compiler off."""
    variables = os.environ | {"MPLBACKEND": "nope", "NUMBA_DISABLE_JIT": "1"}
    line = "critical --length 0.5 --eta-b 3780 --height 0.09 --model rod --accuracy 5e-3 --plot strip.png --json"
    command = [sys.executable, "-m", "stripfold", *line.split()]
    done = subprocess.run(command, cwd=tmp_path, env=variables, capture_output=True, text=True, check=True)
    expected = Strip(length=0.5, eta_b=3780).critical(height=0.09, model="rod", accuracy=5e-3)
    assert json.loads(done.stdout)["lambda_c"] == pytest.approx(expected.lambda_c, rel=1e-9)
    assert done.stderr.count("NUMBA_DISABLE_JIT is set") == 1
    assert (tmp_path / "strip.png").stat().st_size > 0


@pytest.mark.parametrize(
    ("words", "completed"),
    [("stripfold as", "assess"), ("stripfold critical --hei", "--height"), ("stripfold completion b", "bash")],
)
def test_completion(words: str, completed: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["completion", "bash"]) == 0
    script = tmp_path / "completion.sh"
    script.write_text(capsys.readouterr().out)
    line = f"source {script}; COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _shtab_stripfold"
    done = subprocess.run(["bash", "-c", line + '; echo "${COMPREPLY[@]}"'], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [completed]
