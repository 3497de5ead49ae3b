"""The solid's elements: patch tests, rigid motions, zero modes, weight, mass, and derivatives of one another."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from scipy.optimize import minimize
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

    @pytest.mark.parametrize("across", [1, 2])
    def test_quadratic_and_linear_elastic(self, across):
        """Order 2 has every quadratic displacement exactly in the linearised solid, also on distorted elements.

        Truth: stress linear in X, constant body force -div(stress), traction stress n.  The two Gauss points along
        the strip integrate all of it exactly.  It does not hold for large displacements, where the stress of a
        quadratic field is of sixth degree; nor for order 1.
        """
        model = strip(2, across)
        x, z = model.basis.doflocs
        rng = np.random.default_rng(5)
        c = rng.standard_normal((2, 3))  # of x^2, x z, z^2, for each component
        q = interpolant(model, c @ np.stack([x**2, x * z, z**2]))
        # d u_i / d X_j per coordinate k
        slope = np.stack([np.array([[2 * c[i, 0], c[i, 1]], [c[i, 1], 2 * c[i, 2]]]) for i in (0, 1)])
        strain = 0.5 * (slope + slope.transpose(1, 0, 2))
        trace = strain[0, 0] + strain[1, 1]
        stress = model.lame[0] * np.eye(2)[:, :, None] * trace + 2.0 * model.lame[1] * strain
        body = -np.einsum("ijj->i", stress)
        basis = skfem.Basis(model.basis.mesh, model.basis.elem, intorder=8)
        load = skfem.LinearForm(lambda v, w: body[0] * v[0] + body[1] * v[1]).assemble(basis)
        force = model.force_and_tangent(np.zeros(model.size))[1] @ q
        wanted = to_unknowns(model, load) + traction(model, np.zeros((2, 2)), stress)
        assert np.abs(force - wanted).max() < 1e-13 * np.abs(wanted).max()

    @pytest.mark.parametrize("law", ["svk", "printed"])
    @pytest.mark.parametrize("degrees", RIGID)
    @pytest.mark.parametrize(("order", "across"), KINDS)
    def test_a_rigid_motion_needs_no_force(self, order, across, degrees, law):
        """Truth: zero, measured against the stiffness; also for the printed law, whose E vanishes too."""
        model = strip(order, across, law=law)
        force, k = model.force_and_tangent(rigid(model, degrees))
        assert np.abs(force).max() < 1e-14 * np.abs(k.diagonal()).max()

    @pytest.mark.parametrize("degrees", [0.0, 90.0, 180.0])
    def test_unknowns_of_a_turned_strip(self, degrees):
        """``unknowns_of`` of a rigid motion is that motion, on a straight mesh."""
        model = strip(2, 2, distorted=False)
        q = rigid(model, degrees)
        angle = np.full(len(model.s), np.radians(degrees))
        np.testing.assert_allclose(model.unknowns_of(model.mid_surface(q), angle), q, atol=1e-14)


def bending_energy(across: int, turn: float) -> float:
    """Energy of pure bending with ``turn`` = kappa h, over that of the stiffness one; the thickness gives as it may."""
    model = Reference.of(0.06, 1.0, nu=0.0, elements=3, across=across)
    s, y = model.basis.doflocs
    out = np.stack([np.sin(turn * s), np.cos(turn * s)])
    circle = interpolant(model, out * (1.0 / turn + y) - np.stack([s, y + 1.0 / turn]))
    levels = np.unique(np.round(y, 9))
    thicker = np.array([interpolant(model, turn * out * np.isclose(y, level)) for level in levels])

    def energy(by: np.ndarray) -> float:
        return model.energy(circle + by @ thicker) / (0.06 * 0.5 * turn**2)

    return float(minimize(energy, np.zeros(len(levels)), tol=1e-12).fun)


def test_bending_stiffness_of_elements_across():
    """The thickness yields by a cubic, which n quadratic elements miss by (kappa h)^2 / 60 n^4: docs/hard-cases.md."""
    turn = 0.1
    one, two = (bending_energy(across, turn) for across in (1, 2))
    assert (one - two) / turn**2 == pytest.approx((1.0 - 1.0 / 16.0) / 60.0, rel=0.02)


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

    def test_a_distorted_strip_weighs_its_area(self):
        """Truth: half as long again in the reference configuration is half as heavy again."""
        model = Reference.of(LENGTH, THICKNESS, elements=ELEMENTS, distort=lambda p: p * [[1.5], [1.0]])
        up = np.zeros(model.size)
        up[model.middle[:, 1]] = 1.0
        assert model.weight @ up == pytest.approx(1.5 * LENGTH, rel=1e-14)
        assert up @ (model.mass @ up) == pytest.approx(1.5 * LENGTH, rel=1e-14)

    @pytest.mark.parametrize("across", [1, 2])
    @pytest.mark.parametrize("powers", [(0, 0), (1, 0), (0, 1), (0, 2), (1, 1), (2, 0), (1, 2)])
    def test_exact_products(self, powers, across):
        """Order 2: the mass between a field X^m Z^n and another is the exact integral.

        Truth: integrals of monomials.  With the two Gauss points along the strip that the stress has, X^4 is not.
        """
        model = strip(2, across, distorted=False)
        x, z = model.basis.doflocs
        zero = np.zeros_like(x)

        def integral(m: int, n: int) -> float:
            moments = [
                0.0 if k % 2 else (size / 2.0) ** (k + 1) * 2.0 / (k + 1) for k, size in ((m, LENGTH), (n, THICKNESS))
            ]
            return moments[0] * moments[1] / THICKNESS

        m, n = powers
        field = interpolant(model, np.stack([zero, x**m * z**n]))
        for i, j in ((0, 0), (1, 0), (0, 1), (2, 0)):
            other = interpolant(model, np.stack([zero, x**i * z**j]))
            assert field @ (model.mass @ other) == pytest.approx(integral(m + i, n + j), abs=1e-14)
        assert model.weight @ field == pytest.approx(integral(m, n), abs=1e-14)

    @pytest.mark.parametrize(("order", "across"), KINDS)
    def test_no_motion_without_mass(self, order, across):
        """With too few points along an element a pattern of alternating nodes would have no mass."""
        model = strip(order, across, distorted=False)
        mass = model.mass.to_sparse().toarray()
        scale = np.sqrt(np.diag(mass))
        assert np.linalg.eigvalsh(mass / np.outer(scale, scale)).min() > 0.02

    @pytest.mark.parametrize(("order", "across"), KINDS)
    def test_turning_inertia(self, order, across):
        """Truth: L (L^2 + h^2) / 12 about the middle."""
        model = strip(order, across, distorted=False)
        x, z = model.basis.doflocs
        turn = interpolant(model, np.stack([-z, x]))
        wanted = LENGTH * (LENGTH**2 + THICKNESS**2) / 12.0
        assert turn @ (model.mass @ turn) == pytest.approx(wanted, rel=1e-13)


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

    def test_the_printed_law_too(self):
        """Its force has a tangent, not symmetric; slope 2."""
        model = strip(2, 1, law="printed")
        rng = np.random.default_rng(2)
        q, dq = arc(model, 2.6) + 0.02 * rng.standard_normal(model.size), rng.standard_normal(model.size)
        force, k = model.force_and_tangent(q)
        remainders = [np.abs(model.internal_force(q + t * dq) - force - t * (k @ dq)).max() for t in self.STEPS]
        slopes = np.log2(np.divide(remainders[:-1], remainders[1:]))
        print("slopes", slopes)
        assert slopes[-1] == pytest.approx(2.0, abs=0.05)
        assert remainders[-1] < 1e-4 * np.abs(k @ dq).max()
        dense = k.to_sparse().toarray()
        assert np.abs(dense - dense.T).max() > 1e-3 * np.abs(dense).max()

    def test_predicted_stress(self):
        """``predict_stress(q, dq)`` is the stress at q + dq up to dq^2, and the own stress for dq = 0."""
        model = strip(2, 1)
        rng = np.random.default_rng(4)
        q, dq, zero = arc(model, 2.6), rng.standard_normal(model.size), np.zeros(model.size)
        remainders = [
            np.abs(model.predict_stress(q, t * dq) - model.predict_stress(q + t * dq, zero)).max() for t in self.STEPS
        ]
        slopes = np.log2(np.divide(remainders[:-1], remainders[1:]))
        print("slopes", slopes)
        assert slopes[-1] == pytest.approx(2.0, abs=0.05)
        own = model.force_and_tangent(q, model.predict_stress(q, zero))[1].flat
        plain = model.force_and_tangent(q)[1].flat
        assert np.abs(own - plain).max() < 1e-14 * np.abs(plain).max()


class TestMesh:
    """Numbering and geometry of the strip's mesh."""

    @pytest.mark.parametrize(("order", "across"), KINDS)
    def test_columns_and_middle(self, order, across):
        """Columns run from the grasped to the held end, nodes upwards; the middle row lies at z = 0."""
        mesh = strip(order, across, distorted=False)
        x, z = (a[mesh.nodal_of[mesh.unknowns[:, :, 0]]] for a in mesh.basis.doflocs)
        wanted = ELEMENTS if order == 1 else np.sort(np.r_[ELEMENTS, (ELEMENTS[1:] + ELEMENTS[:-1]) / 2.0])
        np.testing.assert_allclose(mesh.s, wanted, atol=1e-14)
        np.testing.assert_allclose(x, np.broadcast_to(mesh.s[:, None] - LENGTH / 2.0, x.shape), atol=1e-14)
        across_ = np.linspace(-0.5, 0.5, order * across + 1) * THICKNESS
        np.testing.assert_allclose(z, np.broadcast_to(across_, z.shape), atol=1e-14)
        np.testing.assert_array_equal(np.sort(mesh.unknowns.ravel()), np.arange(mesh.size))
        np.testing.assert_array_equal(mesh.middle, mesh.unknowns[:, order * across // 2])

    @pytest.mark.parametrize(("order", "across"), KINDS)
    def test_nodal_displacements(self, order, across):
        """They undo :func:`interpolant`."""
        model = strip(order, across)
        field = np.random.default_rng(1).standard_normal(model.basis.doflocs.shape)
        nodal = model.transformation @ interpolant(model, field)
        for component in (0, 1):
            own = model.nodal_of[model.unknowns[:, :, component]].ravel()
            np.testing.assert_allclose(nodal[own], field[component][own], atol=1e-14)
