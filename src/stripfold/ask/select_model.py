"""The cheapest model and mesh for an accuracy of lambda_c, chosen a priori."""

from __future__ import annotations

from stripfold import elastica
from stripfold.ask.inputs import Model
from stripfold.ask.model_error import model_error
from stripfold.ask.prediction import ElasticaPrediction

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
MARGIN = 0.1
"""Distance from the touch limit within which only the solid decides how the advance ends, L*."""
SPARE = 0.5
"""Share of the accuracy allotted to the model error; the mesh has the rest."""


def undecided(prediction: ElasticaPrediction, length: float, thickness: float) -> bool:
    """Whether the thickness may decide how the advance ends.

    That is near the touch limit, or if little of the strip lies.
    """
    room, height = room_for(thickness), prediction.height
    return abs(height - elastica.touch_limit()) < room or length - prediction.last.length < room


def room_for(thickness: float) -> float:
    """How far, in L*, the advance of a strip may end from where the elastica's does."""
    return MARGIN + 10.0 * thickness**2


def candidates(
    prediction: ElasticaPrediction, length: float, thickness: float, nu: float, accuracy: float
) -> tuple[Model, ...]:
    """The models that may meet an accuracy, cheapest first; the last is the solid, which always may.

    Where the end of the advance is :func:`undecided` it is the solid alone.
    """
    if undecided(prediction, length, thickness):
        return ("solid",)
    cheap: tuple[Model, ...] = ("elastica", "rod")
    height = prediction.height
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
