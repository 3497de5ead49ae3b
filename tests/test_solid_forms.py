"""The compiled solid against the same formulas written as scikit-fem forms, with which it shares nothing."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold.follow.statics import StripModel, solve_height
from stripfold.strip.reference import Reference
from stripfold.strip.solid import Solid

ELEMENTS = np.array([0.0, 0.4, 0.7, 1.3, 1.9, 2.4])


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_the_kernels_are_the_forms(nu):
    """All that both compute, in a strip bent by more than 90 degrees, to 1e-12 of the largest entry."""
    models = [kind.of(2.4, 0.3, nu=nu, elements=ELEMENTS) for kind in (Solid, Reference)]
    s, rng = models[0].s, np.random.default_rng(1)
    position = np.stack([np.sin(0.9 * s) / 0.9 - 1.2, (1.0 - np.cos(0.9 * s)) / 0.9], axis=1)
    q, dq = (models[0].unknowns_of(position, 0.9 * s) + 0.02 * rng.standard_normal(models[0].size) for _ in range(2))
    growth = 0.1 * rng.standard_normal(5)

    def found(model: Solid) -> dict[str, np.ndarray]:
        force, tangent = model.force_and_tangent(q)
        predicted = model.predict_stress(q, dq, growth)
        return {
            "force": force,
            "force alone": model.internal_force(q),
            "tangent": tangent.flat,
            "with predicted stress": model.force_and_tangent(q, predicted)[1].flat,
            "mass": model.mass.flat,
            "weight": model.weight,
            "part of the weight": model.weighted(growth),
            "energy": np.array(model.energy(q)),
            "resampled": model.resampled(q, np.linspace(0.0, 2.4, 7)),
        }

    for (name, fast), slow in zip(found(models[0]).items(), found(models[1]).values(), strict=True):
        error = np.abs(fast - slow).max() / np.abs(slow).max()
        assert error < 1e-12, (name, error)
    by_length = [model.force_and_derivatives(q, growth[None])[2] for model in models]
    np.testing.assert_allclose(*by_length, atol=1e-12 * np.abs(by_length[0]).max())


@pytest.mark.parametrize("thickness", [1e-1, 1e-2, 1e-3, 1e-4])
def test_thin_strips_differ_by_rounding_of_the_nodal_form_only(thickness):
    """What the thickness-relative unknowns are for: the nodal form loses figures in 1/h, the kernels do not.

    Truth: a rigid turn by 180 degrees leaves no force.  Measured against the stiffness, the kernels' force stays at
    rounding for every thickness; that of the nodal form grows as 1/h.
    """
    model = Solid.of(2.4, thickness, elements=6)
    position = np.stack([-(model.s - 1.2), np.zeros(len(model.s))], axis=1)
    q = model.unknowns_of(position, np.full(len(model.s), np.pi))
    stiffness = np.abs(model.force_and_tangent(q)[1].diagonal()).max()
    ours = np.abs(model.internal_force(q)).max() / stiffness
    nodal = np.abs(Reference.of(2.4, thickness, elements=6).internal_force(q)).max() / stiffness
    assert ours < 2e-15
    assert nodal < 1e-14 / thickness


@pytest.mark.slow
def test_the_critical_point_is_the_same():
    """From the lift to lambda_c on coarse elements; where they are planned anew on the way moves it by 4e-6."""
    fast, slow = (solve_height(StripModel(12.0, 0.0594, kind=kind), 3.0, 2.0) for kind in ("solid", "reference"))
    assert fast.lam == pytest.approx(slow.lam, abs=1e-5)
