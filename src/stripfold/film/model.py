"""The model's lambda_c for a described strip, to be shown beside the measured one."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan

from stripfold import elastica
from stripfold.base.material import Material
from stripfold.film.recording import Entries


@dataclass(frozen=True)
class ModelValue:
    """lambda_c of the elastica at the described height, m; nan where the sag touches the lower layer before a snap.

    ``without_friction``, ``low``, ``high``: the value, and its 95 % interval from that of eta_b; nan where none was
    given.  ``with_friction``: with the fabric's friction to first order, see :func:`.elastica.friction_delay`; nan
    where none was given.
    """

    without_friction: float
    low: float
    high: float
    with_friction: float


def model_value(entries: Entries) -> ModelValue:
    """The model's lambda_c for a recording's strip and height."""
    strip, height = entries.strip, entries.gripper.height

    def lambda_c(eta_b: float) -> float:
        unit = Material(eta_b).gravity_length
        return elastica.critical(height / unit).advance * unit

    value, low, high, with_friction = lambda_c(strip.eta_b), nan, nan, nan
    if strip.eta_b_interval is not None:
        ends = [lambda_c(eta_b) for eta_b in strip.eta_b_interval]
        if all(map(isfinite, (value, *ends))):
            low, high = sorted(ends)
    if strip.friction_moment is not None and strip.rho_a is not None:
        material = Material(strip.eta_b)
        unit = material.gravity_length
        moment = strip.friction_moment / (strip.rho_a * material.gravity * unit**2)
        with_friction = value + elastica.friction_delay(height / unit) * moment * unit
    return ModelValue(value, low, high, with_friction)
