"""The ends of the advance with friction: the law for little of it, another discretisation, assess, the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from stripfold import elastica
from stripfold.ask.friction import friction_boundary
from stripfold.cli import main
from stripfold.files import store

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
    assert picture.is_file()


@pytest.mark.parametrize("moment", ["-1e-3", "0", "0.1", "nan"])
def test_no_such_friction(moment: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*COMMAND, f"--friction-moment={moment}"]) == 2
    told = capsys.readouterr().err
    assert "friction_moment" in told
    assert told.count("\n") == 1
