"""Figures: stored datasets in, a matplotlib figure out; nothing is solved here.

:data:`FIGURES` is the table of all.  A figure is drawn by the function ``draw`` of the module of its name, which also
says which datasets it takes.  Importing this package does not import matplotlib.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from stripfold.errors import InvalidInputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class Entry(NamedTuple):
    """The module whose ``draw`` draws a figure, and a caption that says what to see."""

    module: str
    caption: str


def table(package: str, captions: Mapping[str, str]) -> dict[str, Entry]:
    """A table of the figures in a package from their captions."""
    return {name: Entry(f"{package}.{name}", caption) for name, caption in captions.items()}


# fmt: off
FIGURES = table(__name__, {
    "geometry":
        "The strip is held at one end (blue) and grasped at the other (purple); its mid-surface is red.",
    "motion":
        "The gripper moves from lambda_0, where it exerts no horizontal force, to the critical point lambda_c; states "
        "past it (dashed) are unstable.",
    "deflection":
        "The branch turns at lambda_c (inset), where stable states (solid) end and unstable ones (dashed) begin.",
    "collapse":
        "Static states (grey) lead to the critical state (black), the strip falls (red) until its upper layer rests on "
        "the lower one, and static states (green) follow until the gripper (purple) is above the held end (blue).",
    "collapse_curve":
        "The gripper is held slightly past lambda_c (inset): in the fall (red) the deflection jumps at constant "
        "lambda; static states continue after it (green).",
    "energy":
        "Gravity releases energy in the fall (a), most of it to bending; air and fabric dissipate the rest (b), and "
        "the balance closes to rounding (c).",
    "paths":
        "The gripper's paths (purple) start at lambda_0 and end at the critical points (dotted line); crosses mark "
        "heights at which the sag touches before any snap.",
    "critical_points":
        "lambda_c grows almost linearly with the gripper height for every material.",
    "master_curve":
        "In units of the gravity-bending length L* the critical points of all materials lie on one curve, that of the "
        "elastica; below 1.586 L* (grey) the sag touches first and there is no snap of this kind.",
    "folding":
        "The gripper (purple) carries the grasped end along the folding path over the fold line (blue).",
    "planned_paths":
        "The triangular and the circular path assume straight panels, the R-path the true bent shape of the strip.",
    "evolutions":
        "The strip deviates from the states assumed by the triangular and the circular path and snaps; the R-path only "
        "touches the stability boundary (black: last state before the critical point).",
    "rpath_friction":
        "Past the critical point the planned state is unstable and the strip falls and touches (red) or rests without "
        "touching (blue); a little internal friction holds it on the plan to the end (orange).",
    "rpath_curve":
        "Without friction the branch (black) ends at the critical point, enlarged in (b); with friction (orange) the "
        "strip stays within a fraction of a millimetre of the plan.",
    "touch_error":
        "On the triangular path the strip first touches more than L* short of where the folded strip lands; on the "
        "R-path it comes closer, on the circular path it mostly touches too far.",
    "friction_needed":
        "A pull of about one percent of the gripper force, or a similarly small hysteresis, suffices everywhere.",
    "measured":
        "Strips snap later than the frictionless model says (lines), the more so the faster the gripper moves.",
    "real_paths":
        "The onset of the snap lies past the frictionless boundary of stability (dotted) at every height.",
})
# fmt: on


def draw(name: str, *datasets: xr.Dataset, **options: Any) -> Figure:
    """Draw a figure of :data:`FIGURES`; the datasets in the order in which its module's ``draw`` takes them.

    Raises
    ------
    InvalidInputError
        There is no such figure, or a dataset is not what the figure needs.
    """
    return draw_from(FIGURES, name, *datasets, **options)


def draw_from(figures: Mapping[str, Entry], name: str, *datasets: xr.Dataset, **options: Any) -> Figure:
    """Draw the figure ``name`` of a table."""
    if name not in figures:
        raise InvalidInputError("figure", name, f"one of {', '.join(figures)}")
    figure: Figure = import_module(figures[name].module).draw(*datasets, **options)
    return figure
