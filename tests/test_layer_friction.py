"""Friction between the layers and on the floor: a strip dragged, one that slides to rest, and a fold frozen in."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from stripfold.ask.inputs import Simulation
from stripfold.follow.track import End
from stripfold.solve import dynamics, newton
from stripfold.solve.dynamics import Moving, TimeEvent, TimeOptions
from stripfold.strip.layer_friction import SPRING, LayerFriction
from stripfold.strip.model import Model
from stripfold.strip.problem import AlongX, Opened, StripProblem
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid

LENGTH, THICKNESS, MU = 10.0, 0.1, 0.4


def lying(model: Model) -> StripProblem:
    """A strip that lies flat, with friction."""
    problem = StripProblem(model, AlongX(0.0))
    flat = np.zeros(model.size)
    friction = LayerFriction.of(model, MU, flat, problem.reaction)
    return replace(problem, effects=(friction,))


def dragged(advance: float, steps: int) -> tuple[StripProblem, np.ndarray, float]:
    """A strip whose grasped end is pulled away from the held one; the problem after it, its state and the force."""
    problem = lying(Rod.of(LENGTH, THICKNESS, elements=200))
    q, force = np.zeros(problem.size), 0.0
    for lam in np.linspace(0.0, -advance, steps + 1)[1:]:
        state = newton.solve(problem, q, float(lam), problem.bounded)
        q, force = state.q, -float(state.force[problem.model.middle[0, 0]])
        problem = problem.accepted(q)
    return problem, q, force


@dataclass(frozen=True)
class Loose(StripProblem):
    """A strip that nothing holds."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "prescribed", np.zeros(0, dtype=int))
        object.__setattr__(self, "bounded", np.sort(self.model.middle[:, 1]))
        object.__setattr__(self, "lower", np.zeros(len(self.bounded)))

    def prescribed_values(self, lam: float) -> np.ndarray:
        return np.zeros(0)

    prescribed_rates = prescribed_values


@pytest.mark.parametrize(
    "model", [Rod.of(3.0, THICKNESS, elements=20), Solid.of(3.0, THICKNESS, elements=15)], ids=["rod", "solid"]
)
def test_a_strip_slides_to_rest_like_a_block(model: Model) -> None:
    problem, flat, speed = Loose(model, Opened()), np.zeros(model.size), 0.5
    friction = LayerFriction.of(model, MU, flat, problem.reaction)
    assert friction.normal.sum() == pytest.approx(3.0)
    problem = replace(problem, effects=(friction,))
    v = np.zeros(model.size)
    v[model.middle[:, 0]] = speed
    first = dynamics.start(problem, flat, v, 0.0, problem.bounded)
    end = TimeEvent(lambda state: state.t > 1.5 * speed / MU)
    options = TimeOptions(first=0.002, largest=0.02)
    for state in dynamics.march(problem, first, Moving(0.0, 0.0), options=options, until=(end,)):
        problem = problem.accepted(state.q)
    # Time v / (mu g), distance v^2 / (2 mu g), and heat mu w L times the distance: all of the kinetic energy.
    distance, kinetic = speed**2 / (2.0 * MU), 0.5 * 3.0 * speed**2
    assert np.mean(state.q[model.middle[:, 0]]) == pytest.approx(distance, rel=0.01)
    assert np.ptp(state.q[model.middle[:, 0]]) < 1e-3
    (friction,) = problem.effects
    assert friction.dissipated == pytest.approx(kinetic, rel=0.01)
    assert friction.dissipated == pytest.approx(MU * 3.0 * distance, rel=0.01)
    assert abs(state.energy.closing) < 1e-7


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_on_an_inclined_plane_a_strip_slides_above_mu(share: float) -> None:
    model = Rod.of(3.0, THICKNESS, elements=20)
    x, z = model.middle.T
    tilted = model.weight.copy()
    tilted[x] = -share * MU * tilted[z]
    model.__dict__["weight"] = tilted
    problem, flat = Loose(model, Opened()), np.zeros(model.size)
    problem = replace(problem, effects=(LayerFriction.of(model, MU, flat, problem.reaction),))
    # With springs that hold what they can: a sudden load would make the strip swing on them.
    begin = flat.copy()
    begin[x] = min(share, 1.0) * MU / SPRING
    first = dynamics.start(problem, begin, flat, 0.0, problem.bounded)
    end = TimeEvent(lambda state: state.t > 3.0)
    *_, last = dynamics.march(
        problem, first, Moving(0.0, 0.0), options=TimeOptions(first=0.002, largest=0.02), until=(end,)
    )
    moved = float(np.mean(last.q[x]))
    if share < 1.0:
        assert moved == pytest.approx(share * MU / SPRING, rel=0.1)
    else:
        assert moved == pytest.approx(0.5 * (share - 1.0) * MU * last.t**2, rel=0.02)


def test_tangent() -> None:
    problem, q, _ = dragged(4e-3, 3)
    (friction,), rng = problem.effects, np.random.default_rng(1)
    way = np.zeros(problem.size)
    way[problem.model.middle[:, 0]] = rng.uniform(0.5, 1.0, len(problem.model.s))
    # Backwards: what has slipped unloads elastically.
    change = (friction.force(q + 1e-7 * way) - friction.force(q)) / 1e-7
    assert np.allclose(change, friction.force_and_tangent(q)[1] @ way, rtol=1e-5)


def test_a_scene_without_statics_after_the_fall_says_so() -> None:
    from stripfold.ask import collapse

    strip = {"length": 0.6, "eta_b": 3780.0, "height": 0.07, "model": "rod", "layer_friction": 0.3}
    found = collapse.run(Simulation(**strip))
    assert found.attrs["end"] == collapse.ENDS[End.REST]
    row = found.sel(effect="layer_friction")
    assert row["needed"] == row["active"] == 1.0
    assert float(row["since"]) > 0.0
    assert float(found["friction"].dropna("state")[-1]) > 0.0
    without = collapse.run(Simulation(**strip, until="touch", effects={"layer_friction": "off"}))
    assert "layer_friction" in without.attrs["missing"]
    assert not without["friction"].dropna("state").any()
