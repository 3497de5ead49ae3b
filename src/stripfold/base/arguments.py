"""Arguments of the public functions that no input model sees."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import wraps
from inspect import signature
from pathlib import Path
from sys import float_info
from typing import Any, ParamSpec, TypeVar

from stripfold.base.errors import InvalidInputError

P = ParamSpec("P")
T = TypeVar("T")


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """Make a function refuse an unknown keyword, and a ``progress`` that cannot be called, as bad input."""
    form = signature(function)
    known = [name for name in form.parameters if name != "self"]

    @wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> T:
        for key, value in named.items():
            if key not in known:
                from stripfold.base.validation import did_you_mean

                raise InvalidInputError(key, value, f"only the arguments {', '.join(known)}", did_you_mean(key, known))
        progress = form.bind_partial(*given, **named).arguments.get("progress")
        if progress is not None and not callable(progress):
            raise InvalidInputError("progress", progress, "a function that takes a line of text, as print")
        return function(*given, **named)

    return call


def file_name(key: str, given: Any) -> Path:
    """The name of a file or folder.

    Raises InvalidInputError: not a name.
    """
    if not isinstance(given, str | os.PathLike) or not str(given):
        raise InvalidInputError(key, given, "the name of a file, a text or a pathlib.Path")
    return Path(given)


def number(key: str, value: Any, unit: str, limits: tuple[float, float] | None = None) -> float:
    """``value`` as a finite float within ``limits``, or greater than 0; raises InvalidInputError."""
    low, high = limits or (5e-324, float_info.max)
    try:
        found = float(value)
    except (TypeError, ValueError):
        found = float("nan")
    if not low <= found <= high:
        allowed = f"from {low:g} to {high:g}" if limits else "greater than 0"
        raise InvalidInputError(key, value, f"a finite number {allowed}{unit}")
    return found
