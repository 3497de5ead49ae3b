"""Studies of many independent cases, on all cores of a rule."""

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor

import xarray as xr


def in_parts(
    part: Callable[..., xr.Dataset], count: int, size: int, *arguments: object, threads: int, say: Callable[[str], None]
) -> xr.Dataset:
    """``part(range, *arguments)`` for all of ``count`` cases, ``size`` at a time, joined along ``case``."""
    parts: list[xr.Dataset] = []
    with ProcessPoolExecutor(threads) as pool:
        ranges = [range(first, min(first + size, count)) for first in range(0, count, size)]
        for job in [pool.submit(part, cases, *arguments) for cases in ranges]:
            try:
                parts.append(job.result())
            except BaseException:
                # Else all that is left would be run before the error is seen.
                pool.shutdown(wait=False, cancel_futures=True)
                raise
            say(f"{sum(part.sizes['case'] for part in parts)} of {count} cases")
    return xr.concat(parts, dim="case", combine_attrs="override")
