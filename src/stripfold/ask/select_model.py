"""How far the models' lambda_c are apart by the thickness, and the cheapest model and mesh for an accuracy.

With the curvature k and the membrane strain e every model of a strip has, to the order of h^2, the energy

    6 e^2 / h^2 + (1 + a e) k^2 / 2 + h^2 (c k^4 - d k'^2).

The strain that minimises it is h^2 / 12 times T - a k^2 / 2, T the force along the strip.  What is left of the order
of h^2 is the integral of -(T - a k^2 / 2)^2 / 24 + c k^4 - d k'^2, and lambda_c is linear in it.  Derivation, and
comparison with the models: docs/method.md.  Lengths in L*.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from stripfold.ask.inputs import Model
    from stripfold.ask.prediction import ElasticaPrediction

SENSITIVITY = -0.77, 3.91, 0.79
"""Change of lambda_c, over itself and h^2, by the integrals of T k^2, k^4 and k'^2: at the lowest gripper with a snap,
where they are largest."""
LOWEST_SNAP = 1.59
"""Height of that gripper, L*."""
OTHER_HEIGHTS, TOUCH = 0.006, 0.035
"""Change of a distance with the height, over h^2: for higher grippers, and for lower ones, whose sag touches."""
MARGIN, FOURTH = 1.1, 0.25
"""Margin of the terms of h^2, and factor of those of h^4."""
FINEST = 0.1
"""Smallest factor on the element lengths that is tried."""
COARSEST = 1.0
"""Largest one."""
USUAL_ERROR = {"rod": 2e-5, "solid": 7e-5}
"""Relative error of lambda_c at refinement one that two meshes may not show (docs/method.md)."""
ORDER = {"rod": 4.0, "solid": 2.0}
"""Order of that error in the element length."""
COARSER = 1.5
"""Ratio of the element lengths of the mesh that the error is estimated with."""
SHARE = {"rod": 0.3, "solid": 0.5}
"""Estimate of the error as a share of the change from that mesh; 1/4 and 2/5 at the orders 4 and 3."""
USED = 0.7
"""Share of the accuracy that the usual estimate takes at the refinement tried first."""
NEAR_TOUCH = 0.1
"""Distance from the touch limit within which only the solid decides how the advance ends, L*."""
SPARE = 0.5
"""Share of the accuracy allotted to the model error; the mesh has the rest."""


class Section(NamedTuple):
    """The numbers of a section that bends."""

    a: float
    c: float
    d: float


ROD = Section(3.5, 0.0, 0.0)


def exact(nu: float) -> Section:
    """The two-dimensional solid: a cubic warp across the strip, and the pressure of bent fibres."""
    p = nu / (1.0 - nu)
    c = 0.075 * ((1.0 - p) ** 2 / 4.0 - 4.0 * p / 3.0) - 0.05 * (1.0 - p**2)
    return Section(3.0 * (1.0 - p), c, 0.1 / (1.0 - nu) + p / 40.0)


def one_across(nu: float) -> Section:
    """The solid with one biquadratic element across: it cannot follow what is cubic across the strip."""
    p = nu / (1.0 - nu)
    yielding = 6.0 / (1.0 - p**2) * (p**2 / 320.0 - (p + 2.0 * (1.0 - p**2)) ** 2 / 576.0)
    c = 0.075 * ((1.0 - p) ** 2 / 4.0 - p) + yielding
    d = 3.0 * (1.0 - nu) * ((1.0 / (6.0 * (1.0 - nu)) + p / 24.0) ** 2 - p**2 / 320.0)
    return Section(3.0 * (1.0 - p), c, d)


def model_error(model: str, thickness: float, nu: float, height: float, length: float) -> float:
    """Bound of a model's relative distance from the solid's lambda_c or lambda_touch; 0 for the solid itself.

    The solid is the paper's, with one biquadratic element across; :func:`solid_error` is its own distance from the
    exact one.  The elastica lacks the thickness: bending, the stretch under the weight of a high strip, and the
    compression of what lies.

    ``model``: "elastica", "rod" or "solid"; ``thickness``, ``height``, ``length``: h, the gripper's height and the
    strip's length, L*; ``nu``: Poisson's ratio.
    """
    if model == "elastica":
        effect = (max(0.85, height / 25.0) + 0.0024 * length) * thickness**2
        return effect + 3.0 * effect**2
    if model == "rod":
        return _apart(ROD, one_across(nu), thickness, height)
    return 0.0


def solid_error(thickness: float, nu: float, height: float) -> float:
    """Bound of the relative distance of lambda_c between one biquadratic element across and the exact solid."""
    return _apart(one_across(nu), exact(nu), thickness, height)


def _apart(one: Section, other: Section, thickness: float, height: float) -> float:
    stretch, bending, shear = SENSITIVITY
    low = stretch * (one.a - other.a) / 24.0 - shear * (one.d - other.d)
    low += bending * (one.c - other.c - (one.a**2 - other.a**2) / 96.0)
    square = MARGIN * abs(low) + (OTHER_HEIGHTS if height >= LOWEST_SNAP else TOUCH)
    return (square + FOURTH * thickness**2) * thickness**2


def candidates(
    prediction: ElasticaPrediction, length: float, thickness: float, nu: float, accuracy: float
) -> tuple[Model, ...]:
    """The models that may meet an accuracy, cheapest first; the last is the solid, which always may.

    It is the solid alone where the thickness may decide how the advance ends: near the touch limit, or if little of the
    strip lies.
    """
    from stripfold import elastica

    room, height = NEAR_TOUCH + 10.0 * thickness**2, prediction.height
    if abs(height - elastica.touch_limit()) < room or length - prediction.last.length < room:
        return ("solid",)
    cheap: tuple[Model, ...] = ("elastica", "rod")
    return (*(m for m in cheap if model_error(m, thickness, nu, height, length) <= SPARE * accuracy), "solid")


def refinement(model: str, accuracy: float) -> float:
    """Factor on the element lengths that usually meets an accuracy by the estimate from a coarser mesh."""
    order = ORDER[model]
    estimate = (1.0 + SHARE[model] * (COARSER**order - 1.0)) * USUAL_ERROR[model]
    return float(min(COARSEST, max(FINEST, (USED * accuracy / estimate) ** (1.0 / order))))


def error(model: str, refinement: float, fine: float, coarse: float, slack: float) -> float:
    """Estimated error of lambda_c by a model at a refinement, L*, given that on a mesh :data:`COARSER`.

    It is a share of the change from there, the usual error, and the bracket's width.  Two meshes may agree by chance:
    in a thin strip the solid's error changes its sign with the mesh.
    """
    return SHARE[model] * abs(fine - coarse) + USUAL_ERROR[model] * refinement ** ORDER[model] * fine + slack
