"""`stripfold path` and `stripfold assess`: tables that fit together, verdicts, errors in one line."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stripfold as sf
from stripfold.base.material import Material
from stripfold.cli import main
from stripfold.draw.save import save_as
from stripfold.files import store
from stripfold.files.json_output import as_json
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
    assert rows[0].tolist() == [0.0, -0.225, 0.0]
    np.testing.assert_allclose(rows[-1], [1.0, 0.225, 0.0], atol=1e-9)
    assert np.all(np.diff(rows[:, 0]) > 0.0)
    back = table.read(here / "own.csv", 0.45 / UNIT, UNIT)
    assert back.pieces[-1].end == pytest.approx(back.length)


@pytest.mark.parametrize("kind", ["r-path", "triangular"])
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


def test_a_path_that_cannot_be_written_is_not_drawn(here: Path) -> None:
    assert main(["path", "circular", *STRIP, "--plot", "own.png", "--csv", "nowhere/own.csv"]) == 2
    assert not os.listdir(here)


def test_a_path_and_a_critical_point_are_drawn(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The files are what ``plot()`` draws."""
    assert main(["path", "low", *STRIP, "--height", "0.036", "--plot", "path.png"]) == 0
    assert main(["critical", *STRIP, "--height", "0.09", "--model", "elastica", "--plot", "strip.png"]) == 0
    strip = sf.Strip(length=0.45, eta_b=3780.0)
    drawn = {"path.png": sf.paths.low(strip, 0.036), "strip.png": strip.critical(0.09, model="elastica")}
    for name, result in drawn.items():
        save_as(result.plot(), here / f"by_{name}")
        assert (here / name).read_bytes() == (here / f"by_{name}").read_bytes()


@pytest.mark.parametrize(("error", "says"), [(1e-3, "beyond it"), (-1e-3, "short of it")])
def test_the_sign_of_an_error_is_in_words(error: float, says: str) -> None:
    strip = sf.Strip(length=0.45, eta_b=3780.0)
    found = replace(strip.assess(sf.paths.triangular(strip), model="rod"), touch_error=error)
    assert f"{error:g} m  ({says})" in str(found)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["path", "r-path", "--length", "0.2", "--eta-b", "3780"], "more than 0.215 m"),
        (["path", "r-path", "--length", "3.5", "--eta-b", "3780"], "at most 2.999 m"),
        (["path", "circular", "--length", "-1", "--eta-b", "3780"], "length = -1.0"),
        (["path", "circular", "--length", "450", "--eta-b", "3780"], "length = 450.0"),
        (["path", "circular", *STRIP, "--csv", "own.txt"], "ends in .csv"),
        (["path", "circular", *STRIP, "--height", "0.04"], "with the low path only"),
        (["path", "low", *STRIP], "height is missing"),
        (["path", "r-path", *STRIP, "--fold-at", "0.3"], "at most 0.225 m, half the length"),
        (["path", "r-path", *STRIP, "--fold-at", "0.1"], "more than 0.1075 m"),
        (["path", "low", *STRIP, "--height", "0.1", "--fold-at", "0.15"], "from 0.002999 to 0.075 m"),
        (["assess", "good.csv", *STRIP, "--fold-at", "nan"], "fold_at = nan"),
        (["path", "circular", *STRIP, "--plot", "own.txt"], "ends in .png"),
        (["assess", "good.csv", *STRIP, "--plot", "nowhere/own.png"], "existing folder"),
        (["critical", *STRIP, "--height", "0.09", "--plot", "own.pdf"], "ends in .png"),
        (["path", "low", *STRIP, "--height", "0.2"], "from 0.002999 to 0.1125 m"),
        (["path", "low", *STRIP, "--height", "nan"], "height = nan cannot be used"),
        (["assess", "nowhere.csv", *STRIP], "nowhere.csv"),
        (["assess", "bad.csv", *STRIP], "header t,x,z"),
        (["assess", "good.csv", *STRIP, "--eta-m", "1"], "eta_m"),
        (["assess", "good.csv", *STRIP, "--pull", "-1"], "pull = -1.0"),
        (["assess", "good.csv", *STRIP, "--pull", "nan"], "pull = nan"),
        (["assess", "good.csv", *STRIP, "--step", "0.01"], "together with friction"),
        (["assess", "good.csv", *STRIP, "--pull", "1", "--step", "9"], "step = 9.0 cannot be used; allowed: more"),
        (["assess", "good.csv", *STRIP, "--eta-m", "0.09"], "m thick, more than 0.006 m"),
        (["assess", "good.csv", "--length", "0.6", "--eta-b", "3780"], "start at (-0.3, 0) m"),
    ],
)
def test_bad_input_is_one_line_and_code_2(
    here: Path, arguments: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "bad.csv").write_text("time;x;z\n0;1;2\n", encoding="utf-8")
    (here / "good.csv").write_text("t,x,z\n0,-0.225,0\n1,0,0.225\n", encoding="utf-8")
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert says in err
    assert "L*" not in err or "times L* =" in err
    assert str(here) not in err
    assert sorted(os.listdir(here)) == ["bad.csv", "good.csv"]


def test_what_is_no_number_is_null_in_json() -> None:
    nan = float("nan")
    text = as_json({"a": nan, "critical": [{"t": 0.5, "angle": nan}], "b": (1.0, float("inf"))})
    assert json.loads(text) == {"a": None, "critical": [{"t": 0.5, "angle": None}], "b": [1.0, None]}


@pytest.mark.parametrize(
    ("command", "option", "advice"),
    [
        (["assess", "own.csv"], "--hysteresis", "hysteresis is now called friction_moment (M_0, N)"),
        (["assess", "own.csv"], "--friction", "friction is now called friction_moment (M_0, N) or pull (k_f, s^-2)"),
        (["map"], "--friction", "friction is now called friction_moment (M_0, N)"),
        (["plan"], "--hysteresis=1", "hysteresis is now called friction_moment (M_0, N)"),
    ],
)
def test_a_former_option_is_refused_with_the_present_one(
    command: list[str], option: str, advice: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        main([*command, *STRIP, option, "1"])
    assert stopped.value.code == 2
    said = capsys.readouterr().err
    assert advice in said
    assert said.count("error") == 1


def test_both_laws_at_once_are_refused(here: Path) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["assess", "own.csv", *STRIP, "--friction-moment", "1", "--pull", "1"])
    assert stopped.value.code == 2
