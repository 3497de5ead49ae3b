"""Facts about each stored dataset: the quoted values, and whatever their statements and criteria mention."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from stripfold.analysis import needed_effects
from stripfold.errors import CoarseMeshError
from stripfold.vision.measure import Z_95
from studies import branches as of_branches
from studies import peers as of_peers
from studies.peers import CRITICAL, EQUILIBRIUM
from studies.random_paths import CONTRADICTED
from studies.recordings_accuracy import BOUND, MEASURED, REFUSED, error
from studies.schemes import CONSERVING, DEFAULT

Facts = dict[str, Any]
"""Numbers (also arrays without dimensions) and texts by name."""

PAPERS_THICKNESS = 0.06
"""Thicknesses up to the paper's, which is 0.0594 L* at eta_b = 3780 and less for softer strips, L*."""
HEIGHT = 3.0
"""Gripper height at which times are quoted, L*."""
WRONG_RECORDING = 1.0
"""Error of lambda from which a measured value is wrong, mm."""


def seed_of(d: xr.Dataset) -> str:
    """How the sample of a study is named."""
    return f"seed {int(d.attrs['seed'])}" if "seed" in d.attrs else "seed not stored"


def share(chosen: np.ndarray) -> float:
    """Share of True; nan of nothing, which meets no criterion."""
    return float(np.mean(chosen)) if np.size(chosen) else float("nan")


def process(d: xr.Dataset) -> Facts:
    """Of a timed process."""
    return {"seconds": d["wall"].median(), "memory": d.memory, "error": d.get("error", np.nan)}


def points(d: xr.Dataset) -> Facts:
    unit, found = d.gravity_length, np.isfinite(d.lambda_c)
    return {
        "found": found.sum(),
        "no_snap": (d.snap == 0.0).sum(),
        "error": (d.lambda_error / d.lambda_c).where(found).max(),
        "bracket": ((d.lambda_c_upper - d.lambda_c_lower) / unit).where(found).max(),
    }


def deviation(d: xr.Dataset, master: xr.Dataset) -> Facts:
    lambda_c = (d.lambda_c / d.gravity_length).values
    curve = np.interp((d.height / d.gravity_length).values, master.z.values, master.lambda_c.values)
    return {"found": np.isfinite(lambda_c).sum(), "deviation": np.nanmax(np.abs(lambda_c / curve - 1.0))}


def limit(d: xr.Dataset) -> list[Facts]:
    """One for each eta_m."""
    out = []
    for i, eta_m in enumerate(d.eta_m.values):
        value, mesh = (np.abs(x) / d.lambda_c_elastica for x in (d.difference[i, -1], d.mesh_error[i]))
        order, first = float(d.order[i]), i == 0
        text = "" if first else f", order {order:.2f} in eta_m"
        rule = "no criterion: the largest eta_m has no order" if first else "order 1 in eta_m within 0.1"
        holds = first or abs(order - 1.0) < 0.1
        out.append({"eta_m": eta_m, "error": value, "mesh": mesh, "order": text, "rule": rule, "first_order": holds})
    return out


def rod(d: xr.Dataset) -> Facts:
    thin, thickest = d.sel(thickness=d.thickness <= PAPERS_THICKNESS), d.sel(thickness=d.thickness.max())
    return {
        "error": np.abs(thin.model_error).max(),
        "mesh": (thin.mesh_error / thin.lambda_c).max(),
        "papers": PAPERS_THICKNESS,
        "top": thickest.thickness,
        "thickest": np.abs(thickest.model_error).max(),
    }


def branches(d: xr.Dataset) -> Facts:
    wrong, failed = ((d.verdict == verdict).sum() for verdict in (of_branches.WRONG, of_branches.FAILED))
    return {"cases": d.sizes["case"], "seed": seed_of(d), "wrong": wrong, "failed": failed}


def accuracy(d: xr.Dataset) -> Facts:
    solid = d.sel(asked="solid", accuracy=1e-3)
    return {
        "z": HEIGHT,
        "seconds": solid.preset_seconds.sel(height=HEIGHT),
        "estimate": solid.preset_estimate.sel(height=HEIGHT),
        "off": np.abs(solid.preset_error).max(),
        "slowest": solid.preset_seconds.max(),
        "elastica": d.elastica_seconds.sel(height=HEIGHT),
        "slowest_elastica": d.elastica_seconds.max(),
        "apart": np.abs(d.elastica_error).max(),
    }


def estimates(d: xr.Dataset) -> Facts:
    """A scene without a number counts as one whose error is beyond its estimate."""
    within, asked = (d.error <= d.estimate).values, d.asked.values
    return {
        "share": share(within),
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "missing": np.sum(~np.isfinite(d.error.values + d.estimate.values)),
        "by_model": ", ".join(f"{name} {share(within[asked == name]):.2f}" for name in np.unique(asked)),
    }


def hard_cases(d: xr.Dataset) -> Facts:
    # So written, nan counts as failed.
    failed = ~(d.failed.values == 0.0)
    names = ", ".join(d["name"].values[failed])
    errors = np.sum(d.outcome.values != "value")
    cases = d.sizes["case"]
    return {
        "cases": cases,
        "errors": errors,
        "values": cases - errors,
        "failed": failed.sum(),
        "names": names or "none",
    }


def effects(d: xr.Dataset) -> Facts:
    needed, idle = d.needed == 1.0, d.needed == 0.0
    # The effect's own clock is more precise than the difference of two runs, which is mostly noise of the machine.
    cost = d.clocked.fillna(d.cost).where(idle)
    lacking = needed & (d.matters == 1.0)
    largest = [(name, float(cost.sel(effect=name).max())) for name in d.effect.values]
    return {
        "cost": cost.max(),
        "by_effect": ", ".join(f"{name} {value:+.1%}" for name, value in largest if np.isfinite(value)),
        "solid": needed_effects.SOLID,
        "idle": idle.sum(),
        "changed": (idle & (d.matters != 0.0)).sum(),
        "lacking": lacking.sum(),
        "unseen": (lacking & (d.reported != 1.0)).sum(),
        "failed": (~(needed | idle)).sum(),
    }


def cold_run(d: xr.Dataset) -> Facts:
    shares = zip(d.rule.values[:3], (d.seconds / d.seconds.sum()).values, strict=False)
    most = ", ".join(f"{name} {part:.0%}" for name, part in shares)
    return {"wall": d.attrs["wall"], "jobs": int(d.jobs.sum()), "most": most}


def schemes(d: xr.Dataset) -> Facts:
    chosen, conserving, steps = d.sel(scheme=DEFAULT), d.sel(scheme=CONSERVING), d.swing_step.values
    oscillator, swing = float(chosen.oscillator_order), float(chosen.swing_order)
    return {
        "oscillator": oscillator,
        "swing": swing,
        "order": min(oscillator, swing),
        "steps": f"{steps[0]:g} to {steps[-1]:g}",
        "drift": np.abs(conserving.drift),
        "contact": conserving.contact_share,
        "numerical": chosen.numerical_share,
    }


def modes(d: xr.Dataset) -> Facts:
    return {"error": d.motion_error.isel(steps=-1).max(), "steps": d.steps[-1], "linear": d.solid_error.max()}


def lag(d: xr.Dataset) -> list[Facts]:
    """Without damping, and in air."""
    out = []
    for suffix, damping, theory in (("", "no damping", "4/5"), ("_damped", f"air drag {d.attrs['air']:g}", "2/3")):
        slope, half_width = d[f"exponent{suffix}"], d[f"exponent_half_width{suffix}"]
        speed, ratio = d[f"speed{suffix}"].values, (d[f"lag{suffix}"] / d[f"expected{suffix}"]).values
        apart = np.abs(slope - d[f"theory{suffix}"])
        ratios, speeds = f"{ratio.min():.2f} to {ratio.max():.2f}", f"{speed.min():g} to {speed.max():g}"
        words = {"suffix": suffix, "damping": damping, "theory": theory, "ratios": ratios, "speeds": speeds}
        out.append({**words, "count": speed.size, "slope": slope, "half_width": half_width, "apart": apart})
    return out


def lag_limit(d: xr.Dataset) -> Facts:
    return {"error": np.abs(d.limit - d.lambda_c), "damped": np.abs(d.limit_damped - d.lambda_c)}


def falls(d: xr.Dataset) -> Facts:
    same = ["half the step", "other sign"]
    coarse, base, fine = d.touch_x.sel(case=["coarse mesh", "base", "fine mesh"]).values
    return {
        "cases": d.sizes["case"],
        "failed": np.isnan(d.touch_x).sum(),
        "penetration": np.maximum(-d.minimal_gap.min(), 0.0),
        "gain": d.closing.max(),
        "same": " and ".join(same),
        "spread": d.distance.sel(case=same).max(),
        "coarse": abs(coarse - base),
        "fine": abs(base - fine),
        "rest": d.handed_over.max(),
    }


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
    """First touch less the landing place of the folded state, L*, of the strips that fall; one for each path."""
    out = []
    for path, which, side, bound in (
        ("triangular", "largest", "short of", "<"),
        ("circular", "smallest", "beyond", ">"),
    ):
        error = (d.touch_error / d.gravity_length).sel(path=path).values
        fell = d.fell.sel(path=path).values == 1.0
        fallen = error[fell] if fell.any() else np.array([np.nan])
        worst = fallen.max() if which == "largest" else fallen.min()
        each, laid = (", ".join(f"{x:+.2f}" for x in error[one]) or "none" for one in (fell, ~fell))
        words = {"path": path, "which": which, "side": side, "bound": bound, "each": each, "laid": laid}
        out.append({**words, "value": worst, "falls": fell.sum()})
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
        "coarse": sum(text.startswith(CoarseMeshError.__name__) for text in messages),
        "contradicted": np.sum(messages == CONTRADICTED),
        "typed": sum("Error: " in text for text in messages),
    }


def calibration(d: xr.Dataset) -> Facts:
    views = d.view_rms.sel(way="scaled")
    return {"rms": d.rms.sel(way="scaled"), "views": views.size, "worst": views.max() / views.median()}


def centrelines(d: xr.Dataset) -> Facts:
    return {"rms": 1e3 * d.centreline_rms, "span": 1e3 * d.centreline_span}


def recordings_accuracy(d: xr.Dataset) -> Facts:
    """In mm; nan where nothing was measured, so that no criterion holds."""
    outcome, off = d.outcome.values, 1e3 * error(d)
    flags, sd = (d[name].values[outcome == MEASURED] for name in ("flags", "sd"))
    flagged, wrong = flags != "", np.abs(off) > WRONG_RECORDING
    some = off if off.size else np.array([np.nan])
    median = np.median(some)
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "measured": off.size,
        "share": share(np.abs(off) <= 1e3 * Z_95 * sd),
        "median": median,
        "mean": some.mean(),
        "rms": np.sqrt(np.mean(some**2)),
        "sd": 1.4826 * np.median(np.abs(some - median)),
        "refused_share": share(outcome == REFUSED),
        "refused": np.sum(outcome == REFUSED),
        "unseen": np.sum(outcome == BOUND),
        "wrong": np.sum(wrong & ~flagged),
        "flagged": flagged.sum(),
        "flagged_wrong": np.sum(wrong & flagged),
    }


def recordings(d: xr.Dataset) -> Facts:
    found = d.snapped.values == 1.0
    event, zero, model = (d[name].values[found] for name in ("lambda_event", "lambda_zero", "lambda_model"))
    above = (zero > model)[np.isfinite(zero)]
    return {"all": len(found), "measured": found.sum(), "above": share(event > model), "zero": share(above)}


def video_benchmark(d: xr.Dataset) -> Facts:
    rates = d.rate.median("run").isel(length=-1)
    memory = d.memory.median("run").sel(codec="h264")
    others = ", ".join(f"{name} {float(rates.sel(codec=name)):.0f}" for name in d.codec.values if name != "h264")
    ratio = memory[-1] / memory[0]
    return {"rate": rates.sel(codec="h264"), "others": others, "memory": ratio, "frames": d["length"][0]}


def peers(d: xr.Dataset) -> list[Facts]:
    """One for every question that both a program and our model beside it answered."""
    out = []
    for question, suffix, task in ((EQUILIBRIUM, "", "one equilibrium"), (CRITICAL, "_critical", "one critical point")):
        for name, ours in of_peers.COUNTERPARTS.items():
            (seconds, error), (own, own_error) = (of_peers.fastest(d, one, question) for one in (name, ours))
            if np.isfinite(seconds / own):
                reached = [e <= of_peers.RATIO_TOLERANCE for e in (error, own_error)]
                words = {"key": name + suffix, "program": of_peers.TITLES[name], "task": task, "ours": ours}
                note = "" if reached[0] else f"; it reached {error:.0e} only"
                out.append({**words, "seconds": seconds, "ratio": seconds / own, "note": note, "both": all(reached)})
    return out


def project(d: xr.Dataset) -> Facts:
    """From attributes: ``stale`` (names with commas between), ``studies``, ``package_lines`` and ``ci_seconds``."""
    stale = [name.strip() for name in d.attrs["stale"].split(",") if name.strip()]
    return {**d.attrs, "stale": len(stale), "names": ", ".join(stale) or "none"}
