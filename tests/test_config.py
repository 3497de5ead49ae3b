"""The configuration: the shipped ones are sound, and what is wrong is named."""

from __future__ import annotations

import inspect
import json
import subprocess
import sys
from collections import OrderedDict
from copy import deepcopy
from pathlib import Path
from typing import Any, get_args

import pytest
import yaml

import configuration as config
from config_models import Configuration
from config_motion import FallWay
from config_studies import Strategy, Studies
from stripfold import elastica
from stripfold.ask.inputs import Scene
from stripfold.base.errors import InvalidInputError
from studies import (
    accuracy,
    benchmark,
    commands,
    disturbed_rpath,
    fabric_laws,
    fabrics,
    fall_accuracy,
    folding_plans,
    friction_delay,
    friction_margin,
    friction_touch,
    fuzz,
    lag,
    layer_friction,
    models,
    modes,
    order,
    profiling,
    rpaths,
    schemes,
    second_gripper,
    sweeps,
    textile_law,
)
from tasks.textile import largest_curvature

ROOT = Path(__file__).parents[1]
SHIPPED = ["paper", "quick"]

PAPER = yaml.safe_load((ROOT / "workflow/config/paper.yaml").read_text(encoding="utf-8"))
MINIMAL: dict[str, Any] = {
    "materials": [
        {"name": "a", "label": "A", "source": "-", "eta_b": 3780, "length": 0.6, "heights": [2.0, 3.0]},
        {"name": "b", "label": "B", "source": "-", "eta_b": 820, "length": 0.6, "heights": [3]},
    ],
    "recordings": {"materials": ["a"], "heights": [3.0], "speeds": [0.001], "friction_moment_star": [0.0]},
    "studies": {**PAPER["studies"], "limit": {**PAPER["studies"]["limit"], "length_star": 20}},
}


def shipped(name: str) -> config.Config:
    return config.load(ROOT / "workflow" / "config" / f"{name}.yaml", ROOT)


def changed(path: str, value: Any) -> dict[str, Any]:
    """The minimal configuration with another value at a dotted path; ``...`` removes it."""
    content = deepcopy(MINIMAL)
    *way, last = [int(key) if key.isdigit() else key for key in path.split(".")]
    place: Any = content
    for key in way:
        place = place[key]
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return content


def refused(content: Any, root: Path = ROOT) -> InvalidInputError:
    with pytest.raises(InvalidInputError) as caught:
        config.load(content, root)
    assert caught.value.key in str(caught.value)
    return caught.value


def test_defaults_are_filled_in():
    loaded = config.load(MINIMAL)
    assert (loaded["results"], loaded["figures"], loaded["gravity"]) == ("results", "figures", 9.81)
    assert loaded["solid"] == {"order": 2, "elements_across": 1, "law": "svk", "accuracy": 1e-3}
    first = loaded["materials"][0]
    assert (first["eta_m"], first["nu"], first["rho_a"], first["touching_heights"]) == (1e-3, 0.0, 1.0, [])


def test_the_input_is_left_alone():
    content = deepcopy(MINIMAL)
    loaded = config.load(content)
    loaded["solid"]["order"] = 7
    loaded["materials"][0]["touching_heights"].append(1.0)
    assert content == MINIMAL
    assert config.load(content)["materials"][1]["touching_heights"] == []


@pytest.mark.parametrize("name", SHIPPED)
def test_loading_again_changes_nothing(name):
    loaded = shipped(name)
    assert config.load(loaded, ROOT) == loaded
    assert config.load(json.loads(json.dumps(loaded)), ROOT) == loaded


def test_other_mappings_are_taken():
    ordered = OrderedDict(MINIMAL, solid=OrderedDict(order=2))
    assert config.load(ordered) == config.load(MINIMAL)


# -- the keys


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"materials": ["wool"]}, "recordings.materials[0]"),
        ({"heights": [0.001]}, "recordings.heights[0]"),
        ({"length_star": 7.0}, "recordings.length_star"),
        ({"speeds": [0.0]}, "recordings.speeds[0]"),
        ({"friction_moment_star": [-1.0]}, "recordings.friction_moment_star[0]"),
        ({"friction_moment_star": [0.01, 0.02]}, "recordings.friction_moment_star"),
        ({"hights": [5.0]}, "recordings.hights"),
    ],
)
def test_recordings_that_cannot_be(change: dict[str, Any], key: str):
    name = MINIMAL["materials"][0]["name"]
    asked = {"materials": [name], "heights": [5.0], "speeds": [0.001], "friction_moment_star": [0.01]}
    config.load(changed("recordings", asked), ROOT)
    assert refused(changed("recordings", asked | change)).key == key


@pytest.mark.parametrize(
    ("name", "study"),
    [
        ("limit", models.run_limit),
        ("order", order.run),
        ("rod", models.run_rod),
        ("benchmark", benchmark.run),
        ("schemes", schemes.run),
        ("modes", modes.run),
        ("lag", lag.run),
        ("tangency", rpaths.run_tangency),
        ("friction_steps", rpaths.run_friction_steps),
        ("friction_delay", friction_delay.run),
        ("friction_touch", friction_touch.run),
        ("disturbed_rpath", disturbed_rpath.run),
        ("fabrics", fabrics.run),
        ("fabric_laws", fabric_laws.run),
        ("friction_margin", friction_margin.run),
        ("textile_law", textile_law.run),
        ("layer_friction", layer_friction.run),
        ("accuracy", accuracy.run),
        ("fall_accuracy", fall_accuracy.run),
        ("profiling", profiling.run),
        ("commands", commands.run),
        ("fuzz", fuzz.run),
        ("sweeps", sweeps.run),
        ("folding_plans", folding_plans.run),
        ("second_gripper", second_gripper.run),
    ],
)
def test_the_keys_are_the_parameters_of_the_studies(name, study):
    fields = get_args(Studies.model_fields[name].annotation)[0].model_fields
    assert set(fields) == set(inspect.signature(study).parameters) - {"progress", "threads"}
    assert all(field.is_required() for field in fields.values())


def test_the_methods_of_the_studies():
    assert set(Strategy.model_fields) == set(accuracy.Strategy._fields)
    assert tuple(FallWay.model_fields) == fall_accuracy.Way._fields
    assert set(get_args(get_args(FallWay.model_fields["scheme"].annotation)[0])) == set(fall_accuracy.SCHEMES)


def test_every_key_is_described():
    """The generated JSON schema is the reference of the keys: types everywhere, and units or words with numbers."""
    schema = Configuration.model_json_schema()
    assert all(model["additionalProperties"] is False for model in (schema, *schema["$defs"].values()))


# -- what is wrong is named


@pytest.mark.parametrize(
    ("path", "named", "near"),
    [
        ("figurs", "figurs", "figures"),
        ("solid", "solid.acuracy", "accuracy"),
        ("materials.1.heigths", "materials[1].heigths", "heights"),
        ("studies.branches.case", "studies.branches.case", "cases"),
        ("studies.limit.zzz", "studies.limit.zzz", None),
    ],
)
def test_unknown_keys(path, named, near):
    error = refused(changed(path, {"acuracy": 1} if path == "solid" else 1))
    assert error.key == named
    assert error.advice == (f"did you mean {near}?" if near else "remove it")
    assert error.allowed.startswith("only the keys ")


def test_a_misspelt_key_is_reported_before_the_missing_one():
    content = changed("materials.0.heights", ...)
    content["materials"][0]["heigths"] = [3.0]
    assert refused(content).key == "materials[0].heigths"


@pytest.mark.parametrize(
    ("path", "named"),
    [
        ("materials", "materials"),
        ("recordings", "recordings"),
        ("studies.branches.seed", "studies.branches.seed"),
        ("materials.0.length", "materials[0].length"),
        ("materials.0.eta_b", "materials[0].eta_b"),
    ],
)
def test_missing_keys(path, named):
    error = refused(changed(path, ...))
    assert (error.key, error.value) == (named, "(missing)")


@pytest.mark.parametrize(
    ("path", "value", "named", "allowed"),
    [
        ("gravity", "9.81", "gravity", "a number from 0.1 to 100 m s^-2"),
        ("gravity", True, "gravity", "a number"),
        ("gravity", 0, "gravity", "from 0.1"),
        ("gravity", 981.0, "gravity", "from 0.1 to 100 m s^-2"),
        ("results", 3, "results", "a text"),
        ("results", "", "results", "a text"),
        ("solid", {"order": 3}, "solid.order", "a whole number from 1 to 2"),
        ("solid", {"order": True}, "solid.order", "a whole number from 1 to 2"),
        ("solid", {"accuracy": 0.5}, "solid.accuracy", "from 1e-06 to 0.1"),
        ("solid", {"law": "hooke"}, "solid.law", "one of svk, printed"),
        ("solid", None, "solid", "keys and values"),
        ("materials", [], "materials", "a list of at least 1 entries"),
        ("materials.1", 3, "materials[1]", "keys and values"),
        ("materials.1.name", "a", "materials[1].name", "no other material"),
        ("materials.1.name", "B 1", "materials[1].name", "small letters"),
        ("materials.0.eta_b", 0, "materials[0].eta_b", "from 0.1"),
        ("materials.0.eta_b", 3.78e9, "materials[0].eta_b", "1e+08 m^-4 s^2"),
        ("materials.0.eta_b", 3.78e6, "materials[0].length", "150 times L*"),
        ("materials.0.eta_m", 1, "materials[0].eta_m", "m^-2 s^2"),
        ("materials.0.nu", 0.5, "materials[0].nu", "0.49"),
        ("materials.0.rho_a", -1, "materials[0].rho_a", "kg m^-2"),
        ("materials.0.length", 600, "materials[0].length", "from 0.09 to 4.5 m"),
        ("materials.0.heights", 3.0, "materials[0].heights", "a list"),
        ("materials.0.heights", [], "materials[0].heights", "at least 1"),
        ("materials.0.heights", [3.0, 3.0], "materials[0].heights", "no two alike"),
        ("materials.0.heights", [3.0, "4"], "materials[0].heights[1]", "a number"),
        ("materials.0.heights", [3.0, 0.01], "materials[0].heights[1]", "0.1 to 60 times L*"),
        ("materials.0.touching_heights", [1.2, 21], "materials[0].touching_heights[1]", "less than the length, 0.6 m"),
        ("materials.0.heights", [17.5, 2.0], "materials[0].length", "more than 0.6267 m"),
        ("studies.limit.eta_m", [1e-3], "studies.limit.eta_m", "at least 2"),
        ("studies.limit.eta_m", [1e-3, 1.0], "studies.limit.eta_m[1]", "m^-2 s^2"),
        ("studies.limit.height", 19.0, "studies.limit.length_star", "more than"),
        ("studies.order.parts", [1], "studies.order.parts", "at least 2"),
        ("studies.order.parts", [4, 2, 0], "studies.order.parts[2]", "at least 1"),
        ("studies.branches.cases", 2.5, "studies.branches.cases", "a whole number"),
        ("studies.benchmark.repeats", 0, "studies.benchmark.repeats", "at least 1"),
    ],
)
def test_values_that_cannot_be_used(path, value, named, allowed):
    error = refused(changed(path, value))
    assert error.key == named
    assert allowed in error.allowed


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_no_nan_slips_through(value):
    assert refused(changed("studies.order.height", value)).key == "studies.order.height"
    assert refused(changed("materials.0.heights", [2.0, value])).key == "materials[0].heights[1]"


def test_yamls_texts_that_look_like_numbers(tmp_path):
    (tmp_path / "a.yaml").write_text(yaml.safe_dump(MINIMAL).replace("[]", "").replace("eta_b: 820", "eta_b: 8e2"))
    error = refused(tmp_path / "a.yaml")
    assert (error.key, error.value) == ("materials[1].eta_b", "8e2")
    assert "1.0e-3" in error.advice


@pytest.mark.parametrize("text", ["", "- 1", "just a text", "a: [1", "a: \x00", "a: b: c"])
def test_files_that_are_no_configuration(tmp_path, text):
    path = tmp_path / "a.yaml"
    path.write_text(text)
    assert refused(path).key in ("configuration", "a")


def test_a_missing_file(tmp_path):
    assert "nowhere.yaml" in str(refused(tmp_path / "nowhere.yaml"))


# -- the textile


def textile(**secant: Any) -> dict[str, Any]:
    given = {"table": "data/textile_moment_curvature.csv", "areal_load": 13.6, "height": 3.0, **secant}
    content = changed("materials.0.eta_b", ...)
    content["materials"][0].update(secant=given, length=2.0, eta_m=2e-4)
    return content


def test_a_secant_becomes_eta_b_and_rho_a(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # the table's path starts from the root that is given
    material = config.load(textile(), ROOT)["materials"][0]
    star = (material["secant"]["stiffness"] / 13.6) ** (1 / 3)
    assert material["rho_a"] == pytest.approx(13.6 / 9.81, rel=1e-12)
    assert material["eta_b"] == pytest.approx(1.0 / (9.81 * star**3), rel=1e-12)
    state = elastica.critical(3.0).state
    assert material["secant"]["kappa"] * star == pytest.approx(largest_curvature(state), rel=1e-9)


@pytest.mark.parametrize(
    ("secant", "named"),
    [
        ({"table": "nowhere.csv"}, "materials[0].secant.table"),
        ({"height": 1.0}, "materials[0].secant.height"),
        ({"height": 1000.0}, "materials[0].secant.height"),
        ({"areal_load": 0}, "materials[0].secant.areal_load"),
        ({"areal_load": 100.0}, "materials[0].secant.dimensionless_curvature"),
        ({"kappa": 20.0}, "materials[0].secant.kappa"),
        ({"load": 20.0}, "materials[0].secant.load"),
    ],
)
def test_a_secant_that_cannot_be_used(secant, named):
    assert refused(textile(**secant)).key == named


def test_a_secant_and_another_eta_b_contradict_each_other():
    content = textile()
    content["materials"][0]["eta_b"] = 100.0
    assert refused(content).key == "materials[0].eta_b"


# -- the workflow with one


def snakemake(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Snakemake in an environment whose path has a space."""
    (folder / "a b").symlink_to(sys.prefix)
    command = [folder / "a b/bin/python", "-m", "snakemake", "--cores", "1", *options]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def test_what_a_configuration_leaves_out_does_not_come_from_the_papers(tmp_path):
    (tmp_path / "workflow").symlink_to(ROOT / "workflow")  # the paper's is where the Snakefile looks for it
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(changed("recordings", ...)))
    done = snakemake(tmp_path, "--snakefile", str(ROOT / "Snakefile"), "--list-rules", "--configfile", "own.yaml")
    assert done.returncode != 0
    assert "recordings is missing" in done.stdout + done.stderr


def test_scripts_run_where_a_path_has_spaces(tmp_path):
    (tmp_path / "workflow").symlink_to(ROOT / "workflow")
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(MINIMAL))
    (tmp_path / "script.py").write_text("open(snakemake.output[0], 'w').close()\n")
    (tmp_path / "Snakefile").write_text(
        'include: "workflow/rules/common.smk"\nrule made:\n    output: "out"\n    script: "script.py"\n'
    )
    done = snakemake(tmp_path, "--configfile", "own.yaml")
    assert (done.returncode, (tmp_path / "out").exists()) == (0, True), done.stderr


def test_folders_of_recordings(tmp_path):
    for name in ("(a) +[b", "cotton"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "recording.yaml").touch()
    (tmp_path / "empty").mkdir()
    assert config.recording_folders(tmp_path, ["eta820"]) == ["(a) +[b", "cotton"]
    with pytest.raises(InvalidInputError, match=r"'cotton'.*rename"):
        config.recording_folders(tmp_path, ["eta820", "cotton"])
    (tmp_path / "cotton").rename(tmp_path / "{cotton")
    with pytest.raises(InvalidInputError, match=r"'{cotton'.*rename"):
        config.recording_folders(tmp_path, [])


# -- the shipped ones


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_height_does_what_it_is_there_for(name):
    for material in shipped(name)["materials"]:
        assert min(material["heights"]) > elastica.touch_limit()
        assert max(material["touching_heights"]) < elastica.touch_limit()
        assert sorted(material["heights"]) == material["heights"]
        unit = 1.0 / Scene(length=1.0, height=0.5, eta_b=material["eta_b"]).length_star
        # At least L* is left on the floor.
        assert elastica.critical(max(material["heights"])).length < material["length"] / unit - 1.0


def test_the_papers_runs():
    loaded = shipped("paper")
    first = loaded["materials"][:4]
    assert [material["eta_b"] for material in first] == [820, 3780, 12700, 30200]
    assert {(material["length"], material["eta_m"], material["nu"]) for material in first} == {(0.6, 1e-3, 0.0)}
    assert all(len(m["heights"]) >= 8 and len(m["touching_heights"]) == 2 for m in loaded["materials"])
    assert loaded["studies"]["branches"]["cases"] >= 1000


def test_the_textile_is_thin_and_long():
    loaded = shipped("paper")
    material = loaded["materials"][-1]
    asked = config.scene(loaded, material, 3.0)
    assert asked.material.relative_thickness < 0.05
    assert asked.length_star == pytest.approx(20.0, abs=0.1)
    assert asked.height_star == pytest.approx(3.0)
    # The numbers that the comment in the file quotes.
    assert material["eta_b"] == pytest.approx(94.9, abs=0.05)
    assert material["secant"]["kappa"] == pytest.approx(26.3, abs=0.05)
    assert material["secant"]["stiffness"] == pytest.approx(0.0146, abs=5e-5)


def test_quick_is_the_papers_in_small():
    paper, quick = shipped("paper"), shipped("quick")

    def keys(value: Any) -> Any:
        return {key: keys(item) for key, item in value.items()} if isinstance(value, dict) else None

    # Studies that a unit test runs, or that need an environment of their own, are left out.
    assert set(quick["studies"]) < set(paper["studies"])
    paper["studies"] = {name: paper["studies"][name] for name in quick["studies"]}
    assert keys(paper) == keys(quick)
    assert {m["name"] for m in quick["materials"]} <= {m["name"] for m in paper["materials"]}
    assert [len(m["heights"]) for m in quick["materials"]] == [3, 2]
    assert (quick["studies"]["branches"]["cases"], quick["studies"]["benchmark"]["repeats"]) == (8, 1)


def test_scene_of_a_material():
    loaded = config.load(changed("solid", {"law": "printed", "accuracy": 1e-2}))
    solid = config.scene(loaded, loaded["materials"][1], 3.0)
    assert (solid.law, solid.accuracy, solid.model) == ("printed", 1e-2, "solid")
    assert (solid.length, solid.material.eta_b, solid.height_star) == (0.6, 820, pytest.approx(3.0, rel=1e-14))
    thin = config.scene(loaded, loaded["materials"][1], 3.0, model="elastica")
    assert (thin.law, thin.model) == ("svk", "elastica")
