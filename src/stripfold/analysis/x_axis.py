"""The x-axis study: one material, many heights; the paper's section IV without its dynamics.

The strip is lifted once; at each height the gripper moves from lambda_0 along x to what ends its advance.  Stored
in SI.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from stripfold.analysis.diagnostics import Record, node_weights, record
from stripfold.analysis.select_model import FINEST
from stripfold.analysis.static import End, StripModel, XRun, along_x, lift
from stripfold.arrays import Array
from stripfold.material import Material
from stripfold.solve.critical import CriticalPoint


@dataclass(frozen=True)
class HeightResult:
    """What one height gave, in solver units: the run, its records, and the same end on a mesh half as fine."""

    height: float
    run: XRun
    records: tuple[Record, ...]
    coarse: XRun

    @property
    def discretisation_error(self) -> float:
        """Estimate for lambda at the end of the advance, L*: what halving the elements changed, and the slack."""
        return abs(self.run.last.lam - self.coarse.last.lam) + self.run.slack


def at_heights(
    strip: StripModel, heights: Sequence[float], refinement: float, progress: Callable[[str], None] | None = None
) -> list[HeightResult]:
    """Run all heights, ascending, each lifted on from the last; lengths in L*.

    Raises
    ------
    SolveError
        When one of them cannot be computed: a gap is never stored in its place.
    """
    out = []
    for height, model, state in lift(strip, sorted(heights)):
        fine = along_x(strip, height, (model, state), refinement)
        coarse = along_x(strip, height, (model, state), 2.0 * refinement, past=0.0)
        out.append(HeightResult(height, fine, tuple(record(fine.problem, p) for p in fine.points), coarse))
        if progress:
            progress(f"z = {height:g} L*: {fine.end.value}")
    return out


def dataset(material: Material, length: float, results: Sequence[HeightResult]) -> xr.Dataset:
    """Collect the results of a material into one dataset, in SI; rows are padded with nan.

    Parameters
    ----------
    material
        Supplies the scales.
    length
        Length of the strip, m.
    results
        From :func:`at_heights`.
    """
    unit, force = material.gravity_length, material.force_scale
    n_step = max(len(r.records) for r in results)
    n_node = max(len(r.run.problem.model.s) for r in results)
    data = xr.Dataset(attrs={"eta_b": material.eta_b, "eta_m": material.eta_m, "nu": material.nu, "length": length})
    data.attrs |= {"gravity_length": unit, "thickness": material.thickness, "rho_a": material.rho_a}

    def put(name: str, dims: tuple[str, ...], values: Array, units: str, long_name: str, symbol: str = "") -> None:
        data[name] = (
            dims,
            values,
            {"units": units, "long_name": long_name} | ({"symbol": symbol} if symbol else {}),
        )

    def per_height(get: Callable[[HeightResult], float]) -> Array:
        return np.array([get(r) for r in results], dtype=float)

    def per_step(get: Callable[[Record], float]) -> Array:
        rows = np.full((len(results), n_step), np.nan)
        for row, result in zip(rows, results, strict=True):
            row[: len(result.records)] = [get(x) for x in result.records]
        return rows

    data = data.assign_coords(
        height=(
            "height",
            unit * per_height(lambda r: r.height),
            {"units": "m", "long_name": "gripper height", "symbol": "z"},
        )
    )
    snap = per_height(lambda r: 1.0 if r.run.end is End.SNAP else 0.0)
    only_snap = np.where(snap > 0.0, 1.0, np.nan)
    data["snap"] = (
        "height",
        snap.astype(np.int8),
        {"units": "1", "long_name": "1 where lambda has a maximum"},
    )
    data["reason"] = (
        "height",
        np.array([r.run.end.reason for r in results], dtype=object),
        {"units": "1", "long_name": "what ended the advance"},
    )
    at = ("height",)
    put(
        "lambda_0",
        at,
        unit * per_height(lambda r: r.run.lambda_0),
        "m",
        "advance without horizontal force",
        "lambda_0",
    )
    end = unit * per_height(lambda r: r.run.last.lam)
    put("lambda_end", at, end, "m", "advance at its end: critical, first touch or strip lifted")
    put("lambda_c", at, end * only_snap, "m", "critical advance of the gripper", "lambda_c")

    def of_critical(get: Callable[[CriticalPoint], float]) -> Array:
        return per_height(lambda r: get(r.run.critical) if r.run.critical else np.nan)

    put(
        "lambda_c_lower",
        at,
        unit * of_critical(lambda c: c.lower),
        "m",
        "lower end of the bracket",
    )
    put(
        "lambda_c_upper",
        at,
        unit * of_critical(lambda c: c.upper),
        "m",
        "upper end of the bracket",
    )
    put(
        "lambda_c_eigenvalue",
        at,
        unit * of_critical(lambda c: c.eigenvalue_lam),
        "m",
        "advance where the smallest eigenvalue is zero",
    )
    put(
        "detectors_agree",
        at,
        of_critical(lambda c: float(c.agree)),
        "1",
        "1 where all detectors agree",
    )
    put(
        "lambda_error",
        at,
        unit * per_height(lambda r: r.discretisation_error),
        "m",
        "estimated discretisation error",
    )
    put(
        "contact_folds",
        at,
        per_height(lambda r: r.run.contact_folds),
        "1",
        "maxima of lambda due to the mesh, passed",
    )
    put(
        "free_length",
        at,
        unit * per_height(lambda r: r.run.free_length),
        "m",
        "free length at the end of the advance",
    )
    put(
        "elements",
        at,
        per_height(lambda r: len(r.run.problem.model.ends) - 1),
        "1",
        "elements of the mesh",
    )

    steps = ("height", "step")
    put(
        "lambda",
        steps,
        unit * per_step(lambda x: x.lam),
        "m",
        "advance of the gripper past the flat end",
        "lambda",
    )
    put(
        "tangent_lambda",
        steps,
        per_step(lambda x: x.tangent_lam),
        "1",
        "lambda component of the unit tangent",
    )
    frequency = material.gravity / unit
    for k in range(2):

        def eigenvalue(x: Record, k: int = k) -> float:
            return float(x.eigenvalues[k])

        name = f"eigenvalue_{k + 1}"
        long_name = f"eigenvalue {k + 1} of (K, M), nearest zero"
        put(
            name,
            steps,
            frequency * per_step(eigenvalue),
            "s-2",
            long_name,
            f"mu_{k + 1}",
        )
    put("negatives", steps, per_step(lambda x: x.negatives), "1", "number of negative eigenvalues")
    put("newton_iterations", steps, per_step(lambda x: x.newton_iterations), "1", "Newton iterations")
    put("residual", steps, force * per_step(lambda x: x.residual), "N m-1", "largest unbalanced force")
    put("contacts", steps, per_step(lambda x: x.contacts), "1", "nodes on the floor")
    put("minimal_gap", steps, unit * per_step(lambda x: x.minimal_gap), "m", "smallest height over the floor")
    put("force_x", steps, force * per_step(lambda x: x.force_x), "N m-1", "gripper force along x per width")
    put("force_z", steps, force * per_step(lambda x: x.force_z), "N m-1", "gripper force along z per width")
    put(
        "elastic_energy",
        steps,
        force * unit * per_step(lambda x: x.elastic_energy),
        "J m-1",
        "elastic energy per width",
    )
    put(
        "gravity_energy",
        steps,
        force * unit * per_step(lambda x: x.gravity_energy),
        "J m-1",
        "gravity energy per width",
    )
    put(
        "first_integral_error",
        steps,
        force * per_step(lambda x: x.first_integral_error),
        "N m-1",
        "defect of the first integral at the gripper",
    )

    shape = (len(results), n_step, n_node)
    x, z = np.full(shape, np.nan), np.full(shape, np.nan)
    s, mode = np.full(shape[::2], np.nan), np.full((*shape[::2], 2), np.nan)
    for i, result in enumerate(results):
        model = result.run.problem.model
        s[i, : len(model.s)] = model.s
        for j, entry in enumerate(result.records):
            x[i, j, : len(model.s)], z[i, j, : len(model.s)] = entry.mid_surface.T
        if result.run.critical:
            mode[i, : len(model.s)] = result.run.critical.mode[model.middle]
    nodes = ("height", "step", "node")
    put("arc", ("height", "node"), unit * s, "m", "distance along the strip from the grasped end", "s")
    put("x", nodes, unit * x, "m", "mid-surface, horizontal; origin mid-strip", "x")
    put("z", nodes, unit * z, "m", "mid-surface, height over the floor", "z")
    put("mode_x", ("height", "node"), mode[..., 0], "1", "critical eigenvector at the mid-surface, horizontal")
    put("mode_z", ("height", "node"), mode[..., 1], "1", "critical eigenvector at the mid-surface, vertical")
    deflection = np.sqrt(np.nansum(_node_weights(s)[:, None] * ((x - x[:, :1]) ** 2 + (z - z[:, :1]) ** 2), axis=-1))
    deflection[np.isnan(x[..., 0])] = np.nan
    long_name = "root mean square displacement of the mid-surface from lambda_0"
    put("deflection", steps, unit * deflection, "m", long_name)
    return data


def _node_weights(s: Array) -> Array:
    """Share of each node in the length of its strip, shape of ``s``, zero where padded."""
    weights = np.zeros_like(s)
    for row, out in zip(s, weights, strict=True):
        n = int(np.isfinite(row).sum())
        out[:n] = node_weights(row[:n]) / row[n - 1]
    return weights


def refinement_for(accuracy: float) -> float:
    """Factor on the element lengths with which a whole run usually meets a relative accuracy of lambda_c."""
    return min(2.0, max(FINEST, (accuracy / 5e-3) ** 0.5 * 2.0))


def run(
    material: Material,
    length: float,
    heights: Sequence[float],
    refinement: float = 1.0,
    progress: Callable[[str], None] | None = None,
    **solid: object,
) -> xr.Dataset:
    """The x-axis study of one material.

    Parameters
    ----------
    material
        The strip's material.
    length
        Length of the strip, m.
    heights
        Gripper heights in units of L*.
    refinement
        Factor on all element lengths (:mod:`stripfold.analysis.planning`).
    solid
        Further options of :class:`.StripModel`.
    """
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu, **solid)  # type: ignore[arg-type]
    return dataset(material, length, at_heights(strip, heights, refinement, progress))
