"""Internal friction of real fabrics in units of the strip's own weight and stiffness, from published measurements.

Kawabata's test gives the bending rigidity B and 2HB, the width of the loop: M_0 is half of it.  With the weight w per
area, L* = (B / w)^(1/3).  A first bending, moment = M_0 + B kappa, gives both by a straight line.
Source: docs/physics.md, section 8.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from stripfold import elastica, tables
from stripfold.errors import InvalidInputError
from stripfold.material import GRAVITY
from studies.common import dataset
from tasks import textile

TEXTS = ("name", "fibre", "weave", "source")
PRINTED = {"W_mg_per_cm2": 1e-2, "B_gf_cm2_per_cm": 9.80665e-5, "2HB_gf_cm_per_cm": 9.80665e-3}
"""Columns in the units that are printed, and the factors to SI."""
SI = ("areal_density_kg_per_m2", "B_N_m", "2HB_N")
COLUMNS = ",".join([*TEXTS[:3], *PRINTED, *SI, TEXTS[3]])
MAX_ROWS = 1000
ROUNDING = 1e-6
"""Largest relative difference of a value in SI from the printed one."""


def run(table: str, measured: str, areal_load: float, height: float) -> xr.Dataset:
    """Friction of the fabrics of ``table`` over ``fabric``, and of the textile of data/.

    Parameters
    ----------
    table
        Path of the fabrics' table, with the header :data:`COLUMNS`.
    measured, areal_load
        Moment-curvature table of the textile as it is first bent, and its weight per area, N m^-2.
    height
        Height of the gripper at whose critical state the textile's secant is taken, L*.

    Raises
    ------
    InvalidInputError
        A table that cannot be read, or values in SI that are not the printed ones.
    """
    path = Path(table)
    header = COLUMNS.split(",")
    rows = tables.read_rows("table", path, COLUMNS, (1, MAX_ROWS))
    texts = {name: [row[header.index(name)] for row in rows] for name in TEXTS}
    numbers = tables.to_numbers("table", path, [row[3:9] for row in rows], 6)
    printed, si = numbers[:, :3], numbers[:, 3:]
    wrong = np.abs(printed * list(PRINTED.values()) / si - 1.0) > ROUNDING
    if np.any(numbers <= 0.0) or np.any(wrong):
        row = int(np.flatnonzero(np.any((numbers[:, :3] <= 0.0) | wrong, axis=1))[0])
        raise InvalidInputError("table", texts["name"][row], "positive values, in SI those printed", f"see {path}")
    density, rigidity, loop = si.T
    weight = GRAVITY * density
    unit = np.cbrt(rigidity / weight)
    bent = textile.read_table(measured)
    slope, moment = np.polyfit(bent[:, 0], bent[:, 1], 1)  # moment = M_0 + B kappa in a first bending
    secant = textile.secant(bent, areal_load, textile.largest_curvature(elastica.critical(height).state))
    units = {"": np.cbrt(slope / areal_load), "_secant": np.cbrt(secant.stiffness / areal_load)}
    return dataset(
        "fabrics",
        {
            "fabric": ("fabric", texts["name"]),
            **{name: ("fabric", texts[name]) for name in TEXTS[1:]},
            "areal_density": ("fabric", density),
            "rigidity": ("fabric", rigidity),
            "loop_width": ("fabric", loop),
            "gravity_length": ("fabric", unit),
            "eta_b": ("fabric", density / rigidity),
            "friction": ("fabric", 0.5 * loop / (weight * unit**2)),
            "textile_rigidity": ((), slope),
            "textile_moment": ((), moment),
            **{f"textile_friction{of}": ((), moment / (areal_load * unit**2)) for of, unit in units.items()},
        },
    )
