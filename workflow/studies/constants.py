"""Named numerical constants of the solver, counted in the syntax trees of its modules."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from pathlib import Path

import xarray as xr

from studies.common import dataset

SOURCE = Path(__file__).parents[2] / "src" / "stripfold"


def run(packages: Sequence[str], before: int) -> xr.Dataset:
    """Constants over ``constant``: module, name and value as written.

    Parameters
    ----------
    packages
        Packages and modules of :mod:`stripfold`.
    before
        Their number before the lift-off was an unknown.
    """
    found = list(of_packages(SOURCE, packages))
    modules, names, values = zip(*found, strict=True)
    columns = {"module": ("constant", modules), "constant": ("constant", names), "value": ("constant", values)}
    return dataset("solver_constants", columns, {"before": before})


def of_packages(source: Path, packages: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """Module, name and value of each constant of packages and modules."""
    for package in packages:
        for path in sorted([*source.glob(f"{package}.py"), *source.glob(f"{package}/**/*.py")]):
            for name, value in constants(path.read_text(encoding="utf-8")):
                yield path.relative_to(source).with_suffix("").as_posix().replace("/", "."), name, value


def constants(code: str) -> Iterator[tuple[str, str]]:
    """Upper-case names at the top of a module whose values contain a number, and the values as written."""
    for statement in ast.parse(code).body:
        targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
        value = getattr(statement, "value", None)
        if value is None or not any(_is_number(node) for node in ast.walk(value)):
            continue
        for name in (
            node.id for target in targets if target for node in ast.walk(target) if isinstance(node, ast.Name)
        ):
            if name.isupper():
                yield name, ast.unparse(value)


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)
