"""What the site needs beside the pages: the README as its first page, figures and examples under the same links."""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
SHOWN = ("figures/*.png", "figures/*.mp4", "figures/*.html", "examples/*.py")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the README as index.md and what pages show from outside docs."""
    files.append(File.generated(config, "index.md", abs_src_path=str(ROOT / "README.md")))
    for pattern in SHOWN:
        for path in sorted(ROOT.glob(pattern)):
            files.append(File.generated(config, path.relative_to(ROOT).as_posix(), abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Links as they are in the site, whose root is docs."""
    outside = "docs/" if page.file.src_uri == "index.md" else r"\.\./(?=figures/|examples/)"
    return re.sub(rf"\]\({outside}", "](", markdown)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Docstrings name objects as :class:`Strip`, which shows as Strip, and pages as docs/plan.md, which are linked."""
    html = re.sub(r":(?:class|func|meth|mod|attr|data):<code>[.~]*", "<code>", html)
    if page.file.src_uri == "api.md":
        html = re.sub(r"docs/([a-z-]+)\.md", r'<a href="../\1/">\1</a>', html)
    return html
