"""The commands that measure in pictures and recordings, or make these."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stripfold.base.errors import InvalidInputError, require
from stripfold.cli_commands import command, draw, given, lines, metres, number, options, plot_option, writable
from stripfold.cli_messages import Say, write
from stripfold.files.reporting import as_json, document

if TYPE_CHECKING:
    from stripfold.film.eta import EtaB


def eta_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.film.request import EtaRequest

    source = parser.add_mutually_exclusive_group(required=True)
    options(source, EtaRequest, ("fold_height",))
    options(source, EtaRequest, ("image",), metavar="FILE", nargs="+")
    options(source, EtaRequest, ("loop", "bending_length", "rigidity", "kes_b"))
    options(parser, EtaRequest, ("ruler",), metavar="X1,Y1,X2,Y2,M")
    options(parser, EtaRequest, ("scale", "method", "slope", "tilt", "roll", "depth", "width"))
    options(parser, EtaRequest, ("length", "height", "gsm", "kes_2hb"))
    plot_option(parser, "the fit over the picture", "picture")


@command("eta_b from the height of a fold or a hanging loop, from a picture, or from a bending test", eta_options)
def eta(arguments: argparse.Namespace, say: Say) -> str:
    """Measure the weight-to-bending-stiffness ratio from the height of a fold or of a hanging loop, from a bending
    test, or from a picture of a folded strip, of one that hangs out of a clamp, or of one that hangs as a loop."""
    from stripfold.film.request import EtaRequest

    inputs = given(arguments, EtaRequest)
    images = inputs.pop("image", [None])
    asked = [EtaRequest(**inputs, image=image) for image in images]
    if arguments.picture is not None and (images[0] is None or len(images) > 1):
        raise InvalidInputError("picture", str(arguments.picture), "this only together with one image")
    from stripfold.film.eta import EtaB

    found = [EtaB.of(one) for one in asked]
    if len(found) > 1:
        return _several(images, found, inputs | {"image": images}, arguments.json)
    draw(found[0], arguments.picture)
    given_image = {} if images[0] is None else {"image": images[0]}
    return as_json(document(found[0].to_dict(), inputs | given_image)) if arguments.json else str(found[0])


def _several(images: Sequence[str], found: Sequence[EtaB], inputs: dict[str, Any], in_json: bool) -> str:
    """What several pictures of one cloth say, each and together."""
    from stripfold.film.eta import together

    eta_b, (low, high), scatter = together(found)
    if in_json:
        numbers = {"eta_b": eta_b, "eta_b_lower": low, "eta_b_upper": high, "scatter": scatter}
        pictures = [{"image": image} | one.to_dict() for image, one in zip(images, found, strict=True)]
        return as_json(document(numbers | {"pictures": pictures}, inputs))
    each = [
        (Path(image).name, f"{one.eta_b:.6g} m^-4 s^2, 95 % {one.interval[0]:.6g} to {one.interval[1]:.6g}")
        for image, one in zip(images, found, strict=True)
    ]
    said = f"{low:.6g} to {high:.6g} m^-4 s^2; the pictures scatter by {scatter:.1%}"
    return lines([*each, ("eta_b", f"{eta_b:.6g} m^-4 s^2"), ("  95 %", said)])


def plate_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--paper", choices=("a4", "letter"), default="a4", help="size of the sheet [a4]")
    parser.add_argument("--output", metavar="PLATE.pdf", help="where to write it [plate.pdf, here]")


@command("plate to print, by which films and photographs are measured", plate_options, named_after=("plate",))
def plate(arguments: argparse.Namespace, say: Say) -> str:
    """Write a sheet with the plates for films and photographs, and markers for the gripper, to be printed at 100 %."""
    require("vision")
    from stripfold.draw.save import save_as
    from stripfold.film.plate_sheet import sheet

    save_as(sheet(arguments.paper), arguments.output)
    written = {"written": str(arguments.output)}
    return as_json(document(written, {"paper": arguments.paper})) if arguments.json else lines([*written.items()])


def record_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", metavar="SCENE.yaml", help="strip, gripper, filming, and the source of the motion")
    parser.add_argument("--output", metavar="FOLDER", help="where to write [the scene's name, here]")


@command("synthetic recording: film, calibration, log and truth", record_options)
def record(arguments: argparse.Namespace, say: Say) -> str:
    """Render a strip's motion as a camera would film it, with the calibration of that camera."""
    from stripfold.synthetic import recording, scene

    asked = scene.read(arguments.scene)
    folder = Path(arguments.output or Path(arguments.scene).stem)
    if folder.exists():
        raise InvalidInputError("output", str(folder), "a folder that is not there yet", "remove it, or choose another")
    writable(folder, arguments)
    say("motion")
    history = recording.history_of(asked)
    recording.write_recording(history, asked, folder, progress=say)
    critical = history.lambda_c
    if arguments.json:
        numbers = {"lambda_c": critical, "duration": float(history.t[-1]), "written": str(folder)}
        return as_json(document(numbers, asked.as_config()))
    rows = [("written", f"{folder} (synthetic)"), ("length", f"{history.t[-1]:.4g} s")]
    if not isinstance(asked.motion, scene.DynamicsMotion):
        return lines([*rows, ("lambda_c", f"{critical:.6g} m  (static, of the drawn motion, which has no mechanics)")])
    from stripfold import elastica

    unit, friction = asked.gravity_length, f"with friction, M_0 = {asked.motion.friction_moment_star:g} rho_a g L*^2"
    without = elastica.critical(asked.height / unit).advance * unit
    return lines(
        [
            *rows,
            ("lambda_c", f"{critical:.6g} m  (static, {friction})"),
            ("  without", f"{without:.6g} m  (static, without friction: the model's lambda_c that measure prints)"),
        ]
    )


def calibrate_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("images", metavar="IMAGES", help="folder of pictures of the board")
    parser.add_argument("--board", required=True, choices=("chessboard", "charuco"), help="kind of the board")
    for name in ("columns", "rows"):
        text = "inner corners of a chessboard, squares of a ChArUco board"
        parser.add_argument(f"--{name}", required=True, type=int, metavar="N", help=text)
    parser.add_argument("--square", required=True, type=metres, metavar="M", help="side of a square, m")
    parser.add_argument("--marker", type=metres, metavar="M", help="side of a marker of a ChArUco board, m")
    parser.add_argument("--dictionary", metavar="NAME", help="of a ChArUco board's markers, for example 4x4_50")
    parser.add_argument("--output", metavar="FILE.yaml", help="where to write it if it is accepted [camera.yaml, here]")


@command("calibration of a camera from pictures of a board", calibrate_options, named_after=("camera",))
def calibrate(arguments: argparse.Namespace, say: Say) -> str:
    """Calibrate a camera, report each picture and the quality, and accept or refuse it."""
    require("vision")
    from stripfold.base.errors import CalibrationError
    from stripfold.film import camera_check
    from stripfold.film.boards import Board

    asked = {name: getattr(arguments, name) for name in ("columns", "rows", "square", "marker", "dictionary")}
    board = Board.of({"type": arguments.board} | {name: value for name, value in asked.items() if value is not None})
    say("calibrating")
    found = camera_check.check(Path(arguments.images), board)
    inputs = {"images": arguments.images, "board": arguments.board, **asked}
    said = as_json(document(found.to_dict(), inputs)) if arguments.json else lines(found.rows())
    try:
        found.write(arguments.output)
    except CalibrationError:
        # It says what each picture shows, the error why they do not suffice.
        write(said)
        raise
    return said if arguments.json else f"{said}\n{'written':<12} {arguments.output}"


def measure_options(parser: argparse.ArgumentParser) -> None:
    text = "a film with the plate in view, or a folder with recording.yaml, film and calibration: docs/measuring.md"
    parser.add_argument("recording", metavar="FILM|FOLDER", help=text)
    parser.add_argument("--length", type=metres, metavar="M", help="of the strip in a film, m")
    parser.add_argument("--eta-b", type=number, metavar="X", help="of that strip, m^-4 s^2, if known")
    parser.add_argument("--width", type=metres, metavar="M", help="of that strip, m, if known")
    parser.add_argument("--camera", metavar="FILE", help="of that film, by stripfold calibrate [a usual phone's]")
    text = "of the ten squares of that film's plate, by a ruler, m [0.24]"
    parser.add_argument("--plate-width", type=metres, metavar="M", help=text)


@command("lambda at the snap in a recording", measure_options)
def measure(arguments: argparse.Namespace, say: Say) -> str:
    """Follow strip and gripper through a recording, find the snap, and estimate its uncertainty."""
    require("vision")
    from stripfold.files import store
    from stripfold.film import measure as film
    from stripfold.film.recording import inside

    asked = Path(arguments.recording)
    folder = Path(f"{asked.stem}-result") if asked.is_file() else inside(asked, "result", "output")
    if os.path.exists(folder) and not folder.is_dir():
        raise InvalidInputError("output", str(folder), "a folder, or nothing yet", "remove the file")
    data, page = folder / "measurement.nc", folder / "report.html"
    for path in (data, page) if folder.is_dir() else (folder,):
        # A recording that is not there has an error of its own.
        if path.parent.is_dir():
            writable(path, arguments)
    known = {name: getattr(arguments, name) for name in ("length", "eta_b", "width", "camera", "plate_width")}
    found = film.measure(arguments.recording, **known, progress=say)
    say("writing the report")
    # Both or none.
    with store.atomic(data) as new_data, store.atomic(page) as new_page:
        found.to_netcdf(new_data)
        found.report(new_page)
    if arguments.json:
        inputs = {name: value for name, value in known.items() if value is not None}
        return as_json(document(found.to_dict(), {"recording": arguments.recording} | inputs))
    return f"{found}\n{'written':<36} {page}, {data}"
