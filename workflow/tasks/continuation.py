"""Motion of the gripper along x."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.ask import select_model
from tasks import x_axis
from tasks.branch_checks import check_branch
from tasks.materials import material_of


def run_x_axis(
    material: Mapping[str, Any], solid: Mapping[str, Any], gravity: float, progress: Callable[[str], None]
) -> xr.Dataset:
    """The x-axis runs of a material at all its heights."""
    data = x_axis.run(
        material_of(material, gravity),
        material["length"],
        [*material["touching_heights"], *material["heights"]],
        select_model.refinement("solid", solid["accuracy"]),
        progress,
        order=solid["order"],
        across=solid["elements_across"],
        law=solid["law"],
    )
    check_branch(data)
    return data.assign_attrs(title=f"x-axis continuation, {material['label']}")


def critical_points(runs: Sequence[xr.Dataset], labels: Mapping[str, str], top: float) -> list[xr.Dataset]:
    """The critical points of all materials; those of the elastica from the touch limit to beyond ``top``, L*."""
    heights = [elastica.touch_limit() + 1e-6, *np.arange(1.65, top + 0.25, 0.05)]
    return [
        x_axis.critical_points(dict(zip(labels, runs, strict=True)), labels).assign_attrs(
            title="critical points of all materials"
        ),
        x_axis.master_curve(heights).assign_attrs(title="the elastica's master curve"),
    ]
