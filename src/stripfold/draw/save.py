"""Figures and pages to files: PNG, SVG and PDF, the same bytes in every run; HTML from templates."""

from __future__ import annotations

import io
import os
import re
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from stripfold.base.version import running_commit, version
from stripfold.draw.style import styled
from stripfold.files.store import atomic

# Neither date nor version: a file depends on what is drawn alone.
_METADATA: dict[str, dict[str, None]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


@styled
def save(fig: Figure, stem: str | os.PathLike[str]) -> tuple[Path, Path]:
    """Write ``fig`` as ``stem``.png and ``stem``.svg, each atomically; missing folders are made."""
    stem = os.fspath(stem)
    return save_as(fig, f"{stem}.png"), save_as(fig, f"{stem}.svg")


@styled
def save_as(fig: Figure, path: str | os.PathLike[str]) -> Path:
    """Write ``fig`` as one file, atomically; its suffix is .png, .svg or .pdf."""
    if fig.get_layout_engine() is not None:
        _arrange(fig)
    path = Path(path)
    kind = path.suffix[1:]
    with atomic(path) as temporary:
        fig.savefig(temporary, format=kind, metadata=_METADATA[kind])
        if kind == "svg":
            temporary.write_text(_numbered(temporary.read_text("utf-8")), encoding="utf-8", newline="\n")
    return path


@styled
def as_svg(fig: Figure) -> str:
    """``fig`` as an SVG element in an HTML page."""
    if fig.get_layout_engine() is not None:
        _arrange(fig)
    text = io.StringIO()
    fig.savefig(text, format="svg", metadata=_METADATA["svg"])
    # Inside a page there is no XML declaration.
    return text.getvalue()[text.getvalue().index("<svg") :]


def _numbered(svg: str) -> str:
    """An SVG file whose clips, markers and hatchings are numbered by their first use.

    Matplotlib names them by all digits of what they are, of which rounding errors in the data change the last ones.
    """
    named = set(re.findall(r'id="([a-z][0-9a-f]{10})"', svg))
    numbers = dict[str, str]()

    def number(found: re.Match[str]) -> str:
        name = found[0]
        return numbers.setdefault(name, f"{name[0]}{len(numbers)}") if name in named else name

    return re.sub(r"\b[a-z][0-9a-f]{10}\b", number, svg)


def _arrange(fig: Figure) -> None:
    """Lay out a figure once and for all.

    The solver of the layout takes its unknowns in the order of their addresses: what it finds differs by rounding
    errors, of which matplotlib makes other names in an SVG.
    """
    fig.draw_without_rendering()
    fig.set_layout_engine(None)
    for ax in fig.axes:
        left, bottom, width, height = (round(float(share), 6) for share in ax.get_position(original=True).bounds)
        ax.set_position((left, bottom, width, height))


def html(template: str, **values: Any) -> str:
    """The page of a template of the folder ``templates``, with its values, and the version and commit of the code."""
    import jinja2

    loader = jinja2.PackageLoader("stripfold")
    environment = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    return environment.get_template(template).render(version=version(), commit=running_commit(), **values)
