"""The solid: its laws at a point, scikit-fem forms of the same formulas, and its elements by patch tests and modes."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from skfem.helpers import dot, mul

from oracles.held_solid import HeldSolid, arc, column, interpolant
from stripfold.follow.statics import StripModel, solve_height
from stripfold.strip.reference import LAWS, Reference, c_of, product, second_piola, second_piola_rate
from stripfold.strip.solid import Solid

RNG = np.random.default_rng(7)
F = np.eye(2)[:, :, None] + 0.4 * RNG.standard_normal((2, 2, 5))
DF = RNG.standard_normal((2, 2, 5))
STEPS = 2.0 ** -np.arange(6, 12)
ELEMENTS = np.array([0.0, 0.4, 0.7, 1.3, 1.9, 2.4])


def lame(young: float, nu: float) -> dict[str, float]:
    """The Lame parameters, of a solid whose thickness gives it this Young's modulus."""
    lam, mu = Solid.of(1.0, (12.0 * (1.0 - nu**2) / young) ** (1.0 / 3.0), nu=nu).lame
    return {"lam": lam, "mu": mu}


def first_piola(law: str, f: np.ndarray, w: dict[str, float]) -> np.ndarray:
    return product(f, second_piola(f, w, law))


def rotation(degrees: float) -> np.ndarray:
    """Rotation matrix, as a field of one point."""
    a = np.radians(degrees)
    return np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])


def slopes(remainders: np.ndarray) -> np.ndarray:
    """Observed orders between successive halvings of the step."""
    return np.log2(remainders[:-1] / remainders[1:])


@pytest.mark.parametrize("nu", [0.0, 0.3])
@pytest.mark.parametrize("law", LAWS)
def test_stress_and_its_rate(law, nu):
    """Taylor: the remainder has slope 2."""
    w = lame(1.7, nu)
    rate = product(DF, second_piola(F, w, law)) + product(F, second_piola_rate(F, DF, w, law))
    here = first_piola(law, F, w)
    remainder = np.array([np.abs(first_piola(law, F + t * DF, w) - here - t * rate).max() for t in STEPS])
    assert np.log2(remainder[:-1] / remainder[1:]) == pytest.approx(2.0, abs=0.1)
    assert remainder[-1] < 1e-5


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("degrees", [37.0, 90.0, 180.0, -123.0])
def test_a_rotation_leaves_no_stress(law, degrees):
    """Truth: E = 0 under a rotation, so both laws (also the printed one) give zero."""
    assert np.abs(first_piola(law, rotation(degrees), lame(1.7, 0.3))).max() < 2e-15


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.45])
def test_lame_parameters_give_the_papers_matrix(nu):
    """Truth: the paper's matrix D, plane strain, in Voigt's order (11, 22, 12) with the doubled shear strain."""
    young = 2.5
    d = np.array([[1 - nu, nu, 0], [nu, 1 - nu, 0], [0, 0, (1 - 2 * nu) / 2]])
    d *= young / ((1 + nu) * (1 - 2 * nu))
    for e11, e22, g12 in np.eye(3):
        s = c_of(np.array([[e11, g12 / 2], [g12 / 2, e22]])[:, :, None], lame(young, nu))[:, :, 0]
        np.testing.assert_allclose([s[0, 0], s[1, 1], s[0, 1]], d @ [e11, e22, g12], atol=1e-13)
        assert s[0, 1] == s[1, 0]


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


LENGTH, THICKNESS = 2.4, 0.5
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


@pytest.mark.parametrize(
    ("stretch", "shear", "crushed"), [(0.64, 0.0, False), (0.62, 0.0, True), (1.0, 0.88, False), (1.0, 0.96, True)]
)
def test_a_state_is_admissible_down_to_a_principal_strain(stretch: float, shear: float, crushed: bool):
    """By hand: the least of a stretch is (s^2 - 1) / 2, that of a simple shear g/2 (g/2 - sqrt(1 + g^2 / 4))."""
    reference = Reference.of(2.0, 0.1, elements=6)
    x, z = reference.basis.doflocs
    q = interpolant(reference, np.stack([(stretch - 1.0) * x + shear * z, 0.0 * z]))
    by_hand = 0.5 * (stretch**2 - 1.0) if not shear else 0.5 * shear * (0.5 * shear - np.sqrt(1.0 + 0.25 * shear**2))
    for model in (reference, Solid.of(2.0, 0.1, elements=6)):
        said = model.admissibility(q)
        assert ("crushed" in said) is crushed
        assert not said or f"its strain is {by_hand:.3g}," in said
