"""Keys and values of a scene, checked one by one; errors name the key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from difflib import get_close_matches
from math import isfinite
from numbers import Real
from typing import Any, TypeVar

from stripfold.errors import InvalidInputError

Part = TypeVar("Part")


def checked(
    part: type[Part], given: Any, name: str, ranges: Mapping[str, tuple[float, float]], choices: Mapping[str, Any]
) -> Part:
    """A frozen dataclass of numbers, texts and pairs from a mapping; each value is checked by its default's type.

    Raises
    ------
    InvalidInputError
        No mapping, an unknown key, or a value that cannot be used.
    """
    if not isinstance(given, Mapping):
        raise InvalidInputError(name, given, "keys and values")
    defaults = {item.name: item.default for item in fields(part) if item.default is not MISSING}  # type: ignore[arg-type]
    known_keys(given, tuple(defaults), name)
    values = {
        str(key): _checked(f"{name}.{key}" if name else str(key), str(key), value, defaults[str(key)], ranges, choices)
        for key, value in given.items()
    }
    return part(**values)


def _checked(
    name: str, key: str, value: Any, default: Any, ranges: Mapping[str, tuple[float, float]], choices: Mapping[str, Any]
) -> Any:
    if isinstance(default, tuple):
        if not isinstance(value, list | tuple) or len(value) != len(default):
            raise InvalidInputError(name, value, f"{len(default)} numbers")
        return tuple(_checked(name, key, item, default[0], ranges, choices) for item in value)
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise InvalidInputError(name, value, "true or false")
        return value
    if isinstance(default, str):
        if key in choices and value not in choices[key]:
            raise InvalidInputError(name, value, " or ".join(choices[key]))
        if not isinstance(value, str) or not value.strip():
            raise InvalidInputError(name, value, "a text")
        return value
    low, high = ranges[key]
    whole = isinstance(default, int)
    if isinstance(value, bool) or not isinstance(value, int if whole else Real) or not isfinite(float(value)):
        raise InvalidInputError(name, value, "a whole number" if whole else "a number")
    if not low <= float(value) <= high:
        raise InvalidInputError(name, value, f"from {low:g} to {high:g}")
    return value if whole else float(value)


def known_keys(given: Mapping[Any, Any], known: tuple[str, ...], name: str) -> None:
    """Refuse a key that nothing is called by, with the nearest that something is."""
    for key in given:
        if key not in known:
            near = get_close_matches(str(key), known, 1)
            advice = f"did you mean {near[0]}?" if near else "remove it"
            where = f"{name}.{key}" if name else str(key)
            raise InvalidInputError(where, given[key], f"one of the keys {', '.join(known)}", advice)
