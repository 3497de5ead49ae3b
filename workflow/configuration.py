"""The configuration of a run: its keys with units, limits and defaults; read, checked, completed, resolved."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from math import isclose
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from stripfold.ask.inputs import Scene
from stripfold.base.errors import MISSING, InvalidInputError
from stripfold.base.material import GRAVITY, Material
from stripfold.base.validation import (
    Accuracy,
    AtLeastOne,
    Distinct,
    EtaB,
    EtaM,
    Gravity,
    Input,
    Length,
    Nu,
    Number,
    RhoA,
    Text,
    quantity,
    read_yaml,
)
from verification import STUDIES

Config = dict[str, Any]
LengthStar = Annotated[Number, quantity("length of the strip", "L*", gt=0.0)]
HeightStar = Annotated[Number, quantity("gripper height", "L*", gt=0.0)]
Refinement = Annotated[Number, quantity("element size over that of the standard mesh", gt=0.0)]
Step = Annotated[Number, quantity("size of the steps along the path", "L*", gt=0.0)]
Speed = Annotated[Number, quantity("speed of the gripper", "m s^-1", gt=0.0)]


Friction = Annotated[Number, quantity("M_0 of the bending hysteresis", "rho_a g L*^2", ge=0.0)]


class Recordings(Input):
    """Synthetic recordings that are made and measured."""

    materials: AtLeastOne[Text]
    heights: AtLeastOne[HeightStar]
    speeds: AtLeastOne[Speed]
    friction_moment_star: Annotated[list[Friction], Field(description="M_0 of each of the materials")]
    length_star: LengthStar = 20.0


class Assessment(Input):
    """Folding paths followed by all materials."""

    refinement: Refinement = 1.0
    friction_refinement: Annotated[Refinement, Field(description="for the search of the smallest friction")] = 1.0
    step: Step = 0.1


class Secant(Input):
    """In place of eta_b and rho_a: the secant stiffness of a measured law."""

    table: Annotated[Text, Field(description="CSV file of moment over curvature")]
    areal_load: Annotated[Number, quantity("weight per area", "N m^-2", gt=0.0)]
    height: Annotated[Number, quantity("height whose critical state sets the curvature", "L*")]
    stiffness: Annotated[Number | None, quantity("filled in: bending stiffness per width", "N m")] = None
    kappa: Annotated[Number | None, quantity("filled in: curvature of the secant", "m^-1")] = None


class MaterialEntry(Input):
    """A strip of the x-axis study."""

    name: Annotated[
        str, Field(pattern=r"^[a-z][a-z0-9_]*$", description="used in file names: small letters, digits and _")
    ]
    label: Annotated[Text, Field(description="used in figures")]
    source: Annotated[Text, Field(description="where the numbers are from")]
    eta_b: EtaB | None = None
    eta_m: EtaM = 1e-3
    nu: Nu = 0.0
    rho_a: RhoA | None = None
    length: Length
    heights: AtLeastOne[HeightStar]
    touching_heights: Distinct[HeightStar] = Field(default_factory=list, description="heights of which none snaps")
    secant: Secant | None = None

    @model_validator(mode="after")
    def _check_stiffness(self) -> Self:
        if self.eta_b is None and self.secant is None:
            raise InvalidInputError("eta_b", MISSING, "a number, m^-4 s^2", "or give secant instead")
        return self


class Configuration(Input):
    """Configuration of a run."""

    results: Annotated[Text, Field(description="folder of the stored results")] = "results"
    figures: Annotated[Text, Field(description="folder of the figures")] = "figures"
    collapse: Annotated[Text, Field(description="scene file of the simulated and filmed collapse")] = (
        "workflow/config/collapse.yaml"
    )
    gravity: Gravity = GRAVITY
    accuracy: Annotated[Accuracy, Field(description="of lambda_c with the solid")] = 1e-3
    images: Annotated[
        Text, Field(description="folder of the public test pictures; without it the stored results are used")
    ] = "../shared/data"
    recordings: Recordings
    assessment: Assessment = Assessment()
    materials: Annotated[list[MaterialEntry], Field(min_length=1)]
    scale: Annotated[Literal["quick", "reader", "release"], Field(description="of the studies")] = "reader"
    studies: Annotated[
        dict[str, dict[str, Any] | Literal[False]],
        Field(description="arguments of studies that differ from their defaults, or false: the study is left out"),
    ] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        for name in self.studies:
            if name not in STUDIES:
                raise InvalidInputError("studies", name, f"one of {', '.join(STUDIES)}")
        names = [material.name for material in self.materials]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise InvalidInputError(f"materials[{i}].name", name, "a name that no other material has")
        for i, name in enumerate(self.recordings.materials):
            if name not in names:
                raise InvalidInputError(f"recordings.materials[{i}]", name, f"one of the materials {', '.join(names)}")
        filmed, frictions = len(self.recordings.materials), len(self.recordings.friction_moment_star)
        if frictions != filmed:
            raise InvalidInputError(
                "recordings.friction_moment_star", f"{frictions} numbers", f"{filmed}, one for each material"
            )
        return self


def load(source: str | os.PathLike[str] | Mapping[str, Any], root: str | os.PathLike[str] = ".") -> Config:
    """The resolved configuration: defaults filled in, textiles turned into ``eta_b``, everything checked.

    Loading a resolved configuration again changes nothing.

    ``source``: path of a YAML file, or its content; ``root``: folder from which relative paths inside the configuration
    start.

    Returns a new one; plain numbers, texts, lists and dicts.  Raises InvalidInputError: not readable, an unknown or
    missing key, or a value that cannot be used; the message names the key; SolveError: the elastica, which tells how
    long a strip must be, could not be solved.
    """
    given = source if isinstance(source, Mapping) else read_yaml(source, "configuration", "gravity: 9.81")
    config: Config = Configuration.of(given).model_dump(mode="json", exclude_none=True)
    for i, material in enumerate(config["materials"]):
        at = f"materials[{i}]"
        if "secant" in material:
            _resolve_secant(material, config["gravity"], Path(root), at)
        material.setdefault("rho_a", 1.0)
        _check_heights(config, material, at)
    _check_recordings(config)
    return config


def recording_folders(folder: Path, taken: Iterable[str]) -> list[str]:
    """Names of the recordings in a folder, sorted.

    Raises InvalidInputError: one of the names in ``taken``, or with what Snakemake takes for a wildcard.
    """
    names = sorted(path.parent.name for path in folder.glob("*/recording.yaml"))
    for name in {*taken} & {*names} or [name for name in names if "{" in name or "}" in name]:
        allowed = "a name without { and } that is none of the configuration's materials and synthetic recordings"
        raise InvalidInputError(str(folder), name, allowed, "rename the folder")
    return names


def _resolve_secant(material: Config, gravity: float, root: Path, at: str) -> None:
    """Fill in what the measured law gives; what is there already must agree."""
    from stripfold import elastica
    from tasks import textile

    given = material["secant"]
    with _named({"z": f"{at}.secant.height"}, f"{at}.secant"):
        point = elastica.critical(given["height"])
        if not point.snap:
            raise InvalidInputError("z", given["height"], "a height at which the strip snaps, in L*")
        table = textile.read_table(root / given["table"])
        found = textile.secant(table, given["areal_load"], textile.largest_curvature(point.state), gravity)
    filled = (
        (material, at, "eta_b", found.eta_b),
        (material, at, "rho_a", given["areal_load"] / gravity),
        (given, f"{at}.secant", "stiffness", found.stiffness),
        (given, f"{at}.secant", "kappa", found.kappa),
    )
    for mapping, where, key, value in filled:
        if not isclose(mapping.setdefault(key, value), value, rel_tol=1e-9):
            raise InvalidInputError(f"{where}.{key}", mapping[key], f"{value:.10g}, or nothing: the secant gives it")


def _check_heights(config: Config, material: Config, at: str) -> None:
    from stripfold.paths.rpath import LONGEST, shortest_half_fold

    lists = [(name, material[name]) for name in ("heights", "touching_heights")]
    scenes = [
        _scene_at(config, material, height, at, f"{at}.{name}[{i}]")
        for name, heights in lists
        for i, height in enumerate(heights)
    ]
    longest = LONGEST * scenes[0].material.gravity_length
    shortest = shortest_half_fold() * scenes[0].material.gravity_length
    if not shortest < material["length"] <= longest:
        raise InvalidInputError(
            f"{at}.length",
            material["length"],
            f"more than {shortest:.4g} m and at most {longest:.4g} m with eta_b = {material['eta_b']:g} m^-4 s^2",
            "a strip outside has no R-path",
        )
    # The free length grows with the height.
    with _named({}, at):
        max(scenes, key=lambda scene: scene.height).require_long_enough()


def _check_recordings(config: Config) -> None:
    names = {material["name"]: material for material in config["materials"]}
    asked = config["recordings"]
    for i, name in enumerate(asked["materials"]):
        at = f"recordings.materials[{i}]"
        star = Material(names[name]["eta_b"], gravity=config["gravity"]).gravity_length
        strip = {**names[name], "length": asked["length_star"] * star}
        for j, height in enumerate(asked["heights"]):
            asked_scene = _scene_at(config, strip, height, at, f"recordings.heights[{j}]")
            with _named({"length": "recordings.length_star"}, at):
                asked_scene.require_long_enough()


def _scene_at(config: Config, material: Config, height: float, at: str, height_key: str) -> Scene:
    """The scene of a material at a gripper height in L*; its errors name the configuration's keys."""
    with _named({"gravity": "gravity", "accuracy": "accuracy", "height": height_key}, at):
        return Scene(
            length=material["length"],
            height=height * Material(material["eta_b"], gravity=config["gravity"]).gravity_length,
            **{key: material[key] for key in ("eta_b", "eta_m", "nu", "rho_a")},
            model="solid",
            accuracy=config["accuracy"],
            gravity=config["gravity"],
        )


@contextmanager
def _named(keys: Mapping[str, str], at: str) -> Iterator[None]:
    """Errors name the configuration's key: that in ``keys``, or the one of the same name within ``at``."""
    try:
        yield
    except InvalidInputError as error:
        key = keys.get(error.key, f"{at}.{error.key}")
        advice = "heights are in L* here, the value shown is in m" if error.key == "height" else error.advice
        raise InvalidInputError(key, error.value, error.allowed, advice) from error
