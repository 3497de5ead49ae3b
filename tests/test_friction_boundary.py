"""The ends of the advance with friction: the law for little of it, and the command that shows them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from stripfold import elastica
from stripfold.base.material import Material
from stripfold.cli import main
from stripfold.files import store

ETA_B, RHO_A = 3780.0, 0.2
MATERIAL = Material(ETA_B, rho_a=RHO_A)
LENGTH = 9.0 * MATERIAL.gravity_length
COMMAND = ["map", "--length", f"{LENGTH:.12g}", "--eta-b", f"{ETA_B}", "--rho-a", f"{RHO_A}"]


@pytest.mark.slow
def test_little_friction_delays_by_the_law(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Truth: lambda_c of the elastica and its delay to first order, of which kappa_y takes up to a tenth."""
    star = 0.005
    moment = star * MATERIAL.scales["N"]
    data, picture = tmp_path / "map.nc", tmp_path / "map.png"
    asked = [*COMMAND, f"--friction-moment={moment:.12g}", "--json", "--output", str(data), "--plot", str(picture)]
    assert main(asked) == 0
    said = json.loads(capsys.readouterr().out)
    assert "lifted on the line" in said["friction_history"]
    assert said["units"]["friction_moment"] == "N"
    assert picture.is_file()

    stored = store.read(data)
    assert stored.attrs["friction_moment"] == pytest.approx(moment)
    places = np.stack([stored["friction_x"], stored["friction_z"]], axis=1)
    np.testing.assert_allclose(places, said["friction_boundary"], rtol=1e-9)

    snaps = np.array(said["friction_snap"])
    advance, z = np.array(said["friction_boundary"]).T / MATERIAL.gravity_length + [[4.5], [0.0]]
    assert snaps.any()
    # Friction raises the height from which on a strip snaps.
    assert np.all(z[snaps] > elastica.touch_limit())
    assert np.all(np.diff(snaps.astype(int)) >= 0)
    for height, end in zip(z[snaps], advance[snaps], strict=True):
        delay = end - elastica.critical(height).state.advance
        assert 0.85 < delay / (star * elastica.friction_delay(height)) < 1.02


@pytest.mark.parametrize("moment", ["-1e-3", "0", "0.1", "nan"])
def test_no_such_friction(moment: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*COMMAND, f"--friction-moment={moment}"]) == 2
    told = capsys.readouterr().err
    assert "friction_moment" in told
    assert told.count("\n") == 1
