"""One hard case: what it asks, and how its outcome is judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan
from time import perf_counter
from typing import Any

from stripfold.analysis.static import XRun
from stripfold.errors import SolveError, StripfoldError


@dataclass(frozen=True, slots=True)
class Finding:
    """A value, what it should be by an independent way, by how much it may be off, and Newton's iterations for it."""

    value: float
    reference: float
    allowed: float
    iterations: int = 0


@dataclass(frozen=True, slots=True)
class Case:
    """A case; all lengths in L*.

    Attributes
    ----------
    name, theme
        What it is called, and the theme it belongs to.
    judged
        What its value is, and against what it is judged.
    solve
        From a factor on all element lengths to a finding; None where an error should have been raised before.
    errors
        Typed errors that are a right answer, too.
    """

    name: str
    theme: str
    judged: str
    solve: Callable[[float], Finding | None]
    errors: tuple[type[StripfoldError], ...] = ()


def judge(case: Case, refinement: float) -> dict[str, Any]:
    """Run a case; never raises: whatever it ends in is a row of the table."""
    began = perf_counter()
    found, outcome, message, iterations, failed = None, "value", "", 0, True
    try:
        found = case.solve(refinement)
        if found is None:
            outcome = "no error"
        else:
            iterations = found.iterations
            # So written, nan fails.
            failed = not abs(found.value - found.reference) <= found.allowed
    except StripfoldError as error:
        outcome, message, failed = type(error).__name__, str(error), not isinstance(error, case.errors)
        iterations = max(len(error.residuals) - 1, 0) if isinstance(error, SolveError) else 0
    except Exception as error:
        # An error without a type of its own is what no case may end in; the others still have their turn.
        outcome, message = type(error).__name__, str(error)
    value, reference, allowed = (found.value, found.reference, found.allowed) if found else (nan, nan, nan)
    return {
        "name": case.name,
        "theme": case.theme,
        "judged": case.judged,
        "value": value,
        "reference": reference,
        "error": abs(value - reference),
        "allowed": allowed,
        "iterations": iterations,
        "outcome": outcome,
        "failed": failed,
        "message": message,
        "seconds": perf_counter() - began,
    }


def iterations(run: XRun) -> int:
    """Newton's iterations for the accepted points of a run."""
    return sum(len(point.state.residuals) - 1 for point in run.points)


def shown(row: dict[str, Any]) -> str:
    """A row in a few words, for a log."""
    what = row["message"] or f"{row['value']:.9g}, reference {row['reference']:.9g}, allowed {row['allowed']:.1e}"
    return f"{'FAILED ' if row['failed'] else ''}{row['name']}: {row['outcome']} {what} ({row['seconds']:.1f} s)"
