"""A path for a strip whose eta_b is not well known: which one, its margin, its motion, its files."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stripfold as sf
from made_up import assess_path
from stripfold import elastica
from stripfold.ask import plan as planner
from stripfold.ask.assess import assess
from stripfold.ask.friction import lost_with
from stripfold.ask.inputs import PathInputs, PlanInputs
from stripfold.ask.outcome import Outcome, outcome_of
from stripfold.ask.plan import FoldingPlan
from stripfold.base.errors import InvalidInputError, NoPathError
from stripfold.cli import main
from stripfold.paths import FoldPath
from stripfold.paths.curve import GripperPath, pieces_through
from stripfold.paths.geometric import layer_slide

ETA_B = 3780.0
LIMIT = 1.5861708


OF_CLOTH = [
    *(("low", 18.0, 1.11), ("circular", 18.0, 1.11), ("triangular", 15.0, 0.95), ("circular", 15.0, 0.5)),
    *(("r_path", 21.0, 0.35), ("circular", 26.0, 0.5), ("circular", 12.0, 0.3945), ("low", 15.0, 0.5)),
    *(("r_path", 15.0, 1.3), ("circular", 15.0, 1.3), ("r_path", 10.0, 1.11), ("low", 12.0, 0.35)),
]
"""Paths, lengths, L*, and friction moments, rho_a g L*^2."""


def star(eta_b: float) -> float:
    return float((9.81 * eta_b) ** (-1.0 / 3.0))


@pytest.fixture(scope="module")
def strip() -> sf.Strip:
    return sf.Strip(length=0.36, eta_b=ETA_B)


def asked(**given: Any) -> PlanInputs:
    return PlanInputs(**{"length": 0.5, "eta_b": ETA_B, **given})


@pytest.fixture(scope="module")
def long() -> FoldingPlan:
    return sf.Strip(length=0.5, eta_b=ETA_B).plan(cores=1)


def followed(name: str, **given: Any) -> Outcome:
    """What comes of one path, with the least and the largest eta_b, without a plan's choice."""
    strip = asked(**given)
    candidate = next(candidate for candidate in planner.candidates(strip) if candidate.name == name)
    strips = strip.strips[::2] if strip.eta_b_uncertainty else strip.strips[1:2]
    return outcome_of(strip, candidate, strips)


def by_name(plan: FoldingPlan) -> dict[str, Outcome]:
    return {outcome.name: outcome for outcome in plan.outcomes}


class TestMargin:
    def test_of_a_short_strip_is_the_distance_to_critical_points(self) -> None:
        """Down the second edge, up to where the sag lands; the softest strip's length is 9.4 L*."""
        length, unit = 9.4, star(1.2 * ETA_B)
        found = followed("lifted triangle", length=length * unit).margin / unit
        heights = np.linspace(LIMIT, 2.5, 60)
        wall = np.array([(elastica.critical(z).state.advance, z) for z in heights[1:]])
        z = np.linspace(length / 2.0, 0.0, 2000)
        touch = np.array([elastica.critical(h).state.advance for h in (1.0, 1.4)])
        edge = np.column_stack([length - z, z])
        lands = edge[:, 0] > np.interp(z, (1.0, 1.4), touch)
        edge = edge[: int(np.argmax(lands & (z < 1.5)))]
        away = np.linalg.norm(edge[:, None] - wall, axis=2).min()
        assert found == pytest.approx(away, abs=0.04)


class TestOutcomes:
    def test_every_path_is_there_with_what_comes_of_it(self, long: FoldingPlan) -> None:
        """16.7 L*: the paper's three paths snap, as its section IV says; the low one does not."""
        found = by_name(long)
        assert set(found) == {"low", "lifted triangle", "triangular", "circular", "r-path"}
        assert {name for name, outcome in found.items() if outcome.drop == 0.0} == {"low"}
        assert {name for name, outcome in found.items() if outcome.margin > 0.0} == {"low"}
        assert long.error[1] == min(outcome.error[1] for outcome in long.outcomes) or (
            long.error[1] < min(outcome.error[1] for outcome in long.outcomes) + 1e-3
        )
        assert long.best.name == "low"
        assert all(verdict.stable and verdict.completed for verdict in long.best.verdicts)

    def test_the_height_of_the_low_path(self, long: FoldingPlan) -> None:
        low = by_name(long)["low"]
        assert low.path.places[:, 2].max() == pytest.approx(star(ETA_B), rel=1e-6)
        # From its height up to where the softest strip snaps.
        assert low.margin == pytest.approx(LIMIT * star(1.2 * ETA_B) - star(ETA_B), rel=1e-6)

    def test_a_gripper_that_is_off_and_friction_widen_the_interval(self, long: FoldingPlan) -> None:
        """Without both it is what eta_b does to the fold; a layer that lands too far is held there by friction."""
        for name in ("low", "circular"):
            exact = followed(name, gripper_accuracy=0.0, layer_friction=0.0)
            off = [verdict.shape_error for verdict in exact.verdicts]
            assert min(off) <= exact.error[0] <= exact.error[1] <= max(off)
            assert by_name(long)[name].error[1] > exact.error[1] + 2e-4
        assert exact.error[1] < 1e-3
        circular = by_name(long)["circular"]
        assert circular.touch_error[1] > 0.02
        assert circular.error[1] > 0.05

    def test_layers_slide_as_the_height_at_the_touch_says(self) -> None:
        """Against the elastica, for the given strip without friction."""
        low = followed("low", eta_b_uncertainty=0.0)
        unit = star(ETA_B)
        assert low.layer_slide == pytest.approx(unit * layer_slide(0.5 / unit, 1.0), abs=0.15 * unit)

    def test_layers_slide_as_far_where_a_path_is_known(self, long: FoldingPlan) -> None:
        """Of a snapped one from where it has landed: what is kept of its fall says where."""
        for name in ("circular", "lifted triangle"):
            found = by_name(long)[name]
            again = outcome_of(asked(), found.candidate, asked().strips[::2], known=found)
            assert again.layer_slide == found.layer_slide
            assert any(len(motion) > 1 for of in found.verdicts for _, motion in of.falls)

    def test_goals_and_limits(self, long: FoldingPlan) -> None:
        quick, *_ = planner.ranked(asked(goal="quick"), list(long.outcomes))
        assert quick.duration == min(outcome.duration for outcome in long.outcomes)
        gentle = planner.ranked(asked(goal="gentle"), [*long.outcomes[1:], long.outcomes[0]])
        drops = [outcome.drop for outcome in gentle if outcome.flatness_ratio > 1.0]
        assert drops == sorted(drops)
        with pytest.raises(NoPathError, match=r"at most 5 mm is asked for.*the drop of its snap is") as caught:
            sf.Strip(length=0.4, eta_b=ETA_B).plan(eta_b_uncertainty=0.0, max_slide=0.005, max_snap=0.0, cores=1)
        assert {"low", "r-path"} <= {one.path for one in caught.value.refused}

    @pytest.mark.slow
    def test_layers_that_may_not_slide_snap(self) -> None:
        strip = sf.Strip(length=0.3, eta_b=ETA_B)
        held = strip.plan(max_slide=0.03, tool=0.5, cores=1)
        assert held.best.layer_slide <= 0.03
        # The softest of the three strips snaps: what friction makes of its fold was found in time.
        assert held.best.drop > 0.0
        assert held.best.error[1] == pytest.approx(by_name(held)["low"].error[1], rel=0.2)
        assert held.best.tool_room > 0.5
        low = held.outcomes[-1]
        assert low.excluded.startswith("the slide of the layers over each other is")

    def test_what_slips_on_the_table_is_not_folded(self, strip: sf.Strip) -> None:
        """On the circular path 12 L* pull with 2.3 times what lies."""
        rough = strip.plan(eta_b_uncertainty=0.0, table_friction=0.5, cores=1)
        assert rough.best.table_slide == 0.0
        assert rough.best.hold_friction < 0.5
        circular = by_name(rough)["circular"]
        assert circular.hold_friction > 2.0
        assert rough.outcomes[-1].error[1] == circular.error[1] == np.inf

    @pytest.mark.slow
    def test_on_a_smooth_table_the_strip_follows_its_gripper(self, strip: sf.Strip) -> None:
        with pytest.raises(NoPathError, match=r"slides \d+ mm on the table"):
            strip.plan(table_friction=0.05)

    def test_friction_holds_what_would_snap(self) -> None:
        """M_0 of half of what the least fabric of fabrics.csv has."""
        strip = sf.Strip(length=0.36, eta_b=ETA_B)
        moment = 0.11 * 9.81 * strip.rho_a * strip.gravity_length**2
        found = followed("r-path", length=0.36, friction_moment=moment)
        assert found.sufficient_moment is not None
        assert found.sufficient_moment < moment
        assert found.drop == 0.0 < found.margin
        assert all(verdict.stable for verdict in found.verdicts)

    @pytest.mark.slow
    def test_friction_of_real_cloth_is_in_the_fold(self) -> None:
        """Of the wool of the table, beside the paper's solid with that friction: millimetres instead of a tenth."""
        wool = sf.fabric("wool tropical")
        given = wool.values | {"eta_b_uncertainty": 0.0, "length": 0.2, "gripper_accuracy": 0.0, "layer_friction": 0.0}
        found, without = followed("low", **given), followed("low", **given | {"friction_moment": None})
        strip = sf.Strip(length=0.2, eta_b=wool.eta_b, rho_a=wool.rho_a)
        solid = strip.assess(found.path, friction_moment=wool.friction_moment)
        assert found.error[0] == pytest.approx(solid.shape_error, rel=0.1)
        assert found.error[0] > 10.0 * without.error[1]
        assert found.sufficient_moment is None  # nothing snaps without it

    @pytest.mark.slow
    @pytest.mark.parametrize(("path", "length", "share"), OF_CLOTH)
    def test_friction_of_real_cloth_loses_no_strip(self, path: str, length: float, share: float) -> None:
        """With M_0 of 0.22 rho_a g L*^2 and more, the least of a fabric, nothing snaps, and the solid lands there, too:
        the rod's elements, each of which sticks or slides, must not decide."""
        strip = sf.Strip(length=length * star(ETA_B), eta_b=ETA_B)
        moment = share * 9.81 * strip.rho_a * strip.gravity_length**2
        way = sf.paths.low(strip, star(ETA_B)) if path == "low" else getattr(sf.paths, path)(strip)
        given = {"length": strip.length, "eta_b": ETA_B, "friction_moment": moment}
        rod, solid = (assess(PathInputs(**given, model=model), way, compare=False) for model in ("rod", "solid"))
        assert rod.stable
        assert solid.stable
        assert rod.shape_error == pytest.approx(solid.shape_error, rel=0.1)

    def test_friction_of_real_cloth_gives_the_fold_of_a_chain_of_masses(self) -> None:
        """0.2212 L* by verification/chain.py, whatever the elements: planned anew along the path they must keep what
        friction holds."""
        unit = star(ETA_B)
        strip = {"length": 12.0 * unit, "eta_b": ETA_B, "eta_m": ETA_B * (0.05 * unit) ** 2 / 12.0}
        moment, way = 1.114 * sf.Strip(**strip).material.scales["N"], sf.paths.circular(sf.Strip(**strip))
        asked = PathInputs(**strip, friction_moment=moment, model="rod", step=0.25 * unit)
        folds = [assess(asked, way, refinement=factor, compare=False).shape_error / unit for factor in (1.0, 2.0)]
        assert folds == pytest.approx([0.2212, 0.2212], rel=0.02)

    @pytest.mark.slow
    def test_friction_of_real_cloth_follows_a_push_on_a_thin_strip(self) -> None:
        """In the first steps up at 45 degrees elements stick; with half as long ones as much is lifted."""
        unit = star(ETA_B)
        strip = sf.Strip(length=12.0 * unit, eta_b=ETA_B, eta_m=ETA_B * (0.02 * unit) ** 2 / 12.0)
        up = unit * np.array([(-6.0, 0.0), (-5.2, 0.8)])
        path = FoldPath("up", strip.length, unit, GripperPath("up", pieces_through([("up", up)])))
        moment = 0.15 * strip.material.scales["N"]
        ends = [strip.assess(path, friction_moment=moment, model="rod", step=step * unit) for step in (0.3, 0.15)]
        assert all(end.stable and end.completed for end in ends)
        assert ends[0].lying_length == pytest.approx(ends[1].lying_length, rel=0.01)

    def test_what_friction_loses_is_stated_without_and_ranks_last(self) -> None:
        """A tenth of the least fabric's friction: the circular path snaps with it, too."""
        strip = sf.Strip(length=15.0 * star(ETA_B), eta_b=ETA_B)
        moment = 0.02 * 9.81 * strip.rho_a * strip.gravity_length**2
        given = asked(length=strip.length, eta_b_uncertainty=0.0, friction_moment=moment)
        found = planner.ranked(given, [followed(name, **given.model_dump()) for name in ("circular", "low")])
        assert [outcome.name for outcome in found] == ["low", "circular"]
        assert [outcome.with_friction for outcome in found] == [True, False]
        assert "all this without the friction" in found[1].costs(given)
        assert [outcome.lacks_friction(given) for outcome in found[:2]] == [False, True]

    @pytest.mark.slow
    def test_what_is_known_with_friction_is_kept(self) -> None:
        given = asked(length=9.5 * star(ETA_B), eta_b_uncertainty=0.05, friction_moment=1e-5)
        low = next(candidate for candidate in planner.candidates(given) if candidate.name == "low")
        bounds = outcome_of(given, low, given.strips[::2])
        found = outcome_of(given, low, given.strips, known=bounds)
        assert [verdict.asked.eta_b for verdict in found.verdicts] == [strip.eta_b for strip in given.strips]
        assert found.verdicts[::2] == bounds.verdicts
        assert bounds.with_friction
        assert found.with_friction

    def test_friction_that_is_not_well_known_widens_the_interval(self) -> None:
        """Nine tenths of the way to the fold with the most of it, where 95 of 100 evenly drawn are below."""
        exact: dict[str, Any] = {"eta_b_uncertainty": 0.0, "gripper_accuracy": 0.0, "layer_friction": 0.0}
        moment, unsure = 5e-4, 0.3
        given = asked(length=9.5 * star(ETA_B), friction_moment=moment, friction_uncertainty=unsure, **exact)
        low = next(candidate for candidate in planner.candidates(given) if candidate.name == "low")
        found = outcome_of(given, low, given.strips)
        strip, step = given.strips[1].model_dump(), 0.25 * star(ETA_B)  # a plan's
        usual, most = (
            assess(PathInputs(**strip, friction_moment=m, model="rod", step=step), low.path, compare=False).shape_error
            for m in (moment, (1.0 + unsure) * moment)
        )
        assert found.error == pytest.approx((usual, usual + 0.9 * (most - usual)), rel=0.02)
        with pytest.raises(InvalidInputError, match="friction_uncertainty"):
            asked(friction_uncertainty=unsure)

    def test_lengths_that_no_strip_of_the_interval_can_have(self) -> None:
        with pytest.raises(InvalidInputError, match="length"):  # 7.33 L* with the given eta_b, 6.81 with the least
            planner.choose(asked(length=0.22))


class TestFabric:
    def test_numbers_of_the_table(self) -> None:
        """B 1.2e-5 N m, 0.124 kg/m^2, 2HB 1.2e-3 N: Matsudaira et al., table 1; warp and weft of Feng et al., row 1."""
        cotton, other = sf.fabric(" cotton  BROAD"), sf.fabric("cantilever 1")
        assert cotton == sf.fabric("cotton broadcloth") == sf.fabric("cotton broad (A)")
        assert cotton.eta_b == pytest.approx(0.1238 / 1.1571847e-5)
        assert cotton.friction_moment == pytest.approx(6.08e-4, rel=1e-3)
        assert 0.1 < cotton.eta_b_uncertainty < 0.5
        ends = [0.0673 / 1.7799e-6, 0.0673 / 3.0762e-6]
        assert other.eta_b * (1.0 + other.eta_b_uncertainty) == pytest.approx(max(ends))
        assert other.eta_b * (1.0 - other.eta_b_uncertainty) == pytest.approx(min(ends))
        assert "friction_moment" not in other.values

    @pytest.mark.parametrize(
        ("name", "said"), [("polyester", "one of"), ("", "one of"), ("cottn broad", "did you mean")]
    )
    def test_unknown_and_ambiguous(self, name: str, said: str) -> None:
        with pytest.raises(InvalidInputError, match=rf"fabric = '{name}' .*{said}.*cotton broad \(A\)"):
            sf.fabric(name)

    def test_what_is_given_is_kept(self, capsys: pytest.CaptureFixture[str]) -> None:
        command = ["plan", "--length", "0.2", "--fabric", "cantilever 22", "--rho-a", "0.3", "--cores", "1", "--json"]
        assert main([*command, "--eta-b-uncertainty", "0.7"]) == 2
        assert "eta_b_uncertainty = 0.7" in capsys.readouterr().err
        assert main([*command, "--eta-b-uncertainty", "0"]) == 0
        inputs = json.loads(capsys.readouterr().out)["inputs"]
        assert inputs["eta_b"] == pytest.approx(14698, rel=1e-4)
        assert (inputs["rho_a"], inputs["eta_b_uncertainty"], inputs["friction_moment"]) == (0.3, 0.0, None)


class TestInTime:
    @pytest.mark.slow
    def test_slow_motion_is_quasi_static(self, strip: sf.Strip) -> None:
        """The deviation vanishes with the speed; the kinetic energy is at least that of what is carried."""
        fast, slow = (strip.plan(max_snap=0.0, speed=speed) for speed in (0.08, 0.02))
        assert fast.in_time is not None
        assert slow.in_time is not None
        for one, other in zip(fast.in_time.motions, slow.in_time.motions, strict=True):
            assert 1.2 * other.deviation < one.deviation < 0.6 * star(ETA_B)
            assert max(one.shape_error, other.shape_error) < 0.02 * star(ETA_B)
            # A free part of five L* is moved, with at least a third of the energy as if all had the gripper's speed.
            assert one.kinetic > 5.0 * star(1.2 * ETA_B) * 0.08**2 / 6.0
            assert 4.0 * other.kinetic < one.kinetic
        found = fast.in_time
        assert found.motions[found.worst].deviation == max(moved.deviation for moved in found.motions)
        assert "stays with its static states" in str(fast)
        assert set(fast.to_dict()["in_time"]) == {"motions"}
        assert len(fast.to_dict()["in_time"]["motions"]) == fast.to_dataset()["planned_kinetic"].size == 3


class TestFriction:
    """A path that friction has to hold, with the solver."""

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("length", "uncertainty", "which", "kappa_y", "moment"),
        [(0.36, 0.05, 2, 10.0, 1.1e-4), (0.562, 0.2, 0, 7.2, 8.1e-4)],
    )
    def test_what_holds(self, length: float, uncertainty: float, which: int, kappa_y: float, moment: float) -> None:
        """Against verdicts: a strip that the path pushes too far, and one that touches too late."""
        strip = asked(length=length, eta_b_uncertainty=uncertainty).strips[which]
        path = sf.paths.r_path(asked(length=length)).curve.scaled(1.0 / strip.gravity_length)
        followed = (strip.material, strip.length, path)
        assert lost_with([followed], 1.25 * moment, kappa_y) is None
        assert lost_with([followed], 0.75 * moment, kappa_y) == followed
        given = {"friction_moment": 0.75 * moment, "yield_curvature": kappa_y}
        assert not assess_path(*followed, **given, model="rod", refinement=0.7).stable

    def test_a_spring_that_cannot_be_followed_is_refused(self) -> None:
        """Taken without friction instead, the fold was said to be a fifth as far off."""
        least = 5.3e-3 * ETA_B / 4.0
        with pytest.raises(InvalidInputError, match=rf"at least {least:.4g} 1/m, M_0 over 4 B"):
            asked(friction_moment=5.3e-3, yield_curvature=0.99 * least)
        assert asked(friction_moment=5.3e-3, yield_curvature=1.01 * least).yield_curvature > least


class TestFiles:
    def test_angles(self, long: FoldingPlan) -> None:
        t, x, z, angle = long.waypoints.T
        assert (angle[0], angle[-1]) == (0.0, pytest.approx(180.0, abs=0.5))
        assert np.abs(np.diff(angle)).max() < 15.0
        assert np.all(np.diff(t) > 0.0)
        assert (x[0], x[-1], z[0], z[-1]) == pytest.approx((-0.25, 0.25, 0.0, 0.0), abs=1e-9)
        # Lifted without horizontal force, and little, a strip is a line of weight: the end is turned upwards.
        assert 0.0 < angle[1] < 15.0

    def test_written_whole_or_not_at_all(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        csv, out = tmp_path / "a.csv", tmp_path / "a.json"
        command = ["plan", "--length", "0.26", "--eta-b", "3780", "--cores", "1", "--csv", str(csv), "--json", str(out)]
        assert main([*command, "--margin", "0.05", "--eta-b-uncertainty", "0"]) == 6
        assert "no path folds the strip as asked" in capsys.readouterr().err
        assert main([*command[:-1], str(tmp_path / "a.yaml")]) == 2
        assert not any(tmp_path.iterdir())
        drawing = tmp_path / "a.png"
        command += ["--tool", "0.5"]  # none for the low path
        assert main([*command, "--speed", "0.2", "--acceleration", "1", "--plot", str(drawing)]) == 0
        assert drawing.stat().st_size > 10_000
        assert "in time" in capsys.readouterr().out
        found = json.loads(out.read_text(encoding="utf-8"))
        assert found["path"] == "lifted triangle"
        assert found["units"]["angle"] == "degree"
        rows = np.loadtxt(csv, delimiter=",", skiprows=3)
        np.testing.assert_allclose(rows[:, 1], found["waypoints"]["x"], atol=1e-8)
        # A straight edge down, from rest to rest.
        edge, apex = 0.13 * np.sqrt(2.0), int(rows[:, 2].argmax())
        assert rows[apex, 1:3] == pytest.approx([0.0, 0.13], abs=1e-8)
        assert rows[-1, 0] - rows[apex, 0] == pytest.approx(edge / 0.2 + 0.2, rel=1e-3)
        back = sf.paths.read(csv, sf.Strip(length=0.26, eta_b=ETA_B))
        assert len(back.curve.pieces) == 3


class TestOwnPath:
    def test_it_is_ranked_among_the_known_ones(self) -> None:
        strip = sf.Strip(length=0.26, eta_b=ETA_B)
        found = by_name(strip.plan(eta_b_uncertainty=0.0, path=sf.paths.triangular(strip), cores=1))
        given, known = found.pop("given"), found["triangular"]
        assert (given.error, given.drop, given.margin) == (known.error, known.drop, known.margin)
        assert given.candidate.made == "triangular"
        assert len(found) > 3

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--path", "none.csv"], "path = 'none.csv' cannot be used"),
            (["--path", "mine.csv", "--csv", "mine.csv"], "csv = 'mine.csv' cannot be used; allowed: another file"),
            (["--path", "mine.csv", "--unit", "mm"], "unit"),
            (["--smooth", "0.001"], "smooth = 0.001 cannot be used; allowed: this together with path"),
        ],
    )
    def test_what_cannot_be_one(
        self,
        options: list[str],
        words: str,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        monkeypatch.chdir(tmp_path)
        (tmp_path / "mine.csv").write_text("t,x [m],z [m]\n0,-0.13,0\n1,0,0.13\n2,0.13,0\n")
        assert main(["plan", "--length", "0.26", "--eta-b", "3780", *options]) == 2
        assert words in capsys.readouterr().err

    def test_of_another_strip(self, strip: sf.Strip) -> None:
        with pytest.raises(InvalidInputError, match=r"a path for a length of 0\.26 m"):
            strip.plan(path=sf.paths.triangular(sf.Strip(length=0.26, eta_b=ETA_B)))


class TestReport:
    def test_a_page_in_one_file(self, long: FoldingPlan, tmp_path: Path) -> None:
        long.report(tmp_path / "plan.html")
        page = (tmp_path / "plan.html").read_text(encoding="utf-8")
        assert page.count("<svg") == 3
        assert long.best.candidate.made in page
        assert all(outcome.name in page for outcome in long.outcomes)
        assert all(f"{strip.eta_b:.4g}</td>" in page for strip in long.asked.strips)
        assert f"{long.margin:.4g} m" in page
        assert page.count('class="worst"') == 1
        # Nothing is loaded from elsewhere.
        assert not re.search(r"""(src|href)\s*=\s*["'](?!#|data:)|url\((?!#)|<script|@import""", page)


def test_a_wrinkled_strip_is_carried_higher() -> None:
    """The push falls with the height; a very low carry makes usual wrinkles grow."""
    strip, found = sf.Strip(length=0.36, eta_b=3780), []
    for flatness in (5e-4, 0.04, 0.1):
        found.append(followed("low", length=0.36, flatness=flatness))
    usual, wrinkled, rough = found
    assert wrinkled.path.places[:, 2].max() > 1.01 * usual.path.places[:, 2].max()
    assert min(usual.flatness_ratio, wrinkled.flatness_ratio) > 1.0
    assert strip.assess(sf.paths.low(strip, 0.007), model="rod").flatness_ratio < 1.0
    assert rough.flatness_ratio < 1.0
    assert "ruck" in rough.costs(asked(length=0.36, flatness=0.1))
