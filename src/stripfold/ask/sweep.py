"""A question asked of a grid of strips on all cores, in one file; an interrupted sweep goes on where it stopped."""

from __future__ import annotations

import json
import logging
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from math import ceil, prod
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import Field

from stripfold.ask.question import QUESTIONS, Question
from stripfold.base import processes
from stripfold.base.arguments import checked, file_name
from stripfold.base.errors import MISSING, InvalidInputError
from stripfold.base.progress import Percent
from stripfold.base.validation import Input, Number, Whole, quantity, with_text_keys, within
from stripfold.base.version import running_commit, version
from stripfold.files import schema, store
from stripfold.files.reporting import Progress

if TYPE_CHECKING:
    import xarray as xr

NAMES = {"height": "gripper_height", "gripper": "grip", "table_friction": "table_mu", "layer_friction": "layer_mu"}
"""Names of keys in the dataset, where they are others: CF reserves ``height``, and some have another sense there."""
LARGEST = 1e9
"""Largest end of a range: the limits of no key are wider."""
MOST_CASES = 200_000
"""Most cases of a grid: on the solid a night's work, and with a text for each 100 MB in memory."""
CHUNKS = 32
"""Chunks of a small grid or of one of the elastica, at most: enough to keep the cores equally busy."""
LOCK = "in_use"
"""File in the folder of parts that whoever writes there has locked; the system unlocks it when a process ends."""

Job = tuple[range, Path]
"""A chunk, and the file of its results."""
logger = logging.getLogger("stripfold")


class Range(Input):
    """Numbers at equal distances, both ends included, or of samples any between them."""

    start: Annotated[Number, quantity("the first", ge=0.0, le=LARGEST), Field(alias="from")]
    to: Annotated[Number, quantity("the last", ge=0.0, le=LARGEST)]
    count: Annotated[Whole | None, Field(description="how many", ge=2, le=MOST_CASES)] = None


class Samples(Input):
    """How many cases are drawn: each key by itself, evenly from its range or its list."""

    samples: Annotated[Whole, Field(description="how many cases are drawn", ge=2, le=MOST_CASES)]
    seed: Annotated[Whole, Field(description="of the random numbers", ge=0)] = 0


@dataclass(frozen=True)
class Grid:
    """Values of all keys, and the keys for which a list or a range is given, in the order of the question's; SI.

    The cases are all combinations or, where they are ``drawn``, each place of the lists; ``given``: from what.
    """

    question: Question
    values: dict[str, list[Any]]
    listed: tuple[str, ...]
    drawn: Samples | None = None
    given: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Self:
        """A grid from numbers, lists of them and ranges.

        Raises InvalidInputError: a key or value that cannot be used, or no case with values that go together.
        """
        if not isinstance(given, Mapping):
            raise InvalidInputError("grid", given, "keys and values")
        question, drawn = question_of(given), None
        keys = {str(key): value for key, value in given.items() if key != "question"}
        if draw := {key: keys.pop(key) for key in Samples.model_fields if key in keys}:
            drawn = Samples(**draw)
        axes = {key: _values(key, value, drawn) for key, value in keys.items()}
        each, first = question.each, {key: values[0] for key, values in axes.items()}
        checked_values = {key: [value] for key, value in each.of(first)}
        if drawn is None and (count := prod(len(values) for values in axes.values())) > MOST_CASES:
            raise InvalidInputError("grid", f"{count} cases", f"at most {MOST_CASES} cases", "split the grid")
        for key, values in axes.items():
            checked_values[key] = [getattr(each.of(first | {key: value}), key) for value in values]
        listed = tuple(key for key in question.keys if isinstance(keys.get(key), list | tuple | Mapping))
        if drawn is not None:
            random = np.random.default_rng(drawn.seed)
            for key in listed:
                checked_values[key] = _drawn(checked_values[key], isinstance(keys[key], Mapping), drawn, random)
        for key in listed:
            if drawn is None and len(set(checked_values[key])) < len(checked_values[key]):
                raise InvalidInputError(key, keys[key], "values of which no two are alike")
        whole, refused = {key: checked_values[key] for key in question.keys}, None
        grid = cls(question, whole, listed, drawn, keys)
        for number in range(grid.count):
            try:
                question.inputs(**grid.case(number))
            except InvalidInputError as error:
                refused = refused or error
            else:
                return grid
        # No case is possible, as with a wrong unit.
        assert refused is not None
        raise refused

    @property
    def shape(self) -> tuple[int, ...]:
        """Numbers of values of the listed keys, or of samples."""
        return (self.drawn.samples,) if self.drawn else tuple(len(self.values[key]) for key in self.listed)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the dimensions in the dataset."""
        return ("sample",) if self.drawn else tuple(NAMES.get(key, key) for key in self.listed)

    @property
    def count(self) -> int:
        """Number of cases."""
        return prod(self.shape)

    @property
    def chunks(self) -> list[range]:
        """The numbers of the cases, in chunks."""
        size = ceil(self.count / CHUNKS)
        if self.values.get("model") != ["elastica"]:
            size = min(size, self.question.chunk)
        return [range(first, min(first + size, self.count)) for first in range(0, self.count, size)]

    def case(self, number: int) -> dict[str, Any]:
        """Keys and values of a case."""
        places: dict[str, Any] = dict.fromkeys(self.listed, number)
        if self.drawn is None:
            places = dict(zip(self.listed, np.unravel_index(number, self.shape), strict=True))
        return {key: values[places.get(key, 0)] for key, values in self.values.items()}

    def config(self) -> dict[str, Any]:
        """The resolved keys and values, as they could be given."""
        said = {key: values if key in self.listed else values[0] for key, values in self.values.items()}
        if self.drawn:
            said |= {key: with_text_keys(self.given[key]) for key in self.listed} | self.drawn.model_dump()
        return said | ({} if self.question.name == "critical" else {"question": self.question.name})


def question_of(given: Mapping[str, Any]) -> Question:
    """The question of a grid, by default that for critical points; raises InvalidInputError: there is no such one."""
    name = given.get("question", "critical")
    if not isinstance(name, str) or name not in QUESTIONS:
        raise InvalidInputError("question", name, f"one of {', '.join(QUESTIONS)}")
    return QUESTIONS[name]


@checked
def run(
    given: Mapping[str, Any], file: str | os.PathLike[str], cores: int | None = None, progress: Progress | None = None
) -> xr.Dataset:
    """Ask a question of all combinations of values, or of samples, and store what is found in one netCDF file.

    What is done stands in the folder ``file`` + ".parts" until the file is whole: the same call goes on from there.

    Parameters
    ----------
    given
        ``question``: "critical", which it is if left out, "assess" or "plan".  For each of its keys
        (:mod:`.question`) a value, a list of values, or ``{"from": ..., "to": ..., "count": ...}``; those that are
        left out have the defaults of the question.  With ``samples`` as many cases are drawn with the random numbers
        of ``seed``, each key evenly from its list or its range, which then has no count.
    file
        Where to write.
    cores
        Most processes at a time, by default one for each core that may be used, which are also the most; one process
        is the calling one.
    progress
        Called with a line on how much is done.

    Returns
    -------
    What is found over the keys with several values, named as in :data:`NAMES`, or over ``sample``; nan where a case is
    refused or fails, with the error as its ``reason``.

    Raises
    ------
    InvalidInputError
        A key or value that cannot be used, the parts of another sweep stand beside the file, or another process is at
        work on them.
    StripfoldError
        A process of the sweep was ended from outside.
    """
    grid, file = Grid.of(given), file_name("file", file)
    most = processes.most(cores)
    with owned(file):
        parts = chunk_files(grid, file)
        try:
            left = [(chunk, part) for part, chunk in parts.items() if not _is_whole(grid, part)]
            solved, finished = Percent(progress, "solved"), grid.count - sum(len(chunk) for chunk, _ in left)
            solved(finished / grid.count)
            work = partial(_solved, grid)
            for chunk in map(work, left) if min(most, len(left)) < 2 else processes.elsewhere(work, left, most):
                finished += len(chunk)
                solved(finished / grid.count)
            found = _gathered(grid, parts)
            store.write(found, file, title=f"{grid.question.name}: a sweep over strips", config=grid.config())
            for part in parts:
                part.unlink()
        finally:
            for half_written in _folder(file).glob(".stripfold-*"):  # of a process that was ended
                shutil.rmtree(half_written, ignore_errors=True)
    return found


def _folder(file: Path) -> Path:
    """The folder of the parts of a sweep into ``file``."""
    return file.with_name(f"{file.name}.parts")


@contextmanager
def owned(file: Path, shared: bool = False) -> Iterator[None]:
    """Keep other processes from working on the parts of a sweep into ``file``; ``shared``: but for other shared ones.

    Raises InvalidInputError: one of them does so.
    """
    import fcntl  # not on Windows

    folder = _folder(file)
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / LOCK, "a") as lock:
        try:
            fcntl.flock(lock, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
            os.stat(folder / LOCK)
        except (BlockingIOError, FileNotFoundError):  # the latter: its owner has just ended and removed it
            allowed, advice = "a file that no other sweep is writing", "wait for its end, or give another output"
            raise InvalidInputError("output", str(file), allowed, advice) from None
        except OSError as error:  # a file system without locks
            logger.info(f"{folder} cannot be locked ({error.strerror}): start no other sweep into {file}")
        try:
            yield
        finally:
            if not shared:
                (folder / LOCK).unlink(missing_ok=True)
                with suppress(OSError):  # what is left of the parts, or of somebody else
                    folder.rmdir()


def chunk_files(grid: Grid, file: Path) -> dict[Path, range]:
    """The files of the chunks of a sweep into ``file``, and the numbers of the cases in each.

    Raises InvalidInputError: the parts of another sweep stand beside the file.
    """
    folder = _folder(file)
    # Parts of another version are of another sweep: one file has one origin.
    origin = [grid.config(), grid.question.chunk, CHUNKS, version(), running_commit()]
    digest = sha256(json.dumps(origin).encode()).hexdigest()[:16]
    parts = {folder / f"{digest}-{number:05d}.nc": chunk for number, chunk in enumerate(grid.chunks)}
    if any(part not in parts for part in folder.glob("*.nc") if re.fullmatch(r"[0-9a-f]{16}-\d{5}", part.stem)):
        advice = f"give another output, or remove its parts from {folder}"
        raise InvalidInputError("output", str(file), "a file without the parts of another sweep beside it", advice)
    return parts


def _values(key: str, given: Any, drawn: Samples | None) -> list[Any]:
    """The values of a key; of a range of which samples are drawn both ends."""
    if isinstance(given, Mapping):
        with within(key):
            asked = Range.of(given)
            if (asked.count is None) is (drawn is None):
                how, advice = f"a whole number from 2 to {MOST_CASES}", "or give samples and no count"
                if drawn is not None:
                    how, advice = "no count", "samples says how many"
                raise InvalidInputError("count", MISSING if asked.count is None else asked.count, how, advice)
        return np.linspace(asked.start, asked.to, asked.count or 2).tolist()
    if isinstance(given, list | tuple):
        if not given:
            raise InvalidInputError(key, given, "a value, a list of values, or from, to and count")
        return list(given)
    return [given]


def _drawn(values: list[Any], between: bool, drawn: Samples, random: np.random.Generator) -> list[Any]:
    """Samples of the values of a key, or of those ``between`` the first and the last."""
    if between:
        found: list[Any] = random.uniform(values[0], values[-1], drawn.samples).tolist()
        return found
    return [values[i] for i in random.integers(len(values), size=drawn.samples)]


def _is_whole(grid: Grid, part: Path) -> bool:
    """Whether a part is there; a damaged one is solved again."""
    try:
        store.read(part, grid.question.found)
    except InvalidInputError:
        return False
    return True


def _solved(grid: Grid, job: Job) -> range:
    solve(grid, *job)
    return job[0]


def solve(grid: Grid, chunk: range, part: Path) -> None:
    """Solve the cases of a chunk and store them in one of :func:`chunk_files`."""
    rows = [grid.question.row(grid.case(number)) for number in chunk]
    found = schema.dataset({name: ("case", [row[name] for row in rows]) for name in grid.question.found})
    store.write(found, part, title="part of a sweep")


def _gathered(grid: Grid, parts: Mapping[Path, range]) -> xr.Dataset:
    """The dataset, part by part."""
    asks, known = grid.question, dict[str, str]()
    found: dict[str, Any] = {name: np.empty(grid.count) for name in asks.numbers}
    found |= {name: np.empty(grid.count, dtype=object) for name in asks.texts}
    for part, chunk in parts.items():
        data = store.read(part, asks.found)
        where = slice(chunk.start, chunk.stop)
        for name in asks.numbers:
            found[name][where] = data[name]
        for name in asks.texts:
            found[name][where] = [known.setdefault(text, text) for text in data[name].values]
    values: dict[str, Any] = {}
    for key in grid.listed:
        name = NAMES.get(key, key)
        values[name] = ("sample" if grid.drawn else name, grid.values[key])
    values |= {name: (grid.axes, array.reshape(grid.shape)) for name, array in found.items()}
    same = {key: grid.values[key][0] for key in grid.question.keys if key not in grid.listed}
    attrs = {key: int(value) if isinstance(value, bool) else value for key, value in same.items() if value is not None}
    return schema.dataset(values, attrs)
