"""Facts that decide claims of the paper, from the paper's own runs; see :mod:`.facts`."""

from __future__ import annotations

import numpy as np
import xarray as xr

from studies.summary.facts import Facts


def eigenvalues(d: xr.Dataset) -> Facts:
    """Of the critical points found along x."""
    apart = np.abs(d.lambda_c_eigenvalue - d.lambda_c) / d.gravity_length
    found = np.isfinite(d.lambda_c)
    return {"apart": apart.max(), "found": found.sum(), "agree": (d.detectors_agree.where(found) == 1.0).sum()}


def slopes(d: xr.Dataset) -> Facts:
    """Of lambda_c over the height, material by material, between neighbouring heights."""
    found = []
    for name in d.material.values:
        one = d.sel(material=name).dropna("height_index", subset=["lambda_c"]).sortby("gripper_height")
        found.append(np.diff(one.lambda_c) / np.diff(one.gripper_height))
    slope = np.concatenate(found)
    return {"least": slope.min(), "most": slope.max(), "materials": d.sizes["material"]}


def thickness(d: xr.Dataset) -> Facts:
    """What rho as a volumetric density in the printed ratios would make of them: a factor 1/h in SI."""
    factor = 1.0 / d.thickness.values
    return {"factor": factor.min(), "range": f"{factor.min():.0f} to {factor.max():.0f}"}


def collapse(d: xr.Dataset) -> Facts:
    """The fall: the farthest move of a point of the strip, the gripper's, and the states after it."""
    unit, phase = d.attrs["gravity_length"], d.phase.values
    fall, after = np.flatnonzero(phase == "fall"), np.flatnonzero(phase == "after")
    ends = d.isel(state=[int(fall[0]), int(fall[-1])])
    jump = np.hypot(ends.x.diff("state"), ends.z.diff("state")).max() / unit
    moved = float(np.abs(ends["advance"].diff("state")).max()) / unit
    return {
        "jump": jump,
        "moved": moved,
        "after": len(after),
        "stable": np.sum(d.negatives.values[after] == 0.0),
        "end": d.attrs["end"],
    }


def paths(d: xr.Dataset) -> Facts:
    """The three paths without friction, in L*."""
    unit = d.gravity_length
    angle, across = d.critical_angle, d.sel(path=["triangular", "circular"])
    shape = d.shape_error / unit
    off = (d.touch_error / unit).sel(path="r-path")
    line = (d.touch_x / unit).sel(path="triangular")
    load = d.rho_a / (d.eta_b * unit**3)
    hold = d.peak_hold / (load * d.lying_length)
    return {
        "runs": d.critical_points.size,
        "critical": (d.critical_points > 0.0).sum(),
        "boundary": np.abs(d.boundary_error / unit).max(),
        "bifurcations": (d.bifurcation.sel(path="r-path") == 1.0).sum(),
        "materials": d.sizes["material"],
        "angle_r": angle.sel(path="r-path").max(),
        "angle": across.critical_angle.min(),
        "snaps": (across.bifurcation == 0.0).sum(),
        "shape": shape.max(),
        "paths_apart": (shape.max("path") - shape.min("path")).max(),
        "off": np.abs(off).min(),
        "offs": ", ".join(f"{x:+.2f}" for x in off.values),
        "line": line.max() - line.min(),
        "lines": f"{float(line.min()):.2f} to {float(line.max()):.2f}",
        "hold": hold.sel(path="r-path").max(),
        "hold_triangular": hold.sel(path="triangular").max(),
        "hold_circular": hold.sel(path="circular").max(),
    }


def friction(d: xr.Dataset) -> Facts:
    """R-paths with the smallest friction that suffices, in L*."""
    touch, deviation = (np.abs(x) / d.gravity_length for x in (d.touch_x - d.planned_touch_x, d.deviation_max))
    laws = {"pull": "pull", "moment": "hysteresis"}
    return {
        "touch": touch.max(),
        "deviation": deviation.max(),
        **{f"touch_{key}": touch.sel(law=law).max() for key, law in laws.items()},
        **{f"deviation_{key}": deviation.sel(law=law).max() for key, law in laws.items()},
    }


def printed_law(d: xr.Dataset) -> Facts:
    """At a rotation by 90 degrees, over what the law gives unrotated."""
    upright, flat = d.sel(angle=90.0), d.sel(angle=0.0)
    return {
        "stiffness": upright.stiffness_printed / flat.stiffness_printed,
        "objective": upright.stiffness_svk / flat.stiffness_svk,
    }
