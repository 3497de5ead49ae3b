"""A stored result is stale when its code, parameters, libraries or inputs have changed, and only then."""

import json

import pytest
import xarray as xr

import evidence

CALL = "studies.limit:run"
PARAMS = {"height": 3.0}


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A small project of its own: ``studies.limit`` imports ``stripfold.deep`` by way of ``stripfold.near``.

    ``stripfold.lazy`` loads its modules on first use.
    """
    files = {
        "src/stripfold/__init__.py": "",
        "src/stripfold/near.py": "from typing import TYPE_CHECKING\nfrom stripfold import lazy\nif TYPE_CHECKING:\n"
        "    from stripfold import typed\n"
        "def f():\n    from stripfold import deep\n    return deep.X + lazy.loaded.X\n",
        "src/stripfold/lazy/__init__.py": "def __getattr__(name): ...\n",
        "src/stripfold/lazy/loaded.py": "X = 1\n",
        "src/stripfold/lazy/other.py": "X = 1\n",
        "src/stripfold/deep.py": '"""A constant."""\nX = 1\n',
        "src/stripfold/typed.py": "Y = 1\n",
        "src/stripfold/other.py": "Z = 1\n",
        "workflow/studies/__init__.py": "",
        "workflow/studies/limit.py": "from stripfold.near import f\n",
        "environment.lock": "numpy==2.4.6 ; python_version < '3.12' \\\nnumpy==2.5.5 \\\nrich==1.0 \\\n",
    }
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    monkeypatch.setattr(evidence, "ROOT", tmp_path)
    return tmp_path


@pytest.fixture(autouse=True)
def _caches():
    _clear()
    yield
    _clear()


def stored(inputs=()):
    found = evidence.evidence(CALL, PARAMS, inputs)
    _clear()
    return xr.Dataset(attrs={evidence.ATTRIBUTE: json.dumps(found)})


def _clear():
    for value in vars(evidence).values():
        if hasattr(value, "cache_clear"):
            value.cache_clear()


def edit(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_unchanged_is_fresh(project):
    assert evidence.why_stale(stored(), PARAMS) == ""


@pytest.mark.parametrize(
    ("name", "old", "new", "reason"),
    [
        ("src/stripfold/deep.py", "X = 1", "X = 2", "the code has changed"),
        ("src/stripfold/deep.py", "X = 1", "X = 1  # one", ""),
        ("src/stripfold/deep.py", "A constant.", "The constant.", ""),
        ("src/stripfold/lazy/loaded.py", "X = 1", "X = 2", "the code has changed"),
        ("src/stripfold/lazy/other.py", "X = 1", "X = 2", ""),
        ("src/stripfold/typed.py", "Y = 1", "Y = 2", ""),
        ("src/stripfold/other.py", "Z = 1", "Z = 2", ""),
        ("environment.lock", "numpy==2.4.6", "numpy==2.4.7", "a library has changed"),
        ("environment.lock", "rich==1.0", "rich==1.1", ""),
    ],
)
def test_what_counts(project, name, old, new, reason):
    data = stored()
    edit(project / name, old, new)
    assert evidence.why_stale(data, PARAMS) == reason


@pytest.mark.parametrize(
    ("today", "reason"),
    [(("numpy",), ""), (("numpy", "scipy"), ""), (("numpy", "scipy", "rich"), "a library has changed")],
)
def test_libraries_that_are_watched_today_count(project, monkeypatch, today, reason):
    monkeypatch.setattr(evidence, "LIBRARIES", ("numpy", "scipy"))
    data = stored()
    monkeypatch.setattr(evidence, "LIBRARIES", today)
    assert evidence.why_stale(data, PARAMS) == reason


def test_code_that_is_gone(project):
    data = stored()
    (project / "workflow/studies/limit.py").unlink()
    assert evidence.why_stale(data, PARAMS) == "the code that made it is gone"


def test_configuration(project):
    data = stored()
    assert evidence.why_stale(data, {"height": 2.0}) == "the configuration has changed"
    assert evidence.why_stale(data) == ""


def test_inputs_count_by_their_own_evidence(project):
    path = project / "input.nc"
    xr.Dataset(attrs={evidence.ATTRIBUTE: '{"code": "a"}', "git_commit": "1"}).to_netcdf(path)
    data = stored([path])
    xr.Dataset(attrs={evidence.ATTRIBUTE: '{"code": "a"}', "git_commit": "2"}).to_netcdf(path)
    assert evidence.why_stale(data, PARAMS) == ""
    _clear()
    xr.Dataset(attrs={evidence.ATTRIBUTE: '{"code": "b"}'}).to_netcdf(path)
    assert evidence.why_stale(data, PARAMS) == "its input input.nc has changed"


def test_without_evidence():
    assert evidence.why_stale(xr.Dataset()) == "it does not say which code made it"


def test_every_study_has_code_and_parameters():
    from configuration import load
    from studies import STUDIES, parameters

    config = load(evidence.ROOT / "workflow/config/paper.yaml", evidence.ROOT)
    for name, study in STUDIES.items():
        assert evidence.code_digest(study.call, study.files)
        json.dumps(parameters(name, config))
