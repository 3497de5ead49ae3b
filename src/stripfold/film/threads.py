"""OpenCV on one thread."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import cv2


@contextmanager
def one_thread() -> Iterator[None]:
    """Within it OpenCV has one thread; also a decorator.

    Several threads add up in an order that changes from run to run, and so do the last digits of the result.  On
    pictures this small they also cost more than they save.
    """
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)
