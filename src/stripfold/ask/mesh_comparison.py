"""What another mesh makes of the verdict on a path: the same events, and how far from the first mesh's.  In L*."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isnan, nan

from stripfold.ask.select_model import COARSER
from stripfold.base.errors import SolveError

WHERE = f"with elements {COARSER:g} times as long"


@dataclass(frozen=True)
class Events:
    """Lengths travelled at the critical points, x of the first touch, and whether the strip was not followed on."""

    travelled: tuple[float, ...]
    touch: float
    failed: bool = False


@dataclass(frozen=True)
class MeshComparison:
    """The change to the other mesh.

    ``critical``: by how much farther along the path each critical point lies; nan where the other mesh has none.
    ``touch``: by how much farther the first touch lies; nan where one of them has none.  ``said``: in words, where the
    events are not the same; else empty.
    """

    critical: tuple[float, ...]
    touch: float
    said: str


def another_mesh(run: Callable[[], Events], progress: Callable[[str], None] | None) -> Events | str:
    """The events on the other mesh, or why there are none."""
    if progress is not None:
        progress("on another mesh")
    try:
        return run()
    except SolveError as error:
        return f"{WHERE} the strip could not be followed: {error}"


def compared(found: Events, other: Events | str) -> MeshComparison:
    """The change from one mesh to the other; what follows a failure on one of them is no difference."""
    if isinstance(other, str):
        return MeshComparison((nan,) * len(found.travelled), nan, " ".join(other.split()))
    here, there = found.travelled, other.travelled
    apart = [b - a for a, b in zip(here, there, strict=False)]
    critical = (*apart, *(nan,) * (len(here) - len(apart)))
    said = ""
    if (len(here) > len(there) and not other.failed) or (len(there) > len(here) and not found.failed):
        said = f"{WHERE} the strip has {len(there) or 'no'} critical point{'s' * (len(there) != 1)}, not {len(here)}"
    elif isnan(found.touch) != isnan(other.touch) and not (found.failed or other.failed):
        said = f"{WHERE} the strip {'does not touch' if isnan(other.touch) else 'touches'}"
    return MeshComparison(critical, other.touch - found.touch, said)
