"""An event set by hand: ``override.yaml`` in a recording's folder; whatever it gives is stored as such."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from stripfold.validation import Input, Number, Text, quantity, read_yaml
from stripfold.vision.recording import Recording

NAME = "override.yaml"


class Override(Input):
    """An event set by hand."""

    event_time: Annotated[Number, quantity("when the snap sets in, by the video's clock", "s")]
    sd: Annotated[Number, quantity("its standard deviation", "s", gt=0.0)]
    reason: Annotated[Text, Field(description="why it was set by hand")]

    @classmethod
    def read(cls, recording: Recording) -> Override | None:
        """The override of a recording; None where it has none.

        Raises
        ------
        InvalidInputError
            The file cannot be used.
        """
        path = recording.folder / NAME
        if not path.exists():
            return None
        return cls(**read_yaml(path, NAME, "event_time: 3.5"))
