"""Figures to files: PNG and SVG, the same bytes in every run."""

from __future__ import annotations

import os
from pathlib import Path

from matplotlib.figure import Figure

from stripfold.plots.style import styled
from stripfold.store import atomic

# Neither date nor version: a file depends on what is drawn alone.
_METADATA: dict[str, dict[str, None]] = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}


@styled
def save(fig: Figure, stem: str | os.PathLike[str]) -> tuple[Path, Path]:
    """Write ``fig`` as ``stem``.png and ``stem``.svg, each atomically; missing folders are made."""
    # Arranged once: doing so again for each format would move things by a rounding error.
    fig.draw_without_rendering()
    fig.set_layout_engine(None)
    stem = os.fspath(stem)
    return save_as(fig, f"{stem}.png"), save_as(fig, f"{stem}.svg")


@styled
def save_as(fig: Figure, path: str | os.PathLike[str]) -> Path:
    """Write ``fig`` as one file, atomically; its suffix is .png or .svg."""
    path = Path(path)
    kind = path.suffix[1:]
    with atomic(path) as temporary:
        fig.savefig(temporary, format=kind, metadata=_METADATA[kind])
    return path
