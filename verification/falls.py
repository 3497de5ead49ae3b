"""Falls: bounded, above the floor, free of energy gain and the same in the end; their accuracy versus run time.

The name of a case says how it differs from the base.  A way is a model, the factor on its element lengths, an
integrator and the allowed error of a time step: each finds its own critical state and falls from there undamped, up to
the first touch; only the fall is timed.  All in units of L*, sqrt(L*/g).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import MODEL_LOOKS, draw_pareto, entry, headroom, note, plain_numbers
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.draw.colours import GREEN, GREY, PINK
from stripfold.draw.style import figure, legend_above, styled
from stripfold.follow.fall import Fall, ReleaseState, simulate_fall, state_at_rest, to_critical_point
from stripfold.follow.statics import StripModel
from stripfold.follow.track import Track
from stripfold.solve.dynamics import TimeState
from stripfold.solve.linear import Band, Sparse
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.schemes import Damping, DynamicProblem, EnergyMomentum, Scheme, StepResult, solve_step
from verification.common import Progress, attempted, dataset, pooled
from verification.numbers import Facts, Number

UNITS = {"s": "seconds"}

BASE = {
    "length": 20.0,
    "thickness": 0.0594,
    "height": 5.0,
    "disturbance": 1e-3,
    "air": 0.11,
    "stiffness": 0.05,
    "refinement": 1.0,
    "tolerance": 1e-5,
}
CASES = {
    "half the step": {"tolerance": 1.25e-6},
    "other sign": {"disturbance": -1e-3},
    "coarse mesh": {"refinement": 2.0},
    "fine mesh": {"refinement": 0.5},
    "no damping": {"air": 0.0, "stiffness": 0.0},
    "double the step": {"tolerance": 8e-5},
    "disturbance 1e-12": {"disturbance": 1e-12},
    "disturbance 1e-2": {"disturbance": 1e-2},
    "disturbance -1e-2": {"disturbance": -1e-2},
    "strong damping": {"air": 1.0, "stiffness": 0.5},
    "thin, h = 1e-4": {"thickness": 1e-4},
    "thick, h = 0.2": {"thickness": 0.2},
    "low gripper, z = 1.7": {"height": 1.7},
    "soft, z = 15": {"length": 40.0, "height": 15.0},
    "stiff, z = 1.8": {"length": 9.0, "height": 1.8},
}
SAME = ["half the step", "other sign"]
"""Cases that end as the base does."""
VALUES = ("touch_x", "minimal_gap", "closing", "handed_over", "distance")
USED, CONSERVING, ALPHA = "energy-momentum", "energy-momentum, conserving", "generalised-alpha"
WAYS = (
    ("rod", 2.0, USED, 1e-5),
    ("rod", 1.0, USED, 1e-4),
    ("rod", 1.0, USED, 1e-5),
    ("rod", 1.0, USED, 1e-6),
    ("rod", 0.5, USED, 1e-5),
    ("rod", 0.25, USED, 1e-5),
    ("rod", 1.0, CONSERVING, 1e-5),
    ("rod", 1.0, ALPHA, 1e-5),
    ("rod", 1.0, ALPHA, 1e-6),
    ("solid", 2.0, USED, 1e-5),
    ("solid", 1.0, USED, 1e-4),
    ("solid", 1.0, USED, 1e-5),
    ("solid", 0.5, USED, 1e-5),
)
REFERENCE = (("solid", 0.25, USED, 1e-6), ("solid", 0.5, USED, 1e-6))
"""The reference, and a cheaper one that estimates its error."""


@dataclass(frozen=True, slots=True)
class GeneralisedAlpha:
    """The generalised-alpha method (Chung and Hulbert, 1993), for comparison; without damping.

    ``radius`` is the spectral radius at infinite frequency: 1 dissipates nothing, 0 all that is faster than the step.
    """

    radius: float = 0.8

    def step(
        self, problem: DynamicProblem, begin: TimeState, dt: float, lam: float, damping: Damping, options: NewtonOptions
    ) -> StepResult:
        """See :class:`Scheme`; work and losses are to the method's own order only."""
        mass, r = problem.mass, self.radius
        alpha_m, alpha_f = (2.0 * r - 1.0) / (r + 1.0), r / (r + 1.0)
        beta, gamma = 0.25 * (1.0 - alpha_m + alpha_f) ** 2, 0.5 - alpha_m + alpha_f
        force_0 = problem.residual(begin.q, lam)

        def acceleration(q: Array) -> Array:
            return (q - begin.q - dt * begin.v) / (beta * dt**2) - (0.5 / beta - 1.0) * begin.a

        def evaluate(q: Array, predicted_stress: Any) -> tuple[Array, Band | Sparse]:
            force, tangent, _ = problem.linearise(q, lam, predicted_stress)
            mean = (1.0 - alpha_m) * acceleration(q) + alpha_m * begin.a
            both = (1.0 - alpha_f) * force + alpha_f * force_0
            inertia = mass.scaled((1.0 - alpha_m) / (beta * dt**2))
            return mass @ mean + both, tangent.scaled(1.0 - alpha_f) + inertia

        end = solve_step(problem, evaluate, begin.q, begin.q + dt * begin.mean_v, lam, begin.active, options)
        a = acceleration(end.q)
        v = begin.v + dt * ((1.0 - gamma) * begin.a + gamma * a)
        moved, held = end.q - begin.q, problem.prescribed
        work, contact = float(end.force[held] @ moved[held]), -float(end.force[end.active] @ moved[end.active])
        return StepResult(end.q, v, a, end.active, len(end.residuals) - 1, work, contact)


SCHEMES: dict[str, Scheme] = {USED: EnergyMomentum(), CONSERVING: EnergyMomentum(0.0), ALPHA: GeneralisedAlpha()}
COLOURS = {
    ("rod", USED): MODEL_LOOKS["rod"].color,
    ("rod", CONSERVING): GREEN,
    ("rod", ALPHA): PINK,
    ("solid", USED): MODEL_LOOKS["solid"].color,
}
"""Of model and integrator."""


@cache
def critical_state(length: float, thickness: float, model: Any, height: float, refinement: float) -> ReleaseState:
    """The state from which a strip falls."""
    strip = StripModel(length, thickness, kind=model)
    return ReleaseState.at(to_critical_point(strip, height, refinement).last, refinement)


def fallen(release: ReleaseState, fall: Fall, tolerance: float, scheme: str = USED) -> Track:
    """A fall; raises SolveError where nothing touches."""
    motion = simulate_fall(release, replace(fall, tolerance=tolerance), scheme=SCHEMES[scheme])
    if motion.touch is None:
        raise SolveError("the strip came to rest without touching")
    return motion


def end_of(given: Mapping[str, float]) -> tuple[dict[str, float], Array]:
    """Follow one fall, damped to rest: its numbers, and the last state's mid-surface at 400 places, shape (400, 2)."""
    strip = given["length"], given["thickness"], "solid", given["height"], given["refinement"]
    damping = Damping(given["air"], given["stiffness"])
    damped = damping != Damping()
    release = critical_state(*strip)
    motion = fallen(release, Fall(given["disturbance"], 0.0, damping, damped), given["tolerance"])
    problem, model, end = release.problem, release.problem.model, motion.moments[-1]
    s = np.linspace(0.0, model.length, 400)
    return {
        "touch_x": motion.touch_x,
        "minimal_gap": min(float(np.min(state.q[problem.bounded])) for state in motion.moments),
        "closing": end.energy.closing,
        "handed_over": model.largest_move(end.q, state_at_rest(problem, end).point.q) if damped else np.nan,
    }, np.stack([np.interp(s, model.s, at) for at in model.mid_surface(end.q).T], axis=1)


def _attempted(given: Mapping[str, float]) -> tuple[tuple[dict[str, float], Array] | None, str]:
    return attempted(partial(end_of, given))


def run(
    cases: int = 5,
    length_star: float = 20.0,
    thickness: float = 0.0594,
    heights: Sequence[float] = (3.0,),
    ways: Sequence[tuple[str, float, str, float]] = WAYS,
    reference: Sequence[tuple[str, float, str, float]] = REFERENCE,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Let strips fall: the base and the first ``cases``, and by all ``ways`` from ``heights``.

    Dataset over ``case``, the first being called "base", nan where it failed, with a message; and over ``way`` and
    ``gripper_height``.
    """
    falls = {"base": BASE} | {name: {**BASE, **case} for name, case in list(CASES.items())[:cases]}
    found = pooled(_attempted, falls.values(), threads, progress)
    rows = [{**dict.fromkeys(VALUES, np.nan), **(one[0] if one else {})} for one, _ in found]
    shapes = {name: one[1] for name, (one, _) in zip(falls, found, strict=True) if one}
    for name, row in zip(falls, rows, strict=True):
        if name in SAME and {name, "base"} <= set(shapes):
            row["distance"] = float(np.linalg.norm(shapes[name] - shapes["base"], axis=1).max())

    error, seconds = np.empty((2, len(ways), len(heights)))
    uncertain = np.empty(len(heights))
    fall = Fall(0.01, to_rest=False)
    for j, height in enumerate(heights):
        touches = []
        for i, (model, refinement, scheme, tolerance) in enumerate((*reference, *ways)):
            release = critical_state(length_star, thickness, model, height, refinement)
            began = perf_counter()
            try:
                touches.append(fallen(release, fall, tolerance, scheme).touch_x)
            except SolveError:
                # Of the generalised-alpha method, which may create energy.
                if scheme != ALPHA:
                    raise
                touches.append(np.nan)
            if i >= 2:
                seconds[i - 2, j] = perf_counter() - began
        uncertain[j], error[:, j] = abs(touches[1] - touches[0]), np.array(touches[2:]) - touches[0]
        if progress:
            progress(f"all ways from {height:g} L*")
    names = "model", "refinement", "scheme", "tolerance"
    return dataset(
        {
            "case": ("case", list(falls)),
            "message": ("case", [message for _, message in found]),
            **{name: ("case", [row[name] for row in rows]) for name in VALUES},
            **{name: ("way", list(values)) for name, values in zip(names, zip(*ways, strict=True), strict=True)},
            "gripper_height": ("gripper_height", heights),
            "error": (("way", "gripper_height"), error),
            "seconds": (("way", "gripper_height"), seconds),
            "uncertain": ("gripper_height", uncertain),
        },
        {"length_star": length_star, "thickness_star": thickness},
        UNITS,
    )


def facts(d: xr.Dataset) -> Facts:
    coarse, base, fine = d.touch_x.sel(case=["coarse mesh", "base", "fine mesh"]).values
    return {
        "cases": d.sizes["case"],
        "failed": np.isnan(d.touch_x).sum(),
        "penetration": np.maximum(-d.minimal_gap.min(), 0.0),
        "gain": d.closing.max(),
        "same": " and ".join(SAME),
        "spread": d.distance.max(),
        "coarse": abs(coarse - base),
        "fine": abs(base - fine),
        "rest": d.handed_over.max(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("falls_failed", "failed", "count", "= 0", "falls, of {cases}, that end without a touch"),
        Number("falls_penetration", "penetration", "L*", "< 1e-4 L*", "deepest penetration of the floor, all falls",
            digits=4, spread=1.0),
        Number("falls_energy_gain", "gain", "1", "< 1e-6", "largest energy gained, rho_a g L*^2, all falls",
            spread=1.0),
        Number("falls_end_state", "spread", "L*", "< 1e-3 L*",
            "largest distance of the end states of {same} from that of the first fall", spread=1.0),
        Number("touch_convergence", "fine", "L*", "< 5e-3 L*, and less than at the halving before",
            "change of the first touch's x when the elements are halved; at the halving before: {coarse:.1e} L*",
            lambda f: f.fine < f.coarse, spread=1.0),
        Number("handed_over", "rest", "L*", "< 0.01 L*",
            "largest distance between a state at rest and the equilibrium that the static solver finds from it",
            spread=1.0),
    ),
}
# fmt: on


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw |error| over run time, a panel per height, with the Pareto front.

    The size of a marker is that of the elements; filled: the default time step, upper half: longer steps, lower half:
    shorter ones.  Dotted: uncertainty of the reference, at which smaller errors are drawn.
    """
    count = data.sizes["gripper_height"]
    fig = figure(0.6 + 1.9 * count)
    panels = fig.subplots(count, 1, squeeze=False, sharex=True, sharey=True).ravel()
    ways = list(zip(*(data[name].values for name in ("model", "refinement", "scheme", "tolerance")), strict=True))
    for j, (ax, height) in enumerate(zip(panels, data["gripper_height"].values, strict=True)):
        one = data.isel(gripper_height=j)
        seconds, uncertain = one["seconds"].values, float(one["uncertain"])
        error = np.maximum(np.abs(one["error"].values), uncertain)
        for x, y, (model, refinement, scheme, tolerance) in zip(seconds, error, ways, strict=True):
            fill = "full" if tolerance == 1e-5 else "top" if tolerance > 1e-5 else "bottom"
            style = {"color": COLOURS[model, scheme], "fillstyle": fill, "markerfacecoloralt": "white"}
            ax.plot(x, y, MODEL_LOOKS[model].marker, ms=5.0 * refinement**0.5, **style)
        draw_pareto(ax, seconds, error, uncertain)
        ax.set(xscale="log", yscale="log")
        note(ax, f"({'abcdefgh'[j]}) $z = {height:g}\\,L^*$", loc="upper right")
    headroom(panels[0], 0.15)
    plain_numbers(panels[-1].xaxis)
    panels[-1].set_xlabel("run time of the fall [s]")
    fig.supylabel(r"error of the first touch$\,/\,L^*$", fontsize=9.0)
    shown = dict.fromkeys((model, scheme) for model, _, scheme, _ in ways)
    handles = [entry(f"{m}, {s}", COLOURS[m, s], "none", marker=MODEL_LOOKS[m].marker, ms=5.0) for m, s in shown]
    handles += [entry("Pareto front", GREY, lw=1.0), entry("uncertainty of the reference", GREY, ":", lw=0.8)]
    title = "large marks: long elements; upper half filled: longer time steps, lower half: shorter ones"
    legend_above(fig, handles, fontsize=6.5, title=title, title_fontsize=6.5)
    return fig
