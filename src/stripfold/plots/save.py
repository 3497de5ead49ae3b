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
    for suffix in _METADATA:
        paths.append(Path(f"{os.fspath(stem)}.{suffix}"))
        _write(fig, paths[-1], suffix)
    return paths[0], paths[1]


@styled
def save_png(fig: Figure, path: str | os.PathLike[str]) -> Path:
    """Write ``fig`` as the one PNG file ``path``; it is whole or not there."""
    _write(fig, Path(path), "png")
    return Path(path)


def _write(fig: Figure, path: Path, suffix: str) -> None:
    with atomic(path) as temporary:
        fig.savefig(temporary, format=suffix, metadata=_METADATA[suffix])
