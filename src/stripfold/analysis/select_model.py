"""Which model and mesh give lambda_c to an accuracy for the least time: what is known before anything is solved."""

from __future__ import annotations

from stripfold import elastica
from stripfold.analysis.locate_rod import ElasticaPrediction
from stripfold.inputs import Model
from stripfold.models.model_error import model_error

FINEST = 0.1
"""Smallest factor on the element lengths that is tried."""
COARSEST = 1.6
"""Largest one of the solid: on twice that, which its estimate needs, a node of the floor can hold the strip back."""
MARGIN = 0.1
"""How near the touch limit a gripper may be for a model that is not the solid to say what ends the advance, L*."""
SPARE = 0.5
"""Share of the accuracy that a model may use up; the mesh has the rest."""


def undecided(prediction: ElasticaPrediction, length: float, thickness: float) -> bool:
    """Whether the strip's thickness may decide what ends the advance: the elastica then does not know.

    So it is near the touch limit, and where little of the strip lies at the end.
    """
    room = MARGIN + 10.0 * thickness**2
    return abs(prediction.height - elastica.touch_limit()) < room or length - prediction.last.length < room


def candidates(
    prediction: ElasticaPrediction, length: float, thickness: float, nu: float, accuracy: float
) -> tuple[Model, ...]:
    """The models that may meet an accuracy, cheapest first; the last is the solid, which always may.

    Near the touch limit, and where little of the strip lies at the end, the solid alone says what ends the advance.
    """
    if undecided(prediction, length, thickness):
        return ("solid",)
    cheap: tuple[Model, ...] = ("elastica", "rod")
    return (*(m for m in cheap if model_error(m, thickness, nu) <= SPARE * accuracy), "solid")


def solid_refinement(accuracy: float) -> float:
    """Factor on the solid's element lengths that usually meets an accuracy by the estimate from a mesh half as fine."""
    return min(COARSEST, max(FINEST, 1.4 * (accuracy / 1e-3) ** 0.5))


def rod_refinement(accuracy: float, at_one: float) -> float:
    """The same of the rod's, of order four, with the error ``at_one``."""
    return min(1.0, max(FINEST, (accuracy / at_one) ** 0.25))
