"""Results of the public API: small frozen objects with their numbers as text, JSON, dataset and figure."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from math import isfinite, nan
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from stripfold import schema
from stripfold.analysis import critical_point, verdict
from stripfold.analysis.assess import Followed
from stripfold.analysis.critical_point import CriticalResult
from stripfold.analysis.mesh_comparison import WHERE
from stripfold.analysis.phases import AFTER, BEFORE, FALL, SLOW
from stripfold.analysis.second_gripper import SecondAlongX, second_gripper
from stripfold.analysis.second_on_path import SecondOnPath, second_on_path
from stripfold.analysis.uncertain_eta_b import EtaBRange, over_eta_b
from stripfold.analysis.verdict import Verdict
from stripfold.inputs import PathAssessment as Asked
from stripfold.inputs import Scene
from stripfold.paths import FoldPath
from stripfold.reporting import Progress, Result, Rows, metres
from stripfold.simulation import Simulation
from stripfold.solve.dynamics import TimeState

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


NODES = 201
"""Nodes along the strip at which states on a path are stored: their own meshes differ."""


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
        Estimated error of lambda_c or lambda_touch by mesh and bracket.
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
        The model used, and the estimated distance of its advance from the solid's; 0 for the solid.
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
            ("  model", metres(self.model_error, "estimated distance from the solid's")),
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
        more = ("lambda_c_lower", "lambda_c_upper", "lambda_touch", "touch_x", "lambda_0", "model", "model_error")
        given = {name: getattr(self, name) for name in ("eta_b_range", "second_gripper")}
        asked = {name: asdict(value) for name, value in given.items() if value is not None}
        return {name: getattr(self, name) for name in names + more} | asked

    def to_dataset(self) -> xr.Dataset:
        names = ("lambda_c", "lambda_c_lower", "lambda_c_upper", "lambda_touch", "touch_x")
        more = ("error", "lambda_0", "model_error", "free_length")
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
        from stripfold.plots.results import draw_strip

        return draw_strip([self.state])

    def config(self) -> dict[str, Any]:
        return self.scene.model_dump()


@dataclass(frozen=True, eq=False, repr=False)
class PathAssessment(Result, Verdict):
    """A gripper path assessed for a strip; lengths in m, forces in N per m of width, nan where there is no such thing.

    Source: the paper's section IV; docs/physics.md, sections 5, 8 and 9.

    Attributes
    ----------
    stable
        Whether the strip follows all of the path.
    critical
        Its critical points: ``t``, ``x``, ``z`` of the gripper, ``kind``, the ``angle`` with the stability boundary in
        degrees, and how large the event is: ``drop``, the largest height that a point of the strip loses, m, and
        ``energy`` freed, J per m of width; nan without a fall.  ``outcome`` says in words what the strip did;
        ``change`` is by how much farther along the path it lies on another mesh, m; nan where that mesh has none.
    touch_x, planned_touch_x, touch_error
        Where the upper layer first touches, where that of the strip's planned R-path does (the accurate fold), and the
        difference.  The fold line is at x = 0, for a half fold.
    landing_x
        Where the folded state lands.
    shape_error
        Largest distance of the last state from the folded one; nan for a path that ends elsewhere.
    lying_length
        Length that lies from the held end in the last state.
    peak_force, peak_hold
        Largest force of the gripper, and horizontal force of the held end, in the static states.
    completed
        Whether the path was followed to its end.
    contact
        "moving" where the ends of the contact were unknowns in all static states, "nodal" where the contact was found
        node by node in some.
    failure
        Why the fall, or what comes after it, could not be followed; empty where it could or was not asked for.
    second_gripper
        How far the strip follows with a second gripper; None where none is asked for or there is no critical point.
    touch_change, mesh_dependence
        By how much farther the first touch lies on another mesh, with elements half as long again; and in words what
        else is different there, empty where the verdict is the same.  A motion in time is of one mesh.
    path, asked, seconds
        The path, the other inputs, and the run time.
    """

    second_gripper: SecondOnPath | None
    path: FoldPath
    asked: Asked
    seconds: float
    title = "a gripper path assessed"
    shown = ("stable", "completed", "touch_x", "touch_error")

    @classmethod
    def of(cls, asked: Asked, path: FoldPath, began: float, progress: Progress | None = None) -> Self:
        """Assess it; ``began`` is when that started."""
        found = verdict.assess_path(
            asked.material,
            asked.length,
            path.curve,
            friction=asked.friction,
            hysteresis=asked.hysteresis,
            layer_friction=asked.layer_friction,
            step=asked.step,
            fall=asked.fall,
            fold_at=path.fold_at,
            model=asked.model,
            progress=progress,
        )
        values = {item.name: getattr(found, item.name) for item in fields(found)}
        second, place = None, asked.second_gripper
        if place is not None:
            second = second_on_path(asked.material, asked.length, path.curve, place)
        return cls(**values, second_gripper=second, path=path, asked=asked, seconds=perf_counter() - began)

    def rows(self) -> Rows:
        return [
            ("stable", "yes" if self.stable else "no"),
            *(row for event in self.critical for row in self._event_rows(event)),
            *([("failed", self.failure)] if self.failure else []),
            ("first touch", metres(self.touch_x, "x, origin mid-strip")),
            ("  planned", metres(self.planned_touch_x, "x of the first touch of the accurate fold, an R-path's")),
            ("  error", metres(self.touch_error, "beyond it" if self.touch_error > 0.0 else "short of it")),
            ("landing", metres(self.landing_x, "x where the folded state lands")),
            ("shape error", metres(self.shape_error, "largest distance of the last state from the folded one")),
            ("lying", metres(self.lying_length, "length from the held end in the last state")),
            ("peak force", f"{self.peak_force:.4g} N/m  (gripper, per width)"),
            ("peak hold", f"{self.peak_hold:.4g} N/m  (horizontal, at the held end)"),
            ("completed", self._completed()),
            *([] if self.asked.second_gripper is None else self._second_rows(self.second_gripper)),
            ("mesh", self._mesh()),
            ("time", f"{self.seconds:.1f} s"),
        ]

    def _mesh(self) -> str:
        """What another mesh says."""
        if self.mesh_dependence:
            return f"the verdict depends on it: {self.mesh_dependence}"
        far = max((abs(event["change"]) for event in self.critical if isfinite(event["change"])), default=0.0)
        points = f"; critical points within {far:.2g} m" if self.critical else ""
        touch = f"; first touch within {abs(self.touch_change):.2g} m" if isfinite(self.touch_change) else ""
        return f"{WHERE} the verdict is the same{points}{touch}"

    @staticmethod
    def _second_rows(second: SecondOnPath | None) -> Rows:
        if second is None:
            return [("2nd gripper", "none is needed: a rod follows the path without a critical point")]
        taken = f"at t = {second.t:.4g}, x = {second.x:.4g} m, z = {second.z:.4g} m"
        end = f"t = {second.end_t:.4g}, gripper at x = {second.end_x:.4g} m, z = {second.end_z:.4g} m"
        return [
            ("2nd gripper", metres(second.s, f"along the strip from the first, taken {taken}")),
            ("  snap", f"{'yes' if second.snap else 'no'}: {second.reason}"),
            ("  stable to", f"{end}, {second.gain:.4g} m farther than with one gripper"),
        ]

    @staticmethod
    def _event_rows(event: Mapping[str, Any]) -> Rows:
        place = f"t = {event['t']:.4g}, gripper at x = {event['x']:.4g} m, z = {event['z']:.4g} m"
        size = ""
        if isfinite(event["drop"]):
            size = f"; {event['drop']:.3g} m down, {event['energy']:.3g} J/m freed"
        return [("critical", f"{place}: {event['kind']}"), ("  there", f"{event['outcome']}{size}")]

    def _completed(self) -> str:
        if self.completed:
            return "yes"
        if self.failure:
            return "no: what follows the last state could not be computed"
        return "no: the statics end at the critical point" if self.critical and not self.asked.fall else "no"

    def to_dict(self) -> dict[str, Any]:
        names = [item.name for item in fields(Verdict) if item.name not in ("states", "falls")]
        values = {name: getattr(self, name) for name in (*names, "seconds")}
        second = {} if self.second_gripper is None else {"second_gripper": asdict(self.second_gripper)}
        return values | {"critical": [dict(event) for event in self.critical]} | second

    def to_dataset(self) -> xr.Dataset:
        touches = ("touch_x", "planned_touch_x", "touch_error", "landing_x")
        numbers = (*touches, "touch_change", "shape_error", "lying_length", "peak_force", "peak_hold")
        values: dict[str, Any] = {name: ((), getattr(self, name)) for name in numbers}
        states = self._mid_surfaces()
        values |= {
            "pseudo_time": ("state", [self.path.curve.pseudo_time(point.lam) for _, point in self.states]),
            "x": (("state", "node"), states[..., 0]),
            "z": (("state", "node"), states[..., 1]),
            "kind": ("event", [event["kind"] for event in self.critical]),
        }
        values |= {
            f"critical_{key}": ("event", np.array([event[key] for event in self.critical], dtype=float))
            for key in ("t", "x", "z", "angle", "drop", "energy", "change")
        }
        if (second := self.second_gripper) is not None:
            given = {f"second_{key}": getattr(second, key) for key in ("s", "x", "z", "snap")}
            values |= {name: ((), float(value)) for name, value in given.items()}
        flags = {"stable": int(self.stable), "completed": int(self.completed)}
        said = {"contact": self.contact, "failure": self.failure, "mesh_dependence": self.mesh_dependence}
        return schema.dataset(values, flags | said)

    def _mid_surfaces(self, states: Sequence[Followed] | None = None) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Shape (states, nodes, 2), m."""
        unit = self.asked.gravity_length
        arc = np.linspace(0.0, self.states[0][0].model.length, NODES)
        states = self.states if states is None else states
        return np.stack([unit * problem.model.resampled_mid_surface(point.q, arc) for problem, point in states])

    def plot(self) -> Figure:
        """The strip along the path, the last static state black; critical points are crosses."""
        from stripfold.plots.results import draw_strip

        states = self._mid_surfaces()
        chosen = np.unique(np.linspace(0, len(states) - 1, 12).astype(int))
        marks = np.array([(event["x"], event["z"]) for event in self.critical]).reshape(-1, 2)
        return draw_strip(list(states[chosen]), self.path.places[:, 1:], marks)

    def film(self, file: str | os.PathLike[str], progress: Progress | None = None) -> None:
        """Draw it as an MP4 film, with the falls that were followed."""
        from stripfold.extras import require

        require("vision")
        from stripfold.plots import film, readers

        ordered = [(SLOW if isinstance(state[1], TimeState) else BEFORE, state) for state in self.states]
        if self.falls:
            first = self.falls[0][0]
            ordered[first:] = [(AFTER, state) for _, state in ordered[first:]]
        for before, motion in reversed(self.falls):
            ordered[before:before] = [(FALL, (motion.problem, state)) for state in motion.states]
        phase, states = (list(part) for part in zip(*ordered, strict=True))
        second = self.asked.material.scales["s"]
        followed = readers.Followed(
            phase=np.array(phase),
            time=np.array([second * state.t if isinstance(state, TimeState) else nan for _, state in states]),
            advance=self.asked.gravity_length * np.array([state.lam for _, state in states]),
            states=self._mid_surfaces(states),
        )
        film.draw(followed, file, "way", progress=progress)

    def config(self) -> dict[str, Any]:
        return {**self.asked.model_dump(), "path": self.path.name, "fold_at": self.path.fold_at}


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
        from stripfold.analysis import collapse

        return cls(collapse.run(simulation, progress), simulation)

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
        from stripfold.plots import collapse_curve

        return collapse_curve.draw(self.dataset)

    def film(self, file: str | os.PathLike[str], progress: Progress | None = None) -> None:
        """Draw it as an MP4 film."""
        from stripfold.extras import require

        require("vision")
        from stripfold.plots.film import film

        film(self.dataset, file, progress=progress)

    def config(self) -> dict[str, Any]:
        return self.simulation.as_config()
