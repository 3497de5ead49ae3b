"""What a path does to a strip: critical points and their kind, falls, first touch, end; and what is stored of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from stripfold import elastica
from stripfold.follow import track as assessing
from stripfold.follow.contact import columns_on_floor, touches
from stripfold.follow.fall import Fall, assess_strip
from stripfold.follow.statics import StripModel
from stripfold.follow.track import BIFURCATION, MOVING, SNAP, End, Track
from stripfold.paths import geometric, low_path, rpath, table
from stripfold.paths.curve import GripperPath, pieces_through
from stripfold.solve.schemes import Damping

THICKNESS = 0.0594
STRIP = StripModel(20.0, THICKNESS)
FALL = Fall(1e-2, damping=Damping(0.2, 0.1))
PATHS: dict[str, Callable[[], GripperPath]] = {
    "triangular": lambda: geometric.triangular(STRIP.length),
    "circular": lambda: geometric.circular(STRIP.length),
    "r-path": lambda: rpath.plan_r_path(STRIP.length).path,
}
LOW = low_path.low(12.0, 1.2)
PLACES = {"triangular": (3.392, 6.608), "circular": (5.289, 8.487), "r-path": (4.309, 7.518)}


@pytest.fixture(scope="module")
def followed() -> dict[str, Track]:
    """The paper's paths up to their critical points."""
    return {name: assess_strip(STRIP, make()) for name, make in PATHS.items()}


@pytest.fixture(scope="module")
def low() -> tuple[StripModel, Track]:
    """A path too low for a snap."""
    strip = StripModel(12.0, 0.06)
    return strip, assess_strip(strip, LOW, FALL, 2.0)


def elasticas_angle(path: GripperPath, travelled: float) -> float:
    """Angle between a path and the elastica's lambda_c(z), by differences of both, degrees."""
    d = 1e-3
    (x0, z0), (x1, z1) = path.position(travelled - d), path.position(travelled + d)
    slope = (elastica.critical(float(z1) + d).advance - elastica.critical(float(z1) - d).advance) / (2.0 * d)
    path_angle, boundary_angle = np.arctan2(z1 - z0, x1 - x0), np.arctan2(1.0, slope)
    apart = abs(np.degrees(path_angle - boundary_angle)) % 180.0
    return float(min(apart, 180.0 - apart))


class TestCriticalPoints:
    """Where, and of which kind."""

    @pytest.mark.parametrize("name", PATHS)
    def test_place_is_on_the_boundary(self, followed: dict[str, Track], name: str):
        """Truth: the elastica's lambda_c at this height; a thickness takes 6 (h/L*)^2 off it."""
        found = followed[name]
        (event,) = found.events
        place = PATHS[name]().position(event.travelled)
        assert place == pytest.approx(PLACES[name], abs=4e-3)
        x, z = (float(value) for value in place)
        off = x + STRIP.length / 2.0 - elastica.critical(z).advance
        assert off == pytest.approx(-6.0 * THICKNESS**2, abs=8e-3)
        assert event.travelled == event.found.lam
        assert not found.stable
        assert found.end is End.SNAP
        assert found.touch is None
        assert not found.falls
        assert found.critical is event.found
        assert found.points[-1].point is event.found.before

    @pytest.mark.parametrize("name", PATHS)
    def test_kind_by_the_angle(self, followed: dict[str, Track], name: str):
        """Truth: the elastica's boundary, by differences.  The R-path of the elastica meets its own at no angle."""
        (event,) = followed[name].events
        truth = elasticas_angle(PATHS[name](), event.travelled)
        assert event.angle == pytest.approx(truth, abs=2.5)
        if name == "r-path":
            assert event.kind == BIFURCATION
            assert event.angle == pytest.approx(8.2, abs=0.5)
        else:
            assert event.kind == SNAP
            assert event.angle == pytest.approx({"triangular": 89.0, "circular": 76.4}[name], abs=0.8)

    def test_angle_is_that_of_the_path(self, followed: dict[str, Track]):
        """The same critical state come upon along its boundary, across it, and in between."""
        found = followed["circular"]
        (event,) = found.events
        problem, point = found.states[-1]
        z = float(PATHS["circular"]().position(event.travelled)[1])
        slope = (elastica.critical(z + 1e-3).advance - elastica.critical(z - 1e-3).advance) / 2e-3
        along = np.array([slope, 1.0]) / np.hypot(slope, 1.0)
        across = np.array([along[1], -along[0]])
        for angle in (0.0, 30.0, 60.0, 90.0):
            way = np.cos(np.radians(angle)) * along + np.sin(np.radians(angle)) * across
            for signed in (3.0 * way, -way):
                piece = SimpleNamespace(position=problem.motion.path.position, rate=lambda s, way=signed: way)
                turned = replace(problem, motion=replace(problem.motion, path=piece))
                assert assessing.boundary_angle(turned, point) == pytest.approx(angle, abs=2.0)

    def test_normal_by_differences(self, followed: dict[str, Track]):
        """At fixed other unknowns a move of the gripper changes the forces; what the mode feels of it is the normal."""
        found = followed["circular"]
        (event,) = found.events
        problem, before = found.states[-1]
        mode, grasp = before.mode, problem.model.middle[0]
        normal = []
        for unknown in grasp:
            q = before.q.copy()
            forces = []
            for d in (1e-6, -1e-6):
                q[unknown] = before.q[unknown] + d
                forces.append(problem.residual(q, before.lam))
            normal.append(float(mode @ (forces[0] - forces[1])) / 2e-6)
        way = problem.motion.rates(event.travelled)
        sine = abs(np.dot(normal, way)) / np.linalg.norm(normal) / np.linalg.norm(way)
        assert event.angle == pytest.approx(np.degrees(np.arcsin(sine)), abs=1e-2)

    def test_a_table_of_the_triangle_is_the_triangle(self, followed: dict[str, Track], tmp_path: Path):
        file = tmp_path / "triangle.csv"
        file.write_text("t,x,z\n0,-0.3,0\n0.2,0,0.3\n1,0.3,0\n")
        other = assess_strip(STRIP, table.read(file, 20.0, 0.03))
        (event,), (truth,) = other.events, followed["triangular"].events
        assert event.travelled == pytest.approx(truth.travelled, abs=2e-6)
        assert event.angle == pytest.approx(truth.angle, abs=0.01)
        assert event.kind == SNAP


class TestLow:
    """A path on which nothing snaps."""

    def test_it_is_followed_to_its_end(self, low: tuple[StripModel, Track]):
        _, found = low
        assert found.stable
        assert found.end is End.PATH
        assert not found.falls
        assert found.lam == pytest.approx(LOW.length)

    def test_first_touch(self, low: tuple[StripModel, Track]):
        """Truth: at this height the elastica's sag comes down at a known advance and place; located to 1e-4 L*."""
        strip, found = low
        assert found.touch is not None
        assert not found.touch.fell
        truth = elastica.critical(1.2).state
        assert truth.sag is not None
        half = strip.length / 2.0
        x, z = LOW.position(found.touch.travelled)
        assert z == pytest.approx(1.2)
        assert x + half == pytest.approx(truth.advance, abs=0.04)
        touch = x + truth.x[-1] - float(truth.at(truth.sag.s).x)
        assert found.touch.x == pytest.approx(touch, abs=0.06)
        # The state of the touch is one of them, upright over the floor at one point.
        at = next(i for i, (problem, point) in enumerate(found.states) if touches(problem.model, point))
        problem, point = found.states[at]
        assert point.lam == found.touch.travelled
        assert not touches(found.states[at - 1][0].model, found.states[at - 1][1])
        place, rest = problem.model.s[columns_on_floor(problem.model, point)][:2]
        assert rest - place > 2.0
        x = problem.model.resampled_mid_surface(point.q, np.array([place]))[0, 0]
        assert x == pytest.approx(found.touch.x, abs=1e-3)

    def test_a_strip_that_lies_from_the_first_does_not_touch_again(self, low: tuple[StripModel, Track]):
        _, found = low
        assert found.touch is not None
        lying = found.touch.index
        for part in (slice(lying, None), slice(0, lying)):
            assert replace(found, points=found.points[part], phases=found.phases[part]).touch is None


def test_a_pushed_strip_buckles_where_its_elements_are_to_be_planned_anew() -> None:
    """A gripper that rises by 6 degrees pushes the strip until it snaps; coarse elements are 0.02 L* late."""
    strip = StripModel(9.43299, 0.0950411, kind="solid")
    start = np.array([-0.5 * strip.length, 0.0])
    path = GripperPath("line", pieces_through([("line", np.array([start, start + np.array([3.0, 0.3149])]))]))
    found, finer = (assess_strip(strip, path, refinement=refinement) for refinement in (1.0, 0.7))
    assert [event.kind for event in found.events] == [SNAP]
    assert found.events[0].travelled == pytest.approx(finer.events[0].travelled, abs=0.05)


def test_a_pushed_strip_is_laid_down_without_a_snap() -> None:
    """At 45 degrees, on coarse elements as on fine ones."""
    for refinement in (2.0, 1.0):
        found = assess_strip(StripModel(9.0, THICKNESS), geometric.triangular(9.0), refinement=refinement)
        assert found.stable
        assert found.end is End.PATH
        assert found.contact == MOVING
