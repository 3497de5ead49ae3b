"""Named numerical constants of the solver, counted in the syntax trees of its modules."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from pathlib import Path

import xarray as xr

from studies.common import dataset, markdown_table

SOURCE = Path(__file__).parents[2] / "src" / "stripfold"


def run(packages: Sequence[str], before: int, later: Sequence[str]) -> xr.Dataset:
    """Constants over ``constant``: module, name, value as written, and reason as documented.

    ``packages``: packages and modules of :mod:`stripfold`; ``before``: their number before the lift-off was an unknown;
    ``later``: modules of what did not exist then.
    """
    found = list(of_packages(SOURCE, packages))
    columns = zip(("module", "constant", "value", "reason"), zip(*found, strict=True), strict=True)
    attrs = {"before": before, "later": sum(module in later for module, *_ in found)}
    return dataset("solver_constants", {name: ("constant", values) for name, values in columns}, attrs)


def markdown(data: xr.Dataset) -> str:
    """The constants as a table."""
    rows = []
    for one in (data.isel(constant=i) for i in range(data.sizes["constant"])):
        cells = (f"`{one['constant'].item()}`", f"`{one['value'].item()}`", one["reason"].item())
        rows.append((one["module"].item(), *(cell.replace("|", r"\|") for cell in cells)))
    return markdown_table(("module", "constant", "value", "reason"), rows)


def of_packages(source: Path, packages: Sequence[str]) -> Iterator[tuple[str, str, str, str]]:
    """Module, name, value and reason of each constant of packages and modules."""
    for package in packages:
        for path in sorted([*source.glob(f"{package}.py"), *source.glob(f"{package}/**/*.py")]):
            for constant in constants(path.read_text(encoding="utf-8")):
                yield path.relative_to(source).with_suffix("").as_posix().replace("/", "."), *constant


def constants(code: str) -> Iterator[tuple[str, str, str]]:
    """Upper-case names at the top of a module whose values contain a number, the values as written, and the reason.

    That is the first paragraph of the docstring below; constants that follow each other can share one.
    """
    body = ast.parse(code).body
    for i, statement in enumerate(body):
        targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
        value = getattr(statement, "value", None)
        if value is None or not any(_is_number(node) for node in ast.walk(value)):
            continue
        for name in (
            node.id for target in targets if target for node in ast.walk(target) if isinstance(node, ast.Name)
        ):
            if name.isupper():
                yield name, ast.unparse(value), _docstring(body[i + 1 :])


def _docstring(behind: Sequence[ast.stmt]) -> str:
    """The first paragraph of the docstring behind assignments; empty without one."""
    first = next((statement for statement in behind if not isinstance(statement, ast.Assign | ast.AnnAssign)), None)
    text = first.value.value if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant) else ""
    return " ".join(str(text).split("\n\n")[0].split())


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)
