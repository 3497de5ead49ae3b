"""The friction an R-path needs, and the strip held by it, as a dataset in SI; and the two ways out without it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from stripfold import schema
from stripfold.analysis.friction import LAWS, Run, follow, model_for, smallest
from stripfold.analysis.path_friction import Step
from stripfold.analysis.post_critical import follow_both_branches
from stripfold.analysis.release import Fall, Progress
from stripfold.analysis.states import dataset, of_material, rows_of_motion, rows_of_segment
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from stripfold.effects import Pull
from stripfold.errors import SolveError
from stripfold.material import Material
from stripfold.paths.rpath import RPath, plan_r_path
from stripfold.problem import StripProblem
from stripfold.solve import continuation
from stripfold.solve.problem import Tangent

OF_STRIP = ("eta_b", "gravity_length", "relative_length", "step", "k_f", "M_0", "planned_touch_x")
"""Attributes of the files of :func:`run` that the table has per material."""


def run(
    material: Material, length: float, step: float, refinement: float, progress: Progress | None = None
) -> xr.Dataset:
    """The smallest friction with which an R-path is followed, by either law, and the path followed with it to its end.

    Parameters
    ----------
    material, length
        The strip; m.
    step
        Size of the steps, L*.
    refinement
        Factor on all element lengths.

    Returns
    -------
    Dataset over ``law``, ``state`` (the steps) and ``node``.

    Raises
    ------
    SolveError
        No friction suffices, or the path is not followed to its end with the one that does.
    """
    say = progress or (lambda _: None)
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu)
    plan = plan_r_path(strip.length)
    model = model_for(strip, plan, refinement)
    brackets, runs = [], []
    for law in LAWS:
        say(f"{law}: looking for the smallest that suffices")
        brackets.append(smallest(model, plan, law, step))
        found = follow(model, plan, law, brackets[-1][1], step, to_end=True)
        if found.lost:
            raise SolveError(f"the path was followed to its first touch only: {found.lost}")
        say(f"{law}: {brackets[-1][1]:.4g}, first touch at {found.touch_x:.4g} L*")
        runs.append(found)
    values = {
        "fails": ("law", [b[0] for b in brackets]),
        "suffices": ("law", [b[1] for b in brackets]),
        "touch_x": ("law", [r.touch_x for r in runs]),
        "touch_step": ("law", [float(r.touch or 0) for r in runs]),
        **_of_steps(runs, plan),
        "arc": ("node", model.s),
        "law": ("law", LAWS),
    }
    attrs = {
        "step": step,
        "k_f": brackets[0][1],
        "M_0": brackets[1][1],
        "relative_length": strip.length,
        "planned_touch_x": plan.first_touch,
        "landing_x": plan.landing,
    }
    return schema.dataset(
        values, {**of_material(material), "length": length, **schema.in_si(attrs, material.scales)}, material.scales
    )


def _of_steps(runs: list[Run], plan: RPath) -> dict[str, Any]:
    """Values of each step, in solver units; both laws take the same steps."""
    model = runs[0].steps[0].problem.model

    def each(get: Any) -> Array:
        return np.array([[get(step) for step in found.steps] for found in runs])

    def deviation(step: Step) -> float:
        planned = plan.mid_surface(step.point.lam, model.s)
        return float(np.linalg.norm(model.mid_surface(step.point.q) - planned, axis=1).max())

    grip = each(lambda step: float(np.linalg.norm(_grip(step))))
    pull = each(lambda step: sum(e.pulling_force(step.point.q) for e in step.problem.effects if isinstance(e, Pull)))
    place = each(lambda step: model.mid_surface(step.point.q))
    columns = {
        "travelled": each(lambda step: step.point.lam),
        "pseudo_time": each(lambda step: plan.path.pseudo_time(step.point.lam)),
        "gripper_force": grip,
        "pulling_force": pull,
        "ratio": pull / grip,
        "eigenvalue": each(_eigenvalue),
        "deviation": each(deviation),
    }
    on = ("law", "state")
    nodes = (*on, "node")
    return {name: (on, values) for name, values in columns.items()} | {
        "x": (nodes, place[..., 0]),
        "z": (nodes, place[..., 1]),
    }


def _grip(step: Step) -> Array:
    return np.asarray(step.problem.residual(step.point.q, step.point.lam)[step.problem.model.middle[0]])


def _eigenvalue(step: Step) -> float:
    """The smallest eigenvalue of the strip's own tangent at a step: negative where only friction holds it."""
    bare = StripProblem(step.problem.model, step.problem.motion)
    towards = Tangent(np.zeros(bare.size), 1.0)
    return float(continuation.evaluate(bare, step.point.state, towards, mode=step.point.mode).eigenvalues[0])


def two_ways(
    material: Material, length: float, fall: Fall, refinement: float, progress: Progress | None = None
) -> xr.Dataset:
    """The two ways out of an R-path, over ``state`` and ``node`` as :func:`.states.dataset`, with ``way``: 0 or 1.

    Where there is no unstable planned state the dataset is empty and its attribute ``reason`` says so.
    """
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu)
    plan = plan_r_path(strip.length)
    model = model_for(strip, plan, refinement)
    try:
        ways = follow_both_branches(model, strip, plan, fall, progress)
    except SolveError as error:
        return xr.Dataset(attrs={**of_material(material), "length": length, "reason": str(error)})
    rows, way, touches = [], [], []
    for i, direction in enumerate(ways.branches):
        new = rows_of_motion(direction.motion, direction.after.problem(0), 2 * i)
        new += rows_of_segment(direction.after, 2 * i + 1)
        rows += new
        way += [float(i)] * len(new)
        touches.append(direction.motion.touch_x)
    data = dataset(rows, model, plan.path, material)
    data["way"] = ("state", way, schema.variables()["way"].attributes)
    return data.assign_attrs(
        length=length,
        reason="",
        signs=[direction.sign for direction in ways.branches],
        touch_x=[unit * x for x in touches],
        ends=[unit * direction.after.points[-1].lam for direction in ways.branches],
        landing_x=unit * plan.landing,
        planned_touch_x=unit * plan.first_touch,
    )


def table(files: Mapping[str, xr.Dataset], ways: Mapping[str, xr.Dataset], labels: Mapping[str, str]) -> xr.Dataset:
    """What friction each material needs, over ``material`` and ``law``, and whether it has two ways out without.

    ``files`` are of :func:`run` and ``ways`` of :func:`two_ways`, by the material's name.
    """
    names = list(labels)
    runs = [files[name] for name in names]

    def of_law(get: Callable[[xr.Dataset], float]) -> tuple[tuple[str, str], Array]:
        return ("material", "law"), np.array([[get(data.sel(law=law)) for law in LAWS] for data in runs])

    fell = [float(np.isfinite(ways[name].attrs.get("touch_x", [])).sum() == 1) for name in names]
    return schema.dataset(
        {
            "fails": of_law(lambda d: float(d["fails"])),
            "suffices": of_law(lambda d: float(d["suffices"])),
            "touch_x": of_law(lambda d: float(d["touch_x"])),
            "ratio_max": of_law(lambda d: float(_before_touch(d, "ratio").max())),
            "ratio_median": of_law(lambda d: float(np.median(_before_touch(d, "ratio")))),
            "eigenvalue_min": of_law(lambda d: float(_before_touch(d, "eigenvalue").min())),
            "deviation_max": of_law(lambda d: float(d["deviation"].max())),
            "deviation_end": of_law(lambda d: float(d["deviation"][-1])),
            **{name: ("material", [float(d.attrs[name]) for d in runs]) for name in OF_STRIP},
            "two_ways": ("material", fell),
            "material": ("material", names),
            "label": ("material", list(labels.values())),
            "law": ("law", LAWS),
        }
    )


def _before_touch(data: xr.Dataset, name: str) -> Array:
    """Values of one law up to its first touch."""
    return np.asarray(data[name].values[: int(data["touch_step"]) + 1])
