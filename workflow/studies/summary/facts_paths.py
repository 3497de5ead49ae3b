"""Facts about the studies of folding paths, of pictures and recordings, and of other programs; see :mod:`.facts`."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stripfold.arrays import Array
from stripfold.vision.camera_motion import MOVED_BY
from stripfold.vision.measurement import WARNING, half_width
from studies import folding_plans as of_plans
from studies import peers as of_peers
from studies.peers import CRITICAL, EQUILIBRIUM
from studies.random_paths import CONTRADICTED
from studies.recordings_accuracy import BOUND, ETA, MEASURED, error
from studies.recordings_chain import CHAIN
from studies.summary.facts import Facts, seed_of, share

PEER_RATIOS = {"felupe": 10.0, "mujoco": 30.0, "pyelastica": 100.0, "auto": 1.5, "auto_critical": 2.0}
"""Asked of the time of another program over ours."""
WRONG_RECORDING = 1.0
"""Error of lambda, outside the interval, from which a measured value is wrong, mm."""


def tangency(d: xr.Dataset) -> Facts:
    error, thin, thick = np.abs(d.boundary_error), d.thickness.values.argmin(), d.thickness.values.argmax()
    return {
        "error": error.max(),
        "missing": np.isnan(error).sum(),
        "lengths": f"{d.sizes['length']} lengths from {float(d.length.min()):g} to {float(d.length.max()):g}",
        "elastica": np.abs(d.elastica_error).max(),
        "plan": d.plan_error.max(),
        "thinnest": d.thickness[thin],
        "thickest": d.thickness[thick],
        "angle": d.angle[:, thin].max(),
        "angle_thick": d.angle[:, thick].max(),
    }


def assessment(d: xr.Dataset) -> list[Facts]:
    """First touch less the planned one of the R-path, L*, of the strips that fall; one for each of the other paths.

    The worst strip is the one that is least beyond its error on the expected side.
    """
    out = []
    for path, sign, side in (("triangular", -1.0, "short of"), ("circular", 1.0, "beyond")):
        one = d.sel(path=path)
        off, error = ((one[name] / d.gravity_length).values for name in ("touch_error", "touch_uncertainty"))
        line = (one.touch_x / d.gravity_length).values
        fell = one.fell.values == 1.0
        beyond = np.where(fell, sign * off - error, np.inf)
        worst = int(np.argmin(beyond)) if fell.any() else -1
        each, laid, lines = (
            ", ".join(f"{x:+.2f}" for x in values) or "none" for values in (off[fell], off[~fell], line[fell])
        )
        words = {"path": path, "side": side, "bound": "<" if sign < 0.0 else ">", "each": each, "laid": laid}
        words |= {"lines": lines, "errors": error[fell].max(initial=0.0), "falls": fell.sum()}
        found = {"value": off[worst] if worst >= 0 else np.nan, "error": error[worst], "decided": beyond.min() > 0.0}
        out.append(words | found | {"fallen": fell.any()})
    return out


def friction(d: xr.Dataset) -> Facts:
    pull, moment = d.sel(law="pull"), d.suffices.sel(law="hysteresis")
    end = d.deviation_end / d.gravity_length
    both, long = d.two_ways.values == 1.0, d.relative_length.values
    two, one = (", ".join(f"{x:.0f}" for x in long[chosen]) or "none" for chosen in (both, ~both))
    return {
        "two": both.sum(),
        "two_lengths": two,
        "one_lengths": one,
        "completed": (end < 0.05).all("law").sum(),
        "farthest": end.max(),
        "ratio": pull.ratio_max.max(),
        "medians": f"{float(pull.ratio_median.min()):.1e} to {float(pull.ratio_median.max()):.1e}",
        "moment": moment.max(),
        "least_moment": moment.min(),
    }


def friction_steps(d: xr.Dataset) -> Facts:
    pull, moment = (d.suffices.sel(law=law) for law in ("pull", "hysteresis"))
    product = (pull * d.step).values
    return {
        "steps": f"{float(d.step.min()):g} to {float(d.step.max()):g}",
        "k_f": pull.max() / pull.min(),
        "products": f"{product.min():.4f} to {product.max():.4f}",
        "spread": product.max() / product.min(),
        "M_0": moment.max() / moment.min(),
    }


def random_paths(d: xr.Dataset) -> Facts:
    outcome = d.outcome.values
    messages = d.message.values[outcome == "undecided"]
    names = ("stable", "critical", "close", "refused", "undecided")
    return {
        "paths": len(outcome),
        "seed": seed_of(d),
        "counts": ", ".join(f"{np.sum(outcome == name)} {name}" for name in names),
        "apart": np.abs(d.critical - d.again).values[outcome == "critical"].max(initial=0.0),
        "undecided": len(messages),
        "contradicted": np.sum(messages == CONTRADICTED),
    }


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
    """eta_b by the motion, of the films that begin as early as docs/measuring.md asks, and of the second generator's."""
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


def sweeps(d: xr.Dataset) -> Facts:
    one, rod = d.sel(model="elastica"), d.sel(model="rod")
    return {
        **{name: one[name] for name in ("scenes", "snaps", "wall", "memory")},
        "none": (d.scenes - d.results).sum(),
        "apart": d.apart.max(),
        "checked": d.attrs["checked"],
        "rod_scenes": rod.scenes,
        "rod": rod.results / rod.wall,
        "elastica": one.results / one.wall,
        "cost": rod.cost,
        "elastica_cost": one.cost,
        "million": rod.cost * 1e6 / 3600.0,
        "elastica_million": one.cost * 1e6 / 3600.0,
        "dry_run": d.attrs.get("dry_run", np.nan),
        "jobs_scenes": one.scenes,
    }


def folding_plans(d: xr.Dataset) -> Facts:
    path, none = d.path.values, d.path.values == of_plans.REFUSED
    safe = d.safe.values[np.isfinite(d.safe.values)]
    kinds = [name for name in np.unique(path) if name not in (of_plans.REFUSED, of_plans.FAILED)]
    return {
        "cases": len(path),
        "failed": (path == of_plans.FAILED).sum(),
        "planned": safe.size,
        "kinds": ", ".join(f"{(path == name).sum()} {name}" for name in kinds),
        "paths": len(kinds),
        "safe": share(safe == 1.0),
        "none": none.sum(),
        "unconfirmed": (none & (d.confirmed.values != 1.0)).sum(),
        "seconds": np.median(d.seconds.values),
        "longest": d.seconds.values.max(),
    }


def peers(d: xr.Dataset) -> list[Facts]:
    """One for every question that both a program and our model beside it answered."""
    out = []
    for question, suffix, task in ((EQUILIBRIUM, "", "one equilibrium"), (CRITICAL, "_critical", "one critical point")):
        for name, ours in of_peers.COUNTERPARTS.items():
            (seconds, error), (own, own_error) = (of_peers.fastest(d, one, question) for one in (name, ours))
            if np.isfinite(seconds / own):
                reached = [e <= of_peers.RATIO_TOLERANCE for e in (error, own_error)]
                asked = PEER_RATIOS.get(name + suffix)
                bound = f">= {asked:g}, and " if asked else ""
                words = {
                    "key": name + suffix,
                    "asked": bound,
                    "program": of_peers.TITLES[name],
                    "task": task,
                    "ours": ours,
                }
                note = "" if reached[0] else f"; it reached {error:.0e} only"
                out.append({**words, "seconds": seconds, "ratio": seconds / own, "note": note, "both": all(reached)})
    return out


def conventions(d: xr.Dataset) -> Facts:
    """Stored files that do not conform."""
    wrong = d.file.values[d.cf_errors.values > 0]
    return {
        "errors": d.cf_errors.sum(),
        "files": d.sizes["file"],
        "which": ", ".join(map(str, wrong)) or "none",
        "omissions": d.acdd_omissions.sum(),
    }


def project(d: xr.Dataset) -> Facts:
    """From attributes: ``stale`` (names with commas between) and numbers that are counted elsewhere."""
    stale = [name.strip() for name in d.attrs["stale"].split(",") if name.strip()]
    return {**d.attrs, "stale": len(stale), "names": ", ".join(stale) or "none"}
