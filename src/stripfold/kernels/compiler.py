"""The compiler's settings, and its cache."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

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


def compiled(signature: Any = None) -> Callable[[F], F]:
    """Compile a function for one signature; without it, for the kernels that call it."""

    def compile_(function: F) -> F:
        kernel: Any = numba.njit(error_model="numpy", fastmath=FASTMATH)(function)
        if signature is not None:
            # Without a folder that can hold the cache, the package's or the user's, it is compiled each time.
            with suppress(RuntimeError):
                kernel.enable_caching()
                # The compiler's own stamp misses changes of the functions that this one calls.
                kernel._cache._cache_file._source_stamp = SOURCES
            kernel.compile(signature)
        return cast(F, kernel)

    return compile_
