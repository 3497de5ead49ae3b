"""Observed order of lambda_c in the element size, on uniform meshes.

The floor holds nodes, so the error depends on where along an element the strip lifts off.  Each element size is
therefore run with its mesh shifted in several phases, and the error is the root mean square over them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stripfold.analysis.static import StripModel, XRun, along_x, lift, solve_height
from stripfold.arrays import Array


def uniform(length: float, size: float, phase: float) -> Array:
    """Element boundaries of one size, shifted by ``phase`` (0 to 1) of an element; the end elements are longer."""
    inner = np.arange(size * (1.0 + phase), length - 1.4 * size, size)
    return np.concatenate([[0.0], inner, [length]])


def _largest(run: XRun) -> float:
    """The largest lambda reached: on a uniform mesh the teeth of the contact may split the maximum in several."""
    return run.last.lam + run.slack


def run(
    length_star: float, thickness: float, height: float, sizes: Sequence[float], phases: int, reference: float
) -> xr.Dataset:
    """lambda_c on uniform meshes against the planned mesh at refinement ``reference``; all in L*."""
    strip = StripModel(length_star, thickness)
    truth = solve_height(strip, height, reference, past=0.0).last.lam
    (_, model, state) = next(lift(strip, [height]))
    shifts = np.arange(phases) / phases
    lambda_c = np.array(
        [
            [
                _largest(along_x(strip, height, (model, state), uniform(length_star, size, shift), past=0.0))
                for shift in shifts
            ]
            for size in sizes
        ]
    )
    error = np.sqrt(np.mean((lambda_c - truth) ** 2, axis=1))
    slope = np.polyfit(np.log(np.asarray(sizes)), np.log(error), 1)[0]
    return xr.Dataset(
        {
            "lambda_c": (("size", "phase"), lambda_c, {"units": "1", "long_name": "lambda_c / L*"}),
            "reference": ((), truth, {"units": "1", "long_name": "lambda_c / L* on the planned mesh"}),
            "error": ("size", error, {"units": "1", "long_name": "rms error of lambda_c / L* over the phases"}),
            "order": ((), slope, {"units": "1", "long_name": "observed order, fitted over all sizes"}),
        },
        coords={
            "size": ("size", list(sizes), {"units": "1", "long_name": "element length / L*"}),
            "phase": ("phase", shifts, {"units": "1", "long_name": "shift of the mesh, in elements"}),
        },
        attrs={"length_star": length_star, "thickness": thickness, "height_star": height},
    )
