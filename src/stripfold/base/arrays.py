"""The types of array that the whole package shares, and equality of what holds arrays."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import fields
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]
Picture = NDArray[np.uint8]


class ByValue:
    """Equality and hash of a frozen dataclass by the values of its fields, of arrays too."""

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and _values(other) == _values(self)

    def __hash__(self) -> int:
        return hash(_values(self))


class ByFields:
    """Copies of a frozen dataclass by what it was made of: what has been computed from that is the larger part."""

    def __reduce__(self) -> tuple[partial[Self], tuple[()]]:
        made_of = {item.name: getattr(self, item.name) for item in fields(self) if item.init}  # type: ignore[arg-type]
        return partial(type(self), **made_of), ()


def _values(of: Any) -> tuple[Hashable, ...]:
    return tuple(_value(getattr(of, item.name)) for item in fields(of))


def _value(of: Any) -> Hashable:
    if isinstance(of, tuple):
        return tuple(map(_value, of))
    # Adding zero makes -0.0 the 0.0 that it is equal to.
    return (of.shape, (of + 0.0).tobytes()) if isinstance(of, np.ndarray) else of
