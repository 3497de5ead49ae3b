"""Facts about each stored dataset: the quoted values, and whatever their statements and criteria mention."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from stripfold.ask import collapse_record
from stripfold.ask.model_error import solid_error
from studies import branches as of_branches
from studies import estimates as of_estimates
from studies.schemes import CONSERVING, DEFAULT

Facts = dict[str, Any]
"""Numbers (also arrays without dimensions) and texts by name."""

PAPERS_THICKNESS = 0.06
"""Thicknesses up to the paper's, which is 0.0594 L* at eta_b = 3780 and less for softer strips, L*."""
HEIGHT = 3.0
"""Gripper height at which times are quoted, L*."""


def seed_of(d: xr.Dataset) -> str:
    """How the sample of a study is named."""
    return f"seed {int(d.attrs['seed'])}" if "seed" in d.attrs else "seed not stored"


def share(chosen: np.ndarray) -> float:
    """Share of True; nan of nothing, which meets no criterion."""
    return float(np.mean(chosen)) if np.size(chosen) else float("nan")


def process(d: xr.Dataset) -> Facts:
    """Of a timed process."""
    return {"seconds": d["wall"].median(), "memory": d.memory, "error": d.get("error", np.nan)}


def robot_log(d: xr.Dataset) -> Facts:
    smooth, noisy = float(d.smooth_wall.median()), float(d.noisy_wall.median())
    return {"cost": noisy / smooth, "smooth": smooth, "noisy": noisy, "mb": d.noisy_memory, "apart": 1e3 * d.apart}


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
    curve = np.interp((d.gripper_height / d.gravity_length).values, master.z.values, master.lambda_c.values)
    return {"found": np.isfinite(lambda_c).sum(), "deviation": np.nanmax(np.abs(lambda_c / curve - 1.0))}


def limit(d: xr.Dataset) -> list[Facts]:
    """One for each eta_m."""
    out = []
    for i, eta_m in enumerate(d.eta_m.values):
        value, mesh = (np.abs(x[i]) / d.lambda_c_elastica for x in (d.difference, d.mesh_error))
        order, first = float(d.order[i]), i == 0
        text = "" if first else f", order {order:.2f} in eta_m"
        rule = "no criterion: the largest eta_m has no order" if first else "order 1 in eta_m within 0.1"
        holds = first or abs(order - 1.0) < 0.1
        out.append({"eta_m": eta_m, "error": value, "mesh": mesh, "order": text, "rule": rule, "first_order": holds})
    return out


def _derived(d: xr.Dataset, one: str, other: str) -> xr.DataArray:
    """The derived relative distance of two sections."""
    apart = d.derived.sel(section=one) - d.derived.sel(section=other)
    return apart * d.thickness**2 / d.lambda_c_elastica


def rod(d: xr.Dataset) -> Facts:
    thin, thickest = d.sel(thickness=d.thickness <= PAPERS_THICKNESS), d.sel(thickness=d.thickness.max())
    return {
        "error": np.abs(thin.model_error).max(),
        "mesh": (thin.mesh_error / thin.lambda_c).max(),
        "papers": PAPERS_THICKNESS,
        "top": thickest.thickness,
        "thickest": np.abs(thickest.model_error).max(),
        "derived": np.abs(thin.model_error - _derived(thin, "rod", "solid")).max(),
        "one_across": np.abs(_derived(thin, "solid", "exact")).max(),
    }


def branches(d: xr.Dataset) -> Facts:
    wrong, failed = ((d.verdict == verdict).sum() for verdict in (of_branches.WRONG, of_branches.FAILED))
    return {"cases": d.sizes["case"], "seed": seed_of(d), "wrong": wrong, "failed": failed}


def spurious(strips: xr.Dataset, paths: xr.Dataset) -> Facts:
    # Files of an earlier version have none compared.
    strip, path = (d.get("spurious_limit_points", d.case[:0]).dropna("case") for d in (strips, paths))
    return {
        "strips": strip.size,
        "paths": path.size,
        "drawn": paths.sizes["case"],
        "refused": (paths.outcome == "refused").sum(),
        "spurious": float(strip.sum()) + float(path.sum()),
    }


def order(d: xr.Dataset) -> Facts:
    return {
        "rod": d.order.sel(model="rod"),
        "solid": d.order.sel(model="solid"),
        "coarsest": int(d.elements.isel(parts=0).min()),
        "elements": int(d.elements.isel(parts=-1).min()),
        "cost": d.cost_order.max(),
    }


def accuracy(d: xr.Dataset) -> Facts:
    solid = d.sel(asked="solid", accuracy=1e-3)
    return {
        "z": HEIGHT,
        "seconds": solid.preset_seconds.sel(gripper_height=HEIGHT),
        "estimate": solid.preset_estimate.sel(gripper_height=HEIGHT),
        "off": np.abs(solid.preset_error).max(),
        "across": solid_error(float(d.attrs["thickness_star"]), 0.0, HEIGHT),
        "slowest": solid.preset_seconds.max(),
        "elastica": d.elastica_seconds.sel(gripper_height=HEIGHT),
        "slowest_elastica": d.elastica_seconds.max(),
        "apart": np.abs(d.elastica_error).max(),
    }


def estimates(d: xr.Dataset) -> Facts:
    """A scene that was refused, or has no good reference, counts neither way; the criterion limits their number."""
    judged = d.sel(case=(d.outcome == of_estimates.NUMBER).values)
    # So written, nan counts as outside.
    within, width = (judged.error <= judged.estimate).values, (judged.estimate / judged.error).values
    groups = {
        **{name: judged.asked == name for name in of_estimates.MODELS},
        "h < 0.01 L*": judged.thickness < 0.01,
        "thicker": judged.thickness >= 0.01,
        "nu < 0.25": judged.nu < 0.25,
        "above": judged.nu >= 0.25,
        "accuracy < 1e-4": judged.accuracy < 1e-4,
        "looser": judged.accuracy >= 1e-4,
    }
    return {
        "share": share(within),
        "cases": d.sizes["case"],
        "judged": judged.sizes["case"],
        "seed": seed_of(d),
        "refused": (d.outcome == of_estimates.REFUSED).sum(),
        "unknown": (d.outcome == of_estimates.UNCERTAIN).sum(),
        "by_group": ", ".join(f"{name} {share(within[chosen.values]):.2f}" for name, chosen in groups.items()),
        "width": np.median(width),
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
    # The solid is a model, not an effect on one: it has no cost on the same model.
    cost = d.clocked.fillna(d.cost).where(idle & (d.effect != collapse_record.SOLID))
    lacking = needed & (d.matters == 1.0)
    largest = [(name, float(cost.sel(effect=name).max())) for name in d.effect.values]
    return {
        "cost": cost.max(),
        "by_effect": ", ".join(f"{name} {value:+.1%}" for name, value in largest if np.isfinite(value)),
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
