"""What the commands share: where they write, how they print, what they show meanwhile."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Any

from stripfold.errors import InvalidInputError


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """A function that shows what is being done, on a terminal only."""
    from tqdm import tqdm

    with tqdm(disable=None, leave=False, file=sys.stderr, bar_format="{desc} [{elapsed}]") as bar:
        yield bar.set_description_str


def metres(value: float, what: str) -> str:
    """A length with what it is."""
    return f"{value:.6g} m  ({what})" if isfinite(value) else "-"


def output_path(given: str | None, source: str, suffix: str) -> Path:
    """Where to write: as asked, or in the working folder under the source's name."""
    path = Path(given or Path(source).with_suffix(suffix).name)
    if path.suffix != suffix:
        raise InvalidInputError("output", str(path), f"a name that ends in {suffix}")
    if not path.parent.is_dir():
        raise InvalidInputError("output", str(path), "a path in an existing folder", f"make {path.parent} first")
    return path


def as_json(values: Mapping[str, Any]) -> str:
    """One JSON object; JSON has no nan: where there is no number there is null."""

    def plain(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: plain(item) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [plain(item) for item in value]
        return None if isinstance(value, float) and not isfinite(value) else value

    return json.dumps(plain(values), allow_nan=False)
