"""Figures of the paper's runs and of the studies: stored datasets in, a matplotlib figure out; nothing is solved here.

A figure is drawn by the function ``draw_`` with its name, or by ``draw`` of its study, which also says which datasets
it takes.  The captions, in ``captions``, are for the gallery of all figures, ``docs/figures.md``, and for ``make
report``.  Importing this package does not import matplotlib.
"""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

SECTIONS = {
    "Motion along x": ["geometry", "motion", "deflection", "collapse", "collapse_curve", "energy", "paths"],
    "Critical points": ["critical_points", "master_curve", "stability_map", "barrier"],
    "Folding paths": ["folding", "planned_paths", "evolutions", "rpath_friction", "rpath_curve"],
    "Folding paths of all materials": [
        "touch_error",
        "friction_needed",
        "folding_plans",
        "gripper",
        "fabrics",
        "textile_law",
        "friction_delay",
        "low_paths",
        "rucks",
        "layer_friction",
        "friction_touch",
        "disturbed_rpath",
    ],
    "Recordings": ["measured", "real_paths", "recordings_accuracy", "calibration"],
    "Accuracy and performance": ["work_precision", "fall_precision", "order", "rod", "printed_law", "peers"],
}
"""The figures, in the sections of the gallery and of Snakemake's report."""
FIGURES = {
    name: " ".join(Path(__file__).with_name("captions").joinpath(f"{name}.rst").read_text(encoding="utf-8").split())
    for names in SECTIONS.values()
    for name in names
}
"""The caption of each figure, which says what to see."""
_HEAD = """\
# Figures

<!-- Made by `plots.gallery_markdown`: edit the captions in `workflow/plots/captions`. -->

All figures of `figures/`, drawn from stored results; each is there as PNG and SVG. The collapse is also a
[film](../figures/collapse.mp4): static states quickly, a short fall slowed down.

The [explorer](../figures/explorer.html) is a page for a browser: drag the gripper, or move it with the arrow keys, and
the strip of your length and eta_b follows or falls. It shows the stability boundary, the distance to it, four paths,
and after a fall the hysteresis loop; a button plays the paper's motion along x. Its states are interpolated in tables
of the elastica (`explorer_error` in [verification](verification.md)): without friction, for strips of 8 to 46 L\\*
and, while the strip is carried over, grippers at least 0.3 L\\* high.

A colour means the same in all figures. As in the paper, purple is the gripper; blue the held end, the fold line and the
way out of an R-path without a touch; red the mid-surface and the strip in motion; grey static states; black the
critical state; green static states after a fall and the lines at lambda_0 and lambda_c; magenta the place where the
folded strip begins to lie. Dashed orange-red states are unstable, orange ones need friction. The R-path is black with
circles, the triangular path light blue with triangles, the circular path pink with diamonds.
"""


def gallery_markdown() -> str:
    """The page ``docs/figures.md``: every figure with its caption."""
    blocks = [_HEAD]
    for section, names in SECTIONS.items():
        blocks.append(f"## {section}\n")
        for name in names:
            caption = f"**{name.replace('_', ' ')}**: {FIGURES[name]}".replace("L*", r"L\*")
            blocks.append(f"![{name}](../figures/{name}.png)\n\n{fill(caption, 120)}\n")
    return "\n".join(blocks)
