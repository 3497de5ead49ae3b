"""Version and commit of the running code: every result carries them."""

from __future__ import annotations

import subprocess
from functools import cache
from pathlib import Path

# What decides a result: a change elsewhere, in a text or in a stored result, does not make the commit "dirty".
_SOURCES = ("src", "workflow", "data", "Snakefile", "environment.lock")


@cache
def version() -> str:
    """Return the version of the installed package, that of its tag."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as installed

    try:
        return installed("stripfold")
    except PackageNotFoundError:
        return "unknown"


@cache
def running_commit() -> str:
    """Return :func:`git_commit` of this package as it was at the first call, when the code was loaded."""
    return git_commit()


def git_commit(folder: Path = Path(__file__).parent) -> str:
    """Return the commit of the source tree that ``folder`` belongs to, with "-dirty" when its sources were changed.

    Where this is no checkout, or git is missing, that of the wheel; "unknown" of one built without git.
    """
    # An installed copy may lie inside somebody else's checkout: only one that tracks this file counts.
    if _git(folder, "ls-files", "--error-unmatch", Path(__file__).name) is not None:
        commit, top = _git(folder, "rev-parse", "HEAD"), _git(folder, "rev-parse", "--show-toplevel")
        if commit and top:
            changed = _git(Path(top), "status", "--porcelain", "--", *_SOURCES)
            return commit if changed == "" else f"{commit}-dirty"
    of_wheel = Path(__file__).parents[1] / "commit.txt"
    return of_wheel.read_text(encoding="utf-8").strip() if of_wheel.is_file() else "unknown"


def _git(folder: Path, *arguments: str) -> str | None:
    """Return what git prints, None when it fails; on a full disk git would leave the lock of its index behind."""
    try:
        done = subprocess.run(
            ["git", "--no-optional-locks", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=30
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None
