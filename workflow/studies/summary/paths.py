"""The numbers the project quotes about folding paths and internal friction."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stripfold.errors import CoarseMeshError
from studies.random_paths import OTHERWISE
from studies.summary.entry import Entry, entry

SMALL_BOUNDARY_ERROR = 1e-3
SMALL_PLAN_ERROR = 1e-8
SMALL_RATIO = 0.1
SAME_MOMENT = 1.2
MANY = 200


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """Entries of ``tangency``, ``assessment``, ``friction``, ``friction_steps``, ``random_paths`` and
    ``assess_benchmark``, read from the files ``sources``."""
    return {
        **_tangency(data["tangency"], sources["tangency"]),
        **_touches(data["assessment"], sources["assessment"]),
        **_friction(data["friction"], sources["friction"]),
        **_steps(data["friction_steps"], sources["friction_steps"]),
        **_random(data["random_paths"], sources["random_paths"]),
        **_benchmark(data["assess_benchmark"], sources["assess_benchmark"]),
    }


def _tangency(data: xr.Dataset, source: str) -> dict[str, Entry]:
    error = np.abs(data["boundary_error"].values)
    angle, length, thickness = data["angle"].values, data["length"].values, data["thickness"].values
    plan = float(data["plan_error"].max())
    elastica = float(np.abs(data["elastica_error"]).max())
    missing = int(np.isnan(error).sum())
    return {
        "tangency_error_max": entry(
            float(np.nanmax(error)),
            "L*",
            "largest distance of the solid's critical point on the R-path from its lambda_c(z), "
            f"{len(length)} lengths from {length.min():g} to {length.max():g} L*, {len(thickness)} thicknesses; on the "
            f"elastica {elastica:.0e} L*",
            f"< {SMALL_BOUNDARY_ERROR:g} L* for at least five lengths, none missing",
            bool(np.nanmax(error) < SMALL_BOUNDARY_ERROR) and missing == 0 and len(length) >= 5,
            source,
            2,
        ),
        "tangency_angle": entry(
            float(np.nanmax(angle[:, int(np.argmin(thickness))])),
            "degree",
            f"largest angle between R-path and stability boundary at h = {thickness.min():g} L*; at h = "
            f"{thickness.max():g} L* {np.nanmax(angle[:, int(np.argmax(thickness))]):.1f} degrees",
            "less than on the thickest",
            bool(np.nanmax(angle[:, int(np.argmin(thickness))]) < np.nanmax(angle[:, int(np.argmax(thickness))])),
            source,
            2,
        ),
        "rpath_plan_error": entry(
            plan,
            "1",
            "largest error of the first integral in the R-paths' planned states",
            f"< {SMALL_PLAN_ERROR:g}",
            plan < SMALL_PLAN_ERROR,
            source,
            2,
        ),
    }


def _touches(data: xr.Dataset, source: str) -> dict[str, Entry]:
    out: dict[str, Entry] = {}
    error = data["touch_error"] / data["gravity_length"]
    for name, way, worst in (("triangular", "short of", np.max), ("circular", "beyond", np.min)):
        one, fell = error.sel(path=name).values, data["fell"].sel(path=name).values == 1.0
        laid = ", ".join(f"{value:+.3f}" for value in one[~fell]) or "none"
        each = ", ".join(f"{value:+.2f}" for value in one[fell])
        value = float(worst(one[fell])) if fell.any() else float("nan")
        sign = -1.0 if name == "triangular" else 1.0
        out[f"first_touch_{name}"] = entry(
            value,
            "L*",
            f"first touch less the landing place of the folded state, the {'largest' if sign < 0 else 'smallest'} of "
            f"{int(fell.sum())} strips that fall: {each} (the paper: {way} it); laid down without a fall: {laid}",
            f"{'<' if sign < 0 else '>'} 0",
            sign * value > 0.0,
            source,
        )
    return out


def _friction(data: xr.Dataset, source: str) -> dict[str, Entry]:
    pull = data.sel(law="pull")
    ratio, median = pull["ratio_max"].values, pull["ratio_median"].values
    end = (data["deviation_end"] / data["gravity_length"]).values
    completed = int(np.sum(np.all(np.isfinite(end) & (end < 0.05), axis=1)))
    moment = data["suffices"].sel(law="hysteresis").values
    both = data["two_ways"].values == 1.0
    long = data["relative_length"].values
    return {
        "rpath_two_ways": entry(
            int(both.sum()),
            "count",
            f"materials, of {len(both)}, whose unstable planned state goes two ways without friction, on the lower "
            f"layer or to a rest above it ({', '.join(f'{x:.0f}' for x in long[both])} L* long; not: "
            f"{', '.join(f'{x:.0f}' for x in long[~both]) or 'none'})",
            ">= 1",
            bool(both.any()),
            source,
        ),
        "rpath_completed": entry(
            completed,
            "count",
            f"materials, of {data.sizes['material']}, whose whole R-path is followed with friction of either law, the "
            f"last state within 0.05 L* of the folded one (farthest: {end.max():.3f} L*)",
            "all",
            completed == data.sizes["material"],
            source,
        ),
        "friction_ratio_max": entry(
            float(ratio.max()),
            "1",
            "largest pulling force / gripper force on an R-path followed with the smallest friction that suffices, all "
            f"materials; medians along the path {median.min():.1e} to {median.max():.1e}",
            f"< {SMALL_RATIO:g}",
            bool(ratio.max() < SMALL_RATIO),
            source,
            2,
        ),
        "friction_moment_max": entry(
            float(moment.max()),
            "1",
            f"largest M_0 / rho_a g L*^2 that suffices as bending hysteresis; the smallest {moment.min():.1e}",
            "< 0.1",
            bool(moment.max() < 0.1),
            source,
            2,
        ),
    }


def _steps(data: xr.Dataset, source: str) -> dict[str, Entry]:
    step = data["step"].values
    pull, moment = (data["suffices"].sel(law=law).values for law in ("pull", "hysteresis"))
    product = pull * step
    return {
        "friction_step_k_f": entry(
            float(pull.max() / pull.min()),
            "1",
            f"smallest k_f that suffices, largest over smallest for steps of {step.min():g} to {step.max():g} L*; k_f "
            f"times the step is {product.min():.4f} to {product.max():.4f} g",
            f"k_f times the step within a factor {SAME_MOMENT:g}",
            bool(product.max() / product.min() < SAME_MOMENT),
            source,
            3,
        ),
        "friction_step_M_0": entry(
            float(moment.max() / moment.min()),
            "1",
            "the same of the hysteresis' M_0",
            f"< {SAME_MOMENT:g}",
            bool(moment.max() / moment.min() < SAME_MOMENT),
            source,
            3,
        ),
    }


def _random(data: xr.Dataset, source: str) -> dict[str, Entry]:
    outcome = data["outcome"].values
    count = {name: int(np.sum(outcome == name)) for name in ("stable", "critical", "close", "refused", "undecided")}
    said = ", ".join(f"{number} {name}" for name, number in count.items())
    undecided = data["message"].values[outcome == "undecided"]
    contradicted = int(np.sum(undecided == OTHERWISE))
    coarse = sum(text.startswith(CoarseMeshError.__name__) for text in undecided)
    typed = sum("Error: " in text for text in undecided)
    both = np.abs(data["critical"].values - data["again"].values)[outcome == "critical"]
    apart = float(both.max(initial=0.0))
    return {
        "random_paths": entry(
            len(outcome),
            "count",
            f"random gripper paths, each assessed twice ({said}); critical points of both runs at most {apart:.1e} L* "
            "apart",
            f">= {MANY}",
            len(outcome) >= MANY,
            source,
        ),
        "random_paths_undecided": entry(
            count["undecided"],
            "count",
            f"of these, with a typed error instead of a verdict ({coarse} that the mesh decides), or ({contradicted}) "
            "two runs that say otherwise",
            "a verdict or a typed error for each, no two runs that say otherwise",
            contradicted == 0 and typed == count["undecided"],
            source,
        ),
    }


def _benchmark(data: xr.Dataset, source: str) -> dict[str, Entry]:
    seconds, memory, error = float(data["wall"].median()), float(data["memory"]), float(data["error"])
    return {
        "time_assess": entry(
            seconds,
            "s",
            f"median time of one `stripfold assess` of an R-path with its fall, one core; {memory:.0f} MB, error "
            f"{error:.1e} of the length against half the elements",
            "<= 30 s at an error of 5e-3",
            seconds <= 30.0 and error <= 5e-3,
            source,
            3,
        )
    }
