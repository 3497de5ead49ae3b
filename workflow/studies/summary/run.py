"""The numbers the project quotes: one entry per number, each from a stored dataset and judged by a criterion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from studies.branches import FAILED, WRONG
from studies.summary import (
    accuracy as summary_accuracy,
)
from studies.summary import (
    cold_run as summary_cold_run,
)
from studies.summary import (
    dynamics as summary_dynamics,
)
from studies.summary import (
    effects as summary_effects,
)
from studies.summary import (
    hard_cases as summary_hard,
)
from studies.summary import (
    paths as summary_paths,
)
from studies.summary import (
    peers as summary_peers,
)
from studies.summary import (
    rod as summary_rod,
)
from studies.summary import (
    vision as summary_vision,
)
from studies.summary.entry import Entry, entry


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """All entries.

    Parameters
    ----------
    data
        Datasets by name: ``points``, ``master``, ``limit``, ``order``, ``branches``, ``benchmark``, and those of
        :mod:`.summary_rod`, :mod:`.summary_accuracy`, :mod:`.summary_hard`, :mod:`.summary_dynamics`,
        :mod:`.summary_paths`, :mod:`.summary_vision`, :mod:`.summary_effects`, :mod:`.summary_cold_run` and
        :mod:`.summary_peers`.
    sources
        The files they were read from, by the same names.
    """
    out: dict[str, Entry] = {}
    _points(out, data["points"], data["master"], sources)
    _limit(out, data["limit"], sources["limit"])
    order = data["order"]
    out["order_lambda_c"] = entry(
        float(order["order"]),
        "1",
        "observed order of lambda_c in the element size, uniform meshes, rms over mesh phases",
        "> 1.5, and the finest mesh within 5e-3 L*",
        float(order["order"]) > 1.5 and float(order["error"][-1]) < 5e-3,
        sources["order"],
        3,
    )
    branches = data["branches"]
    verdict, cases = branches["verdict"].values, branches.sizes["case"]
    wrong, failed = int(np.sum(verdict == WRONG)), int(np.sum(verdict == FAILED))
    out["branch_cases"] = entry(
        cases, "count", "random strips run on the solid", ">= 2000", cases >= 2000, sources["branches"]
    )
    out["branch_jumps"] = entry(
        wrong, "count", "of these, on a wrong branch against the elastica", "0", wrong == 0, sources["branches"]
    )
    out["branch_failures"] = entry(
        failed, "count", "of these, ended by a typed error instead of a result", "0", failed == 0, sources["branches"]
    )
    _benchmark(out, data["benchmark"], sources["benchmark"])
    parts = (
        summary_rod,
        summary_accuracy,
        summary_hard,
        summary_effects,
        summary_cold_run,
        summary_dynamics,
        summary_paths,
        summary_vision,
        summary_peers,
    )
    for part in parts:
        out |= part.summarise(data, sources)
    return out


def _points(out: dict[str, Entry], points: xr.Dataset, master: xr.Dataset, sources: Mapping[str, str]) -> None:
    source = sources["points"]
    unit = points["gravity_length"]
    z, lambda_c = (points["height"] / unit).values, (points["lambda_c"] / unit).values
    found = np.isfinite(lambda_c)
    curve = np.interp(z[found], master["z"].values, master["lambda_c"].values)
    apart = np.abs(lambda_c[found] / curve - 1.0)
    out["critical_points"] = entry(
        found.sum(), "count", "critical points of the x-axis study", ">= 40", found.sum() >= 40, source
    )
    no_snap = int(np.sum(points["snap"].values == 0.0))
    out["heights_without_snap"] = entry(
        no_snap, "count", "heights of the study at which the sag lands first: no snap", "> 0", no_snap > 0, source
    )
    out["collapse_deviation"] = entry(
        apart.max(),
        "1",
        "largest relative distance of the solid's points (eta_m as configured) from the elastica's master curve",
        "< 1e-2",
        apart.max() < 1e-2,
        source,
        2,
    )
    error = (points["lambda_error"] / points["lambda_c"]).values[found]
    out["lambda_c_error_max"] = entry(
        error.max(),
        "1",
        "largest estimated relative discretisation error of lambda_c",
        "< 1e-3",
        error.max() < 1e-3,
        source,
        2,
    )
    width = ((points["lambda_c_upper"] - points["lambda_c_lower"]) / unit).values[found]
    out["bracket_max"] = entry(
        width.max(), "L*", "widest bracket of lambda_c", "<= 1e-6 L*", width.max() <= 1e-6, source, 2
    )
    out["touch_limit"] = entry(
        master.attrs["touch_limit"],
        "L*",
        "height below which the elastica's sag lands before the strip can snap",
        "1.58617 to 1e-5",
        abs(master.attrs["touch_limit"] - 1.58617) < 1e-5,
        sources["master"],
        7,
    )


def _limit(out: dict[str, Entry], limit: xr.Dataset, source: str) -> None:
    truth = float(limit["lambda_c_elastica"])
    relative = np.abs(limit["difference"].values[:, -1]) / truth
    for eta_m, value, mesh, order in zip(
        limit["eta_m"].values, relative, limit["mesh_error"].values / truth, limit["order"].values, strict=True
    ):
        out[f"solid_limit_error_{eta_m:.0e}"] = entry(
            value,
            "1",
            f"|solid - elastica| / elastica in lambda_c at z = {limit.attrs['height_star']:g} L*, eta_m = {eta_m:.0e}, "
            f"mesh error {mesh:.0e}" + ("" if np.isnan(order) else f", order {order:.2f} in eta_m"),
            "order 1 in eta_m within 0.1",
            np.isnan(order) or abs(order - 1.0) < 0.1,
            source,
            3,
        )
    out["solid_limit_error"] = entry(
        relative[-1], "1", "the same at the smallest eta_m", "< 1e-5", relative[-1] < 1e-5, source, 3
    )


def _benchmark(out: dict[str, Entry], benchmark: xr.Dataset, source: str) -> None:
    seconds, error = float(benchmark["seconds"].median()), float(benchmark["relative_error"].max())
    out["time_solid_lambda_c"] = entry(
        seconds,
        "s",
        f"median time of one solid lambda_c with its error estimate ({error:.0e} relative), one core",
        "<= 5 s at 5e-3",
        seconds <= 5.0 and error <= 5e-3,
        source,
        3,
    )
    memory = float(benchmark["memory"])
    out["memory_solid_lambda_c"] = entry(
        memory, "MB", "peak memory of that process", "<= 400 MB", memory <= 400.0, source, 3
    )


def markdown(summary: Mapping[str, Entry]) -> str:
    """The summary as the README's table."""
    rows = ["| key | value | what | criterion | holds |", "|---|---|---|---|---|"]
    for key, item in summary.items():
        unit = "" if item["unit"] in ("1", "count") else f" {item['unit']}"
        what, criterion = (item[part].replace("|", "\\|") for part in ("statement", "criterion"))
        rows.append(
            f"| `{key}` | {item['value']:g}{unit} | {what} | {criterion} | {'yes' if item['holds'] else 'no'} |"
        )
    return "\n".join(rows) + "\n"
