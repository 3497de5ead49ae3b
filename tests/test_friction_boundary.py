"""The ends of the advance with friction: the law for little of it, another discretisation, assess, the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from assessing import assess_path
from stripfold import elastica
from stripfold.ask.friction_boundary import THICKNESS, friction_boundary
from stripfold.base.material import Material
from stripfold.cli import main
from stripfold.elastica.half_fold import states_no_horizontal_force
from stripfold.files import store
from stripfold.paths.curve import GripperPath, pieces_through

LENGTH = 9.0
COMMAND = ["map", "--length", "0.24", "--eta-b", "3780", "--rho-a", "0.2"]


def test_little_friction_delays_by_the_law() -> None:
    """Truth: lambda_c of the elastica and its delay to first order, of which kappa_y takes up to a tenth."""
    moment = 0.005
    found = friction_boundary(LENGTH, moment)
    assert found.snaps.any()
    # Friction raises the height from which on a strip snaps.
    assert np.all(found.z[found.snaps] > elastica.touch_limit())
    assert np.all(np.diff(found.snaps.astype(int)) >= 0)
    for z, advance in zip(found.z[found.snaps], found.advance[found.snaps], strict=True):
        delay = advance - elastica.critical(z).state.advance
        assert 0.85 < delay / (moment * elastica.friction_delay(z)) < 1.02


def test_assess_along_the_same_way() -> None:
    material = Material(3780.0)
    thin = Material(3780.0, eta_m=3780.0 * (THICKNESS * material.gravity_length) ** 2 / 12.0)
    moment = 0.02
    found = friction_boundary(12.0, moment)
    (z, advance), half = (found.z[-1], found.advance[-1]), 6.0
    assert found.snaps[-1]
    line = [(s.advance - half, s.gripper[1]) for s in states_no_horizontal_force(11.0) if s.gripper[1] < z - 0.05]
    line.append((elastica.state_no_horizontal_force(z).advance - half, z))
    carry = np.array([line[-1], (line[-1][0] + 12.0, z)])
    path = GripperPath("lift and carry", pieces_through([("lift", np.array([(-half, 0.0), *line])), ("carry", carry)]))
    in_si = moment * thin.scales["N"]
    verdict = assess_path(thin, 12.0 * thin.gravity_length, path, friction_moment=in_si, model="rod")
    (event,) = verdict.critical
    assert event["x"] / thin.gravity_length + half == pytest.approx(advance, abs=0.005)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, picture = tmp_path / "map.nc", tmp_path / "map.png"
    asked = [*COMMAND, "--friction-moment", "1e-5", "--json", "--output", str(data), "--plot", str(picture)]
    assert main(asked) == 0
    said = json.loads(capsys.readouterr().out)
    assert "lifted on the line" in said["friction_history"]
    assert len(said["friction_boundary"]) == len(said["friction_snap"]) >= 2
    assert said["units"]["friction_moment"] == "N"
    stored = store.read(data)
    assert stored.attrs["friction_moment"] == 1e-5
    places = np.stack([stored["friction_x"], stored["friction_z"]], axis=1)
    np.testing.assert_allclose(places, said["friction_boundary"], rtol=1e-9)
    unit = Material(3780.0).gravity_length
    alone = friction_boundary(0.24 / unit, 1e-5 / (0.2 * 9.81 * unit**2))
    np.testing.assert_allclose(places[:, 0] + 0.12, unit * alone.advance, rtol=1e-6)
    assert picture.is_file()


@pytest.mark.parametrize("moment", ["-1e-3", "0", "0.1", "nan"])
def test_no_such_friction(moment: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*COMMAND, f"--friction-moment={moment}"]) == 2
    told = capsys.readouterr().err
    assert "friction_moment" in told
    assert told.count("\n") == 1
