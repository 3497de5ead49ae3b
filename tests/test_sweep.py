"""A sweep: the same as single critical points, also after an interruption; what cannot be computed is never data."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

from stripfold import paths
from stripfold.ask import critical, sweep
from stripfold.ask.assess import assess
from stripfold.ask.inputs import PathInputs, PlanInputs, Scene, Strip
from stripfold.ask.plan import FoldingPlan, choose
from stripfold.ask.question import CRITICAL
from stripfold.base import processes
from stripfold.base.errors import InvalidInputError, StripfoldError
from stripfold.cli import main
from stripfold.files import store

STRIP = {"length": 0.6, "eta_b": 3780.0, "height": 0.09, "model": "elastica"}
HEIGHTS = STRIP | {"height": {"from": 0.03, "to": 0.12, "count": 40}}


def single(case: dict[str, object]) -> tuple[dict[str, float], str]:
    """What the command ``critical`` gives."""
    try:
        scene = Scene(**case)
        scene.require_long_enough()
        found = critical.find(scene)
    except StripfoldError as error:
        return dict.fromkeys(CRITICAL.numbers, np.nan), str(error)
    return {name: getattr(found, name) for name in CRITICAL.numbers}, found.reason


@pytest.fixture
def interrupted(tmp_path):
    """A file whose sweep over the heights was interrupted after its first chunk."""
    file = tmp_path / "sweep.nc"

    def interrupt(said):
        if said != "solved: 0 %":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep.run(HEIGHTS, file, cores=1, progress=interrupt)
    return file


def parts(file: Path) -> dict[str, int]:
    """Names and inodes of the parts."""
    return {part.name: part.stat().st_ino for part in file.with_name("sweep.nc.parts").glob("*.nc")}


def test_a_sweep_is_the_single_critical_points(tmp_path):
    """Snaps, touches, strips too short for their height, a gripper above the length, a strip too thick."""
    axes = {
        "model": ["rod", "elastica"],
        "length": [0.16, 0.6],
        "height": [0.2, 0.036, 0.09],
        "eta_m": [1e-3, 0.02],
    }
    file = tmp_path / "sweep.nc"
    found = sweep.run({**axes, "eta_b": 3780}, file, cores=2)
    assert found.lambda_c.dims == ("gripper_height", "length", "eta_m", "model")
    seen = set()
    for values in product(*axes.values()):
        at = dict(zip(axes, values, strict=True))
        numbers, reason = single({**at, "eta_b": 3780.0})
        here = found.sel({sweep.NAMES.get(key, key): value for key, value in at.items()})
        # The elastica's are interpolated.
        rounding = 1e-10 if at["model"] == "elastica" else 0.0
        near = pytest.approx(numbers, rel=rounding, abs=0, nan_ok=True)
        assert {name: float(here[name]) for name in CRITICAL.numbers} == near
        assert here.reason.item() == reason
        seen.add(reason.split(maxsplit=1)[0])
    assert seen == {"lambda", "the", "height", "length", "eta_m"}
    stored = store.read(file)
    xr.testing.assert_equal(stored, found)
    assert stored.lambda_c.units == stored.gripper_height.units == "m"
    assert (stored.attrs["eta_b"], stored.attrs["nu"]) == (3780.0, 0.0)
    assert os.listdir(tmp_path) == ["sweep.nc"]


ASSESSED = {"question": "assess", "length": [0.3], "eta_b": 3780.0, "model": "rod", "fall": True}


def test_a_sweep_of_paths_is_the_single_assessments(tmp_path):
    found = sweep.run(ASSESSED | {"path": ["triangular", "r-path"]}, tmp_path / "sweep.nc", cores=1)
    assert found.stable.dims == ("path", "length")
    for path, length in product(("triangular", "r-path"), ASSESSED["length"]):
        here, strip = found.sel(path=path, length=length), Strip(length=length, eta_b=3780.0)
        given = PathInputs(**strip.model_dump(), model="rod", fall=True)
        alone = assess(given, paths.PLANS[path](strip, None), compare=False)
        assert bool(here.stable) == alone.stable == (length == 0.3 and path == "triangular")
        for name in ("touch_x", "shape_error", "peak_force", "hold_friction"):
            assert float(here[name]) == getattr(alone, name)
        if not alone.stable:
            assert float(here.critical_z) == alone.critical[0]["z"]
            assert float(here.critical_drop) == alone.critical[0]["drop"] > 0.0
    assert store.read(tmp_path / "sweep.nc").attrs["fall"] == 1


@pytest.mark.slow
def test_a_sweep_of_plans_is_the_single_plans(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = {"length": 0.3, "eta_b": 3780.0, "eta_b_uncertainty": 0.0}
    given = asked | {"question": "plan", "goal": "quick", "length": [0.1, 0.3]}
    Path("grid.yaml").write_text(yaml.safe_dump(given), encoding="utf-8")
    assert main(["sweep", "grid.yaml", "--cores", "1"]) == 0
    said = capsys.readouterr().out
    assert "planned      1" in said
    assert "no result    1, the first: length = 0.1 cannot be used" in said
    found = store.read("grid.nc")
    best, here = choose(PlanInputs(**asked, goal="quick"))[0][0], found.sel(length=0.3)
    assert here.outcome_path.item() == best.name
    assert float(here.outcome_error) == best.error[1]
    assert float(here.outcome_duration) == best.duration


def test_samples_are_drawn_once_and_resumed_as_they_were(tmp_path):
    drawn = STRIP | {"height": {"from": 0.03, "to": 0.12}, "eta_b": [2000.0, 3780.0], "samples": 40, "seed": 3}

    def interrupt(said):
        if said != "solved: 0 %":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep.run(drawn, tmp_path / "sweep.nc", cores=1, progress=interrupt)
    found = sweep.run(drawn, tmp_path / "sweep.nc", cores=1)
    whole = sweep.run(drawn, tmp_path / "whole.nc", cores=1)
    assert (tmp_path / "sweep.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()
    other = sweep.run(drawn | {"seed": 4}, tmp_path / "other.nc", cores=1)
    assert found.lambda_c.dims == found.gripper_height.dims == ("sample",)
    assert (whole.gripper_height != other.gripper_height).all()
    height = found.gripper_height.values
    assert 0.03 <= height.min() < 0.05
    assert 0.1 < height.max() <= 0.12
    assert len(np.unique(height)) == 40
    assert set(found.eta_b.values) == {2000.0, 3780.0}
    at = {"height": float(height[7]), "eta_b": float(found.eta_b[7])}
    lambda_c = critical.find(Scene(**STRIP | at)).lambda_c
    assert float(found.lambda_c[7]) == pytest.approx(lambda_c, rel=1e-10, nan_ok=True)


def test_an_interrupted_sweep_goes_on_and_gives_the_same_file(tmp_path, interrupted):
    before, told = parts(interrupted), []
    assert 1 <= len(before) < len(sweep.Grid.of(HEIGHTS).chunks) == 20
    # Left by a process that was killed while it wrote.
    interrupted.with_name("sweep.nc.parts").joinpath(".stripfold-left").mkdir()
    kept = {}

    def say(text):
        told.append(text)
        kept.update(parts(interrupted))

    sweep.run(HEIGHTS, interrupted, cores=2, progress=say)
    assert kept.items() >= before.items()
    assert told[0] == f"solved: {5 * len(before)} %"
    assert told[-1] == "solved: 100 %"
    sweep.run(HEIGHTS, tmp_path / "whole.nc", cores=1)
    assert interrupted.read_bytes() == (tmp_path / "whole.nc").read_bytes()
    assert sorted(os.listdir(tmp_path)) == ["sweep.nc", "whole.nc"]


def test_parts_of_another_sweep_are_refused_and_left(interrupted):
    before = parts(interrupted)
    with pytest.raises(InvalidInputError, match=r"output.*without the parts of another sweep.*remove") as error:
        sweep.run(HEIGHTS | {"eta_b": 3000.0}, interrupted)
    assert str(interrupted) in str(error.value)
    assert parts(interrupted) == before


def workers(process: int) -> set[int]:
    """The processes that solve for a sweep: its children, but git."""
    found = map(int, Path(f"/proc/{process}/task/{process}/children").read_text().split())
    return {child for child in found if b"stripfold.base.processes" in Path(f"/proc/{child}/cmdline").read_bytes()}


several = pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core: one process")


@several
def test_a_killed_process_is_named_and_the_sweep_goes_on(tmp_path):
    def kill(_):
        for child in workers(os.getpid()):
            os.kill(child, signal.SIGKILL)

    with pytest.raises(StripfoldError, match=r"ended by SIGKILL.*run it again"):
        sweep.run(HEIGHTS, tmp_path / "sweep.nc", cores=2, progress=kill)
    assert parts(tmp_path / "sweep.nc")
    assert sweep.run(HEIGHTS, tmp_path / "sweep.nc", cores=1).free_length.notnull().all()


SCRIPT = """
import multiprocessing, sys
from stripfold import sweep
def two(cores):
    grid = {"length": 0.6, "eta_b": 3780, "height": [0.06, 0.09], "model": "elastica"}
    return sweep.run(grid, f"{cores}.nc", cores).sizes["gripper_height"]
"""


UNGUARDED = "multiprocessing.set_start_method(sys.argv[1])\nassert two(2) == two(1) == 2"
IN_A_POOL = """
if __name__ == "__main__":
    pool = multiprocessing.get_context(sys.argv[1]).Pool(1)
    assert pool.map(two, [1, 2]) == [2, 2]
"""


@pytest.mark.parametrize(
    ("method", "use"),
    [
        ("forkserver", UNGUARDED),
        pytest.param("spawn", UNGUARDED, marks=pytest.mark.slow),
        pytest.param("fork", IN_A_POOL, marks=pytest.mark.slow),
    ],
    ids=lambda given: given[:10].strip(),
)
def test_programs_start_sweeps_as_they_like(tmp_path, method, use):
    (tmp_path / "program.py").write_text(SCRIPT + use)
    done = subprocess.run(
        [sys.executable, "program.py", method], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_damaged_parts_are_redone_and_the_users_files_kept(interrupted):
    folder = interrupted.with_name("sweep.nc.parts")
    (part,) = folder.glob("*.nc")
    part.write_bytes(part.read_bytes()[:-100])
    for name in ("notes.txt", "mine.nc"):
        (folder / name).write_text("mine")
    found = sweep.run(HEIGHTS, interrupted, cores=1)
    assert found.free_length.notnull().all()
    assert sorted(os.listdir(folder)) == ["mine.nc", "notes.txt"]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"hight": [0.08, 0.09]}, r"hight = 0.08 .* did you mean height"),
        ({"eta_b": []}, r"eta_b = \[\] .* a list of values, or from, to and count"),
        ({"nu": [0.1, 0.6]}, r"nu = 0.6 .* from 0 to 0.49"),
        ({"nu": [0, 0.0]}, r"nu = \[0, 0.0\] .* no two are alike"),
        ({"model": ["rod", "rods"]}, r"model = 'rods' .* one of solid, rod, elastica, auto"),
        ({"height": {"from": 0.05, "to": 0.1}}, r"height.count is missing; allowed: a whole number from 2"),
        ({"height": {"from": 0.05, "to": 0.1, "cuont": 3}}, r"height.cuont = 3 .* did you mean count"),
        (
            {"height": {"from": 0.05, "to": 0.1, "count": 150_000}, "nu": [0.0, 0.1]},
            r"'300000 cases' .* at most 200000",
        ),
        ({"height": {"from": -1.7e308, "to": 1.7e308, "count": 3}}, r"height.from = -1.7e\+308 .* from 0 to 1e\+09"),
        ({"height": {"from": 0.05, "to": 0.1, "count": 3}, "samples": 9}, r"height.count = 3 .* no count"),
        ({"question": "map"}, r"question = 'map' .* one of critical, assess, plan"),
        ({"question": ["plan"]}, r"question = \['plan'\] .* one of critical, assess, plan"),
        ({"question": "plan"}, r"height = 0.09 .* only the keys goal, length"),
        ({"seed": 1}, r"samples is missing"),
        ({"height": [90, 120]}, r"height = 90.0 .* less than the length, 0.6 m"),
    ],
)
def test_bad_grids(capsys, tmp_path, given, message):
    grid = tmp_path / "grid.yaml"
    grid.write_text(yaml.safe_dump(STRIP | given), encoding="utf-8")
    with pytest.raises(InvalidInputError, match=message):
        sweep.Grid.of(STRIP | given)
    assert main(["sweep", str(grid), "--output", str(tmp_path / "sweep.nc")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert os.listdir(tmp_path) == ["grid.yaml"]


def test_command(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("grid.yaml").write_text(yaml.safe_dump(STRIP | {"height": [0.03, 0.09, 0.12, 0.7]}), encoding="utf-8")
    assert main(["sweep", "grid.yaml", "--cores", "0"]) == 2
    assert "cores = 0 cannot be used" in capsys.readouterr().err
    assert main(["sweep", "grid.yaml", "--cores", "2"]) == 0
    rows = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert (rows["cases"], rows["snap"], rows["touch"], rows["written"]) == ("4", "2", "1", "grid.nc")
    assert rows["no"].startswith("result    1, the first: height = 0.7 cannot be used")


class TestProcesses:
    @pytest.mark.parametrize("count", [1, 2, 3])
    def test_answers_are_those_of_one_process_in_order(self, count: int) -> None:
        shares: list[float] = []
        assert processes.in_order(math.sqrt, range(40), count, shares.append) == [math.sqrt(i) for i in range(40)]
        assert shares == sorted(shares)
        assert processes.in_order(math.sqrt, [], count, shares.append) == []

    @pytest.mark.parametrize("count", [1, 2])
    def test_an_error_anywhere_is_the_error(self, count: int) -> None:
        with pytest.raises(ValueError, match="math domain error"):
            processes.in_order(math.sqrt, [4.0, -1.0, *range(20)], count, lambda _: None)

    def test_one_that_is_ended_is_named(self) -> None:
        with pytest.raises(StripfoldError, match="a process was ended with exit code 3: run it again"):
            list(processes.elsewhere(os._exit, [3], 1))

    def test_a_plan_is_the_same_by_several(self) -> None:
        strip = Strip(length=0.26, eta_b=3780.0)
        one, two = (
            FoldingPlan.of(PlanInputs(**strip.model_dump(), eta_b_uncertainty=0.0), cores=cores) for cores in (1, 2)
        )
        assert one.as_text() == two.as_text()
        assert [outcome.to_dict() for outcome in one.outcomes] == [outcome.to_dict() for outcome in two.outcomes]
        with pytest.raises(InvalidInputError, match=r"cores = 1\.5 "):
            FoldingPlan.of(PlanInputs(**strip.model_dump()), cores=1.5)
