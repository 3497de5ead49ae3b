"""``python -m stripfold``: the command line."""

import sys

from stripfold.cli import main

sys.exit(main())
