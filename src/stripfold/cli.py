"""The command line; the commands themselves are in :mod:`.cli_commands` and beside it."""

from __future__ import annotations

import argparse
import gc
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from inspect import getdoc
from pathlib import Path
from threading import Timer
from typing import TYPE_CHECKING, Any, NoReturn

from stripfold import cli_commands as commands
from stripfold import cli_doctor, cli_recordings  # noqa: F401
from stripfold.base.errors import InvalidInputError, StripfoldError
from stripfold.base.version import version
from stripfold.cli_messages import Say, in_si, messages, printable, verbosity_options, write

if TYPE_CHECKING:
    from sys import UnraisableHookArgs


def completion_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=("bash", "zsh", "tcsh"))


@commands.command("completion of commands and options by the tab key, for a shell", completion_options, json=False)
def completion(arguments: argparse.Namespace, _: Say) -> str:
    """Print the script that completes commands and options: eval "$(stripfold completion bash)"."""
    from stripfold.base.errors import require

    require("completion")
    import shtab

    return str(shtab.complete(_parser(list(COMMANDS)), arguments.shell))


ORDER = (
    "critical sweep eta simulate film path plan map assess monitor plate record calibrate measure new completion doctor"
)
COMMANDS = {name: commands.COMMANDS[name] for name in ORDER.split()}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0: done, also where there is no snap.  1: a path that --check refuses.  2: bad input, or a file that cannot be read
    or written.  3: a solve failed.  4: a recording that cannot be measured.  5: a fault of the program.  6: no path
    with the margin.  130: interrupted.  141: the reader of the output has gone.  143: terminated.
    """
    signals: list[int] = []

    def stop(number: int, _: object) -> NoReturn:
        signals.append(number)
        sys.unraisablehook = again
        sys.exit(128 + number)  # an exception: temporary files are removed

    def again(lost: UnraisableHookArgs) -> None:
        """Stop once more where the exception was raised in a destructor or a callback, and ignored."""
        if isinstance(lost.exc_value, SystemExit):
            Timer(0.01, os.kill, (os.getpid(), signals[-1])).start()

    if argv is None:
        argv = sys.argv[1:]
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, stop)
    # The systems are small: threads inside BLAS gain nothing, and on a busy machine they wait for each other, up to
    # twenty times longer.  Heeded only by a numpy that is not imported yet.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    # Commands draw into files only; matplotlib refuses to be imported with a name that it does not know.
    os.environ["MPLBACKEND"] = "agg"
    # To search for cycles among the objects that imports make takes a twentieth of a short command.
    gc.set_threshold(10_000)
    parser = _parser(argv)
    arguments, unknown = parser.parse_known_args(argv)
    if unknown:
        parser.error(f"unrecognized arguments: {' '.join(unknown)}")
    try:
        for name, given in vars(arguments).items():
            if isinstance(given, str) and "\0" in given:
                raise InvalidInputError(name, given, "a text without the character NUL")
        with messages(arguments) as say:
            command = COMMANDS[arguments.command]
            commands.check_outputs(arguments, arguments.parser, command.named_after)
            answer = command.run(arguments, say)
        said, code = answer if isinstance(answer, tuple) else (answer, 0)
        if said:
            write(said)
        return code
    except BrokenPipeError:
        # What is left in the buffers is written when Python ends, and would fail again.
        nothing = os.open(os.devnull, os.O_WRONLY)
        for stream in (sys.stdout, sys.stderr):
            os.dup2(nothing, stream.fileno())
        return 141
    except Exception as error:
        if signals:  # libraries put an error of their own in its place, as pydantic while it builds a class
            return 128 + signals[-1]
        said, code = _in_words(error)
        write(f"stripfold: error: {in_si(said, arguments)}", sys.stderr)
        return code


def _in_words(error: Exception) -> tuple[str, int]:
    """What happened, where, and what to do; and the exit code."""
    if isinstance(error, StripfoldError):
        return str(error), error.exit_code
    if isinstance(error, OSError):
        place = f"{error.filename}: " if error.filename else ""
        return f"{place}{error.strerror or error}; check the name, the rights and the space there", 2
    if isinstance(error, MemoryError):
        return f"the memory does not suffice: {error}; ask for less accuracy, or check the size of the input", 2
    *_, at = traceback.extract_tb(error.__traceback__)
    place = f"{Path(at.filename).name}, line {at.lineno}"
    return f"{type(error).__name__} in {place}: {error}; this is a fault of the program: please report it", 5


class _Parser(argparse.ArgumentParser):
    """Its errors are one line, whatever the arguments are."""

    def error(self, message: str) -> NoReturn:
        super().error(printable(" ".join(message.split())))


class _Command(_Parser):
    """Says what an unknown option may have been, and not that the option meant is missing."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        for given in args[: args.index("--")] if "--" in args else args:
            if given.startswith("--") and (name := given.partition("=")[0]) not in self._option_string_actions:
                from stripfold.base.validation import did_you_mean

                self.error(f"unknown option {name}: {did_you_mean(name, self._option_string_actions)}")
        return super().parse_known_args(args, namespace)


class _Version(argparse.Action):
    """Looked up only where it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        print(f"{parser.prog} {version()}")
        parser.exit()


def _parser(argv: Sequence[str]) -> argparse.ArgumentParser:
    parser = _Parser(
        prog="stripfold",
        description="Static stability of fabric strip folding. All numbers in SI units.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the program's version number and exit")
    added = parser.add_subparsers(dest="command", required=True, metavar="command", parser_class=_Command)
    for name, command in COMMANDS.items():
        options = added.add_parser(name, help=command.help, description=getdoc(command.run), allow_abbrev=False)
        # The models are imported for the command that is called, not for `--help`.
        if name in argv:
            command.options(options)
            if command.json:
                options.add_argument("--json", action="store_true", help="print one JSON object")
            verbosity_options(options)
            options.set_defaults(parser=options)
    return parser
