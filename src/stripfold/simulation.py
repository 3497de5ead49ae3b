"""What ``stripfold simulate`` is asked for: a scene and how its strip is let go; in SI."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, field
from difflib import get_close_matches
from math import sqrt
from typing import Any

from stripfold import schemas
from stripfold.effects import demand
from stripfold.effects.demand import Choices
from stripfold.errors import InvalidInputError
from stripfold.scene import Scene, checked_number, require_long_enough

OF_SCENE = ("length", "height", "eta_b", "eta_m", "nu", "rho_a", "gravity", "model", "accuracy")
MODELS = ("solid", "rod")
"""What has a motion in time."""
REQUIRED = ("length", "height", "eta_b")
UNTIL = ("rest", "touch")
BEFORE, FALL, AFTER = PHASES = "before", "fall", "after"
"""Values of a simulated motion's ``phase``, in their order: statics to lambda_c, the fall, statics from rest on."""


@dataclass(frozen=True, slots=True)
class LettingGo:
    """How the strip is let go at its critical point.

    Parameters
    ----------
    disturbance
        Largest speed of the mid-surface in the initial velocity along the critical eigenvector, m/s; positive the way
        the branch goes on, negative against it.
    speed
        Speed of the gripper, m/s; with 0 it is held just past lambda_c.
    air
        Mass-proportional damping, 1/s.  The default is what the drag of air, about 0.3 kg m^-2 s^-1 at the 0.3 m/s of
        a falling layer, is to a light fabric of 0.15 kg m^-2.
    stiffness
        Stiffness-proportional damping, s.  The default is a loss tangent of 0.1, usual for fabrics in bending, at
        the 5 Hz of a swinging layer.
    until
        "rest", or "touch" to end at the first touch.
    """

    disturbance: float = 1e-3
    speed: float = 0.0
    air: float = 2.0
    stiffness: float = 3e-3
    until: str = "rest"


OF_FALL = tuple(LettingGo.__dataclass_fields__)


@dataclass(frozen=True, slots=True)
class Simulation:
    """A scene with how its strip is let go; make it with :meth:`create` or :func:`read`."""

    scene: Scene
    letting_go: LettingGo
    effects: Choices = field(default_factory=Choices)

    @classmethod
    def create(cls, **given: Any) -> Simulation:
        """From plain numbers in SI units: those of :class:`.Scene` and of :class:`LettingGo`; and ``effects``.

        The model is the solid, or what ``model`` says; with ``effects`` and without ``model``, what they say.

        Raises
        ------
        InvalidInputError
            An unknown or missing key, or a value that cannot be used.
        """
        known = (*OF_SCENE, *OF_FALL, "effects")
        for key in given:
            if key not in known:
                near = get_close_matches(str(key), known, 1)
                advice = f"did you mean {near[0]}?" if near else "remove it"
                raise InvalidInputError(str(key), given[key], f"one of the keys {', '.join(known)}", advice)
        for key in REQUIRED:
            if key not in given:
                raise InvalidInputError(key, None, "a number", "it is missing")
        choices = Choices.of(given.get("effects", demand.AUTO))
        of_scene = {key: given[key] for key in OF_SCENE if key in given}
        scene = Scene.create(**of_scene)
        if scene.model not in MODELS:
            raise InvalidInputError("model", scene.model, " or ".join(MODELS), "it has no motion in time")
        choices = choices.with_model(scene.model, "model" in given or "effects" not in given)
        if choices.solid == demand.OFF or (choices.solid == demand.AUTO and not _needs_solid(scene)):
            scene = Scene.create(**{**of_scene, "model": "rod"})
        require_long_enough(scene)
        fall = {key: given[key] for key in OF_FALL if key in given}
        for key, value in fall.items():
            if key != "until":
                fall[key] = checked_number(key, value)
            elif value not in UNTIL:
                raise InvalidInputError(key, value, " or ".join(UNTIL))
        return cls(scene, LettingGo(**fall), choices)

    @property
    def time_unit(self) -> float:
        """sqrt(L*/g), s."""
        return sqrt(self.scene.material.gravity_length / self.scene.material.gravity)

    def as_config(self) -> dict[str, Any]:
        """The resolved keys and values, as they could be given."""
        material = self.scene.material
        return {
            "length": self.scene.length,
            "height": self.scene.height,
            **{key: getattr(material, key) for key in ("eta_b", "eta_m", "nu", "rho_a", "gravity")},
            "model": self.scene.model,
            "accuracy": self.scene.accuracy,
            **asdict(self.letting_go),
            "effects": {**self.effects.as_config(), "solid": demand.ON if self.scene.model == "solid" else demand.OFF},
        }


def _needs_solid(scene: Scene) -> bool:
    material = scene.material
    return demand.need_of_solid(material.relative_thickness, material.nu, scene.accuracy).needed


def read(path: str | os.PathLike[str]) -> Simulation:
    """A simulation from a YAML file.

    Raises
    ------
    InvalidInputError
        Not readable, not a mapping, or a key or value that cannot be used.
    """
    return Simulation.create(**schemas.read_scene(path, "length: 0.6"))
