"""Run notebooks without Jupyter, and store in them what their cells print and draw.

``python workflow/notebooks.py NOTEBOOK.ipynb ...`` runs each in a temporary folder.  A cell shows what it prints and
the value of its last expression: a figure as a small picture, another as text.
"""

from __future__ import annotations

import ast
import base64
import json
import sys
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from io import BytesIO, StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from matplotlib.figure import Figure
from PIL import Image

DPI = 75
COLOURS = 16
"""Of a picture: more make it larger, not better."""


def run(notebook: dict[str, Any], name: str) -> None:
    """Run all cells in order, in one namespace, and replace their outputs."""
    names: dict[str, Any] = {"__name__": "__main__"}
    code = (cell for cell in notebook["cells"] if cell["cell_type"] == "code")
    for count, cell in enumerate(code, 1):
        said = StringIO()
        with redirect_stdout(said):
            value = _executed("".join(cell["source"]), f"{name}, cell {count}", names)
        cell["execution_count"], cell["outputs"] = count, list(_outputs(said.getvalue(), value, count))


def _executed(source: str, where: str, names: dict[str, Any]) -> Any:
    """The value of the last expression; None without one."""
    tree, last = ast.parse(source, where), None
    if isinstance(tree.body[-1], ast.Expr):
        last = ast.Expression(tree.body.pop().value)  # type: ignore[attr-defined]
    exec(compile(tree, where, "exec"), names)
    return None if last is None else eval(compile(last, where, "eval"), names)


def _outputs(said: str, value: Any, count: int) -> Iterator[dict[str, Any]]:
    """In the format of notebooks."""
    if said:
        yield {"name": "stdout", "output_type": "stream", "text": said.splitlines(keepends=True)}
    if value is not None:
        data = {"image/png": _picture(value)} if isinstance(value, Figure) else {"text/plain": [repr(value)]}
        yield {"data": data, "execution_count": count, "metadata": {}, "output_type": "execute_result"}


def _picture(figure: Figure) -> str:
    large, small = BytesIO(), BytesIO()
    figure.savefig(large, format="png", dpi=DPI)
    Image.open(large).convert("RGB").quantize(COLOURS).save(small, "png", optimize=True)
    return base64.b64encode(small.getvalue()).decode()


if __name__ == "__main__":
    for path in map(Path, sys.argv[1:]):
        found = json.loads(path.read_text(encoding="utf-8"))
        with TemporaryDirectory() as folder, chdir(folder):
            run(found, path.name)
        path.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8", newline="\n")
