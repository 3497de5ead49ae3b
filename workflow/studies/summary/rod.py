"""The numbers quoted about the rod: how far it is from the solid, and how fast."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from studies.summary.entry import Entry, entry

PAPERS = 0.06
"""Thicknesses up to the paper's, which is 0.0594 L* at eta_b = 3780 and less for softer strips, L*."""


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """Entries of ``rod`` and ``rod_benchmark``, read from the files ``sources``."""
    rod, source = data["rod"], sources["rod"]
    thin = rod.sel(thickness=rod["thickness"] <= PAPERS)
    error, mesh = float(np.abs(thin["model_error"]).max()), float((thin["mesh_error"] / thin["lambda_c"]).max())
    top = float(rod["thickness"].max())
    thickest = float(np.abs(rod["model_error"].sel(thickness=top)).max())
    times, of_times = data["rod_benchmark"], sources["rod_benchmark"]
    seconds, estimated = float(times["seconds"].median()), float(times["estimated_error"])
    assessing, apart = float(times["seconds_assess"].median()), float(times["apart"])
    return {
        "rod_model_error": entry(
            error,
            "1",
            f"largest relative distance of the rod's lambda_c from the solid's up to h = {PAPERS:g} L*, meshes good "
            f"for {mesh:.0e}; at h = {top:g} L* it is {thickest:.0e}",
            "< 1e-3",
            error < 1e-3,
            source,
            2,
        ),
        "time_rod_1e-3": entry(
            seconds,
            "s",
            f"median time of one lambda_c of the rod with its error estimate ({estimated:.0e} relative), one core, "
            "warmed process",
            "<= 0.1 s at 1e-3",
            seconds <= 0.1 and estimated <= 1e-3,
            of_times,
            3,
        ),
        "time_assess_rod": entry(
            assessing,
            "s",
            "median time of one R-path assessed on the rod with its fall, one core, warmed process; critical point and "
            f"first touch {apart:.0e} of the length from the solid's",
            "<= 1 s at 5e-3",
            assessing <= 1.0 and apart <= 5e-3,
            of_times,
            3,
        ),
    }
