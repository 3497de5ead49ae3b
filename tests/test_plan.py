"""A path for a strip whose eta_b is not well known: which one, its margin, its motion, its files."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stripfold as sf
from assessing import assess_path
from stripfold import elastica
from stripfold.ask import plan as planner
from stripfold.ask.friction import lost_with
from stripfold.ask.inputs import PlanInputs
from stripfold.ask.map import gripper_map
from stripfold.ask.plan import FoldingPlan
from stripfold.base.errors import InvalidInputError, NoPathError
from stripfold.cli import main
from stripfold.paths.geometric import triangular

ETA_B = 3780.0
LIMIT = 1.5861708


def star(eta_b: float) -> float:
    return float((9.81 * eta_b) ** (-1.0 / 3.0))


@pytest.fixture(scope="module")
def strip() -> sf.Strip:
    return sf.Strip(length=0.36, eta_b=ETA_B)


@pytest.fixture(scope="module")
def plan(strip: sf.Strip) -> FoldingPlan:
    return strip.plan(layers_may_slide=True)


def asked(**given: Any) -> PlanInputs:
    return PlanInputs(**{"length": 0.5, "eta_b": ETA_B, **given})


class TestMargin:
    def test_of_a_short_strip_is_the_distance_to_critical_points(self) -> None:
        length = 9.4
        found = planner.margin_on(triangular(length), gripper_map(length))
        heights = np.linspace(LIMIT, 2.5, 60)
        wall = np.array([(elastica.critical(z).state.advance, z) for z in heights[1:]])
        # Down the second edge, up to where the sag lands.
        z = np.linspace(length / 2.0, 0.0, 2000)
        touch = np.array([elastica.critical(h).state.advance for h in (1.0, 1.4)])
        edge = np.column_stack([length - z, z])
        lands = edge[:, 0] > np.interp(z, (1.0, 1.4), touch)
        edge = edge[: int(np.argmax(lands & (z < 1.5)))]
        away = np.linalg.norm(edge[:, None] - wall, axis=2).min()
        assert found == pytest.approx(away, abs=0.03)


class TestChoice:
    def test_low_path_keeps_its_distance_for_the_softest_strip(self, plan: FoldingPlan) -> None:
        assert plan.path.name == "low"
        assert plan.waypoints[:, 2].max() == pytest.approx(star(ETA_B), rel=1e-6)
        assert plan.margin == pytest.approx(LIMIT * star(1.2 * ETA_B) - star(ETA_B), rel=1e-6)
        assert all(verdict.stable and verdict.completed for verdict in plan.choice.verdicts)
        assert max(verdict.shape_error for verdict in plan.choice.verdicts) < 1e-3

    def test_lengths_that_no_strip_of_the_interval_can_have(self) -> None:
        with pytest.raises(InvalidInputError, match="length"):  # 7.33 L* with the given eta_b, 6.81 with the least
            planner.choose(asked(length=0.22))


class TestInTime:
    @pytest.mark.slow
    def test_slow_motion_is_quasi_static(self, strip: sf.Strip) -> None:
        """The deviation vanishes with the speed; the kinetic energy is at least that of what is carried."""
        fast, slow = (strip.plan(layers_may_slide=True, speed=speed) for speed in (0.08, 0.02))
        assert fast.choice.in_time is not None
        assert slow.choice.in_time is not None
        for one, other in zip(fast.choice.in_time.motions, slow.choice.in_time.motions, strict=True):
            assert 1.2 * other.deviation < one.deviation < 0.6 * star(ETA_B)
            assert max(one.shape_error, other.shape_error) < 0.02 * star(ETA_B)
            # A free part of five L* is moved, with at least a third of the energy as if all had the gripper's speed.
            assert one.kinetic > 5.0 * star(1.2 * ETA_B) * 0.08**2 / 6.0
            assert 4.0 * other.kinetic < one.kinetic
        found = fast.choice.in_time
        assert found.motions[found.worst].deviation == max(moved.deviation for moved in found.motions)
        assert "stays with its static states" in str(fast)
        assert set(fast.to_dict()["in_time"]) == {"motions"}
        assert len(fast.to_dict()["in_time"]["motions"]) == fast.to_dataset()["planned_kinetic"].size == 3


class TestFriction:
    """A path that friction has to hold, with the solver."""

    @pytest.mark.parametrize(
        ("length", "uncertainty", "which", "kappa_y", "moment"),
        [(0.36, 0.05, 2, 10.0, 1.1e-4), pytest.param(0.562, 0.2, 0, 7.2, 8.1e-4, marks=pytest.mark.slow)],
    )
    def test_what_holds(self, length: float, uncertainty: float, which: int, kappa_y: float, moment: float) -> None:
        """Against verdicts: a strip that the path pushes too far, and one that touches too late."""
        strip = asked(length=length, eta_b_uncertainty=uncertainty).strips[which]
        path = planner.scaled(sf.paths.r_path(asked(length=length)), strip.gravity_length)
        followed = (strip.material, strip.length, path)
        assert lost_with([followed], 1.25 * moment, kappa_y) is None
        assert lost_with([followed], 0.75 * moment, kappa_y) == followed
        given = {"friction_moment": 0.75 * moment, "yield_curvature": kappa_y}
        assert not assess_path(*followed, **given, model="rod", refinement=0.7).stable

    @pytest.mark.parametrize(
        ("length", "uncertainty", "moment"),
        [(14.0, 0.2, 0.040), (20.0, 0.05, 0.057), (30.0, 0.1, 0.113), (40.0, 0.2, 0.2)],
    )
    def test_without_a_friction_moment_an_amount_is_named(
        self, length: float, uncertainty: float, moment: float
    ) -> None:
        """Truth: M_0 by searches on the path, rho_a g L*^2; a quarter more is asked for."""
        given = asked(length=length * star(ETA_B), eta_b_uncertainty=uncertainty, margin=0.0)
        with pytest.raises(NoPathError) as caught:
            planner.choose(given)
        about = re.search(r"about (\S+) N would do", caught.value.refused[-1].reason)
        assert about is not None
        scale = given.material.force_scale * star(ETA_B)
        assert 0.7 < float(about[1]) / (1.25 * moment * scale) < 1.4


class TestFiles:
    def test_angles(self, plan: FoldingPlan) -> None:
        t, x, z, angle = plan.waypoints.T
        assert (angle[0], angle[-1]) == (0.0, pytest.approx(180.0, abs=0.5))
        assert np.abs(np.diff(angle)).max() < 15.0
        assert np.all(np.diff(t) > 0.0)
        assert (x[0], x[-1], z[0], z[-1]) == pytest.approx((-0.18, 0.18, 0.0, 0.0), abs=1e-9)
        # Lifted without horizontal force, and little, a strip is a line of weight: the end is turned upwards.
        assert 0.0 < angle[1] < 15.0

    def test_written_whole_or_not_at_all(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        csv, out = tmp_path / "a.csv", tmp_path / "a.json"
        command = ["plan", "--length", "0.26", "--eta-b", "3780", "--csv", str(csv), "--json", str(out)]
        assert main([*command, "--margin", "0.05"]) == 6
        assert "no path keeps 50 mm" in capsys.readouterr().err
        assert main([*command[:-1], str(tmp_path / "a.yaml")]) == 2
        assert not any(tmp_path.iterdir())
        drawing = tmp_path / "a.png"
        assert main([*command, "--speed", "0.2", "--acceleration", "1", "--plot", str(drawing)]) == 0
        assert drawing.stat().st_size > 10_000
        assert "in time" in capsys.readouterr().out
        found = json.loads(out.read_text(encoding="utf-8"))
        assert found["path"] == "triangular"
        assert found["units"]["angle"] == "degree"
        rows = np.loadtxt(csv, delimiter=",", skiprows=3)
        np.testing.assert_allclose(rows[:, 1], found["waypoints"]["x"], atol=1e-8)
        # A straight edge down, from rest to rest.
        edge, apex = 0.13 * np.sqrt(2.0), int(rows[:, 2].argmax())
        assert rows[apex, 1:3] == pytest.approx([0.0, 0.13], abs=1e-8)
        assert rows[-1, 0] - rows[apex, 0] == pytest.approx(edge / 0.2 + 0.2, rel=1e-3)
        back = sf.paths.read(csv, sf.Strip(length=0.26, eta_b=ETA_B))
        assert len(back.curve.pieces) == 3


class TestReport:
    def test_a_page_in_one_file(self, plan: FoldingPlan, tmp_path: Path) -> None:
        plan.report(tmp_path / "plan.html")
        page = (tmp_path / "plan.html").read_text(encoding="utf-8")
        assert page.count("<svg") == 3
        assert plan.choice.reason in page
        assert all(f"{strip.eta_b:.4g}</td>" in page for strip in plan.asked.strips)
        assert f"{plan.margin:.4g} m" in page
        assert page.count('class="worst"') == 1
        # Nothing is loaded from elsewhere.
        assert not re.search(r"""(src|href)\s*=\s*["'](?!#|data:)|url\((?!#)|<script|@import""", page)


def test_a_wrinkled_strip_is_carried_higher() -> None:
    """The push falls with the height; a very low carry makes usual wrinkles grow."""
    strip = sf.Strip(length=0.36, eta_b=3780)
    usual, wrinkled = (strip.plan(layers_may_slide=True, flatness=flatness) for flatness in (5e-4, 0.04))
    assert wrinkled.waypoints[:, 2].max() > 1.01 * usual.waypoints[:, 2].max()
    assert all(verdict.flatness_ratio > 1.0 for plan in (usual, wrinkled) for verdict in plan.choice.verdicts)
    assert strip.assess(sf.paths.low(strip, 0.007), model="rod").flatness_ratio < 1.0
    with pytest.raises(sf.NoPathError, match="would have to be at least"):
        strip.plan(layers_may_slide=True, flatness=0.1)
