"""The public API: names, units, errors; results as text, dataset, file and figure; a range of eta_b."""

from __future__ import annotations

import dataclasses
import doctest
import inspect
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import stripfold as sf
from stripfold import elastica
from stripfold.ask import inputs
from stripfold.base.errors import InvalidInputError
from stripfold.files.reporting import Result

STRIP = sf.Strip(length=0.6, eta_b=3780)
SHORT = sf.Strip(length=0.36, eta_b=3780)


@pytest.fixture(scope="module")
def stability_map():
    return sf.Strip(length=0.25, eta_b=3780).map()


def test_import_is_light():
    code = (
        "import sys, stripfold\n"
        "print([n for n in ('numpy', 'scipy', 'xarray', 'pydantic', 'matplotlib') if n in sys.modules])\n"
        "stripfold.Strip\n"
        "print([n for n in ('numpy', 'scipy', 'xarray') if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:2] == ["[]", "[]"]


def test_all_public_names_are_there_and_documented():
    assert set(sf.__all__) <= set(dir(sf))
    for name in set(sf.__all__) - {"__version__"}:
        assert inspect.getdoc(getattr(sf, name)), name
    with pytest.raises(AttributeError, match="no attribute 'Strap'"):
        sf.Strap  # noqa: B018


def test_one_source_of_names_and_defaults():
    fields = {field.name: field.default for field in dataclasses.fields(sf.Strip)}
    for name, field in inputs.Strip.model_fields.items():
        assert fields.pop(name) == (dataclasses.MISSING if field.is_required() else field.default), name
    assert not fields


def test_a_strip_is_checked_and_frozen():
    assert STRIP.gravity_length == pytest.approx((3780 * 9.81) ** (-1 / 3))
    assert isinstance(STRIP.eta_b, float)
    with pytest.raises(sf.InvalidInputError, match=r"600 mm is 0\.6 m"):
        sf.Strip(length=600, eta_b=3780)
    with pytest.raises(dataclasses.FrozenInstanceError):
        STRIP.length = 1.0  # type: ignore[misc]


@pytest.mark.parametrize("kind", ["r_path", "circular", "low"])
def test_a_path_is_for_any_strip_of_its_length(kind, tmp_path: Path):
    """Planned for one eta_b, assessed for another: as by its table."""
    softer = sf.Strip(length=0.36, eta_b=4500)
    path = getattr(sf.paths, kind)(SHORT, *((0.04,) if kind == "low" else ()))
    path.to_csv(tmp_path / "path.csv")
    found = softer.assess(path, model="rod").to_dict()
    by_table = softer.assess(sf.paths.read(tmp_path / "path.csv", softer), model="rod").to_dict()
    for event, other in zip(found.pop("critical"), by_table.pop("critical"), strict=True):
        assert event["kind"] == other["kind"]
        assert [event[key] for key in "txz"] == pytest.approx([other[key] for key in "txz"], abs=1e-5)
    for key in ("stable", "completed", "contact"):
        assert found[key] == by_table[key]
    for key in ("touch_x", "lying_length", "shape_error", "peak_force"):
        assert found[key] == pytest.approx(by_table[key], rel=1e-3, abs=1e-5, nan_ok=True), key
    with pytest.raises(sf.InvalidInputError, match=r"one for this strip's length, 0.6 m"):
        STRIP.assess(path)


@pytest.mark.parametrize(
    ("x", "z", "key"), [("0.1", 0.1, "x"), (0.1, None, "z"), ([0.1, 0.2], [0.1, 0.2, 0.3], "z"), (True, 0.1, "x")]
)
def test_places_on_a_map_are_numbers(stability_map, x, z, key):
    for name in ("hangs", "lies", "margin", "barrier"):
        with pytest.raises(sf.InvalidInputError) as caught:
            getattr(stability_map, name)(x, z)
        assert caught.value.key == key
    assert stability_map.hangs([0.0, 0.01], 0.05).shape == (2,)


def test_a_result_is_written_to_a_file_with_a_name(stability_map):
    for wrong in (5, "", b"map.nc"):
        with pytest.raises(sf.InvalidInputError) as caught:
            stability_map.to_netcdf(wrong)
        assert caught.value.key == "file"


@pytest.mark.parametrize("name", ["stripfold", "stripfold.ask.strip", "stripfold.film.eta", "stripfold.ask.inputs"])
def test_examples_in_docstrings(name):
    found = doctest.testmod(import_module(name))
    assert found.attempted
    assert not found.failed


def test_every_result_says_units_and_source():
    found = [kind for kind in (getattr(sf, name) for name in sf.__all__) if isinstance(kind, type)]
    for kind in found:
        if issubclass(kind, Result) and kind is not Result:
            text = inspect.getdoc(kind) or ""
            assert "Source:" in text, kind
            assert "Attributes" in text, kind


@pytest.mark.parametrize(
    ("height", "there", "gone"), [(0.09, "lambda_c", "lambda_touch"), (0.03, "lambda_touch", "lambda_c")]
)
def test_a_result_is_shown_on_one_line_without_what_it_has_not(height: float, there: str, gone: str) -> None:
    found = STRIP.critical(height=height, model="elastica")
    shown = repr(found)
    assert "\n" not in shown
    assert shown.startswith("CriticalPoint(model='elastica', ")
    assert f"{there}={getattr(found, there):.6g}" in shown
    assert gone not in shown


@pytest.mark.parametrize(
    ("model", "height", "off"), [("elastica", 0.09, 1e-9), ("rod", 0.09, 6e-4), ("rod", 0.049, 6e-4)]
)
def test_the_ends_are_those_of_strips_with_such_an_eta_b(model, height: float, off: float) -> None:
    """Exactly on the elastica; at the lower height the softer of them snaps and the stiffer is laid down."""
    ends = STRIP.critical(height, model=model, eta_b_uncertainty=0.2).eta_b_range
    assert ends is not None
    assert ends.eta_b == pytest.approx((3024.0, 4536.0))
    for eta_b, snap, advance, margin in zip(ends.eta_b, ends.snap, ends.advance, ends.margin, strict=True):
        strip = sf.Strip(length=0.6, eta_b=eta_b)
        other = strip.critical(height, model=model)
        assert snap == other.snap
        assert advance == pytest.approx(other.lambda_c if snap else other.lambda_touch, rel=off)
        assert margin == pytest.approx(height - elastica.touch_limit() * strip.gravity_length)
    assert ends.snap == ((True, True) if height > 0.05 else (False, True))


@pytest.mark.parametrize(("length", "uncertainty", "key"), [(0.6, 1.0, "eta_b_uncertainty"), (0.22, 0.5, "length")])
def test_no_strip_at_one_of_the_ends(length: float, uncertainty: float, key: str) -> None:
    with pytest.raises(InvalidInputError) as refused:
        sf.Strip(length=length, eta_b=3780.0).critical(0.09, model="elastica", eta_b_uncertainty=uncertainty)
    assert refused.value.key == key
