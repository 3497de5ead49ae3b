"""The strip's material: the two weight-to-stiffness ratios and what follows from them.

Source: the paper's section III-D; the settled units are in ``docs/physics.md``, section 1.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import partial
from math import sqrt

GRAVITY = 9.81
"""Gravitational acceleration, m s^-2."""
UNITS = {"m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3}, "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}}
"""Other units in which people have lengths and times, by the SI unit, and their factors."""
_NUMBER = r"(?<![\w.])(-?\d+(?:\.\d+)?(?:e[-+]?\d+)?)"


@dataclass(frozen=True, slots=True)
class Material:
    """A strip material.

    ``eta_b``: weight-to-bending-stiffness ratio ``rho_a / D``, m^-4 s^2.  ``eta_m``: weight-to-membrane-stiffness ratio
    ``rho_a / (E h / (1 - nu^2))``, m^-2 s^2.  ``nu``: Poisson's ratio.  ``rho_a``: areal density, kg m^-2.  It cancels
    in statics and scales the force output only.  ``gravity``: gravitational acceleration, m s^-2.

    Examples
    --------
    >>> paper = Material(eta_b=3780.0)
    >>> round(paper.gravity_length, 5), round(paper.thickness, 6)
    (0.02999, 0.001782)
    """

    eta_b: float
    eta_m: float = 1e-3
    nu: float = 0.0
    rho_a: float = 1.0
    gravity: float = GRAVITY

    @property
    def gravity_length(self) -> float:
        """Gravity-bending length ``L* = (eta_b g)^(-1/3)``, m."""
        return float((self.eta_b * self.gravity) ** (-1.0 / 3.0))

    @property
    def thickness(self) -> float:
        """Thickness of the model ``h = sqrt(12 eta_m / eta_b)``, m; not the cloth's own."""
        return sqrt(12.0 * self.eta_m / self.eta_b)

    @property
    def relative_thickness(self) -> float:
        """``h / L*``: the only number beside nu by which the solid differs from the elastica."""
        return self.thickness / self.gravity_length

    @property
    def force_scale(self) -> float:
        """Force per width that the solvers call one: ``rho_a g L*``, N m^-1."""
        return self.rho_a * self.gravity * self.gravity_length

    def in_si(self, text: str) -> str:
        """A text with its numbers in L* and sqrt(L*/g) in metres and seconds.

        Examples
        --------
        >>> Material(3780.0).in_si("not within 400 sqrt(L*/g), 0.3 L* from it")
        'not within 22.12 s, 0.008996 m from it'
        """
        for unit, factor, si in (
            (r"sqrt\(L\*/g\)", sqrt(self.gravity_length / self.gravity), "s"),
            (r"L\*", self.gravity_length, "m"),
        ):
            text = re.sub(f"{_NUMBER} {unit}", partial(_converted, factor, si), text)
        return text

    @property
    def attributes(self) -> dict[str, float]:
        """Its numbers, for a file's attributes."""
        names = ("eta_b", "eta_m", "nu", "rho_a", "gravity", "gravity_length")
        return {name: float(getattr(self, name)) for name in names}

    @property
    def scales(self) -> dict[str, float]:
        """Factors from solver units (L*, rho_a g L*, sqrt(L*/g)) to SI, by the unit; quantities per metre of width."""
        length, force, time = self.gravity_length, self.force_scale, sqrt(self.gravity_length / self.gravity)
        return {
            "1": 1.0,
            "degree": 1.0,
            "m": length,
            "m s-1": length / time,
            "s": time,
            "s-2": time**-2,
            "N m-1": force,
            "N": force * length,
            "J m-1": force * length,
        }


def _converted(factor: float, unit: str, found: re.Match[str]) -> str:
    # Four digits: what was a round number in L* is none in m.
    return f"{factor * float(found[1]):.4g} {unit}"
