"""Figures from stored datasets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from typing import Any

from stripfold.draw.save import save
from stripfold.files import store


def figures(drawings: Sequence[Mapping[str, Any]], output: Any) -> None:
    """Draw figures and store them as PNG and SVG.

    ``drawings``: for each figure the function that draws it, ``draw``, as "module:name", the ``files`` of the datasets
    that this takes, and its ``options``; ``output``: its ``png`` are the names of the files.
    """
    read = cache(store.read)
    for drawing, path in zip(drawings, output.png, strict=True):
        module, _, name = drawing["draw"].partition(":")
        draw = getattr(import_module(module), name)
        save(draw(*(read(file) for file in drawing["files"]), **drawing["options"]), path.removesuffix(".png"))
