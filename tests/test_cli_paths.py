"""`stripfold path` and `stripfold assess`: tables that fit together, verdicts, errors in one line."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stripfold as sf
from stripfold import cli_paths
from stripfold.ask import path_assessment, verdict
from stripfold.base.errors import TimeStepError
from stripfold.base.material import Material
from stripfold.cli import main
from stripfold.draw.save import save_as
from stripfold.files import store
from stripfold.files.json_output import as_json
from stripfold.follow.statics import StripModel
from stripfold.paths import PLANS, geometric, table

STRIP = ["--length", "0.45", "--eta-b", "3780"]
UNIT = Material(3780.0).gravity_length


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Assess on elements of twice the length."""
    assess_path = verdict.assess_path
    monkeypatch.setattr(
        verdict, "assess_path", lambda *given, **asked: assess_path(*given, **{"refinement": 2.0, **asked})
    )


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


def test_assess_says_where_the_strip_leaves(here: Path, coarse: None, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["path", "triangular", *STRIP, "--csv", "own.csv"]) == 0
    capsys.readouterr()
    assert main(["assess", "own.csv", *STRIP, "--fall", "--json", "--plot", "own.png"]) == 0
    found = json.loads(capsys.readouterr().out)
    (event,) = found["critical"]
    assert not found["stable"]
    assert found["completed"]
    assert event["kind"] == "snap-through"
    # On the way down, at 45 degrees from the apex.
    assert event["x"] + event["z"] == pytest.approx(0.225, abs=1e-9)
    assert event["t"] == pytest.approx(0.5 + event["x"] / 0.45, abs=1e-6)
    assert found["landing_x"] == pytest.approx(3.584045 * UNIT, abs=1e-6)
    assert found["planned_touch_x"] == pytest.approx(2.6255 * UNIT, abs=1e-3 * UNIT)
    assert found["touch_error"] == pytest.approx(found["touch_x"] - found["planned_touch_x"])
    assert -0.4 * UNIT < found["touch_error"] < -0.1 * UNIT
    assert 0.0 < found["shape_error"] < 0.02 * UNIT
    assert found["seconds"] > 0.0
    assert event["outcome"] == "fell to a touch"
    assert 0.1 < event["drop"] / UNIT < 1.0
    assert 1e-3 < event["energy"] / (9.81 * UNIT**2) < 0.1
    assert found["folded"]
    # All of the energy in a part of the strip between 1 L* and all of it.
    assert (2.0 * event["energy"] / 0.45) ** 0.5 / 2.0 < event["speed"] < (2.0 * event["energy"] / UNIT) ** 0.5
    assert not found["failure"]
    assert sorted(os.listdir(here)) == ["own.csv", "own.png"]


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
    """Its numbers are those of the stored study: true eta_b over that of the plan."""
    stored = store.read(Path(__file__).parents[1] / "results/studies/disturbed_rpath.nc")["touch_error"].sel(moment=0.0)
    errors = dict(zip(stored["disturbance"].values, stored.values, strict=True))
    assert pytest.approx(abs(errors["eta_b +5%"]), abs=5e-3) == cli_paths.TOO_LOW
    assert pytest.approx(abs(errors["eta_b -5%"]), abs=5e-3) == cli_paths.TOO_HIGH
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


@pytest.mark.parametrize(
    ("other", "code"), [({}, 0), ({"stable": False}, 1), ({"folded": False}, 1), ({"mesh_dependence": "other"}, 1)]
)
def test_what_check_refuses(here: Path, monkeypatch: pytest.MonkeyPatch, other: dict[str, object], code: int) -> None:
    """The film is drawn of all, and read from no file of the command's."""
    strip, drawn = sf.Strip(length=0.45, eta_b=3780.0), []
    path = sf.paths.low(strip, 0.04)
    path.to_csv(here / "low.csv")
    found = replace(strip.assess(path, model="rod"), **other)
    monkeypatch.setattr(path_assessment.PathAssessment, "of", lambda *_: found)
    monkeypatch.setattr(path_assessment.PathAssessment, "film", lambda _, file, __: drawn.append(file))
    assert main(["assess", "low.csv", *STRIP, "--check", "--film", "low.mp4"]) == code
    assert drawn == [Path("low.mp4")]


@pytest.mark.parametrize("option", [["--output", "nowhere/r.nc"], ["--output", "r.png"], ["--plot", "nowhere/r.png"]])
def test_assess_tries_its_outputs_first(
    here: Path, option: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(verdict, "assess_path", lambda *_, **__: pytest.fail("computed"))
    assert main(["path", "circular", *STRIP, "--csv", "own.csv"]) == 0
    assert main(["assess", "own.csv", *STRIP, *option]) == 2
    assert f"{option[0][2:]} = {option[1]!r} cannot be used" in capsys.readouterr().err


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


def test_a_fall_that_does_not_come_is_part_of_the_verdict(
    here: Path, coarse: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(rest, "LONGEST", 3.0)
    assert main(["path", "triangular", *STRIP, "--csv", "own.csv"]) == 0
    capsys.readouterr()
    asked = ["assess", "own.csv", *STRIP, "--model", "rod", "--fall"]
    assert main(asked) == 0
    said = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert said[0] == ["stable", "no"]
    assert said[1][0] == "critical"
    (failed,) = [text for name, text in said if name == "failed"]
    assert "L*" not in failed
    assert " s (" in failed
    assert main([*asked, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["failure"] == failed
    assert not found["stable"]
    assert not found["completed"]
    (event,) = found["critical"]
    assert event["drop"] is event["energy"] is event["speed"] is None
    assert event["outcome"] == "the fall could not be followed to rest"


@pytest.mark.parametrize("length", [14.0, 20.0])
def test_a_long_fall_of_a_thin_strip_keeps_the_verdict(length: float) -> None:
    """On these R-paths the strip moves on by less than a millimetre; once that was no verdict but an error."""
    strip = sf.Strip(length=length * UNIT, eta_b=3780.0, eta_m=1e-5)
    found = strip.assess(sf.paths.r_path(strip), model="rod", fall=True)
    assert not found.stable
    assert found.critical[0]["kind"] == "bifurcation"
    assert found.completed != bool(found.failure)


def test_a_motion_that_fails_leaves_the_statics(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise TimeStepError("lost at 0.5 L*", last=None)

    monkeypatch.setattr(verdict, "follow_in_time", fail)
    path = geometric.triangular(0.45 / UNIT)
    found = verdict.assess_path(Material(3780.0), 0.45, path, layer_friction=0.3, refinement=2.0, model="rod")
    assert not found.stable
    assert found.failure == f"lost at {0.5 * UNIT:.4g} m"
    assert found.critical[0]["outcome"] == verdict.NOT_FOLLOWED


@pytest.mark.parametrize(("error", "says"), [(1e-3, "beyond it"), (-1e-3, "short of it")])
def test_the_sign_of_an_error_is_in_words(error: float, says: str) -> None:
    strip = sf.Strip(length=0.45, eta_b=3780.0)
    found = replace(strip.assess(sf.paths.triangular(strip), model="rod"), touch_error=error)
    assert f"{error:g} m  ({says})" in str(found)


def test_assess_in_words_with_friction(here: Path, coarse: None, capsys: pytest.CaptureFixture[str]) -> None:
    """With friction in bending the R-path is stable; heavier strips have proportionate forces."""
    assert main(["path", "r-path", *STRIP, "--csv", "r.csv"]) == 0
    capsys.readouterr()
    weight = ["--rho-a", "0.2"]
    friction = ["--friction-moment", str(0.2 * 9.81 * UNIT**2 * 0.012), "--step", str(0.2 * UNIT)]
    assert main(["assess", "r.csv", *STRIP, *weight, *friction]) == 0
    said = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines() if not line.startswith(" "))
    assert said["stable"] == "yes"
    assert said["completed"] == "yes"
    assert "critical" not in said
    assert float(said["peak"].split()[1]) < 0.2 * 9.81 * 0.45


def test_a_lost_strip_is_a_verdict(coarse: None) -> None:
    """Strong friction on a path that would have the strip flung over: it is lost, and where is said."""
    material = Material(3780.0)
    path = geometric.triangular(0.45 / UNIT)
    found = verdict.assess_path(material, 0.45, path, pull=1e-3 * 9.81 / UNIT, step=0.3 * UNIT, refinement=2.0)
    (event,) = found.critical
    assert not found.stable
    assert not found.completed
    assert event["kind"] == "snap-through"
    assert event["x"] + event["z"] == pytest.approx(0.225, abs=1e-9)
    assert np.isnan(found.shape_error)


def test_units_of_friction(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, float, float]] = []

    def followed(strip: StripModel, path: object, law: tuple[str, float], size: float, *_: object) -> Any:
        asked.append((*law, size))
        raise RuntimeError

    monkeypatch.setattr(verdict, "effects_of", lambda law, strength, *_: (law, strength))
    monkeypatch.setattr(verdict, "_with_friction", followed)
    material = Material(3780.0, rho_a=0.2)
    path = geometric.triangular(15.0)
    for given in ({"pull": 25.0, "step": 0.003}, {"friction_moment": 1e-5}):
        with pytest.raises(RuntimeError):
            verdict.assess_path(material, 15.0 * UNIT, path, **given)
    assert asked[0] == ("pull", pytest.approx(25.0 * UNIT / 9.81), pytest.approx(0.003 / UNIT))
    assert asked[1] == ("hysteresis", pytest.approx(1e-5 / (0.2 * 9.81 * UNIT**2)), 0.1)


def test_unit_of_the_yield_curvature(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []

    def effects_of(law: str, strength: float, yield_curvature: float) -> None:
        asked.append(yield_curvature)
        raise RuntimeError

    monkeypatch.setattr(verdict, "effects_of", effects_of)
    for kappa_y in (None, 8.0):
        with pytest.raises(RuntimeError):
            verdict.assess_path(
                Material(3780.0), 15.0 * UNIT, geometric.triangular(15.0), friction_moment=1e-5, yield_curvature=kappa_y
            )
    assert asked == [0.05, pytest.approx(8.0 * UNIT)]


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
