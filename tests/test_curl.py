"""A strip that is curled without forces: derivatives, a shooting method as oracle, falls, what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve, minimize_scalar

import stripfold as sf
from stripfold.follow.statics import StripModel, solve_height
from stripfold.follow.track import End
from stripfold.strip.model import Model
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid

ENDS = np.array([0.0, 0.2, 0.5, 0.6, 1.0, 1.3, 1.7, 2.0])
MODELS = [Rod.of(2.0, 0.1, elements=ENDS, curl=-0.7), Solid.of(2.0, 0.1, nu=0.3, elements=ENDS, curl=-0.7)]


@pytest.fixture(params=MODELS, ids=["rod", "solid"])
def model(request: pytest.FixtureRequest) -> Model:
    return request.param


class TestDerivatives:
    def test_by_the_unknowns(self, model: Model) -> None:
        q, step = 0.1 * np.random.default_rng(1).standard_normal(model.size), 1e-5
        force, tangent = model.force_and_tangent(q)
        for way in np.random.default_rng(2).standard_normal((3, model.size)):
            ahead, back = q + step * way, q - step * way
            slope = (model.energy(ahead) - model.energy(back)) / (2.0 * step)
            assert force @ way == pytest.approx(slope, rel=1e-7)
            rate = (model.internal_force(ahead) - model.internal_force(back)) / (2.0 * step)
            np.testing.assert_allclose(tangent @ way, rate, rtol=0.0, atol=1e-7 * np.abs(rate).max())

    def test_by_the_lengths(self, model: Model) -> None:
        rng, step = np.random.default_rng(3), 1e-5
        q, growth = 0.1 * rng.standard_normal(model.size), rng.standard_normal((1, len(ENDS) - 1))
        *_, columns = model.force_and_derivatives(q, growth)

        def force(factor: float) -> np.ndarray:
            return model.with_lengths(model.lengths * (1.0 + factor * growth[0])).internal_force(q)

        rate = (force(step) - force(-step)) / (2.0 * step)
        np.testing.assert_allclose(columns[:, 0], rate, rtol=0.0, atol=1e-7 * np.abs(rate).max())

    def test_the_work_of_a_step_in_time_is_the_gain(self, model: Model) -> None:
        q0, q1 = 0.1 * np.random.default_rng(4).standard_normal((2, model.size))
        force, _ = model.force_over_step(q0, q1, 0.0)
        assert force @ (q1 - q0) == pytest.approx(model.energy(q1) - model.energy(q0), rel=1e-12)

    def test_the_flat_strip_is_bent_by_its_curl(self, model: Model) -> None:
        """Moments of -curl at its ends hold it flat."""
        turn = model.directors.unknowns, model.directors.factor, int(model.slopes is not None)
        force, moments = model.internal_force(np.zeros(model.size)), []
        for element, end in ((0, 0), (-1, 1)):
            unknowns, factor = turn[0][element, end, :, turn[2]], turn[1][element, end]
            # A section that turns moves its director by (0, 1) or (-1, 0).
            moments.append((1.0 if turn[2] else -1.0) * factor @ force[unknowns] / (factor @ factor))
        np.testing.assert_allclose(moments, [model.curl, -model.curl], rtol=1e-12)


OTHERS = [("rod", 0.3), ("rod", -0.15), ("solid", -0.15)]


def shot(length: float, height: float, curl: float, guess: np.ndarray) -> tuple[np.ndarray, float]:
    """Force at the lift-off of a raised part of this length, whose end has the curvature ``curl``; and its advance."""

    def end(force: np.ndarray) -> np.ndarray:
        def rates(s: float, y: np.ndarray) -> list[float]:
            _, _, angle, curvature = y
            return [np.cos(angle), np.sin(angle), curvature, force[0] * np.sin(angle) - (force[1] + s) * np.cos(angle)]

        return solve_ivp(rates, (0.0, length), np.zeros(4), rtol=1e-10, atol=1e-11).y[:, -1]

    def missed(force: np.ndarray) -> np.ndarray:
        _, z, _, curvature = end(force)
        return np.array([z - height, curvature - curl])

    force, _, found, _ = fsolve(missed, guess, full_output=True, xtol=1e-11)
    assert found == 1
    return force, length - end(force)[0]


def critical(height: float, curl: float) -> float:
    """Largest advance over lengths of the raised part."""
    known = sf.elastica.critical(height).state
    near = shot(known.length, height, 0.0, np.array([known.force_x, known.force_0]))[0]
    for part in np.linspace(0.0, curl, 5)[1:]:
        near = shot(known.length, height, float(part), near)[0]
    best = minimize_scalar(
        lambda length: -shot(length, height, curl, near)[1],
        bounds=(known.length - 0.4, known.length + 0.4),
        method="bounded",
        options={"xatol": 1e-5},
    )
    return float(-best.fun)


@pytest.mark.parametrize(
    ("kind", "curl"),
    [("solid", 0.3), *(pytest.param(*case, marks=pytest.mark.slow) for case in OTHERS)],
)
def test_lambda_c_is_shifted_as_an_elasticas(kind: str, curl: float) -> None:
    """By 0.14 and by -0.06 L*, of which no mesh and no stretch takes more than 2e-4."""
    flat, curled = (solve_height(StripModel(14.0, 0.01, kind=kind, curl=of), 3.0) for of in (0.0, curl))
    assert curled.end is End.SNAP
    shift = curled.events[0].travelled - flat.events[0].travelled
    assert shift == pytest.approx(critical(3.0, curl) - sf.elastica.critical(3.0).state.advance, abs=2e-4)


def test_a_curl_makes_or_prevents_a_snap() -> None:
    """Slightly above the limit of the touch; 1/m."""
    strip = sf.Strip(length=0.5, eta_b=3770)
    ends = {curl: strip.critical(0.052, model="rod", curl=curl).snap for curl in (-10.0, 0.0, 10.0)}
    assert ends == {-10.0: False, 0.0: True, 10.0: True}


@pytest.mark.slow
def test_a_path_and_its_falls_by_both_models() -> None:
    """On an R-path a strip that curls up touches where one that does not is planned to."""
    strip = sf.Strip(length=0.45, eta_b=3770)
    path = sf.paths.r_path(strip)
    rods = {curl: strip.assess(path, model="rod", fall=True, curl=curl) for curl in (0.0, 5.0, -12.0)}
    for curl, touch in ((5.0, 0.0778), (-12.0, 0.0985)):
        assert rods[curl].folded
        assert len(rods[curl].critical) == 1
        assert rods[curl].touch_x == pytest.approx(touch, abs=5e-4)
        assert abs(rods[curl].touch_x - rods[0.0].touch_x) > 5e-3
    solid = strip.assess(path, model="solid", fall=True, curl=-12.0)
    assert solid.folded
    assert len(solid.critical) == 1
    assert solid.touch_x == pytest.approx(rods[-12.0].touch_x, abs=2e-4)


def test_a_collapse_is_the_critical_points(tmp_path: Any) -> None:
    strip = sf.Strip(length=0.45, eta_b=3770)
    fall = strip.collapse(0.09, model="rod", curl=5.0, release={"until": "touch"})
    found = strip.critical(0.09, model="rod", curl=5.0)
    assert fall.lambda_c == pytest.approx(found.lambda_c, abs=2e-5)
    assert fall.lambda_c > strip.critical(0.09, model="rod").lambda_c + 1e-3


@pytest.mark.slow
def test_a_plan_follows_the_curled_strip_and_knows_no_margin() -> None:
    strip = sf.Strip(length=0.26, eta_b=3770)
    found = strip.plan(eta_b_uncertainty=0.0, curl=4.0, cores=1)
    followed = {outcome.name: outcome for outcome in found.outcomes}["triangular"]
    (verdict,) = followed.verdicts
    alone = strip.assess(sf.paths.triangular(strip), model="rod", fall=True, curl=4.0)
    assert verdict.touch_x == pytest.approx(alone.touch_x, abs=1e-9)
    assert np.isnan(found.margin)
    with pytest.raises(sf.NoPathError, match="snaps is not known"):
        strip.plan(eta_b_uncertainty=0.0, curl=4.0, margin=0.001)
    with pytest.raises(sf.InvalidInputError, match="no curl together with friction_moment"):
        strip.plan(curl=4.0, friction_moment=1e-4)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"curl": 20.0}, r"curl = 20\.0 cannot be used; allowed: from -16\.7 to 16\.7 1/m"),
        ({"curl": 1.0, "model": "elastica"}, "solid or rod together with curl"),
        ({"curl": 1.0, "model": "auto"}, "solid or rod together with curl"),
        ({"curl": 1.0, "law": "printed"}, "svk together with curl"),
        ({"curl": 1.0, "second_gripper": 0.1}, "no curl together with second_gripper"),
        ({"curl": 1.0, "eta_b_uncertainty": 0.1}, "no curl together with eta_b_uncertainty"),
    ],
)
def test_what_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(sf.InvalidInputError, match=words):
        sf.Strip(length=0.5, eta_b=3770).critical(0.09, **given)
