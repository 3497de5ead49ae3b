"""The numbers the project quotes about measuring in pictures and recordings."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stripfold.vision.measure import COVERED
from studies.recordings_accuracy import BOUND, MEASURED, REFUSED, error
from studies.summary.entry import Entry, entry

SMALL_RMS = 0.25
"""Pixels, and mm of the centreline."""
NO_OUTLIER = 3.0
WHOLE_SPAN = 0.222
"""Length of the textile in its photograph that its authors measured, m."""
COVERAGE = (0.93, 0.97)
SMALL_BIAS = 1e-4
MANY = 200
FEW_REFUSED = 0.1
WRONG = 1e-3
FRAMES = 60.0
"""Frames per second that must be measured in a video of 1280 x 720."""
RECORDINGS = 40


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """Entries of ``calibration``, ``centrelines``, ``recordings_accuracy``, ``recordings`` and ``video_benchmark``,
    read from the files ``sources``."""
    return {
        **_calibration(data["calibration"], sources["calibration"]),
        **_centrelines(data["centrelines"], sources["centrelines"]),
        **_accuracy(data["recordings_accuracy"], sources["recordings_accuracy"]),
        **_recordings(data["recordings"], sources["recordings"]),
        **_speed(data["video_benchmark"], sources["video_benchmark"]),
    }


def _calibration(data: xr.Dataset, source: str) -> dict[str, Entry]:
    rms = float(data["rms"].sel(way="scaled"))
    views = data["view_rms"].sel(way="scaled").values
    worst = float(np.max(views) / np.median(views))
    charuco = float(data["charuco_rms"])
    return {
        "calibration_rms": entry(
            rms,
            "pixel",
            f"reprojection error of the public chessboard set, {len(views)} views, the worst {worst:.1f} times the "
            "median",
            f"< {SMALL_RMS:g} pixels, no view over {NO_OUTLIER:g} times the median",
            rms < SMALL_RMS and worst <= NO_OUTLIER,
            source,
            3,
        ),
        "charuco_rms": entry(
            charuco,
            "pixel",
            f"the same of the public ChArUco picture with its published camera, {int(data['charuco_corners'])} corners",
            f"< {SMALL_RMS:g} pixels",
            charuco < SMALL_RMS,
            source,
            3,
        ),
    }


def _centrelines(data: xr.Dataset, source: str) -> dict[str, Entry]:
    rms, span = 1e3 * float(data["centreline_rms"]), float(data["centreline_span"])
    return {
        "centreline_rms": entry(
            rms,
            "mm",
            "distance of the centreline in the photograph of a textile from its authors' midline",
            f"< {SMALL_RMS:g} mm",
            rms < SMALL_RMS,
            source,
            3,
        ),
        "centreline_span": entry(
            1e3 * span, "mm", "horizontal extent of that centreline", ">= 222 mm", span >= WHOLE_SPAN, source, 4
        ),
    }


def _accuracy(data: xr.Dataset, source: str) -> dict[str, Entry]:
    off = error(data)
    outcome, flags = data["outcome"].values, data["flags"].values
    measured = outcome == MEASURED
    inside = np.abs(off) <= COVERED * data["sd"].values[measured]
    count = len(off)
    if not count:
        # Nothing was measured: no criterion may hold.
        off, inside = np.array([10.0 * WRONG]), np.array([False])
    share = float(inside.mean())
    silent = int(np.sum((np.abs(off[:count]) > WRONG) & (flags[measured] == "")))
    refused = float(np.mean(outcome == REFUSED))
    unseen = int(np.sum(outcome == BOUND))
    return {
        "lambda_coverage": entry(
            share,
            "1",
            f"share of the 95 % intervals of lambda that hold the truth, {count} synthetic recordings measured",
            f"{COVERAGE[0]:g} to {COVERAGE[1]:g}, {MANY} recordings or more",
            COVERAGE[0] <= share <= COVERAGE[1] and data.sizes["case"] >= MANY,
            source,
            3,
        ),
        "lambda_bias": entry(
            1e3 * float(np.median(off)),
            "mm",
            f"median error of lambda at the onset in these; mean {1e3 * off.mean():.2f} mm",
            f"< {1e3 * SMALL_BIAS:g} mm",
            abs(np.median(off)) < SMALL_BIAS,
            source,
            2,
        ),
        "lambda_sd": entry(
            1e3 * 1.4826 * float(np.median(np.abs(off - np.median(off)))),
            "mm",
            "standard deviation of the error by its median size; root mean square "
            f"{1e3 * np.sqrt(np.mean(off**2)):.2f} mm",
            "no criterion",
            True,
            source,
            2,
        ),
        "recordings": entry(
            data.sizes["case"],
            "count",
            "synthetic recordings of the design",
            f">= {MANY}",
            data.sizes["case"] >= MANY,
            source,
        ),
        "recordings_failed": entry(
            refused,
            "1",
            f"share of them that end in an error; in {unseen} more no snap is seen",
            f"<= {FEW_REFUSED:g}",
            refused <= FEW_REFUSED,
            source,
            2,
        ),
        "recordings_wrong": entry(
            silent,
            "count",
            f"values more than {1e3 * WRONG:g} mm off without a flag",
            "0",
            silent == 0,
            source,
        ),
    }


def _recordings(data: xr.Dataset, source: str) -> dict[str, Entry]:
    found = data["snapped"].values == 1.0
    above = float(np.mean((data["lambda_event"] > data["lambda_model"]).values[found])) if found.any() else 0.0
    zero = (data["lambda_zero"] > data["lambda_model"]).values[found & np.isfinite(data["lambda_zero"].values)]
    return {
        "measured_above_model": entry(
            above,
            "1",
            f"share of the measured values above the frictionless model's lambda_c, {int(found.sum())} recordings of "
            f"strips with friction; extrapolated to vanishing speed {zero.mean() if len(zero) else 0.0:.2f}",
            "> 0.9, as in the paper",
            above > 0.9,
            source,
            3,
        ),
        "recordings_measured": entry(
            found.sum(),
            "count",
            f"of {len(found)} recordings of the configured materials in which a snap was measured",
            f">= {RECORDINGS}",
            found.sum() >= RECORDINGS,
            source,
        ),
    }


def _speed(data: xr.Dataset, source: str) -> dict[str, Entry]:
    rates = data["rate"].median("run")
    rate = rates.sel(codec="h264")
    memory = data["memory"].median("run").sel(codec="h264").values
    others = ", ".join(
        f"{name} {float(rates.sel(codec=name)[-1]):.0f}" for name in data["codec"].values if name != "h264"
    )
    return {
        "tracking_rate": entry(
            float(rate[-1]),
            "1/s",
            f"frames of 1280 x 720 a second on one core, h264 ({others}), median of {data.sizes['run']} runs",
            f">= {FRAMES:g}",
            float(rate[-1]) >= FRAMES,
            source,
            3,
        ),
        "tracking_memory": entry(
            float(memory[-1] / memory[0]),
            "1",
            f"peak memory with four times as many frames over that with {int(data['length'][0])}",
            "<= 1.05",
            memory[-1] <= 1.05 * memory[0],
            source,
            3,
        ),
    }
