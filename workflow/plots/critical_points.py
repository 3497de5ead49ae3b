"""Critical points over the gripper height, in SI units, for all materials."""

from __future__ import annotations

from typing import Any

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from plots.pieces import ETA_TITLE, Look, entry, note
from plots.readers import critical_points, materials
from stripfold.draw.colours import BLACK
from stripfold.draw.style import CM, figure, legend_above, styled

CROWDED = 0.6
"""When all materials but one fill less than this part of the axes, that one gets a panel of its own."""
NO_SNAP = "sag touches first: no snap"


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw lambda_c over the gripper height; where there is no snap, the advance at which the sag touches.

    ``data`` holds critical points over ``material`` and ``height_index``, padded with nan.
    """
    found = [(critical_points(data, name), how) for name, how in materials(data)]
    sizes = sorted((CM * float(p["gripper_height"].max()), CM * float(p["end"].max())) for p, _ in found)
    apart = len(sizes) > 1 and sizes[-2][0] < CROWDED * sizes[-1][0]
    fig = figure(5.0 if apart else 3.2)
    axes = list(fig.subplots(2 if apart else 1, 1, squeeze=False, height_ratios=(2, 1) if apart else (1,)).flat)
    for p, how in found:
        large = apart and CM * float(p["gripper_height"].max()) == sizes[-1][0]
        draw_points(axes[1 if large else 0], p, CM, how)
    for ax in axes:
        ax.set(ylabel=r"critical point $\lambda_c$ [cm]", xlim=(0.0, None), ylim=(0.0, None))
    axes[-1].set_xlabel("gripper height $z$ [cm]")
    legend_above(fig, legend_handles(data), title=ETA_TITLE)
    if apart:
        note(axes[0], "(a)")
        note(axes[1], "(b) the longest strip")
    return fig


def legend_handles(data: xr.Dataset) -> list[Line2D]:
    """One entry for each material under the title ``ETA_TITLE``, and one for crosses where there are any."""
    handles = [
        entry(eta_label(data, name), how.color, marker=how.marker, ms=3.0, lw=1.0) for name, how in materials(data)
    ]
    if not all(critical_points(data, name)["snap"].all() for name, _ in materials(data)):
        handles.append(entry(NO_SNAP, BLACK, "none", marker="x"))
    return handles


def draw_points(ax: Axes, p: xr.Dataset, scale: float, how: Look, **options: Any) -> None:
    """Draw one material's points, lengths times ``scale``: markers joined by a line, crosses without snap."""
    z, lam, error = (scale * p[name].values for name in ("gripper_height", "end", "lambda_error"))
    snap = p["snap"].values
    ax.errorbar(z[snap], lam[snap], yerr=error[snap], **error_bars(how) | options)
    ax.plot(z[~snap], lam[~snap], "x", color=how.color, mew=1.2, label="_no-snap")


def error_bars(how: Look) -> dict[str, Any]:
    """Options of ``Axes.errorbar`` for the points of a material."""
    return {"color": how.color, "marker": how.marker, "ms": 3.0, "lw": 1.0, "capsize": 1.5, "elinewidth": 0.8}


def eta_label(data: xr.Dataset, material: str) -> str:
    """``eta_b`` of a material, with its name where it has one."""
    one = data.sel(material=material)
    label = str(one["label"].values)
    number = f"{float(f'{float(one.eta_b):.3g}'):.10g}"
    return number if label.startswith("η_b") else f"{number}: {label}".replace("η_b", r"$\eta_b$")
