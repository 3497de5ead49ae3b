"""Critical points for an uncertain eta_b: the range against runs with other eta_b."""

from __future__ import annotations

import pytest

import stripfold as sf
from stripfold import elastica
from stripfold.base.errors import InvalidInputError

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


@pytest.mark.parametrize(("length", "uncertainty", "key"), [(0.6, 1.0, "eta_b_uncertainty"), (0.22, 0.5, "length")])
def test_no_strip_at_one_of_the_ends(length: float, uncertainty: float, key: str) -> None:
    with pytest.raises(InvalidInputError) as refused:
        sf.Strip(length=length, eta_b=3780.0).critical(0.09, model="elastica", eta_b_uncertainty=uncertainty)
    assert refused.value.key == key
