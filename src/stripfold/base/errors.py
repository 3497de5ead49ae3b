"""Typed errors: what was given, what is allowed, what to do.

A failed solve raises; it is never stored as data.  The command line turns every
:class:`StripfoldError` into one line on standard error and a non-zero exit code.
"""

from __future__ import annotations

import copyreg
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import Any

MISSING = "(missing)"
"""Stands for the value of an entry that was not given."""
LONGEST_VALUE = 100
"""Characters of a value in a message, of which most paths take less; a longer one is shown without its middle."""


class StripfoldError(Exception):
    """Base of every error this package raises on purpose."""

    exit_code = 5

    def __reduce__(self) -> tuple[Any, ...]:
        """As it is: most errors are made of other arguments than their message."""
        return copyreg.__newobj__, (type(self), *self.args), vars(self)  # type: ignore[attr-defined]


class InvalidInputError(StripfoldError, ValueError):
    """Input that cannot be used.

    Parameters
    ----------
    key
        Name of the offending entry, as the user wrote it.
    value
        What was given, or :data:`MISSING`.
    allowed
        What would have been accepted, in words.
    advice
        What to do about it; optional.
    """

    exit_code = 2

    def __init__(self, key: str, value: Any, allowed: str, advice: str = "") -> None:
        self.key, self.value, self.allowed, self.advice = key, value, allowed, advice
        tail = f"; {advice}" if advice else ""
        found = f"{key} is missing" if value is MISSING else f"{key} = {_shown(value)} cannot be used"
        super().__init__(f"{found}; allowed: {allowed}{tail}")


def _shown(value: Any) -> str:
    try:
        text = repr(value)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        return "(a number of thousands of digits)"
    half = (LONGEST_VALUE - 3) // 2
    return text if len(text) <= LONGEST_VALUE else f"{text[:half]}...{text[-half:]}"


class MissingExtraError(StripfoldError, ImportError):
    """An optional part of the package is not installed."""

    exit_code = 2

    def __init__(self, extra: str, missing: Sequence[str]) -> None:
        self.extra = extra
        needed = f"this needs the optional dependencies of stripfold[{extra}] ({', '.join(missing)} missing)"
        super().__init__(f'{needed}; install them: pip install "stripfold[{extra}]"')


class SolveError(StripfoldError):
    """A solve that did not reach its tolerance.

    Carries what is needed to understand it: the control parameter, the step, the
    residual history, and advice.
    """

    exit_code = 3

    def __init__(
        self,
        message: str,
        *,
        parameter: float = float("nan"),
        step: float = float("nan"),
        residuals: Sequence[float] = (),
        advice: str = "",
        details: Mapping[str, Any] | None = None,
    ) -> None:
        self.parameter, self.step, self.advice = parameter, step, advice
        self.residuals = tuple(residuals)
        self.details = dict(details or {})
        tail = f" ({advice})" if advice else ""
        super().__init__(f"{message}{tail}")


class NewtonError(SolveError):
    """Newton's method did not converge from the given guess."""


class CrushedError(NewtonError):
    """Newton's method converged to an inadmissible state: compressed beyond the law of its material."""


class ContinuationError(SolveError):
    """A branch could not be followed: the step became smaller than allowed."""


class LostStabilityError(SolveError):
    """A strip with friction did not follow its gripper: it moved far within one step, or no stable state was found."""


class TimeStepError(SolveError):
    """A motion could not be followed: the time step became too small; ``last`` is the last accepted state."""

    def __init__(self, message: str, *, last: Any, **details: Any) -> None:
        super().__init__(message, **details)
        self.last = last


class NoPathError(StripfoldError):
    """No known path keeps the asked margin; ``refused`` says of each why, and by how much."""

    exit_code = 6

    def __init__(self, asked: str, refused: Sequence[Any]) -> None:
        self.refused = tuple(refused)
        reasons = "; ".join(f"{one.path}: {one.reason}" for one in refused)
        super().__init__(f"no path {asked}: {reasons}")


class MeasurementError(StripfoldError):
    """A recording or picture that can be read but not measured; ``found`` says what was there instead.

    Parameters
    ----------
    source
        The file or part of the recording, as its user knows it.
    found
        What was found.
    needed
        What a measurement needs.
    advice
        What to do about it; optional.
    """

    exit_code = 4

    def __init__(self, source: str, found: str, needed: str, advice: str = "") -> None:
        self.source, self.found, self.needed, self.advice = source, found, needed, advice
        tail = f"; {advice}" if advice else ""
        super().__init__(f"{source}: {found}; needed is {needed}{tail}")


class CalibrationError(MeasurementError):
    """The calibration of a camera, of the folding plane or of the robot is not good enough to measure with."""


class TrackingError(MeasurementError):
    """The gripper or the strip was lost, or was not found at all."""


class SynchronisationError(MeasurementError):
    """The video's clock and the robot's could not be brought together."""


MODULES = {
    "completion": ("shtab",),
    "plot": ("jinja2", "matplotlib"),
    "vision": ("av", "cv2", "jinja2", "matplotlib", "PIL", "skimage"),
}
"""Modules by the extra that installs them."""


def require(extra: str) -> None:
    """Raise MissingExtraError unless all modules of an extra are installed."""
    missing = [module for module in MODULES[extra] if find_spec(module) is None]
    if missing:
        raise MissingExtraError(extra, missing)
