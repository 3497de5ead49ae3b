"""The solid's elements: patch tests, rigid motions, zero modes, weight, mass, and derivatives of one another."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from skfem.helpers import dot, mul

from oracles.held_solid import HeldSolid, arc, column, interpolant
from stripfold.strip.reference import Reference

LENGTH, THICKNESS = 2.4, 0.5
ELEMENTS = np.array([0.0, 0.4, 0.7, 1.3, 1.9, 2.4])
KINDS = [
    pytest.param(1, 2, id="order1-across2"),
    pytest.param(2, 1, id="order2"),
    pytest.param(2, 2, id="order2-across2"),
]
RIGID = (0.0, 37.0, 90.0, 180.0, -135.0)


def skew(p: np.ndarray) -> np.ndarray:
    """Quadrilaterals of many shapes; also the faces and the ends are no longer straight."""
    x, z = p
    return np.stack([x + 0.5 * z + 0.1 * np.sin(9.0 * x + 5.0 * z), z * (1.0 + 0.2 * np.cos(4.0 * x)) + 0.05 * x])


def strip(order: int, across: int, nu: float = 0.3, law: str = "svk", distorted: bool = True) -> Reference:
    """The strip of most tests here."""
    return Reference.of(
        LENGTH,
        THICKNESS,
        nu=nu,
        order=order,
        elements=ELEMENTS,
        across=across,
        law=law,
        distort=skew if distorted else None,
    )


def to_unknowns(model: Reference, nodal: np.ndarray) -> np.ndarray:
    """A nodal force in our unknowns: T^T f."""
    return np.asarray(model.transformation.T @ nodal)


def traction(model: Reference, stress: np.ndarray, gradient: np.ndarray | None = None) -> np.ndarray:
    """Force of ``(stress + gradient x) n`` on the whole boundary, with a rule of high order.

    ``stress`` has shape (2, 2), ``gradient`` (2, 2, 2): component i, j per coordinate.
    """
    basis = skfem.FacetBasis(model.basis.mesh, model.basis.elem, intorder=8)
    slope = np.zeros((2, 2, 2)) if gradient is None else gradient

    @skfem.LinearForm
    def form(v, w):
        s = stress[:, :, None, None] + np.einsum("ijk,k...->ij...", slope, w.x)
        return dot(mul(s, w.n), v)

    return to_unknowns(model, form.assemble(basis))


def rigid(model: Reference, degrees: float) -> np.ndarray:
    """Unknowns of the strip turned about a point beside it and shifted."""
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    x = model.basis.doflocs
    return interpolant(model, turn @ x - x + np.array([[0.3], [-1.2]]))


class TestPatch:
    """Fields that the elements must have exactly, whatever their shape."""

    @pytest.mark.parametrize("nu", [0.0, 0.3])
    @pytest.mark.parametrize(("order", "across"), KINDS)
    def test_affine_with_a_large_stretch(self, order, across, nu):
        """Truth: F constant (a turn by 50 degrees after 40 % stretch, 10 % across and shear) and P = F S(F) everywhere.

        Ends prescribed, faces loaded by the exact traction P n; started off the solution.
        """
        a = np.radians(50.0)
        f = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) @ np.array([[1.4, 0.1], [0.0, 1.1]])
        model = strip(order, across, nu)
        strain = 0.5 * (f.T @ f - np.eye(2))
        p = f @ (model.lame[0] * np.trace(strain) * np.eye(2) + 2.0 * model.lame[1] * strain)
        exact = interpolant(model, (f - np.eye(2)) @ model.basis.doflocs)
        held = np.concatenate([column(model, 0), column(model, -1)])
        problem = HeldSolid(model, held, exact[held], traction(model, p))
        start = exact + 0.02 * np.random.default_rng(3).standard_normal(model.size)
        q = problem.solve(start, force_tolerance=1e-11).q
        assert np.abs(start - exact).max() > 0.02
        assert np.abs(q - exact).max() < 1e-12

    @pytest.mark.parametrize("law", ["svk", "printed"])
    @pytest.mark.parametrize("degrees", RIGID)
    @pytest.mark.parametrize(("order", "across"), KINDS)
    def test_a_rigid_motion_needs_no_force(self, order, across, degrees, law):
        """Truth: zero, measured against the stiffness; also for the printed law, whose E vanishes too."""
        model = strip(order, across, law=law)
        force, k = model.force_and_tangent(rigid(model, degrees))
        assert np.abs(force).max() < 1e-14 * np.abs(k.diagonal()).max()


@pytest.mark.parametrize("degrees", [0.0, 90.0])
@pytest.mark.parametrize("distorted", [False, True])
@pytest.mark.parametrize(("order", "across"), KINDS)
def test_three_zero_modes(order, across, distorted, degrees):
    """The free strip has its three rigid modes and no other: the reduced rule along the strip leaves no hourglass.

    Truth: the rank of the tangent, from its singular values, scaled to unit diagonal; the gap is of ten decades.
    """
    model = strip(order, across, distorted=distorted)
    k = model.force_and_tangent(rigid(model, degrees))[1].to_sparse().toarray()
    scale = 1.0 / np.sqrt(np.diag(k))
    values = np.linalg.eigvalsh(scale[:, None] * k * scale)
    print(values[:5])
    assert np.abs(values[:3]).max() < 1e-13
    assert values[3] > 1e-4


class TestWeightAndMass:
    """Integrals of the density; the strip weighs one per length."""

    @pytest.mark.parametrize(("order", "across"), KINDS)
    def test_totals(self, order, across):
        """Truth: weight and mass of the strip are its length; no weight along x, no product of x and z."""
        model = strip(order, across, distorted=False)
        x = model.basis.doflocs
        along, up = (interpolant(model, np.outer(e, np.ones(x.shape[1]))) for e in np.eye(2))
        assert model.weight @ up == pytest.approx(LENGTH, rel=1e-14)
        assert model.weight @ along == 0.0
        assert along @ (model.mass @ along) == pytest.approx(LENGTH, rel=1e-14)
        assert up @ (model.mass @ up) == pytest.approx(LENGTH, rel=1e-14)
        assert abs(along @ (model.mass @ up)) < 1e-15


class TestDerivatives:
    """Taylor tests about a strip bent by 150 degrees."""

    STEPS = 2.0 ** -np.arange(7, 12)

    @pytest.mark.parametrize("nu", [0.0, 0.3])
    @pytest.mark.parametrize(("order", "across"), KINDS)
    def test_energy_force_tangent(self, order, across, nu):
        """Remainders: force against tangent of slope 2, energy against force and tangent of slope 3."""
        model = strip(order, across, nu)
        rng = np.random.default_rng(2)
        q = arc(model, np.radians(150.0)) + 0.02 * rng.standard_normal(model.size)
        dq = rng.standard_normal(model.size)
        force, k = model.force_and_tangent(q)
        rate = k @ dq
        remainders = np.array(
            [
                [
                    np.abs(model.internal_force(q + t * dq) - force - t * rate).max() / np.abs(rate).max(),
                    abs(model.energy(q + t * dq) - model.energy(q) - t * (force @ dq) - t**2 / 2 * (dq @ rate))
                    / abs(dq @ rate),
                ]
                for t in self.STEPS
            ]
        )
        slopes = np.log2(remainders[:-1] / remainders[1:])
        print("slopes: force", slopes[:, 0], "energy", slopes[:, 1])
        assert slopes[-1] == pytest.approx([2.0, 3.0], abs=0.05)
        assert np.all(remainders[-1] < [1e-4, 1e-8])
