"""The measured textile with its own moment-curvature law, against the secant that stands in for it.

The law is elastic: a first bending, taken as what the strip would also follow back.  Beyond the largest measured
curvature the moment goes on along a straight line.  Units: L* of the secant.  Source: docs/physics.md, section 11.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import LostStabilityError
from stripfold.follow.contact_branch import BranchPoint, from_elastica, from_flat, solved, transferred
from stripfold.follow.memory import load_incrementally_from, steps_on
from stripfold.follow.statics import StripModel, to_the_end
from stripfold.follow.track import End
from stripfold.paths import rpath
from stripfold.strip.effects import BendingLaw, MomentCurvature
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, AlongX, Motion
from tasks import textile
from verification.common import blank, dataset
from verification.numbers import Facts, Number

UNITS = {"m": "gravity_length"}

LAWS = ("secant", "measured")
SHARES = np.linspace(0.0, 1.0, 9)[1:]
"""Shares of the measured law with which the first state of a branch is found from that of the linear strip."""
FIRST = 0.05
"""Length travelled at the first state on a path, L*."""


def run(
    table: str = "data/textile_moment_curvature.csv",
    areal_load: float = 13.6,
    height: float = 3.0,
    length_star: float = 20.0,
    thickness: float = 0.003,
    heights: list[float] = (2.0, 3.0, 8.0),
    step: float = 0.2,
    refinement: float = 0.5,
) -> xr.Dataset:
    """The end of the advance at each height, and the end of the R-path planned with the secant, for both laws.

    ``table``, ``areal_load``: moment-curvature table, and the weight per area, N m^-2.  ``height``: height at whose
    critical state the secant is taken, L*.  ``length_star``, ``thickness``, ``heights``: of the strip, and of the
    gripper, L*.  The thickness is to have no effect.  ``step``: steps along the R-path, L*.  ``refinement``: factor on
    the element lengths.  Raises SolveError: a branch that could not be followed.
    """
    rows = textile.read_table(table)
    secant = textile.secant(rows, areal_load, textile.largest_curvature(elastica.critical(height).state))
    unit = float(np.cbrt(secant.stiffness / areal_load))
    curvature, moment = unit * rows[:, 0], rows[:, 1] / (areal_load * unit**2)
    strip = StripModel(length_star, thickness, kind="rod")
    laws = {"secant": (curvature, curvature), "measured": (curvature, moment)}
    names = ("advance", "free_length", "curvature", "leaves", "snap")
    ends = {name: blank(len(LAWS), len(heights)) for name in names}
    paths = {name: blank(len(LAWS)) for name in ("path_lost", "path_curvature", "path_leaves")}
    plan = rpath.plan_r_path(length_star)
    for i, law in enumerate(LAWS):
        for j, z in enumerate(heights):
            state = elastica.state_no_horizontal_force(z)
            first = from_elastica(strip.contact_mesh(refinement), AlongX(z), state.advance, state)
            found = to_the_end(bent(first, *laws[law]))
            points = found.branch
            bends, lams = np.array([largest(p) for p in points]), np.array([p.point.lam for p in points])
            left = leaves(lams, bends, curvature[-1])
            row = (found.lam, found.free_length, bends[-1], left, found.end is End.SNAP)
            for name, value in zip(names, row, strict=True):
                ends[name][i, j] = value
        motion = AlongPath(plan.path.pieces[0], length_star)
        first = bent(from_flat(strip.contact_mesh(refinement), motion, FIRST), *laws[law])
        lams, bends, lost = followed(first, steps_on(plan.path, length_star, step))
        paths["path_lost"][i], paths["path_curvature"][i] = lost / plan.path.length, bends[-1]
        paths["path_leaves"][i] = leaves(lams, bends, curvature[-1]) / plan.path.length
    return dataset(
        {
            "law": ("law", list(LAWS)),
            "gripper_height": ("gripper_height", heights),
            **{name: (("law", "gripper_height"), array) for name, array in ends.items()},
            **{name: ("law", array) for name, array in paths.items()},
            "measured_curvature": ("row", curvature),
            "measured_moment": ("row", moment),
            "gravity_length": ((), unit),
        },
        units=UNITS,
    )


def bent(at: BranchPoint, curvature: Array, moment: Array) -> BranchPoint:
    """The state of a strip with a law, at the lambda of one of the linear strip, whose law changes in small steps."""
    motion: Motion = at.problem.motion
    for share in SHARES:
        law = MomentCurvature(curvature, (1.0 - share) * curvature + share * moment)
        problem = MovingContact(at.problem.mesh, motion, (BendingLaw.of(at.model, law),), at.contact)
        at = solved(problem, at.point.q, at.point.lam)
        if problem.mesh.drifted(at.contact):
            at = transferred(at)
    return at


def largest(at: BranchPoint) -> float:
    """The largest curvature of a strip with a law, 1/L*."""
    (effect,) = at.problem.at(at.contact).effects
    assert isinstance(effect, BendingLaw)
    return float(np.abs(effect.curvature(at.u)).max())


def leaves(lams: Array, bends: Array, end: float) -> float:
    """lambda at which the largest curvature leaves the measured range; nan if it does not."""
    out = np.flatnonzero(bends > end)
    if not len(out):
        return np.nan
    i = int(out[0])
    return float(lams[i] if i == 0 else np.interp(end, bends[i - 1 : i + 1], lams[i - 1 : i + 1]))


def followed(first: BranchPoint, places: Iterable[tuple[Motion, float]]) -> tuple[Array, Array, float]:
    """Lengths travelled and largest curvatures up to the first touch or the loss of stability, and where that is."""
    lams, bends = [], []
    try:
        for step in load_incrementally_from(first, places):
            lams.append(step.lam)
            bends.append(largest(step))
            if step.touches:
                break
        lost = lams[-1]
    except LostStabilityError as error:
        lost = np.nan if error.parameter is None else error.parameter
    return np.array(lams), np.array(bends), lost


def facts(d: xr.Dataset) -> Facts:
    """The measured law against the secant, over the heights."""
    measured, secant = (d.sel(law=law) for law in ("measured", "secant"))
    ratio = measured.advance / secant.advance
    return {
        "heights": f"{float(d.gripper_height.min()):g} to {float(d.gripper_height.max()):g}",
        "ratio": ratio.max(),
        "least_ratio": ratio.min(),
        "bend": measured.curvature.max() / d.measured_curvature.max(),
        "secant_bend": secant.curvature.max() / d.measured_curvature.max(),
        "leaves": (measured.leaves / measured.advance).max(),
        "lost": measured.path_lost,
        "secant_lost": secant.path_lost,
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("textile_law_ratio", "ratio", "1", "no criterion",
            "largest lambda_c of the textile with its measured bending law over that of its secant, gripper at "
            "{heights} L*; smallest {least_ratio:.3f}"),
        Number("textile_law_range", "bend", "1", "no criterion",
            "largest curvature at these snaps over the largest one measured (with the secant {secant_bend:.2f}); it "
            "leaves the measured range at {leaves:.0%} of lambda_c or before"),
        Number("textile_law_path", "lost", "1", "no criterion",
            "share of the R-path planned with the secant that the textile with its measured law, without friction, "
            "follows before it snaps; with the secant {secant_lost:.2f}"),
    ),
}
# fmt: on
