"""The x-axis study: critical points over the gripper's height, of one material and of all (the paper's section IV).

The strip is lifted once; at each height the gripper moves from lambda_0 along x to the end of its advance.
Stored in SI.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from stripfold import elastica
from stripfold.ask import select_model
from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.files import schema
from stripfold.files.schema import Variable
from stripfold.follow.collapse import node_weights
from stripfold.follow.static import End, StripModel, XRun, along_x, lift
from stripfold.solve.critical import CriticalPoint
from tasks.diagnostics import Record, record

if TYPE_CHECKING:
    import xarray as xr

RECORDED = (
    "negatives",
    "newton_iterations",
    "residual",
    "contacts",
    "minimal_gap",
    "force_x",
    "force_z",
    "elastic_energy",
    "gravity_energy",
    "first_integral_error",
)
"""Diagnostics of each state that are stored as they are."""


@dataclass(frozen=True)
class HeightResult:
    """Result at one height, in solver units: the run, its records, and the error of lambda at its end."""

    height: float
    run: XRun
    records: tuple[Record, ...]
    error: float


def at_heights(
    strip: StripModel, heights: Sequence[float], refinement: float, progress: Callable[[str], None] | None = None
) -> list[HeightResult]:
    """Run all heights, ascending, each lifted on from the last; lengths in L*.

    Raises SolveError: when one of them cannot be computed: a gap is never stored in its place.
    """
    out = []
    for height, start in lift(strip.contact_mesh(refinement), sorted(heights)):
        fine = along_x(start, height)
        coarse = along_x(start, height, strip.contact_mesh(select_model.COARSER * refinement), past=0.0)
        error = select_model.error(strip.kind, refinement, fine.lam, coarse.lam, fine.slack)
        out.append(HeightResult(height, fine, tuple(record(at) for at in fine.points), error))
        if progress:
            progress(f"z = {height:g} L*: {fine.end.value}")
    return out


def dataset(material: Material, length: float, results: Sequence[HeightResult]) -> xr.Dataset:
    """Collect the results of a material into one dataset, in SI; rows are padded with nan.

    ``material``: supplies the scales; ``length``: length of the strip, m; ``results``: from :func:`at_heights`.
    """
    n_step = max(len(r.records) for r in results)
    n_node = max(len(_nodes(r.run)) for r in results)

    def per_height(get: Callable[[HeightResult], float]) -> Array:
        return np.array([get(r) for r in results], dtype=float)

    def critical(get: Callable[[CriticalPoint], float]) -> Array:
        return per_height(lambda r: get(r.run.critical) if r.run.critical else np.nan)

    def per_step(get: Callable[[Record], float]) -> Array:
        rows = np.full((len(results), n_step), np.nan)
        for row, result in zip(rows, results, strict=True):
            row[: len(result.records)] = [get(x) for x in result.records]
        return rows

    shape = (len(results), n_step, n_node)
    x, z = np.full(shape, np.nan), np.full(shape, np.nan)
    s, mode = np.full(shape[::2], np.nan), np.full((*shape[::2], 2), np.nan)
    for i, result in enumerate(results):
        at = _nodes(result.run)
        s[i, : len(at)] = at
        for j, point in enumerate(result.run.points):
            x[i, j, : len(at)], z[i, j, : len(at)] = point.mid_surface(at).T
        if result.run.critical:
            mode[i, : len(at)] = result.run.critical.mode[result.run.last.model.middle]
    deflection = np.sqrt(np.nansum(_node_weights(s)[:, None] * ((x - x[:, :1]) ** 2 + (z - z[:, :1]) ** 2), axis=-1))
    deflection[np.isnan(x[..., 0])] = np.nan

    snap = per_height(lambda r: float(r.run.end is End.SNAP))
    end = per_height(lambda r: r.run.lam)
    heights: dict[str, Array] = {
        "gripper_height": per_height(lambda r: r.height),
        "snap": snap.astype(np.int8),
        "lambda_0": per_height(lambda r: r.run.lambda_0),
        "lambda_end": end,
        "lambda_c": np.where(snap > 0.0, end, np.nan),
        "lambda_c_lower": critical(lambda c: c.lower),
        "lambda_c_upper": critical(lambda c: c.upper),
        "lambda_c_eigenvalue": critical(lambda c: c.eigenvalue_lam),
        "detectors_agree": critical(lambda c: float(c.agree)),
        "lambda_error": per_height(lambda r: r.error),
        "free_length": per_height(lambda r: r.run.free_length),
        "elements": per_height(lambda r: len(r.run.last.model.ends) - 1),
    }
    steps: dict[str, Array] = {
        "advance": per_step(lambda x: x.lam),
        "tangent_lambda": per_step(lambda x: x.tangent_lam),
        "eigenvalue_1": per_step(lambda x: float(x.eigenvalues[0])),
        "eigenvalue_2": per_step(lambda x: float(x.eigenvalues[1])),
        "deflection": deflection,
        **{name: per_step(attrgetter(name)) for name in RECORDED},
    }
    nodes, node = ("gripper_height", "step", "node"), ("gripper_height", "node")
    return schema.dataset(
        {
            **{name: ("gripper_height", values) for name, values in heights.items()},
            **{name: (("gripper_height", "step"), values) for name, values in steps.items()},
            **{"x": (nodes, x), "z": (nodes, z), "arc": (node, s)},
            **{"mode_x": (node, mode[..., 0]), "mode_z": (node, mode[..., 1])},
            "reason": ("gripper_height", [r.run.end.reason for r in results]),
        },
        {**material.attributes, "thickness": material.thickness, "length": length},
        material.scales,
    )


def _nodes(run: XRun) -> Array:
    """The mid-surface nodes of the last state, at which all states are stored."""
    return run.last.model.s


def _node_weights(s: Array) -> Array:
    """Share of each node in the length of its strip, shape of ``s``, zero where padded."""
    weights = np.zeros_like(s)
    for row, out in zip(s, weights, strict=True):
        n = int(np.isfinite(row).sum())
        out[:n] = node_weights(row[:n]) / row[n - 1]
    return weights


def run(
    material: Material,
    length: float,
    heights: Sequence[float],
    refinement: float = 1.0,
    progress: Callable[[str], None] | None = None,
    **solid: object,
) -> xr.Dataset:
    """The x-axis study of one material.

    ``material``: the strip's material; ``length``: length of the strip, m; ``heights``: gripper heights in units of L*;
    ``refinement``: factor on all element lengths; ``solid``: further options of :class:`.StripModel`.
    """
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu, **solid)  # type: ignore[arg-type]
    return dataset(material, length, at_heights(strip, heights, refinement, progress))


PER_HEIGHT = (
    "snap",
    "lambda_0",
    "lambda_c",
    "lambda_c_lower",
    "lambda_c_upper",
    "lambda_c_eigenvalue",
    "detectors_agree",
    "lambda_end",
    "lambda_error",
    "free_length",
    "gripper_height",
)
PER_MATERIAL = ("eta_b", "eta_m", "gravity_length", "thickness", "length")
STAR = {
    "z": Variable("1", "gripper height / L*", "z / L*"),
    "lambda_c": Variable("1", "critical advance of the gripper / L*", "lambda_c / L*"),
    "free_length": Variable("1", "free length at the critical point / L*"),
}
"""Variables of the master curve: in L*."""


def critical_points(runs: Mapping[str, xr.Dataset], labels: Mapping[str, str]) -> xr.Dataset:
    """Per material and height what the x-axis study found; rows padded with nan.

    ``runs``: datasets of :func:`run` by the material's name; ``labels``: how figures call each material.
    """
    names = list(runs)
    n = max(run.sizes["gripper_height"] for run in runs.values())

    def padded(values: xr.DataArray) -> np.ndarray:
        row = np.full(n, np.nan)
        row[: values.size] = values.values
        return row

    dims = ("material", "height_index")
    reasons = np.full((len(names), n), "", dtype=object)
    for row, m in zip(reasons, names, strict=True):
        row[: runs[m].sizes["gripper_height"]] = runs[m]["reason"].values
    return schema.dataset(
        {
            **{key: (dims, np.stack([padded(runs[m][key]) for m in names])) for key in PER_HEIGHT},
            **{key: ("material", [runs[m].attrs[key] for m in names]) for key in PER_MATERIAL},
            "reason": (dims, reasons),
            "label": ("material", [labels[m] for m in names]),
            "material": ("material", names),
        }
    )


def master_curve(heights: Sequence[float]) -> xr.Dataset:
    """The elastica's critical points, in L*, at ``heights`` above its touch limit."""
    points = [elastica.critical(z) for z in heights]
    values = {
        "z": ("z", heights),
        "lambda_c": ("z", [point.advance for point in points]),
        "free_length": ("z", [point.length for point in points]),
    }
    return schema.dataset(values, {"touch_limit": elastica.touch_limit()}, table=STAR)
