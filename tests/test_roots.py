"""The search for a root."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold.base.roots import root

CASES = {
    "smooth": (lambda x: np.cos(x) - x, 0.0, 1.0, 0.7390851332151607),
    "at an end": (lambda x: x - 1.0, 1.0, 3.0, 1.0),
    "flat": (lambda x: (x - 0.3) ** 3, -1.0, 2.0, 0.3),
    "steep": (lambda x: np.tanh(1e4 * (x - 0.7)), 0.0, 1.0, 0.7),
    "lopsided": (lambda x: np.exp(20.0 * x) - 2.0, -1.0, 1.0, np.log(2.0) / 20.0),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
@pytest.mark.parametrize("turned", [False, True])
def test_root(case, turned):
    function, low, high, truth = case
    calls = []

    def counted(x):
        calls.append(x)
        return function(x)

    ends = (high, low) if turned else (low, high)
    assert root(counted, *ends, 1e-10) == pytest.approx(truth, abs=1e-10)
    assert len(calls) < 60


def test_to_rounding():
    assert root(lambda x: x**3 - 2.0, 1.0, 2.0, 0.0) == pytest.approx(2.0 ** (1.0 / 3.0), rel=2e-15)


def test_without_a_change_of_sign():
    with pytest.raises(ValueError, match="no change of sign between 1 and 2"):
        root(lambda x: x, 1.0, 2.0, 1e-9)
    with pytest.raises(ValueError, match="no change of sign"):
        root(lambda _: np.nan, 1.0, 2.0, 1e-9)
