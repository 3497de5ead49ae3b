"""The configuration of a run: read, checked against the schema, completed, resolved.

The schema, ``config.schema.json`` beside this file, is the reference of all keys.  Ranges of physical numbers are not
repeated there: :class:`.Scene` knows them.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from functools import lru_cache
from importlib.resources import files
from math import isclose, isfinite
from pathlib import Path
from typing import Any

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError

from stripfold.errors import InvalidInputError
from stripfold.material import Material
from stripfold.scene import Scene, require_long_enough

Config = dict[str, Any]


def load(source: str | os.PathLike[str] | Mapping[str, Any], root: str | os.PathLike[str] = ".") -> Config:
    """The resolved configuration: defaults filled in, textiles turned into ``eta_b``, everything checked.

    Loading a resolved configuration again changes nothing.

    Parameters
    ----------
    source
        Path of a YAML file, or its content.
    root
        Folder from which relative paths inside the configuration start.

    Returns
    -------
    dict
        A new one; plain numbers, texts, lists and dicts.

    Raises
    ------
    InvalidInputError
        Not readable, an unknown or missing key, or a value that cannot be used; the message names the key.
    SolveError
        The elastica, which tells how long a strip must be, could not be solved.
    """
    config = _complete(schema(), source if isinstance(source, Mapping) else _read(Path(source)))
    _check_finite(config, ())
    # A misspelt key is missing too: say that it is unknown first.
    errors = sorted(
        Draft202012Validator(schema()).iter_errors(config),
        key=lambda e: (e.validator != "additionalProperties", list(map(str, e.absolute_path)), e.message),
    )
    if errors:
        raise _in_words(errors[0])
    _check_names(config["materials"])
    for i, material in enumerate(config["materials"]):
        at = f"materials[{i}]"
        if "secant" in material:
            _resolve_secant(material, config["gravity"], Path(root), at)
        material.setdefault("rho_a", 1.0)
        _check_heights(config, material, at)
    _check_studies(config)
    return config


def scene(config: Config, material: Mapping[str, Any], height: float, model: str = "solid") -> Scene:
    """The scene of one of the configuration's materials at a gripper height in L*.

    Raises
    ------
    InvalidInputError
        A number that cannot be used.
    """
    return Scene.create(
        length=material["length"],
        height=height * Material(material["eta_b"], gravity=config["gravity"]).gravity_length,
        **{key: material[key] for key in ("eta_b", "eta_m", "nu", "rho_a")},
        model=model,
        accuracy=config["solid"]["accuracy"],
        law=config["solid"]["law"] if model == "solid" else "svk",
        gravity=config["gravity"],
    )


def material_of(config: Config, entry: Mapping[str, Any]) -> Material:
    """The material of one of the configuration's materials."""
    return scene(config, entry, entry["heights"][0]).material


@lru_cache(maxsize=1)
def schema() -> dict[str, Any]:
    """The JSON schema of the configuration; not to be changed."""
    text = files("stripfold").joinpath("config.schema.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def _read(path: Path) -> Any:
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise InvalidInputError("configuration", str(path), "a readable YAML file", str(error)) from error


def _complete(rules: Mapping[str, Any], value: Any) -> Any:
    """A copy of ``value`` with the schema's defaults; what is malformed is left for the validation."""
    if isinstance(value, Mapping):
        properties = rules.get("properties", {})
        defaults = {key: rule["default"] for key, rule in properties.items() if "default" in rule}
        return {key: _complete(properties.get(key, {}), item) for key, item in {**defaults, **value}.items()}
    if isinstance(value, list | tuple):
        return [_complete(rules.get("items", {}), item) for item in value]
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


def _check_names(materials: list[Config]) -> None:
    names = [material["name"] for material in materials]
    for i, name in enumerate(names):
        if name in names[:i]:
            raise InvalidInputError(f"materials[{i}].name", name, "a name that no other material has")


def _resolve_secant(material: Config, gravity: float, root: Path, at: str) -> None:
    """Fill in what the measured law gives; what is there already must agree."""
    from stripfold import elastica, textile

    given = material["secant"]
    with _named({"z": f"{at}.secant.height"}, f"{at}.secant"):
        state = elastica.critical(given["height"]).state
        if state is None:
            raise InvalidInputError("z", given["height"], "a height at which the strip snaps, in L*")
        table = textile.read_table(root / given["table"])
        found = textile.secant(table, given["areal_load"], state.max_curvature, gravity)
    filled = (
        (material, at, "eta_b", found.eta_b),
        (material, at, "rho_a", given["areal_load"] / gravity),
        (given, f"{at}.secant", "stiffness", found.stiffness),
        (given, f"{at}.secant", "kappa", found.kappa),
    )
    for mapping, where, key, value in filled:
        if not isclose(mapping.setdefault(key, value), value, rel_tol=1e-9):
            raise InvalidInputError(f"{where}.{key}", mapping[key], f"{value:.10g}, or nothing: the secant gives it")


def _check_heights(config: Config, material: Config, at: str) -> None:
    from stripfold.paths import LONGEST, shortest_half_fold

    lists = [(name, material[name]) for name in ("heights", "touching_heights")]
    scenes = [
        _scene_at(config, material, height, at, f"{at}.{name}[{i}]")
        for name, heights in lists
        for i, height in enumerate(heights)
    ]
    longest = LONGEST * scenes[0].material.gravity_length
    shortest = shortest_half_fold() * scenes[0].material.gravity_length
    if not shortest < material["length"] <= longest:
        raise InvalidInputError(
            f"{at}.length",
            material["length"],
            f"more than {shortest:.4g} m and at most {longest:.4g} m with eta_b = {material['eta_b']:g} m^-4 s^2",
            "a strip outside has no R-path",
        )
    # The free length grows with the height.
    with _named({}, at):
        require_long_enough(max(scenes, key=lambda scene: scene.height))


def _check_studies(config: Config) -> None:
    limit = config["studies"]["limit"]
    star = Material(limit["eta_b"], gravity=config["gravity"]).gravity_length
    strip = {"eta_b": limit["eta_b"], "nu": 0.0, "rho_a": 1.0, "length": limit["length_star"] * star}
    for eta_m in limit["eta_m"]:
        at = "studies.limit"
        asked = _scene_at(config, {**strip, "eta_m": eta_m}, limit["height"], at, f"{at}.height")
        with _named({"length": f"{at}.length_star"}, at):
            require_long_enough(asked)


def _scene_at(config: Config, material: Config, height: float, at: str, height_key: str) -> Scene:
    """The scene; its errors name the configuration's keys."""
    with _named({"gravity": "gravity", "accuracy": "solid.accuracy", "height": height_key}, at):
        return scene(config, material, height)


@contextmanager
def _named(keys: Mapping[str, str], at: str) -> Iterator[None]:
    """Errors name the configuration's key: that in ``keys``, or the one of the same name within ``at``."""
    try:
        yield
    except InvalidInputError as error:
        key = keys.get(error.key, f"{at}.{error.key}")
        advice = "heights are in L* here, the value shown is in m" if error.key == "height" else error.advice
        raise InvalidInputError(key, error.value, error.allowed, advice) from error


def _in_words(error: ValidationError) -> InvalidInputError:
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
    if error.validator in ("required", "anyOf"):
        wanted = rules["required"] if error.validator == "required" else ["eta_b"]
        key = next(key for key in wanted if key not in instance)
        advice = "give secant in its place" if error.validator == "anyOf" else ""
        return InvalidInputError(_dotted((*path, key)), "(missing)", _allowed(properties[key]), advice)
    advice = ""
    if isinstance(instance, str) and rules.get("type") in ("number", "integer"):
        advice = "YAML takes a number with an exponent for a text unless it has a point: write 1.0e-3"
    return InvalidInputError(_dotted(path), instance, _allowed(rules), advice)


def _allowed(rules: Mapping[str, Any]) -> str:
    """A schema in words."""
    if "enum" in rules:
        what = "one of " + ", ".join(map(str, rules["enum"]))
    else:
        kinds = {"array": "a list", "object": "a mapping", "string": "a text", "integer": "a whole number"}
        what = kinds.get(rules["type"], "a number")
    limits = {
        "minimum": "at least {}",
        "exclusiveMinimum": "greater than {}",
        "minLength": "of at least {} letter",
        "minItems": "of at least {} entries",
    }
    parts = [what, *(words.format(rules[key]) for key, words in limits.items() if key in rules)]
    if rules.get("uniqueItems"):
        parts.append("no two alike")
    return ", ".join(parts) + f" ({rules.get('description', 'the configuration')})"


def _dotted(path: Iterable[str | int]) -> str:
    """A path as people write it: materials[0].heights[1]."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return text.removeprefix(".") or "configuration"
