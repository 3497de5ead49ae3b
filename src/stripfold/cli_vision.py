"""The commands that measure in pictures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from stripfold.cli_common import as_json, metres, output_path, progress
from stripfold.errors import InvalidInputError

if TYPE_CHECKING:
    from stripfold.vision.eta import EtaB

METHODS = ("fold", "cantilever")


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command that measures a recording."""
    measure = commands.add_parser(
        "measure",
        help="lambda at the snap in a recording",
        description="Follow strip and gripper through a recording, find the snap, and say how sure that is.",
        allow_abbrev=False,
    )
    measure.add_argument(
        "folder", metavar="FOLDER", help="with recording.yaml, film and calibration: docs/measuring.md"
    )
    measure.add_argument("--json", action="store_true", help="print one JSON object")


def measure(arguments: argparse.Namespace) -> str:
    """``stripfold measure``: result/ in the recording's folder, and the numbers."""
    from stripfold import store
    from stripfold.vision import measure, recording, report, results

    asked = recording.read(arguments.folder)
    folder = asked.folder / "result"
    with progress() as say:
        found = measure.measure(asked, say)
        say("writing the report")
        page = report.html(found)
    data = results.as_dataset(found)
    title = f"measured: {asked.entries['title']}"
    store.write(data, folder / "measurement.nc", title=title, config=asked.entries)
    store.write_text(page, folder / "report.html")
    if arguments.json:
        return as_json(results.fields(found))
    lines = [("result", report.result(found)), *report.rows(found), *(("flag", flag) for flag in found.flags)]
    lines.append(("written", f"{folder / 'report.html'}, {folder / 'measurement.nc'}"))
    return "\n".join(f"{name:<30} {text}" for name, text in lines)


def add_to_eta(parser: argparse.ArgumentParser, given: argparse._MutuallyExclusiveGroup) -> None:
    """What ``stripfold eta`` needs to measure in a picture."""
    given.add_argument("--image", metavar="FILE", help="picture of the strip from the side, upright")
    parser.add_argument("--scale", type=float, metavar="M", help="metres per pixel of the picture")
    parser.add_argument("--method", choices=METHODS, help="what the picture shows: a folded strip or a hanging one")
    parser.add_argument("--picture", metavar="OUT.png", help="where to draw the fit over the picture")


def refuse_without_image(arguments: argparse.Namespace) -> None:
    """Options that only a picture has a use for are an error without one."""
    for name in ("scale", "method", "picture"):
        if (value := getattr(arguments, name)) is not None:
            raise InvalidInputError(name, value, "this only together with --image")


def eta(arguments: argparse.Namespace) -> str:
    """``stripfold eta --image``."""
    for name in ("scale", "method"):
        if getattr(arguments, name) is None:
            raise InvalidInputError(name, None, f"a value for --{name} with --image")
    # Where to write is checked before anything is measured.
    target = None if arguments.picture is None else output_path(arguments.picture, arguments.picture, ".png")
    from stripfold.vision.eta import from_image
    from stripfold.vision.pictures import read_grey

    image = read_grey(arguments.image)
    found = from_image(image, arguments.scale, arguments.method, Path(arguments.image).name)
    if target is not None:
        from stripfold.plots.save import save_as
        from stripfold.vision import eta_figure

        save_as(eta_figure.draw(image, found), target)
    return as_json(found.fields()) if arguments.json else _as_text(found)


def _as_text(found: EtaB) -> str:
    low, high = found.interval
    lines = [
        ("eta_b", f"{found.eta_b:.6g} m^-4 s^2"),
        ("  95 %", f"{low:.6g} to {high:.6g} m^-4 s^2, with the scale as given"),
        ("L*", f"{found.gravity_length:.6g} m"),
        ("residual", metres(found.residual, "root mean square of measured less fitted")),
    ]
    if found.fold is not None:
        lines.append(("height", metres(found.fold.height * found.scale, "of the loop, between the layers' middles")))
    if found.line is not None:
        lines.append(("length", metres(found.line.length * found.scale, "that hangs in the picture")))
    if (exponent := found.exponent) is not None:
        n, lower, upper = exponent
        text = "yes" if found.linear else "no: one eta_b does not describe it"
        lines.append(("linear", f"{text}; M ~ curvature^n with n = {n:.3g} ({lower:.3g} to {upper:.3g})"))
        ends = (found.secant(0.25), found.secant(1.0))
        text = "from a quarter of the largest curvature to all of it"
        lines.append(("  secant", f"eta_b {ends[0]:.6g} to {ends[1]:.6g} m^-4 s^2, {text}"))
    return "\n".join(f"{name:<12} {text}" for name, text in lines)
