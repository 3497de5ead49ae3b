"""The functions that measure in pictures and recordings, and their results in the form of :mod:`.reporting`."""

from __future__ import annotations

import os
from dataclasses import dataclass
from math import degrees, isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

from stripfold.base.arguments import checked, file_name
from stripfold.base.errors import InvalidInputError
from stripfold.base.extras import require
from stripfold.base.material import GRAVITY
from stripfold.base.quantities import ETA_B
from stripfold.files import schema, store
from stripfold.files.reporting import Progress, Result, Rows, metres
from stripfold.film.request import KES_B, KES_HB, EtaRequest

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from stripfold.film.eta import CantileverEtaB, FoldEtaB
    from stripfold.film.measurement import Flag, Measurement


@dataclass(frozen=True, eq=False, repr=False)
class EtaB(Result):
    """A measured weight-to-bending-stiffness ratio.

    Source: docs/measuring.md.

    Attributes
    ----------
    eta_b, interval
        m^-4 s^2; the 95 % interval is known from a picture only, else nan.
    gravity_length
        L*, m.
    friction_moment, friction_moment_star
        Friction moment in bending M_0, N and rho_a g L*^2; nan if it is not known.
    fit
        Details of the fit to a picture; None without one.
    """

    eta_b: float
    gravity_length: float
    interval: tuple[float, float] = (nan, nan)
    friction_moment: float = nan
    friction_moment_star: float = nan
    fit: FoldEtaB | CantileverEtaB | None = None
    image: Any = None
    title = "a weight-to-bending-stiffness ratio"
    shown = ("eta_b", "gravity_length")

    @classmethod
    def of(cls, asked: EtaRequest) -> Self:
        """Measure it.

        Raises
        ------
        InvalidInputError
            Not a picture, or no eta_b of a strip.
        TrackingError
            No strip in the picture as the method needs it.
        """
        from stripfold.base.material import Material

        if asked.image is None or asked.scale is None or asked.method is None:
            eta_b, moment, star = _of_numbers(asked)
            unit = Material(eta_b).gravity_length
            found = cls(eta_b, unit, friction_moment=moment, friction_moment_star=star)
        else:
            require("vision")
            from stripfold.film.eta import View, from_image
            from stripfold.film.pictures import read_grey

            image = read_grey(asked.image)
            view = View(**asked.model_dump(include={"tilt", "roll", "depth"}, exclude_none=True))
            fit = from_image(image, asked.scale, asked.method, Path(asked.image).name, asked.slope, view)
            found = cls(fit.eta_b, fit.gravity_length, fit.interval, fit=fit, image=image)
        if not ETA_B[0] <= found.eta_b <= ETA_B[1]:
            key = next(key for key in ("scale", "length", "gsm") if getattr(asked, key) is not None)
            allowed = f"one that makes eta_b {ETA_B[0]:g} to {ETA_B[1]:g} m^-4 s^2; it would be {found.eta_b:.3g}"
            raise InvalidInputError(key, getattr(asked, key), allowed, "are the units as asked?")
        return found

    def rows(self) -> Rows:
        rows = [("eta_b", f"{self.eta_b:.6g} m^-4 s^2")]
        fit = self.fit
        if fit is None:
            rows.append(("L*", f"{self.gravity_length:.6g} m, Peirce's bending length"))
            text = f"{self.friction_moment_star:.4g} rho_a g L*^2, {self.friction_moment:.4g} N, friction"
            return rows if isnan(self.friction_moment) else [*rows, ("M_0", text)]
        from stripfold.film.eta import CantileverEtaB

        low, high = self.interval
        view, hangs = fit.view, isinstance(fit, CantileverEtaB)
        roll = f"roll up to {view.roll:g}, " if hangs else ""
        camera = f"tilt up to {view.tilt:g} degrees, {roll}depth {view.depth:g}"
        rows += [
            ("  95 %", f"{low:.6g} to {high:.6g} m^-4 s^2, with the scale as given; {camera}"),
            ("L*", f"{self.gravity_length:.6g} m"),
            ("residual", metres(fit.residual, "root mean square of measured less fitted")),
        ]
        if not isinstance(fit, CantileverEtaB):
            height = metres(fit.fit.height * fit.scale, "of the fitted loop, between layers' middles")
            return [*rows, ("height", height)]
        n, lower, upper = fit.exponent
        where = "more at the clamp and less" if n < 1.0 else "less at the clamp and more"
        no = f"no: one eta_b does not describe it, it bends {where} towards its end than a linear strip"
        slope = "below the horizontal at the clamp; eta_b depends on it where the strip is not linear"
        secant = "from a quarter of the largest curvature to all of it"
        law = f"M ~ curvature^n with n = {n:.3g} ({lower:.3g} to {upper:.3g})"
        return [
            *rows,
            ("length", metres(fit.line.length * fit.scale, "that hangs in the picture")),
            ("slope", f"{degrees(fit.fit.slope):.1f} degrees {slope}"),
            ("linear", f"{'yes' if fit.linear else no}; {law}"),
            ("  secant", f"eta_b {fit.secant(0.25):.6g} to {fit.secant(1.0):.6g} m^-4 s^2, {secant}"),
        ]

    def to_dict(self) -> dict[str, Any]:
        if self.fit is not None:
            return self.fit.fields()
        names = ["eta_b", "gravity_length"]
        if not isnan(self.friction_moment):
            names += ["friction_moment", "friction_moment_star"]
        return {name: getattr(self, name) for name in names}

    def to_dataset(self) -> xr.Dataset:
        low, high = self.interval
        values = {"eta_b": self.eta_b, "eta_b_lower": low, "eta_b_upper": high, "gravity_length": self.gravity_length}
        return schema.dataset({name: ((), value) for name, value in values.items()})

    def plot(self) -> Figure:
        """The fit over the picture."""
        if self.fit is None:
            raise InvalidInputError("image", None, "a picture", "without one there is nothing to draw")
        from stripfold.film import eta_figure

        return eta_figure.draw(self.image, self.fit)


def _of_numbers(asked: EtaRequest) -> tuple[float, float, float]:
    """eta_b, m^-4 s^2, and the friction moment, N and rho_a g L*^2 or nan, without a picture."""
    from stripfold import elastica

    if asked.fold_height is not None:
        return elastica.eta_b_from_fold_height(asked.fold_height), nan, nan
    if asked.loop is not None:
        assert asked.length is not None  # the request has checked both
        assert asked.height is not None
        eta_b, rho_a = elastica.eta_b_from_hanging_loop(asked.loop, asked.length, asked.height), nan
    elif asked.bending_length is not None:
        eta_b, rho_a = 1.0 / (GRAVITY * asked.bending_length**3), nan
    else:
        assert asked.gsm is not None  # the request has one of the sources
        rigidity = asked.rigidity if asked.kes_b is None else KES_B * asked.kes_b
        assert rigidity is not None
        rho_a = 1e-3 * asked.gsm
        eta_b = rho_a / rigidity
    if asked.kes_2hb is None:
        return eta_b, nan, nan
    moment = 0.5 * KES_HB * asked.kes_2hb
    return eta_b, moment, moment / (rho_a * GRAVITY * (eta_b * GRAVITY) ** (-2.0 / 3.0))


@dataclass(frozen=True, eq=False, repr=False)
class RecordingMeasurement(Result):
    """lambda at the onset of the snap in a recording, with its uncertainty.

    Source: docs/measuring.md.

    Attributes
    ----------
    details
        All that was measured: tracks, speeds, clocks, parts of the uncertainty.
    """

    details: Measurement
    shown = ("snap", "lambda_event", "interval")

    @classmethod
    def of(cls, folder: str | os.PathLike[str], progress: Progress | None = None) -> Self:
        """Measure it."""
        require("vision")
        from stripfold.film import measure, recording

        return cls(measure.measure(recording.read(folder), progress))

    @property
    def snap(self) -> bool:
        """True if there was a snap; without one ``lambda_event`` is the largest lambda, a lower bound."""
        return self.details.snapped

    @property
    def lambda_event(self) -> float:
        """lambda at the onset of the snap, m."""
        return self.details.event

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of ``lambda_event``, m."""
        return self.details.interval

    @property
    def flags(self) -> tuple[Flag, ...]:
        """Warnings, where the value or its interval is affected, and notes; empty where all is well."""
        return self.details.flags

    def rows(self) -> Rows:
        from stripfold.film import report

        return [
            ("result", report.result(self.details)),
            *report.rows(self.details),
            *self.flags,
        ]

    def __str__(self) -> str:
        return "\n".join(f"{name:<36} {text}" for name, text in self.rows())

    def to_dict(self) -> dict[str, Any]:
        found = self.details
        return {
            "snap": found.snapped,
            **found.numbers(),
            "speed": found.speed,
            "flags": [flag._asdict() for flag in found.flags],
            "manual_onset": found.manual,
            "synthetic": found.recording.entries.synthetic,
        }

    def to_dataset(self) -> xr.Dataset:
        """Over ``t`` (frames), ``moment`` (of the speed), ``station`` (along the strip); scalars for the result."""
        found, entries = self.details, self.details.recording.entries
        tracks, motion = found.tracks, found.motion
        scalars = {
            **found.numbers(),
            "lambda_sd": found.sd,
            **{f"sd_{name}": sd for name, sd in found.parts.items()},
            "snapped": int(found.snapped),
            "gripper_speed": found.speed,
            "speed_ratio": motion.ratio,
            "following": motion.following,
            "clock_offset": found.clock.offset if found.clock else nan,
            "gripper_height": entries.gripper.height,
            "eta_b": entries.strip.eta_b,
            "length": entries.strip.length,
        }
        values: schema.Values = {name: ((), value) for name, value in scalars.items()} | {
            "t": ("t", tracks.timing.time),
            "x": ("t", tracks.gripped_end[:, 0]),
            "z": ("t", tracks.gripped_end[:, 1]),
            "gripper_seen": ("t", tracks.gripper.tracked.astype("int8")),
            "gripper_score": ("t", tracks.gripper.score),
            "strip_score": ("t", tracks.score),
            "moment": ("moment", motion.t),
            "speed": ("moment", motion.u),
            "station": ("station", tracks.stations),
            "axis": ("axis", ["x", "z"]),
            "strip": (("t", "station", "axis"), tracks.points.astype("float32")),
        }
        attrs = {
            "title": f"measured: {entries.title}",
            "recording": entries.title,
            "synthetic": int(entries.synthetic),
            "flags": "; ".join(map(str, found.flags)),
            "manual_onset": found.manual,
            **{f"calibration_{name}": value for name, value in found.calibration.quality.items()},
        }
        ends = {axis: schema.Variable("m", f"{axis} of the gripped end by the video") for axis in ("x", "z")}
        return schema.dataset(values, attrs, table=schema.variables() | ends)

    def plot(self) -> Figure:
        """Gripper, speed of the strip and confidence over time."""
        from stripfold.film import measurement_figure

        return measurement_figure.draw(self.details)

    def to_netcdf(self, file: str | os.PathLike[str]) -> None:
        entries = self.details.recording.entries
        config = entries.model_dump(mode="json", exclude_none=True)
        store.write(self.to_dataset(), file, title=f"measured: {entries.title}", config=config)

    def report(self, file: str | os.PathLike[str]) -> None:
        """Write one HTML page with film, curves and numbers."""
        from stripfold.film import report

        store.write_text(report.html(self.details), file)


@checked
def eta_b(
    *,
    fold_height: float | None = None,
    image: str | os.PathLike[str] | None = None,
    scale: float | None = None,
    method: Literal["fold", "cantilever"] | None = None,
    slope: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
    depth: float | None = None,
    bending_length: float | None = None,
    rigidity: float | None = None,
    kes_b: float | None = None,
    kes_2hb: float | None = None,
    gsm: float | None = None,
) -> EtaB:
    """The weight-to-bending-stiffness ratio of a fabric.

    Parameters
    ----------
    fold_height
        Height of the loop of a strip folded in half, m; or
    image
        a picture, upright, of such a loop or of a strip that hangs out of a clamp, with
    scale
        m per pixel, and
    method
        "fold" or "cantilever".
    slope
        Angle of a cantilever below the horizontal at its clamp, degrees; fitted if left out.
    tilt, roll, depth
        What is not excluded of the camera, and so part of the interval: the angles of its axis to the strip's width and
        of its rows to the horizontal, degrees, and the strip's width over its distance; 3, 1 and 0.05 if left out.
    bending_length
        Peirce's bending length, m: it is L*; or
    rigidity
        bending stiffness per width, N m; or
    kes_b, kes_2hb
        B, gf cm^2/cm, of Kawabata's test and, if known, its 2HB, gf cm/cm: the friction; these or the rigidity with
    gsm
        weight per area, g/m^2.

    Raises
    ------
    InvalidInputError
        A value that cannot be used.
    MeasurementError
        The picture shows no such strip.

    Examples
    --------
    >>> import stripfold as sf
    >>> round(sf.eta_b(fold_height=0.0272).eta_b, 1)
    3774.6
    """
    picture = None if image is None else str(file_name("image", image))
    return EtaB.of(
        EtaRequest(
            fold_height=fold_height,
            image=picture,
            scale=scale,
            method=method,
            slope=slope,
            tilt=tilt,
            roll=roll,
            depth=depth,
            bending_length=bending_length,
            rigidity=rigidity,
            kes_b=kes_b,
            kes_2hb=kes_2hb,
            gsm=gsm,
        )
    )


@checked
def measure(folder: str | os.PathLike[str], *, progress: Progress | None = None) -> RecordingMeasurement:
    """lambda at the onset of the snap in a recording, with its uncertainty (docs/measuring.md).

    Parameters
    ----------
    folder
        With recording.yaml, the film and the calibration.
    progress
        Called with a line on what is being done.

    Raises
    ------
    InvalidInputError
        A file that cannot be read, or an entry that cannot be used.
    MeasurementError
        The files can be read but not measured.
    """
    return RecordingMeasurement.of(file_name("folder", folder), progress)
