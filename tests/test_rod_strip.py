"""The rod on the floor: what is asked of it, against the elastica, and the command line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from stripfold import elastica
from stripfold.ask import critical
from stripfold.ask.inputs import Scene, Simulation
from stripfold.base.errors import InvalidInputError
from stripfold.cli import main
from stripfold.follow.track import End


class TestCriticalPoint:
    @pytest.mark.parametrize(("height", "end"), [(1.3, End.TOUCH), (1.75, End.SNAP), (5.0, End.SNAP)])
    def test_found(self, height: float, end: End):
        """``find`` on the rod: the elastica's verdict, and its value within the estimate and the thickness's share."""
        scene = Scene(length=0.6, height=height * 0.029988, eta_b=3780.0, eta_m=1e-4, model="rod")
        found, truth = critical.find(scene), elastica.critical(scene.height_star)
        unit = scene.material.gravity_length
        assert found.model == "rod"
        assert found.snap == truth.snap == (end is End.SNAP)
        assert found.lambda_0 / unit == pytest.approx(
            elastica.state_no_horizontal_force(scene.height_star).advance, abs=2e-3
        )
        if found.snap:
            thickness = 8.0 * scene.material.relative_thickness**2
            assert found.error <= 1e-3 * found.lambda_c
            assert abs(found.lambda_c / unit - truth.advance) < found.error / unit + thickness
        else:
            assert np.isnan(found.lambda_c)

    def test_a_strip_that_is_lifted(self):
        """Too short for the height: no snap, and the reason; nothing is solved for."""
        found = critical.find(Scene(length=0.15, height=0.09, eta_b=3780.0, model="rod"))
        assert (found.snap, found.reason) == (False, End.LIFTED.reason)


class TestCommand:
    def test_critical(self, capsys: pytest.CaptureFixture[str]):
        arguments = ["--length", "0.6", "--eta-b", "3780", "--height", "0.09", "--model", "rod", "--json"]
        assert main(["critical", *arguments]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["model"] == "rod"
        assert found["lambda_c"] == pytest.approx(0.2951, rel=1e-3)

    def test_what_is_not_possible(self):
        """The printed law on the rod, and a motion in time of the elastica."""
        strip = {"length": 0.6, "height": 0.09, "eta_b": 3780.0}
        with pytest.raises(InvalidInputError, match="only the solid has another law"):
            Scene(**strip, model="rod", law="printed")
        with pytest.raises(InvalidInputError, match="no motion in time"):
            Simulation(**strip, model="elastica")
        assert Simulation(**strip, model="rod").as_config()["model"] == "rod"
