"""Numbers of the paper's own runs: critical points, the collapse, folding paths, friction, recordings."""

from __future__ import annotations

import numpy as np
import xarray as xr

from verification.numbers import Facts, Number, share


def critical_points(points: xr.Dataset) -> Facts:
    unit, found = points.gravity_length, np.isfinite(points.lambda_c)
    return {
        "found": found.sum(),
        "no_snap": (points.snap == 0.0).sum(),
        "error": (points.lambda_error / points.lambda_c).where(found).max(),
        "bracket": ((points.lambda_c_upper - points.lambda_c_lower) / unit).where(found).max(),
    }


def eigenvalues(points: xr.Dataset) -> Facts:
    """Of the critical points found along x."""
    apart = np.abs(points.lambda_c_eigenvalue - points.lambda_c) / points.gravity_length
    found = np.isfinite(points.lambda_c)
    return {"apart": apart.max(), "found": found.sum(), "agree": (points.detectors_agree.where(found) == 1.0).sum()}


def slopes(points: xr.Dataset) -> Facts:
    """Of lambda_c over the height, material by material, between neighbouring heights."""
    found = []
    for name in points.material.values:
        one = points.sel(material=name).dropna("height_index", subset=["lambda_c"]).sortby("gripper_height")
        found.append(np.diff(one.lambda_c) / np.diff(one.gripper_height))
    slope = np.concatenate(found)
    return {"least": slope.min(), "most": slope.max(), "materials": points.sizes["material"]}


def thickness(points: xr.Dataset) -> Facts:
    """What rho as a volumetric density in the printed ratios would make of them: a factor 1/h in SI."""
    factor = 1.0 / points.thickness.values
    return {"factor": factor.min(), "range": f"{factor.min():.0f} to {factor.max():.0f}"}


def deviation(points: xr.Dataset, master: xr.Dataset) -> Facts:
    lambda_c = (points.lambda_c / points.gravity_length).values
    curve = np.interp((points.gripper_height / points.gravity_length).values, master.z.values, master.lambda_c.values)
    return {"found": np.isfinite(lambda_c).sum(), "deviation": np.nanmax(np.abs(lambda_c / curve - 1.0))}


def touch_limit(master: xr.Dataset) -> Facts:
    return {"z": master.attrs["touch_limit"]}


def fall(collapse: xr.Dataset) -> Facts:
    """The fall: the farthest move of a point of the strip, the gripper's, and the states after it."""
    unit, phase = collapse.attrs["gravity_length"], collapse.phase.values
    fall, after = np.flatnonzero(phase == "fall"), np.flatnonzero(phase == "after")
    ends = collapse.isel(state=[int(fall[0]), int(fall[-1])])
    jump = np.hypot(ends.x.diff("state"), ends.z.diff("state")).max() / unit
    moved = float(np.abs(ends["advance"].diff("state")).max()) / unit
    return {
        "jump": jump,
        "moved": moved,
        "after": len(after),
        "stable": np.sum(collapse.negatives.values[after] == 0.0),
        "end": collapse.attrs["end"],
    }


def without_friction(assessment: xr.Dataset) -> Facts:
    """The three paths without friction, in L*."""
    unit = assessment.gravity_length
    angle, across = assessment.critical_angle, assessment.sel(path=["triangular", "circular"])
    shape = assessment.shape_error / unit
    off = (assessment.touch_error / unit).sel(path="r-path")
    line = (assessment.touch_x / unit).sel(path="triangular")
    load = assessment.rho_a / (assessment.eta_b * unit**3)
    hold = assessment.peak_hold / (load * assessment.lying_length)
    return {
        "runs": assessment.critical_points.size,
        "critical": (assessment.critical_points > 0.0).sum(),
        "boundary": np.abs(assessment.boundary_error / unit).max(),
        "bifurcations": (assessment.bifurcation.sel(path="r-path") == 1.0).sum(),
        "materials": assessment.sizes["material"],
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


def first_touch(assessment: xr.Dataset) -> list[Facts]:
    """First touch less the planned one of the R-path, L*, of the strips that fall; one for each of the other paths.

    The worst strip is the one that is least beyond its error on the expected side.
    """
    out = []
    for path, sign, side in (("triangular", -1.0, "short of"), ("circular", 1.0, "beyond")):
        one = assessment.sel(path=path)
        off, error = ((one[name] / assessment.gravity_length).values for name in ("touch_error", "touch_uncertainty"))
        line = (one.touch_x / assessment.gravity_length).values
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


def least_friction(friction: xr.Dataset) -> Facts:
    """R-paths with the smallest friction that suffices, in L*."""
    touch, deviation = (
        np.abs(x) / friction.gravity_length
        for x in (friction.touch_x - friction.planned_touch_x, friction.deviation_max)
    )
    laws = {"pull": "pull", "moment": "hysteresis"}
    return {
        "touch": touch.max(),
        "deviation": deviation.max(),
        **{f"touch_{key}": touch.sel(law=law).max() for key, law in laws.items()},
        **{f"deviation_{key}": deviation.sel(law=law).max() for key, law in laws.items()},
    }


def friction_needed(friction: xr.Dataset) -> Facts:
    pull, moment = friction.sel(law="pull"), friction.suffices.sel(law="hysteresis")
    end = friction.deviation_end / friction.gravity_length
    both, long = friction.two_ways.values == 1.0, friction.relative_length.values
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


def snaps(recordings: xr.Dataset) -> Facts:
    found = recordings.snapped.values == 1.0
    event, zero, model = (recordings[name].values[found] for name in ("lambda_event", "lambda_zero", "lambda_model"))
    above = (zero > model)[np.isfinite(zero)]
    return {"all": len(found), "measured": found.sum(), "above": share(event > model), "zero": share(above)}


# fmt: off
NUMBERS = {
    critical_points: (
        Number("heights_without_snap", "no_snap", "count", "> 0",
            "heights of that study at which the sag touches the floor layer before lambda has a maximum: no snap"),
        Number("lambda_c_error_max", "error", "1", "< 1e-3",
            "largest estimated relative discretisation error of lambda_c, all {found} critical points"),
        Number("bracket_max", "bracket", "L*", "<= 1e-6 L*", "widest bracket of lambda_c, all {found} of them"),
    ),
    eigenvalues: (
        Number("detectors_apart", "apart", "L*", "< 1e-3 L*, detectors agree at every point",
            "largest distance of the lambda at which the smallest eigenvalue is zero from lambda_c, all {found} "
            "critical points; tangent, inertia and eigenvalue agree at {agree}", lambda f: f.agree == f.found),
    ),
    slopes: (
        Number("lambda_c_slope", "least", "1", "> 0",
            "least slope of lambda_c over the height, {materials} materials, between neighbouring heights; the largest "
            "{most:.2f}"),
    ),
    thickness: (
        Number("density_factor", "factor", "1/m", "> 10",
            "least factor 1/h between the printed ratios with the volumetric and with the areal density, all "
            "materials: {range} in SI"),
    ),
    deviation: (
        Number("collapse_deviation", "deviation", "1", "< 1e-2",
            "largest relative distance of the solid's lambda_c (eta_m as configured) from the elastica's master "
            "curve, all {found} critical points"),
    ),
    touch_limit: (
        Number("touch_limit", "z", "L*", "1.58617 to 1e-5",
            "height below which the elastica's sag touches the floor layer before the strip can snap",
            lambda f: abs(f.z - 1.58617) < 1e-5, digits=7),
    ),
    fall: (
        Number("collapse_jump", "jump", "L*", "> 0.5 L*, more than ten times as far as the gripper",
            "farthest move of a point of the strip in the fall, in which the gripper moves {moved:.1e} L*",
            lambda f: f.jump > 10.0 * f.moved),
        Number("collapse_stable_after", "stable", "count", "all {after}",
            "static states after the fall without a negative eigenvalue, to the end: {end}",
            lambda f: f.stable == f.after > 1),
    ),
    without_friction: (
        Number("paths_critical", "critical", "count", "all {runs}",
            "paths with a critical point, of {runs}: triangular, circular and R-path of {materials} materials, without "
            "friction", lambda f: f.critical == f.runs),
        Number("path_boundary_error", "boundary", "L*", "< 1e-3 L*",
            "largest distance of a path's critical point from lambda_c of the x-axis study at its height"),
        Number("rpath_bifurcations", "bifurcations", "count", "all {materials}",
            "materials whose R-path meets the stability boundary at less than 15 degrees (at most {angle_r:.1f})",
            lambda f: f.bifurcations == f.materials),
        Number("snap_angle", "angle", "degree", "> 15 degrees",
            "least angle at which a triangular or circular path meets the stability boundary"),
        Number("fold_error_frictionless", "shape", "L*", "< 0.02 L*",
            "largest distance of the finished fold from the planned one, all {runs} runs"),
        Number("fold_paths_apart", "paths_apart", "L*", "< 1e-3 L*",
            "largest difference of that distance between the three paths of one material"),
        Number("rpath_touch_frictionless", "off", "L*", "> 0.1 L*",
            "least distance of the first touch from the planned one on an R-path without friction; all: {offs}"),
        Number("triangular_touch_scaled", "line", "L*", "< 0.2 L*",
            "spread over all materials of the first touch's distance from the fold line on the triangular path: "
            "{lines} L*, which vanishes with L*"),
        Number("hold_over_weight", "hold", "1", "< 1",
            "largest force at the held end over the weight of what lies in the end, R-path; triangular path "
            "{hold_triangular:.1f}, circular path {hold_circular:.1f}"),
    ),
    first_touch: (
        Number("first_touch_{path}", "value", "L*", "{bound} 0 by more than its error, every strip that falls",
            "first touch less the planned one of the R-path, {path} path, the least of the {falls} strips that fall: "
            "{each}, errors at most {errors:.0e} L* (the paper: {side} it; from the fold line: {lines}); strips laid "
            "down without a fall do not count: {laid}", lambda f: f.fallen and f.decided, "error"),
    ),
    least_friction: (
        Number("rpath_touch_friction", "touch", "L*", "< 0.1 L*",
            "largest distance of the first touch from the planned one with the smallest sufficient friction (pull "
            "{touch_pull:.3f}, hysteresis {touch_moment:.3f})"),
        Number("rpath_deviation", "deviation", "L*", "< 0.5 L*",
            "largest distance of a state from the planned one on R-paths with the smallest sufficient friction (pull "
            "{deviation_pull:.2f}, hysteresis {deviation_moment:.2f})"),
    ),
    friction_needed: (
        Number("rpath_two_ways", "two", "count", ">= 1",
            "materials, of {d.sizes[material]}, whose unstable planned state has two outcomes without friction, on "
            "the lower layer or at rest above it ({two_lengths} L* long; not: {one_lengths})"),
        Number("rpath_completed", "completed", "count", "all {d.sizes[material]}",
            "materials whose whole R-path is followed with friction of either law, the last state within 0.05 L* of "
            "the folded one (farthest: {farthest:.3f} L*)", lambda f: f.completed == f.d.sizes["material"]),
        Number("friction_ratio_max", "ratio", "1", "< 0.1",
            "largest pulling force / gripper force on an R-path followed with the smallest sufficient friction, all "
            "{d.sizes[material]} materials; medians along the path {medians}"),
        Number("friction_moment_max", "moment", "1", "< 0.1",
            "largest sufficient M_0 / rho_a g L*^2 of bending hysteresis, all {d.sizes[material]} materials; the "
            "smallest {least_moment:.1e}"),
    ),
    snaps: (
        Number("measured_above_model", "above", "1", "> 0.9",
            "verification of the measuring chain: share of the {measured} snaps, filmed synthetically with friction in "
            "the strips, that are measured above the frictionless lambda_c; extrapolated to zero speed {zero:.2f}; "
            "recordings without a snap do not count"),
    ),
}
# fmt: on
