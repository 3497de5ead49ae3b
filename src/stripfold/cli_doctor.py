"""``stripfold doctor``: what is installed, what is missing, and a small run of two models against each other."""

from __future__ import annotations

import argparse
import os
import platform
from collections.abc import Iterator
from importlib import metadata
from typing import Any, NamedTuple

import stripfold
from stripfold.cli_messages import Say
from stripfold.errors import StripfoldError
from stripfold.extras import MODULES
from stripfold.json_output import as_json

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


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def doctor(arguments: argparse.Namespace, say: Say) -> tuple[str, int]:
    """The findings, and 2 as the exit code where something is wrong that every command needs."""
    found = []
    for finding in _findings():
        say(finding.name)
        found.append(finding)
    code = 2 if any(finding.fault and finding.needed for finding in found) else 0
    if arguments.json:
        return as_json({finding.name: {"state": finding.state, "fault": finding.fault} for finding in found}), code
    rows = [f"{f.name:<16} {f.state}" + (f"; {f.fault}" if f.fault else "") for f in found]
    verdict = "something is missing that every command needs" if code else "all that every command needs is there"
    return "\n".join([*rows, verdict]), code


def _findings() -> Iterator[Finding]:
    yield Finding("stripfold", stripfold.__version__)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    yield Finding("python", f"{platform.python_version()}, {platform.system()} {platform.machine()}, {cores} cores")
    yield from _packages()
    for extra, modules in MODULES.items():
        yield _extra(extra, modules)
    yield _compiled()
    yield _run()


def _packages() -> Iterator[Finding]:
    """Required packages with their versions, against the bounds that the installed package declares."""
    from packaging.requirements import Requirement

    for text in metadata.requires("stripfold") or []:
        required = Requirement(text)
        if required.marker is not None:
            continue
        try:
            version = metadata.version(required.name)
        except metadata.PackageNotFoundError:
            yield Finding(required.name, "missing", f'pip install "{required}"')
            continue
        fits = required.specifier.contains(version, prereleases=True)
        yield Finding(required.name, version, "" if fits else f'too old: pip install "{required}"')


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


def _codec(av: Any, name: str, mode: str) -> bool:
    try:
        av.codec.Codec(name, mode)
    except ValueError:
        return False
    return True


def _compiled() -> Finding:
    """Whether compiled code can be kept: otherwise each command compiles it first."""
    from stripfold.kernels import band

    kernel: Any = band.factorise
    folder = getattr(kernel._cache, "cache_path", None)
    if folder is None:
        advice = "each command compiles anew: set NUMBA_CACHE_DIR to a folder that can be written"
        return Finding("compiled code", "not kept", advice, needed=False)
    return Finding("compiled code", f"kept in {folder}")


def _run() -> Finding:
    """lambda_c of one strip by the rod and by the elastica."""
    from stripfold import elastica
    from stripfold.strip import Strip

    height = 0.09
    try:
        strip = Strip(length=0.6, eta_b=3780.0, eta_m=1e-5)
        rod = strip.critical(height=height, model="rod").lambda_c
        unit = strip.gravity_length
        expected = unit * elastica.critical(height / unit).advance
    except StripfoldError as error:
        return Finding("small run", "failed", f"{error}; please report it")
    if rod is None or abs(rod - expected) > AGREEMENT * unit:
        return Finding(
            "small run", f"lambda_c {rod} m by the rod, {expected:.5f} m by the elastica", "please report it"
        )
    return Finding("small run", f"lambda_c {rod:.4f} m, within {AGREEMENT:g} L* by two models")
