"""What a verdict says of the end of a path and of the push on the way, and paths at the edge of what is possible."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stripfold as sf
from assessing import assess_path
from stripfold import elastica
from stripfold.base.material import Material
from stripfold.cli import main
from stripfold.paths import geometric, low_path

MATERIAL = Material(5000.0)
UNIT, FORCE = MATERIAL.gravity_length, MATERIAL.force_scale
LENGTH = 9.0 * UNIT
START = (-LENGTH / 2.0, 0.0)
LOW = low_path.low(9.0, 1.0).sampled(0.1)[1] * UNIT
"""Places on a low path, m."""
ANGLE = np.linspace(0.0, 0.5 * np.pi, 40)


def written(file: Path, rows: Any) -> str:
    table = "".join(f"{t},{x:.9f},{max(z, 0.0):.9f}\n" for t, (x, z) in enumerate(rows))
    file.write_text(f"t,x,z\n{table}", encoding="utf-8")
    return str(file)


def scaled_to(distance: float) -> Any:
    """The low path, all of it drawn together to end that much short of its place."""
    return (LOW - START) * [1.0 - distance / LENGTH, 1.0] + START


@pytest.mark.parametrize(
    ("rows", "folded"),
    [
        ([START, (START[0] + 0.005, 0.01)], "no: the end is 241.1 mm"),
        (np.column_stack([START[0] * np.cos(ANGLE), 1.2 * UNIT * np.sin(ANGLE)]), "no: the end is 127."),
        (scaled_to(0.012), "no: the end is 12.0 mm"),
        (scaled_to(0.004), "yes: the end is 4.0 mm"),
        (LOW[(LOW[:, 1] > 0.002) | (LOW[:, 0] < 0.0)], "yes: the end is 2."),
        (LOW, "yes: the end is 0.0 mm"),
    ],
    ids=["lifted", "mid-air", "short", "nearly", "up", "there"],
)
def test_a_path_is_checked_for_its_fold(
    tmp_path: Path, rows: Any, folded: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """All of them are stable and followed to their ends; a robot's log may end 5 mm off."""
    strip = ["--length", str(LENGTH), "--eta-b", "5000", "--model", "rod"]
    assert main(["assess", written(tmp_path / "path.csv", rows), *strip, "--check"]) == int(folded.startswith("no"))
    said = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert (said["stable"], said["completed"]) == ("yes", "yes")
    assert said["folded"].startswith(folded)


def test_an_end_in_its_place_does_not_make_a_fold() -> None:
    """Friction between the layers holds what the circular path lays down 2.05 L* off (docs/physics.md, section 8)."""
    path, moment = geometric.circular(14.0), 0.02 * FORCE * UNIT
    found = assess_path(
        MATERIAL,
        14.0 * UNIT,
        path,
        friction_moment=moment,
        layer_friction=0.4,
        refinement=3.0,
        model="rod",
        compare=False,
    )
    assert (found.completed, found.folded) == (True, False)
    assert found.end_error < 1e-9
    assert found.shape_error == pytest.approx(2.05 * UNIT, rel=0.05)


def test_a_strip_without_a_fold_is_not_folded(tmp_path: Path) -> None:
    strip = sf.Strip(length=7.0 * UNIT, eta_b=5000.0)
    found = strip.assess(
        sf.paths.read(written(tmp_path / "p.csv", geometric.triangular(7.0).sampled(1.0)[1] * UNIT), strip), model="rod"
    )
    assert found.completed
    assert not found.folded
    assert "no folded state is known of a strip of this length" in str(found)


def assessed(path: Any, length: float = 9.0) -> Any:
    return assess_path(MATERIAL, length * UNIT, path, model="rod", compare=False)


def test_a_start_at_45_degrees_pushes() -> None:
    """44 to 53 rho_a g L* at 0.16 to 0.2 L* by independent programs; a bump as Hobbs has it."""
    found = assessed(geometric.triangular(9.0))
    assert 44.0 < found.peak_push / FORCE < 53.0
    assert 0.16 < found.push_z / UNIT < 0.2
    assert found.bump == pytest.approx(15.7 * UNIT / (found.peak_push / FORCE) ** 2, rel=1e-3)


def test_a_pull_is_no_push() -> None:
    """A circular start draws the strip taut, and pushes later with less than a weight; drawn up it is not pushed."""
    found = assessed(geometric.circular(14.0), 14.0)
    assert found.peak_hold > 5.0 * FORCE
    assert found.peak_push < FORCE


def test_a_low_path_pushes_as_the_elastica() -> None:
    found = assessed(low_path.low(9.0, 0.7))
    push = -min(state.force_x for state in elastica.x_axis_branch(0.7, max_step=0.05))
    assert found.peak_push == pytest.approx(push * FORCE, rel=0.03)
    assert found.push_z == pytest.approx(0.7 * UNIT, rel=1e-3)


@pytest.mark.parametrize(("length", "eta_b", "margin"), [(9.0, 5000.0, 0.1), (8.0, 500.0, 0.3), (8.3, 50000.0, 0.2)])
def test_no_plan_makes_a_small_bump_grow(length: float, eta_b: float, margin: float) -> None:
    """The triangular path is stable for these and keeps the margin, but its start pushes them into a ruck."""
    unit = Material(eta_b).gravity_length
    strip = sf.Strip(length=length * unit, eta_b=eta_b)
    plan = strip.plan(margin=margin * unit)
    assert plan.path.name == "triangular"
    assert all(found.stable and found.folded and found.bump > 5e-4 for found in plan.choice.verdicts)
    assert max(found.peak_push / (9.81 * unit) for found in plan.choice.verdicts) < 1.4


@pytest.mark.parametrize(
    "rows",
    [
        [(0.0, 0.0), (0.05, 0.0)],
        [(0.0, 0.0), (0.01, 0.0), (0.02, 0.02)],
        [(0.0, 0.0), (0.0001, 0.0), (0.0005, 0.005)],
    ],
    ids=["drag", "drag and lift", "slide and lift"],
)
@pytest.mark.parametrize("law", [{}, {"friction_moment": 1e-5}, {"layer_friction": 0.3}])
def test_what_begins_on_the_floor_is_refused(tmp_path: Path, rows: Any, law: dict[str, Any]) -> None:
    strip = sf.Strip(length=LENGTH, eta_b=5000.0)
    path = sf.paths.read(written(tmp_path / "path.csv", np.array(rows) + START), strip)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(sf.InvalidInputError, match="lifts the end of the strip from its start"):
            strip.assess(path, model="rod", **law)


@pytest.mark.parametrize(
    "rows",
    [
        [(0.0, 0.0), (0.0001, 0.02)],
        [(0.0, 0.0), (1e-5, 1e-5)],
        [(0.0, 0.0), (0.02, 1e-9)],
        [(0.0, 0.0), (0.01, 0.02), (0.02, 0.0), (0.05, 0.0), (0.06, 0.02)],
    ],
    ids=["up", "tiny", "along the floor", "set down and dragged"],
)
@pytest.mark.parametrize("law", [{}, {"friction_moment": 1e-5}, {"layer_friction": 0.3}])
def test_extreme_paths_are_followed_without_a_warning(tmp_path: Path, rows: Any, law: dict[str, Any]) -> None:
    strip = sf.Strip(length=LENGTH, eta_b=5000.0)
    path = sf.paths.read(written(tmp_path / "path.csv", np.array(rows) + START), strip)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not strip.assess(path, model="rod", **law).folded
