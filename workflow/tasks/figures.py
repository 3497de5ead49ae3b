"""Figures from stored datasets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

import xarray as xr

from stripfold.plots.save import save


def figure(drawing: str, data: Sequence[xr.Dataset], options: Mapping[str, Any], output: Any) -> None:
    """Draw a figure with the function ``drawing``, "module:name", and store it as PNG and SVG."""
    module, _, name = drawing.partition(":")
    save(getattr(import_module(module), name)(*data, **options), output.png.removesuffix(".png"))
