"""A static equilibrium of a strip on the floor with felupe: the paper's solid, from the flat strip on.

Biquadratic plane-strain elements, St Venant-Kirchhoff's law, the floor by felupe's own contact of points with a wall
(penalty).  felupe's Newton iteration takes whole steps; from the flat strip these are tens of strip lengths long, so it
is written out here with a cap on the step.
"""

import felupe as fem
import numpy as np
from _answer import answer
from scipy.sparse.linalg import spsolve

PENALTY = 1e6
"""Of the floor, weights per unit of length and penetration."""
BELOW = 1e-7
"""The wall's distance below the flat strip, which may not touch it at first, L*."""
CAP = 0.3
"""Largest change of a displacement in one iteration, L*."""
TOLERANCE = 1e-6
"""Of the displacements, L*."""
MOST = 80
"""Iterations of one step."""
STEPS = 10
"""Of the lift, and again of the advance."""


def two_by_three():
    """Gauss's rule with two points along the strip, where three would lock, and three across."""
    along, across = np.polynomial.legendre.leggauss(2), np.polynomial.legendre.leggauss(3)
    points = np.stack(np.meshgrid(along[0], across[0]), axis=-1).reshape(-1, 2)
    return fem.quadrature.Scheme(points, np.outer(across[1], along[1]).ravel())


def stress(x, modulus):
    """P = F S of St Venant and Kirchhoff, without Poisson's effect."""
    f, state = x[0], x[-1]
    return [np.einsum("iM...,MJ...->iJ...", f, modulus * strain(f)), state]


def elasticity(x, modulus):
    """dP/dF."""
    f, one = x[0], np.eye(3)
    geometric = np.einsum("ik,JL...->iJkL...", one, modulus * strain(f))
    material = np.einsum("iL...,kJ...->iJkL...", f, f) + np.einsum("JL,iM...,kM...->iJkL...", one, f, f)
    return [geometric + modulus / 2 * material]


def strain(f):
    return (np.einsum("kI...,kJ...->IJ...", f, f) - np.eye(3)[..., None, None]) / 2


def equilibrium(scene, elements):
    length, thickness = scene["length"], scene["thickness"]
    mesh = fem.Rectangle(b=(length, thickness), n=(elements + 1, 2))
    mesh.points[:, 1] -= thickness / 2
    mesh = mesh.convert(order=2, calc_points=True, calc_midfaces=True)
    middle = np.flatnonzero(np.abs(mesh.points[:, 1]) < 1e-9 * thickness)
    middle = middle[np.argsort(mesh.points[middle, 0])]
    mesh.add_points([0.0, -BELOW])
    mesh.points_without_cells = mesh.points_without_cells[:-1]
    region = fem.RegionBiQuadraticQuad(mesh, quadrature=two_by_three())
    displacement = fem.FieldPlaneStrain(region, dim=2)
    field = fem.FieldContainer([displacement])
    modulus = 12.0 / thickness**3
    solid = fem.SolidBody(fem.Material(stress, elasticity, modulus=modulus), field)
    weight = fem.SolidBodyForce(field, values=[0.0, -1.0 / thickness, 0.0])
    floor = fem.MultiPointContact(field, points=middle, centerpoint=-1, skip=(True, False), multiplier=PENALTY)
    items, at = [solid, weight, floor], displacement.values
    grasp, held, wall = 2 * middle[0], 2 * middle[-1], 2 * (mesh.npoints - 1)
    always = [held, held + 1, wall, wall + 1]
    iterations = 0
    for lift in np.linspace(0.0, scene["height"], STEPS + 1)[1:]:
        iterations += newton(items, field, at, {grasp + 1: lift}, always)
    start = at.ravel()[grasp]
    for advance in np.linspace(start, scene["lam"], STEPS + 1)[1:]:
        iterations += newton(items, field, at, {grasp: advance, grasp + 1: scene["height"]}, always)
    place = mesh.points[middle] + at[middle]
    return {"s": mesh.points[middle, 0].tolist(), "place": place.tolist(), "iterations": iterations}


def newton(items, field, at, given, always):
    u = at.ravel()
    moved = np.array(list(given))
    free = np.setdiff1d(np.arange(u.size), [*given, *always])
    for iteration in range(1, MOST + 1):
        solid, weight, floor = items
        # felupe's loads are assembled without their sign.
        force = (solid.assemble.vector(field) - weight.assemble.vector(field) + floor.assemble.vector(field)).toarray()[
            :, 0
        ]
        stiffness = (solid.assemble.matrix(field) + floor.assemble.matrix(field)).tocsr()
        du = np.zeros(u.size)
        du[moved] = np.array(list(given.values())) - u[moved]
        du[free] = spsolve(stiffness[free][:, free].tocsc(), -(force + stiffness @ du)[free])
        size = np.abs(du).max()
        u += du * min(1.0, CAP / size)
        if size < TOLERANCE:
            return iteration
    raise RuntimeError(f"no convergence in {MOST} iterations: {size:.1e}")


answer("felupe", {"equilibrium": equilibrium})
