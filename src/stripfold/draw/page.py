"""Pages about results: one HTML file each, from a template in the frame that all share."""

from __future__ import annotations

from typing import Any

import jinja2

from stripfold.base.version import running_commit, version


def html(template: str, **values: Any) -> str:
    """The page of a template of the folder ``templates``, with its values, and the version and commit of the code."""
    loader = jinja2.PackageLoader("stripfold")
    environment = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    return environment.get_template(template).render(version=version(), commit=running_commit(), **values)
