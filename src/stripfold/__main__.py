"""``stripfold`` and ``python -m stripfold``: the command line."""

import signal
import sys


def main() -> int:
    """Run the command line; until it handles signals itself, an interruption ends the process without a traceback."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from stripfold import cli

    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
