"""Hard cases of the strip and of the way to its end: thickness, length, meshes, contact, steps and starts.

The solid's value is compared with the rod's, another model on other meshes (:mod:`stripfold.ask.prediction`); the
rod's and that of very thin strips with the elastica's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from math import inf, nan

import numpy as np

from stripfold import elastica
from stripfold.ask.critical import find
from stripfold.ask.inputs import Model as ModelName
from stripfold.ask.inputs import Scene
from stripfold.ask.prediction import ElasticaPrediction, from_near_the_end
from stripfold.ask.select_model import model_error
from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.follow.contact_branch import STEPS, BranchCrossing, BranchPoint, follow, solved
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel, along_x, at_lambda, lift, solve_height, start_along_x
from stripfold.follow.track import End, Track
from stripfold.paths import geometric
from stripfold.solve import newton
from stripfold.solve.continuation import Event
from stripfold.strip.model import Model
from verification.hard_cases.case import Finding, refined

PAPERS = 0.0594
"""Thickness of the paper's strips at eta_b = 3780, L*."""
LENGTH, HEIGHT = 9.0, 3.0
"""Of the strip and the gripper where nothing else is said, L*."""
FINE = 0.25
"""Refinement of the rod that is a reference."""


def located(follow: Callable[[float], Track], refinement: float) -> tuple[Track, float]:
    """A run and the error estimate of its lambda, as :func:`.critical.find` has it; nan where the ends differ."""
    fine, coarse = follow(refinement), follow(2.0 * refinement)
    error = abs(fine.lam - coarse.lam) + fine.slack
    return fine, error if fine.end is coarse.end else nan


def _rod_error(thickness: float, height: float) -> float:
    """The rod's largest relative distance from the solid without a Poisson's ratio."""
    return model_error("rod", thickness, 0.0, height, LENGTH)


def end(strip: StripModel, height: float, refinement: float) -> Finding:
    """Where the solid's advance ends, and how; the elastica says how."""
    run, error = located(lambda r: solve_height(strip, height, r, past=0.0), refinement)
    prediction = ElasticaPrediction.at(height)
    rod = from_near_the_end(replace(strip, kind="rod"), prediction, FINE)
    same = (run.end is End.SNAP) == (rod.end is End.SNAP) == prediction.snap
    return Finding(run.lam if same else nan, rod.lam, error, _rod_error(strip.thickness, height) * rod.lam)


def thin(refinement: float) -> Finding:
    run, error = located(lambda r: solve_height(StripModel(LENGTH, 9e-5), HEIGHT, r), refinement)
    return Finding(run.lam if run.end is End.SNAP else nan, elastica.critical(HEIGHT).advance, error)


def rod(thickness: float, reference: float, reference_error: float = 0.0) -> Finding:
    """lambda_c of the rod."""
    prediction, strip = ElasticaPrediction.at(HEIGHT), StripModel(LENGTH, thickness, kind="rod")
    fine, coarse = (from_near_the_end(strip, prediction, r) for r in (0.5, 1.0))
    error = abs(fine.lam - coarse.lam) + fine.slack
    return Finding(fine.lam if fine.end is End.SNAP else nan, reference, error, reference_error)


def high(refinement: float) -> Finding:
    """lambda_c of a high thin rod on fine elements, far from the grasp."""
    prediction, strip = ElasticaPrediction.at(42.6), StripModel(60.0, 4e-4, kind="rod")
    run, error = located(partial(from_near_the_end, strip, prediction), 0.24 * refinement)
    return Finding(run.lam, prediction.last.advance, error, model_error("elastica", 4e-4, 0.0, 42.6, 60.0) * run.lam)


def pushed(refinement: float) -> Finding:
    """Where a thin solid is lost on a triangular path, which makes it buckle from its start; the rod's is one too."""
    lost = [
        assess_strip(StripModel(16.4, 1.5e-3, kind=kind), geometric.triangular(16.4), refinement=r).events[0].travelled
        for kind, r in (("solid", refinement), ("solid", 0.5 * refinement), ("rod", 0.5))
    ]
    return Finding(lost[1], lost[2], abs(lost[1] - lost[0]))


def touched_last(refinement: float) -> Finding:
    """Where the sag of a short solid touches on a circular path, in its last step, and where the rod's does."""
    path = geometric.circular(7.5)
    found = [
        assess_strip(StripModel(7.5, 0.02, kind=kind), path, refinement=r).touch
        for kind, r in (("solid", refinement), ("solid", 0.5 * refinement), ("rod", 0.5))
    ]
    coarse, fine, other = (float(touch.travelled) if touch else nan for touch in found)
    return Finding(fine, other, abs(fine - coarse))


def landed(refinement: float) -> Finding:
    """Height of a solid's fold once its gripper has come down beside an upper layer that lies, and the elastica's."""

    def height(refinement: float) -> float:
        track = assess_strip(StripModel(7.4, PAPERS), geometric.circular(7.4), refinement=refinement)
        last = track.points[-1]
        assert isinstance(last, BranchPoint)
        return float(last.mid_surface(np.linspace(0.0, 7.4, 2001))[:, 1].max()) if track.stable else nan

    folded = float(elastica.folded_loop().state.z.max())
    return refined(height, refinement, folded, PAPERS**2 * folded)


def thick_rod(refinement: float) -> Finding:
    """Against the solid."""
    solid, error = located(lambda r: solve_height(StripModel(LENGTH, 0.2), HEIGHT, r, past=0.0), refinement)
    return rod(0.2, solid.lam, error + _rod_error(0.2, HEIGHT) * solid.lam)


def thick(thickness: float, height: float, refinement: float) -> Finding:
    """Against two elements across: one is stiffer in bending by (kappa h)^2 / 60 (docs/hard-cases.md).

    Lengths go with the cube root of the stiffness, at most that of the largest curvature.
    """

    def across(number: int) -> tuple[Track, float]:
        strip = StripModel(LENGTH, thickness, across=number)
        return located(lambda r: solve_height(strip, height, r), refinement)

    (one, error), (two, other_error) = across(1), across(2)
    ds = 1e-3 * one.free_length
    tangent = np.gradient(one.last.mid_surface(np.arange(0.0, one.free_length, ds)), ds, axis=0)
    curvature = np.abs(np.gradient(np.unwrap(np.arctan2(*tangent.T)), ds)).max()
    stiffer = float(curvature * thickness) ** 2 / 60.0
    same = one.end is two.end is End.SNAP
    return Finding(one.lam if same else nan, two.lam, error, other_error + stiffer / 3.0 * two.lam)


def scene(eta_b: float, model: ModelName, thickness: float = 0.03) -> Scene:
    """A strip that is the same in L*, whatever its eta_b."""
    star = Material(eta_b).gravity_length
    eta_m = (thickness * star) ** 2 * eta_b / 12.0
    return Scene(length=LENGTH * star, height=HEIGHT * star, eta_b=eta_b, eta_m=eta_m, model=model)


def decades() -> Finding:
    """Spread of the rod's lambda_c / L* over eight decades of eta_b, relative."""
    scenes = [scene(float(eta_b), "rod") for eta_b in 10.0 ** np.arange(-1, 9)]
    lambda_c = [find(one).lambda_c / one.material.gravity_length for one in scenes]
    return Finding(float(np.ptp(lambda_c) / np.mean(lambda_c)), 0.0, 0.0, 1e-11)


def one_decade(eta_b: float) -> Finding:
    """lambda_c / L* of the solid in SI, with its own error."""
    asked = scene(eta_b, "solid")
    found, unit = find(asked), asked.material.gravity_length
    truth = from_near_the_end(StripModel(LENGTH, 0.03, kind="rod"), ElasticaPrediction.at(HEIGHT), FINE).lam
    return Finding(found.lambda_c / unit, truth, found.error / unit, _rod_error(0.03, HEIGHT) * truth)


def usual_eta_m() -> None:
    """With the paper's eta_m the stiffest of these strips would be a third of L* thick."""
    star = Material(0.1).gravity_length
    Scene(length=16.0 * star, height=3.0 * star, eta_b=0.1)


def taut(refinement: float) -> Finding:
    """The gripper goes back until the strip pulls: the horizontal force, against the elastica of the same advance."""
    strip, free = StripModel(30.0, 0.01, kind="rod"), 16.0
    truth = elastica.state_no_horizontal_force(HEIGHT)
    while truth.length < free:
        truth = elastica.state_at(HEIGHT, min(truth.length + 0.2, free), truth)
    # The elastica does not stretch.
    stretch = (truth.force_x + 0.5 * HEIGHT * free / strip.length) * strip.length * strip.thickness**2 / 12.0
    target = truth.advance - stretch
    back = Event("target", lambda point, _: point.lam <= target, tolerance=inf)

    def pull(refinement: float) -> float:
        start = start_along_x(_lifted(strip, HEIGHT, refinement), HEIGHT, -1.0)
        for item in follow(start, STEPS, lambda _: [back], through_contact=False):
            if isinstance(item, BranchCrossing):
                found = at_lambda(item.after, target)
                return -float(found.point.state.force[found.model.middle[0, 0]])
        raise AssertionError("a branch ends in an event or raises")

    # The stretch is right to first order.
    return refined(pull, 0.25 * refinement, truth.force_x, stretch / strip.length * truth.force_x)


def lifted_whole(refinement: float) -> Finding:
    """Too short to snap: followed until next to nothing lies, on the elastica of the same free length."""
    strip = StripModel(6.5, 0.01)
    run, error = located(lambda r: solve_height(strip, HEIGHT, r), refinement)
    truth = elastica.state_at(HEIGHT, run.free_length)
    # A solid lifts off within a thickness.
    thickness = abs(elastica.state_at(HEIGHT, run.free_length - strip.thickness, truth).advance - truth.advance)
    return Finding(run.lam if run.end is End.LIFTED else nan, truth.advance, error, thickness)


STRIP = StripModel(LENGTH, PAPERS)


def _lifted(strip: StripModel, height: float, refinement: float) -> BranchPoint:
    """The strip with its gripper at a height and free along x."""
    ((_, at),) = lift(strip.contact_mesh(refinement), [height])
    return at


lifted = lru_cache(maxsize=4)(partial(_lifted, STRIP))


def with_steps(size: float, refinement: float) -> Finding:
    """lambda_c, against that from shortly before it."""
    options = replace(STEPS, first=size, largest=size)
    run, error = located(lambda r: along_x(lifted(HEIGHT, r), HEIGHT, past=0.0, options=options), refinement)
    near = from_near_the_end(STRIP, ElasticaPrediction.at(HEIGHT), refinement)
    return Finding(run.lam if run.end is near.end is End.SNAP else nan, near.lam, error, near.slack)


def from_a_guess(height: float, refinement: float, change: Callable[[Model, Array], Array] | None = None) -> Finding:
    """lambda_0 from a state that is none: the state of another height, or the right one changed."""
    at, right = lifted(height, refinement), lifted(HEIGHT, refinement)
    q = at.point.q.copy()
    if change is not None:
        q[: at.problem.n] = change(at.model, q[: at.problem.n])
    found = solved(at.problem, q, HEIGHT)
    lambda_0, truth = (float(one.point.q[one.model.middle[0, 0]]) for one in (found, right))
    return Finding(lambda_0, truth, 1e-3)


def flat(model: Model, q: Array) -> Array:
    return np.zeros(model.size)


def noise(size: float) -> Callable[[Model, Array], Array]:
    """Every place of the mid-surface moved at random."""

    def change(model: Model, q: Array) -> Array:
        q[model.middle] += size * np.random.default_rng(1).standard_normal(model.middle.shape)
        return q

    return change


def below_the_floor(model: Model, q: Array) -> Array:
    q[model.middle[:, 1]] *= -1.0
    return q


def past_the_end(refinement: float) -> None:
    """The gripper past lambda_c in one step: no state is near."""
    at = solve_height(STRIP, HEIGHT, refinement).last
    options = newton.NewtonOptions(max_iterations=100, max_distance=0.2)
    newton.solve(at.problem, at.point.q, at.point.lam + 0.1, at.problem.bounded, options=options)
