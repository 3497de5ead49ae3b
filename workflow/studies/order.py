"""Observed order of lambda_c in the element size, on uniform meshes.

The floor holds nodes, so the error depends on where along an element the strip lifts off.  Each element size is
therefore run with its mesh shifted in several phases, and the error is the root mean square over them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stripfold.analysis.nodal import along_x, lift, solve_height
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from studies.common import blank, dataset


def uniform(length: float, size: float, phase: float) -> Array:
    """Element boundaries of one size, shifted by ``phase`` (0 to 1) of an element; the end elements are longer."""
    inner = np.arange(size * (1.0 + phase), length - 1.4 * size, size)
    return np.concatenate([[0.0], inner, [length]])


def run(
    length_star: float, thickness: float, height: float, sizes: Sequence[float], phases: int, reference: float
) -> xr.Dataset:
    """lambda_c on uniform meshes against the planned mesh at refinement ``reference``; all in L*."""
    strip = StripModel(length_star, thickness)
    truth = solve_height(strip, height, reference, past=0.0).lam
    (_, model, state) = next(lift(strip, [height]))
    shifts = [phase / phases for phase in range(phases)]
    lambda_c = blank(len(sizes), phases)
    for i, j in np.ndindex(lambda_c.shape):
        mesh = uniform(length_star, sizes[i], shifts[j])
        found = along_x(strip, height, (model, state), mesh, past=0.0)
        # The largest lambda reached: on a uniform mesh contact switching may split the maximum in several.
        lambda_c[i, j] = found.lam + found.slack
    error = np.sqrt(np.mean((lambda_c - truth) ** 2, axis=1))
    return dataset(
        "order",
        {
            "size": ("size", sizes),
            "phase": ("phase", shifts),
            "lambda_c": (("size", "phase"), lambda_c),
            "reference": ((), truth),
            "error": ("size", error),
            "order": ((), np.polyfit(np.log(sizes), np.log(error), 1)[0]),
        },
        {"length_star": length_star, "thickness": thickness, "height_star": height},
    )
