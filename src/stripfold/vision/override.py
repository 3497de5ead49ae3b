"""An event set by hand: ``override.yaml`` in a recording's folder; whatever it gives is stored as such."""

from __future__ import annotations

from dataclasses import dataclass

import yaml

from stripfold import schemas
from stripfold.errors import InvalidInputError
from stripfold.vision.recording import Recording

NAME = "override.yaml"
SCHEMA = {
    "type": "object",
    "additionalProperties": False,
    "required": ["event_time", "sd", "reason"],
    "properties": {
        "event_time": {"type": "number", "description": "When the snap sets in, s by the video's clock."},
        "sd": {"type": "number", "exclusiveMinimum": 0, "description": "Its standard deviation, s."},
        "reason": {"type": "string", "minLength": 1, "description": "Why it was set by hand."},
    },
}
MOST_BYTES = 10_000


@dataclass(frozen=True, slots=True)
class Override:
    """Time of the event, s, its standard deviation, s, and why it was set by hand."""

    event_time: float
    sd: float
    reason: str

    @classmethod
    def of(cls, recording: Recording) -> Override | None:
        """The override of a recording; None where it has none.

        Raises
        ------
        InvalidInputError
            The file cannot be used.
        """
        path = recording.folder / NAME
        if not path.exists():
            return None
        if path.stat().st_size > MOST_BYTES:
            raise InvalidInputError(NAME, str(path), f"at most {MOST_BYTES} bytes")
        try:
            given = yaml.safe_load(path.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError, yaml.YAMLError) as error:
            raise InvalidInputError(NAME, str(path), "a readable YAML file", " ".join(str(error).split())) from error
        schemas.check(SCHEMA, given, "the override")
        return cls(float(given["event_time"]), float(given["sd"]), str(given["reason"]))
