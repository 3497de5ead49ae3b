"""Malformed and odd inputs of all commands: each ends in a result or in one line, within time and memory."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from io import TextIOWrapper
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from stripfold.ask.results import StripCollapse
from stripfold.ask.simulation import Simulation
from stripfold.cli import main
from stripfold.film.pictures import one_thread
from studies.common import Progress, dataset, pooled

SHARES = {"arguments": 0.4, "yaml": 0.3, "tables": 0.1, "data": 0.1, "pictures": 0.1}
"""Kinds of inputs, with their shares."""
GOOD = "@"
"""Begins a word that names one of the files that can be used."""
PIPE, FOLDER = b"a pipe", b"a folder"
"""Contents that stand for something else than a file."""
BATCH = 250
"""Cases of one process."""
LONGEST = 30
"""Seconds after which a case has failed."""
MEMORY = 1e9
"""Bytes that a case may take; half as much again and there are no more."""
ENDINGS = ("answered", "followed", "refused", "failed")
"""A result was printed; the input was accepted, and the computation that it asks for left out; an error; a failure."""
# Where an input has been checked and a long computation begins.
_STOPS = (
    "stripfold.ask.results:StripCollapse.of",
    "stripfold.ask.path_assessment:PathAssessment.of",
    "stripfold.ask.stability_map:StabilityMap.of",
    "stripfold.ask.folding_plan:FoldingPlan.of",
    "stripfold.ask.sweep:_solve_all",
    "stripfold.synthetic.recording:history_of",
    "stripfold.draw.film:_Stage",
    "stripfold.draw.save:save_as",
    "stripfold.film.intrinsics:find_views",
    "stripfold.film.robot_grid:read_calibration_picture",
    "stripfold.ask.critical_point:solve_height",
    "stripfold.cli_doctor:_findings",
)
# A recording's table is read after a picture of a board.
_SKIPPED = ("stripfold.film.calibration:read_calibration_picture", "stripfold.film.calibration:detect")
_STEP = re.compile(r"^ *\d+\.\d{3} s  .*\n", re.M)
"""A line of `--verbose`."""
_NO_NUMBER = re.compile(r"(?<![\w-])-?(nan|inf|NaN|Infinity)(?![\w-])")


class Case(NamedTuple):
    """A command line, and files in the folder in which it is called."""

    words: tuple[str, ...]
    files: dict[str, bytes]


class Ending(NamedTuple):
    """How a case ended: one of :data:`ENDINGS`, and what is wrong where it failed."""

    kind: str
    why: str = ""


class Followed(BaseException):
    """The input was accepted."""


def run(inputs: int, seed: int, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Call commands with ``inputs`` generated inputs, the same for the same ``seed``.

    Dataset over ``kind`` of the input: how many ended how; the attribute ``failures`` describes those that failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        write_good(Path(folder))
        with stopped():
            pass  # what is imported once here is not imported in each process
        tasks = [
            (kind, min(BATCH, count - first), seed + 1000 * number + first // BATCH)
            for number, (kind, share) in enumerate(SHARES.items())
            for count in [round(share * inputs)]
            for first in range(0, count, BATCH)
        ]
        found = pooled(partial(_batch, Path(folder)), tasks, threads)
    counts = {name: [0] * len(SHARES) for name in ENDINGS}
    failures = []
    for (kind, *_), endings in zip(tasks, found, strict=True):
        for line, ending in endings:
            counts[ending.kind][list(SHARES).index(kind)] += 1
            if ending.kind == "failed":
                failures.append(f"{line}: {ending.why}")
                if progress:
                    progress(failures[-1])
    values: dict[str, Any] = {name: ("kind", counts[name]) for name in ENDINGS}
    attrs = {"seed": seed, "failures": "; ".join(failures)[:2000]}
    return dataset("fuzz", {"kind": ("kind", list(SHARES)), **values}, attrs)


def write_good(folder: Path) -> None:
    """Files that commands accept, and a pipe, in a folder."""
    from PIL import Image

    from studies import fuzz_inputs

    for name, tree in fuzz_inputs.SCENES.values():
        (folder / name).write_text(fuzz_inputs._as_yaml(tree), encoding="utf-8")
    (folder / "path.csv").write_bytes(fuzz_inputs.as_csv(fuzz_inputs.PATH))
    StripCollapse.of(Simulation.read(folder / "scene.yaml")).to_netcdf(folder / "scene.nc")
    picture = Image.linear_gradient("L").resize((80, 60))
    picture.save(folder / "fold.png")
    (folder / "views").mkdir()
    picture.save(folder / "views" / "0.png")
    (folder / "recording").mkdir()
    for name, content in fuzz_inputs.recording().items():
        (folder / "recording" / name).write_bytes(content)
    os.mkfifo(folder / "pipe")


def _batch(good: Path, task: tuple[str, int, int]) -> list[tuple[str, Ending]]:
    """Generate cases of a kind and call them in a process of their own; another goes on where one was ended."""
    from studies import fuzz_files
    from studies import fuzz_inputs as of

    kind, count, seed = task
    ways = {
        "arguments": of.of_arguments(),
        "yaml": of.of_yaml(),
        "tables": of.of_tables(),
        "data": fuzz_files.of_data(good / "scene.nc"),
        "pictures": fuzz_files.of_pictures(),
    }
    cases = of.drawn(ways[kind], count, seed)
    return list(zip((" ".join(case.words)[:200] for case in cases), endings_of(cases, good), strict=True))


@one_thread()  # OpenCV's threads do not survive a fork
def endings_of(cases: Sequence[Case], good: Path) -> list[Ending]:
    """How cases end, in processes of their own; ``good`` is the folder of :func:`write_good`."""
    found: list[Ending] = []
    context = multiprocessing.get_context("fork")
    while len(found) < len(cases):
        receiver, sender = context.Pipe(duplex=False)
        process = context.Process(target=_call_all, args=(cases[len(found) :], good, sender))
        process.start()
        sender.close()
        before = len(found)
        try:
            while True:
                found.append(receiver.recv())
        except EOFError:
            pass
        process.join()
        if process.exitcode:
            why = (
                f"no end within {LONGEST} s" if process.exitcode == -signal.SIGALRM else f"ended by {process.exitcode}"
            )
            found.append(Ending("failed", why))
        assert len(found) > before
    return found


def _call_all(cases: Sequence[Case], good: Path, sender: Connection) -> None:
    """Call cases until the memory of the process has grown, and send how each ended."""
    # Ended without a word by what Python cannot interrupt, such as a pipe that is opened.
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    with tempfile.TemporaryDirectory() as folder, stopped():
        # What is imported takes half a gigabyte of the space that a limit is set to.
        space = _space()
        resource.setrlimit(resource.RLIMIT_AS, (space + int(1.5 * MEMORY), resource.RLIM_INFINITY))
        os.chdir(folder)
        for number, case in enumerate(cases):
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            ending = call(case, Path(folder) / str(number), good)
            taken = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
            if taken > MEMORY:
                ending = Ending("failed", f"takes {taken:.1e} bytes")
            sender.send(ending)
            # What libraries keep would be missed by the next case.
            if taken > 0.2 * MEMORY or _space() > space + 0.2 * MEMORY:
                return


def _space() -> int:
    """Bytes of the addresses that the process has."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def call(case: Case, folder: Path, good: Path) -> Ending:
    """How one case ends, in a new folder that is removed then."""
    for name, content in case.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if content == PIPE:
            os.mkfifo(path)
        elif content == FOLDER:
            path.mkdir()
        else:
            path.write_bytes(content)
    folder.mkdir(exist_ok=True)
    words = [f"{good}/{word.removeprefix(GOOD)}" if word.startswith(GOOD) else word for word in case.words]
    os.chdir(folder)
    try:
        with _printed(folder.parent) as printed:
            signal.alarm(LONGEST)
            try:
                code: int | str = main(words)
            except Followed:
                code = "followed"
            except SystemExit as ended:
                code = int(ended.code or 0)
            except BaseException:
                code = traceback.format_exc(limit=-2)
            finally:
                signal.alarm(0)
        return judged(code, *printed)
    finally:
        os.chdir(folder.parent)
        shutil.rmtree(folder, ignore_errors=True)


def judged(code: int | str, said: str, errors: str) -> Ending:
    """How a call ended, from its exit code or the text of what it raised, and what it printed."""
    errors = _STEP.sub("", errors)
    lines = errors.splitlines()
    if code in (0, "followed"):
        if found := _NO_NUMBER.search(said):
            return Ending("failed", f"prints {found[0]}")
        if any(not line.startswith(("stripfold: note: ", "stripfold: warning: ")) for line in lines):
            return Ending("failed", f"says {lines[-1]}")
        return Ending("followed" if code else "answered")
    if isinstance(code, str):
        return Ending("failed", code)
    # The parser of the arguments says how the command is used before what is wrong.
    usage = code == 2 and errors.startswith("usage: ") and re.match(r"stripfold( \w+)?: error: ", lines[-1])
    if usage or (code in (2, 3, 4, 6) and len(lines) == 1 and errors.startswith("stripfold: error: ")):
        memory = "the memory does not suffice" in errors
        return Ending("failed", lines[-1]) if memory else Ending("refused")
    said = re.sub(r"\S*/", "", " | ".join(lines))  # folders are of one machine
    return Ending("failed", f"exit code {code}, {len(lines)} lines: {said[-400:]}")


@contextmanager
def _printed(folder: Path) -> Iterator[list[str]]:
    """What the block prints on both of its streams, libraries in other languages included."""
    printed: list[str] = []
    names = [folder / "stdout", folder / "stderr"]
    before = [os.dup(1), os.dup(2)]
    streams = sys.stdout, sys.stderr
    for number, name in enumerate(names, start=1):
        opened = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(opened, number)
        os.close(opened)
    sys.stdout = TextIOWrapper(os.fdopen(1, "wb", closefd=False), encoding="utf-8")
    sys.stderr = TextIOWrapper(os.fdopen(2, "wb", closefd=False), encoding="utf-8", errors="backslashreplace")
    try:
        yield printed
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        sys.stdout, sys.stderr = streams
        for number, known in enumerate(before, start=1):
            os.dup2(known, number)
            os.close(known)
        printed += [name.read_text(encoding="utf-8", errors="replace") for name in names]


@contextmanager
def stopped() -> Iterator[None]:
    """Computations that follow on an accepted input are left out in the block."""
    before = []
    try:
        for place in (*_STOPS, *_SKIPPED):
            module, _, name = place.partition(":")
            owner: Any = importlib.import_module(module)
            *way, name = name.split(".")
            for step in way:
                owner = getattr(owner, step)
            before.append((owner, name, owner.__dict__[name]))
            setattr(owner, name, _stop if place in _STOPS else _skip)
        yield
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)


def _stop(*_: object, **__: object) -> None:
    raise Followed


def _skip(*_: object) -> bool:
    return True
