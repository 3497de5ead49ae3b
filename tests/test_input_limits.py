"""Every input model by its own JSON schema: what is outside its limits, no number or misspelt is refused by name."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from importlib import import_module
from math import inf, nan
from typing import Any

import pytest

import stripfold
from stripfold.base.errors import InvalidInputError
from stripfold.base.validation import Input

SOUND = {
    "length": 0.6, "eta_b": 3780.0, "height": 0.09, "values": [1.0, 2.0], "from": 0.0, "to": 1.0, "count": 3,
    "columns": "t,x,z", "unit": "m", "frame": "0,0", "marker": 7, "size": 0.02,
}  # fmt: skip
"""Values of keys that a model requires."""
BEYOND = {"minimum": lambda x: x - 1e-6 * max(1.0, abs(x)), "maximum": lambda x: x + 1e-6 * max(1.0, abs(x))}
NO_NUMBERS = (nan, inf, -inf, "0.5", "", True, [1.0], {}, 1j, 10**400)


def models() -> list[type[Input]]:
    """All input models of the package."""
    for module in pkgutil.walk_packages(stripfold.__path__, "stripfold."):
        # Kernels have no inputs, and would be compiled.
        if not module.name.endswith("__main__") and ".kernels." not in module.name:
            import_module(module.name)

    def below(model: type[Input]) -> Iterator[type[Input]]:
        for one in model.__subclasses__():
            yield one
            yield from below(one)

    return sorted(set(below(Input)), key=lambda model: (model.__module__, model.__name__))


def sound(model: type[Input]) -> dict[str, Any] | None:
    """Input that the model takes, or nothing where it needs more than :data:`SOUND` has."""
    given = {key: SOUND[key] for key, field in model.model_fields.items() if field.is_required() and key in SOUND}
    try:
        model(**given)
    except InvalidInputError:
        return None
    return given


MODELS = [(model, given) for model in models() if (given := sound(model)) is not None]
NUMBERS = [
    pytest.param(model, given, name, part, id=f"{model.__name__}.{name}")
    for model, given in MODELS
    for name, part in model.model_json_schema()["properties"].items()
    if "number" in {part.get("type"), *(one.get("type") for one in part.get("anyOf", ()))}
]


def refused(model: type[Input], given: dict[str, Any]) -> InvalidInputError:
    with pytest.raises(InvalidInputError) as caught:
        model(**given)
    return caught.value


def test_most_models_are_met():
    assert len(MODELS) >= 12
    assert len(NUMBERS) >= 60


@pytest.mark.parametrize(("model", "given", "name", "part"), NUMBERS)
def test_a_number(model: type[Input], given: dict[str, Any], name: str, part: dict[str, Any]):
    allowed = [one.get("const") for one in part.get("anyOf", ())]
    values = [value for value in NO_NUMBERS if value not in allowed]
    values += [change(part[limit]) for limit, change in BEYOND.items() if limit in part]
    values += [part[limit] for limit in ("exclusiveMinimum", "exclusiveMaximum") if limit in part]
    for value in values:
        error = refused(model, {**given, name: value})
        assert error.key.split(".")[0] == name, value
        assert error.allowed


@pytest.mark.parametrize(("model", "given"), MODELS, ids=lambda one: getattr(one, "__name__", ""))
def test_a_misspelt_key_is_named_with_the_right_one(model: type[Input], given: dict[str, Any]):
    known = list(model.model_fields)
    wrong = f"{known[0]}x"
    error = refused(model, {**given, wrong: 1.0})
    assert wrong in str(error)
    assert any(key in f"{error.allowed} {error.advice}" for key in known)


@pytest.mark.parametrize(("model", "given"), MODELS, ids=lambda one: getattr(one, "__name__", ""))
def test_a_required_key_that_is_missing_is_named(model: type[Input], given: dict[str, Any]):
    for key in given:
        assert refused(model, {name: value for name, value in given.items() if name != key}).key == key
