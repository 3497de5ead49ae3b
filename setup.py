"""What pyproject.toml cannot say: the version is that of the tag, and a wheel knows its commit."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
UNTAGGED = "0.1.0"
"""What the first tag will be, v0.1.0."""


def git(*arguments: str) -> str | None:
    """Output of git; None when it fails, or where this file is not in its checkout."""
    for line in (["ls-files", "--error-unmatch", "setup.py"], arguments):
        try:
            done = subprocess.run(["git", "-C", str(HERE), *line], capture_output=True, text=True, timeout=30)
        except (OSError, subprocess.TimeoutExpired):
            return None
        if done.returncode:
            return None
    return done.stdout.strip()


def version() -> str:
    """That of the tag, vX.Y.Z; behind it with the number of commits since; of an unpacked sdist its own."""
    if described := git("describe", "--tags", "--long", "--match", "v[0-9]*"):
        tag, commits, commit = described[1:].rsplit("-", 2)
        return tag if commits == "0" else f"{tag}.post{commits}+{commit}"
    metadata = HERE / "PKG-INFO"
    if metadata.is_file() and (found := re.search(r"^Version: (.+)$", metadata.read_text(encoding="utf-8"), re.M)):
        return found[1]
    return f"{UNTAGGED}.dev{git('rev-list', '--count', 'HEAD') or 0}"


class BuildWithCommit(build_py):
    """A wheel is no checkout that could be asked."""

    def run(self) -> None:
        super().run()
        commit = git("rev-parse", "HEAD")
        if commit and not self.editable_mode:
            Path(self.build_lib, "stripfold", "commit.txt").write_text(f"{commit}\n", encoding="utf-8")


setup(version=version(), cmdclass={"build_py": BuildWithCommit})
