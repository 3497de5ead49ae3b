"""The table of numbers by chapter, physics first; :mod:`.number` says what an entry is."""

from __future__ import annotations

from typing import NamedTuple

from studies.summary.number import Source
from studies.summary.numbers_paths import PATHS
from studies.summary.numbers_recordings import RECORDINGS
from studies.summary.numbers_statics import STATICS
from studies.summary.numbers_tool import TOOL

ABOUT_THE_PROGRAM = {"project", "conventions", "cold_run", "kills", "slurm_run", "commands", "fuzz", "wheels"}
"""Datasets about the program as a program."""


class Chapter(NamedTuple):
    """Sources of numbers, and the sections of the gallery (:data:`plots.SECTIONS`) whose figures belong to them."""

    sources: tuple[Source, ...]
    figures: tuple[str, ...]


CHAPTERS = {
    "Statics": Chapter(STATICS, ("Motion along x", "Critical points")),
    "Folding paths and friction": Chapter(PATHS, ("Folding paths", "Folding paths of all materials")),
    "Recordings": Chapter(RECORDINGS, ("Recordings",)),
    "Accuracy and speed": Chapter(
        tuple(source for source in TOOL if source.names not in ABOUT_THE_PROGRAM), ("Accuracy and performance",)
    ),
    "The program": Chapter(tuple(source for source in TOOL if source.names in ABOUT_THE_PROGRAM), ()),
}
SOURCES = tuple(source for chapter in CHAPTERS.values() for source in chapter.sources)
