"""How much internal friction an R-path needs: the smallest with which the strip follows its plan, by either law.

In units of L*, g/L* and rho_a g L*; :func:`run` converts to SI.  See docs/physics.md, sections 5 and 8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import exp
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stripfold.ask.friction import bisected
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.base.material import Material
from stripfold.files import schema
from stripfold.follow.contact import touch_position
from stripfold.follow.contact_branch import BranchPoint, Planned
from stripfold.follow.fall import Progress
from stripfold.follow.memory import effects_of, load, load_path, steps_on
from stripfold.follow.statics import StripModel
from stripfold.follow.track import End, Track, nodes, on_mesh
from stripfold.paths.rpath import RPath, plan_r_path
from stripfold.solve import continuation
from stripfold.strip.effects import Pull
from stripfold.strip.moving_contact import MovingContact

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


class Needed(NamedTuple):
    """A strength too weak for a plan to be followed to its first touch, one that suffices, and the track with it."""

    fails: float
    suffices: float
    track: Track
    touch_x: float


def first_guess(mesh: Planned, law: str, step: float) -> float:
    """Strength to begin the search with."""
    model, (factor, decay) = mesh(np.ones(1)).model, FIRST_GUESS[law]
    return factor * model.thickness**1.5 * exp(-decay / model.length) / (step if law == "pull" else 1.0)


def smallest(mesh: Planned, plan: RPath, law: str, step: float) -> Needed:
    """The smallest strength with which the first touch is the planned one.

    ``law``: one of :data:`LAWS`.  ``step``: size of the steps, L*.  The strengths are k_f in g/L* or M_0 in
    rho_a g L*^2.  Raises SolveError: when none does.
    """

    def followed(strength: float) -> tuple[Track, float] | None:
        track = load_path(mesh, plan.path, effects_of(law, strength), step, until="touch")
        if track.end is End.SNAP:
            return None
        if track.end is not End.TOUCH:
            raise SolveError("the strip has come to the end of the path without a touch")
        problem, point = on_mesh(track.last)
        x = touch_position(problem.model, point)
        return (track, x) if abs(x - plan.first_touch) < FOLLOWED else None

    fails, suffices, (track, x) = bisected(followed, first_guess(mesh, law, step), FIRST_RATIO, NARROW)
    return Needed(fails, suffices, track, x)


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
    found, rows = [], []
    for law in LAWS:
        say(f"{law}: looking for the smallest that suffices")
        needed = smallest(mesh, plan, law, step)
        say(f"{law}: {needed.suffices:.4g}, first touch at {needed.touch_x:.4g} L*")
        found.append(needed)
        last = needed.track.last
        places = [place for place in steps_on(plan.path, strip.length, step) if place[1] > last.point.lam + 1e-9]
        rest = load(last, places)
        if rest.end is not End.PATH:
            raise SolveError("the path was followed to its first touch only", parameter=rest.lam)
        rows.append([_of_step(at, plan, arc) for at in needed.track.then(rest).points if isinstance(at, BranchPoint)])
    values = {
        "fails": ("law", [needed.fails for needed in found]),
        "suffices": ("law", [needed.suffices for needed in found]),
        "touch_x": ("law", [needed.touch_x for needed in found]),
        "touch_step": ("law", [len(needed.track.points) - 1.0 for needed in found]),
        **_of_steps(rows),
        "arc": ("node", arc),
        "law": ("law", LAWS),
    }
    attrs = {
        "step": step,
        "k_f": found[0].suffices,
        "M_0": found[1].suffices,
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


def _of_step(at: BranchPoint, plan: RPath, arc: Array) -> dict[str, float | Array]:
    """Values of a step, in solver units; ``arc``: distances from the grasped end of places on the strip, L*."""
    state, model, lam = at.point.state, at.model, at.point.lam
    grip = float(np.linalg.norm(state.force[model.middle[0]]))
    place = at.mid_surface(arc)
    effects = at.problem.at(at.contact).effects
    pull = sum(effect.pulling_force(at.u) for effect in effects if isinstance(effect, Pull))
    bare = MovingContact(at.problem.mesh, at.problem.motion)
    return {
        "travelled": lam,
        "pseudo_time": plan.path.pseudo_time(lam),
        "gripper_force": grip,
        "pulling_force": pull,
        "ratio": pull / grip,
        # The strip's own: negative where only friction holds it.
        "eigenvalue": float(continuation.eigenvalues(bare, state)[0][0]),
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
