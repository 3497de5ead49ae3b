"""Fabrics that have been measured: what to plan with where one's own strip has not been (docs/plan.md)."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from stripfold.ask.inputs import MOST_UNCERTAIN
from stripfold.base.errors import InvalidInputError

TABLE = Path(__file__).with_name("fabrics.csv")
"""Weight, bending rigidity and, where the source has it, hysteresis, with the sources."""


@dataclass(frozen=True)
class Fabric:
    """A fabric of the table.

    Attributes
    ----------
    name
        Its name in the table.
    eta_b
        Weight-to-bending-stiffness ratio, m^-4 s^2; with warp and weft the middle of both.
    eta_b_uncertainty
        Half the difference of warp and weft, relative, at most 0.5; the median of the table's where they are not told
        apart.
    rho_a
        Areal density, kg m^-2.
    friction_moment
        M_0, N: half of 2HB; None where the source has none.
    source
        Where the numbers are from.
    """

    name: str
    eta_b: float
    eta_b_uncertainty: float
    rho_a: float
    friction_moment: float | None
    source: str

    @property
    def values(self) -> dict[str, Any]:
        """What is known of a strip of it, by the names of inputs."""
        names = ("eta_b", "eta_b_uncertainty", "rho_a", "friction_moment")
        return {name: value for name in names if (value := getattr(self, name)) is not None}

    def __str__(self) -> str:
        eta_b = f"eta_b = {self.eta_b:.4g} m^-4 s^2 within {self.eta_b_uncertainty:.0%}"
        moment = "" if self.friction_moment is None else f", M_0 = {self.friction_moment:.3g} N"
        return f"{self.name}: {eta_b}, rho_a = {self.rho_a:.3g} kg/m^2{moment}"


@cache
def fabrics() -> tuple[Fabric, ...]:
    """All fabrics of the table."""
    lines = [line for line in TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    both = [row for row in rows if row["b_1_warp_N_m"]]
    usual = float(np.median([_ends(row)[1] for row in both]))
    return tuple(
        Fabric(
            name=row["name"],
            eta_b=(ends := _ends(row))[0],
            eta_b_uncertainty=min(ends[1] or usual, MOST_UNCERTAIN),
            rho_a=float(row["areal_density_kg_per_m2"]),
            friction_moment=0.5 * float(row["2HB_N"]) if row["2HB_N"] else None,
            source=row["source"],
        )
        for row in rows
    )


def _ends(row: dict[str, str]) -> tuple[float, float]:
    """Middle and half the relative difference of the eta_b of warp and weft, m^-4 s^2; 0 where one is known only."""
    weight, told = float(row["areal_density_kg_per_m2"]), row["b_1_warp_N_m"]
    rigidities = [row["b_1_warp_N_m"], row["b_1_weft_N_m"]] if told else [row["B_N_m"]]
    eta_b = [weight / float(rigidity) for rigidity in rigidities]
    middle = 0.5 * (max(eta_b) + min(eta_b))
    return middle, (max(eta_b) - min(eta_b)) / (2.0 * middle)


def fabric(name: str) -> Fabric:
    """The fabric of this name; its beginning is enough, where no other begins so.

    Raises InvalidInputError: no such fabric, or several.

    Examples
    --------
    >>> print(fabric("cotton broad"))
    cotton broad (A): eta_b = 1.07e+04 m^-4 s^2 within 31%, rho_a = 0.124 kg/m^2, M_0 = 0.000608 N
    """
    known = {one.name.casefold(): one for one in fabrics()}
    asked = " ".join(name.casefold().split())
    # Its beginning, or a longer name of the trade, as broadcloth.
    begins = [key for key in known if asked and key.startswith(asked)]
    meant = begins or [key for key in known if asked.startswith(key.rpartition(" (")[0] or key)]
    if asked in known or len(meant) == 1:
        return known[asked if asked in known else meant[0]]
    near = get_close_matches(asked, known, 1)
    names = ", ".join(one.name for one in fabrics())
    raise InvalidInputError("fabric", name, f"one of {names}", f"did you mean {known[near[0]].name}?" if near else "")
