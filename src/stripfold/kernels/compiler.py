"""The compiler's settings, and the cache of what it has compiled."""

from __future__ import annotations

import logging
import os
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.compiler import CompileResult
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps

F = TypeVar("F", bound=Callable[..., Any])

FASTMATH = {"contract", "reassoc", "nsz", "arcp"}
"""Fused and reordered sums; infinities and nan keep their meaning."""

vector, matrix, mask = numba.float64[::1], numba.float64[:, ::1], numba.boolean[::1]
index = numba.int64[::1]

PACKAGE = Path(__file__).parent
logger = logging.getLogger("stripfold")
KEEPING = (
    "set NUMBA_CACHE_DIR to a folder that can be written, or call `stripfold doctor` once as a user who can write to "
    "the package"
)
"""What to do where compiled code cannot be kept."""
kept_in: set[Path] = set()
"""Folders that kernels of this process were loaded from or stored in."""
_said: set[str] = set()


def _folders() -> list[Path]:
    """Where compiled code is looked for, and stored in the first that can be written.

    A package that is shared or part of an image can often be read only: it is loaded from there all the same.
    """
    caches = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    package, user = PACKAGE / "__pycache__", caches / "stripfold" / sha256(os.fsencode(PACKAGE)).hexdigest()[:16]
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return [Path(chosen) / user.name, package]
    # Without a home the user's is relative: to the working folder.
    return [package, user] if user.is_absolute() else [package]


def _digest() -> str:
    """Of the sources of all kernels: a kernel contains the code of those that it calls."""
    files = [*PACKAGE.glob("*.py"), *PACKAGE.parent.glob("film/*_kernels.py")]
    return sha256(b"".join(file.read_bytes() for file in sorted(files))).hexdigest()


SOURCES = _digest()


def _once(level: int, said: str) -> None:
    """Log a message, in each process once."""
    if said not in _said:
        _said.add(said)
        logger.log(level, said)


class _Cache:
    """The machine code of one kernel, in the place of numba's own cache.

    That one ends in an error at a damaged file, does not read where it cannot write, and misses changes of the kernels
    that this one calls.  Here a file is the digest of its key and its content, then the content; any other file is as
    good as none.
    """

    cache_path = None
    """For numba's statistics."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._name = f"{function.__module__}.{function.__qualname__}"

    def _key(self, target: Any) -> tuple[str, bytes]:
        """Name of the file, different for each Python and processor; what the content must have been made for."""
        machine = f"{sys.implementation.cache_tag} {target.codegen().magic_tuple()}"
        key = f"{self._name} {machine} {numba.__version__} {SOURCES}"
        return f"{self._name}-{sha256(machine.encode()).hexdigest()[:16]}.kernel", key.encode()

    def load_overload(self, _: Any, target: Any) -> Any:
        # All that loading needs of the compiler's library, whose import takes twice as long as all kernels do.
        rtsys.initialize(target)
        name, key = self._key(target)
        for folder in _folders():
            # Whatever keeps it from being loaded, the kernel is compiled.
            with suppress(Exception):
                kept = (folder / name).read_bytes()
                digest, content = kept[:32], kept[32:]
                if digest == sha256(key + content).digest():
                    found = CompileResult._rebuild(target, *pickle.loads(content))
                    kept_in.add(folder)
                    return found
        _once(logging.INFO, "compiling, once after an installation: this takes up to a minute")
        return None

    def save_overload(self, _: Any, compiled: Any) -> None:
        name, key = self._key(compiled.target_context)
        reasons = []
        for folder in _folders():
            try:
                content = dumps(compiled._reduce())
                folder.mkdir(parents=True, exist_ok=True)
                new = folder / f".{os.urandom(8).hex()}"
                try:
                    new.write_bytes(sha256(key + content).digest() + content)
                    new.replace(folder / name)
                finally:
                    new.unlink(missing_ok=True)
                kept_in.add(folder)
                return
            except Exception as error:
                reasons.append(f"{folder}: {getattr(error, 'strerror', None) or error}")
        why = "; ".join(reasons)
        _once(logging.WARNING, f"compiled code cannot be kept, each command compiles anew ({why}): {KEEPING}")


def compiled(signature: Any = None) -> Callable[[F], F]:
    """Compile a function for one signature; without it, for the kernels that call it."""

    def compile_(function: F) -> F:
        kernel: Any = numba.njit(error_model="numpy", fastmath=FASTMATH)(function)
        if kernel is function:
            _once(logging.WARNING, "NUMBA_DISABLE_JIT is set: the compiled loops run as Python, very slowly")
        elif signature is not None:
            kernel._cache = _Cache(function)
            kernel.compile(signature)
            # For a constant among the arguments a kernel that calls this one would have it compiled once more.
            kernel.disable_compile()
        return cast(F, kernel)

    return compile_
