"""What holds for every name of docs/api.md: reachable as written, printed, copied, compared, sent between processes."""

from __future__ import annotations

import copy
import pickle
import re
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest

import stripfold as sf
from stripfold.ask.plan import Refusal
from stripfold.base.errors import TimeStepError
from stripfold.files.reporting import Result

PAGE = (Path(__file__).parents[1] / "docs" / "api.md").read_text(encoding="utf-8")
NAMES = [name for name in re.findall(r"^::: (\S+)", PAGE, re.MULTILINE) if name != "stripfold.paths"]
(MEMBERS,) = re.findall(r"members: \[(.*)\]", PAGE)
NAMES += [f"stripfold.paths.{name}" for name in MEMBERS.split(", ")]


def strip(eta_b: float) -> sf.Strip:
    return sf.Strip(length=0.36, eta_b=eta_b)


# Each made from an eta_b: the same one makes the same object, another one another.
MADE: dict[str, Callable[[float], Any]] = {
    "stripfold.Strip": strip,
    "stripfold.Release": lambda eta_b: sf.Release(air=1e-3 * eta_b),
    "stripfold.paths.FoldPath": lambda eta_b: sf.paths.r_path(strip(eta_b), fold_at=0.17),
    "stripfold.CriticalPoint": lambda eta_b: strip(eta_b).critical(
        0.06, model="rod", eta_b_uncertainty=0.1, second_gripper="auto"
    ),
    "stripfold.StripCollapse": lambda eta_b: strip(eta_b).collapse(0.06, model="rod", release={"until": "touch"}),
    "stripfold.PathAssessment": lambda eta_b: strip(eta_b).assess(
        sf.paths.circular(strip(eta_b)), model="rod", fall=True
    ),
    "stripfold.StabilityMap": lambda eta_b: sf.Strip(length=0.25, eta_b=eta_b).map(),
    "stripfold.FoldingPlan": lambda eta_b: sf.Strip(length=0.26, eta_b=eta_b).plan(eta_b_uncertainty=0.0, cores=1),
    "stripfold.Monitor": lambda eta_b: sf.Monitor(sf.Strip(length=0.25, eta_b=eta_b)),
    "stripfold.EtaB": lambda eta_b: sf.eta_b(bending_length=strip(eta_b).gravity_length),
    "stripfold.StripfoldError": lambda eta_b: sf.StripfoldError(f"{eta_b}"),
    "stripfold.InvalidInputError": lambda eta_b: sf.InvalidInputError("eta_b", eta_b, "another one", "give it"),
    "stripfold.MeasurementError": lambda eta_b: sf.MeasurementError("film.mkv", f"{eta_b}", "a strip"),
    "stripfold.NoPathError": lambda eta_b: sf.NoPathError(f"folds {eta_b}", (Refusal("r-path", "it snaps"),)),
    "stripfold.SolveError": lambda eta_b: TimeStepError("too small", last=strip(eta_b), parameter=1.0, step=0.1),
}
ELSEWHERE = {"stripfold.RecordingMeasurement"}
"""Made by the tests of recordings, which take longer."""


@cache
def made(name: str, eta_b: float = 3780.0) -> Any:
    return MADE[name](eta_b)


@pytest.mark.parametrize("module", ["", *sorted({name.split(".")[1] for name in NAMES if name.count(".") > 1})])
def test_every_name_is_reachable_as_written(module: str) -> None:
    """In a process of its own: an import of one module makes others reachable."""
    names = [name for name in NAMES if name.startswith(f"stripfold.{module}.") or (not module and name.count(".") == 1)]
    assert names
    code = (
        "import sys, stripfold\n"
        "print([name for name in sys.argv[1:] if not callable(eval(name)) or name.split('.')[1] not in dir(stripfold)])"
    )
    done = subprocess.run([sys.executable, "-c", code, *names], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_class_is_made_here() -> None:
    classes = {name for name in NAMES if isinstance(eval(name, {"stripfold": sf}), type)}
    assert classes == set(MADE) | ELSEWHERE
    for name in MADE:
        assert isinstance(made(name), eval(name, {"stripfold": sf}))


@pytest.mark.parametrize("name", MADE)
def test_shown_copied_and_compared(name: str) -> None:
    found = made(name)
    getattr(found, "eigenvalues", None)  # the copies of a map then have them too, and need no seconds to find them
    other = made(name, 3600.0)
    if not isinstance(found, Exception):
        assert len(repr(found)) < 200
    assert "\n" not in repr(found)
    for again in (pickle.loads(pickle.dumps(found)), copy.deepcopy(found)):
        assert type(again) is type(found)
        assert same(again, found)
        assert not same(again, other)
        if isinstance(found, Result):
            # The values of a result are many, and some are nan.
            with pytest.raises(TypeError, match="unhashable"):
                hash(again)
        elif not isinstance(found, Exception):
            assert hash(again) == hash(found)
    assert found != "another thing"


def same(one: Any, other: Any) -> bool:
    """Errors are equal to themselves only, as all of Python's."""
    if isinstance(one, Exception):
        return str(one) == str(other) and one.args == other.args and vars(one) == vars(other)
    return bool(one == other)


def through_a_process(found: Any) -> Any:
    return found


def fails(key: str) -> None:
    raise sf.InvalidInputError(key, 1.0, "another")


@pytest.mark.parametrize(
    "start", ["forkserver", *(pytest.param(way, marks=pytest.mark.slow) for way in ("fork", "spawn"))]
)
def test_sent_from_another_process(start: str) -> None:
    with ProcessPoolExecutor(1, get_context(start)) as pool:
        mine = [made(name) for name in MADE]
        for name, one, back in zip(MADE, mine, pool.map(through_a_process, mine), strict=True):
            assert same(back, one), name
        name = "stripfold.PathAssessment"
        assert pool.submit(made, name).result() == made(name)
        error = pool.submit(fails, "length").exception()
        assert isinstance(error, sf.InvalidInputError)
        assert error.key == "length"
