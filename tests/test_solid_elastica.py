"""The solid against the heavy elastica, whose infinitely thin limit it must have: every error falls as h^2.

Truth: :mod:`stripfold.elastica`, collocation on the equation of an inextensible line (docs/physics.md, section 4).
Lengths in L*, forces in the weight of a length L*.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import jv

from oracles.held_solid import clamped
from stripfold import elastica
from stripfold.solve import newton
from stripfold.strip.problem import AlongX, StripProblem
from stripfold.strip.solid import Solid


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
