"""Paths below the touch limit, on which lambda has no maximum: random strips on the solid, its finer mesh and the rod.

The gripper moves along x from lambda_0 until the sag has touched in a point and the contact has become an interval.
The touch limit falls with the thickness, as the lying part is stretched: heights are drawn in proportion to it.
Lengths in L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.polynomial import Polynomial

from stripfold import elastica
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
"""Of the gripper above a thin strip; above a thick one less, as its touch limit is."""
LENGTH = (10.0, 30.0)
MESHES = {"solid": ("solid", 1.0), "finer": ("solid", 0.5), "rod": ("rod", 1.0)}
"""Model and refinement of each run."""
BETWEEN = (1.4, 1.6)
"""Where touch limits are looked for, L*."""
LIMIT_TOLERANCE = 1e-3
THICKNESSES = 4
"""Number of thicknesses for which the touch limit is computed; it is linear in the square."""
LANDED = 1.0
"""Length of the interval of contact up to which a strip is followed, L*."""
STABLE, LIMITED, FAILED = "stable", "limit point", "failed"


def run(cases: int, seed: int, eta_m: float, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """The first cases of the sequence that ``seed`` starts.

    Returns
    -------
    Dataset over ``case``: what was drawn, and for each of :data:`MESHES` the outcome and lambda at the touch.
    """
    ends = [Material(eta_b, eta_m).relative_thickness for eta_b in ETA_B]
    thicknesses = np.linspace(min(ends), max(ends), THICKNESSES)
    limits = pooled(touch_limit, thicknesses, threads)
    limit = Polynomial.fit(thicknesses**2, limits, 1)
    rows = pooled(partial(case, seed=seed, eta_m=eta_m, limit=limit), range(cases), threads, progress)
    return table("low_paths", "case", rows, {"seed": seed, "eta_m": eta_m})


def touch_limit(thickness: float) -> float:
    """Height below which the sag of the longest rod touches before lambda has a maximum, L*: the lowest such height."""
    strip = StripModel(LENGTH[1], thickness, kind="rod")
    below, above = BETWEEN
    while above - below > LIMIT_TOLERANCE:
        middle = 0.5 * (below + above)
        if solve_height(strip, middle, 1.0).end is End.SNAP:
            above = middle
        else:
            below = middle
    return below


def case(number: int, seed: int, eta_m: float, limit: Polynomial) -> dict[str, Any]:
    """One case; each has a random stream of its own.  ``limit`` is the touch limit by the thickness squared."""
    draw = np.random.default_rng([seed, number])
    eta_b = float(np.exp(draw.uniform(*np.log(ETA_B))))
    height, length = float(draw.uniform(*HEIGHT)), float(draw.uniform(*LENGTH))
    h = Material(eta_b, eta_m).relative_thickness
    own = float(limit(h**2))
    height *= own / elastica.touch_limit()
    row: dict[str, Any] = {"case": number, "height": height, "length": length, "thickness": h, "touch_limit": own}
    row["message"] = ""
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
