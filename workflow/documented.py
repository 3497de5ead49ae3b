"""The examples in the documentation: blocks of Python and of commands, which tests/test_docs_examples.py runs."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
MADE = "examples.md"
"""Shows the programs of `examples`, which have a test of their own."""


@dataclass(frozen=True)
class Example:
    """A block of a page: where it begins, "python" or "console", and its lines."""

    page: str
    line: int
    language: str
    text: str


def pages() -> list[Path]:
    """The README and the pages of docs that are written by hand."""
    return [ROOT / "README.md", *(page for page in sorted((ROOT / "docs").glob("*.md")) if page.name != MADE)]


def examples(page: Path) -> list[Example]:
    """The blocks of a page marked as ``python``, or as ``console``: commands after "$ ", and what they print.

    Blocks marked as ``sh`` and those without a mark are not run.
    """
    text = page.read_text(encoding="utf-8")
    return [
        Example(page.name, text.count("\n", 0, found.start()) + 1, found[1], found[2])
        for found in re.finditer(r"^```(python|console)\n(.*?)^```$", text, re.M | re.S)
    ]
