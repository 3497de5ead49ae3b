"""Figures of the paper's runs and of the studies: stored datasets in, a matplotlib figure out; nothing is solved here.

A figure is drawn by the function ``draw`` of the module of its name, which also says which datasets it takes.  The
captions are for the gallery of all figures in ``docs/figures.md``.  Importing this package does not import matplotlib.
"""

from __future__ import annotations

from textwrap import fill

# fmt: off
FIGURES = {
    "geometry":
        "The strip is held at one end (blue) and grasped at the other (purple); its mid-surface is red.",
    "motion":
        "A high gripper moves from lambda_0, where it exerts no horizontal force, to the critical point lambda_c; "
        "states past it (dashed) are unstable. The farther it goes, the deeper the strip sags beside the loop.",
    "deflection":
        "At a low height the branch turns at lambda_c (inset), where stable states (solid) end and unstable ones "
        "(dashed) begin; the unstable ones end where the sag touches.",
    "collapse":
        "Static states (grey) lead to the critical state (black), the strip falls (red) until its upper layer rests on "
        "the lower one, and static states (green) follow until the gripper (purple) is above the held end (blue).",
    "collapse_curve":
        "Over the deflection (a) the snap is hardly seen, as most of the strip does not move; over the height of the "
        "sag (b) the branch turns at lambda_c, the sag falls to the lower layer at constant lambda (red) and stays "
        "there in the static states after it (green).",
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
        "elastica; below 1.586 L* (grey) the sag touches first and there is no snap of this kind. What is left (below) "
        "is due to the solid's stretch: it is proportional to eta_m g L* and grows with the weight that hangs from the "
        "gripper.",
    "barrier":
        "The energy that makes a hanging strip fall grows as the 3/2 power of the distance to lambda_c (a, b), up to "
        "lambda_t, where the sag of the unstable state touches the floor (crosses): with less advance the strip has no "
        "other state and comes back from any disturbance. The range is narrow at low grippers (c).",
    "stability_map":
        "The gripper's places of a strip of 20 L* (a). In the shaded region the strip can hang; the lines have equal "
        "distances to the boundary at which it snaps. To the right of the dashed line its sag can lie on the floor. "
        "The triangular and the circular path cross the boundary, the R-path is tangent to it, and the low path passes "
        "below it (b: the distance as long as the strip hangs). Near the boundary the smallest eigenvalue falls as the "
        "root of the distance and the energy barrier as its 3/2 power (c); farther away there is no other state.",
    "eigenvalues":
        "The smallest eigenvalue of (K, M) goes to zero at the critical points (a): as the root of the distance at a "
        "snap-through; on the R-path linearly but for its last part, where the thickness turns the tangency into a "
        "crossing (thin: the second eigenvalue). The critical modes (red down, blue up) at the snap along x (b) and on "
        "the R-path (c).",
    "folding":
        "The gripper (purple) carries the grasped edge along the folding path over the fold line (blue; dashed where "
        "the upper layer hides it).",
    "planned_paths":
        "The triangular and the circular path assume straight panels, the R-path the true bent shape of the strip.",
    "evolutions":
        "The strip deviates from the states assumed by the triangular and the circular path and snaps; the R-path only "
        "touches the stability boundary (black: last state before the critical point). The strip falls (red) from "
        "there and first touches (red triangles) beyond the planned place (black ones) or, on the triangular path, "
        "short of it.",
    "rpath_friction":
        "Past the critical point the planned state is unstable and the strip falls and touches (red) or rests without "
        "touching (blue); a little internal friction, here the paper's pull, holds it on the plan (dotted) to the end "
        "(orange: by friction alone).",
    "rpath_curve":
        "Without friction the branch (black) ends at the critical point, enlarged in (b); the strip falls (dashed) to "
        "the lower layer, from which the static states (green) lead back to the plan (dotted). From an unstable "
        "planned state (white) it falls to the lower layer (red) or rises to rest above it (blue). With friction "
        "(orange) it stays within a fraction of a millimetre of the plan.",
    "touch_error":
        "Compared with the planned first touch of the R-path the strip touches short of it on the triangular path and "
        "beyond it on the circular one; the R-path without friction does not touch where planned either. Bars: change "
        "on elements half as long. What decides is the length in L*, not eta_b: two materials of 20 L* coincide.",
    "friction_needed":
        "A pull of about one percent of the gripper force, or a similarly small hysteresis, suffices at all lengths. "
        "The two strips of 20 L* have different thicknesses.",
    "friction_delay":
        "Bending friction delays the snap in proportion to M_0 (a) until the sag touches first and nothing snaps; with "
        "the friction of fabrics (grey) there is no snap at these heights (b).",
    "friction_touch":
        "With the friction of fabrics (grey) the strip is laid down instead of falling (open marks). On the triangular "
        "path (a) that moves the touch to where it is planned, for one M_0 at each length; on the circular path (b) it "
        "stays too far. Vertical lines: an eta_b known to 20 per cent.",
    "disturbed_rpath":
        "Without friction any disturbance of the gripper, or an eta_b that is wrong, makes the strip leave the R-path "
        "and decides where it touches; with the friction of a fabric it touches close to the planned place. "
        "Vibrations: amplitude, and angular frequency in units of the square root of g over L*.",
    "fabrics":
        "Most fabrics have an L* of one to three centimetres (a). Those whose friction in bending was measured have "
        "tens of times what an R-path needs (b; shaded: all materials).",
    "textile_law":
        "The moment of the measured textile hardly grows with the curvature (a): its bends are much sharper than those "
        "of its secant, and leave the measured range long before the snap, which comes later (b).",
    "low_paths":
        "Low paths of random strips on the rod (a): stable below the touch limit, 1.586 L* for a thin strip, and above "
        "a height at which the lying part gives too much; shaded where the elastica on a lying part that gives is "
        "stable. (b) The push on what lies, and the height from which a bump in it would grow.",
    "layer_friction":
        "With friction between the layers the finished fold of the circular path is off by two L* (a): the upper layer "
        "touches with slack that it cannot push out, and the loop stays aside (b). On the triangular path the gripper "
        "draws the layer into place. Shaded: usual coefficients of fabric on fabric; circles: a finer computation.",
    "measured":
        "Verification of the measuring chain: strips filmed synthetically, each with its own friction, are measured to "
        "snap later than the frictionless model says (lines), the more so the faster the gripper moves: small filled "
        "marks and large open ones. Bars: 95 % intervals.",
    "real_paths":
        "Verification of the measuring chain: in synthetic films (above, one of them) of strips with friction the "
        "onset of the snap lies past the frictionless boundary of stability (dotted) at every height.",
    "recordings_accuracy":
        "About 95 % of the intervals hold the true lambda of synthetic recordings with noise, blur, rolling shutter, "
        "shadows, occlusion, dropped frames and compression; the other intervals are orange-red. "
        "Below, the errors in standard deviations with the distribution that the intervals assume.",
    "calibration":
        "With a refinement window that grows with the distance of the corners (blue) every view meets the target; the "
        "published outlier, view 02, comes from a window that reaches the next corner.",
    "work_precision":
        "Accuracy versus run time: error of lambda_c (a: of the first touch; d: over memory) for models and meshes, "
        "with the Pareto front (grey) and the uncertainty of the reference (dotted); open markers are elements of "
        "order one, or two elements across the thickness.",
    "fall_precision":
        "Accuracy versus run time of a fall: error of the first touch for models, meshes, time steps and integrators. "
        "Some fine meshes end 0.01 L* from the reference, a fine solid: the last stable state with nodes in contact "
        "lies at lambda_c on some meshes and 0.001 L* before it on others, which counts more at low grippers than in "
        "the fall from 5 L* of `touch_convergence`.",
    "order":
        "The error of lambda_c falls with the fourth power of the element length on the rod and the third on the solid "
        "(a); the run time grows linearly with the number of elements (b).",
    "rod":
        "The rod's distance from the solid is far below the effect of the thickness, which both have (dotted). Dashed: "
        "the orders in h between the two thickest strips; on thin ones the rod's distance is that of the meshes.",
    "printed_law":
        "A rotated strip loses stress and bending stiffness under the law as printed, all of it at 90 degrees; the "
        "objective law keeps both.",
    "peers":
        "Error over processor time of other programs and of this one (bold) on the same strip.",
}
# fmt: on
"""The caption of each figure, which says what to see."""

_SECTIONS = {
    "Motion along x": ["geometry", "motion", "deflection", "collapse", "collapse_curve", "energy", "paths"],
    "Critical points": ["critical_points", "master_curve", "stability_map", "barrier", "eigenvalues"],
    "Folding paths": ["folding", "planned_paths", "evolutions", "rpath_friction", "rpath_curve"],
    "Folding paths of all materials": [
        "touch_error",
        "friction_needed",
        "fabrics",
        "textile_law",
        "friction_delay",
        "low_paths",
        "layer_friction",
        "friction_touch",
        "disturbed_rpath",
    ],
    "Recordings": ["measured", "real_paths", "recordings_accuracy", "calibration"],
    "Accuracy and performance": ["work_precision", "fall_precision", "order", "rod", "printed_law", "peers"],
}
_HEAD = """\
# Figures

<!-- Made by `plots.gallery_markdown`: edit the captions there. -->

All figures of `figures/`, drawn from stored results; each is there as PNG and SVG. The collapse is also a
[film](../figures/collapse.mp4): static states quickly, a short fall slowed down.

The [explorer](../figures/explorer.html) is a page, to be opened in a browser: drag the gripper, or move it with the
arrow keys, and the strip of your length and eta_b follows. It shows the stability boundary, the distance to it, four
paths, and what to do where the strip would fall. Its states are interpolated in tables of the elastica
(`explorer_error` in [verification.md](verification.md)): without friction, for strips of 8 to 46 L\\* and, while the
strip is carried over, grippers at least 0.3 L\\* high. `make explorer` redoes the tables and their check in headless
Chromium.

A colour means the same in all figures. As in the paper, purple is the gripper; blue the held end, the fold line and the
way out of an R-path without a touch; red the mid-surface and the strip in motion; grey static states; black the
critical state; green static states after a fall and the lines at lambda_0 and lambda_c; magenta the place where the
folded strip begins to lie. Dashed orange-red states are unstable, orange ones need friction. Where the three paths are
compared, the R-path is black with circles, the triangular path light blue with triangles, the circular path pink with
diamonds, each with its own kind of line. Other colours tell materials, models or programs apart and are in legends.
"""


def gallery_markdown() -> str:
    """The page ``docs/figures.md``: every figure with its caption."""
    blocks = [_HEAD]
    for section, names in _SECTIONS.items():
        blocks.append(f"## {section}\n")
        for name in names:
            caption = f"**{name.replace('_', ' ')}**: {FIGURES[name]}".replace("L*", r"L\*")
            blocks.append(f"![{name}](../figures/{name}.png)\n\n{fill(caption, 120)}\n")
    return "\n".join(blocks)
