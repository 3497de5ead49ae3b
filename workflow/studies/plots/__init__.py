"""Figures of the studies, and the gallery of all figures in ``docs/figures.md``; does not import matplotlib."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Any

from stripfold import plots
from stripfold.plots import draw_from, table

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# fmt: off
FIGURES = table(__name__, {
    "recordings_accuracy":
        "About 95 % of the intervals hold the true lambda of synthetic recordings with noise, blur, rolling shutter, "
        "shadows, occlusion, dropped frames and compression; the other intervals are orange-red.",
    "calibration":
        "With a refinement window that grows with the distance of the corners (blue) every view meets the target; the "
        "published outlier, view 02, comes from a window that reaches the next corner.",
    "work_precision":
        "Accuracy versus run time: error of lambda_c (a: of the first touch; d: over memory) for models and meshes, "
        "with the Pareto front (grey) and the uncertainty of the reference (dotted); open markers are elements of "
        "order one, or two elements across the thickness.",
    "fall_precision":
        "Accuracy versus run time of a fall: error of the first touch for models, meshes (size of the markers), time "
        "steps (half-filled: longer at the top, shorter at the bottom) and integrators, with the Pareto front (grey) "
        "and the uncertainty of the reference (dotted).",
    "order":
        "The error of lambda_c falls with the fourth power of the element length on the rod and the third on the solid "
        "(a); the run time grows linearly with the number of elements (b).",
    "rod":
        "The rod's distance from the solid is far below the effect of the thickness, which both have (dotted).",
    "printed_law":
        "A rotated strip loses stress and bending stiffness under the law as printed, all of it at 90 degrees; the "
        "objective law keeps both.",
    "peers":
        "Error over processor time of other programs and of this one (bold) on the same strip.",
})
# fmt: on

_SECTIONS = {
    "Motion along x": ["geometry", "motion", "deflection", "collapse", "collapse_curve", "energy", "paths"],
    "Critical points": ["critical_points", "master_curve"],
    "Folding paths": ["folding", "planned_paths", "evolutions", "rpath_friction", "rpath_curve"],
    "Folding paths of all materials": ["touch_error", "friction_needed"],
    "Recordings": ["measured", "real_paths", "recordings_accuracy", "calibration"],
    "Accuracy and performance": ["work_precision", "fall_precision", "order", "rod", "printed_law", "peers"],
}
_HEAD = """\
# Figures

<!-- Made by `studies.plots.gallery_markdown`: edit the captions there and in `stripfold.plots`. -->

All figures of `figures/`, drawn from stored results; each is there as PNG and SVG. The collapse is also a
[film](../figures/collapse.mp4): static states quickly, a short fall slowed down.

A colour means the same in all figures. As in the paper, purple is the gripper; blue the held end, the fold line and the
way out of an R-path without a touch; red the mid-surface and the strip in motion; grey static states; black the
critical state; green static states after a fall and the lines at lambda_0 and lambda_c; magenta the place where the
folded strip begins to lie. Dashed orange-red states are unstable, orange ones need friction. Other colours tell
materials, models or programs apart and are named in legends.
"""


def draw(name: str, *datasets: xr.Dataset, **options: Any) -> Figure:
    """Draw a figure of the package or of the studies; as :func:`stripfold.plots.draw`."""
    return draw_from(plots.FIGURES | FIGURES, name, *datasets, **options)


def gallery_markdown() -> str:
    """The page ``docs/figures.md``: every figure with its caption."""
    figures = plots.FIGURES | FIGURES
    blocks = [_HEAD]
    for section, names in _SECTIONS.items():
        blocks.append(f"## {section}\n")
        for name in names:
            caption = f"**{name.replace('_', ' ')}**: {figures[name].caption}".replace("L*", r"L\*")
            blocks.append(f"![{name}](../figures/{name}.png)\n\n{fill(caption, 120)}\n")
    return "\n".join(blocks)
