"""What the site needs beside the pages: the README as its first page, figures and examples under the same links.

Notebooks become pages, with the outputs that are stored in them.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
SHOWN = ("figures/*.png", "figures/*.gif", "figures/*.mp4", "figures/*.html", "examples/*.py")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the README as index.md and what pages show from outside docs."""
    files.append(File.generated(config, "index.md", abs_src_path=str(ROOT / "README.md")))
    for pattern in SHOWN:
        for path in sorted(ROOT.glob(pattern)):
            files.append(File.generated(config, path.relative_to(ROOT).as_posix(), abs_src_path=str(path)))
    for path in sorted(ROOT.glob("examples/*.ipynb")):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        content = "\n\n".join(block for cell in cells for block in _blocks(cell))
        files.append(File.generated(config, f"examples/{path.stem}.md", content=content))
    return files


def _blocks(cell: dict[str, Any]) -> Iterator[str]:
    """A cell of a notebook and its outputs as Markdown."""
    source = "".join(cell["source"])
    yield source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```"
    for output in cell.get("outputs", ()):
        data = output.get("data", {"text/plain": output.get("text", ())})
        if picture := data.get("image/png"):
            yield f"![what the cell draws](data:image/png;base64,{picture})"
        else:
            yield f"```text\n{''.join(data['text/plain']).rstrip()}\n```"


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Links as they are in the site, whose root is docs."""
    if page.file.src_uri.startswith("examples/"):
        return markdown.replace("](../docs/", "](../")
    if page.file.src_uri == "examples.md":
        markdown = re.sub(r"^\[(\w+\.py)\]\(.*\)$", _with_code, markdown, flags=re.M)
    outside = "docs/" if page.file.src_uri == "index.md" else r"\.\./(?=figures/|examples/)"
    return re.sub(r"\]\((examples/\w+)\.ipynb\)", r"](\1.md)", re.sub(rf"\]\({outside}", "](", markdown))


def _with_code(link: re.Match[str]) -> str:
    """A link to a program, and the program."""
    code = (ROOT / "examples" / link[1]).read_text(encoding="utf-8")
    return f"{link[0]}\n\n```python\n{code}```"


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Docstrings name objects as :class:`Strip`, which shows as Strip, and pages as docs/plan.md, which are linked."""
    html = re.sub(r":(?:class|func|meth|mod|attr|data):<code>[.~]*", "<code>", html)
    if page.file.src_uri == "api.md":
        html = re.sub(r"docs/([a-z-]+)\.md", r'<a href="../\1/">\1</a>', html)
    return html
