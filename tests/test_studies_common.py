"""The studies' helpers: datasets, timed calls and processes, cases on several cores."""

from __future__ import annotations

from time import sleep

import cv2
import numpy as np
import pytest

from stripfold.base.errors import StripfoldError
from studies import common


def test_a_dataset_has_the_units_of_its_study() -> None:
    data = common.table("branches", "case", [{"case": 3, "eta_b": 100.0, "end": "snap"}], {"seed": 5})
    assert data["eta_b"].attrs["units"] == "m-4 s2"
    assert data.sel(case=3)["end"].item() == "snap"
    assert data.attrs["seed"] == 5
    with pytest.raises(StripfoldError, match="nonsense"):
        common.dataset("branches", {"nonsense": ((), 1.0)})


def test_calls_are_timed_after_one_that_is_not() -> None:
    clock = iter([10.0, 11.0, 20.0, 23.0])
    calls = iter(range(9))
    assert common.timed(lambda: next(calls), 2, lambda: next(clock)) == ([1.0, 3.0], 2)


def test_time_and_memory_of_a_process() -> None:
    """A hundred megabytes are seen; a process that fails is reported."""
    _, _, least = common.timed_process("import numpy")
    seconds, printed, peak = common.timed_process("import numpy\nnumpy.ones(12_500_000)\nprint(7)", 2)
    assert peak == pytest.approx(least + 100.0, abs=10.0)
    assert printed == ["7\n", "7\n"]
    assert len(seconds) == 2
    for code, message in (("1 / 0", "ZeroDivisionError"), (common.command("nonsense"), "nonsense")):
        with pytest.raises(StripfoldError, match=message):
            common.timed_process(code)


def square(number: int) -> int:
    if number == 7:
        raise ValueError("seven")
    return number**2


@pytest.mark.parametrize("threads", [1, 2])
def test_cases_on_several_cores_keep_their_order_and_their_errors(threads: int) -> None:
    shown: list[str] = []
    assert common.pooled(square, range(5), threads, shown.append) == [0, 1, 4, 9, 16]
    assert shown == ["0", "1", "4", "9", "16"]
    with pytest.raises(ValueError, match="seven"):
        common.pooled(square, range(20), threads)


def opencv_threads(_: int) -> int:
    return cv2.getNumThreads()


def test_opencv_has_one_thread_in_the_processes_of_a_study() -> None:
    """Its threads do not survive a fork: a process that asks for another number of them then waits for ever."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(2)
    try:
        assert common.pooled(opencv_threads, range(4), 2) == [1, 1, 1, 1]
        assert cv2.getNumThreads() == 2
    finally:
        cv2.setNumThreads(before)


def area(height: float, width: int) -> dict[str, float]:
    if width == 2:
        raise ZeroDivisionError("planted")
    return {"thickness": height * width}


@pytest.mark.parametrize("threads", [1, 2])
def test_a_failed_case_of_a_grid_has_its_error_and_no_number(threads: int) -> None:
    values = common.grid(area, ["thickness"], {"height": [3.0, 5.0], "steps": [1, 2, 4]}, threads)
    dims, found = values["thickness"]
    assert dims == ("height", "steps")
    np.testing.assert_array_equal(found, [[3.0, np.nan, 12.0], [5.0, np.nan, 20.0]])
    assert values["no_result"][1].tolist() == [["", "ZeroDivisionError: planted", ""]] * 2


def test_a_case_that_takes_too_long_has_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(common, "LONGEST", 1)
    found, message = common.attempted(lambda: sleep(5.0))
    assert found is None
    assert message == "TimeoutError: no result in 1 s"
    assert common.attempted(lambda: 7) == (7, "")
