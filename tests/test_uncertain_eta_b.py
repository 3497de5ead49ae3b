"""Critical points for an uncertain eta_b: the range against runs with other eta_b."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import stripfold as sf
from stripfold import elastica
from stripfold.base.errors import InvalidInputError
from stripfold.cli import main
from stripfold.files import store

STRIP = sf.Strip(length=0.6, eta_b=3780.0)


@pytest.mark.parametrize(
    ("model", "height", "off"), [("elastica", 0.09, 1e-9), ("rod", 0.09, 6e-4), ("rod", 0.049, 6e-4)]
)
def test_the_ends_are_those_of_strips_with_such_an_eta_b(model, height: float, off: float) -> None:
    """Exactly on the elastica; at the lower height the softer of them snaps and the stiffer is laid down."""
    ends = STRIP.critical(height, model=model, eta_b_uncertainty=0.2).eta_b_range
    assert ends is not None
    assert ends.eta_b == pytest.approx((3024.0, 4536.0))
    for eta_b, snap, advance, margin in zip(ends.eta_b, ends.snap, ends.advance, ends.margin, strict=True):
        strip = sf.Strip(length=0.6, eta_b=eta_b)
        other = strip.critical(height, model=model)
        assert snap == other.snap
        assert advance == pytest.approx(other.lambda_c if snap else other.lambda_touch, rel=off)
        assert margin == pytest.approx(height - elastica.touch_limit() * strip.gravity_length)
    assert ends.snap == ((True, True) if height > 0.05 else (False, True))


def test_it_is_printed_and_stored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["critical", "--length", "0.6", "--eta-b", "3780", "--height", "0.049", "--model", "elastica"]
    assert main([*asked, "--eta-b-uncertainty", "0.2"]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("eta_b")]
    assert "touch at 0.27" in rows[0]
    assert rows[0].endswith("below the touch limit")
    assert "snap at 0.24" in rows[1]
    assert rows[1].endswith("above the touch limit")
    assert main([*asked, "--json"]) == 0
    assert "eta_b_range" not in json.loads(capsys.readouterr().out)
    STRIP.critical(0.049, model="elastica", eta_b_uncertainty=0.2).to_netcdf(tmp_path / "point.nc")
    np.testing.assert_array_equal(store.read(tmp_path / "point.nc")["end_snap"], [0.0, 1.0])


@pytest.mark.parametrize(("length", "uncertainty", "key"), [(0.6, 1.0, "eta_b_uncertainty"), (0.22, 0.5, "length")])
def test_no_strip_at_one_of_the_ends(length: float, uncertainty: float, key: str) -> None:
    with pytest.raises(InvalidInputError) as refused:
        sf.Strip(length=length, eta_b=3780.0).critical(0.09, model="elastica", eta_b_uncertainty=uncertainty)
    assert refused.value.key == key
