"""The questions of a sweep: what a case of each has, and what is found for it (docs/sweep.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import nan
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from stripfold import elastica, paths
from stripfold.ask import critical
from stripfold.ask.assess import assess
from stripfold.ask.inputs import PathInputs, PlanInputs, Scene, Strip
from stripfold.ask.plan import choose
from stripfold.ask.prediction import ElasticaPrediction
from stripfold.ask.select_model import solid_error
from stripfold.base.errors import StripfoldError
from stripfold.base.validation import Input
from stripfold.follow.track import End

Case = Mapping[str, Any]
"""Keys and values."""


class OnPath(PathInputs):
    """A strip that is moved along one of the known paths."""

    path: Annotated[Literal["r-path", "triangular", "circular"], Field(description="path of the gripper")]


@dataclass(frozen=True)
class Question:
    """What is asked of each case of a grid.

    Attributes
    ----------
    name
        What it is called in a grid.
    inputs
        The model of a case; the fields of ``keys`` may be given.
    keys
        Of a grid, the slowest first.
    numbers, texts
        What is found.
    counted
        Numbers that are known of a case with a result, by what such cases are called.
    chunk
        Most cases that are solved in a row: what an interruption loses.
    answer
        Finds it for a case; raises StripfoldError: there is no result.
    """

    name: str
    inputs: type[Strip]
    keys: tuple[str, ...]
    numbers: tuple[str, ...]
    texts: tuple[str, ...]
    counted: Mapping[str, str]
    chunk: int
    answer: Callable[[Case], dict[str, Any]]

    @property
    def found(self) -> tuple[str, ...]:
        """Names of all that is found."""
        return (*self.numbers, *self.texts)

    @property
    def each(self) -> Any:
        """The keys of a case, each within its limits; what goes together is left to ``inputs``."""
        fields: dict[str, Any] = {
            key: (self.inputs.model_fields[key].annotation, self.inputs.model_fields[key]) for key in self.keys
        }
        return create_model("_Case", __base__=Input, **fields)

    def row(self, case: Case) -> dict[str, Any]:
        """What is found, or nan with the error as the reason."""
        try:
            return self.answer(case)
        except StripfoldError as error:
            nothing = dict.fromkeys(self.numbers, nan) | dict.fromkeys(self.texts, "")
            return nothing | {"reason": " ".join(str(error).split())}


def _critical(case: Case) -> dict[str, Any]:
    """Of a strip drawn over itself: lambda_c or, without a snap, lambda_touch."""
    scene = Scene(**case)
    if scene.model == "elastica":
        return _of_elastica(scene)
    found = critical.find(scene, prediction=_predicted(scene.height_star))
    return {name: getattr(found, name) for name in CRITICAL.found}


def _of_elastica(scene: Scene) -> dict[str, Any]:
    """The same of the elastica, interpolated over the height: its states are not asked for."""
    end, unit = elastica.end_of_advance(scene.height_star), scene.gravity_length
    scene.require_long_enough(end.length)
    lam = unit * end.advance
    return {
        "lambda_c": lam if end.snap else nan,
        "lambda_touch": nan if end.snap else lam,
        "error": unit * critical.ELASTICA_ERROR,
        "model_error": lam * scene.distance_from_solid("elastica"),
        "solid_error": lam * solid_error(scene.material.relative_thickness, scene.nu, scene.height_star),
        "free_length": unit * end.length,
        "reason": (End.SNAP if end.snap else End.TOUCH).reason,
    }


_predicted = lru_cache(maxsize=1)(ElasticaPrediction.at)


def _assess(case: Case) -> dict[str, Any]:
    """Of a strip on a path: its first critical point, with what falls there, its touch and its fold."""
    asked = OnPath(**case)
    inputs = PathInputs(**asked.model_dump(exclude={"path"}))
    found = assess(inputs, paths.PLANS[asked.path](inputs, None), compare=False)
    first = found.critical[0] if found.critical else {}
    of: dict[str, Any] = {f"critical_{name}": float(first.get(name, nan)) for name in ("x", "z", "drop", "energy")}
    of |= {"critical_points": len(found.critical), "reason": found.failure}
    return of | {name: float(getattr(found, name)) for name in ASSESS.numbers if name not in of}


def _plan(case: Case) -> dict[str, Any]:
    """Of a strip to be folded: the best path, and what comes of it."""
    best = choose(PlanInputs(**case))[0][0]
    of: dict[str, Any] = {
        f"outcome_{name}": getattr(best, name) for name in ("drop", "energy", "margin", "layer_slide", "duration")
    }
    of |= {"outcome_error": best.error[1], "outcome_hold_friction": best.hold_friction}
    return of | {"outcome_path": best.name, "reason": best.failure}


CRITICAL = Question(
    name="critical",
    inputs=Scene,
    # Cases in a row share the elastica at their height, which those of one L* have.
    keys=("eta_b", "height", "length", "eta_m", "nu", "model", "accuracy"),
    numbers=("lambda_c", "lambda_touch", "error", "model_error", "solid_error", "free_length"),
    texts=("reason",),
    counted={"snap": "lambda_c", "touch": "lambda_touch"},
    chunk=100,
    answer=_critical,
)
ASSESS = Question(
    name="assess",
    inputs=OnPath,
    keys=(
        *("path", "length", "eta_b", "eta_m", "nu", "rho_a", "model", "fall", "flatness", "curl", "gripper"),
        *("friction_moment", "layer_friction", "table_friction"),
    ),
    numbers=(
        *("stable", "folded", "critical_points", "critical_x", "critical_z", "critical_drop", "critical_energy"),
        *("touch_x", "touch_error", "shape_error", "end_error", "slide"),
        *("peak_force", "peak_push", "flatness_ratio", "hold_friction"),
    ),
    texts=("reason",),
    counted={"assessed": "stable"},
    chunk=100,
    answer=_assess,
)
PLAN = Question(
    name="plan",
    inputs=PlanInputs,
    keys=(
        *("goal", "length", "eta_b", "eta_m", "rho_a", "eta_b_uncertainty", "gripper_accuracy", "layer_friction"),
        *("max_snap", "max_slide", "friction_moment", "friction_uncertainty", "speed", "flatness", "curl"),
        "table_friction",
    ),
    numbers=(
        *("outcome_error", "outcome_drop", "outcome_energy", "outcome_margin", "outcome_layer_slide"),
        *("outcome_hold_friction", "outcome_duration"),
    ),
    texts=("outcome_path", "reason"),
    counted={"planned": "outcome_error"},
    chunk=10,
    answer=_plan,
)
QUESTIONS = {question.name: question for question in (CRITICAL, ASSESS, PLAN)}
