"""Other programs beside ours: what they answer, how it is judged, what is quoted and drawn of it."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import xarray as xr

from plots import peers as plot
from stripfold import elastica
from stripfold.files import store
from stripfold.follow.static import StripModel
from studies import peers, peers_ours
from studies.peers import COUNTERPARTS, CRITICAL, EQUILIBRIUM, table
from studies.summary import facts_paths

FOLDER = Path(__file__).parents[1] / "workflow" / "peers"
SCENE = {"length": 12.0, "thickness": 0.05, "height": 3.0, "lam": 8.0, "repeats": 1}

# What AUTO writes, shortened: its head, an ordinary point, the one that was asked for, a limit point.
BRANCH = """\
   0  -1.7976+308  1.7976+308 -1.7976+308  1.7976+308
   0   NTST=  40   NCOL=   4   IAD=   3   ISP =   0
   0
   0    PT  TY  LAB    PAR(1)             L2-NORM            MAX U(1)           PAR(2)             PAR(3)
   1     1   9    1  2.1631393724E+000  3.0000000000E+000  2.0412331386E+000  4.2043725109E+000  0.0000000000E+000
   1     5   0    0  2.4024523230E+000  3.3811322677E+000  1.7319176871E+000  4.0829598714E+000 -2.6249213403E-001
   1    42  -4    2  8.0000001564E+000  4.5011941070E+000  8.3591829032E-001  5.5074366463E+000 -7.3036589264E-001
   1    59   5    3  9.8569077226E+000  5.3964171871E+000  7.2968089001E-001  7.1330766483E+000  1.6796003374E-001
"""
SOLUTIONS = """\
     1     1     9     1     4     1     2     4     5   1    1    5    0    5    4    0
      0.0000000000E+000  0.0000000000E+000  0.0000000000E+000  0.0000000000E+000
      1.0000000000E+000  2.0412331386E+000  3.0000000000E+000  1.5314953341E+000
    1    2    3    4
      4.6869016915E-001 -2.9574194203E-001 -6.0480743452E-001 -3.1175125660E-001
      4.2043725109E+000
     1    42    -4     2     4     1     3     4     4   1    1    5    0    5    4    0
      0.0000000000E+000  0.0000000000E+000  0.0000000000E+000  0.0000000000E+000
      5.0000000000E-001  1.0000000000E+000  0.5000000000E+000  0.5000000000E+000
      1.0000000000E+000 -2.4925633537E+000  3.0000000000E+000  2.5000000000E+000
    1    2    3    4
"""


@pytest.fixture(scope="module")
def auto() -> ModuleType:
    """The script that runs AUTO-07p; it stands outside the package."""
    sys.path.insert(0, str(FOLDER))
    try:
        spec = importlib.util.spec_from_file_location("auto_strip", FOLDER / "auto_strip.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(FOLDER))
    return module


def test_autos_points_are_read(auto: ModuleType) -> None:
    found = auto.points(BRANCH)
    assert [(kind, label) for kind, label, _ in found] == [(9, 1), (-4, 2), (5, 3)]
    label, values = auto.first(BRANCH, auto.LIMIT_POINT, "limit point")
    assert (label, values[0]) == (3, 9.8569077226)
    assert auto.first(BRANCH, auto.ASKED_FOR, "point")[1][-2] == 5.5074366463
    with pytest.raises(RuntimeError, match="no branch point was found"):
        auto.first(BRANCH, 1, "branch point")


def test_autos_solutions_are_read(auto: ModuleType) -> None:
    assert auto.solution(SOLUTIONS, 1)[-1] == [1.0, 2.0412331386, 3.0, 1.5314953341]
    assert [row[0] for row in auto.solution(SOLUTIONS, 2)] == [0.0, 0.5, 1.0]
    with pytest.raises(RuntimeError, match="label 3"):
        auto.solution(SOLUTIONS, 3)


def test_our_models_agree_on_the_equilibrium() -> None:
    s, place = peers_ours.elastica_equilibrium(12.0, 3.0, 8.0)
    np.testing.assert_allclose(place[0], [8.0, 3.0], atol=1e-9)
    np.testing.assert_allclose(place[-1], [12.0, 0.0], atol=1e-12)
    # It does not stretch, and so does its spline.
    length = np.linalg.norm(np.diff(place, axis=0), axis=1).sum()
    assert length == pytest.approx(12.0, abs=1e-4)
    thin = peers_ours.model_equilibrium(StripModel(12.0, 0.01, kind="rod"), 3.0, 8.0, 1.0)
    apart = thin[1] - np.stack([np.interp(thin[0], s, axis) for axis in place.T], axis=1)
    assert np.linalg.norm(apart, axis=1).max() < 2e-3


def test_start_is_in_equilibrium() -> None:
    start = peers._start(3.0)
    advance, length, force_x, force_0, height = start["parameters"]
    rows = np.array(start["rows"])
    assert (force_x, height) == (0.0, 3.0)
    assert advance == pytest.approx(elastica.state_no_horizontal_force(3.0).advance)
    _, x, z, theta, curvature, s = rows.T
    assert (s[-1], z[-1]) == pytest.approx((length, 3.0))
    assert advance == pytest.approx(length - x[-1])
    # The equations that AUTO is given, by differences.
    middle = 0.5 * (s[1:] + s[:-1])
    for given, rate in ((x, np.cos(theta)), (z, np.sin(theta)), (theta, curvature)):
        np.testing.assert_allclose(np.diff(given) / np.diff(s), 0.5 * (rate[1:] + rate[:-1]), atol=1e-3)
    angle = 0.5 * (theta[1:] + theta[:-1])
    np.testing.assert_allclose(np.diff(curvature) / np.diff(s), -(force_0 + middle) * np.cos(angle), atol=1e-3)


def answered() -> xr.Dataset:
    """Everyone reaches 1e-3 but felupe; PyElastica is not there, one run of AUTO failed."""
    rows = []
    for program, question, seconds, error in (
        ("solid", EQUILIBRIUM, 0.5, 8e-4),
        ("solid", EQUILIBRIUM, 2.0, 5e-5),
        ("rod", EQUILIBRIUM, 0.1, 9e-4),
        ("elastica", EQUILIBRIUM, 0.2, 1e-9),
        ("elastica", CRITICAL, 0.05, 1e-9),
        ("felupe", EQUILIBRIUM, 0.25, 2e-2),
        ("felupe", EQUILIBRIUM, 1.0, 3e-3),
        ("mujoco", EQUILIBRIUM, 0.3, 5e-3),
        ("mujoco", EQUILIBRIUM, 2.0, 6e-4),
        ("mujoco", EQUILIBRIUM, 4.0, 9e-4),
        ("auto", EQUILIBRIUM, 0.1, 1e-7),
        ("auto", CRITICAL, 0.01, 1e-4),
        ("auto", CRITICAL, np.nan, np.nan),
    ):
        failed = "RuntimeError: no limit point was found" if np.isnan(error) else ""
        row = {"program": program, "question": question, "setting": "n 3", "seconds": seconds}
        rows.append({**row, "error": error, "failed": failed})
    programs = {name: {"model": name, "version": "", EQUILIBRIUM: "", CRITICAL: ""} for name in ("solid", "rod")}
    programs["elastica"] = dict(programs["rod"], model="elastica")
    for name, ours in COUNTERPARTS.items():
        programs[name] = {"model": ours, "version": "1.0", EQUILIBRIUM: "", CRITICAL: "finds none"}
    programs["pyelastica"][EQUILIBRIUM] = "not installed"
    programs["auto"][CRITICAL] = ""
    return peers.collected(rows, programs, SCENE)


def test_times_to_a_tolerance_and_ratios(tmp_path: Path) -> None:
    store.write(answered(), tmp_path / "peers.nc", title="peers", config={})
    data = store.read(tmp_path / "peers.nc")
    times = data["time"].sel(question=EQUILIBRIUM)
    # The fastest that is good enough, not the last one.
    np.testing.assert_array_equal(times.sel(program="mujoco"), [0.3, 2.0, np.nan])
    np.testing.assert_array_equal(times.sel(program="solid"), [0.5, 0.5, 2.0])
    found = {one["key"]: one for one in facts_paths.peers(data)}
    assert {key: (pytest.approx(one["ratio"]), one["both"]) for key, one in found.items()} == {
        "felupe": (2.0, False),
        "mujoco": (20.0, True),
        "auto": (0.5, True),
        "auto_critical": (0.2, True),
    }
    assert "it reached 3e-03 only" in found["felupe"]["note"]


def test_table_says_why() -> None:
    text = table(answered())
    assert "| MuJoCo | 1.0 | rod | 0.3 s | 2 s | - | - | - | - |" in text
    assert "| **elastica**, ours | this one | elastica | 0.2 s | 0.2 s | 0.2 s | 0.05 s | 0.05 s | 0.05 s |" in text
    assert "* PyElastica, equilibrium: not installed." in text
    assert "* AUTO-07p, critical, n 3: RuntimeError: no limit point was found." in text


def test_figure_has_a_line_for_everyone_who_answered() -> None:
    fig = plot.draw(answered())
    for ax, names in zip(
        fig.axes, ({"solid", "rod", "elastica", "felupe", "mujoco", "auto"}, {"elastica", "auto"}), strict=True
    ):
        drawn = [line for line in ax.get_lines() if len(line.get_xdata())]
        assert len(drawn) == len(names)
        bold = [line for line in drawn if line.get_linewidth() > 2.0]
        assert len(bold) == len(names & {"solid", "rod", "elastica"})


def test_a_program_that_is_missing_or_fails_is_reported(tmp_path: Path) -> None:
    said, answer = peers._ask("felupe", dict(SCENE), tmp_path)
    assert "not installed" in said
    assert answer["runs"] == []
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    python = tmp_path / ".venv" / "bin" / "python"
    # A link would lose the environment where Python is the system's.
    python.write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
    python.chmod(0o755)
    (tmp_path / "felupe_strip.py").write_text("raise ImportError('no felupe here')\n")
    said, answer = peers._ask("felupe", dict(SCENE), tmp_path)
    assert said == "ended with an error: ImportError: no felupe here"
    how = {EQUILIBRIUM: [{}], CRITICAL: "finds none"}
    assert peers._reasons(how, said) == {EQUILIBRIUM: said, CRITICAL: "finds none"}


def test_a_scripts_answer_is_judged(tmp_path: Path) -> None:
    """A peer that knows the truth but for 1e-3 up, has one failing setting, and one lambda_c."""
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    python = tmp_path / ".venv" / "bin" / "python"
    # A link would lose the environment where Python is the system's.
    python.write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
    python.chmod(0o755)
    (tmp_path / "_answer.py").write_text((FOLDER / "_answer.py").read_text())
    (tmp_path / "felupe_strip.py").write_text(
        "from _answer import answer\n"
        "def equilibrium(scene, elements):\n"
        "    if elements == 1:\n"
        "        raise RuntimeError('too coarse')\n"
        "    return {'s': [0.0, 1.0], 'place': [[0.0, 1e-3], [1.0, 0.0]]}\n"
        "answer('numpy', {'equilibrium': equilibrium, 'critical': lambda scene: {'lambda_c': 9.5}})\n"
    )
    questions = {EQUILIBRIUM: [{"elements": 1}, {"elements": 2}], CRITICAL: [{}]}
    said, answer = peers._ask("felupe", {**SCENE, "questions": questions}, tmp_path)
    assert (said, answer["version"]) == ("", np.__version__)
    truth = {"solid": (lambda s: np.stack([s, 0.0 * s], axis=1), 10.0)}
    failed, found, critical = peers._judged("felupe", "solid", answer["runs"], truth)
    assert failed["failed"] == "RuntimeError: too coarse"
    assert np.isnan(failed["error"])
    assert (found["error"], found["setting"]) == (1e-3, "elements 2")
    assert 0.0 <= found["seconds"] < 1.0
    assert critical["error"] == 0.5
