"""Studies of many independent cases, on all cores of a rule."""

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import xarray as xr

Progress = Callable[[str], None]


def in_parts(
    part: Callable[..., xr.Dataset], count: int, size: int, *arguments: object, threads: int, progress: Progress
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
            progress(f"{sum(part.sizes['case'] for part in parts)} of {count} cases")
    return xr.concat(parts, dim="case", combine_attrs="override")


def recordings_accuracy(cases: int, seed: int, dynamics: float, threads: int, progress: Progress) -> xr.Dataset:
    from studies import recordings_design as design
    from studies.recordings_accuracy import run

    with TemporaryDirectory() as folder:
        # Before the processes start: two of them would render the same calibration.
        for camera in {design.case(number, seed).factors["camera"] for number in range(cases)}:
            design.write_calibration(camera, Path(folder))
        return in_parts(run, cases, 5, seed, dynamics, Path(folder), threads=threads, progress=progress)
