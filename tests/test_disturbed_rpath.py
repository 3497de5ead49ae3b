"""First touches on a disturbed R-path."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from plots import disturbed_rpath as figure
from stripfold.paths.rpath import plan_r_path
from studies import disturbed_rpath
from studies.disturbed_rpath import Vibrating, _risen

MOTION = {"yield_curvature": 0.05, "step": 0.2, "speed": 0.05, "air": 0.11, "stiffness": 0.05}


def test_vibrating_gripper():
    drive = Vibrating(5.0, 0.1, 6.0, 0.02, 4.0)
    for t in (0.3, 9.0, 14.0):
        assert (drive.lam(t + 1e-6) - drive.lam(t - 1e-6)) / 2e-6 == pytest.approx(drive.rate(t), abs=1e-6)
    assert drive.lam(20.0 * pi) == pytest.approx(6.0)


def test_path_of_another_scale_and_height():
    path = plan_r_path(12.0).path
    other = _risen(path.scaled(1.1), 0.2)
    for s in (0.5, 3.0, 10.0):
        np.testing.assert_allclose(other.position(1.1 * s), 1.1 * path.position(s) + [0.0, 0.2 * min(1.1 * s, 1.0)])
    piece = other.pieces[1]
    middle = 0.5 * (piece.start + piece.end)
    difference = (piece.position(middle + 1e-5) - piece.position(middle - 1e-5)) / 2e-5
    np.testing.assert_allclose(difference, piece.rate(middle), atol=1e-6)


def test_study(monkeypatch):
    first = plan_r_path(12.0).first_touch
    monkeypatch.setattr(disturbed_rpath, "_lost", lambda case: 10.0)
    monkeypatch.setattr(disturbed_rpath, "vibrated", lambda case, path, m, vibration, start: first + vibration[0])
    # A strip that touches at the same share of its length.
    monkeypatch.setattr(
        disturbed_rpath, "first_touch", lambda case, path, m: (first * case.length / 12.0 + 0.1 * m, 0.0)
    )
    data = disturbed_rpath.run(12.0, 0.01, [0.3], [1.2], [0.1], [[0.02, 5.0]], MOTION)
    np.testing.assert_allclose(data["touch_error"][:, 0], [0.0, 0.0, 0.0, 0.02], atol=1e-12)
    np.testing.assert_allclose(data["touch_error"][1, 1], 0.03 / 1.2 ** (1.0 / 3.0))
    (ax,) = figure.draw(data).axes
    labels = ["none", r"$\eta_b$ +20%", "height +0.1 $L^*$", r"vibration 0.02 $L^*$, $\omega = $5"]
    assert [text.get_text() for text in ax.get_yticklabels()] == labels
