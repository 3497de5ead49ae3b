"""The smallest eigenvalue of (K, M) along x and along the three folding paths down to zero, and the critical modes.

Each branch is followed to its first critical point, and back from there in short steps, where the eigenvalue goes to
zero.  On the rod: at the solid's limit point the eigenvalue is zero to the first order of its elements' length only,
1e-3 g/L* on standard ones.  Lengths in L*, eigenvalues in g/L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import PATH_LOOKS, entry, look, note
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.draw.colours import BLACK, CRITICAL, GREY, GRIPPER, HANGING, TOUCHING
from stripfold.draw.style import figure, styled, text_at
from stripfold.follow import contact_branch
from stripfold.follow.contact_branch import STEPS, BranchPoint
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel, solve_height
from tasks.assess_data import PATHS, path_of
from verification.common import Progress, blank, dataset, pooled
from verification.numbers import Facts, Number

ALONG_X = "x"
BACK = replace(STEPS, first=0.003, largest=0.05)
"""Steps back from the critical point."""
NEAR = 0.3
"""Arc length of the branch that is followed back."""
LENGTH, THICKNESS, SPACING = 20.0, 0.0594, 0.05
"""Of the rod, and of the places at which shapes are stored, L*."""


def run(height: float = 3.0, refinement: float = 0.5, progress: Progress | None = None) -> xr.Dataset:
    """Eigenvalues over ``motion`` and ``step``, nan after the last, and the critical states and modes.

    ``height``: of the gripper along x.
    """
    s = np.linspace(0.0, LENGTH, round(LENGTH / SPACING) + 1)
    motions = (ALONG_X, *PATHS)
    found = pooled(partial(_approach, height, refinement, s), motions, 1, progress)
    rows = blank(3, len(motions), max(len(eigenvalues) for eigenvalues, *_ in found))
    for i, (eigenvalues, *_) in enumerate(found):
        rows[:, i, : len(eigenvalues)] = eigenvalues.T
    shape, mode = (np.array([one[i] for one in found]) for i in (1, 2))
    # Of either sign: this one lets the strip fall.
    mode *= -np.sign(mode[..., 1].sum(axis=1))[:, None, None] / np.abs(mode).max(axis=(1, 2), keepdims=True)
    names = ("distance", "eigenvalue_1", "eigenvalue_2")
    return dataset(
        {
            "motion": ("motion", list(motions)),
            **{name: (("motion", "step"), row) for name, row in zip(names, rows, strict=True)},
            **{name: (("motion", "s"), shape[..., i]) for i, name in enumerate("xz")},
            **{f"mode_{name}": (("motion", "s"), mode[..., i]) for i, name in enumerate("xz")},
        }
    )


def _approach(height: float, refinement: float, s: Array, motion: str) -> tuple[Array, Array, Array]:
    """Distances from the critical point and two eigenvalues, shape (steps, 3); the last stable state and the mode at s.

    Raises SolveError: no state is critical.
    """
    strip = StripModel(LENGTH, THICKNESS, kind="rod")
    if motion == ALONG_X:
        found = solve_height(strip, height, refinement)
    else:
        options = replace(STEPS, largest=0.2)
        found = assess_strip(strip, path_of(motion, LENGTH), None, refinement, options=options)
    critical = found.critical
    if critical is None:
        raise SolveError(f"no critical point along {motion}")
    last = contact_branch.solved(found.last.problem, critical.before.q, critical.before.lam, -1.0)
    near = []
    for item in contact_branch.follow(last, BACK, lambda _: [], through_contact=False):
        assert isinstance(item, BranchPoint)
        near.append(item.point)
        if item.point.arc - last.point.arc > NEAR:
            break
    far = [at.point for at in found.branch if at.point.lam < near[-1].lam and at.point.negatives == 0]
    rows = np.array([(critical.lam - point.lam, *point.eigenvalues[:2]) for point in (*far, *near[::-1])])
    model = last.model
    mode = model.resampled_mid_surface(critical.mode, s) - model.resampled_mid_surface(0.0 * last.u, s)
    return rows, model.resampled_mid_surface(last.u, s), mode


NEAREST, FARTHEST = 1e-6, 3e-3
"""Distances from the critical point between which the exponent of the eigenvalue is taken; smallest drawn, L*."""


def facts(d: xr.Dataset) -> Facts:
    """How far the eigenvalue goes down, its exponent at the snaps, and the distance to the second one."""
    rest, exponents = [], {}
    for motion in d.motion.values:
        one = d.sel(motion=motion).dropna("step", subset=["distance"])
        distance, first = one.distance.values, one.eigenvalue_1.values
        rest.append(abs(first[-1]) / one.eigenvalue_2.values[-1])
        near = (distance > NEAREST) & (distance < FARTHEST)
        exponents[motion] = np.polyfit(np.log(distance[near]), np.log(first[near]), 1)[0]
    snaps = [value for motion, value in exponents.items() if motion != "r-path"]
    return {
        "rest": max(rest),
        "snap": max(snaps, key=lambda value: abs(value - 0.5)),
        "off": max(abs(value - 0.5) for value in snaps),
        "motions": len(exponents),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("eigenvalue_at_critical", "rest", "1", "< 1e-3, four motions",
            "smallest eigenvalue of (K, M) at the last state before a critical point, over the second one: the largest "
            "along x and along three paths, on the rod", lambda f: f.motions == 4),
        Number("eigenvalue_exponent", "snap", "1", "1/2 within 0.02",
            "exponent of the distance with which that eigenvalue goes to zero at a snap, farthest from 1/2 of three "
            "motions", lambda f: f.off < 0.02, digits=4),
    ),
}
# fmt: on


LOOKS = {"x": ("along $x$", look(2)), **PATH_LOOKS}
SHOWN = {"x": "(b) along $x$", "r-path": "(c) R-path"}
STYLES = ("-", "--", "-.", ":")
WIDE = 7.5
"""Part of the strip drawn, from the bulge on, L*."""
SIZE = 0.5
"""Largest displacement drawn of a mode, L*."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) both eigenvalues over the distance to the critical point, (b, c) the critical state and its mode."""
    fig = figure(5.0)
    axes = fig.subplot_mosaic([["a", "a"], ["b", "c"]], height_ratios=(1.0, 1.0))
    top, below = axes["a"], [axes["b"], axes["c"]]
    for i, (motion, (label, how)) in enumerate(LOOKS.items()):
        one = data.sel(motion=motion)
        distance = one["distance"].values
        shown = distance > NEAREST
        line: dict[str, Any] = {"color": how.color, "ls": STYLES[i]}
        top.plot(distance[shown], one["eigenvalue_1"].values[shown], **line, lw=1.2, label=label)
        top.plot(distance[shown], one["eigenvalue_2"].values[shown], **line, lw=0.6, label="_second")
    for power, factor, text, place in ((0.5, 0.025, "1/2", 1e-4), (1.0, 0.45, "1", 0.9)):
        x = place * np.array([0.3, 3.0])
        top.plot(x, factor * x**power, color=GREY, lw=0.8, label="_guide")
        text_at(top, (x[0], factor * x[0] ** power), text, (2, 0), ha="left", va="center", fontsize=7, color=GREY)
    top.set(xscale="log", yscale="log", xlabel=r"distance to the critical point$\,/\,L^*$")
    top.set_ylabel("eigenvalues [$g/L^*$]")
    top.invert_xaxis()
    top.legend(loc="lower left", fontsize=7)
    note(top, "(a)", loc="upper right")
    for ax, (motion, title) in zip(below, SHOWN.items(), strict=True):
        one = data.sel(motion=motion)
        shape = np.stack([one["x"].values, one["z"].values])
        mode = SIZE * np.stack([one["mode_x"].values, one["mode_z"].values])
        ax.plot(*(shape + mode), color=TOUCHING, lw=0.8, ls="--", label="_down")
        ax.plot(*(shape - mode), color=HANGING, lw=0.8, ls="-.", label="_up")
        ax.plot(*shape, color=CRITICAL, lw=1.4, label="_critical")
        ax.plot(*shape[:, 0], "o", color=GRIPPER, ms=4, zorder=5)
        ax.axhline(0.0, color=BLACK, lw=0.6, zorder=1)
        left = float(shape[0].min()) - 1.0
        ax.set(aspect="equal", xlim=(left, left + WIDE), xlabel="$x\\,/\\,L^*$")
        note(ax, title)
    below[0].set_ylabel("$z\\,/\\,L^*$")
    below[1].tick_params(labelleft=False)
    high = float(data.sel(motion=list(SHOWN))["z"].max()) + 1.5
    for ax in below:
        ax.set_ylim(-0.5, high)
    handles = [
        entry("critical state", CRITICAL, lw=1.4),
        entry("mode, down", TOUCHING, "--", lw=0.8),
        entry("mode, up", HANGING, "-.", lw=0.8),
    ]
    below[0].legend(handles=handles, loc="center right", fontsize=7, bbox_to_anchor=(1.0, 0.65))
    return fig
