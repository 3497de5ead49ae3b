"""Low paths: between which heights of the gripper a strip is carried over without a snap, and how it is laid down.

Random strips on the rod follow the whole low path in statics, the first of those that the elastica says are stable on
the solid and its finer mesh, too; a few follow it in time, with friction between the layers.  Lengths in L*, forces per
width in rho_a g L*.
Source: docs/low-path.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import takewhile
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from plots.pieces import entry, note
from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.draw.colours import BLACK, BLUE, GREY, SHADE, VERMILLION
from stripfold.draw.style import figure, styled
from stripfold.follow.contact import columns_on_floor, touches
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel
from stripfold.follow.time import dissipated, follow_in_time
from stripfold.follow.track import BUMP, forces_of, peak_forces, shape_error
from stripfold.paths.geometric import low
from stripfold.paths.rpath import plan_r_path
from stripfold.solve.schemes import Damping
from verification.common import Progress, attempted, dataset, grid, markdown_table, pooled
from verification.numbers import Facts, Number, seed_of, share

LENGTH, HEIGHT, THICKNESS = (8.0, 40.0), (0.3, 1.7), (0.02, 0.15)
"""What is drawn, evenly."""
SHARPEST = 0.25
"""Largest thickness over the height: the curvature is up to 2.5 / height, and at larger strains the solid is no rod."""
MESHES = {"rod": ("rod", 1.0), "solid": ("solid", 1.0), "finer": ("solid", 0.5)}
"""Model and refinement of each run."""
TIME_NUMBERS = ("time_kinetic", "time_grip", "time_hold", "time_error", "time_dissipated")
STABLE, LIMITED, FAILED, OMITTED = "stable", "limit point", "failed", ""
FREE = 5.8
"""Free length at the touch near the touch limit, L*; beside what lies it gives twice as much as its length."""
CURVE = np.concatenate([np.geomspace(0.2, 0.95, 10), elastica.touch_limit() - np.geomspace(0.55, 1e-3, 12)])
"""Heights of the elastica's curve, L*: closer to each other where it falls to zero."""
MARGIN = 0.02
"""Distance below the touch limit within which models and meshes may differ, L*."""
STEP, NEAR = 0.05, 1e-3
"""Largest step along a branch of the elastica, in arc length; change of the free length for a derivative, L*."""
DAMPING = Damping(air=0.1, stiffness=0.06)
"""Air drag of 2 /s and viscosity of 3 ms with L* = 2.5 cm."""


def run(
    cases: int = 12,
    compared: int = 2,
    seed: int = 1,
    length_star: float = 14.0,
    thickness: float = 0.05,
    heights: Sequence[float] = (0.6, 1.2),
    coefficients: Sequence[float] = (0.0, 0.6),
    moment: float = 0.02,
    speed: float = 0.05,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The first cases of the sequence that ``seed`` starts, over ``case``; one in time; the elastica, over ``curve``.

    ``compared``: random strips, inside the limits, that are on the solid, too.  ``length_star``, ``thickness``,
    ``moment``, ``speed``: the strip in time, its M_0, and the speed of its gripper, sqrt(g L*).  ``heights``,
    ``coefficients``: its gripper's, and of friction between the layers.
    """
    curve = np.array(pooled(of_curve, CURVE.tolist(), threads))
    one = partial(in_time, length_star, thickness, moment, speed)
    timed = grid(one, TIME_NUMBERS, {"mu": coefficients, "time_height": heights}, threads, progress)
    strips = [drawn(number, seed) for number in range(cases)]
    lengths, z, thicknesses = np.array(strips).T
    stable = np.flatnonzero(within(lengths, z, thicknesses, CURVE, curve[:, 0]))
    on_solid = np.isin(range(cases), stable[:compared])
    rows = pooled(case, list(zip(strips, on_solid, strict=True)), threads, progress)
    return dataset(
        {name: ("case", [row[name] for row in rows]) for name in rows[0]}
        | timed
        | {
            "curve_height": ("curve", CURVE),
            "curve_compliance": ("curve", curve[:, 0]),
            "curve_push": ("curve", curve[:, 1]),
        },
        {"seed": seed},
    )


def of_curve(height: float) -> tuple[float, float]:
    """The elastica at a height: compliance up to which it is stable, and its largest push on what lies.

    What lies gives by c F_x under the force F_x: the advance is lambda - c F_x.  The compliance is the largest c with
    which that grows up to the touch, the least d lambda / d F_x where F_x grows.
    """
    touch = elastica.critical(height).state
    states = takewhile(lambda state: state.clearance > 0.0, elastica.x_axis_branch(height, max_step=STEP))
    advance, force = np.array([(state.advance, state.force_x) for state in states]).T
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(advance), np.diff(force)))])
    slope, rate = np.gradient(advance, arc), np.gradient(force, arc)
    before, after = (elastica.state_at(height, touch.length + change, touch) for change in (-NEAR, NEAR))
    at_touch = (after.advance - before.advance) / (after.force_x - before.force_x)
    return float(min(at_touch, *(slope / rate)[rate > 0.0])), -float(force.min())


def compliance(length: Any, thickness: Any) -> Any:
    """That of a strip of which all but the free part lies, 1 / (rho_a g); of arrays, too."""
    return (length + FREE) * thickness**2 / 12.0


def within(length: Array, height: Array, thickness: Array, curve: Array, borne: Array) -> NDArray[np.bool_]:
    """Which strips the elastica finds stable, also :data:`MARGIN` higher; at heights ``curve`` it bears ``borne``."""
    here, higher = (np.interp(height + more, curve, borne, right=0.0) for more in (0.0, MARGIN))
    return np.asarray(compliance(length, thickness) < np.minimum(here, higher))


def drawn(number: int, seed: int) -> tuple[float, float, float]:
    """Length, height and thickness of one case; each has a random stream of its own."""
    draw = np.random.default_rng([seed, number])
    length, height = float(draw.uniform(*LENGTH)), float(draw.uniform(*HEIGHT))
    return length, height, float(draw.uniform(THICKNESS[0], min(THICKNESS[1], SHARPEST * height)))


def case(asked: tuple[tuple[float, float, float], bool]) -> dict[str, Any]:
    """One case, by what :func:`drawn` gave, and whether it is on the solid, too."""
    (length, height, h), on_solid = asked
    row: dict[str, Any] = {"length": length, "height": height, "thickness": h, "message": ""}
    for name, (kind, refinement) in MESHES.items():
        row[name] = OMITTED
        if name == "rod" or on_solid:
            found, message = attempted(partial(followed, StripModel(length, h, kind=kind), height, refinement))
            row[name], *numbers = found or (FAILED, np.nan, np.nan)
            row["message"] += message and f"{name}: {message}; "
            row |= dict(zip(("hold", "slide"), numbers, strict=True)) if name == "rod" else {}
    return row


def followed(strip: StripModel, height: float, refinement: float) -> tuple[str, float, float]:
    """The outcome on the low path, the largest push at the held end, and how far the layer slides that has come down.

    Raises SolveError: the path cannot be followed.
    """
    found = assess_strip(strip, low(strip.length, height), refinement=refinement)
    if not found.stable:
        return LIMITED, np.nan, np.nan
    _, hold = peak_forces(forces_of(found.states))
    problem, point = next(state for state in found.states if touches(state[0].model, state[1]))
    place = problem.model.s[columns_on_floor(problem.model, point)][:1]
    first, rest = (p.model.resampled_mid_surface(at.q, place)[0, 0] for p, at in ((problem, point), found.states[-1]))
    return STABLE, hold, float(rest - first)


def in_time(length: float, thickness: float, moment: float, speed: float, mu: float, height: float) -> dict[str, float]:
    """One path in time to rest at its end; raises SolveError, TimeStepError: it cannot be followed."""
    strip = StripModel(length, thickness, kind="rod")
    found = follow_in_time(strip, low(length, height), mu, moment, damping=DAMPING, speed=speed)
    kinetic, error = max(at.energy.kinetic for at in found.moments), shape_error(*found.states[-1], plan_r_path(length))
    numbers = kinetic, *peak_forces(forces_of(found.states)), error, float(dissipated(found)[-1])
    return dict(zip(TIME_NUMBERS, numbers, strict=True))


def markdown(data: xr.Dataset) -> str:
    """The paths in time as a table in Markdown."""
    header = "z", "mu", "kinetic energy", "gripper's force", "at the held end", "error of the fold", "taken by friction"
    forms = (".3f", ".1f", ".1f", ".4f", ".2f")
    rows = []
    for height in data["time_height"].values:
        for mu in data["mu"].values:
            one = data.sel(time_height=height, mu=mu)
            cells = [format(float(one[n]), form) for n, form in zip(TIME_NUMBERS, forms, strict=True)]
            rows.append([f"{height:g}", f"{mu:g}", *cells])
    return markdown_table(header, rows)


LOWEST = 0.7
"""Heights below which the largest push is compared with that of the elastica, L*: its law there is 2.75 / z^2."""


def facts(d: xr.Dataset) -> Facts:
    outcomes = np.stack([d[mesh].values for mesh in MESHES])
    height, curve = d.height.values, (d.curve_height.values, d.curve_compliance.values)
    inside, compared = within(d.length.values, height, d.thickness.values, *curve), outcomes[1] != OMITTED
    limited = outcomes == LIMITED
    above, below = height > curve[0].max(), ~inside & (height < curve[0][curve[1].argmax()])
    push = (d.hold * d.height**2).values[inside & (height < LOWEST)]
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "failed": np.sum(outcomes == FAILED),
        "inside": inside.sum(),
        "stable": share(outcomes[0][inside] == STABLE),
        "margin": MARGIN,
        "above": above.sum(),
        "snapped": (limited[0] & above).sum(),
        "below": below.sum(),
        "squeezed": (limited[0] & below).sum(),
        "compared": (inside & compared).sum(),
        "limited": limited[:, inside & compared].sum(),
        "push": push.max() if push.size else np.nan,
        "law": (d.curve_push * d.curve_height**2).values[curve[0] < LOWEST].max(),
        "lowest": LOWEST,
        "slide": (d.slide / d.length).max(),
        "error": d.time_error.max(skipna=False),
        "grip": d.time_grip.max(),
        "grip_without": d.time_grip.sel(mu=0.0).max(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("low_path_stable", "stable", "1", ">= 1, none failed",
            "share without a limit point of the {inside} paths, of {cases} random ones ({seed}), that the "
            "elastica with a lying part that gives says are stable, {margin:g} L* or more below the "
            "touch limit; of the {above} that are above it {snapped} have one, of the {below} "
            "that are too low {squeezed}", lambda f: f.failed == 0, digits=4),
        Number("low_path_limit_points", "limited", "count", "= 0",
            "limit points of the first {compared} of these on the rod, on the solid and on elements half as long"),
        Number("low_path_push", "push", "1", "within 10 % of the elastica's",
            "largest push on what lies of these, times z^2, below a height of {lowest:g} L* ({law:.3f} on the "
            "elastica); the layer that has come down slides by up to {slide:.2f} of the strip's length",
            lambda f: abs(f.push / f.law - 1.0) < 0.1),
        Number("fold_error_low", "error", "L*", "< 0.02 L*",
            "largest distance of the finished fold of low paths in time from the accurate one; the gripper pulls with "
            "up to {grip:.1f} rho_a g L* with friction, {grip_without:.1f} without"),
    ),
}
# fmt: on


FLAT = 1.0
"""Height up to which a bump is that of a beam, L*."""
LOOKS = {STABLE: ("stable", BLUE, "."), LIMITED: ("limit point", VERMILLION, "x")}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the outcomes over height and compliance with the elastica's limit, (b) pushes over the height."""
    fig = figure(5.6)
    limits, forces = fig.subplots(2, 1, height_ratios=(1.3, 1.0), sharex=True)
    z, curve = data["curve_height"].values, data["curve_compliance"].values
    given = compliance(data["length"], data["thickness"]).values
    lowest = 0.7 * float(given.min())
    edge = np.append(z, elastica.touch_limit()), np.append(curve, lowest)
    limits.fill_between(*edge, lowest, color=SHADE, lw=0.0)
    limits.plot(*edge, color=BLACK, lw=1.0, label="_limit")
    height = data["height"].values
    for outcome, (_, color, marker) in LOOKS.items():
        chosen = data["rod"].values == outcome
        style = {"color": color, "marker": marker, "ls": "none", "ms": 3.5}
        limits.plot(height[chosen], given[chosen], **style, label=f"_{outcome}")
    limits.set(yscale="log", ylabel=r"compliance $c\,\rho_a g$")
    limits.set_ylim(lowest, 3.0 * float(curve.max()))
    looks = [entry(text, color, "none", marker=marker, ms=3.5) for text, color, marker in LOOKS.values()]
    limits.legend(handles=[*looks, entry("elastica on what gives", BLACK)], loc="upper right", fontsize=7)
    forces.plot(height, data["hold"].values, ".", color=BLUE, ms=3.5, label="push at the held end, rod")
    forces.plot(z, data["curve_push"].values, color=BLACK, lw=1.0, label="elastica")
    forces.plot(z, 2.75 / z**2, color=GREY, ls=":", lw=2.0, zorder=1, label=r"$2.75\,{L^*}^2/z^2$")
    bump = BUMP / data["curve_push"].values ** 2
    style = {"color": VERMILLION, "ls": "--", "lw": 1.0, "label": "height of a bump that grows"}
    forces.plot(z[bump < FLAT], bump[bump < FLAT], **style)
    forces.set(yscale="log", xlabel="gripper height $z\\,/\\,L^*$")
    forces.set_ylabel(r"push$\,/\,\rho_a g L^*$, height$\,/\,L^*$")
    forces.set(xlim=(0.25, 1.75), ylim=(0.01, 100.0))
    forces.legend(loc="lower right", fontsize=7)
    note(limits, "(a)")
    note(forces, "(b)")
    return fig
