"""Input models: sound input passes; what is outside its limits, no number or misspelt is refused by name."""

from __future__ import annotations

import pkgutil
import re
from collections.abc import Iterator
from importlib import import_module
from math import inf, nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stripfold
import stripfold as sf
from stripfold import elastica
from stripfold.ask.collapse import in_solver_units
from stripfold.ask.inputs import ETA_B, HEIGHT_STAR, LENGTH_STAR, Release, Scene, Simulation
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import Material
from stripfold.base.validation import Input
from stripfold.film.request import EtaRequest

TYPICAL = {"length": 0.6, "height": 0.09, "eta_b": 3780.0, "eta_m": 1e-3}
STAR = Material(3780.0).gravity_length


def refused(**changes: object) -> InvalidInputError:
    with pytest.raises(InvalidInputError) as caught:
        Scene(**{**TYPICAL, **changes})
    error = caught.value
    for part in (error.key, repr(error.value)[:40], error.allowed):
        assert part in str(error)
    return error


def test_lengths_in_solver_units():
    scene = Scene(**TYPICAL)
    assert scene.length_star == pytest.approx(0.6 * (3780.0 * 9.81) ** (1 / 3), rel=1e-14)
    assert scene.height_star == pytest.approx(scene.length_star * 0.09 / 0.6, rel=1e-14)


def test_defaults_are_the_papers():
    scene = Scene(length=0.6, height=0.09, eta_b=3780.0)
    assert scene.material == Material(3780.0, 1e-3, 0.0, 1.0, 9.81)
    assert (scene.model, scene.accuracy, scene.law) == ("solid", 1e-3, "svk")


def test_whole_and_numpy_numbers_become_floats():
    scene = Scene(length=np.float32(0.5), height=np.float64(0.09), eta_b=np.int64(3780), nu=0)
    assert [type(x) for x in (scene.length, scene.height, scene.material.eta_b, scene.material.nu)] == [float] * 4


# A wrong unit by a factor 1000 in one number of typical input: which key the message names, and a part of it.
WRONG_UNITS = [
    ("length", 1000, "length", "0.09 to 4.5 m"),
    ("length", 1 / 1000, "length", "0.09 to 4.5 m"),
    ("height", 1000, "height", "less than the length, 0.6 m"),
    ("height", 1 / 1000, "height", "0.003 to 1.8 m"),
    ("eta_b", 1000, "length", "with eta_b = 3.78e+06 m^-4 s^2"),
    ("eta_b", 1 / 1000, "length", "with eta_b = 3.78 m^-4 s^2"),
    ("eta_m", 1000, "eta_m", "1e-09 to 0.1 m^-2 s^2"),
]


@pytest.mark.parametrize(("key", "factor", "named", "part"), WRONG_UNITS)
def test_wrong_unit_by_a_factor_1000_is_refused(key, factor, named, part):
    error = refused(**{key: TYPICAL[key] * factor})
    assert error.key == named
    assert part in str(error)
    if key == "eta_b":  # the message cannot know which of the two is wrong: it names both
        assert "m and m^-4 s^2" in str(error)
        assert "eta_b from 12.7 to 1.59e+06" in str(error)


def test_limits_in_gravity_lengths_are_sharp():
    (short, long), (low, high) = LENGTH_STAR, HEIGHT_STAR
    for length in (short * 1.001, long * 0.999):
        Scene(length=length * STAR, height=STAR, eta_b=3780.0)
    for length in (short * 0.999, long * 1.001):
        assert refused(length=length * STAR, height=STAR).key == "length"
    for height in (low * 1.001, high * 0.999):
        Scene(length=100.0 * STAR, height=height * STAR, eta_b=3780.0, eta_m=1e-6)
    for height in (low * 0.999, high * 1.001):
        assert refused(length=100.0 * STAR, height=height * STAR).key == "height"


def test_a_gripper_so_low_that_the_strip_snaps_at_its_push():
    """There lambda_c depends on the elements at the gripper; both pieces of advice are accepted."""
    low = refused(height=0.2 * STAR)
    assert low.key == "height"
    assert "compresses the strip" in str(low)
    height = float(re.search(r"at least (\S+) m", str(low)).group(1))
    eta_m = float(re.search(r"eta_m <= (\S+)", str(low)).group(1))
    Scene(length=0.6, height=1.01 * height, eta_b=3780.0)
    Scene(length=0.6, height=0.2 * STAR, eta_b=3780.0, eta_m=0.95 * eta_m)


def test_the_advised_eta_b_fits():
    for eta_b in (3780.0e3, 3780.0e-3):
        advice = refused(eta_b=eta_b).advice
        low, high = map(float, re.search(r"eta_b from (\S+) to (\S+)", advice).groups())
        assert ETA_B[0] <= low < high <= ETA_B[1]
        Scene(length=0.6, height=0.59, eta_b=1.01 * low)
        Scene(length=0.6, height=0.09, eta_b=0.99 * high)
    assert "eta_b from" not in refused(length=600.0).advice  # no fabric goes with it


def test_height_above_the_length():
    assert "height above the length" in str(refused(height=0.6))
    Scene(**{**TYPICAL, "height": 0.599})


def test_too_thick():
    error = refused(eta_m=0.03)
    assert error.key == "eta_m"
    largest = float(error.allowed.split()[2])
    assert Scene(**{**TYPICAL, "eta_m": 0.999 * largest}).material.relative_thickness == pytest.approx(0.2, rel=2e-3)
    assert refused(eta_m=1.005 * largest).key == "eta_m"


def test_the_elastica_takes_no_law_of_the_solid():
    Scene(**TYPICAL, model="elastica")
    assert refused(model="elastica", law="printed").key == "law"


@pytest.mark.parametrize("height_star", [0.5, 1.2, 3.0, 8.0])
def test_long_enough_is_longer_than_the_free_length_where_the_advance_ends(height_star):
    end = elastica.critical(height_star).state
    enough = end.length * STAR * 1.0001
    Scene(length=enough, height=height_star * STAR, eta_b=3780.0).require_long_enough()
    scene = Scene(length=end.length * STAR * 0.9999, height=height_star * STAR, eta_b=3780.0)
    with pytest.raises(InvalidInputError, match="too short") as caught:
        scene.require_long_enough()
    assert caught.value.key == "length"
    assert float(caught.value.allowed.split()[2]) == pytest.approx(end.length * STAR, rel=1e-3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({**TYPICAL, "heigth": 0.1}, "heigth = 0.1 cannot be used; allowed: only the keys .*; did you mean height"),
        ({"length": 0.6, "eta_b": 3780.0}, "height is missing; allowed: a number from 1e-06 to 1e\\+06 m"),
        ({**TYPICAL, "eta_b": "3e3"}, "eta_b = '3e3' cannot be used; .*write 1.0e-3"),
        ({**TYPICAL, "model": "shell"}, "model = 'shell' cannot be used; allowed: one of solid, rod, elastica, auto"),
    ],
)
def test_messages(given: dict[str, object], message: str):
    with pytest.raises(InvalidInputError, match=f"^{message}"):
        Scene(**given)


@pytest.mark.parametrize("value", [10**400, 10**5000, "9" * 400, [0.5] * 400], ids=["400", "5000", "text", "list"])
def test_a_long_value_is_shown_without_its_middle(value: object):
    with pytest.raises(InvalidInputError, match=r"^length = .* cannot be used; allowed: a number from") as caught:
        Scene(**{**TYPICAL, "length": value})
    assert len(str(caught.value)) < 400


MEANT = [
    ({"length": "0,6"}, "write 0.6"),
    ({"length": "60 cm"}, "write 0.6"),
    ({"length": "0.6m"}, "write 0.6"),
    ({"height": "90mm"}, "write 0.09"),
    ({"eta_b": "3780 m^-4 s^2"}, "write 3780"),
    ({"eta_b": "3780 1/m"}, "write the number alone, in m^-4 s^2"),
    ({"eta_b_uncertainty": "20 %"}, "write 0.2"),
    ({"eta_b_uncertainty": 20}, "20 % is 0.2"),
    ({"length": "1e-3"}, "write 1.0e-3"),
    ({"length": "0.6"}, "leave the quotes out"),
    ({"length": 60.0}, "60 cm is 0.6 m"),
    ({"length": 600.0}, "600 mm is 0.6 m"),
    ({"height": 9.0}, "9 cm is 0.09 m"),
    ({"height": 0.6, "length": 0.09}, "are the two swapped?"),
    ({"eta_b": 0.03}, "if it is L* in m, eta_b is 3775"),
]


@pytest.mark.parametrize(("given", "meant"), MEANT)
def test_an_error_says_what_was_probably_meant(given, meant):
    assert meant in refused(**given).advice


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ({"fold_height": 27.0}, "27 mm is 0.027 m"),
        ({"fold_height": 2.7}, "2.7 cm is 0.027 m or 2.7 mm is 0.0027 m"),
        ({"rigidity": 1e-5, "gsm": 0.18}, "0.18 kg m^-2 are 180"),
        ({"loop": "heart", "length": 0.05, "height": 0.2}, "are the two swapped?"),
    ],
)
def test_a_measured_length_in_another_unit(given, meant):
    with pytest.raises(InvalidInputError) as caught:
        EtaRequest(**given)
    assert meant in caught.value.advice


def test_a_margin_in_another_unit():
    with pytest.raises(InvalidInputError, match=r"margin = 10.* 10 mm is 0\.01 m"):
        sf.Strip(length=0.5, eta_b=3770.0).plan(margin=10.0)


SOUND = {
    "length": 0.6, "eta_b": 3780.0, "height": 0.09, "values": [1.0, 2.0], "from": 0.0, "to": 1.0, "count": 3,
    "columns": "t,x,z", "unit": "m", "frame": "0,0", "marker": 7, "size": 0.02,
}  # fmt: skip
"""Values of keys that a model requires."""
BEYOND = {"minimum": lambda x: x - 1e-6 * max(1.0, abs(x)), "maximum": lambda x: x + 1e-6 * max(1.0, abs(x))}
NO_NUMBERS = (nan, inf, -inf, "0.5", "", True, [1.0], {}, 1j, 10**400)


def models() -> list[type[Input]]:
    """All input models of the package."""
    for module in pkgutil.walk_packages(stripfold.__path__, "stripfold."):
        # Kernels have no inputs, and would be compiled.
        if not module.name.endswith("__main__") and ".kernels." not in module.name:
            import_module(module.name)

    def below(model: type[Input]) -> Iterator[type[Input]]:
        for one in model.__subclasses__():
            yield one
            yield from below(one)

    return sorted(set(below(Input)), key=lambda model: (model.__module__, model.__name__))


def sound(model: type[Input]) -> dict[str, Any] | None:
    """Input that the model takes, or nothing where it needs more than :data:`SOUND` has."""
    given = {key: SOUND[key] for key, field in model.model_fields.items() if field.is_required() and key in SOUND}
    try:
        model(**given)
    except InvalidInputError:
        return None
    return given


MODELS = [(model, given) for model in models() if (given := sound(model)) is not None]
NUMBERS = [
    pytest.param(model, given, name, part, id=f"{model.__name__}.{name}")
    for model, given in MODELS
    for name, part in model.model_json_schema()["properties"].items()
    if "number" in {part.get("type"), *(one.get("type") for one in part.get("anyOf", ()))}
]


def refused_by(model: type[Input], given: dict[str, Any]) -> InvalidInputError:
    with pytest.raises(InvalidInputError) as caught:
        model(**given)
    return caught.value


def test_most_models_are_met():
    assert len(MODELS) >= 12
    assert len(NUMBERS) >= 60


@pytest.mark.parametrize(("model", "given", "name", "part"), NUMBERS)
def test_a_number(model: type[Input], given: dict[str, Any], name: str, part: dict[str, Any]):
    allowed = [one.get("const") for one in part.get("anyOf", ())]
    values = [value for value in NO_NUMBERS if value not in allowed]
    values += [change(part[limit]) for limit, change in BEYOND.items() if limit in part]
    values += [part[limit] for limit in ("exclusiveMinimum", "exclusiveMaximum") if limit in part]
    for value in values:
        error = refused_by(model, {**given, name: value})
        assert error.key.split(".")[0] == name, value
        assert error.allowed


@pytest.mark.parametrize(("model", "given"), MODELS, ids=lambda one: getattr(one, "__name__", ""))
def test_a_misspelt_key_is_named_with_the_right_one(model: type[Input], given: dict[str, Any]):
    known = list(model.model_fields)
    wrong = f"{known[0]}x"
    error = refused_by(model, {**given, wrong: 1.0})
    assert wrong in str(error)
    assert any(key in f"{error.allowed} {error.advice}" for key in known)


@pytest.mark.parametrize(("model", "given"), MODELS, ids=lambda one: getattr(one, "__name__", ""))
def test_a_required_key_that_is_missing_is_named(model: type[Input], given: dict[str, Any]):
    for key in given:
        assert refused_by(model, {name: value for name, value in given.items() if name != key}).key == key


STRIP = {"length": 0.6, "height": 0.15, "eta_b": 3780.0}


def test_solver_units() -> None:
    asked = Simulation(**STRIP, disturbance=-0.02, speed=0.1, air=3.0, stiffness=0.01, until="touch")
    star = (3780.0 * 9.81) ** (-1 / 3)
    time = (star / 9.81) ** 0.5
    fall = in_solver_units(asked, asked.material)
    assert asked.time_unit == pytest.approx(time)
    assert fall.disturbance == pytest.approx(-0.02 * time / star)
    assert fall.speed == pytest.approx(0.1 * time / star)
    assert fall.damping.air == pytest.approx(3.0 * time)
    assert fall.damping.stiffness == pytest.approx(0.01 / time)
    assert not fall.to_rest


def test_resolved_keys_give_the_same() -> None:
    asked = Simulation(**STRIP, air=1.0)
    assert Simulation(**asked.as_config()) == asked


@pytest.mark.parametrize("text", ["- 1\n- 2\n", "length: [", "", "just words"])
def test_a_file_that_is_no_scene(tmp_path: Path, text: str) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(text)
    with pytest.raises(InvalidInputError, match=r"scene\.yaml"):
        Simulation.read(path)


def test_no_file() -> None:
    with pytest.raises(InvalidInputError, match="nowhere"):
        Simulation.read("nowhere.yaml")


def test_the_projects_own_scene() -> None:
    asked = Simulation.read(Path(__file__).parents[1] / "workflow/config/collapse.yaml")
    assert Release(**{key: getattr(asked, key) for key in Release.model_fields}) == Release()
