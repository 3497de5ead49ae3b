"""Entries of a YAML file against a JSON schema: defaults filled in, an error that names the key."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from math import isfinite
from pathlib import Path
from typing import Any

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

from stripfold.errors import InvalidInputError

Schema = Mapping[str, Any]


def complete(schema: Schema, value: Any) -> Any:
    """A copy of ``value`` with the schema's defaults; what is malformed is left for :func:`check`."""
    return _complete(schema, schema, value)


def check(schema: Schema, entries: Any, whole: str) -> None:
    """Raise the first thing that is wrong with ``entries``, which are called ``whole`` where no key can be named.

    Raises
    ------
    InvalidInputError
        An unknown or missing key, or a value that cannot be used.
    """
    _check_finite(entries, ())
    # A misspelt key is missing too: say that it is unknown first.
    errors = sorted(
        Draft202012Validator(schema).iter_errors(entries),
        key=lambda e: (e.validator != "additionalProperties", list(map(str, e.absolute_path)), e.message),
    )
    if errors:
        raise _in_words(schema, errors[0], whole)


def read_scene(path: str | os.PathLike[str], example: str) -> dict[str, Any]:
    """The keys and values of a scene in a YAML file; ``example`` is one, for the message.

    Raises
    ------
    InvalidInputError
        Not readable, or not a mapping.
    """
    try:
        given = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        said = " ".join(str(error).split())
        raise InvalidInputError("scene", os.fspath(path), "a readable YAML file", said) from error
    if not isinstance(given, Mapping):
        raise InvalidInputError("scene", os.fspath(path), f"a file of keys and values, as {example}")
    return {str(key): value for key, value in given.items()}


def _resolved(root: Schema, rules: Schema) -> Schema:
    """What ``$ref`` refers to, with what stands beside it."""
    if "$ref" not in rules:
        return rules
    found: Any = root
    for key in rules["$ref"].removeprefix("#/").split("/"):
        found = found[key]
    return {**found, **rules}


def _complete(root: Schema, rules: Schema, value: Any) -> Any:
    rules = _resolved(root, rules)
    if isinstance(value, Mapping):
        properties = rules.get("properties", {})
        defaults = {key: rule["default"] for key, rule in properties.items() if "default" in rule}
        return {key: _complete(root, properties.get(key, {}), item) for key, item in {**defaults, **value}.items()}
    if isinstance(value, list | tuple):
        return [_complete(root, rules.get("items", {}), item) for item in value]
    return value


def _check_finite(value: Any, path: tuple[str | int, ...]) -> None:
    # JSON schema knows no nan: it would pass every limit.
    if isinstance(value, float) and not isfinite(value):
        raise InvalidInputError(_dotted(path), value, "a finite number")
    pairs: Iterable[tuple[Any, Any]] = ()
    if isinstance(value, dict):
        pairs = value.items()
    elif isinstance(value, list):
        pairs = enumerate(value)
    for key, item in pairs:
        _check_finite(item, (*path, key))


def _in_words(root: Schema, error: ValidationError, whole: str) -> InvalidInputError:
    """The validator's finding as key, value and what is allowed."""
    path = tuple(error.absolute_path)
    rules: Any = error.schema
    instance: Any = error.instance
    properties = rules.get("properties", {})
    if error.validator == "additionalProperties":
        key = min((key for key in instance if key not in properties), key=str)
        near = get_close_matches(str(key), properties, n=1)
        advice = f"did you mean {near[0]!r}?" if near else ""
        return InvalidInputError(_dotted((*path, key)), instance[key], f"only the keys {', '.join(properties)}", advice)
    if error.validator in ("anyOf", "oneOf"):
        ways = [way["required"] for way in rules[error.validator]]
        given = [way for way in ways if all(key in instance for key in way)]
        words = " or ".join(" and ".join(way) for way in ways)
        if given:
            return InvalidInputError(_dotted(path) or whole, given[-1][0], f"only one of: {words}")
        key = next(key for key in ways[0] if key not in instance)
        other = " or ".join(" and ".join(way) for way in ways[1:])
        allowed = _allowed(_resolved(root, properties[key]), whole)
        return InvalidInputError(_dotted((*path, key)), "(missing)", allowed, f"give {other} in its place")
    if error.validator == "required":
        key = next(key for key in rules["required"] if key not in instance)
        allowed = _allowed(_resolved(root, properties[key]), whole) if key in properties else "a value"
        return InvalidInputError(_dotted((*path, key)), "(missing)", allowed)
    advice = ""
    if isinstance(instance, str) and rules.get("type") in ("number", "integer"):
        advice = "YAML takes a number with an exponent for a text unless it has a point: write 1.0e-3"
    return InvalidInputError(_dotted(path) or whole, instance, _allowed(rules, whole), advice)


def _allowed(rules: Schema, whole: str) -> str:
    """A schema in words."""
    if "enum" in rules:
        what = "one of " + ", ".join(map(str, rules["enum"]))
    else:
        kinds = {"array": "a list", "object": "a mapping", "string": "a text", "integer": "a whole number"}
        what = {**kinds, "boolean": "true or false"}.get(rules.get("type", ""), "a number")
    limits = {
        "minimum": "at least {}",
        "exclusiveMinimum": "greater than {}",
        "maximum": "at most {}",
        "minLength": "of at least {} letter",
        "minItems": "of at least {} entries",
    }
    parts = [what, *(words.format(rules[key]) for key, words in limits.items() if key in rules)]
    if rules.get("uniqueItems"):
        parts.append("no two alike")
    return ", ".join(parts) + f" ({rules.get('description', whole)})"


def _dotted(path: Iterable[str | int]) -> str:
    """A path as people write it: materials[0].heights[1]."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return text.removeprefix(".") or "configuration"
