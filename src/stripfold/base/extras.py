"""Optional dependencies: what an extra brings, and a clear error where it is not installed."""

from __future__ import annotations

from importlib.util import find_spec

from stripfold.base.errors import MissingExtraError

MODULES = {
    "completion": ("shtab",),
    "plot": ("jinja2", "matplotlib"),
    "vision": ("av", "cv2", "jinja2", "matplotlib", "PIL", "skimage"),
}
"""Modules by the extra that installs them."""


def require(extra: str) -> None:
    """Refuse to go on without an extra.

    Raises MissingExtraError: one of its modules is not installed.
    """
    missing = [module for module in MODULES[extra] if find_spec(module) is None]
    if missing:
        raise MissingExtraError(extra, missing)
