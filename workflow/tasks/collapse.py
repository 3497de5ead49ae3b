"""One strip through its collapse."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from stripfold.ask import collapse as analysis
from stripfold.ask.inputs import Simulation


def collapse(scene: Path, progress: Callable[[str], None]) -> xr.Dataset:
    """One strip through its collapse."""
    return analysis.run(Simulation.read(scene), progress)
