"""How much internal friction an R-path needs: the smallest with which the strip follows its plan, by either law.

In units of L*, g/L* and rho_a g L*; :func:`run` converts to SI.  See docs/physics.md, sections 5 and 8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import chain
from math import exp, inf, nan, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import LostStabilityError, SolveError
from stripfold.base.material import Material
from stripfold.files import schema
from stripfold.follow.collapse import nodes
from stripfold.follow.contact import touch_position
from stripfold.follow.contact_branch import Planned
from stripfold.follow.path_friction import Step, effects_of, load_incrementally
from stripfold.follow.release import Progress
from stripfold.follow.static import StripModel
from stripfold.paths.rpath import RPath, plan_r_path
from stripfold.solve import continuation
from stripfold.solve.problem import Equilibrium
from stripfold.strip.contact_mesh import ContactMesh
from stripfold.strip.effects import Pull
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import Motion

if TYPE_CHECKING:
    import xarray as xr

LAWS = ("pull", "hysteresis")
"""The paper's pull towards the state before, and the bending hysteresis."""
FOLLOWED = 0.1
"""Largest distance of the first touch from the planned one for a strip that follows its plan, L*."""
FIRST_GUESS = {"pull": (2.45, 33.5), "hysteresis": (1.62, 21.5)}
"""Strength to begin the search with, ``a h^1.5 exp(-b / length)``, fitted to found ones: a of k_f times the step, g, or
of M_0, rho_a g L*^2, and b, L*."""
NARROW = 1.1
"""Ratio of the bracket's ends at which the search ends."""
FIRST_RATIO = 1.095
"""Ratio of the second strength tried to the first: with a good guess both are the bracket."""
MOST_TRIALS = 30


@dataclass(frozen=True, eq=False)
class Sample:
    """What is kept of a step: without its effects, whose elements would fill the memory.

    ``pull`` is the force of the paper's pull, rho_a g L*; 0 without it.
    """

    mesh: ContactMesh
    motion: Motion
    state: Equilibrium
    pull: float

    @classmethod
    def of(cls, step: Step) -> Sample:
        """Of a step."""
        problem, at = step.at.problem, step.at
        effects = problem.at(at.contact).effects
        pull = sum(effect.pulling_force(at.u) for effect in effects if isinstance(effect, Pull))
        return cls(problem.mesh, problem.motion, at.point.state, pull)


@dataclass(frozen=True, eq=False)
class Run:
    """An R-path followed with friction to the first touch.

    Attributes
    ----------
    law, strength, step
        One of :data:`LAWS`; k_f in g/L* or M_0 in rho_a g L*^2; size of the steps, L*.
    steps, rest
        The accepted steps, the last one touches; and those beyond it, which are computed when asked for.
    touch_x
        Where it touches, L*; nan without a touch.
    lost
        Why it ended before; empty if it did not.
    """

    law: str
    strength: float
    step: float
    steps: tuple[Sample, ...]
    rest: Iterable[Sample]
    touch_x: float
    lost: str = ""

    @property
    def touch(self) -> int:
        """Index of the step that touches."""
        return len(self.steps) - 1

    def followed(self, plan: RPath) -> bool:
        """Whether it first touches at the planned place."""
        return abs(self.touch_x - plan.first_touch) < FOLLOWED


def follow(mesh: Planned, plan: RPath, law: str, strength: float, step: float) -> Run:
    """Follow an R-path from the flat strip to its first touch."""
    rest = load_incrementally(mesh, plan.path, effects_of(law, strength), step)
    steps: list[Sample] = []
    try:
        for new in rest:
            steps.append(Sample.of(new))
            if new.touches:
                problem, point = new.on_mesh
                touch_x = touch_position(problem.model, point)
                return Run(law, strength, step, tuple(steps), map(Sample.of, rest), touch_x)
    except LostStabilityError as error:
        return Run(law, strength, step, tuple(steps), (), nan, str(error))
    raise SolveError("the strip has come to the end of the path without a touch")


def first_guess(mesh: Planned, law: str, step: float) -> float:
    """Strength to begin the search with."""
    model, (factor, decay) = mesh(np.ones(1)).model, FIRST_GUESS[law]
    return factor * model.thickness**1.5 * exp(-decay / model.length) / (step if law == "pull" else 1.0)


def smallest(mesh: Planned, plan: RPath, law: str, step: float) -> tuple[float, Run]:
    """A strength too weak for the plan to be followed to its first touch, and a run with one that suffices.

    Raises SolveError: when none does.
    """
    strength = first_guess(mesh, law, step)
    fails, suffices, found, ratio = 0.0, inf, None, FIRST_RATIO
    for _ in range(MOST_TRIALS):
        tried = follow(mesh, plan, law, strength, step)
        if tried.followed(plan):
            suffices, found = strength, tried
        else:
            fails = strength
        if found and suffices <= NARROW * fails:
            return fails, found
        if fails and found:
            strength = sqrt(fails * suffices)
        else:
            strength = strength / ratio if found else strength * ratio
            ratio *= ratio
    raise SolveError(
        f"no {law} friction between {fails:.3g} and {suffices:.3g} was found with which the plan is followed"
    )


OF_STRIP = ("eta_b", "gravity_length", "relative_length", "step", "k_f", "M_0", "planned_touch_x")
"""Attributes of the files of :func:`run` that the table has per material."""


def run(
    material: Material, length: float, step: float, refinement: float, progress: Progress | None = None
) -> xr.Dataset:
    """The smallest friction with which an R-path is followed, by either law, and the path followed with it to its end.

    ``material``, ``length``: the strip; m.  ``step``: size of the steps, L*.  ``refinement``: factor on all element
    lengths.

    Dataset over ``law``, ``state`` (the steps) and ``node``.  Raises SolveError: no friction suffices, or the path is
    not followed to its end with the one that does.
    """
    say = progress or (lambda _: None)
    unit = material.gravity_length
    strip = StripModel(length / unit, material.relative_thickness, material.nu)
    plan = plan_r_path(strip.length)
    mesh = strip.contact_mesh(refinement, memory=True)
    arc = nodes(strip.length)
    brackets, runs, steps = [], [], []
    for law in LAWS:
        say(f"{law}: looking for the smallest that suffices")
        fails, found = smallest(mesh, plan, law, step)
        say(f"{law}: {found.strength:.4g}, first touch at {found.touch_x:.4g} L*")
        brackets.append((fails, found.strength))
        runs.append(found)
        try:
            steps.append([_of_step(new, plan, arc) for new in chain(found.steps, found.rest)])
        except LostStabilityError as error:
            raise SolveError(f"the path was followed to its first touch only: {error}") from error
    values = {
        "fails": ("law", [b[0] for b in brackets]),
        "suffices": ("law", [b[1] for b in brackets]),
        "touch_x": ("law", [r.touch_x for r in runs]),
        "touch_step": ("law", [float(r.touch) for r in runs]),
        **_of_steps(steps),
        "arc": ("node", arc),
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
        values, {**material.attributes, "length": length, **schema.in_si(attrs, material.scales)}, material.scales
    )


def _of_steps(runs: list[list[dict[str, float | Array]]]) -> dict[str, Any]:
    """Values of each step, in solver units; both laws take the same steps."""
    out = {}
    for name in runs[0][0]:
        values = np.array([[of_step[name] for of_step in run] for run in runs])
        out[name] = (("law", "state", "node")[: values.ndim], values)
    return out


def _of_step(step: Sample, plan: RPath, arc: Array) -> dict[str, float | Array]:
    """Values of a step, in solver units; ``arc``: distances from the grasped end of places on the strip, L*."""
    problem, state = MovingContact(step.mesh, step.motion), step.state
    model, lam = problem.at(problem.contact(state.q)).model, state.lam
    grip = float(np.linalg.norm(state.force[model.middle[0]]))
    place = model.resampled_mid_surface(state.q[: problem.n], arc)
    return {
        "travelled": lam,
        "pseudo_time": plan.path.pseudo_time(lam),
        "gripper_force": grip,
        "pulling_force": step.pull,
        "ratio": step.pull / grip,
        # The strip's own: negative where only friction holds it.
        "eigenvalue": float(continuation.eigenvalues(problem, state)[0][0]),
        "deviation": float(np.linalg.norm(place - plan.mid_surface(lam, arc), axis=1).max()),
        "x": place[:, 0],
        "z": place[:, 1],
    }


def table(files: Mapping[str, xr.Dataset], ways: Mapping[str, xr.Dataset], labels: Mapping[str, str]) -> xr.Dataset:
    """The friction that each material needs, over ``material`` and ``law``, and its post-critical branches without.

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
