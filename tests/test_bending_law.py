"""A bending law that is not linear, on rod and solid, against the elastica with that law."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stripfold as sf
from stripfold.ask.assess import assess
from stripfold.ask.friction import refinement_of
from stripfold.ask.inputs import PathInputs
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.cli import main
from stripfold.follow.memory import FIRST_WITH_FRICTION, effects_of, load_path
from stripfold.follow.statics import StripModel
from stripfold.follow.track import End
from stripfold.paths.curve import GripperPath, pieces_through
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


ETA_B, RHO = 3770.0, 0.2
STRIP = sf.Strip(length=0.36, eta_b=ETA_B, rho_a=RHO)
PATH = sf.paths.low(STRIP, 0.03)
UNIT = STRIP.gravity_length
MOMENT = RHO * 9.81 * UNIT**2
"""rho_a g L*^2, N."""


def table(file: Path, rows: dict[str, Array]) -> str:
    np.savetxt(file, np.column_stack([*rows.values()]), delimiter=",", header=",".join(rows), comments="")
    return str(file)


def touch(strip: sf.Strip, path: sf.paths.FoldPath, **given: Any) -> float:
    """x of the first touch, without another mesh beside it."""
    asked = {"length": strip.length, "eta_b": strip.eta_b, "rho_a": RHO, **given}
    return assess(PathInputs(**asked), path, compare=False).touch_x


class TestOnAPath:
    KAPPA = np.linspace(0.0, 12.0, 60)[1:]
    """1/L*."""

    def test_the_law_is_the_tables_whatever_eta_b(self, tmp_path: Path) -> None:
        law = table(tmp_path / "law.csv", {"curvature": self.KAPPA / UNIT, "moment": MOMENT * self.KAPPA})
        linear = touch(STRIP, PATH, model="rod", friction_moment=1e-9)  # in steps, too
        assert touch(STRIP, PATH, model="rod", bending_test=law) == pytest.approx(linear, abs=1e-6)
        rows = {"curvature": np.append(0.0, self.KAPPA) / UNIT, "moment": MOMENT * np.append(0.0, self.KAPPA)}
        law = table(tmp_path / "from_0.csv", rows)
        assert touch(STRIP, PATH, model="rod", bending_test=law) == pytest.approx(linear, abs=1e-6)
        other = sf.Strip(length=0.36, eta_b=1.5 * ETA_B, rho_a=RHO)
        path = sf.paths.read(path_file(tmp_path), other)
        plain, with_law = (touch(other, path, model="rod", bending_test=file) for file in (None, law))
        assert with_law == pytest.approx(linear, abs=1.5e-3)  # half a step
        assert abs(plain - linear) > 5e-3

    def test_by_the_command_line(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        law = table(tmp_path / "law.csv", {"curvature": self.KAPPA / UNIT, "moment": MOMENT * np.sqrt(self.KAPPA)})
        asked = ["--length", "0.36", "--eta-b", f"{ETA_B}", "--rho-a", f"{RHO}", "--model", "rod", "--json"]
        assert main(["assess", str(path_file(tmp_path)), *asked, "--bending-test", law, "--quiet"]) == 0
        found = json.loads(capsys.readouterr().out)["touch_x"]
        assert found == pytest.approx(touch(STRIP, PATH, model="rod", bending_test=law), abs=1e-6)

    @pytest.mark.slow
    def test_a_loop_is_its_mean_and_friction(self, tmp_path: Path) -> None:
        moment, half = MOMENT * self.KAPPA, 0.03 * MOMENT
        rows = {"curvature": self.KAPPA / UNIT, "moment": moment + half, "unloading": moment - half}
        loop = touch(STRIP, PATH, model="rod", bending_test=table(tmp_path / "loop.csv", rows))
        alone = touch(STRIP, PATH, model="rod", friction_moment=half)
        assert loop == pytest.approx(alone, abs=3e-4)
        assert abs(loop - touch(STRIP, PATH, model="rod")) > 1e-3

    def test_a_cloth_that_softens_touches_earlier(self, tmp_path: Path) -> None:
        soft = 4.0 * (1.0 - np.exp(-self.KAPPA / 4.0)) + 0.05 * self.KAPPA
        law = table(tmp_path / "soft.csv", {"curvature": self.KAPPA / UNIT, "moment": MOMENT * soft})
        rod, solid = (touch(STRIP, PATH, model=model, bending_test=law) for model in ("rod", "solid"))
        assert rod == pytest.approx(solid, abs=3e-4)
        assert rod < touch(STRIP, PATH, model="rod") - 5e-3

    @pytest.mark.parametrize(
        ("rows", "given", "words"),
        [
            ("curvature,moment\n1,1e-5\n2,5e-6\n", {}, r"moment = 5e-06 .* rise from 0; row 3 of law\.csv"),
            ("curvature,moment\n0,0\n1,1e-5\n1,2e-5\n", {}, r"curvature = 1\.0 .*; row 4 of law\.csv"),
            ("curvature,moment\n0,0\n1,1e-5\n", {}, "two rows or more with a curvature"),
            ("curvature,moment\n1,1e-5\n", {}, "2 to 10000 rows"),
            ("kappa,m,n\n1,1e-5,1\n2,2e-5,1\n", {}, "curvature,moment"),
            ("", {"fall": True}, "nothing together with fall"),
            ("", {"table_friction": 0.5}, "nothing together with table_friction"),
            ("", {"gripper": "fixed"}, "hinge together with bending_test"),
            (
                "curvature,moment,unloading\n1,2e-5,1e-5\n2,3e-5,2e-5\n",
                {"friction_moment": 1e-5},
                "none with the unloading of a bending test",
            ),
        ],
    )
    def test_what_is_refused(self, tmp_path: Path, rows: str, given: dict[str, Any], words: str) -> None:
        file = tmp_path / "law.csv"
        file.write_text(rows)
        with pytest.raises(sf.InvalidInputError, match=words):
            STRIP.assess(PATH, bending_test=file, **given)


def path_file(folder: Path) -> Path:
    """The path as a table, for strips of another eta_b."""
    PATH.to_csv(folder / "low.csv")
    return folder / "low.csv"


@pytest.mark.parametrize(
    ("end", "length", "thickness", "moment"),
    [
        ((0.097, 0.025), 12.74, 0.0358, 0.589),
        ((0.022, 0.098), 8.46, 0.0429, 0.147),
    ],
)
def test_elements_planned_anew_under_friction_that_is_held(
    end: tuple[float, float], length: float, thickness: float, moment: float
) -> None:
    """In the first steps: the branch with held friction was parallel to the plane in which it was looked for."""
    start, lifted = np.array([-length / 2.0, 0.0]), []
    path = GripperPath("up", pieces_through([("up", np.array([start, start + end]))]))
    for kind in ("rod", "solid"):
        mesh = StripModel(length, thickness, kind=kind).contact_mesh(refinement_of(kind, moment), memory=True)
        found = load_path(mesh, path, effects_of("hysteresis", moment), 0.05, begin=FIRST_WITH_FRICTION)
        assert found.end is End.PATH
        lifted.append(found.points[-1].contact[-1])
    assert lifted[1] == pytest.approx(lifted[0], rel=0.1)
