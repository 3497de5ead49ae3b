"""The cheapest model and mesh for an accuracy of lambda_c, chosen a priori."""

from __future__ import annotations

from stripfold import elastica
from stripfold.analysis.locate_rod import ElasticaPrediction
from stripfold.inputs import Model
from stripfold.models.model_error import model_error

FINEST = 0.1
"""Smallest factor on the element lengths that is tried."""
COARSEST = 1.6
"""Largest one of the solid: its error estimate needs twice that, where spurious limit points appear."""
MARGIN = 0.1
"""Distance from the touch limit within which only the solid decides how the advance ends, L*."""
SPARE = 0.5
"""Share of the accuracy allotted to the model error; the mesh has the rest."""


def undecided(prediction: ElasticaPrediction, length: float, thickness: float) -> bool:
    """Whether the thickness may decide how the advance ends: near the touch limit, or if little of the strip lies."""
    room = MARGIN + 10.0 * thickness**2
    return abs(prediction.height - elastica.touch_limit()) < room or length - prediction.last.length < room


def candidates(
    prediction: ElasticaPrediction, length: float, thickness: float, nu: float, accuracy: float
) -> tuple[Model, ...]:
    """The models that may meet an accuracy, cheapest first; the last is the solid, which always may.

    Where the end of the advance is :func:`undecided` it is the solid alone.
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
