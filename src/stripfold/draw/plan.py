"""The page about a planned path: map, path, margin along it, worst case and reasons in one HTML file, SI."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from stripfold.ask.folding_plan import FRAME, GRASP, FoldingPlan
from stripfold.ask.gripper_map import gripper_map
from stripfold.ask.inputs import Strip
from stripfold.base.arrays import Array
from stripfold.draw import page
from stripfold.draw.colours import BLACK, GREY, GRIPPER, PINK, SKY, TOUCHING
from stripfold.draw.save import as_svg
from stripfold.draw.stability_map import LEVELS, draw_map
from stripfold.draw.style import CM, around, equal_panels, figure, legend_above, styled
from stripfold.elastica.boundary import snap_boundary
from stripfold.follow.contact import touches

STYLES = ((SKY, "--"), (BLACK, "-"), (PINK, ":"))
"""Colours and kinds of line of the least, the given and the largest eta_b."""


def html(plan: FoldingPlan) -> str:
    """The page of a plan.

    Raises SolveError: a boundary could not be computed.
    """
    choice, asked, distances = plan.choice, plan.asked, distances_along(plan)
    worst = int(np.nanargmin(np.nanmin(distances, axis=1)))
    return page.html(
        "plan.html",
        title=f"A gripper path for a strip of {asked.length:g} m",
        plan=plan,
        asked=asked,
        duration=float(plan.waypoints[-1, 0]),
        highest=float(plan.waypoints[:, 2].max()),
        with_friction=choice.sufficient_moment is not None,
        worst=worst,
        cases=list(zip(asked.strips, choice.verdicts, [_nearest(plan, one) for one in distances], strict=True)),
        frame=FRAME,
        grasp=GRASP,
        map=as_svg(draw_places(plan, asked.strips[worst])),
        strip=as_svg(plan.plot()),
        along=as_svg(draw_along(plan, distances)),
    )


def distances_along(plan: FoldingPlan) -> Array:
    """Distance of the waypoints from the frictionless snap boundaries with the three eta_b, shape (3, n), m.

    Negative behind the boundary; nan from the waypoint on at which the sag has come to lie.
    """
    found, (x, z) = [], plan.waypoints[:, 1:3].T
    for strip, verdict in zip(plan.asked.strips, plan.choice.verdicts, strict=True):
        unit = strip.gravity_length
        boundary = snap_boundary(strip.length / unit)
        away = unit * boundary.distance((x + strip.length / 2.0) / unit, z / unit)
        first = next(point.lam for problem, point in verdict.states if touches(problem.model, point))
        found.append(np.where(plan.travelled < unit * first, away, np.nan))
    return np.array(found)


def _nearest(plan: FoldingPlan, distance: Array) -> dict[str, float]:
    """Where the gripper is nearest to the boundary, or farthest behind it."""
    at = int(np.nanargmin(distance))
    t, x, z, _ = plan.waypoints[at]
    return {"distance": float(distance[at]), "t": float(t), "x": float(x), "z": float(z)}


@styled
def draw_places(plan: FoldingPlan, strip: Strip) -> Figure:
    """The path on the stability map of one of its strips."""
    unit = CM * strip.gravity_length
    found = gripper_map(strip.length / strip.gravity_length)
    curves = {name: unit * curve for name, curve in found.curves.items()}
    path = CM * plan.waypoints[:, 1:3]
    shown = [curve for name, curve in curves.items() if name != "lifted_landed"]
    fig, (ax,) = equal_panels([around(np.vstack([*shown, path]))], above=0.56)
    advance, z = found.grid
    levels = [share * unit * found.length for share in LEVELS]
    margin = unit * found.margin(*np.meshgrid(advance, z))
    draw_map(ax, curves, unit * (advance - found.length / 2.0), unit * z, margin, levels, "cm")
    ax.plot(*path.T, color=GRIPPER, lw=1.6, label="gripper", zorder=5)
    legend_above(fig, ax.get_legend_handles_labels()[0], fontsize=7)
    return fig


@styled
def draw_along(plan: FoldingPlan, distances: Array) -> Figure:
    """Distance from the snap boundaries, height and rotation of the gripper over time."""
    t, _, z, angle = plan.waypoints.T
    fig = figure(4.2)
    margin, height, rotation = fig.subplots(3, 1, sharex=True)
    for strip, distance, (colour, line) in zip(plan.asked.strips, distances, STYLES, strict=True):
        margin.plot(t, CM * distance, line, color=colour, label=f"{strip.eta_b:.4g}")
    if plan.choice.sufficient_moment is None:
        margin.axhline(CM * plan.asked.margin, color=GREY, lw=0.8, ls="--", label="asked")
    margin.axhline(0.0, color=TOUCHING, lw=0.8)
    margin.set_ylabel("from the snap [cm]")
    margin.legend(title=r"$\eta_b$ [m$^{-4}$ s$^2$]", fontsize=7, title_fontsize=7)
    height.plot(t, CM * z, color=GRIPPER)
    height.set_ylabel("$z$ [cm]")
    rotation.plot(t, angle, color=GRIPPER)
    rotation.set(ylabel="angle [degree]", xlabel="time [s]")
    return fig
