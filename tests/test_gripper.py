"""The strip in a clamp: its equations, a clamp without a moment, and up to which length it keeps an R-path stable."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import stripfold as sf
from oracles.elastica import longest_stable
from stripfold import elastica
from stripfold.ask.prediction import ElasticaPrediction, clamped_end
from stripfold.base.arrays import Array, Index
from stripfold.base.errors import InvalidInputError
from stripfold.base.validation import Gripper
from stripfold.follow.contact import touches
from stripfold.follow.contact_branch import solved
from stripfold.follow.fall import Fall, assess_strip, size_of_fall
from stripfold.follow.statics import StripModel, follow
from stripfold.follow.track import End, Track, grip_angles
from stripfold.paths.curve import Interpolated
from stripfold.paths.rpath import plan_r_path
from stripfold.strip.contact_mesh import LYING, ContactMesh, Sizes
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, Clamp, StripProblem, end_angle
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid

THICKNESS = 0.0594


def r_path(length: float, kind: str, gripper: Gripper, thickness: float = THICKNESS, refinement: float = 1.0) -> Track:
    path = replace(plan_r_path(length).path, gripper=gripper)
    return follow(StripModel(length, thickness, kind=kind).contact_mesh(refinement), path, length, until="touch")


@pytest.mark.parametrize("of", [Rod, Solid])
def test_derivatives(of: type[Rod] | type[Solid]) -> None:
    """By the unknowns and by lambda, against differences of the residual."""
    points, angles = np.array([[-4.5, 0.0], [-3.0, 1.0], [-1.0, 1.5]]), np.array([0.1, 0.5, 1.2])
    motion = AlongPath(Interpolated.through(points, 0.0, "some", angles), 9.0, "turning")
    planned = np.array([4.0])
    mesh = ContactMesh.of(9.0, LYING, planned, Sizes(1.0, 3.0, 0.5, least=3), lambda e: of.of(9.0, 0.3, elements=e))
    rng, moving = np.random.default_rng(3), MovingContact(mesh, motion)
    for problem in (moving, StripProblem(mesh.at(planned), motion)):
        q = 0.03 * rng.normal(size=problem.size)
        q[moving.n :] = planned + 0.01
        _, matrix, rate = problem.linearise(q, 1.0)
        direction, step = rng.normal(size=problem.size), 1e-6
        for found, moved, turned in ((matrix @ direction, direction, 0.0), (rate, 0.0 * direction, 1.0)):
            ahead, back = (problem.residual(q + s * step * moved, 1.0 + s * step * turned) for s in (1.0, -1.0))
            difference: Array = (ahead - back) / (2.0 * step)
            np.testing.assert_allclose(found, difference, rtol=1e-5, atol=1e-5 * np.abs(difference).max())


@pytest.mark.parametrize("kind", ["rod", "solid"])
def test_a_clamp_without_a_moment_is_a_hinge(kind: str) -> None:
    """At the angle that the strip takes in a hinge, found again from a guess that is bent otherwise."""
    at = next(at for at in r_path(12.0, kind, "hinge").branch if at.lam > 8.0)
    motion = at.problem.motion
    assert isinstance(motion, AlongPath)
    free = Clamp(at.model, 0.0, 0.0)
    along, across = (Clamp(at.model, angle, 0.0).moment(at.u) for angle in (0.0, -np.pi / 2.0))
    angle = -float(np.arctan2(along, -across))
    assert abs(Clamp(at.model, angle, 0.0).moment(at.u)) < 1e-8
    piece = Interpolated.through(np.array([[0.0, 0.0], [1.0, 0.0]]), 0.0, "", np.full(2, angle))
    held = replace(motion, path=replace(piece, points=motion.path.position(at.lam) + piece.points), gripper="turning")
    guess = at.point.q.copy()
    guess[free.unknowns] += 0.01
    found = solved(MovingContact(at.problem.mesh, held), guess, 0.0)
    np.testing.assert_allclose(found.mid_surface(at.model.s), at.mid_surface(at.model.s), atol=1e-9)


def test_longest_strips_of_the_elastica() -> None:
    assert longest_stable(True, 12.0, 13.0) == pytest.approx(12.4747, abs=1e-3)
    assert longest_stable(False, 9.4, 10.0) == pytest.approx(9.5751, abs=1e-3)


@pytest.mark.parametrize(("gripper", "length"), [("turning", 12.4747), ("hinge", 9.5751)])
def test_the_thin_rod_is_stable_up_to_the_same_length(gripper: Gripper, length: float) -> None:
    assert r_path(length - 0.05, "rod", gripper, 1e-3, 0.5).stable
    assert not r_path(length + 0.05, "rod", gripper, 1e-3, 0.5).stable


@pytest.mark.parametrize("kind", ["rod", "solid"])
def test_the_papers_thickness_shortens_it(kind: str) -> None:
    """Rod and solid agree; a hinge loses the shorter strip, too."""
    assert r_path(12.05, kind, "turning").stable
    assert not r_path(12.15, kind, "turning").stable
    assert not r_path(12.05, kind, "hinge").stable


@dataclass(frozen=True)
class Prescribed:
    """The gripper of a rod that prescribes the slope, its length too, at a constant height: another way to clamp."""

    height: float
    angle: float

    def grasped(self, model: Model) -> Index:
        # After the displacement of a node come the unknowns of its slope.
        return np.concatenate([model.middle[0], model.middle[0] + 2])

    def values(self, lam: float) -> Array:
        return np.array([lam, self.height, np.cos(self.angle) - 1.0, -np.sin(self.angle)])

    def rates(self, lam: float) -> Array:
        return np.array([1.0, 0.0, 0.0, 0.0])


class TestAlongX:
    strip = sf.Strip(length=0.6, eta_b=3780)

    @pytest.mark.parametrize("degrees", [0.0, 60.0, 120.0])
    def test_a_prescribed_slope_gives_the_same_state(self, degrees: float) -> None:
        angle, prediction = np.deg2rad(degrees), ElasticaPrediction.at(3.0)
        run = clamped_end(StripModel(20.0, 1e-3, kind="rod"), prediction, angle, 1.0, 1e-6)
        # At its end the strip is soft.
        at = next(at for at in reversed(run.branch) if at.lam < run.lam - 0.5)
        other = MovingContact(at.problem.mesh, Prescribed(3.0, angle))  # type: ignore[arg-type]
        found = solved(other, at.point.q, at.lam)
        np.testing.assert_allclose(found.mid_surface(at.model.s), at.mid_surface(at.model.s), atol=5e-5)

    def test_rod_and_solid_and_what_ends_the_advance(self) -> None:
        rod, solid = (self.strip.critical(0.09, model=model, clamp=90) for model in ("rod", "solid"))
        assert rod.lambda_touch == pytest.approx(solid.lambda_touch, rel=1e-4)
        assert not rod.snap  # in a hinge it snaps at this height
        assert self.strip.critical(0.09, model="rod").snap
        high = self.strip.critical(0.15, model="rod", clamp=90)
        assert high.snap
        assert high.lambda_c == pytest.approx(self.strip.critical(0.15, model="rod").lambda_c, abs=0.01 * 0.03)

    def test_a_collapse_begins_where_the_clamped_strip_snaps(self) -> None:
        found = self.strip.collapse(0.15, model="rod", clamp=0.0).dataset
        assert float(found.lambda_c) == pytest.approx(
            self.strip.critical(0.15, model="rod", clamp=0.0).lambda_c, rel=1e-5
        )
        assert float(found.lambda_c) < 0.98 * self.strip.critical(0.15, model="rod").lambda_c
        assert np.nanmax(np.abs(found.closing.values)) < 1e-9
        with pytest.raises(sf.SolveError, match="the sag touches"):
            self.strip.collapse(0.09, model="rod", clamp=90.0)
        with pytest.raises(InvalidInputError, match="no clamp together with friction_moment"):
            self.strip.collapse(0.15, clamp=0.0, friction_moment=1e-5)

    @pytest.mark.parametrize(
        ("given", "message"),
        [({"model": "elastica"}, "solid or rod together"), ({"second_gripper": "auto"}, "no clamp together")],
    )
    def test_what_cannot_be(self, given: dict[str, str], message: str) -> None:
        with pytest.raises(InvalidInputError, match=message):
            self.strip.critical(0.09, clamp=0.0, **given)


@pytest.mark.parametrize("gripper", ["hinge", "turning"])
def test_the_planned_way_is_along_the_boundary(gripper: Gripper) -> None:
    """As for a strip without thickness: the planned states become unstable without ceasing to be."""
    (event,) = r_path(13.0, "rod", gripper, 0.01).events
    assert event.angle < 2.0


class TestFall:
    """A strip in a clamp that turns as planned is lost on a long R-path, and the clamp stands while it falls."""

    @pytest.fixture(scope="class")
    def fallen(self) -> Track:
        path = replace(plan_r_path(16.0).path, gripper="turning")
        return assess_strip(StripModel(16.0, THICKNESS, kind="rod"), path, Fall())

    @pytest.mark.slow
    def test_it_falls_less_far_than_in_a_hinge_and_is_folded(self, fallen: Track) -> None:
        hinged = assess_strip(StripModel(16.0, THICKNESS, kind="rod"), plan_r_path(16.0).path, Fall())
        drops = [size_of_fall(of.states[of.falls[0].start - 1], of.states[of.falls[0]])[0] for of in (fallen, hinged)]
        assert 0.1 < drops[0] < drops[1]
        assert fallen.end is End.PATH
        assert fallen.failure is None

    def test_no_energy_is_made_and_the_angle_is_kept(self, fallen: Track) -> None:
        falling = fallen.states[fallen.falls[0]]
        assert max(abs(state.energy.closing) for _, state in falling) < 1e-9
        (problem, first), (_, last) = falling[0], falling[-1]
        assert end_angle(problem.model, last.q) == pytest.approx(end_angle(problem.model, first.q), abs=1e-4)


def test_a_limit_point_that_other_elements_have_behind_the_corner() -> None:
    """The branch is followed to the corner, not past it, where the path of the piece before ends."""
    path = plan_r_path(20.0).path
    turned = (replace(piece, angles=piece.angles + np.deg2rad(5.0)) for piece in path.pieces)
    strip = StripModel(20.0, THICKNESS, kind="rod").contact_mesh()
    found = follow(strip, replace(path, pieces=tuple(turned), gripper="turning"), 20.0, until="touch")
    assert found.end is End.SNAP
    assert path.corners[1] < found.lam < path.corners[1] + 0.2


class TestAssess:
    strip = sf.Strip(length=0.36, eta_b=3780)

    def test_a_path_from_a_file_keeps_its_angles(self, tmp_path: Path) -> None:
        path = sf.paths.r_path(self.strip)
        path.to_csv(tmp_path / "path.csv")
        again = sf.paths.read(tmp_path / "path.csv", self.strip)
        for s in np.linspace(0.0, path.curve.length, 50):
            assert again.curve.angle(s)[0] == pytest.approx(path.curve.angle(s)[0], abs=0.02)
        assert path.curve.angle(path.curve.length)[0] == pytest.approx(np.pi)

    def test_the_strip_is_folded_where_a_hinge_loses_it(self) -> None:
        path = sf.paths.r_path(self.strip)
        hinge, clamp = (self.strip.assess(path, model="rod", gripper=how) for how in ("hinge", "turning"))
        assert not hinge.stable
        assert clamp.stable
        assert clamp.folded
        assert hinge.peak_moment == 0.0
        assert "peak moment" in str(clamp)
        # Up to where the hinge loses it the strip has its shape, so that the moment is small.
        assert 0.0 < clamp.peak_moment < 0.1 * 9.81 * self.strip.gravity_length**2

    strip_to_turn = sf.Strip(length=0.1955, eta_b=3780, eta_m=3e-4)

    def turned(self, share: float, end: float, file: Path) -> sf.paths.FoldPath:
        """A path down to the height ``end``, L*, whose gripper turns by a share of half a turn."""
        t, unit = np.linspace(0.0, 1.0, 60), self.strip_to_turn.gravity_length
        corners = [-3.26, -2.96, 2.78], [0.0, 0.32, end]
        places = [np.interp(t, [0.0, 0.5, 1.0], unit * np.array(corner)) for corner in corners]
        table = np.column_stack([t, *places, share * 180.0 * (3.0 * t**2 - 2.0 * t**3)])
        np.savetxt(file, table, delimiter=",", header="t,x,z,angle", comments="")
        return sf.paths.read(file, self.strip_to_turn)

    def test_a_strip_bent_sharply_by_its_clamp_is_resolved(self, tmp_path: Path) -> None:
        """With solid elements as long as elsewhere it would bifurcate half of the way, also with coarser ones."""
        path = self.turned(0.74, 0.1, tmp_path / "path.csv")
        rod, solid = (self.strip_to_turn.assess(path, model=kind, gripper="turning") for kind in ("rod", "solid"))
        assert rod.stable
        assert solid.stable
        assert not solid.mesh_dependence
        assert solid.touch_x == pytest.approx(rod.touch_x, abs=0.01 * self.strip_to_turn.gravity_length)

    def test_a_strip_that_its_clamp_crushes_is_said_where(self, tmp_path: Path) -> None:
        path = self.turned(0.4, 0.02, tmp_path / "path.csv")
        with pytest.raises(sf.SolveError, match=r"^row 5\d, gripper at x = .*turning clamp may bend .* is crushed"):
            self.strip_to_turn.assess(path, model="solid", gripper="turning")

    def test_a_gripper_that_does_not_turn_folds_nothing(self) -> None:
        found = self.strip.assess(sf.paths.triangular(self.strip), model="rod", gripper="fixed")
        assert not found.folded
        assert found.peak_moment > 0.01

    def test_how_far_it_turns_and_which_tools_stay_above_the_table(self) -> None:
        """The angle at the touch is the elastica's, up to the thickness; a tool's end comes down to the table."""
        strip = sf.Strip(length=0.45, eta_b=3770)
        height = strip.gravity_length
        low = strip.assess(sf.paths.low(strip, height), model="rod")
        angles = grip_angles(low.states)
        touch = next(i for i, (problem, point) in enumerate(low.states) if touches(problem.model, point))
        assert np.degrees(angles[touch]) == pytest.approx(
            np.degrees(elastica.critical(1.0).state.theta[-1]) % 360.0, abs=0.1
        )
        z = np.array([problem.model.mid_surface(point.q)[0, 1] for problem, point in low.states])
        ends = low.asked.gravity_length * z + low.tool_room * np.sin(angles)
        assert ends.min() == pytest.approx(0.0, abs=1e-9)
        assert np.degrees(angles.max()) == pytest.approx(low.largest_angle)
        assert 185.0 < low.largest_angle < 195.0
        triangular = strip.assess(sf.paths.triangular(strip), model="rod", fall=True)
        assert (triangular.largest_angle, triangular.tool_room) == (pytest.approx(180.0, abs=0.1), np.inf)
        assert "any tool behind it" in str(triangular)

    def test_what_cannot_be(self, tmp_path: Path) -> None:
        path = sf.paths.triangular(self.strip)
        with pytest.raises(InvalidInputError, match="column angle"):
            self.strip.assess(path, gripper="turning")
        with pytest.raises(InvalidInputError, match="hinge together with layer_friction"):
            self.strip.assess(path, gripper="fixed", layer_friction=0.1)
        file = tmp_path / "path.csv"
        file.write_text("t,x,z,angle\n0,-0.18,0,0\n1,0,0.18,90\n2,0.18,0,180\n")
        with pytest.raises(InvalidInputError, match="within 60 of the row before"):
            sf.paths.read(file, self.strip)
