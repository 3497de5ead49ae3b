"""The studies' helpers: datasets, timed calls and processes, cases on several cores."""

from __future__ import annotations

import pytest

from stripfold.errors import StripfoldError
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
