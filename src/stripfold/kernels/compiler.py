"""The compiler's settings, and its cache."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache
from numba.core.runtime.nrt import rtsys

F = TypeVar("F", bound=Callable[..., Any])

FASTMATH = {"contract", "reassoc", "nsz", "arcp"}
"""Fused and reordered sums; infinities and nan keep their meaning."""

vector, matrix, mask = numba.float64[::1], numba.float64[:, ::1], numba.boolean[::1]
index = numba.int64[::1]


def _digest() -> str:
    """Of the sources of all kernels."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    return sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


SOURCES = _digest()


class _Cache(FunctionCache):  # type: ignore[misc]
    """Kept code, loaded without the compiler's own library, whose import takes twice as long as all kernels do."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        # The compiler's own stamp misses changes of the functions that this one calls.
        self._cache_file._source_stamp = SOURCES

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        rtsys.initialize(target_context)
        return self._load_overload(sig, target_context)


def compiled(signature: Any = None) -> Callable[[F], F]:
    """Compile a function for one signature; without it, for the kernels that call it."""

    def compile_(function: F) -> F:
        kernel: Any = numba.njit(error_model="numpy", fastmath=FASTMATH)(function)
        if signature is not None:
            # Without a folder that can hold the cache, the package's or the user's, it is compiled each time.
            with suppress(RuntimeError):
                kernel._cache = _Cache(function)
            kernel.compile(signature)
            # For a constant among the arguments a kernel that calls this one would have it compiled once more.
            kernel.disable_compile()
        return cast(F, kernel)

    return compile_
