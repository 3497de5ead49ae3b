"""The folder of a recording: ``recording.yaml`` read, checked against the schema beside this file, its files found."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

from stripfold import schemas
from stripfold.errors import InvalidInputError

NAME = "recording.yaml"
MOST_BYTES = 100_000
"""Largest recording.yaml that is read: one is a few kilobytes."""
DEEPEST = 10
"""Most levels of its entries: there are four."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording that can be read.

    Attributes
    ----------
    folder
        Where it is.
    entries
        The content of recording.yaml with its defaults.
    """

    folder: Path
    entries: Mapping[str, Any]

    def file(self, *keys: str) -> Path | None:
        """The file or folder that an entry names, for instance ``("camera", "images")``; None where it names none."""
        value: Any = self.entries
        for key in keys:
            value = value.get(key) if isinstance(value, Mapping) else None
        return None if value is None else self.folder / value


FILES = (
    ("video",),
    ("timestamps",),
    ("robot_log",),
    ("camera", "images"),
    ("camera", "intrinsics"),
    ("plane", "image"),
    ("robot", "grid"),
)
"""Entries that name a file or folder."""


def read(folder: str | os.PathLike[str]) -> Recording:
    """A recording, its entries checked; the files that it names are there.

    Raises
    ------
    InvalidInputError
        No such folder or recording.yaml, a key or value that cannot be used, or a file that is missing or lies outside.
    """
    folder = Path(folder)
    path = folder / NAME
    if not path.is_file():
        raise InvalidInputError("recording", str(folder), f"a folder with a {NAME}", "docs/measuring.md shows one")
    if path.stat().st_size > MOST_BYTES:
        raise InvalidInputError(NAME, str(path), f"at most {MOST_BYTES} bytes")
    try:
        text = path.read_text(encoding="utf-8")
        _check_plain(text, path)
        given = yaml.safe_load(text)
    except InvalidInputError:
        raise
    except (OSError, ValueError, RecursionError, yaml.YAMLError) as error:
        raise InvalidInputError(NAME, str(path), "a readable YAML file", " ".join(str(error).split())) from error
    recording = Recording(folder, checked(given))
    for keys in FILES:
        _require(recording, keys)
    for key in _missing(recording):
        raise InvalidInputError(
            key, None, "a file beside a folder of frames", "frames have no time stamps of their own"
        )
    return recording


def checked(given: Any) -> dict[str, Any]:
    """The entries of a recording with their defaults.

    Raises
    ------
    InvalidInputError
        An unknown or missing key, or a value that cannot be used.
    """
    entries = schemas.complete(schema(), given)
    schemas.check(schema(), entries, "the recording")
    return dict(entries)


@lru_cache(maxsize=1)
def schema() -> dict[str, Any]:
    """The JSON schema of recording.yaml; not to be changed."""
    text = files("stripfold.vision").joinpath("recording.schema.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def _check_plain(text: str, path: Path) -> None:
    """Refuse what takes long to load: a few lines of aliases of aliases unfold to billions of entries."""
    depth = 0
    for event in yaml.parse(text, yaml.SafeLoader):
        if isinstance(event, yaml.AliasEvent):
            raise InvalidInputError(NAME, str(path), "a file without aliases (*name)", "write the entries out")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise InvalidInputError(NAME, str(path), f"entries at most {DEEPEST} levels deep")


def _require(recording: Recording, keys: tuple[str, ...]) -> None:
    path = recording.file(*keys)
    if path is None:
        return
    key, name = ".".join(keys), str(path.relative_to(recording.folder)) if not Path(path).is_absolute() else str(path)
    if recording.folder.resolve() not in path.resolve().parents:
        raise InvalidInputError(key, name, "a path inside the recording's folder", "copy the file there")
    if not path.exists():
        raise InvalidInputError(
            key, name, "an existing file or folder of the recording", f"looked in {recording.folder}"
        )


def _missing(recording: Recording) -> Iterator[str]:
    video = recording.file("video")
    if video is not None and video.is_dir() and recording.file("timestamps") is None:
        yield "timestamps"
