"""The table of numbers, in the order of the summary; :mod:`.number` says what an entry is."""

from __future__ import annotations

from studies.summary.numbers_paths import PATHS
from studies.summary.numbers_recordings import RECORDINGS
from studies.summary.numbers_statics import STATICS
from studies.summary.numbers_tool import TOOL

SOURCES = (*TOOL, *STATICS, *PATHS, *RECORDINGS)
