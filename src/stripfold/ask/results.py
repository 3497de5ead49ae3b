"""Results of strips: small frozen objects with their numbers as text, JSON, dataset and figure."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, fields
from math import isfinite
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from stripfold.ask import critical_point
from stripfold.ask.critical_point import CriticalResult
from stripfold.ask.inputs import Scene
from stripfold.ask.second_gripper import SecondAlongX, second_gripper
from stripfold.ask.simulation import Simulation
from stripfold.ask.uncertain_eta_b import EtaBRange, over_eta_b
from stripfold.base.arguments import checked, file_name
from stripfold.files import schema
from stripfold.files.reporting import Progress, Result, Rows, metres

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class CriticalPoint(Result, CriticalResult):
    """The critical point of a strip whose gripper advances at constant height; lengths in m, nan where there is none.

    Source: the paper's section III; docs/physics.md, sections 4 and 5.

    Attributes
    ----------
    lambda_c
        Advance of the gripper past the flat end at the snap.
    lambda_touch, touch_x
        Where there is none: advance at which the sag touches the lower layer, and where, origin mid-strip.
    error
        Estimated error of lambda_c or lambda_touch by mesh and bracket: its distance from that of the same model on
        elements that vanish along the strip.
    lambda_c_lower, lambda_c_upper
        Its bracket on the mesh used.
    lambda_0
        Advance without horizontal force, where the motion starts.
    x_c
        Gripper at the snap, in the frame with its origin mid-strip.
    free_length
        Length off the floor where the advance ends.
    snap, reason
        Whether the strip snaps, and what ends the advance.
    model, model_error
        The model used, and a bound of the distance of its advance from the solid's, the paper's model with one
        biquadratic element across; 0 for the solid.
    solid_error
        A bound of that solid's own distance from the exact two-dimensional one, which no accuracy includes: 2e-4 of
        lambda_c at h = 0.06 L*, 3e-3 at 0.2 L*, seven times as much at nu = 0.49.  nan for the printed law.
    seconds
        Run time.
    state
        Shape (n, 2): x and z of the mid-surface where the advance ends, from the gripped end; empty where the strip is
        too short for such a state.
    eta_b_range
        The ends of the advance for an uncertain eta_b; None where no uncertainty is given.
    second_gripper
        What a second gripper gains; None where none is asked for or the strip does not snap.
    scene
        The inputs.
    """

    eta_b_range: EtaBRange | None
    second_gripper: SecondAlongX | None
    scene: Scene
    title = "a critical point"
    shown = ("model", "snap", "lambda_c", "lambda_touch", "error")

    @classmethod
    def of(cls, scene: Scene, progress: Progress | None = None) -> Self:
        """Find it."""
        found = critical_point.find(scene, progress)
        ends = None
        if scene.eta_b_uncertainty is not None:
            ends = over_eta_b(scene, scene.eta_b_uncertainty, found.lambda_c if found.snap else found.lambda_touch)
        place, second = scene.second_gripper, None
        if place is not None and found.snap:
            second = second_gripper(scene, place)
        values = {item.name: getattr(found, item.name) for item in fields(found)}
        return cls(**values, eta_b_range=ends, second_gripper=second, scene=scene)

    def rows(self) -> Rows:
        scene, ends = self.scene, self.eta_b_range
        size = f"length {scene.length_star:.4g} L*, height {scene.height_star:.4g} L*"
        if self.snap:
            end = [
                ("lambda_c", metres(self.lambda_c, "advance past the flat end at the snap")),
                ("  between", f"{self.lambda_c_lower:.9f} and {self.lambda_c_upper:.9f} m"),
            ]
            place = [("x_c", metres(self.x_c, "gripper in the frame with its origin mid-strip"))]
        else:
            end = [("touch at", metres(self.lambda_touch, "advance past the flat end, lambda_touch"))]
            place = [("touch_x", metres(self.touch_x, "there, in the frame with its origin mid-strip"))]
        return [
            ("model", f"{self.model}; L* = {scene.gravity_length:.5g} m, {size}"),
            ("snap", f"{'yes' if self.snap else 'no'}: {self.reason}"),
            ("lambda_0", metres(self.lambda_0, "advance of the gripper without horizontal force")),
            *end,
            ("  error", metres(self.error, "estimated, of mesh and bracket")),
            ("  model", metres(self.model_error, "largest distance from the solid's")),
            ("  solid", metres(self.solid_error, "largest distance of the solid's from the exact one")),
            *place,
            ("free length", metres(self.free_length, "off the floor where the advance ends")),
            *([] if ends is None else self._range_rows(ends)),
            *([] if scene.second_gripper is None else self._second_rows(self.second_gripper)),
            ("time", f"{self.seconds:.2f} s"),
        ]

    @staticmethod
    def _second_rows(second: SecondAlongX | None) -> Rows:
        if second is None:
            return [("2nd gripper", "none is needed: the strip does not snap")]
        taken = f"at lambda = {second.advance:.6g} m, x = {second.x:.4g} m, z = {second.z:.4g} m"
        return [
            ("2nd gripper", metres(second.s, f"along the strip from the first, taken {taken}")),
            ("  snap", f"{'yes' if second.snap else 'no'}: {second.reason}"),
            ("  lambda", metres(second.end, f"stable up to there, {second.gain:.4g} m more than with one gripper")),
        ]

    @staticmethod
    def _range_rows(ends: EtaBRange) -> Rows:
        rows = []
        for eta_b, snap, advance, margin in zip(ends.eta_b, ends.snap, ends.advance, ends.margin, strict=True):
            side = f"{abs(margin):.4g} m {'above' if margin > 0.0 else 'below'} the touch limit"
            rows.append((f"eta_b {eta_b:.4g}", f"{'snap' if snap else 'touch'} at {advance:.6g} m, gripper {side}"))
        return rows

    def to_dict(self) -> dict[str, Any]:
        names = ("lambda_c", "x_c", "error", "free_length", "snap", "reason", "seconds")
        ends = ("lambda_c_lower", "lambda_c_upper", "lambda_touch", "touch_x", "lambda_0")
        more = (*ends, "model", "model_error", "solid_error")
        given = {name: getattr(self, name) for name in ("eta_b_range", "second_gripper")}
        asked = {name: asdict(value) for name, value in given.items() if value is not None}
        return {name: getattr(self, name) for name in names + more} | asked

    def to_dataset(self) -> xr.Dataset:
        names = ("lambda_c", "lambda_c_lower", "lambda_c_upper", "lambda_touch", "touch_x")
        more = ("error", "lambda_0", "model_error", "solid_error", "free_length")
        values: dict[str, Any] = {name: ((), getattr(self, name)) for name in names + more}
        values |= {"x": ("node", self.state[:, 0]), "z": ("node", self.state[:, 1])}
        if (ends := self.eta_b_range) is not None:
            values |= {"end_eta_b": ("end", ends.eta_b), "end_snap": ("end", np.array(ends.snap, dtype=float))}
            values |= {"end_advance": ("end", ends.advance), "end_margin": ("end", ends.margin)}
        if (second := self.second_gripper) is not None:
            values |= {f"second_{key}": ((), float(item)) for key, item in asdict(second).items() if key != "reason"}
        values["gripper_height"] = ((), self.scene.height)
        attrs = {"model": self.model, "snap": int(self.snap), "reason": self.reason}
        return schema.dataset(values, attrs)

    def plot(self) -> Figure:
        """The strip where the advance ends."""
        from stripfold.draw.results import draw_strip

        return draw_strip([self.state])

    def config(self) -> dict[str, Any]:
        return self.scene.model_dump()


@dataclass(frozen=True, eq=False, repr=False)
class StripCollapse(Result):
    """A strip through its collapse: statics to lambda_c, the fall, statics again.

    Source: docs/physics.md, section 6.

    Attributes
    ----------
    dataset
        All states over ``state`` and ``node``, with their ``phase``, energies and contacts.
    simulation
        The inputs.
    """

    dataset: xr.Dataset
    simulation: Simulation
    title = "a strip through its collapse"
    shown = ("lambda_c", "touch", "rest_time")

    @classmethod
    def of(cls, simulation: Simulation, progress: Progress | None = None) -> Self:
        """Simulate it."""
        from stripfold.ask import collapse_record

        return cls(collapse_record.run(simulation, progress), simulation)

    @property
    def lambda_c(self) -> float:
        """Advance of the gripper past the flat end at the snap, m."""
        return float(self.dataset["lambda_c"])

    @property
    def touch(self) -> tuple[float, float]:
        """Time of the first touch after the release, s, and its x, m; nan where there is none."""
        return float(self.dataset["touch_time"]), float(self.dataset["touch_x"])

    @property
    def rest_time(self) -> float:
        """Time from the release to rest, s; nan where the fall was not followed so far."""
        return float(self.dataset["settle_time"])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Effects that the scene needs and that were switched off."""
        missing = filter(None, self.dataset.attrs["missing"].split(", "))
        reasons = self.dataset["reason"]
        in_si = self.simulation.material.in_si
        return tuple(f"{name} is off and needed: {in_si(reasons.sel(effect=name).item())}" for name in missing)

    def rows(self) -> Rows:
        time, x = self.touch
        active = self.dataset["effect"].values[self.dataset["active"].values == 1.0]
        return [
            ("lambda_c", metres(self.lambda_c, "advance of the gripper past the flat end at the snap")),
            ("touch", f"after {time:.4g} s at x = {x:.4g} m" if isfinite(time) else "-"),
            ("rest", f"after {self.rest_time:.4g} s" if isfinite(self.rest_time) else "-"),
            ("effects", ", ".join(map(str, active))),
            ("end", self.dataset.attrs["end"]),
        ]

    def to_dict(self) -> dict[str, Any]:
        time, x = self.touch
        return {"lambda_c": self.lambda_c, "touch_time": time, "touch_x": x, "rest_time": self.rest_time}

    def to_dataset(self) -> xr.Dataset:
        return self.dataset

    def plot(self) -> Figure:
        """lambda over the deflection, through the collapse."""
        from stripfold.draw import collapse_curve

        return collapse_curve.draw(self.dataset)

    @checked
    def film(self, file: str | os.PathLike[str], progress: Progress | None = None) -> None:
        """Draw it as an MP4 film."""
        from stripfold.base.extras import require

        require("vision")
        from stripfold.draw.film import film

        film(self.dataset, file_name("file", file), progress=progress)

    def config(self) -> dict[str, Any]:
        return self.simulation.as_config()
