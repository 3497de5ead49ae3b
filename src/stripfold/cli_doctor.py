"""``stripfold doctor``: what is installed, what is missing, and a small run of two models against each other."""

from __future__ import annotations

import argparse
import os
import platform
from collections.abc import Callable, Iterator
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

from stripfold.base.errors import MODULES
from stripfold.base.version import version
from stripfold.cli_commands import command
from stripfold.cli_messages import Say
from stripfold.files.reporting import as_json

AGREEMENT = 1e-3
"""Largest difference of lambda_c between the two models of the small run, L*."""
CODECS = {"h264": "r", "hevc": "r", "mpeg4": "rw", "mjpeg": "rw", "png": "rw", "ffv1": "rw"}
"""Codecs of recordings (read) and of films and synthetic recordings (written)."""


class Finding(NamedTuple):
    """One line of the answer; ``fault`` says what to do, and is empty where all is well."""

    name: str
    state: str
    fault: str = ""
    needed: bool = True


@command("versions, codecs and a small run: what is installed, and what is missing", lambda _: None)
def doctor(arguments: argparse.Namespace, say: Say) -> tuple[str, int]:
    """Say what is installed and what is missing, and solve one strip with two models."""
    found = []
    for finding in _findings():
        say(finding.name)
        found.append(finding)
    code = 2 if any(finding.fault and finding.needed for finding in found) else 0
    if arguments.json:
        return as_json({finding.name: {"state": finding.state, "fault": finding.fault} for finding in found}), code
    rows = [f"{f.name:<16} {f.state}" + (f"; {f.fault}" if f.fault else "") for f in found]
    verdict = "something is missing or does not work" if code else "all that every command needs is there"
    return "\n".join([*rows, verdict]), code


def _findings() -> Iterator[Finding]:
    yield Finding("stripfold", version())
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    yield Finding("python", f"{platform.python_version()}, {platform.system()} {platform.machine()}, {cores} cores")
    yield from _packages()
    for extra, modules in MODULES.items():
        yield (found := _working(f"extra {extra}", partial(_extra, extra, modules)))
        if extra == "vision" and not found.fault:
            yield _working("small film", _film)
    yield _working("compiled code", _compiled)
    yield _working("small run", _run)


def _working(name: str, check: Callable[[], Finding]) -> Finding:
    """What a check finds; libraries that do not fit each other raise errors of any kind."""
    try:
        return check()
    except Exception as error:
        return Finding(name, "does not work", f"{type(error).__name__}: {error}")


def _packages() -> Iterator[Finding]:
    """Required packages with their versions, against the bounds that the installed package declares."""
    from packaging.requirements import Requirement

    for text in metadata.requires("stripfold") or []:
        required = Requirement(text)
        if required.marker is not None:
            continue
        try:
            installed = metadata.version(required.name)
        except metadata.PackageNotFoundError:
            yield Finding(required.name, "missing", f'pip install "{required}"')
            continue
        fits = required.specifier.contains(installed, prereleases=True)
        yield Finding(required.name, installed, "" if fits else f'too old: pip install "{required}"')


def _extra(extra: str, modules: tuple[str, ...]) -> Finding:
    from importlib.util import find_spec

    missing = [module for module in modules if find_spec(module) is None]
    if missing:
        advice = f'pip install "stripfold[{extra}]" where it is wanted'
        return Finding(f"extra {extra}", f"{', '.join(missing)} missing", advice, needed=False)
    if extra != "vision":
        return Finding(f"extra {extra}", "complete")
    import av

    lacking = [name for name, modes in CODECS.items() for mode in modes if not _codec(av, name, mode)]
    if lacking:
        advice = "such films cannot be read or written: install the wheel of av"
        return Finding(f"extra {extra}", f"no codec {', '.join(lacking)}", advice, needed=False)
    return Finding(f"extra {extra}", f"codecs {', '.join(CODECS)}")


def _film() -> Finding:
    """Write a film of two frames, and read it as `measure` does."""
    from tempfile import TemporaryDirectory

    import av
    import numpy as np

    from stripfold.film import video

    pictures = [np.full((120, 160), grey, np.uint8) for grey in (60, 180)]
    with TemporaryDirectory() as folder:
        film = Path(folder) / "film.mkv"
        with av.open(str(film), "w") as container:
            stream = container.add_stream("ffv1", rate=25, options={"threads": "1"})
            stream.width, stream.height, stream.pix_fmt = 160, 120, "gray"
            for picture in pictures:
                container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="gray")))
            container.mux(stream.encode(None))
        with video.read(film) as reader:
            seen = [frame.image for frame in reader]
    if not np.array_equal(seen, pictures):
        return Finding("small film", "is not read as it was written", "please report it")
    return Finding("small film", "2 frames written and read")


def _codec(av: Any, name: str, mode: str) -> bool:
    try:
        av.codec.Codec(name, mode)
    except ValueError:
        return False
    return True


def _compiled() -> Finding:
    """Compile what is not in the cache, and say where it is kept."""
    import numba

    from stripfold import kernels
    from stripfold.kernels import compiler

    kernels.load()
    config: Any = numba.config
    if config.DISABLE_JIT:
        return Finding("compiled code", "switched off", "unset NUMBA_DISABLE_JIT", needed=False)
    if not compiler.kept_in:
        return Finding("compiled code", "not kept: each command compiles anew", compiler.KEEPING, needed=False)
    return Finding("compiled code", f"kept in {', '.join(map(str, sorted(compiler.kept_in)))}")


def _run() -> Finding:
    """lambda_c of one strip by the rod and by the elastica."""
    from stripfold import elastica
    from stripfold.ask.strip import Strip

    height = 0.09
    strip = Strip(length=0.6, eta_b=3780.0, eta_m=1e-5)
    rod = strip.critical(height=height, model="rod").lambda_c
    unit = strip.gravity_length
    expected = unit * elastica.critical(height / unit).advance
    if rod is None or abs(rod - expected) > AGREEMENT * unit:
        return Finding(
            "small run", f"lambda_c {rod} m by the rod, {expected:.5f} m by the elastica", "please report it"
        )
    return Finding("small run", f"lambda_c {rod:.4f} m, within {AGREEMENT:g} L* by two models")
