"""The command line: numbers on standard output, everything else on standard error, exit codes, files to start from."""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import termios
import textwrap
from importlib import metadata, util
from pathlib import Path
from typing import Any

import pytest
import yaml

import stripfold
import stripfold as sf
from stripfold import cli, kernels
from stripfold.ask.inputs import MapInputs, PathInputs, PlanInputs, Scene, Simulation
from stripfold.ask.strip import Strip
from stripfold.base.progress import Percent
from stripfold.cli import COMMANDS, main
from stripfold.files import reporting
from stripfold.film import recording
from stripfold.synthetic import scene as synthetic

STRIP = ["critical", "--length", "0.6", "--eta-b", "3780", "--height", "0.09"]
BY_THE_ROD = ["--length", "0.45", "--eta-b", "3780", "--model", "rod"]


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    try:
        code = main(arguments)
    except SystemExit as stop:  # argparse's own
        code = int(stop.code or 0)
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["critical", "--length", "0,6", "--eta-b", "3780", "--height", "0.1"], "--length: '0,6' .*write 0.6"),
        (["critical", "--length", "60cm", "--eta-b", "3780", "--height", "0.1"], "write 0.6"),
        (["plan", "--length", "0.5", "--eta-b", "3780", "--margin", "10mm"], "write 0.01"),
        (["path", "low", "--length", "0.5", "--eta-b", "3780", "--height", "30mm"], "write 0.03"),
        (["critical", "--length", "0.6", "--eta_b", "3780", "--height", "0.1"], "--eta_b: did you mean --eta-b"),
        (["assess", "path.csv", "--lenght=0.6", "--eta-b", "3780"], "--lenght: did you mean --length"),
        (["map", "--friction", "1"], "--friction: did you mean --friction-moment"),
        (["assess", "--friction=1"], "--friction: did you mean .*--friction-moment or --layer-friction or --table"),
        (["assess", "r-path", "--length", "0.5", "--eta-b", "3780"], "`stripfold path r-path` with --csv writes it"),
        (["plan", "--length", "0.5"], "eta_b is missing; allowed: --eta-b, or --fabric"),
        (["measure", "flim.mp4", "--length", "0.5"], "there is no such file"),
    ],
)
def test_bad_usage_says_what_was_probably_meant(capsys, arguments, meant):
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (2, "")
    assert re.search(meant, err)


@pytest.mark.parametrize(
    "arguments",
    [
        [*STRIP, "--model", "elastica", "--second-gripper", "auto", "--eta-b-uncertainty", "20%"],
        ["eta", "--fold-height", "0.0272"],
        ["eta", "--kes-b", "0.1", "--kes-2hb", "0.05", "--gsm", "200"],
        ["map", "--length", "0.45", "--eta-b", "3780"],
        ["path", "low", "--length", "0.45", "--eta-b", "3780", "--height", "0.04"],
        ["assess", "own.csv", *BY_THE_ROD, "--friction-moment", "1e-4", "--step", "0.03"],
        ["sweep", "grid.yaml", "--cores", "1"],
    ],
)
def test_json_says_what_it_is_for_and_in_which_units(capsys, tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "grid.yaml").write_text("{length: 0.6, eta_b: 3780, height: [0.04, 0.09], model: elastica}")
    run(capsys, "path", "triangular", "--length", "0.45", "--eta-b", "3780", "--csv", "own.csv")
    code, out, err = run(capsys, *arguments, "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["stripfold_version"] == stripfold.__version__
    given = {arguments[i][2:].replace("-", "_"): arguments[i + 1] for i in range(len(arguments) - 1)}
    numbers = {name: float(text) for name, text in given.items() if name in ("length", "eta_b", "fold_height")}
    assert {name: found["inputs"][name] for name in numbers} == numbers
    known = set(reporting._numeric({name: value for name, value in found.items() if name != "units"}))
    assert known <= set(found["units"])


def test_blas_gets_one_thread_by_default(capsys, monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "3")
    run(capsys, "eta", "--fold-height", "0.0272")
    assert (os.environ["OMP_NUM_THREADS"], os.environ["OPENBLAS_NUM_THREADS"]) == ("1", "3")


def test_version(capsys):
    assert run(capsys, "--version") == (0, f"stripfold {stripfold.__version__}\n", "")


HEAVY = ("cv2", "matplotlib", "netCDF4", "numba", "pandas", "skfem", "snakemake", "xarray")
SOLVING = ("numpy", "scipy")
SCIPY = ("scipy.interpolate", "scipy.linalg", "scipy.optimize", "scipy.sparse")
MAIN = "import stripfold.cli\ntry: stripfold.cli.main({!r})\nexcept SystemExit: pass"


@pytest.mark.parametrize(
    ("code", "modules"),
    [
        ("import stripfold", (*HEAVY, *SOLVING, "pydantic", "yaml")),
        (MAIN.format(["--help"]), (*HEAVY, *SOLVING, "pydantic", "yaml", "tqdm")),
        *((MAIN.format([name, "--help"]), (*HEAVY, *SOLVING)) for name in ("critical", "measure", "plan")),
        # The rod's integrals are compiled code, which comes with its compiler, but without what compiles.
        (
            MAIN.format([*STRIP, "--model", "rod"]),
            {*HEAVY, *SCIPY, "tqdm", "numba.np.linalg", "numba.typed.typeddict"} - {"numba"},
        ),
        (MAIN.format([*STRIP, "--model", "solid"]), {*HEAVY, *SCIPY, "tqdm"} - {"numba"}),
        (MAIN.format([*STRIP, "--model", "elastica"]), (*HEAVY, *SCIPY, "tqdm")),
        (MAIN.format(["eta", "--fold-height", "0.0272"]), HEAVY),
        (MAIN.format(["path", "r-path", *STRIP[1:5]]), HEAVY),
    ],
)
def test_what_is_heavy_is_imported_where_it_is_used(code, modules):
    # Compiled in this process, if they are not kept yet, which imports the rest of the compiler.
    for name in ("band", "elements"):
        getattr(kernels, name)
    check = f"\nimport sys; print([name for name in {modules!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code + check], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


# -- with the real search


def command(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "stripfold", *arguments], capture_output=True, text=True)


def test_progress_goes_to_a_terminal_on_standard_error():
    ours, theirs = os.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    line = [sys.executable, "-m", "stripfold", *STRIP, "--model", "elastica", "--json"]
    done = subprocess.run(line, stdout=subprocess.PIPE, stderr=theirs, text=True)
    os.write(theirs, b"end")  # reading ends where nothing was shown
    shown = os.read(ours, 4096).decode()
    os.close(theirs)
    os.close(ours)
    assert json.loads(done.stdout)["snap"] is True
    assert re.search(r"model elastica \[00:\d\d\]\r", shown)


def test_verbose_says_model_mesh_and_steps_in_si(capsys):
    code, out, err = run(capsys, *STRIP, "--model", "rod", "--verbose")
    assert (code, out.count("lambda_c ")) == (0, 1)
    for said in ("model rod", "elements 1.5 times", r"limit point at lambda = 0\.295 m, \d+ unknowns, \d+ iterations"):
        assert re.search(rf"^ +\d+\.\d{{3}} s  {said}", err, re.M), err
    assert "L*" not in err


def test_quiet_leaves_errors_only(capsys):
    line = ["path", "r-path", "--length", "0.5", "--eta-b", "3780"]
    noisy, quiet = run(capsys, *line), run(capsys, *line, "--quiet")
    assert noisy[2].startswith("stripfold: note: plan an R-path for the largest eta_b")
    assert quiet == (0, noisy[1], "")
    code, out, err = run(capsys, *line[:-1], "-1", "--quiet")
    assert (code, out) == (2, "")
    assert err.startswith("stripfold: error: eta_b = -1")


@pytest.mark.parametrize("name", COMMANDS)
def test_all_commands_have_the_same_options(capsys, name):
    said = run(capsys, name, "--help")[1]
    assert "--quiet" in said
    assert "--verbose" in said
    assert ("--json" in said) == (name not in ("completion", "new"))


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
    line = "critical --length 0.5 --eta-b 3780 --height 0.09 --model rod --accuracy 5e-2 --plot strip.png --json"
    command = [sys.executable, "-m", "stripfold", *line.split()]
    done = subprocess.run(command, cwd=tmp_path, env=variables, capture_output=True, text=True, check=True)
    expected = Strip(length=0.5, eta_b=3780).critical(height=0.09, model="rod", accuracy=5e-2)
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


def percents(said: list[str], what: str) -> list[int]:
    return [int(found[1]) for line in said if (found := re.fullmatch(rf"{what}: (\d+) %", line))]


def test_each_per_cent_is_said_once():
    said: list[str] = []
    assert list(Percent(said.append, "drawn").each(range(1000), 1000)) == list(range(1000))
    assert percents(said, "drawn") == list(range(100))


def test_it_never_goes_back():
    said: list[str] = []
    told = Percent(said.append, "followed")
    for share in (0.0, 0.29, 0.1, 0.58, 1.0):
        told(share)
    assert percents(said, "followed") == [0, 29, 58, 100]


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({}, "following the path"),
        ({"friction_moment": 1e-3, "step": 0.03}, "following the path in steps"),
        ({"layer_friction": 0.3}, "following the path in time"),
    ],
    ids=["statics", "friction", "in time"],
)
def test_an_assessment_says_how_far_it_is(options: dict[str, object], what: str):
    strip, said = sf.Strip(length=0.3, eta_b=3780), list[str]()
    strip.assess(sf.paths.low(strip, 0.036), model="rod", progress=said.append, **options)
    found = percents(said, what)
    assert len(found) > 5
    assert found[0] <= 10
    assert found[-1] == 100


def test_so_does_a_sweep(tmp_path: Path):
    said: list[str] = []
    from stripfold.ask import sweep

    sweep.run(
        {"length": 0.6, "model": "elastica", "eta_b": [3000, 4000], "height": 0.09}, tmp_path / "s.nc", 1, said.append
    )
    assert percents(said, "solved")[-1] == 100


ROOT = Path(__file__).resolve().parents[1]
FILMED = "filming: {size: [160, 120], frame_rate: 5.0, views: 4}\nspeed: 0.03\nmotion: {before: 0.008, after: 0.3}\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def written(kind: str, name: str) -> str:
    assert main(["new", kind, "--output", name]) == 0
    return Path(name).read_text(encoding="utf-8")


def test_its_files_are_read_by_their_commands(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = written("scene", "scene.yaml")
    Path("fast.yaml").write_text(scene + "model: rod\nuntil: touch\n", encoding="utf-8")
    assert main(["simulate", "fast.yaml"]) == 0
    Path("filmed.yaml").write_text(scene + FILMED, encoding="utf-8")
    assert main(["record", "filmed.yaml", "--quiet"]) == 0
    description = written("recording", "new.yaml").replace("speed: 0.002", "speed: 0.03")
    (here / "filmed" / "recording.yaml").write_text(description, encoding="utf-8")
    assert recording.read("filmed").entries.strip.length == 0.45
    Path("fast.yaml").write_text(written("grid", "grid.yaml").replace("rod ", "elastica "), encoding="utf-8")
    capsys.readouterr()
    assert main(["sweep", "fast.yaml", "--cores", "1"]) == 0
    assert "cases        8" in capsys.readouterr().out


def optional(text: str) -> dict[str, Any]:
    return dict(yaml.safe_load("\n".join(re.findall(r"^ *#: (.*)$", text, re.M))))


def test_what_may_be_left_out_is_the_default(here: Path) -> None:
    scene = written("scene", "scene.yaml")
    given = yaml.safe_load(scene)
    _, simulated, filmed = re.split(r"^# For .* only.*$", scene, flags=re.M)
    assert Simulation(**given, **optional(simulated)).as_config() == Simulation(**given).as_config()
    assert synthetic.Scene(**given, **optional(filmed)).as_config() == synthetic.Scene(**given).as_config()
    for key, value in optional(written("grid", "grid.yaml")).items():
        assert Scene.model_fields[key].default == value
    text = written("recording", "recording.yaml")
    whole = yaml.safe_load(text.replace("#: ", ""))
    assert recording.Entries(**whole).strip.rho_a == 0.2
    shown = (ROOT / "docs/measuring.md").read_text(encoding="utf-8")
    assert textwrap.indent(text.split("\n\n", 1)[1], "    ") in shown


MODELS = {"critical": Scene, "simulate": Simulation, "plan": PlanInputs, "map": MapInputs, "assess": PathInputs}


@pytest.mark.parametrize("name", MODELS)
def test_an_option_takes_what_its_field_takes(name: str) -> None:
    """A text, a number or one of several words: what is read of it has the type of the input."""
    parser, properties = argparse.ArgumentParser(), MODELS[name].model_json_schema()["properties"]
    COMMANDS[name].options(parser)
    options = {action.dest: action for action in parser._actions if action.nargs != 0}
    for key in properties.keys() & options.keys() - ({"friction_moment"} if name == "plan" else set()):
        read = options[key].type or str
        for kind in properties[key].get("anyOf", [properties[key]]):
            if kind["type"] == "number":
                assert read("0.3") == 0.3, key
            for word in kind.get("enum", [kind.get("const", "law.csv")]) if kind["type"] == "string" else ():
                assert read(word) == word, key


def test_nothing_is_overwritten(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scene.yaml").write_text("mine", encoding="utf-8")
    assert main(["new", "scene", "--output", "scene.yaml"]) == 2
    assert "a file that is not there yet" in capsys.readouterr().err
    assert Path("scene.yaml").read_text(encoding="utf-8") == "mine"
    assert main(["new", "grid"]) == 0
    assert "length: 0.6" in capsys.readouterr().out


def test_a_collapse_is_asked_for_by_a_file_or_by_options(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--length", "0.3", "--eta-b", "3780", "--height", "0.054", "--model", "rod"]
    assert main(["simulate", *options, "--output", "options.nc"]) == 0
    said = capsys.readouterr().out
    Path("scene.yaml").write_text("{length: 0.3, eta_b: 3780, height: 0.054, model: rod}", encoding="utf-8")
    assert main(["simulate", "scene.yaml", "--output", "options.nc"]) == 0
    assert capsys.readouterr().out == said
    for arguments, says in (
        (["scene.yaml", "--length", "0.3"], "length = 0.3 cannot be used; allowed: a scene, or options"),
        ([], "scene is missing; allowed: SCENE.yaml, or --length"),
        (options[:-4], "height is missing"),
    ):
        assert main(["simulate", *arguments]) == 2
        assert says in capsys.readouterr().err
