"""How far a faster model may be from the paper's solid: what the study ``rod`` found, with a fifth more."""

from __future__ import annotations


def model_error(model: str, thickness: float, nu: float) -> float:
    """Bound of a model's relative distance from the solid's lambda_c; 0 for the solid itself.

    The elastica lacks the thickness, by 0.50 to 0.72 h^2 (h in L*); the rod is off by 9e-3 h^2, and thicker ones by
    more.  Neither has a Poisson's ratio: 0.37 to 0.48 (nu h)^2.  Source: docs/method.md.

    ``model``: "elastica", "rod" or "solid"; ``thickness``: h, L*; ``nu``: Poisson's ratio.
    """
    poisson = 0.55 * (nu * thickness) ** 2
    if model == "elastica":
        return 0.85 * thickness**2 + poisson
    if model == "rod":
        return 0.012 * thickness**2 + 0.2 * thickness**4 + poisson
    return 0.0
