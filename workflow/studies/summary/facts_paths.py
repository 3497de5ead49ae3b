"""Facts about the studies of folding paths and of other programs; see :mod:`.facts`."""

from __future__ import annotations

import numpy as np
import xarray as xr

from studies import folding_plans as of_plans
from studies import peers as of_peers
from studies.peers import CRITICAL, EQUILIBRIUM
from studies.random_paths import CONTRADICTED
from studies.summary.facts import Facts, seed_of, share

PEER_RATIOS = {"felupe": 10.0, "mujoco": 30.0, "pyelastica": 100.0, "auto": 1.5, "auto_critical": 2.0}
"""Asked of the time of another program over ours."""


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
        "timed": np.isfinite(d.speed_seconds).sum(),
        "r_paths_refused": np.nansum(d.r_path_refused),
        "still_seconds": np.nanmedian(d.still_seconds),
        "still_longest": np.nanmax(d.still_seconds),
        "speed_seconds": np.nanmedian(d.speed_seconds),
        "speed_longest": np.nanmax(d.speed_seconds),
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
