"""The same work on many things, in new processes that end with this one.

Those of multiprocessing would run the user's program again, and may not be started by one another.
"""

from __future__ import annotations

import gc
import logging
import os
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from itertools import islice
from logging.handlers import QueueHandler
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from queue import Empty, SimpleQueue
from signal import Signals
from threading import Thread
from typing import Any, TypeVar

from stripfold.base.errors import InvalidInputError, StripfoldError

Job = TypeVar("Job")
Answer = TypeVar("Answer")
logger = logging.getLogger("stripfold")
SWITCH = 1e-4
"""Time after which a thread that waits gets its turn, s: less than a step of the work."""


def most(cores: int | None) -> int:
    """Return the largest number of processes at a time: ``cores``, and at most one for each core that may be used.

    One on Windows, where none can be handed a connection like this.  Raises InvalidInputError: no such number of cores.
    """
    if cores is not None and (isinstance(cores, bool) or not isinstance(cores, int) or cores < 1):
        raise InvalidInputError("cores", cores, "a whole number of at least 1")
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores or available, available if os.name == "posix" else 1)


def in_order(
    function: Callable[[Job], Answer], jobs: Sequence[Job], processes: int, progress: Callable[[float], None]
) -> list[Answer]:
    """Return the answers to all jobs; of the processes this one is one, which is not idle while others start.

    ``processes``: the most at a time.  ``progress``: called with the share that is done.  Raises what
    :func:`elsewhere` and ``function`` do.
    """
    work, answers, waiting = partial(_numbered, function), dict[int, Answer](), SimpleQueue[tuple[int, Job]]()
    for job in enumerate(jobs):
        waiting.put(job)

    def left() -> Iterator[tuple[int, Job]]:
        with suppress(Empty):
            while True:
                yield waiting.get_nowait()

    started: list[subprocess.Popen[bytes]] = []
    more, usual = max(min(processes, len(jobs)) - 1, 0), sys.getswitchinterval()
    # The thread takes an answer of megabytes in a hundred pieces, and would wait for this one before each.
    sys.setswitchinterval(min(usual, SWITCH))
    with ThreadPoolExecutor(1) as thread:
        others = thread.submit(lambda: answers.update(elsewhere(work, left(), more, started)))
        try:
            for job in left():
                answers.update([work(job)])
                progress(len(answers) / len(jobs))
        except BaseException:
            # The others neither take up what is left nor finish what they do.
            list(left())
            for process in started:
                process.kill()
            raise
        finally:
            sys.setswitchinterval(usual)
        others.result()
    return [answers[number] for number in range(len(jobs))]


def _numbered(function: Callable[[Job], Answer], job: tuple[int, Job]) -> tuple[int, Answer]:
    return job[0], function(job[1])


def elsewhere(
    function: Callable[[Job], Answer],
    jobs: Iterable[Job],
    processes: int,
    started: list[subprocess.Popen[bytes]] | None = None,
) -> Iterator[Answer]:
    """Yield the answers to jobs as they come, from new processes; what they log is logged here.

    ``function``: of a module, or a partial one; it, the jobs and the answers can be pickled.  ``processes``: the most
    at a time.  ``started``: the processes are added to it.

    Raises StripfoldError: a process was ended from outside; what ``function`` raises.
    """
    waiting, workers = iter(jobs), dict[Any, subprocess.Popen[bytes]]()
    try:
        connection: Any
        for job in islice(waiting, processes):
            connection, theirs = Pipe()
            with theirs:
                code = f"from stripfold.base.processes import work; work({theirs.fileno()})"
                # -P: a module in the user's working folder must not shadow a library.  In a group of its own: an
                # interruption from the keyboard reaches this process only, which ends the others.
                workers[connection] = subprocess.Popen(
                    [sys.executable, "-P", "-c", code],
                    stdin=subprocess.DEVNULL,
                    pass_fds=[theirs.fileno()],
                    process_group=0,
                )
            if started is not None:
                started.append(workers[connection])
            _send(connection, (function, logger.getEffectiveLevel(), gc.get_threshold()))
            _send(connection, job)
        at_work = len(workers)
        while at_work:
            for connection in wait(list(workers)):
                said = _answer(connection, workers[connection])
                if isinstance(said, logging.LogRecord):
                    logger.handle(said)
                    continue
                try:
                    _send(connection, next(waiting))
                except StopIteration:
                    at_work -= 1
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
        reason = ", as where memory is short" if how == "by SIGKILL" else ""
        raise StripfoldError(f"a process was ended {how}{reason}: run it again, with fewer cores if need be") from None
    if isinstance(said, Exception):
        raise said
    return said


def work(descriptor: int) -> None:
    """Do what :func:`elsewhere` asks for by a connection, until it closes that or ends."""
    connection, jobs = Connection(descriptor), SimpleQueue[Any]()
    function, level, threshold = connection.recv()

    def listen() -> None:
        with suppress(EOFError, ConnectionResetError):
            while True:
                jobs.put(connection.recv())
        os._exit(1)

    Thread(target=listen, daemon=True).start()
    gc.set_threshold(*threshold)
    logger.setLevel(level)
    logger.addHandler(_Sender(connection))  # type: ignore[arg-type]
    while True:
        job = jobs.get()
        try:
            said = function(job)
        except Exception as error:
            error.add_note(traceback.format_exc())
            said = error
        _send(connection, said)


class _Sender(QueueHandler):
    """Sends what is logged, instead of putting it into a queue."""

    def enqueue(self, record: logging.LogRecord) -> None:
        self.queue.send(record)  # type: ignore[attr-defined]
