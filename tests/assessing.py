"""Paths in L* assessed for a material."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from stripfold.ask.assess import PathAssessment, assess
from stripfold.ask.inputs import PathInputs
from stripfold.base.material import Material
from stripfold.paths import FoldPath
from stripfold.paths.curve import GripperPath


def assess_path(
    material: Material,
    length: float,
    path: GripperPath,
    *,
    yield_curvature: float | None = None,
    refinement: float = 1.0,
    compare: bool = True,
    **given: Any,
) -> PathAssessment:
    """Assess a path in L* for a strip of ``length``, m; ``given`` are the other inputs."""
    unit = material.gravity_length
    asked = PathInputs(**asdict(material), length=length, **given)
    own = FoldPath(path.name, length, unit, path.scaled(unit))
    return assess(asked, own, yield_curvature=yield_curvature, refinement=refinement, compare=compare)
