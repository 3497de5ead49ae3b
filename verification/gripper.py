"""How long a strip a clamp that turns as planned keeps stable on its R-path, and the friction that longer ones need.

Beside the hinge of the paper, whose strip has the same shapes up to where it is lost.  The longest strip by bisection,
on the rod and the solid; the least M_0 with which the rod's first touch is within 0.1 L* of the planned one, too.
Lengths in L*, M_0 in rho_a g L*^2.  Source: docs/gripper.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from math import sqrt
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import look
from stripfold.base.errors import SolveError
from stripfold.base.validation import Gripper
from stripfold.draw.style import figure, styled
from stripfold.follow.memory import STEP, effects_of, load_path
from stripfold.follow.statics import StripModel, follow
from stripfold.follow.track import End
from stripfold.paths.rpath import plan_r_path
from verification.common import Progress, dataset, grid, pooled
from verification.numbers import Facts, Number

GRIPPERS: dict[Gripper, tuple[float, float]] = {"hinge": (8.5, 10.5), "turning": (11.0, 14.0)}
"""Lengths between which the longest strip is looked for."""
MODELS = ("rod", "solid")
MOMENTS = (1e-4, 0.05)
"""M_0 between which the least one is looked for."""
NEAR = 0.1
"""Largest distance of the first touch from the planned one."""


def run(
    thickness: float = 0.0594,
    lengths: Sequence[float] = (12.0, 14.0),
    refinement: float = 2.0,
    halvings: int = 3,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The longest stable strip over ``model`` and ``gripper``, and the least M_0 over ``gripper`` and ``length``.

    ``lengths``: of the strips whose friction is found; ``halvings``: of each interval that is searched.
    """
    cases = list(product(MODELS, GRIPPERS))
    longest = pooled(partial(_longest, thickness, refinement, halvings), cases, threads, progress)
    needed = partial(_needed, thickness, refinement, halvings)
    axes: dict[str, Sequence[Any]] = {"gripper": list(GRIPPERS), "length": lengths}
    return dataset(
        grid(needed, ("needed",), axes, threads, progress)
        | {"model": ("model", MODELS), "longest": (("model", "gripper"), np.reshape(longest, (len(MODELS), -1)))},
        {"thickness": thickness},
    )


def _last(holds: Callable[[float], bool], low: float, high: float, halvings: int, mean: Callable[..., float]) -> float:
    """The end of the values from ``low`` on for which something holds, which does not at ``high``."""
    if not holds(low) or holds(high):
        raise SolveError(f"no change between {low:g} and {high:g}")
    for _ in range(halvings):
        middle = mean(low, high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return mean(low, high)


def _longest(thickness: float, refinement: float, halvings: int, case: tuple[str, Gripper]) -> float:
    model, gripper = case

    def stable(length: float) -> bool:
        path = replace(plan_r_path(length).path, gripper=gripper)
        mesh = StripModel(length, thickness, kind=model).contact_mesh(0.5 * refinement)
        return follow(mesh, path, length, until="touch").stable

    return _last(stable, *GRIPPERS[gripper], halvings + 2, lambda a, b: 0.5 * (a + b))


def _needed(thickness: float, refinement: float, halvings: int, gripper: Gripper, length: float) -> dict[str, float]:
    """0 where next to nothing is enough."""
    plan = plan_r_path(length)
    path, mesh = replace(plan.path, gripper=gripper), StripModel(length, thickness, kind="rod")

    def fails(moment: float) -> bool:
        planned = mesh.contact_mesh(refinement, memory=True)
        found = load_path(planned, path, effects_of("hysteresis", moment), STEP, until="touch")
        return found.end is not End.TOUCH or abs(found.touch_x - plan.first_touch) > NEAR

    if not fails(MOMENTS[0]):
        return {"needed": 0.0}
    return {"needed": _last(fails, *MOMENTS, halvings, lambda a, b: sqrt(a * b))}


def facts(d: xr.Dataset) -> Facts:
    clamp, hinge = (d.longest.sel(gripper=name) for name in ("turning", "hinge"))
    return {
        "clamp": clamp.sel(model="rod"),
        "solid": clamp.sel(model="solid"),
        "hinge": hinge.sel(model="rod"),
        "apart": max(float(np.abs(of.diff("model")).max()) for of in (clamp, hinge)),
        "thickness": d.attrs["thickness"],
        "needed": "; ".join(
            f"{length:g} L*: {float(d.needed.sel(gripper='turning', length=length)):.4f} against "
            f"{float(d.needed.sel(gripper='hinge', length=length)):.4f}"
            for length in d.length.values
        ),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("clamp_longest", "clamp", "L*", "rod and solid within 0.05 L*",
            "longest strip that is stable on its R-path up to the touch in a clamp that turns as planned, rod, h = "
            "{thickness:g} L*; solid {solid:.3f}; in a hinge {hinge:.3f}; least M_0 of clamp and hinge: {needed}",
            lambda f: f.apart < 0.05, digits=4, spread=0.02),
    ),
}
# fmt: on


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the least friction moment over the length of the strip."""
    fig = figure(2.6)
    ax = fig.subplots()
    for i, (gripper, label) in enumerate((("hinge", "hinge"), ("turning", "clamp that turns as planned"))):
        color, marker = look(i)
        one = data["needed"].sel(gripper=gripper)
        ax.plot(one["length"], one, marker=marker, color=color, mfc="none", label=label)
    ax.set(xlabel="length of the strip$\\,/\\,L^*$", ylabel="$M_0$ needed$\\,/\\,\\rho_a g{L^*}^2$")
    ax.set_ylim(bottom=0.0)
    ax.legend(fontsize=7, loc="lower right")
    return fig
