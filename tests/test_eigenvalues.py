"""The study of eigenvalues towards critical points, and its figure."""

from __future__ import annotations

import numpy as np
import pytest

from plots import eigenvalues as figure
from studies import eigenvalues


def test_the_eigenvalue_goes_to_zero_at_snap_and_tangency(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(eigenvalues, "PATHS", ("r-path",))
    data = eigenvalues.run(3.0, 13.0, 0.03, 1.0)
    along_x = data.sel(motion="x").dropna("step", subset=["distance"])
    distance, first = along_x["distance"].values, along_x["eigenvalue_1"].values
    assert np.all(np.diff(distance) < 0.0)
    near = (distance > 1e-5) & (distance < 1e-3)
    assert np.polyfit(np.log(distance[near]), np.log(first[near]), 1)[0] == pytest.approx(0.5, abs=0.02)
    # Where the path is nearly tangent to the boundary the eigenvalue falls faster with the distance.
    r_path = data.sel(motion="r-path").dropna("step", subset=["distance"])
    far = (r_path["distance"].values > 0.3) & (r_path["distance"].values < 2.0)
    slope = np.polyfit(np.log(r_path["distance"].values[far]), np.log(r_path["eigenvalue_1"].values[far]), 1)[0]
    assert 0.8 < slope < 1.4
    assert np.all(np.abs(data["mode_z"].values).max(axis=1) <= 1.0)
    # The grasped end is held, what lies stays, and the sag goes down.
    np.testing.assert_allclose(data["mode_z"].values[:, [0, -1]], 0.0, atol=1e-9)
    assert np.all(data["mode_z"].values.min(axis=1) < -0.5)


def test_figure() -> None:
    count, s = 4, np.linspace(0.0, 12.0, 5)
    steps = ("motion", "step")
    values = {name: (steps, np.tile([1.0, 0.1, 1e-3], (count, 1))) for name in ("distance", "eigenvalue_1")}
    values["eigenvalue_2"] = (steps, np.full((count, 3), 2.0))
    values |= {name: (("motion", "s"), np.tile(s, (count, 1))) for name in ("x", "z", "mode_x", "mode_z")}
    data = eigenvalues.dataset("eigenvalues", values | {"motion": ("motion", ["x", *eigenvalues.PATHS]), "s": ("s", s)})
    top, *below = figure.draw(data).axes
    assert len([line for line in top.lines if line.get_label() == "_second"]) == count
    for ax in below:
        (critical,) = [line for line in ax.lines if line.get_label() == "_critical"]
        (down,) = [line for line in ax.lines if line.get_label() == "_down"]
        np.testing.assert_allclose(down.get_ydata(), critical.get_ydata() + figure.SIZE * s)
