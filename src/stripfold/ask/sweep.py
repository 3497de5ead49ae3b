"""Critical points of a grid of strips on all cores, in one file; an interrupted sweep goes on where it stopped."""

from __future__ import annotations

import json
import logging
import os
import re
import shutil
import subprocess
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from itertools import islice
from logging.handlers import QueueHandler
from math import ceil, nan, prod
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from pathlib import Path
from queue import SimpleQueue
from signal import SIGKILL, Signals
from threading import Thread
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import Field, create_model

from stripfold import elastica
from stripfold.ask import critical
from stripfold.ask.inputs import Scene
from stripfold.ask.prediction import ElasticaPrediction
from stripfold.ask.select_model import solid_error
from stripfold.base.arguments import checked, file_name
from stripfold.base.errors import InvalidInputError, StripfoldError
from stripfold.base.progress import Percent
from stripfold.base.validation import Input, Number, Whole, quantity, within
from stripfold.base.version import running_commit, version
from stripfold.files import schema, store
from stripfold.files.reporting import Progress
from stripfold.follow.track import End

if TYPE_CHECKING:
    import xarray as xr

KEYS = ("eta_b", "height", "length", "eta_m", "nu", "model", "accuracy")
"""Keys of a grid, the slowest first: cases in a row share the elastica at their height, which those of one L* have."""
NAMES = {"height": "gripper_height"}
"""Names of keys in the dataset, where they are others: CF reserves ``height``."""
LARGEST = 1e9
"""Largest end of a range: the limits of no key are wider."""
NUMBERS = ("lambda_c", "lambda_touch", "error", "model_error", "solid_error", "free_length")
MOST_CASES = 200_000
"""Most cases of a grid: on the solid a night's work, and with a text for each 100 MB in memory."""
CHUNK = 100
"""Most cases of a chunk that are solved one by one: what an interruption loses, and the least that is worth a file."""
CHUNKS = 32
"""Chunks of a small grid or of one of the elastica, at most: enough to keep the cores equally busy."""
LOCK = "in_use"
"""File in the folder of parts that whoever writes there has locked; the system unlocks it when a process ends."""

Job = tuple[range, Path]
"""A chunk, and the file of its results."""
logger = logging.getLogger("stripfold")

_Case: Any = create_model(
    "_Case", __base__=Input, **{key: (Scene.model_fields[key].annotation, Scene.model_fields[key]) for key in KEYS}
)  # type: ignore[call-overload]
"""The keys of a case, each within its limits; what goes together is left to :class:`.inputs.Scene`."""


class Range(Input):
    """Numbers at equal distances, both ends included."""

    start: Annotated[Number, quantity("the first", ge=0.0, le=LARGEST), Field(alias="from")]
    to: Annotated[Number, quantity("the last", ge=0.0, le=LARGEST)]
    count: Annotated[Whole, Field(description="how many", ge=2, le=MOST_CASES)]


@dataclass(frozen=True)
class Grid:
    """Values of all keys, and the keys for which a list or a range is given, in the order of :data:`KEYS`; SI."""

    values: dict[str, list[Any]]
    listed: tuple[str, ...]

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Self:
        """A grid from numbers, lists of them and ranges.

        Raises InvalidInputError: a key or value that cannot be used, or no case with values that go together.
        """
        if not isinstance(given, Mapping):
            raise InvalidInputError("grid", given, "keys and values")
        axes = {str(key): _values(str(key), value) for key, value in given.items()}
        first = {key: values[0] for key, values in axes.items()}
        checked_values = {key: [value] for key, value in _Case.of(first)}
        if (count := prod(len(values) for values in axes.values())) > MOST_CASES:
            raise InvalidInputError("grid", f"{count} cases", f"at most {MOST_CASES} cases", "split the grid")
        for key, values in axes.items():
            checked_values[key] = [getattr(_Case.of(first | {key: value}), key) for value in values]
        listed = tuple(key for key in KEYS if isinstance(given.get(key), list | tuple | Mapping))
        for key in listed:
            if len(set(checked_values[key])) < len(checked_values[key]):
                raise InvalidInputError(key, given[key], "values of which no two are alike")
        grid, refused = cls({key: checked_values[key] for key in KEYS}, listed), None
        for number in range(grid.count):
            try:
                Scene(**grid.case(number))
            except InvalidInputError as error:
                refused = refused or error
            else:
                return grid
        # No case is possible, as with a wrong unit.
        assert refused is not None
        raise refused

    @property
    def shape(self) -> tuple[int, ...]:
        """Numbers of values of the listed keys."""
        return tuple(len(self.values[key]) for key in self.listed)

    @property
    def count(self) -> int:
        """Number of cases."""
        return prod(self.shape)

    @property
    def chunks(self) -> list[range]:
        """The numbers of the cases, in chunks."""
        size = ceil(self.count / CHUNKS)
        if self.values["model"] != ["elastica"]:
            size = min(size, CHUNK)
        return [range(first, min(first + size, self.count)) for first in range(0, self.count, size)]

    def case(self, number: int) -> dict[str, Any]:
        """Keys and values of a case."""
        places = dict(zip(self.listed, np.unravel_index(number, self.shape), strict=True))
        return {key: values[places.get(key, 0)] for key, values in self.values.items()}

    def config(self) -> dict[str, Any]:
        """The resolved keys and values, as they could be given."""
        return {key: values if key in self.listed else values[0] for key, values in self.values.items()}


@checked
def run(
    given: Mapping[str, Any], file: str | os.PathLike[str], cores: int | None = None, progress: Progress | None = None
) -> xr.Dataset:
    """Find the critical points of all combinations of values and store them in one netCDF file.

    What is done stands in the folder ``file`` + ".parts" until the file is whole: the same call goes on from there.

    Parameters
    ----------
    given
        For each key of :data:`KEYS` a value, a list of values, or ``{"from": ..., "to": ..., "count": ...}``; those
        that are left out have the defaults of :class:`.inputs.Scene`.
    file
        Where to write.
    cores
        Most processes at a time, by default one for each core that may be used, which are also the most; one process
        is the calling one.
    progress
        Called with a line on how much is done.

    Returns
    -------
    ``lambda_c`` or, without a snap, ``lambda_touch``, ``error``, ``model_error``, ``solid_error``, ``free_length`` and
    ``reason`` over the keys with several values, named as in :data:`NAMES`; nan where a case is refused or fails, with
    the error as its reason.

    Raises
    ------
    InvalidInputError
        A key or value that cannot be used, the parts of another sweep stand beside the file, or another process is at
        work on them.
    StripfoldError
        A process of the sweep was ended from outside.
    """
    grid, file = Grid.of(given), file_name("file", file)
    if cores is not None and (isinstance(cores, bool) or not isinstance(cores, int) or cores < 1):
        raise InvalidInputError("cores", cores, "a whole number of at least 1")
    with owned(file):
        parts = chunk_files(grid, file)
        try:
            left = [(chunk, part) for part, chunk in parts.items() if not _is_whole(part)]
            solved, finished = Percent(progress, "solved"), grid.count - sum(len(chunk) for chunk, _ in left)
            solved(finished / grid.count)
            available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
            processes = min(cores or available, available, len(left))
            for chunk in _one_by_one(grid, left) if processes < 2 else _in_processes(grid, left, processes):
                finished += len(chunk)
                solved(finished / grid.count)
            found = _gathered(grid, parts)
            store.write(found, file, title="critical points of a grid of strips", config=grid.config())
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
    origin = [grid.config(), CHUNK, CHUNKS, version(), running_commit()]
    digest = sha256(json.dumps(origin).encode()).hexdigest()[:16]
    parts = {folder / f"{digest}-{number:05d}.nc": chunk for number, chunk in enumerate(grid.chunks)}
    if any(part not in parts for part in folder.glob("*.nc") if re.fullmatch(r"[0-9a-f]{16}-\d{5}", part.stem)):
        advice = f"give another output, or remove its parts from {folder}"
        raise InvalidInputError("output", str(file), "a file without the parts of another sweep beside it", advice)
    return parts


def _values(key: str, given: Any) -> list[Any]:
    """The values of a key."""
    if isinstance(given, Mapping):
        with within(key):
            asked = Range.of(given)
        return np.linspace(asked.start, asked.to, asked.count).tolist()
    if isinstance(given, list | tuple):
        if not given:
            raise InvalidInputError(key, given, "a value, a list of values, or from, to and count")
        return list(given)
    return [given]


def _is_whole(part: Path) -> bool:
    """Whether a part is there; a damaged one is solved again."""
    try:
        store.read(part, (*NUMBERS, "reason"))
    except InvalidInputError:
        return False
    return True


def _one_by_one(grid: Grid, left: Iterable[Job]) -> Iterator[range]:
    """Solve chunks in this process."""
    for chunk, part in left:
        solve(grid, chunk, part)
        yield chunk


def _in_processes(grid: Grid, left: Iterable[Job], processes: int) -> Iterator[range]:
    """Solve chunks in new processes, which end with this one.

    Those of multiprocessing would run the user's program again, and may not be started by one another.
    """
    waiting, workers = iter(left), dict[Any, subprocess.Popen[bytes]]()
    try:
        connection: Any
        for job in islice(waiting, processes):
            connection, theirs = Pipe()
            with theirs:
                code = f"from stripfold.ask.sweep import work; work({theirs.fileno()})"
                # -P: a module in the user's working folder must not shadow a library.  In a group of its own: an
                # interruption from the keyboard reaches this process only, which ends the others.
                workers[connection] = subprocess.Popen(
                    [sys.executable, "-P", "-c", code],
                    stdin=subprocess.DEVNULL,
                    pass_fds=[theirs.fileno()],
                    process_group=0,
                )
            _send(connection, (grid, logger.getEffectiveLevel()))
            _send(connection, job)
        at_work = len(workers)
        while at_work:
            for connection in wait(list(workers)):
                said = _answer(connection, workers[connection])
                if isinstance(said, logging.LogRecord):
                    logger.handle(said)
                    continue
                if (next_job := next(waiting, None)) is None:
                    at_work -= 1
                else:
                    _send(connection, next_job)
                yield said
    finally:
        for connection, process in workers.items():
            process.kill()
            process.wait()
            connection.close()


def _send(connection: Connection, said: Any) -> None:
    """Send to a process; where it has ended, that is said when its answer is missing."""
    with suppress(BrokenPipeError):
        connection.send(said)


def _answer(connection: Connection, process: subprocess.Popen[bytes]) -> Any:
    """The answer of a process, or the error that it answers with."""
    try:
        said = connection.recv()
    except (EOFError, ConnectionResetError):
        code = process.wait()
        how = f"by {Signals(-code).name}" if code < 0 else f"with exit code {code}"
        reason = ", as where memory is short" if code == -SIGKILL else ""
        kept = "what is solved is kept: run it again to go on, with fewer cores if need be"
        raise StripfoldError(f"a process of the sweep was ended {how}{reason}; {kept}") from None
    if isinstance(said, Exception):
        raise said
    return said


def work(descriptor: int) -> None:
    """Solve chunks as :func:`_in_processes` asks for them by a connection, until it closes that or ends."""
    connection, jobs = Connection(descriptor), SimpleQueue[Job]()
    grid, level = connection.recv()

    def listen() -> None:
        with suppress(EOFError, ConnectionResetError):
            while True:
                jobs.put(connection.recv())
        os._exit(1)

    Thread(target=listen, daemon=True).start()
    logger.setLevel(level)
    logger.addHandler(_Sender(connection))  # type: ignore[arg-type]
    while True:
        chunk, part = jobs.get()
        said: Any = chunk
        try:
            solve(grid, chunk, part)
        except Exception as error:
            error.add_note(traceback.format_exc())
            said = error
        _send(connection, said)


class _Sender(QueueHandler):
    """Sends what is logged, instead of putting it into a queue."""

    def enqueue(self, record: logging.LogRecord) -> None:
        self.queue.send(record)  # type: ignore[attr-defined]


def solve(grid: Grid, chunk: range, part: Path) -> None:
    """Solve the cases of a chunk and store them in one of :func:`chunk_files`."""
    rows = [_of(grid.case(number)) for number in chunk]
    found = schema.dataset({name: ("case", [row[name] for row in rows]) for name in (*NUMBERS, "reason")})
    store.write(found, part, title="part of a sweep")


def _of(case: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers and reason of a case."""
    try:
        scene = Scene(**case)
        if scene.model == "elastica":
            return _of_elastica(scene)
        found = critical.find(scene, prediction=_predicted(scene.height_star))
    except StripfoldError as error:
        return dict.fromkeys(NUMBERS, nan) | {"reason": " ".join(str(error).split())}
    return {name: getattr(found, name) for name in (*NUMBERS, "reason")}


def _of_elastica(scene: Scene) -> dict[str, Any]:
    """The same of the elastica, interpolated over the height: its states are not asked for."""
    end, unit = elastica.end_of_advance(scene.height_star), scene.gravity_length
    scene.require_long_enough(end.length)
    lam = unit * end.advance
    return {
        "lambda_c": lam if end.snap else nan,
        "lambda_touch": nan if end.snap else lam,
        "error": unit * critical.ELASTICA_ERROR,
        "model_error": lam * scene.distance_from_solid("elastica"),
        "solid_error": lam * solid_error(scene.material.relative_thickness, scene.nu, scene.height_star),
        "free_length": unit * end.length,
        "reason": (End.SNAP if end.snap else End.TOUCH).reason,
    }


_predicted = lru_cache(maxsize=1)(ElasticaPrediction.at)


def _gathered(grid: Grid, parts: Mapping[Path, range]) -> xr.Dataset:
    """The dataset, part by part."""
    found: dict[str, Any] = {name: np.empty(grid.count) for name in NUMBERS}
    found["reason"], texts = np.empty(grid.count, dtype=object), dict[str, str]()
    for part, chunk in parts.items():
        data = store.read(part, (*NUMBERS, "reason"))
        where = slice(chunk.start, chunk.stop)
        for name in NUMBERS:
            found[name][where] = data[name]
        found["reason"][where] = [texts.setdefault(text, text) for text in data["reason"].values]
    listed = tuple(NAMES.get(key, key) for key in grid.listed)
    values: dict[str, Any] = {name: (name, grid.values[key]) for name, key in zip(listed, grid.listed, strict=True)}
    values |= {name: (listed, array.reshape(grid.shape)) for name, array in found.items()}
    return schema.dataset(values, {key: grid.values[key][0] for key in KEYS if key not in grid.listed})
