"""Facts about the studies of pictures and recordings; see :mod:`.facts`."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stripfold.base.arrays import Array
from stripfold.film.camera_motion import MOVED_BY
from stripfold.film.measure import WARNING, half_width
from studies.recordings_accuracy import BOUND, ETA, MEASURED, error
from studies.recordings_chain import CHAIN
from studies.summary.facts import Facts, seed_of, share

WRONG_RECORDING = 1.0
"""Error of lambda, outside the interval, from which a measured value is wrong, mm."""


def calibration(d: xr.Dataset) -> Facts:
    views = d.view_rms.sel(way="scaled")
    return {"rms": d.rms.sel(way="scaled"), "views": views.size, "worst": views.max() / views.median()}


def centrelines(d: xr.Dataset) -> Facts:
    return {"rms": 1e3 * d.centreline_rms, "span": 1e3 * d.centreline_span}


def strip_looks(d: xr.Dataset) -> Facts:
    """In mm."""
    off = 1e3 * np.abs(d.event - d.truth).values
    measured = np.isfinite(off)
    inside = (d.low <= d.truth) & (d.truth <= d.high)
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "measured": measured.sum(),
        "outside": np.sum(measured & ~inside.values),
        "worst": off[measured].max(initial=0.0),
    }


def camera_bump(d: xr.Dataset) -> Facts:
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "noticed": d.noticed.sum(),
        "before": d.before.sum(),
        "chain": np.sum(d.generator.values == "chain"),
        "share": d.noticed.mean(),
    }


def markerless(d: xr.Dataset) -> Facts:
    """In mm."""
    off, inside = 1e3 * (d.event - d.truth).values, (d.low <= d.truth) & (d.truth <= d.high)
    known = np.isfinite(off)
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "measured": known.sum(),
        "share": share(inside.values[known]),
        "rms": np.sqrt(np.mean(off[known] ** 2)) if known.any() else np.nan,
        "half": np.median(5e2 * (d.high - d.low).values[known]) if known.any() else np.nan,
    }


def eta_pictures(d: xr.Dataset) -> Facts:
    known = np.isfinite(d.eta.values)
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "refused": np.sum(~known),
        "share": share(((d.low <= 1.0) & (d.high >= 1.0)).values),
        "error": np.median(np.abs(d.eta.values[known] - 1.0)) if known.any() else np.nan,
        "half": np.median((d.high - d.low).values[known]) / 2.0 if known.any() else np.nan,
        "given": d.given.sum(),
        "empty": d.sizes["picture"],
    }


def recordings_accuracy(d: xr.Dataset) -> Facts:
    """In mm; nan where nothing was measured, so that no criterion holds."""
    outcome, off = d.outcome.values, 1e3 * error(d)
    flags, sd, sound = (d[name].values[outcome == MEASURED] for name in ("flags", "sd", "sound"))
    refused, sound = ~np.isin(outcome, (MEASURED, BOUND)), sound == 1.0
    warned = np.array([WARNING in text for text in flags], dtype=bool)
    inside = {level: np.abs(off) <= 1e3 * half_width(level) * sd for level in (0.5, 0.95)}
    wrong = (np.abs(off) > WRONG_RECORDING) & ~inside[0.95]
    some = off if off.size else np.array([np.nan])
    median = np.median(some)
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "measured": off.size,
        "share": share(inside[0.95]),
        "half": share(inside[0.5]),
        "share_error": np.sqrt(0.95 * 0.05 / max(off.size, 1)),
        "half_error": np.sqrt(0.25 / max(off.size, 1)),
        "median": median,
        "mean": some.mean(),
        "rms": np.sqrt(np.mean(some**2)),
        "sd": 1.4826 * np.median(np.abs(some - median)),
        "refused_share": share(refused),
        "refused": refused.sum(),
        "unseen": np.sum(outcome == BOUND),
        "wrong": np.sum(wrong & ~warned),
        "wrong_all": wrong.sum(),
        "warned": share(warned[sound]),
        "sound": sound.sum(),
        "sound_rms": np.sqrt(np.mean(off[sound] ** 2)) if sound.any() else np.nan,
        "sound_worst": np.abs(off[sound]).max() if sound.any() else np.nan,
        "camera_moved": sum(MOVED_BY in text for text in (*d.flags.values, *d.message.values)),
        "generators": _by_generator(d.generator.values[outcome == MEASURED], off, inside[0.95]),
        **_clock_facts(d),
        **_eta_facts(d),
    }


def _eta_facts(d: xr.Dataset) -> Facts:
    """eta_b by the motion, of films that begin as early as docs/measuring.md asks, and of the second generator's."""
    found: Facts = {}
    for kind in ("", "fitted_"):
        eta, low, high = (d[kind + name].values for name in ETA)
        known, inside = np.isfinite(eta), (low <= 1.0) & (high >= 1.0)
        for of, mine in (("", d.generator.values != CHAIN), ("chain_", d.generator.values == CHAIN)):
            used = known & mine
            off = np.abs(eta[used] - 1.0) if used.any() else np.array([np.nan])
            found |= {
                f"{of}{kind}eta": np.median(off),
                f"{of}{kind}eta_worst": off.max(),
                f"{of}{kind}eta_share": share(inside[used]),
                f"{of}{kind}eta_half": np.median((high - low)[used]) / 2.0 if used.any() else np.nan,
                f"{of}{kind}eta_measured": used.sum(),
                f"{of}eta_cases": np.sum(np.isfinite(d.moment.values) & mine),
            }
    excess = (d.fitted_moment - d.moment).values[d.generator.values != CHAIN]
    return found | {"excess": np.median(excess[np.isfinite(excess)]) if np.isfinite(excess).any() else np.nan}


def _clock_facts(d: xr.Dataset) -> Facts:
    """How far the clocks' offset is off, ms, in all recordings whose clocks were synchronised."""
    names = ("clock_offset", "clock_truth", "clock_sd")
    found, truth, sd = (d[name].values[np.isfinite(d.clock_sd.values)] for name in names)
    off = np.abs(found - truth)
    return {
        "clocks": off.size,
        "clock_share": share(off <= half_width(0.95) * sd),
        "clock_half": share(off <= half_width(0.5) * sd),
        "clock_median": 1e3 * np.median(off) if off.size else np.nan,
        "clock_rms": 1e3 * np.sqrt(np.mean(off**2)) if off.size else np.nan,
    }


def _by_generator(generator: Array, off: Array, inside: Array) -> str:
    """The share of intervals that hold the truth and the root mean square error, mm, for each generator, in words."""
    return "; ".join(
        f"{name} {inside[mine].mean():.3f} of {mine.sum()}, {np.sqrt(np.mean(off[mine] ** 2)):.2f} mm"
        for name in np.unique(generator)
        for mine in [generator == name]
    )


def recordings(d: xr.Dataset) -> Facts:
    found = d.snapped.values == 1.0
    event, zero, model = (d[name].values[found] for name in ("lambda_event", "lambda_zero", "lambda_model"))
    above = (zero > model)[np.isfinite(zero)]
    return {"all": len(found), "measured": found.sum(), "above": share(event > model), "zero": share(above)}


def video_benchmark(d: xr.Dataset) -> Facts:
    rate, frames = d.rate.median("run").values, d["length"].values
    return {
        "rate": rate[-1],
        "short": rate[0],
        "frames": frames[0],
        "many": frames[-1],
        "memory": d.memory.values[-1] / d.memory.values[0],
        "seconds": d.render_seconds + d.measure_seconds,
        **{name: d[f"{name}_seconds"] for name in ("motion", "render", "measure")},
    }
