"""Tasks of the workflow's rules."""

from collections.abc import Mapping
from typing import Any

from stripfold.base.material import Material


def material_of(entry: Mapping[str, Any], gravity: float) -> Material:
    """The material of an entry of the configuration."""
    return Material(**{key: entry[key] for key in ("eta_b", "eta_m", "nu", "rho_a")}, gravity=gravity)
