"""Paths below the touch limit, on which lambda has no maximum: random strips on the solid, its finer mesh and the rod.

The gripper moves along x from lambda_0 until the sag has touched in a point and the contact has become an interval.
Lengths in L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from stripfold.analysis.contact_branch import STEPS, BranchPoint, follow
from stripfold.analysis.static import LIMIT, End, StripModel, solve_height
from stripfold.errors import SolveError
from stripfold.material import Material
from stripfold.models.contact_mesh import Topology
from stripfold.moving_contact import MovingContact
from stripfold.solve.events import Event, never
from studies.branches import ETA_B
from studies.common import Progress, attempted, pooled, table

HEIGHT = (0.5, 1.55)
LENGTH = (10.0, 30.0)
MESHES = {"solid": ("solid", 1.0), "finer": ("solid", 0.5), "rod": ("rod", 1.0)}
"""Model and refinement of each run."""
LANDED = 1.0
"""Length of the interval of contact up to which a strip is followed, L*."""
STABLE, LIMITED, FAILED = "stable", "limit point", "failed"


def run(cases: int, seed: int, eta_m: float, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """The first cases of the sequence that ``seed`` starts.

    Returns
    -------
    Dataset over ``case``: what was drawn, and for each of :data:`MESHES` the outcome and lambda at the touch.
    """
    rows = pooled(partial(case, seed=seed, eta_m=eta_m), range(cases), threads, progress)
    return table("low_paths", "case", rows, {"seed": seed, "eta_m": eta_m})


def case(number: int, seed: int, eta_m: float) -> dict[str, Any]:
    """One case; each has a random stream of its own."""
    draw = np.random.default_rng([seed, number])
    eta_b = float(np.exp(draw.uniform(*np.log(ETA_B))))
    height, length = float(draw.uniform(*HEIGHT)), float(draw.uniform(*LENGTH))
    h = Material(eta_b, eta_m).relative_thickness
    row: dict[str, Any] = {"case": number, "height": height, "length": length, "thickness": h, "message": ""}
    for name, (kind, refinement) in MESHES.items():
        found, message = attempted(partial(landed, StripModel(length, h, kind=kind), height, refinement))
        row[name], row[f"touch_{name}"] = found or (FAILED, np.nan)
        row["message"] += message and f"{name}: {message}; "
    return row


def landed(strip: StripModel, height: float, refinement: float) -> tuple[str, float]:
    """The outcome and lambda at the touch of the sag.

    Raises
    ------
    SolveError
        The branch cannot be followed, or the whole strip leaves the floor.
    """
    run = solve_height(strip, height, refinement)
    if run.end is End.SNAP:
        return LIMITED, np.nan
    if run.end is End.LIFTED:
        raise SolveError(run.end.reason, parameter=run.lam)

    def stops(problem: MovingContact) -> list[Event]:
        if problem.mesh.topology is not Topology.INTERVAL:
            return [LIMIT]
        return [LIMIT, Event("landing", lambda point, _: _interval(problem.contact(point.q)) > LANDED, located=never)]

    # The last point is just past the touch.
    for item in follow(run.points[-2], STEPS, stops):
        if not isinstance(item, BranchPoint):
            return LIMITED if item.event is LIMIT else STABLE, run.lam
    raise AssertionError("a branch ends in an event or raises")


def _interval(contact: np.ndarray) -> float:
    return float(contact[1] - contact[0])
