"""What is asked for: a strip and a gripper height, validated; here SI becomes solver units (L*)."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from typing import Any, Literal, cast, get_args

from stripfold.errors import InvalidInputError
from stripfold.material import GRAVITY, Material

Model = Literal["solid", "rod", "elastica", "auto"]
Law = Literal["svk", "printed"]

ETA_B = (1e-1, 1e8)
"""Allowed weight-to-bending-stiffness ratios, m^-4 s^2: from a metal sheet to a gauze."""
LENGTH_STAR = (3.0, 150.0)
"""Allowed strip lengths, L*.  The shortest strip that can snap is twice as long; the longest is a matter of cost."""
HEIGHT_STAR = (0.1, 60.0)
"""Allowed gripper heights, L*; below the lowest the planning model has not been tested."""
MAX_THICKNESS_STAR = 0.2
"""Largest thickness of the model, L*: at 0.3 the solid's lambda_c depends on the mesh (docs/hard-cases.md)."""

# Key: lowest and highest value, unit.  What goes together is checked in L*, by much sharper limits.
_RANGES = {
    "length": (1e-6, 1e6, " m"),
    "height": (1e-6, 1e6, " m"),
    "eta_b": (*ETA_B, " m^-4 s^2"),
    "eta_m": (1e-9, 1e-1, " m^-2 s^2"),
    "nu": (0.0, 0.49, ""),
    "rho_a": (1e-4, 1e3, " kg m^-2"),
    "accuracy": (1e-6, 0.1, ""),
    "gravity": (0.1, 100.0, " m s^-2"),
    "disturbance": (-1.0, 1.0, " m s^-1"),
    "speed": (0.0, 1.0, " m s^-1"),
    "air": (0.0, 100.0, " s^-1"),
    "stiffness": (0.0, 1.0, " s"),
    "friction": (0.0, 1e9, " s^-2"),
    "hysteresis": (0.0, 1e3, " N"),
    "step": (1e-9, 1e6, " m"),
}
_OF_MATERIAL = ("eta_b", "eta_m", "nu", "rho_a", "gravity")


@dataclass(frozen=True, slots=True)
class Scene:
    """A strip held at one end and a gripper height; make it with :meth:`create`.

    Parameters
    ----------
    material
        The strip's material.
    length, height
        Length of the strip and height of the gripper, m.
    model
        "solid", the paper's finite-element model; "rod", the fast one; "elastica", the thin limit; or "auto", the
        cheapest of them that is as near the solid's lambda_c as ``accuracy`` asks.
    accuracy
        Wanted relative accuracy of lambda_c.
    law
        Constitutive law of the solid, "svk" or "printed" (docs/physics.md, section 2).

    Raises
    ------
    InvalidInputError
        A combination that is no strip, or numbers of which one has a wrong unit.
    """

    material: Material
    length: float
    height: float
    model: Model = "solid"
    accuracy: float = 1e-3
    law: Law = "svk"

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        material, length = checked_strip(self.material, self.length)
        set_(self, "material", material)
        set_(self, "length", length)
        for key in ("height", "accuracy"):
            set_(self, key, checked_number(key, getattr(self, key)))
        _choice("model", self.model, get_args(Model))
        _choice("law", self.law, get_args(Law))
        if self.model != "solid":
            _choice("law", self.law, ("svk",), "only the solid has another law")
        _check_height(self.material, self.length, self.height)

    @classmethod
    def create(
        cls,
        *,
        length: float,
        height: float,
        eta_b: float,
        eta_m: float = 1e-3,
        nu: float = 0.0,
        rho_a: float = 1.0,
        model: str = "solid",
        accuracy: float = 1e-3,
        law: str = "svk",
        gravity: float = GRAVITY,
    ) -> Scene:
        """A scene from plain numbers, in SI units; see :class:`Scene` and :class:`.Material`.

        Raises
        ------
        InvalidInputError
            Not a number, a number outside its range, or numbers that do not go together.

        Examples
        --------
        >>> scene = Scene.create(length=0.6, height=0.09, eta_b=3780.0)
        >>> round(scene.length_star, 3), round(scene.height_star, 3)
        (20.008, 3.001)
        """
        # The scene checks all of it; nothing is computed from a number before that.
        return cls(
            Material(eta_b, eta_m, nu, rho_a, gravity),
            length,
            height,
            cast(Model, model),
            accuracy,
            cast(Law, law),
        )

    @property
    def length_star(self) -> float:
        """Length of the strip, L*."""
        return self.length / self.material.gravity_length

    @property
    def height_star(self) -> float:
        """Height of the gripper, L*."""
        return self.height / self.material.gravity_length


def require_long_enough(scene: Scene) -> None:
    """Refuse a strip of which nothing would be left lying where the gripper's smooth advance ends.

    That is at the critical point, or where the sag touches the lower layer first.  The free length there
    is the elastica's, which the solid's differs from by little.

    Raises
    ------
    InvalidInputError
        The strip is too short for this height; the message says how long it must be.
    SolveError
        The elastica could not be solved.
    """
    from stripfold import elastica

    shortest = elastica.critical(scene.height_star).state.length * scene.material.gravity_length
    if not scene.length > shortest:
        raise InvalidInputError(
            "length",
            scene.length,
            f"more than {shortest:.4g} m with height = {scene.height:g} m",
            "the strip is too short: all of it would leave the floor before it could snap; lengthen it or go lower",
        )


def checked_strip(material: Material, length: float) -> tuple[Material, float]:
    """A strip's material and length, m, if they go together.

    Raises
    ------
    InvalidInputError
        Not a number, a number outside its range, or a combination that is no strip.
    """
    material = Material(**{key: checked_number(key, getattr(material, key)) for key in _OF_MATERIAL})
    length = checked_number("length", length)
    _check_length(material, length)
    if not material.relative_thickness <= MAX_THICKNESS_STAR:
        # h / L* = sqrt(12 eta_m / eta_b) / L*
        largest = (MAX_THICKNESS_STAR * material.gravity_length) ** 2 * material.eta_b / 12.0
        raise InvalidInputError(
            "eta_m",
            material.eta_m,
            f"at most {largest:.3g} m^-2 s^2 with eta_b = {material.eta_b:g} m^-4 s^2",
            f"the model would be {material.thickness:.3g} m thick, more than {MAX_THICKNESS_STAR} L*",
        )
    return material, length


def checked_number(key: str, value: Any) -> float:
    """The number given for a key, if it is one and within the key's range.

    Raises
    ------
    InvalidInputError
        Otherwise.
    """
    low, high, unit = _RANGES[key]
    # A bool is a number to Python, and a mistake to everybody else.
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    if not is_number or not low <= value <= high:  # so written, nan fails too
        raise InvalidInputError(key, value, f"a number from {low:g} to {high:g}{unit}")
    return float(value)


def _choice(key: str, value: Any, allowed: tuple[str, ...], advice: str = "") -> None:
    if value not in allowed:
        raise InvalidInputError(key, value, " or ".join(allowed), advice)


def _check_length(material: Material, length: float) -> None:
    star = material.gravity_length
    low, high = LENGTH_STAR
    if not low * star <= length <= high * star:
        # eta_b = 1 / (g L*^3), for the L* that would make this length allowed.
        stiffest, softest = (1.0 / (material.gravity * (length / n) ** 3) for n in (low, high))
        lowest, highest = max(stiffest, ETA_B[0]), min(softest, ETA_B[1])
        fitting = f"; this length goes with eta_b from {lowest:.3g} to {highest:.3g}" if lowest < highest else ""
        raise InvalidInputError(
            "length",
            length,
            f"from {low * star:.3g} to {high * star:.3g} m with eta_b = {material.eta_b:g} m^-4 s^2 "
            f"({low:g} to {high:g} times L* = {star:.3g} m)",
            f"check the units, m and m^-4 s^2{fitting}",
        )


def _check_height(material: Material, length: float, height: float) -> None:
    star = material.gravity_length
    low, high = HEIGHT_STAR
    if not height < length:
        raise InvalidInputError("height", height, f"less than the length, {length:g} m", "height above the length")
    if not low * star <= height <= high * star:
        raise InvalidInputError(
            "height",
            height,
            f"from {low * star:.3g} to {high * star:.3g} m with eta_b = {material.eta_b:g} m^-4 s^2 "
            f"({low:g} to {high:g} times L* = {star:.3g} m)",
            "check the units, m and m^-4 s^2",
        )
