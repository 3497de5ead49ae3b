"""The configuration of a run: read, checked against the schema, completed, resolved.

The schema, ``config.schema.json`` beside this file, is the reference of all keys.  Ranges of physical numbers are not
repeated there: :class:`.Scene` knows them.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from copy import deepcopy
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
    config = _complete(schema(), deepcopy(dict(source)) if isinstance(source, Mapping) else _read(Path(source)))
    _finite(config, ())
    errors = sorted(Draft202012Validator(schema()).iter_errors(config), key=lambda e: (list(map(str, e.path)), e.message))
    if errors:
        raise _told(errors[0])
    _check_names(config["materials"])
    for i, material in enumerate(config["materials"]):
        if "secant" in material:
            _resolve_secant(material, config["gravity"], Path(root), f"materials[{i}]")
        _check_heights(config, material, f"materials[{i}]")
    limit, branches = config["studies"]["limit"], config["studies"]["branches"]
    for i, eta_m in enumerate(limit["eta_m"]):
        strip = {"eta_b": limit["eta_b"], "eta_m": eta_m, "length_star": limit["length_star"]}
        _scene(config, strip, limit["height"], "studies.limit", {"eta_m": f"eta_m[{i}]"})
    if branches["chunks"] > branches["cases"]:
        allowed = f"at most the number of cases, {branches['cases']}"
        raise InvalidInputError("studies.branches.chunks", branches["chunks"], allowed)
    return config


def scene(config: Config, material: Mapping[str, Any], height: float, model: str = "solid") -> Scene:
    """The scene of one of the configuration's materials at a gripper height in L*.

    Raises
    ------
    InvalidInputError
        A number that cannot be used.
    """
    plain = model == "elastica"
    return Scene.create(
        length=material["length"],
        height=height * _gravity_length(config, material),
        **{key: material[key] for key in ("eta_b", "eta_m", "nu", "rho_a")},
        model=model,
        accuracy=config["solid"]["accuracy"],
        law="svk" if plain else config["solid"]["law"],
        contact="mid" if plain else config["solid"]["contact"],
        gravity=config["gravity"],
    )


@lru_cache(maxsize=1)
def schema() -> dict[str, Any]:
    """The JSON schema of the configuration; not to be changed."""
    text = files("stripfold").joinpath("config.schema.json").read_text(encoding="utf-8")
    return dict(json.loads(text))
