"""``stripfold`` and ``python -m stripfold``: the command line."""

import gc
import signal
import sys


def main() -> int:
    """Run the command line; until it handles signals itself, an interruption ends the process without a traceback."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from stripfold import cli

    try:
        return cli.main()
    finally:
        # Python would search all objects for cycles before it ends, for longer than a short command takes to print.
        gc.freeze()
        # While Python ends it has no handlers: a signal would take the place of the exit code.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})


if __name__ == "__main__":
    sys.exit(main())
