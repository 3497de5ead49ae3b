"""A bending law that is not linear, on rod and solid, against the elastica with that law."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold.base.errors import InvalidInputError
from stripfold.strip.effects import BendingLaw, Hysteresis, MomentCurvature, split_loop
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid

ROD, SOLID = Rod.of(4.0, 0.05, elements=8), Solid.of(4.0, 0.05, elements=8)


def random_shape(model, seed=3):
    rng = np.random.default_rng(seed)
    angle = np.cumsum(rng.normal(0.0, 0.2, len(model.s)))
    steps = np.diff(model.s)[:, None] * np.stack([np.cos(angle[1:]), np.sin(angle[1:])], axis=1)
    q = model.unknowns_of(np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), angle)
    return q + rng.normal(0.0, 1e-3, model.size)


class TestTable:
    LAW = MomentCurvature(np.array([0.2, 1.0, 3.0]), np.array([2.0, 2.4, 2.7]))

    def test_goes_through_its_rows_and_is_odd(self):
        kappa = np.array([-3.0, -1.0, -0.2, 0.0, 0.2, 1.0, 3.0])
        np.testing.assert_allclose(self.LAW.moment(kappa), [-2.7, -2.4, -2.0, 0.0, 2.0, 2.4, 2.7], atol=1e-15)

    def test_monotone_also_beyond_its_rows(self):
        kappa = np.linspace(-5.0, 5.0, 1001)
        assert np.all(np.diff(self.LAW.moment(kappa)) > 0.0)
        assert np.all(self.LAW.tangent(kappa) > 0.0)

    def test_derivatives(self):
        kappa, d = np.linspace(-4.0, 4.0, 41) + 0.01, 1e-6
        for value, rate in ((self.LAW.energy, self.LAW.moment), (self.LAW.moment, self.LAW.tangent)):
            np.testing.assert_allclose((value(kappa + d) - value(kappa - d)) / (2.0 * d), rate(kappa), rtol=1e-5)
        assert self.LAW.energy(np.zeros(1)) == 0.0

    @pytest.mark.parametrize("moment", [[1.0, 0.9], [-1.0, 1.0], [1.0, np.nan], [0.0, 1.0]])
    def test_refuses_what_is_no_law(self, moment):
        with pytest.raises(InvalidInputError):
            MomentCurvature(np.array([1.0, 2.0]), np.array(moment))


@pytest.mark.parametrize("model", [ROD, SOLID])
def test_force_is_the_derivative_of_the_energy_and_tangent_that_of_the_force(model):
    effect = BendingLaw.of(model, TestTable.LAW)
    q, d = random_shape(model), 1e-6
    v = np.random.default_rng(5).normal(size=model.size)
    force, tangent = effect.force_and_tangent(q)
    np.testing.assert_allclose(effect.force(q), force, atol=1e-12)
    ahead, back = (effect.stored(q + s * d * v) for s in (1.0, -1.0))
    assert force @ v == pytest.approx((ahead - back) / (2.0 * d), rel=1e-6)
    difference = (effect.force(q + d * v) - effect.force(q - d * v)) / (2.0 * d)
    np.testing.assert_allclose(tangent @ v, difference, rtol=1e-4, atol=1e-4 * np.abs(difference).max())


def test_loading_and_unloading_are_a_law_and_friction():
    """A strip bent to a circle and back has the moments of the loop that was split, element by element."""
    kappa = np.linspace(0.1, 2.0, 20)
    mean, half = np.arcsinh(3.0 * kappa), 0.4
    law, friction = split_loop(kappa, mean + half, mean - half)
    assert friction == pytest.approx(half, rel=1e-12)
    model = Rod.of(1.0, 0.01, elements=4)

    def circle(bend):
        angle = bend * model.s
        return model.unknowns_of(np.stack([np.sin(angle), 1.0 - np.cos(angle)], axis=1) / bend, angle)

    effect, hysteresis = BendingLaw.of(model, law), Hysteresis.of(model, friction, yield_curvature=0.05)
    moments = {}
    for way, bends in (("loading", kappa), ("unloading", kappa[::-1][1:])):
        for bend in bends:
            moments[way, bend] = effect.moments(circle(bend)) + hysteresis.moments(circle(bend))
            hysteresis = hysteresis.committed(circle(bend), np.zeros_like)
    for i, bend in enumerate(kappa[1:-1], 1):
        np.testing.assert_allclose(moments["loading", bend], mean[i] + half, rtol=1e-6)
        np.testing.assert_allclose(moments["unloading", bend], mean[i] - half, rtol=1e-6)


def test_a_loop_that_gains_energy_is_refused():
    kappa = np.array([1.0, 2.0])
    with pytest.raises(InvalidInputError):
        split_loop(kappa, kappa, kappa + 0.5)
