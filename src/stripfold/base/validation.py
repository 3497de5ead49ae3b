"""Input models: pydantic checks what a user gives, and what it finds becomes one error that names the key."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from functools import cache
from math import inf
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from stripfold.base.errors import MISSING, InvalidInputError
from stripfold.base.material import GRAVITY, UNITS

if TYPE_CHECKING:
    import yaml

MOST_BYTES = 200_000
"""Largest YAML file that is read: a camera's with the corners of a hundred views is smaller."""
DEEPEST = 10
"""Most levels of nested entries in a YAML file."""
YAML_NUMBERS = "YAML reads a number with an exponent as a text unless it has a point: write 1.0e-3"
_NUMBER = re.compile(r"([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?)\s*(.*)", re.DOTALL)


class Input(BaseModel):
    """Base of the input models: frozen, unknown keys refused, every error an :class:`.InvalidInputError`.

    A validator of a model raises :class:`.InvalidInputError` with a key relative to the model.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, /, **given: Any) -> None:
        try:
            super().__init__(**given)
        except ValidationError as error:
            raise _explained(error, type(self)) from None

    @classmethod
    def of(cls, given: Any) -> Self:
        """The model itself, or one from keys and values of any mapping.

        Raises InvalidInputError: no mapping, or what the model refuses.
        """
        if type(given) is cls:
            return given
        if not isinstance(given, Mapping):
            raise InvalidInputError("", given, "keys and values")
        return cls(**with_text_keys(given))

    # Without this mark pydantic would make nested models one by one, and an error would lose the way to its key.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]


@contextmanager
def within(*path: str | int) -> Iterator[None]:
    """Errors get the path to the entry that they are about put before their key."""
    try:
        yield
    except InvalidInputError as error:
        raise _placed(path, error) from None


def _placed(path: Iterable[str | int], error: InvalidInputError) -> InvalidInputError:
    key = dotted((*path, error.key) if error.key else path)
    return InvalidInputError(key, error.value, error.allowed, error.advice)


def _real(value: Any) -> float:
    # A bool is a number to Python, and a mistake to everybody else.
    if isinstance(value, bool) or not isinstance(value, Real):
        raise PydanticCustomError("number", "not a number")
    try:
        return float(value)
    except OverflowError:
        raise PydanticCustomError("number", "too large") from None


Number = Annotated[float, BeforeValidator(_real)]
"""A finite real number; numpy's too, no bool and no text."""
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Text = Annotated[str, Field(pattern=r"\S")]
T = TypeVar("T")


def _no_two_alike(values: list[Any]) -> list[Any]:
    if any(value in values[:i] for i, value in enumerate(values)):
        raise PydanticCustomError("unique", "two entries are alike")
    return values


# Lists without repeated entries.
_UNIQUE = {"uniqueItems": True}
Distinct = Annotated[list[T], Field(json_schema_extra=_UNIQUE), AfterValidator(_no_two_alike)]
AtLeastOne = Annotated[list[T], Field(min_length=1, json_schema_extra=_UNIQUE), AfterValidator(_no_two_alike)]


def quantity(what: str, unit: str = "", **limits: float) -> Any:
    """Description, unit and limits (``ge``, ``gt``, ``le``, ``lt``) for ``Annotated[Number, quantity(...)]``."""
    names = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum", "lt": "exclusiveMaximum"}
    # Beside a validator of its own pydantic leaves the limits out of the JSON schema.
    extra = {names[key]: limit for key, limit in limits.items()} | ({"unit": unit} if unit else {})
    return Field(description=what, json_schema_extra=extra, **limits)  # type: ignore[call-overload]


def number_meant(text: str, unit: str = "") -> str:
    """Say how to write what was given as a text in place of a number in ``unit``.

    Examples
    --------
    >>> number_meant("45cm", "m"), number_meant("0,45", "m"), number_meant("20%"), number_meant("1e-3")[:10]
    ('write 0.45', 'write 0.45', 'write 0.2', 'YAML reads')
    """
    found = _NUMBER.fullmatch(text.strip())
    if not found:
        return ""
    value, behind = found[1].replace(",", "."), "".join(found[2].split())
    if value == text.strip():
        return YAML_NUMBERS if "e" in value.casefold() else "it is a text: leave the quotes out"
    factor = {"": 1.0, "".join(unit.split()): 1.0, **_other_units(unit)}.get(behind)
    if factor is None:
        return f"write the number alone{', in ' if unit else ''}{unit}"
    return f"write {float(value) * factor:.12g}"


def value_meant(value: float, unit: str, low: float, high: float) -> str:
    """Say in which other unit a value would lie within its limits; empty where in none."""
    meant = [
        f"{value:g} {name} is {value * factor:.6g}{unit and ' '}{unit}"
        for name, factor in _other_units(unit).items()
        if factor != 1.0 and low <= value * factor <= high
    ]
    if unit == "m^-4 s^2" and 0.0 < value < low <= (eta_b := 1.0 / (GRAVITY * value**3)) <= high:
        meant.append(f"if it is L* in m, eta_b is {eta_b:.4g}")
    return " or ".join(meant)


def _other_units(unit: str) -> dict[str, float]:
    return {"%": 0.01} if not unit else UNITS.get(unit, {})


def read_yaml(
    path: str | os.PathLike[str], key: str, example: str, plain: Callable[[str], str] = str
) -> dict[str, Any]:
    """The keys and values in a YAML file.

    ``path``: the file; ``key``: what the file is called in an error; ``example``: keys and values as they could stand
    in it, for the error; ``plain``: makes YAML of the text of a file that is not quite YAML.  Raises InvalidInputError:
    not readable, too large, with aliases or tags, too deeply nested, with a key twice, or not a mapping.
    """
    import yaml

    path = Path(path)

    def refuse(allowed: str, advice: str = "") -> None:
        raise InvalidInputError(key, str(path), allowed, advice)

    try:
        if path.exists() and not path.is_file():  # a pipe would block
            refuse("a readable YAML file", "it is not a file")
        if path.stat().st_size > MOST_BYTES:
            refuse(f"a file of at most {MOST_BYTES} bytes")
        given = _plain_yaml(plain(path.read_text(encoding="utf-8")), refuse)
    except InvalidInputError:
        raise
    except (OSError, ValueError, RecursionError, yaml.YAMLError) as error:
        said = " ".join(str(error).split())
        if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:  # its text shows a line as well
            said = f"{error.problem} in line {error.problem_mark.line + 1}, column {error.problem_mark.column + 1}"
        raise InvalidInputError(key, str(path), "a readable YAML file", said) from error
    if not isinstance(given, Mapping):
        raise InvalidInputError(key, str(path), f"a file of keys and values, as {example}")
    content: dict[str, Any] = with_text_keys(given)
    return content


def with_text_keys(value: Any) -> Any:
    """A deep copy in plain dicts with texts as keys, and lists."""
    if isinstance(value, Mapping):
        return {str(key): with_text_keys(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [with_text_keys(item) for item in value]
    return value


def _plain_yaml(text: str, refuse: Callable[[str, str], None]) -> Any:
    """Load a YAML text; ``refuse`` is called with what is allowed and advice.

    A few lines of aliases of aliases unfold to billions of entries, a tag converts what may not be of that type, and of
    a key that stands twice YAML takes the last without a word.
    """
    import yaml

    class Plain(yaml.SafeLoader):
        depth = 0

        def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
            event = self.peek_event()  # type: ignore[no-untyped-call]
            if isinstance(event, yaml.AliasEvent):
                refuse("a file without aliases (*name)", "write the entries out")
            if (tag := getattr(event, "tag", None)) is not None:
                refuse(f"a file without tags ({tag[:40]})", "leave the tag out")
            self.depth += isinstance(event, yaml.CollectionStartEvent)
            if self.depth > DEEPEST:
                refuse(f"entries at most {DEEPEST} levels deep", "")
            node = super().compose_node(parent, index)
            self.depth -= isinstance(node, yaml.CollectionNode)
            lines: dict[str, int] = {}
            for name, _ in node.value if isinstance(node, yaml.MappingNode) else ():
                line, known = name.start_mark.line + 1, str(name.value)
                if known in lines:
                    refuse("a file in which each key stands once", f"{known} is in lines {lines[known]} and {line}")
                lines[known] = line
            return node

    return yaml.load(text, Plain)


def dotted(path: Iterable[str | int]) -> str:
    """A path of keys as people write it: materials[0].heights[1]."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).removeprefix(".")


def did_you_mean(key: str, known: Iterable[str]) -> str:
    """Advice on an unknown name: those that have it as one of their words, or else the nearest."""
    known = list(known)
    near = [name for name in known if key.strip("-") in re.split("[-_]", name)] or get_close_matches(key, known, 1)
    return f"did you mean {' or '.join(near)}?" if near else "remove it"


def _explained(error: ValidationError, model: type[BaseModel]) -> InvalidInputError:
    """The first of pydantic's findings: unknown keys before all others, since a misspelt key is missing, too."""
    findings = error.errors(include_url=False)
    first = min(findings, key=lambda found: found["type"] != "extra_forbidden")
    return _in_words(first, _schema(model))


@cache
def _schema(model: type[BaseModel]) -> dict[str, Any]:
    return model.model_json_schema()


def _in_words(found: ErrorDetails, schema: dict[str, Any]) -> InvalidInputError:
    path, kind = found["loc"], found["type"]
    cause = found.get("ctx", {}).get("error")
    if isinstance(cause, InvalidInputError):
        return _placed(path, cause)
    if kind == "extra_forbidden":
        known = list(_at(schema, path[:-1]).get("properties", {}))
        advice = did_you_mean(str(path[-1]), known)
        return InvalidInputError(dotted(path), found["input"], f"only the keys {', '.join(known)}", advice)
    # Pydantic puts the kinds that an entry may be of after its key, as literal['auto'].
    path = tuple(key for key in path if isinstance(key, int) or "[" not in key)
    if kind == "missing" and isinstance(path[-1], int):
        path = path[:-1]  # one of a fixed number of entries: it is the list that is wrong
    rules = _at(schema, path)
    if kind == "missing" and not isinstance(found["input"], list | tuple):
        return InvalidInputError(dotted(path), MISSING, allowed(rules))
    given, advice, unit = found["input"], "", rules.get("unit", "")
    if isinstance(given, str) and rules.get("type") in ("number", "integer"):
        advice = number_meant(given, unit)
    elif isinstance(given, Real) and kind != "number" and rules.get("type") == "number":
        low = rules.get("minimum", rules.get("exclusiveMinimum", -inf))
        advice = value_meant(float(given), unit, low, rules.get("maximum", rules.get("exclusiveMaximum", inf)))
    return InvalidInputError(dotted(path) or "input", given, allowed(rules), advice)


def _at(schema: Mapping[str, Any], path: Iterable[str | int]) -> dict[str, Any]:
    """The part of a JSON schema that describes the entry at a path, what ``$ref`` refers to filled in."""

    def resolved(rules: Mapping[str, Any]) -> dict[str, Any]:
        # An optional entry: what it is when it is given.
        given = [way for way in rules.get("anyOf", []) if way.get("type") != "null"]
        rules = {**rules, **given[0]} if given else dict(rules)
        while "$ref" in rules:
            rules = dict(rules)
            target = schema["$defs"][rules.pop("$ref").removeprefix("#/$defs/")]
            rules = {**target, **rules}
        return dict(rules)

    rules = resolved(schema)
    for key in path:
        if isinstance(key, int):
            items = rules.get("prefixItems", [])
            rules = resolved(items[key] if key < len(items) else rules.get("items", {}))
        elif key in rules.get("properties", {}):
            rules = resolved(rules["properties"][key])
    return rules


def allowed(rules: Mapping[str, Any]) -> str:
    """A part of a JSON schema in words."""
    if "enum" in rules or "const" in rules:
        words = "one of " + ", ".join(map(str, rules.get("enum", [rules.get("const")])))
    else:
        kinds = {"array": "a list", "object": "keys and values", "string": "a text", "integer": "a whole number"}
        words = {**kinds, "boolean": "true or false"}.get(rules.get("type", ""), "a number")
    low, high = rules.get("minimum"), rules.get("maximum")
    if low is not None and high is not None:
        words += f" from {low:g} to {high:g}"
    fixed = "minItems" in rules and rules["minItems"] == rules.get("maxItems")
    limits = {
        "minimum": "of at least {:g}" if high is None else "",
        "exclusiveMinimum": "greater than {:g}",
        "maximum": "of at most {:g}" if low is None else "",
        "exclusiveMaximum": "less than {:g}",
        "minItems": "of {:g} entries" if fixed else "of at least {:g} entries",
        "maxItems": "" if fixed else "of at most {:g} entries",
    }
    parts = [text.format(rules[key]) for key, text in limits.items() if text and key in rules]
    words = " ".join([words, " and ".join(parts)]) if parts else words
    words += f" {rules['unit']}" if "unit" in rules else ""
    if rules.get("uniqueItems"):
        words += ", no two alike"
    return words + (f" ({rules['description']})" if "description" in rules else "")


# Quantities of a strip that several input models have.
ETA_B = (1e-1, 1e8)
"""Allowed weight-to-bending-stiffness ratios, m^-4 s^2: from a metal sheet to a gauze."""
HEIGHT_STAR = (0.1, 60.0)
"""Allowed gripper heights, L*; below the lowest the planning model has not been tested."""

MovingModel = Literal["solid", "rod"]
Gripper = Literal["hinge", "fixed", "turning"]
"""How the end of the strip is held: freely to turn, or clamped by a gripper that does not turn or turns as planned."""

Length = Annotated[Number, quantity("length of the strip", "m", ge=1e-6, le=1e6)]
Height = Annotated[Number, quantity("height of the gripper", "m", ge=1e-6, le=1e6)]
EtaB = Annotated[Number, quantity("weight-to-bending-stiffness ratio", "m^-4 s^2", ge=ETA_B[0], le=ETA_B[1])]
EtaM = Annotated[Number, quantity("weight-to-membrane-stiffness ratio", "m^-2 s^2", ge=1e-9, le=0.1)]
Nu = Annotated[Number, quantity("Poisson's ratio", ge=0.0, le=0.49)]
RhoA = Annotated[Number, quantity("areal density; scales forces only", "kg m^-2", ge=1e-4, le=1e3)]
Gravity = Annotated[Number, quantity("gravitational acceleration", "m s^-2", ge=0.1, le=100.0)]
Accuracy = Annotated[Number, quantity("requested relative accuracy of lambda_c", ge=1e-6, le=0.1)]
Air = Annotated[Number, quantity("mass-proportional damping", "s^-1", ge=0.0, le=100.0)]
Stiffness = Annotated[Number, quantity("stiffness-proportional damping", "s", ge=0.0, le=1.0)]
