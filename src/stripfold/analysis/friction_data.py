"""The friction an R-path needs, and the strip held by it, as a dataset in SI; and the two ways out without it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

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
    per_law = {
        "fails": (np.array([b[0] for b in brackets]), "1", "not enough: k_f / (g/L*), or M_0 / rho_a g L*^2"),
        "suffices": (np.array([b[1] for b in brackets]), "1", "enough: k_f / (g/L*), or M_0 / rho_a g L*^2"),
        "touch_x": (unit * np.array([r.touch_x for r in runs]), "m", "first touch, horizontal; origin mid-strip"),
        "touch_step": (np.array([float(r.touch or 0) for r in runs]), "1", "index of the first step that touches"),
    }
    data: dict[str, Any] = {
        name: (("law",), values, {"units": units, "long_name": text}) for name, (values, units, text) in per_law.items()
    }
    data |= _of_steps(runs, plan, material)
    data["arc"] = (("node",), unit * model.s, {"units": "m", "long_name": "distance from the grasped end"})
    texts = {"units": "1", "long_name": "law of friction"}
    k_f, moment = (b[1] for b in brackets)
    return xr.Dataset(
        data,
        coords={"law": ("law", np.array(LAWS, dtype=object), texts)},
        attrs={
            **of_material(material),
            "length": length,
            "relative_length": strip.length,
            "step": unit * step,
            "k_f": k_f * material.gravity / unit,
            "M_0": moment * material.rho_a * material.gravity * unit**2,
            "planned_touch_x": unit * plan.first_touch,
            "landing_x": unit * plan.landing,
        },
    )


def _of_steps(runs: list[Run], plan: RPath, material: Material) -> dict[str, Any]:
    """What belongs to each step; both laws take the same steps."""
    unit = material.gravity_length
    seconds = float(np.sqrt(unit / material.gravity))
    force = material.rho_a * material.gravity * unit
    model = runs[0].steps[0].problem.model

    def each(get: Any) -> Array:
        return np.array([[get(step) for step in found.steps] for found in runs])

    def deviation(step: Step) -> float:
        planned = plan.mid_surface(step.point.lam, model.s)
        return float(np.linalg.norm(model.mid_surface(step.point.q) - planned, axis=1).max())

    grip = each(lambda step: float(np.linalg.norm(_grip(step))))
    pull = each(lambda step: sum(e.pulling_force(step.point.q) for e in step.problem.effects if isinstance(e, Pull)))
    place = each(lambda step: model.mid_surface(step.point.q))
    on = ("law", "state")
    columns = {
        "travelled": (on, unit * each(lambda step: step.point.lam), "m", "length the gripper has travelled"),
        "pseudo_time": (on, each(lambda step: plan.path.pseudo_time(step.point.lam)), "1", "pseudo time, lambda"),
        "gripper_force": (on, force * grip, "N m-1", "size of the gripper's force"),
        "pulling_force": (on, force * pull, "N m-1", "pulling force of the paper's friction"),
        "ratio": (on, pull / grip, "1", "pulling force / gripper force"),
        "eigenvalue": (on, each(_eigenvalue) / seconds**2, "s-2", "smallest eigenvalue of (K, M) without friction"),
        "deviation": (on, unit * each(deviation), "m", "largest distance from the planned state"),
        "x": ((*on, "node"), unit * place[..., 0], "m", "mid-surface, horizontal; origin mid-strip"),
        "z": ((*on, "node"), unit * place[..., 1], "m", "mid-surface, height over the floor"),
    }
    return {name: (dims, values, {"units": u, "long_name": t}) for name, (dims, values, u, t) in columns.items()}


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
    data["way"] = (("state",), np.array(way), {"units": "1", "long_name": "which of the two ways"})
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

    def before_touch(data: xr.Dataset, law: str, name: str) -> Array:
        chosen = data.sel(law=law)
        return np.asarray(chosen[name].values[: int(chosen["touch_step"]) + 1])

    def per(get: Callable[[xr.Dataset, str], float]) -> Array:
        return np.array([[get(data, law) for law in LAWS] for data in runs])

    columns = {
        "fails": (per(lambda d, law: float(d["fails"].sel(law=law))), "1", str(runs[0]["fails"].attrs["long_name"])),
        "suffices": (
            per(lambda d, law: float(d["suffices"].sel(law=law))),
            "1",
            str(runs[0]["suffices"].attrs["long_name"]),
        ),
        "touch_x": (per(lambda d, law: float(d["touch_x"].sel(law=law))), "m", "first touch, horizontal"),
        "ratio_max": (
            per(lambda d, law: float(before_touch(d, law, "ratio").max())),
            "1",
            "largest pulling force / gripper force up to the first touch",
        ),
        "ratio_median": (
            per(lambda d, law: float(np.median(before_touch(d, law, "ratio")))),
            "1",
            "median of pulling force / gripper force up to the first touch",
        ),
        "eigenvalue_min": (
            per(lambda d, law: float(before_touch(d, law, "eigenvalue").min())),
            "s-2",
            "smallest eigenvalue of (K, M) without friction up to the first touch",
        ),
        "deviation_max": (
            per(lambda d, law: float(d["deviation"].sel(law=law).max())),
            "m",
            "largest distance from the planned state",
        ),
        "deviation_end": (
            per(lambda d, law: float(d["deviation"].sel(law=law)[-1])),
            "m",
            "distance of the last state from the planned one",
        ),
    }
    data: dict[str, Any] = {
        name: (("material", "law"), values, {"units": units, "long_name": text})
        for name, (values, units, text) in columns.items()
    }
    of_files = {
        "eta_b": ("m-4 s2", "weight-to-bending-stiffness ratio"),
        "gravity_length": ("m", "L*"),
        "relative_length": ("1", "length of the strip / L*"),
        "step": ("m", "size of the steps"),
        "k_f": ("s-2", "smallest k_f that suffices"),
        "M_0": ("N", "smallest M_0 that suffices"),
        "planned_touch_x": ("m", "planned first touch, horizontal"),
    }
    for name, (units, text) in of_files.items():
        values = np.array([float(d.attrs[name]) for d in runs])
        data[name] = (("material",), values, {"units": units, "long_name": text})
    both = np.array([float(np.isfinite(ways[name].attrs.get("touch_x", [])).sum() == 1) for name in names])
    text = "1 where the unstable planned state falls on the lower layer one way and rests without a touch the other"
    data["two_ways"] = (("material",), both, {"units": "1", "long_name": text})
    coords = {
        "material": ("material", np.array(names, dtype=object), {"units": "1", "long_name": "name"}),
        "label": ("material", np.array(list(labels.values()), dtype=object), {"units": "1", "long_name": "label"}),
        "law": ("law", np.array(LAWS, dtype=object), {"units": "1", "long_name": "law of friction"}),
    }
    return xr.Dataset(data, coords=coords)
