"""A gripper path for strips of one length, in SI: planned, or a user's own."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Protocol, runtime_checkable

from stripfold.base.arguments import checked, file_name
from stripfold.base.arrays import Array, ByValue
from stripfold.base.errors import InvalidInputError
from stripfold.base.validation import Input, Number, quantity
from stripfold.paths import geometric, rpath, table
from stripfold.paths.curve import GripperPath

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class PlannedPath(Input):
    """A path of a kind, for a strip."""

    fold_at: Annotated[
        Number | None, quantity("distance of the fold line from the gripped end; by default half the length", "m")
    ] = None
    height: Annotated[Number | None, quantity("height of the gripper on the low path", "m")] = None


@runtime_checkable
class AnyStrip(Protocol):
    """A strip as far as a path needs it."""

    @property
    def eta_b(self) -> float:
        """Weight-to-bending-stiffness ratio, m^-4 s^2."""

    @property
    def length(self) -> float:
        """Length, m."""

    @property
    def gravity_length(self) -> float:
        """L*, m."""


@dataclass(frozen=True, eq=False)
class FoldPath(ByValue):
    """A gripper path for any strip of one length; x and z in the frame with its origin mid-strip on the floor.

    Make one with :func:`r_path`, :func:`triangular`, :func:`circular`, :func:`low` or :func:`read`.

    Attributes
    ----------
    name
        "r-path", "triangular", "circular", "low", or the name of the file.
    length
        Length of the strip, m.
    gravity_length
        L* of the strip that it was made for, m: its places are at most 0.05 L* apart.
    curve
        The path itself; lengths in m.
    fold_at
        Distance of the fold line from the gripped end, m; None for a half fold.
    """

    name: str
    length: float
    gravity_length: float
    curve: GripperPath = field(repr=False)
    fold_at: float | None = None

    @property
    def places(self) -> Array:
        """Shape (n, 3): rows of pseudo time, and x and z of the gripper, m; corners are among them."""
        return table.rows(self.curve, self.spacing)

    @property
    def spacing(self) -> float:
        """Largest distance between two places, m."""
        return table.SPACING * self.gravity_length

    def as_text(self) -> str:
        """The path as a table ``t,x,z``, and ``angle``, degrees, where it says how the gripper turns."""
        comment = f"{self.name}, length {self.length:g} m, L* {self.gravity_length:.6g} m"
        fold = "" if self.fold_at is None else f", fold at {self.fold_at:g} m"
        return table.as_text(self.curve, self.spacing, (comment + fold,))

    def to_dict(self) -> dict[str, Any]:
        """Its name, and the columns of :attr:`places` by name."""
        t, x, z = self.places.T.tolist()
        return {"path": self.name, "t": t, "x": x, "z": z}

    def to_csv(self, file: str | os.PathLike[str]) -> None:
        """Write the table :meth:`as_text`, which :func:`read` takes."""
        from stripfold.files.store import write_text

        write_text(self.as_text(), file)

    def to_dataset(self) -> xr.Dataset:
        """x and z of the gripper, m, over the pseudo time."""
        from stripfold.files import schema

        t, x, z = self.places.T
        values = {"pseudo_time": ("pseudo_time", t), "gripper_x": ("pseudo_time", x), "gripper_z": ("pseudo_time", z)}
        return schema.dataset(values, {"path": self.name, "length": self.length})

    def plot(self) -> Figure:
        """The path."""
        from stripfold.draw.results import draw_strip

        return draw_strip([], self.places[:, 1:])


@checked
def r_path(strip: AnyStrip, fold_at: float | None = None) -> FoldPath:
    """The R-path of a half fold: it keeps the lying length of the folded state (docs/physics.md, section 9).

    With ``fold_at``, m, the fold line is at that distance from the gripped end: the path is that of the half fold of
    twice this length, and what is beyond lies still.

    Raises
    ------
    InvalidInputError
        The strip is too short to be folded in half, or longer than tested.
    SolveError
        A planned state could not be computed.
    """
    return _planned(strip, "r-path", lambda length: rpath.plan_r_path(length).path, fold_at)


@checked
def triangular(strip: AnyStrip, fold_at: float | None = None) -> FoldPath:
    """Straight up at 45 degrees to the middle and straight down (Berg et al., WAFR 2010)."""
    return _planned(strip, "triangular", geometric.triangular, fold_at)


@checked
def circular(strip: AnyStrip, fold_at: float | None = None) -> FoldPath:
    """The half circle about the fold line (Petrik et al., TAROS 2015)."""
    return _planned(strip, "circular", geometric.circular, fold_at)


@checked
def low(strip: AnyStrip, height: float, fold_at: float | None = None) -> FoldPath:
    """Up to a height, m, over at that height, and down; snaps need more than 1.586 L* (docs/low-path.md).

    Raises
    ------
    InvalidInputError
        As :func:`r_path`, or a height less than 0.1 L* or more than a quarter of the length.
    """
    folded, asked = _folded(strip, fold_at), PlannedPath(height=height).height
    lowest, highest = geometric.LOWEST * strip.gravity_length, geometric.HIGHEST * folded
    if asked is None or not lowest <= asked <= highest:
        advice = f"the path is stable below {1.586 * strip.gravity_length:.4g} m"
        raise InvalidInputError("height", height, f"from {lowest:.4g} to {highest:.4g} m", advice)
    return _planned(strip, "low", lambda length: geometric.low(length, height / strip.gravity_length), fold_at)


def lifted_triangular(strip: AnyStrip, height: float) -> FoldPath:
    """The triangular path with a start that does not push: :func:`.geometric.lifted_triangular`; the height in m."""
    star = height / strip.gravity_length
    return _planned(strip, "triangular", lambda length: geometric.lifted_triangular(length, star), None)


PLANS: dict[str, Callable[[AnyStrip, float | None], FoldPath]] = {
    "r-path": r_path,
    "triangular": triangular,
    "circular": circular,
}
"""The paths of the paper by their names: these need a strip only."""


@checked
def read(
    file: str | os.PathLike[str],
    strip: AnyStrip,
    *,
    columns: str | None = None,
    unit: str | None = None,
    frame: str | None = None,
    smooth: float | None = None,
    fold_at: float | None = None,
) -> FoldPath:
    """A path of your own from a CSV file with the columns ``t,x,z``: pseudo time, ascending; place of the gripper, m.

    It starts at (-length/2, 0), where the flat strip ends.  Rows that turn by more than 10 degrees are corners; between
    corners a spline goes through the rows.  A column ``angle`` is the rotation of the gripper, degrees: 0 where it
    grasps the flat strip, 180 on the folded one.  A robot's log may miss the start, the floor or the strip's length by
    5 mm and 5 % of the length: it is moved, and ``curve.warnings`` says how.

    Parameters
    ----------
    file
        Table with semicolons, tabs, commas or blanks between the columns; where it is no comma, a comma may be the
        decimal mark.
    strip
        The strip.
    columns
        Names or numbers, from 1 on, of the columns of time, x and z, as ``"time,tcp_x,tcp_z"``.
    unit
        Of x and z in the file, "m", "cm" or "mm"; without it what the header says, as ``x [mm]``, or m.
    frame
        ``"x0,z0"``, m: the point on the floor under the middle of the strip in the file's frame; ``"x0,z0,flip"`` where
        its x runs against the direction of folding.
    smooth
        Largest distance of the path from the rows, m, for a log with noise.
    fold_at
        Distance of the fold line from the gripped end, m, of a path that folds less than half of the strip.

    Raises
    ------
    InvalidInputError
        No such table, or a path that this strip cannot follow; the message names the row.
    """
    _folded(strip, fold_at)
    star, log = strip.gravity_length, table.LogFormat(columns=columns, unit=unit, frame=frame, smooth=smooth)
    curve = table.read(file_name("file", file), strip.length / star, star, log)
    return FoldPath(curve.name, strip.length, star, curve.scaled(star), fold_at)


def _folded(strip: AnyStrip, fold_at: float | None) -> float:
    """Length of the two layers together, m.

    Raises InvalidInputError: no strip, or no place for its fold line.
    """
    if not isinstance(strip, AnyStrip):
        raise InvalidInputError("strip", strip, "a stripfold.Strip")
    fold_at = PlannedPath(fold_at=fold_at).fold_at
    if fold_at is None:
        return strip.length
    if not 0.0 < fold_at <= strip.length / 2.0:
        raise InvalidInputError(
            "fold_at", fold_at, f"more than 0 and at most {strip.length / 2.0:g} m, half the length"
        )
    return 2.0 * fold_at


def _planned(strip: AnyStrip, name: str, plan: Callable[[float], GripperPath], fold_at: float | None) -> FoldPath:
    folded, unit = _folded(strip, fold_at), strip.gravity_length
    try:
        curve = plan(folded / unit).scaled(unit, (folded - strip.length) / 2.0)
    except InvalidInputError as error:
        key, value, share = ("length", strip.length, 1.0) if fold_at is None else ("fold_at", fold_at, 0.5)
        shortest, longest = share * rpath.shortest_half_fold() * unit, share * rpath.LONGEST * unit
        allowed = f"more than {shortest:.4g} m and at most {longest:.4g} m"
        raise InvalidInputError(key, value, allowed, error.advice) from error
    return FoldPath(name, strip.length, unit, curve, fold_at)
