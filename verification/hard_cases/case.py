"""One hard case: its problem, its one expected outcome, and how the outcome is judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isnan, nan
from time import perf_counter
from typing import Any, NamedTuple

from stripfold.base.errors import StripfoldError

MULTIPLE = 3.0
"""A value may be off by this many times its own error estimate."""


class Finding(NamedTuple):
    """A value, its reference by an independent way, the value's error estimate, and the error of the reference.

    The value is nan on a wrong branch: where the advance ends in another way than it should.
    """

    value: float
    reference: float
    estimate: float
    reference_error: float = 0.0

    @property
    def allowed(self) -> float:
        return MULTIPLE * self.estimate + self.reference_error


def refined(
    value_at: Callable[[float], float], refinement: float, reference: float, reference_error: float = 0.0
) -> Finding:
    """A value on one mesh; the change from the mesh half as fine is taken for its error."""
    value = value_at(refinement)
    return Finding(value, reference, abs(value - value_at(2.0 * refinement)), reference_error)


@dataclass(frozen=True, slots=True)
class Case:
    """A case; all lengths in L*.

    Attributes
    ----------
    theme, name
        What is hard, and the case's own name.
    judged
        What its value is, and with what it is compared; or why an error is expected.
    solve
        From a factor on all element lengths to a finding; None where an error should have been raised before.
    error
        The typed error that is the expected outcome; None where it is a value.
    """

    theme: str
    name: str
    judged: str
    solve: Callable[[float], Finding | None]
    error: type[StripfoldError] | None = None


def judge(case: Case, refinement: float) -> dict[str, Any]:
    """Run a case; never raises: the outcome, whatever it is, is a row of the table."""
    began = perf_counter()
    found, outcome, message, failed = None, "value", "", True
    try:
        found = case.solve(refinement)
        if found is None:
            outcome = "no error"
        else:
            # So written, nan fails.
            failed = case.error is not None or not abs(found.value - found.reference) <= found.allowed
            outcome = "wrong branch" if isnan(found.value) else "value"
    except StripfoldError as error:
        outcome, message = type(error).__name__, str(error)
        failed = case.error is None or not isinstance(error, case.error)
    except Exception as error:
        # No case may end in an error without a type of its own; the others still have their turn.
        outcome, message = type(error).__name__, str(error)
    value, reference, allowed = (found.value, found.reference, found.allowed) if found else (nan, nan, nan)
    return {
        "name": case.name,
        "theme": case.theme,
        "judged": case.judged,
        "expected": case.error.__name__ if case.error else "value",
        "value": value,
        "reference": reference,
        "error": abs(value - reference),
        "allowed": allowed,
        "outcome": outcome,
        "failed": failed,
        "message": message,
        "seconds": perf_counter() - began,
    }
