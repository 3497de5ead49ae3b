"""Helpers of the studies: datasets with units, timed calls and processes, cases on several cores."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import product
from time import perf_counter
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from stripfold.base.arrays import Array
from stripfold.base.errors import StripfoldError
from stripfold.files import schema
from stripfold.files.schema import Values, Variable
from stripfold.film.pictures import one_thread

C = TypeVar("C")
T = TypeVar("T")
Progress = Callable[[str], None]

LONGEST = 240
"""Seconds after which a case has failed, so that none holds up a study."""
NO_RESULT = "no_result"
"""Variable of a study over a grid: why a case has no numbers; empty where it has."""
ONE_CORE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def dataset(
    values: Values, attrs: Mapping[str, Any] | None = None, units: Mapping[str, str] | None = None
) -> xr.Dataset:
    """A dataset of a study; ``units``: the names of the variables with a unit, by unit, separated by spaces."""
    of = {name: unit for unit, names in (units or {}).items() for name in names.split()}
    known = {name: Variable(of.get(name, "1"), name.replace("_", " ")) for name in values}
    return schema.dataset(values, attrs, table=known)


def table(
    dim: str,
    rows: Sequence[Mapping[str, Any]],
    attrs: Mapping[str, Any] | None = None,
    units: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """A dataset of rows of numbers and texts along one dimension."""
    return dataset({name: (dim, [row[name] for row in rows]) for name in rows[0]}, attrs, units)


def markdown_table(header: Iterable[object], rows: Iterable[Iterable[object]]) -> str:
    """A table with these cells."""
    first, *others = ["| " + " | ".join(map(str, cells)) + " |\n" for cells in (header, *rows)]
    return "".join([first, "|---" * (first.count("|") - 1) + "|\n", *others])


def blank(*shape: int) -> Array:
    """An array of nan, to be filled."""
    return np.full(shape, np.nan)


def attempted(call: Callable[[], T]) -> tuple[T | None, str]:
    """The result of a call and an empty text, or None and its error, of any type: no case ends a whole study."""

    def late(*_: object) -> None:
        raise TimeoutError(f"no result in {LONGEST} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(LONGEST)
    try:
        return call(), ""
    except Exception as error:
        return None, f"{type(error).__name__}: {error}"
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@one_thread()  # OpenCV's threads do not survive a fork
def pooled(case: Callable[[C], T], of: Iterable[C], threads: int = 1, progress: Progress | None = None) -> list[T]:
    """``case`` of each, in order, on as many processes; ``case``, its argument and its result can be pickled."""
    if threads == 1:
        return list(_shown(map(case, of), progress))
    with ProcessPoolExecutor(threads) as pool:
        try:
            return list(_shown(pool.map(case, of), progress))
        except BaseException:
            # Otherwise all remaining cases would run before the error is seen.
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _shown(rows: Iterable[T], progress: Progress | None) -> Iterator[T]:
    for row in rows:
        if progress:
            progress(str(row))
        yield row


def grid(
    case: Callable[..., Mapping[str, float]],
    names: Sequence[str],
    axes: Mapping[str, Sequence[Any]],
    threads: int = 1,
    progress: Progress | None = None,
) -> dict[str, tuple[Any, Any]]:
    """``case(*values)`` for every combination of the values of ``axes``.

    Returns its numbers ``names`` over the axes, nan where it failed, and :data:`NO_RESULT`.
    """
    shape = [len(values) for values in axes.values()]
    rows = pooled(partial(_of_grid, case), list(product(*axes.values())), threads, progress)
    found: dict[str, tuple[Any, Any]] = {name: (name, values) for name, values in axes.items()}
    for name in names:
        found[name] = (tuple(axes), np.reshape([row.get(name, np.nan) for _, row, _ in rows], shape))
    return {**found, NO_RESULT: (tuple(axes), np.reshape([text for *_, text in rows], shape))}


def _of_grid(case: Callable[..., Mapping[str, float]], at: Sequence[Any]) -> tuple[Any, Mapping[str, float], str]:
    found, message = attempted(partial(case, *at))
    return at, found or {}, message


def timed(
    call: Callable[[], T], repeats: int, clock: Callable[[], float] = perf_counter, first: bool = True
) -> tuple[list[float], T]:
    """Seconds of ``repeats`` calls, and the result of the last; ``first``: after an uncounted one."""
    if first:
        call()
    seconds = []
    for _ in range(repeats):
        began = clock()
        result = call()
        seconds.append(clock() - began)
    return seconds, result


def timed_process(code: str, repeats: int = 1) -> tuple[list[float], list[str], float]:
    """Run Python code in processes of their own on one core, after an uncounted run where there are several.

    Returns the seconds and output of each counted run, and the largest peak memory, MB.  Raises StripfoldError: a
    process failed.
    """
    # Not from `getrusage`, whose peak includes that of the process that started it.
    told = f"import sys\n{code}\nprint(*(x for x in open('/proc/self/status') if x[:5] == 'VmHWM'), file=sys.stderr)"
    walls, outputs, peaks = [], [], []
    uncounted = 0 if repeats == 1 else 1
    for _ in range(uncounted + repeats):
        began = perf_counter()
        done = subprocess.run(
            [sys.executable, "-c", told], capture_output=True, text=True, check=False, env=os.environ | ONE_CORE
        )
        walls.append(perf_counter() - began)
        if done.returncode:
            said = " ".join(done.stderr.split("\n")[-3:]).strip()
            raise StripfoldError(f"the timed process failed: {said or 'no message'}")
        outputs.append(done.stdout)
        peaks.append(int(done.stderr.split()[-2]) * 1024 / 1e6)
    return walls[uncounted:], outputs[uncounted:], round(max(peaks), 1)


def processor_time() -> float:
    """Of all processes that were started and have ended, those that they started included, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def command(*words: str) -> str:
    """Python code that runs a command of the command line."""
    return f"from stripfold.cli import main\nif main({list(words)!r}): sys.exit('the command failed')"
