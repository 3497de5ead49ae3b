"""Figures to files: PNG and SVG, the same bytes in every run."""

from __future__ import annotations

import os
from pathlib import Path

from matplotlib.figure import Figure

from stripfold.plots.style import styled
from stripfold.store import atomic

# No date, no version: what a file says depends on what is drawn alone.
_METADATA: dict[str, dict[str, None]] = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}


@styled
def save(fig: Figure, stem: str | os.PathLike[str]) -> tuple[Path, Path]:
    """Write ``fig`` as ``stem``.png and ``stem``.svg; each file is whole or not there.

    Parameters
    ----------
    fig
        A figure of one of this package's modules.
    stem
        Path without suffix.  Missing folders are made.

    Returns
    -------
    tuple of Path
        The PNG and the SVG file.
    """
    # Arrange once: arranging anew for each format would move things by a rounding error.
    fig.draw_without_rendering()
    fig.set_layout_engine("none")
    paths = []
    for suffix, metadata in _METADATA.items():
        path = Path(f"{os.fspath(stem)}.{suffix}")
        with atomic(path) as temporary:
            fig.savefig(temporary, format=suffix, metadata=metadata)
        paths.append(path)
    return paths[0], paths[1]
