"""The solid on finer meshes and thinner strips: a manufactured solution, bending without locking, and the elastica."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import jv

from oracles.held_solid import HeldSolid, arc, clamped, column, interpolant
from stripfold import elastica
from stripfold.solve import newton
from stripfold.strip.problem import AlongX, StripProblem
from stripfold.strip.reference import Reference
from stripfold.strip.solid import Solid

LENGTH, THICKNESS, NU = 2.0, 0.5, 0.3


def field(order: int, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """A smooth displacement, linear across the strip: a(x) + z b(x); for order 1 with b constant.

    Across the strip the elements have it exactly, so refining along the strip alone must converge.
    """
    a = np.stack([0.1 * np.sin(1.3 * x), 0.25 * np.cos(2.0 * x)])
    b = np.stack([0.3 * np.sin(x + 0.3), 0.15 * np.cos(1.7 * x)])
    if order == 1:
        b = np.stack([0.2 + 0.0 * x, -0.1 + 0.0 * x])
    return a + z * b


def exact_gradient(order: int, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """du_i/dX_j of :func:`field` by complex steps, exact to rounding; shape (2, 2, ...)."""
    step = 1e-30
    along = field(order, x + 1j * step, z + 0j).imag / step
    across = field(order, x + 0j, z + 1j * step).imag / step
    return np.stack([along, across], axis=1)


def manufactured(order: int, elements: int) -> tuple[float, float]:
    """Errors in the L2 and the energy-like H1 norm on a mesh with elements of alternating size."""
    sizes = np.tile([1.0, 1.3], elements // 2)
    boundaries = np.concatenate([[0.0], np.cumsum(sizes)]) * (LENGTH / sizes.sum())
    model = Reference.of(LENGTH, THICKNESS, nu=NU, order=order, elements=boundaries, across=2 if order == 1 else 1)
    fine = skfem.Basis(model.basis.mesh, model.basis.elem, intorder=12)
    lam, mu = model.lame

    @skfem.LinearForm
    def load(v, w):
        # Integral of P : grad v = body force and tractions of the exact field, as v vanishes at the ends.
        f = np.eye(2)[:, :, None, None] + exact_gradient(order, *w.x)
        e = 0.5 * (np.einsum("kiab,kjab->ijab", f, f) - np.eye(2)[:, :, None, None])
        s = 2.0 * mu * e + lam * (e[0, 0] + e[1, 1]) * np.eye(2)[:, :, None, None]
        return np.einsum("ikab,kjab,ijab->ab", f, s, v.grad)

    start = interpolant(model, field(order, *model.basis.doflocs))
    held = np.concatenate([column(model, 0), column(model, -1)])
    problem = HeldSolid(model, held, start[held], model.transformation.T @ load.assemble(fine))
    q = problem.solve(start, force_tolerance=1e-10).q
    u = fine.interpolate(model.transformation @ q)
    x, z = (np.asarray(c) for c in fine.global_coordinates())
    value, gradient = np.asarray(u.value) - field(order, x, z), np.asarray(u.grad) - exact_gradient(order, x, z)
    return tuple(float(np.sqrt(np.sum(d**2 * fine.dx))) for d in (value, gradient))


@pytest.mark.parametrize(("order", "ceiling"), [(1, (2e-3, 6e-2)), (2, (5e-6, 6e-4))])
def test_manufactured_solution(order, ceiling):
    """Truth: a displacement with strains of 50 %, nu = 0.3, all faces loaded; rates k + 1 in L2 and k in H1."""
    sizes = (8, 16, 32)
    errors = np.array([manufactured(order, n) for n in sizes])
    rates = np.log2(errors[:-1] / errors[1:])
    print("errors", errors, "rates", rates)
    assert np.all(rates[-1] > [order + 0.9, order - 0.1])
    assert np.all(errors[-1] < ceiling)


def half_circle(order: int, elements: int, thickness: float, nu: float = 0.0) -> tuple[float, float]:
    """Energy and moment at the clamp of a strip of length 1, both ends clamped where a half circle has them."""
    solid = Solid.of(1.0, thickness, nu=nu, elements=elements)
    model = solid if order == 2 else Reference.of(1.0, thickness, nu=nu, order=1, elements=elements, across=2)
    problem = clamped(model, arc(model, np.pi), 0, -1, load=np.zeros(model.size))
    # Rounding of a unit displacement gradient, times the membrane stiffness 12 / h^2.
    q = problem.solve(arc(model, np.pi), force_tolerance=1e-8 + 1e-12 / thickness**2).q
    reaction = problem.residual(q, 1.0)[model.unknowns[0, :, 0]]
    return model.energy(q), float(np.linspace(-0.5, 0.5, len(reaction)) @ reaction)


@pytest.mark.parametrize(("order", "rate", "ceiling"), [(1, 2.0, 3e-2), (2, 4.0, 1e-4)])
def test_bending_does_not_lock(order, rate, ceiling):
    """Truth: bending stiffness 1, so a half circle of length 1 has energy pi^2 / 2 and moment pi.

    With eight elements the error of the mesh (to 64 elements, which takes out the thickness's own effect) is the same
    from h = 1e-2 to 1e-4: an element that locks would have it grow as 1/h^2.  The rate is that of beam elements.
    """
    thicknesses = (1e-2, 1e-3, 1e-4) if order == 2 else (2e-2, 1e-2, 5e-3)
    energies = {h: [half_circle(order, n, h)[0] for n in (8, 16, 64)] for h in thicknesses}
    errors = {h: np.subtract(e[:2], e[2]) / (np.pi**2 / 2.0) for h, e in energies.items()}
    for h, error in errors.items():
        observed = np.log2(error[0] / error[1])
        print(f"h = {h:.0e}: errors {error}, rate {observed:.2f}")
        assert error[0] == pytest.approx(errors[thicknesses[-1]][0], rel=0.05)
        assert observed > rate - 0.15
        assert error[0] < ceiling
    energy, moment = half_circle(2, 64, 1e-4)
    assert energy == pytest.approx(np.pi**2 / 2.0, rel=1e-7)
    assert moment == pytest.approx(np.pi, rel=1e-7)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_poisson_does_not_change_bending(nu):
    """Truth: with E = 12 (1 - nu^2) / h^3 the bending stiffness is 1 for every nu, energy pi^2 / 2.

    Needs a section free to widen on one side and to narrow on the other: what quadratic elements are for.
    """
    energy, moment = half_circle(2, 32, 1e-3, nu)
    print(f"energy {energy / (np.pi**2 / 2.0) - 1.0:.1e}, moment {moment / np.pi - 1.0:.1e}")
    assert energy == pytest.approx(np.pi**2 / 2.0, rel=5e-4)
    assert moment == pytest.approx(np.pi, rel=5e-3)


def column_buckling_length() -> float:
    """Height in L* at which a column, clamped below and free above, buckles under its own weight."""
    root = brentq(lambda x: jv(-1.0 / 3.0, x), 1.0, 2.5, xtol=1e-14)
    return float((2.25 * root**2) ** (1 / 3))


def check_orders(thickness: tuple[float, ...], errors: np.ndarray, order: float, slack: float) -> None:
    """Print and check the observed orders of ``errors``, one row per thickness."""
    ratio = np.log2(np.divide(thickness[:-1], thickness[1:]))[:, None]
    rates = np.log2(np.abs(errors[:-1] / errors[1:])) / ratio
    print("h", thickness, "\nerrors\n", errors, "\nrates\n", rates)
    assert rates == pytest.approx(order, abs=slack)


def hanging(length: float, thickness: float, elements: int) -> np.ndarray:
    """Mid-surface of a strip clamped horizontally at one end, started from the straight strip."""
    model = Solid.of(length, thickness, elements=elements)
    flat = np.zeros(model.size)
    return model.mid_surface(clamped(model, flat, 0).solve(flat).q)


def test_cantilever():
    """Truth: the strip of Peirce's test: its chord points 41.5 degrees down at the length 2.000350."""
    length = 2.000350
    assert np.degrees(elastica.cantilever(length).droop_angle) == pytest.approx(41.5, abs=1e-4)
    thickness = (0.1, 0.05, 0.025)
    errors = []
    for h in thickness:
        x = hanging(length, h, 40)
        chord = x[-1] - x[0]
        truth = elastica.cantilever(length).at(np.linspace(0.0, length, len(x)))
        shape = np.hypot(x[:, 0] + length / 2.0 - truth.x, x[:, 1] - truth.z).max()
        errors.append([np.degrees(np.arctan2(-chord[1], chord[0])) - 41.5, shape])
    check_orders(thickness, np.array(errors), 2.0, 0.05)
    assert np.all(np.abs(errors[-1]) < [0.012, 4e-4])


def upright(length: float, thickness: float) -> tuple[float, int, np.ndarray]:
    """Smallest eigenvalue, number of negative ones and mode of a strip that stands on a clamp under its weight."""
    model = Solid.of(length, thickness, elements=16)
    start = model.unknowns_of(np.stack([0.0 * model.s, model.s], axis=1), np.full(len(model.s), np.pi / 2.0))
    problem = clamped(model, start, 0)
    q = problem.solve(start).q
    x = model.mid_surface(q)
    # It still stands straight, shortened by l^2 h^2 / 24 under its weight.
    assert np.abs(x[:, 0]).max() < 1e-6
    assert length - x[-1, 1] == pytest.approx(length**2 * thickness**2 / 24.0, rel=0.02)
    values, mode, negatives = problem.stability(q)
    return float(values[0]), negatives, mode[model.middle]


def test_self_buckling():
    """Truth: a column buckles under its own weight at 1.986353 (Greenhill); there the tangent loses an eigenvalue.

    The straight state is computed past it too; eigenvalue and inertia must change at the same length.
    """
    exact = column_buckling_length()
    assert exact == pytest.approx(1.986353, abs=1e-6)
    thickness = (0.2, 0.1, 0.05)
    errors = []
    for h in thickness:
        found = brentq(lambda length, h=h: upright(length, h)[0], 1.9, 2.1, xtol=1e-9)
        below, above = upright(found - 1e-6, h), upright(found + 1e-6, h)
        assert below[0] > 0.0 > above[0]
        assert (below[1], above[1]) == (0, 1)
        # The mode bends to one side, more and more towards the top, and does not compress.
        side, along = above[2].T
        assert np.all(np.diff(np.abs(side)) > 0.0)
        assert np.abs(along).max() < 1e-6 * np.abs(side).max()
        errors.append([found - exact])
    check_orders(thickness, np.array(errors), 2.0, 0.05)
    assert abs(errors[-1][0]) < 1e-3


def folded(thickness: float, element: float) -> dict[str, float]:
    """Errors of the folded loop: gripper held at the landing place, floor under all of it."""
    loop, lying = elastica.folded_loop(), 2.0
    length = loop.arc + lying
    counts = round(loop.arc / element), round(lying / element)
    boundaries = np.concatenate(
        [np.linspace(0.0, loop.arc, counts[0] + 1), np.linspace(loop.arc, length, counts[1] + 1)[1:]]
    )
    model = Solid.of(length, thickness, elements=boundaries)
    s = model.s
    free = s < loop.arc
    truth = loop.state.at(np.clip(loop.arc - s, 0.0, loop.arc))
    lift_off = length / 2.0 - lying
    position = np.stack(
        [np.where(free, lift_off - truth.x, s - length / 2.0), np.where(free, np.maximum(truth.z, 0.0), 0.0)], axis=1
    )
    problem = StripProblem(model, AlongX(0.0))
    landing_place = lift_off + loop.offset + length / 2.0
    q = newton.solve(
        problem,
        model.unknowns_of(position, np.where(free, -truth.theta, 0.0)),
        landing_place,
        model.middle[~free, 1][:-1],
        options=newton.NewtonOptions(max_iterations=60),
    ).q
    x = model.mid_surface(q)
    assert x[:, 1].min() >= -1e-12
    force = problem.residual(q, landing_place)
    vertical, weight = force[model.middle[:, 1]], model.weight[model.middle[:, 1]]
    top = CubicSpline(s, x[:, 1])(np.linspace(0.0, loop.arc, 20001)).max()
    # Concentrated at either end, whether a gripper or nodes of the floor carry it; behind lift-off the floor carries
    # the strip's own weight besides.
    landing, behind = s < loop.arc / 2.0, s < loop.arc + 1.0
    lifting = vertical[behind & ~landing].sum() - (weight[behind].sum() - loop.arc)
    section = q[model.unknowns[0, -1]] - q[model.unknowns[0, 0]]
    return {
        "height": top - loop.height,
        "landing": vertical[landing].sum() - loop.landing_reaction,
        "lift-off": lifting - loop.lift_off_reaction,
        "horizontal": force[model.middle[0, 0]],
        "angle": abs(np.degrees(np.arctan2(-section[0], 1.0 + section[1]))) - 180.0,
    }


def test_folded_loop():
    """Truth: height 0.906597, lift-off reaction 3.745005, landing reaction 0.938465, no horizontal force, theta = pi.

    With the gripper, a hinge, held at the landing place 2.484620 behind lift-off the strip must find all of these.
    """
    thickness = (0.1, 0.05, 0.025)
    found = [folded(h, 0.025) for h in thickness]
    errors = np.array([[f[key] for key in ("height", "landing", "lift-off")] for f in found])
    check_orders(thickness, errors, 2.0, 0.1)
    for h, f in zip(thickness, found, strict=True):
        assert max(abs(f[key]) for key in ("height", "landing", "lift-off")) < 2.6 * h**2
        # What the floor's nodes leave: its reaction cannot sit between two of them.
        assert abs(f["horizontal"]) < 3e-4
        assert abs(f["angle"]) < 0.05
