"""What a command says: results, and on standard error warnings, progress on a terminal, and each step if asked to.

The package says what it does to the logger "stripfold": warnings, notes (INFO), and the solvers' steps (DEBUG).
"""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from shutil import get_terminal_size
from time import monotonic
from typing import TextIO

from stripfold.base.material import GRAVITY, Material

Say = Callable[[str], None]
logger = logging.getLogger("stripfold")
PREFIX = {logging.WARNING: "stripfold: warning: ", logging.INFO: "stripfold: note: "}


def verbosity_options(parser: argparse.ArgumentParser) -> None:
    """The options that all commands have."""
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--quiet", action="store_true", help="print nothing but the result and errors")
    how.add_argument("--verbose", action="store_true", help="print models, meshes and steps, with the time")


def printable(said: str) -> str:
    """A text that no terminal takes for commands, as names from outside may be: other characters than letters, line
    ends and tabs are shown as Python writes them."""
    return "".join(one if one.isprintable() or one in "\n\t" else repr(one)[1:-1] for one in said)


def write(said: str, to: TextIO | None = None) -> None:
    """Print a text, by default on standard output."""
    print(printable(said), file=to, flush=True)


@contextmanager
def messages(arguments: argparse.Namespace) -> Iterator[Say]:
    """Send what is logged to standard error; yields a function that says what is being done."""
    level = logging.DEBUG if arguments.verbose else logging.ERROR if arguments.quiet else logging.INFO
    handler = _Handler(arguments)
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel(level)
    logger.propagate = False
    try:
        if arguments.verbose:
            yield logger.debug
        elif sys.stderr.isatty() and not arguments.quiet:
            yield handler.show
        else:
            yield lambda _: None
    finally:
        handler.clear()
        logger.removeHandler(handler)
        logger.setLevel(before)
        logger.propagate = True


def in_si(said: str, arguments: argparse.Namespace) -> str:
    """A message on one line, with metres and seconds for the solvers' units where the strip is known."""
    said, eta_b = " ".join(said.split()), getattr(arguments, "eta_b", None) or 0.0
    return Material(eta_b, gravity=getattr(arguments, "gravity", GRAVITY)).in_si(said) if eta_b > 0.0 else said


class _Handler(logging.Handler):
    """Lines on standard error, and a line of progress below them that the next one overwrites."""

    def __init__(self, arguments: argparse.Namespace) -> None:
        super().__init__()
        self.arguments, self.began, self.shown = arguments, monotonic(), False

    def emit(self, record: logging.LogRecord) -> None:
        self.clear()
        prefix = PREFIX.get(record.levelno, f"{monotonic() - self.began:8.3f} s  ")
        write(f"{prefix}{in_si(record.getMessage(), self.arguments)}", sys.stderr)

    def show(self, said: str) -> None:
        """Say what is being done, on a terminal."""
        self.clear()
        minutes, seconds = divmod(int(monotonic() - self.began), 60)
        clock = f" [{minutes:02d}:{seconds:02d}]"
        # A line that wraps could not be removed.
        room = get_terminal_size().columns - len(clock) - 1
        sys.stderr.write(f"{printable(in_si(said, self.arguments))[:room]}{clock}")
        sys.stderr.flush()
        self.shown = True

    def clear(self) -> None:
        """Remove the line of progress."""
        if self.shown:
            sys.stderr.write("\r\x1b[K")
            self.shown = False
