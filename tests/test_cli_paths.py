"""`stripfold path` and `stripfold assess`: tables that fit together, verdicts, errors in one line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stripfold as sf
from stripfold.base.material import Material
from stripfold.cli import main
from stripfold.files import store
from stripfold.files.reporting import as_json
from stripfold.paths import PLANS, table

STRIP = ["--length", "0.45", "--eta-b", "3780"]
UNIT = Material(3780.0).gravity_length


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", [*([name] for name in PLANS), ["low", "--height", "0.04"]])
def test_path_is_printed_and_written_alike(here: Path, kind: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["path", *kind, *STRIP]) == 0
    printed = capsys.readouterr().out
    assert main(["path", *kind, *STRIP, "--csv", "own.csv"]) == 0
    assert (here / "own.csv").read_text(encoding="utf-8") == printed
    rows = np.loadtxt(here / "own.csv", delimiter=",", skiprows=2)
    assert capsys.readouterr().out == f"written      own.csv, {len(rows)} rows\n"
    assert rows[0, :3].tolist() == [0.0, -0.225, 0.0]
    np.testing.assert_allclose(rows[-1, :3], [1.0, 0.225, 0.0], atol=1e-9)
    assert np.all(np.diff(rows[:, 0]) > 0.0)
    back = table.read(here / "own.csv", 0.45 / UNIT, UNIT)
    assert back.pieces[-1].end == pytest.approx(back.length)


@pytest.mark.parametrize("kind", [pytest.param("r-path", marks=pytest.mark.slow), "triangular"])
def test_a_partial_fold_is_the_half_fold_of_a_shorter_strip(
    here: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """What lies beyond the fold only moves the places along x: its fold line is at x = -0.08 m."""
    found = {}
    for length, fold in ((0.45, []), (0.61, ["--fold-at", "0.225"])):
        strip = ["--length", str(length), "--eta-b", "3780"]
        assert main(["path", kind, *strip, *fold, "--csv", "own.csv"]) == 0
        capsys.readouterr()
        assert main(["assess", "own.csv", *strip, *fold, "--model", "rod", "--fall", "--json"]) == 0
        found[length] = json.loads(capsys.readouterr().out)
    half, partial = found.values()
    for name in ("touch_x", "planned_touch_x", "landing_x"):
        assert partial[name] == pytest.approx(half[name] - 0.08, abs=5e-4)
    assert partial["critical"][0]["x"] == pytest.approx(half["critical"][0]["x"] - 0.08, abs=5e-4)
    assert partial["touch_error"] == pytest.approx(half["touch_error"], abs=5e-4)
    assert partial["lying_length"] == pytest.approx(half["lying_length"] + 0.16, abs=5e-4)
    assert partial["shape_error"] == pytest.approx(half["shape_error"], abs=2e-4)
    assert partial["inputs"]["fold_at"] == 0.225
    assert partial["folded"]


def test_an_r_path_says_on_which_side_to_plan(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["path", "r-path", *STRIP]) == 0
    said = capsys.readouterr().err
    assert "plan an R-path for the largest eta_b" in said
    assert "5 % too low moves the first touch by 13 mm, one 5 % too high by 0.6 mm" in said
    assert main(["path", "circular", *STRIP]) == 0
    assert not capsys.readouterr().err


def test_a_verdict_is_written_and_checked(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The exit code is the verdict with --check only; the file holds the states."""
    kinds = {"triangular": [], "low": ["--height", "0.04"]}
    for kind, more in kinds.items():
        assert main(["path", kind, *STRIP, *more, "--csv", f"{kind}.csv"]) == 0
    for kind, code in (("triangular", 1), ("low", 0)):
        asked = ["assess", f"{kind}.csv", *STRIP, "--model", "rod"]
        assert main([*asked, "--check", "--output", f"{kind}.nc"]) == code
        assert main(asked) == 0
        assert f"stable       {'no' if code else 'yes'}" in capsys.readouterr().out
        data = store.read(here / f"{kind}.nc")
        assert data.attrs["stable"] == 1 - code
        assert data.sizes["node"] == 201
        assert json.loads(data.attrs["config"])["length"] == 0.45


def test_a_check_may_limit_the_error_of_the_fold(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """0.26 mm, for the thickness of the strip."""
    assert main(["path", "low", *STRIP, "--height", "0.03", "--csv", "low.csv"]) == 0
    asked = ["assess", "low.csv", *STRIP, "--model", "rod"]
    assert main([*asked, "--check", "--max-error", "3e-4"]) == 0
    assert main([*asked, "--check", "--max-error", "2e-4"]) == 1
    assert main([*asked, "--max-error", "2e-4"]) == 2
    assert "together with check" in capsys.readouterr().err


@pytest.mark.parametrize(("flatness", "code"), [("1e-4", 0), ("2e-3", 1)])
def test_a_wrinkle_that_would_grow_fails_the_check(here: Path, capsys, flatness: str, code: int) -> None:
    """Under the push of a low path at 0.3 L* waves of z^4 L* do not hold the strip, 0.26 mm; a ruck grows from 0.35."""
    assert main(["path", "low", *STRIP, "--height", f"{0.3 * UNIT:g}", "--csv", "low.csv"]) == 0
    capsys.readouterr()
    asked = ["assess", "low.csv", *STRIP, "--model", "rod", "--flatness", flatness]
    assert main([*asked, "--check"]) == code
    assert ("may ruck" in capsys.readouterr().out) == bool(code)


@pytest.mark.parametrize(("error", "says"), [(1e-3, "beyond it"), (-1e-3, "short of it")])
def test_the_sign_of_an_error_is_in_words(error: float, says: str) -> None:
    strip = sf.Strip(length=0.45, eta_b=3780.0)
    found = replace(strip.assess(sf.paths.triangular(strip), model="rod"), touch_error=error)
    assert f"{error:g} m  ({says})" in str(found)


def test_what_is_no_number_is_null_in_json() -> None:
    nan = float("nan")
    text = as_json({"a": nan, "critical": [{"t": 0.5, "angle": nan}], "b": (1.0, float("inf"))})
    assert json.loads(text) == {"a": None, "critical": [{"t": 0.5, "angle": None}], "b": [1.0, None]}
    assert json.loads(as_json({"numpys": [np.bool_(True), np.int64(2), np.float64("nan")]})) == {
        "numpys": [True, 2, None]
    }


def test_both_laws_at_once_are_refused(here: Path) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["assess", "own.csv", *STRIP, "--friction-moment", "1", "--pull", "1"])
    assert stopped.value.code == 2
