"""A textile whose moment-curvature law is not linear: the linear strip that stands in for it.

``eta_b`` describes a linear law.  For another law the secant through the largest curvature that occurs is the best
stiffness that one number can give; which curvature occurs depends on the stiffness, so both are found together.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import GRAVITY
from stripfold.base.numerics import root
from stripfold.files import tables

COLUMNS = "curvature_1_per_m,moment_N"
MAX_ROWS = 10_000


class Secant(NamedTuple):
    """The linear strip that has the textile's moment at the given curvature.

    ``stiffness``: bending stiffness per width ``D = M(kappa) / kappa``, N m; ``kappa``: curvature at which the secant
    is taken, m^-1; ``eta_b``: weight-to-bending-stiffness ratio, m^-4 s^2.
    """

    stiffness: float
    kappa: float
    eta_b: float


def read_table(path: str | os.PathLike[str]) -> Array:
    """Moment-curvature table, shape (m, 2): curvature, m^-1, and moment per width, N.

    Raises InvalidInputError: no such file, other columns, or numbers that are not positive and increasing in the
    curvature.
    """
    table = tables.read_table("table", Path(path), COLUMNS, (2, MAX_ROWS)).numbers()
    if not (np.all(table > 0.0) and np.all(np.diff(table, axis=0) > 0.0)):
        raise InvalidInputError("table", str(path), "positive numbers, both columns increasing")
    return table


def largest_curvature(state: elastica.State) -> float:
    """Largest absolute curvature, 1/L*: a parabola through the largest of 1001 samples and its neighbours."""
    size = np.abs(state.at(np.linspace(0.0, state.length, 1001)).curvature)
    top = min(max(int(np.argmax(size)), 1), size.size - 2)
    before, at, after = size[top - 1 : top + 2]
    second = before - 2.0 * at + after
    # At an end (a clamp), or where the curvature is constant, there is no maximum of a parabola.
    return float(size.max() if at < size.max() or second >= 0.0 else at - (before - after) ** 2 / (8.0 * second))


def secant(table: Array, load: float, dimensionless_curvature: float, gravity: float = GRAVITY) -> Secant:
    """The secant stiffness at ``kappa = dimensionless_curvature / L*``, where ``L* = (D / load)^(1/3)``.

    ``table``: moment-curvature table, shape (m, 2), see :func:`read_table`; straight lines between its rows.  ``load``:
    weight per area, N m^-2.  ``dimensionless_curvature``: largest curvature of the state that the strip is meant for,
    in 1 / L*.  ``gravity``: gravitational acceleration, m s^-2.  Raises InvalidInputError: the curvature would lie
    outside the table: nothing is extrapolated.

    Examples
    --------
    >>> linear = np.array([[1.0, 0.02], [50.0, 1.0]])
    >>> found = secant(linear, load=2.0, dimensionless_curvature=2.5)
    >>> round(found.stiffness, 9), round(found.kappa, 9)
    (0.02, 11.603972084)
    """
    curvature, moment = table.T

    def excess(kappa: float) -> float:
        # kappa L* = c with L*^3 = M / (kappa load): M kappa^2 / load = c^3.  Grows with kappa: one root.
        return float(np.interp(kappa, curvature, moment)) * kappa**2 / load - dimensionless_curvature**3

    lowest, highest = (float(np.cbrt(m * k**2 / load)) for k, m in table[[0, -1]])
    if not lowest <= dimensionless_curvature <= highest:
        allowed = f"from {lowest:.4g} to {highest:.4g} with this table and a load of {load:g} N m^-2"
        raise InvalidInputError("dimensionless_curvature", dimensionless_curvature, allowed)
    kappa = root(excess, float(curvature[0]), float(curvature[-1]), 1e-13)
    stiffness = float(np.interp(kappa, curvature, moment)) / kappa
    return Secant(stiffness, kappa, load / (gravity * stiffness))
