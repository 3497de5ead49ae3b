"""The solid's fast kernels against the same formulas written as scikit-fem forms.

Truth: :mod:`reference_forms`, which shares the basis with the kernels and nothing else.
"""

from __future__ import annotations

import numpy as np
import pytest

from oracles.reference_forms import Reference
from stripfold.strip.solid import Solid

THICKNESS = 0.3
ELEMENTS = np.array([0.0, 0.4, 0.7, 1.3, 1.9, 2.4])


def shear_and_wave(p: np.ndarray) -> np.ndarray:
    """Elements neither rectangular nor alike."""
    x, z = p
    return np.stack([x + 0.4 * z + 0.05 * np.sin(3.0 * x) * z, z * (1.0 + 0.2 * np.cos(2.0 * x)) + 0.03 * x])


def bent(model: Solid, seed: int = 1) -> np.ndarray:
    """Unknowns of a strip bent by more than 90 degrees, with noise on every unknown."""
    curvature = 0.9
    s = model.s
    position = np.stack([np.sin(curvature * s), 1.0 - np.cos(curvature * s)], axis=1) / curvature
    position[:, 0] -= model.length / 2.0
    q = model.unknowns_of(position, curvature * s)
    return q + 0.02 * np.random.default_rng(seed).standard_normal(q.size)


CASES = [
    pytest.param(order, across, nu, distort, id=f"order{order}-across{across}-nu{nu}-{name}")
    for order, across in ((1, 2), (2, 1), (2, 2))
    for nu in (0.0, 0.3)
    for name, distort in (("straight", None), ("distorted", shear_and_wave))
]


@pytest.mark.parametrize("law", ["svk", "printed"])
@pytest.mark.parametrize(("order", "across", "nu", "distort"), CASES)
def test_the_kernels_are_the_forms(order, across, nu, distort, law):
    """Force, tangent, energy, mass and weight to 1e-12 of their largest entry."""
    model = Solid.of(2.4, THICKNESS, nu=nu, order=order, elements=ELEMENTS, across=across, law=law, distort=distort)
    reference = Reference(model.mesh, model.lame, law)
    q = bent(model)
    force, tangent = model.force_and_tangent(q)
    pairs = {
        "force": (force, reference.internal_force(q)),
        "force alone": (model.internal_force(q), force),
        "tangent": (tangent.to_sparse().toarray(), reference.tangent(q)),
        "mass": (model.mass.to_sparse().toarray(), reference.mass()),
        "weight": (model.weight, reference.weight()),
    }
    if law == "svk":
        pairs["energy"] = (np.array(model.energy(q)), np.array(reference.energy(q)))
    else:
        assert np.isnan(model.energy(q))
    for name, (fast, slow) in pairs.items():
        error = np.abs(fast - slow).max() / np.abs(slow).max()
        print(f"{name}: {error:.1e}")
        assert error < 1e-12, name


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
    nodal = np.abs(Reference(model.mesh, model.lame).internal_force(q)).max() / stiffness
    print(f"h = {thickness:.0e}: ours {ours:.1e}, nodal {nodal:.1e}")
    assert ours < 2e-15
    assert nodal < 1e-14 / thickness
