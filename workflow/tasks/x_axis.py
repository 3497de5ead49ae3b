"""The x-axis study: critical points over the gripper's height, of one material and of all (the paper's section IV).

The strip is lifted once; at each height the gripper moves from lambda_0 along x to the end of its advance.
Stored in SI.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stripfold import elastica
from stripfold.ask import collapse as through_collapse
from stripfold.ask import select_model
from stripfold.ask.inputs import Simulation
from stripfold.base.arrays import Array
from stripfold.base.errors import StripfoldError
from stripfold.base.material import Material
from stripfold.files import schema
from stripfold.files.schema import Variable
from stripfold.follow.contact_branch import BranchPoint
from stripfold.follow.statics import StripModel, along_x, lift
from stripfold.follow.track import End, Track, node_weights
from stripfold.solve.critical import CriticalPoint
from tasks import material_of

if TYPE_CHECKING:
    import xarray as xr

NEAR_END = 0.01
"""Share of the first element over which the direction of the grasped end is taken."""


class HeightResult(NamedTuple):
    """Result at one height, in solver units: the run, its states with those past a snap, and the error of lambda."""

    height: float
    run: Track
    points: tuple[BranchPoint, ...]
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
        points = tuple(at for at in (*fine.points, *fine.beyond) if isinstance(at, BranchPoint))
        out.append(HeightResult(height, fine, points, error))
        if progress:
            progress(f"z = {height:g} L*: {fine.end.value}")
    return out


def dataset(material: Material, length: float, results: Sequence[HeightResult]) -> xr.Dataset:
    """Collect the results of a material into one dataset, in SI; rows are padded with nan.

    ``material``: supplies the scales; ``length``: length of the strip, m; ``results``: from :func:`at_heights`.
    """
    n_step = max(len(r.points) for r in results)
    n_node = max(len(r.run.last.model.s) for r in results)

    def per_height(get: Callable[[HeightResult], float]) -> Array:
        return np.array([get(r) for r in results], dtype=float)

    def critical(get: Callable[[CriticalPoint], float]) -> Array:
        return per_height(lambda r: get(r.run.critical) if r.run.critical else np.nan)

    shape = (len(results), n_step, n_node)
    x, z = np.full(shape, np.nan), np.full(shape, np.nan)
    s, mode = np.full(shape[::2], np.nan), np.full((*shape[::2], 2), np.nan)
    for i, result in enumerate(results):
        at = result.run.last.model.s
        s[i, : len(at)] = at
        for j, point in enumerate(result.points):
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
        "lambda_0": per_height(lambda r: r.points[0].point.lam),
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
    steps: dict[str, Array] = {"deflection": deflection}
    for i, result in enumerate(results):
        for j, point in enumerate(result.points):
            for name, value in diagnostics(point).items():
                steps.setdefault(name, np.full(shape[:2], np.nan))[i, j] = value
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


def _node_weights(s: Array) -> Array:
    """Share of each node in the length of its strip, shape of ``s``, zero where padded."""
    weights = np.zeros_like(s)
    for row, out in zip(s, weights, strict=True):
        n = int(np.isfinite(row).sum())
        out[:n] = node_weights(row[:n]) / row[n - 1]
    return weights


def diagnostics(at: BranchPoint) -> dict[str, float]:
    """Diagnostics of a point; lengths in L*, forces in rho_a g L*, energies in rho_a g L*^2 per width.

    Forces follow docs/physics.md, section 4: X points from the lying part to the free part, towards -x, and
    ``(F_x, F_z)`` is the force across a section that the part nearer the gripper exerts on the rest.
    """
    problem, point = at.problem.on_mesh(at.point)
    model, q = problem.model, point.q
    middle = model.mid_surface(q)
    # The gripper's force on the strip, in the paper's frame.
    gripper_x, gripper_z = problem.residual(q, point.lam)[model.middle[0]]
    # The elastica's X axis points the other way.
    force_x, force_z = -gripper_x, gripper_z
    near = NEAR_END * model.ends[1] * np.arange(3.0)
    tangent = _end_tangent(near, model.resampled_mid_surface(q, near))
    along = -tangent[0] * force_x + tangent[1] * force_z
    return {
        "advance": point.lam,
        "tangent_lambda": point.tangent.lam,
        "eigenvalue_1": float(point.eigenvalues[0]),
        "eigenvalue_2": float(point.eigenvalues[1]),
        "negatives": point.negatives,
        "newton_iterations": len(point.state.residuals) - 1,
        "residual": point.state.residuals[-1],
        "contacts": len(point.state.active),
        "minimal_gap": float(np.min(q[problem.bounded] - problem.lower)),
        "force_x": float(gripper_x),
        "force_z": float(gripper_z),
        "elastic_energy": model.energy(q),
        "gravity_energy": float(model.weight @ q),
        "first_integral_error": _first_integral(along, force_x, middle[0, 1], 12.0 / model.thickness**2),
    }


def _first_integral(along: float, force_x: float, height: float, membrane: float) -> float:
    """``T + T^2/2EA - z - (F_x + F_x^2/2EA)`` with T the gripper's force along the tangent.

    The elastica's integral (``docs/physics.md``, section 4) with the stretch energy of a strip that gives; zero in an
    exact equilibrium.
    """
    return float(along + along**2 / (2.0 * membrane) - height - force_x - force_x**2 / (2.0 * membrane))


def _end_tangent(s: Array, middle: Array) -> Array:
    """Unit tangent at the gripper, pointing away from the lying part, by a parabola through the three end nodes."""
    h1, h2 = s[1] - s[0], s[2] - s[0]
    slope = (middle[1] - middle[0]) * h2 / (h1 * (h2 - h1)) - (middle[2] - middle[0]) * h1 / (h2 * (h2 - h1))
    return np.asarray(-slope / np.linalg.norm(slope))


def run(material: Mapping[str, Any], accuracy: float, gravity: float, progress: Callable[[str], None]) -> xr.Dataset:
    """The x-axis study of a material at all its heights; ``accuracy``: of lambda_c, relative.

    Raises StripfoldError: a branch breaks what every branch must obey.
    """
    strip, length = material_of(material, gravity), material["length"]
    model = StripModel(length / strip.gravity_length, strip.relative_thickness, strip.nu)
    heights = [*material["touching_heights"], *material["heights"]]
    data = dataset(strip, length, at_heights(model, heights, select_model.refinement("solid", accuracy), progress))
    check_branch(data)
    return data.assign_attrs(title=f"x-axis continuation, {material['label']}")


GAP = 1e-9
"""Largest penetration of the floor, L*."""
FORCE = 1e-4
"""Largest unbalanced force, rho_a g L*; the rounding of a thin strip's unknowns sets it (docs/method.md)."""


def check_branch(run: xr.Dataset) -> None:
    """Refuse a dataset of :func:`run` that breaks what every branch must obey.

    Raises StripfoldError: with the list of what is broken, and at which heights.
    """
    unit = run.attrs["gravity_length"]
    force = run.attrs["rho_a"] * run.attrs["gravity"] * unit
    snap = run["snap"].values > 0
    lam, negatives = run["advance"].values, run["negatives"].values
    exists = np.isfinite(lam)
    before = exists & (np.cumsum(negatives > 0, axis=1) == 0)
    steps = np.where(before[:, 1:], np.diff(lam, axis=1), np.nan)
    lower, found, upper = (run[f"lambda_c{end}"].values for end in ("_lower", "", "_upper"))
    broken = {
        "a value is missing": np.any(exists & ~np.isfinite(run["residual"].values), axis=1),
        "the floor is penetrated": np.any(run["minimal_gap"].values < -GAP * unit, axis=1),
        "a state is not in equilibrium": np.any(run["residual"].values > FORCE * force, axis=1),
        "the branch starts unstable": negatives[:, 0] > 0,
        "there is no unstable point past a snap": snap & ~np.any(negatives > 0, axis=1),
        "lambda_c has no bracket around it": snap
        & ~((lower <= found) & (found <= upper) & (upper - lower <= 2e-6 * unit)),
        "lambda exceeds lambda_c by more than its error": snap
        & (np.nanmax(lam, axis=1) > (run["lambda_end"] + run["lambda_error"]).values),
        "lambda falls by more than a contact step before the end": np.any(steps < -0.05 * unit, axis=1),
        "lambda_c is given without a snap": ~snap & np.isfinite(run["lambda_c"].values),
    }
    failures = [
        f"{what} at z/L* = {', '.join(f'{z:g}' for z in run['gripper_height'].values[where] / unit)}"
        for what, where in broken.items()
        if np.any(where)
    ]
    if failures:
        raise StripfoldError("the branches break what they must obey: " + "; ".join(failures))


PER_HEIGHT = [
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
]
PER_MATERIAL = ("eta_b", "eta_m", "gravity_length", "thickness", "length")
STAR = {
    "z": Variable("1", "gripper height / L*", "z / L*"),
    "lambda_c": Variable("1", "critical advance of the gripper / L*", "lambda_c / L*"),
    "free_length": Variable("1", "free length at the critical point / L*"),
}
"""Variables of the master curve: in L*."""


def critical_points(runs: Sequence[xr.Dataset], labels: Mapping[str, str], top: float) -> list[xr.Dataset]:
    """The critical points of all materials; those of the elastica from the touch limit to beyond ``top``, L*.

    ``labels``: how figures call the materials of ``runs``, by their names.
    """
    heights = [elastica.touch_limit() + 1e-6, *np.arange(1.65, top + 0.25, 0.05)]
    return [
        of_all(dict(zip(labels, runs, strict=True)), labels).assign_attrs(title="critical points of all materials"),
        master_curve(heights).assign_attrs(title="the elastica's master curve"),
    ]


def of_all(runs: Mapping[str, xr.Dataset], labels: Mapping[str, str]) -> xr.Dataset:
    """Per material and height what the x-axis study found; rows padded with nan."""
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


def collapse(scene: Path, progress: Callable[[str], None]) -> xr.Dataset:
    """One strip through its collapse."""
    return through_collapse.run(Simulation.read(scene), progress)
