"""Digests of what a stored result depends on, so that a result made by other code is known to be stale.

A result depends on the project's source files that its function imports, directly or not, on its parameters, on the
pinned versions of the numerical libraries, and on its input files.  Comments, docstrings and layout do not count.

``python workflow/evidence.py [CONFIG.yaml]`` prints the names of the stale studies, and the reasons on standard error.
"""

from __future__ import annotations

import ast
import hashlib
import json
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import xarray as xr

from stripfold.base.errors import InvalidInputError
from stripfold.files import store
from studies import STUDIES, parameters

ROOT = Path(__file__).parents[1]
PACKAGES = ("stripfold", "conventions", "plots", "second_generator", "studies", "tasks")
"""First parts of the names of the project's modules."""
LIBRARIES = ("av", "numba", "numpy", "opencv-python-headless", "pillow", "scikit-fem", "scikit-image", "scipy")
"""Libraries whose version can change a number; those of them that the lock names."""
ATTRIBUTE = "evidence"
"""Global attribute of a stored dataset that holds its evidence, as JSON."""


def evidence(
    call: str,
    params: Mapping[str, Any],
    inputs: Iterable[str | Path],
    files: Iterable[str] = (),
    code: str | None = None,
) -> dict[str, Any]:
    """Digests of everything that the result of a call depends on.

    ``call``: the function, as "module:name".  ``params``: its parameters.  ``inputs``: its input files.  A dataset with
    evidence of its own counts by its digest.  ``files``: patterns, relative to the repository, of further source files.
    ``code``: the :func:`code_digest`, where it is known.
    """
    return {
        "call": call,
        "files": sorted(files),
        "code": code or code_digest(call, tuple(files)),
        "params": _hash(json.dumps(params, sort_keys=True, default=str)),
        "libraries": libraries(),
        "inputs": {str(path): input_digest(path) for path in inputs},
    }


def digest(found: Mapping[str, Any]) -> str:
    """One digest of a result's evidence."""
    return _hash(json.dumps(found, sort_keys=True))


def why_stale(dataset: xr.Dataset, params: Mapping[str, Any] | None = None) -> str:
    """The reason why a stored dataset is not what today's code would store; empty where it is fresh.

    ``dataset``: as stored.  ``params``: today's parameters of its function; not compared where they are unknown.
    """
    stored = json.loads(dataset.attrs.get(ATTRIBUTE, "{}"))
    if not stored:
        return "it does not say which code made it"
    try:
        code = code_digest(stored["call"], tuple(stored["files"]))
    except FileNotFoundError:
        return "the code that made it is gone"
    if stored["code"] != code:
        return "the code has changed"
    if any(stored["libraries"].get(name) != versions for name, versions in libraries().items()):
        return "a library has changed"
    if params is not None and stored["params"] != _hash(json.dumps(params, sort_keys=True, default=str)):
        return "the configuration has changed"
    for path, found in stored["inputs"].items():
        if not Path(path).exists() or input_digest(path) != found:
            return f"its input {Path(path).name} has changed"
    return ""


def stale_studies(config: Mapping[str, Any]) -> dict[str, str]:
    """The studies of the repository that are missing or stale, by name, with the reason."""
    found = {}
    for name in STUDIES:
        path = ROOT / "results" / "studies" / f"{name}.nc"
        if not path.is_file():
            found[name] = "it is missing"
            continue
        try:
            dataset = xr.Dataset(attrs=_attributes(path))
        except InvalidInputError:
            found[name] = f"it is damaged: delete {path}"
            continue
        if reason := why_stale(dataset, parameters(name, config)):
            found[name] = reason
    return found


def code_digest(call: str, files: tuple[str, ...] = ()) -> str:
    """Digest of the source files that a function's module imports, directly or not, and of further ``files``."""
    modules = closure(call.partition(":")[0])
    sources = {name: source_digest(_file(name)) for name in modules}
    sources |= {
        str(p.relative_to(ROOT)): source_digest(p) for f in files for p in ROOT.glob(f) if ".venv" not in p.parts
    }
    return _hash(json.dumps(sources, sort_keys=True))


@cache
def libraries() -> dict[str, list[str]]:
    """Versions of the numerical libraries that ``environment.lock`` pins: one, or one for each version of Python."""
    pinned = re.findall(r"^([a-z0-9_.-]+)==(\S+)", (ROOT / "environment.lock").read_text(encoding="utf-8"), re.M)
    return {name: sorted(version for pin, version in pinned if pin == name) for name in LIBRARIES}


@cache
def closure(module: str) -> frozenset[str]:
    """Names of the project's modules that a module needs, itself among them."""
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += _imported(name)
    return frozenset(found)


@cache
def source_digest(path: Path) -> str:
    """Digest of a source file; the docstrings, comments and layout of Python code do not count."""
    if path.suffix != ".py":
        return _hash(path.read_bytes())
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in _statements(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [statement for statement in node.body if not _is_text(statement)]
    return _hash(ast.dump(tree))


@cache
def input_digest(path: str | Path) -> str:
    """Digest of an input file; of a folder, that of all its files."""
    path = Path(path)
    if path.suffix == ".nc" and (found := _attributes(path).get(ATTRIBUTE)):
        return digest(json.loads(found))
    if path.is_dir():
        return _hash(
            "".join(f"{p.relative_to(path)} {_hash(p.read_bytes())}" for p in sorted(path.rglob("*")) if p.is_file())
        )
    return _hash(path.read_bytes())


def _attributes(path: Path) -> dict[str, Any]:
    """Global attributes of a netCDF file."""
    with store.opened(path) as dataset:
        return dict(dataset.attrs)


@cache
def _file(name: str) -> Path | None:
    """The source file of a module, None if it is not the project's."""
    if name.partition(".")[0] not in PACKAGES:
        return None
    folder = ROOT / ("src" if name.startswith("stripfold") else "workflow")
    path = folder.joinpath(*name.split("."))
    return next((p for p in (path.with_suffix(".py"), path / "__init__.py") if p.is_file()), None)


@cache
def _imported(name: str) -> frozenset[str]:
    """The project's modules that a module imports, and the packages around them; not those for types only."""
    path = _file(name)
    if path is None:
        raise FileNotFoundError(f"no module {name}")
    found: set[str] = set()
    modules: dict[str, str] = {}
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in _statements(tree, types=False):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
            modules |= {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
    # A package may load its modules on first use: `kernels.band` needs no import of its own.
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in modules:
            found.add(f"{modules[node.value.id]}.{node.attr}")
    found |= {name.rpartition(".")[0] for name in [*found, name]}
    return frozenset(name for name in found if _file(name))


def _statements(tree: ast.Module, types: bool = True) -> Iterator[ast.AST]:
    """A module and its statements, those inside others too; without ``types`` not those for type checkers only."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        if not types and isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            waiting += node.orelse
            continue
        for block in ("body", "orelse", "finalbody", "handlers", "cases"):
            waiting += getattr(node, block, ())


def _is_text(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _hash(content: str | bytes) -> str:
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()[:16]


if __name__ == "__main__":
    from configuration import load

    stale = stale_studies(load(sys.argv[1] if len(sys.argv) > 1 else ROOT / "workflow" / "config" / "paper.yaml"))
    for study, reason in stale.items():
        print(f"{study}: {reason}", file=sys.stderr)
    print(*stale)
