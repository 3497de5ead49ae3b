"""What `stripfold simulate` is asked for: units, defaults, and errors that name the key."""

from __future__ import annotations

from pathlib import Path

import pytest

from stripfold.ask.collapse import in_solver_units
from stripfold.ask.inputs import Release, Simulation
from stripfold.base.errors import InvalidInputError

STRIP = {"length": 0.6, "height": 0.15, "eta_b": 3780.0}


def test_solver_units() -> None:
    asked = Simulation(**STRIP, disturbance=-0.02, speed=0.1, air=3.0, stiffness=0.01, until="touch")
    star = (3780.0 * 9.81) ** (-1 / 3)
    time = (star / 9.81) ** 0.5
    fall = in_solver_units(asked, asked.material)
    assert asked.time_unit == pytest.approx(time)
    assert fall.disturbance == pytest.approx(-0.02 * time / star)
    assert fall.speed == pytest.approx(0.1 * time / star)
    assert fall.damping.air == pytest.approx(3.0 * time)
    assert fall.damping.stiffness == pytest.approx(0.01 / time)
    assert not fall.to_rest


def test_resolved_keys_give_the_same() -> None:
    asked = Simulation(**STRIP, air=1.0)
    assert Simulation(**asked.as_config()) == asked


@pytest.mark.parametrize("text", ["- 1\n- 2\n", "length: [", "", "just words"])
def test_a_file_that_is_no_scene(tmp_path: Path, text: str) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(text)
    with pytest.raises(InvalidInputError, match=r"scene\.yaml"):
        Simulation.read(path)


def test_no_file() -> None:
    with pytest.raises(InvalidInputError, match="nowhere"):
        Simulation.read("nowhere.yaml")


def test_the_projects_own_scene() -> None:
    asked = Simulation.read(Path(__file__).parents[1] / "workflow/config/collapse.yaml")
    assert Release(**{key: getattr(asked, key) for key in Release.model_fields}) == Release()
