"""The command line; more of it in :mod:`.cli_paths` and :mod:`.cli_record`.  Heavy imports wait until needed."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

from stripfold import __version__, cli_paths, cli_record, cli_vision
from stripfold.cli_common import as_json, metres, output_path, progress
from stripfold.errors import InvalidInputError, SolveError, StripfoldError, TimeStepError

if TYPE_CHECKING:
    from stripfold.analysis.critical_point import CriticalResult
    from stripfold.inputs import Scene


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0: done, also where there is no snap.  2: bad input.  3: a solve failed.  130: interrupted.
    """
    arguments = _parser().parse_args(argv)
    # The systems are small: threads inside BLAS gain nothing, and on a busy machine they wait for each other, up to
    # twenty times longer.  Heeded only by a numpy that is not imported yet.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    try:
        commands = {
            "critical": _critical,
            "eta": _eta,
            "simulate": _simulate,
            "film": _film,
            "path": cli_paths.path,
            "assess": cli_paths.assess,
            "record": cli_record.record,
            "measure": cli_vision.measure,
        }
        command = commands[arguments.command]
        print(command(arguments))
    except StripfoldError as error:
        print(f"stripfold: error: {' '.join(str(error).split())}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("stripfold: interrupted", file=sys.stderr)
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="stripfold",
        description="Static stability of fabric strip folding. All numbers in SI units.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="command")

    critical = commands.add_parser(
        "critical",
        help="where a strip snaps when its gripper advances at constant height",
        description="Where a strip that lies flat, is lifted at one end and then drawn over itself, snaps through.",
        allow_abbrev=False,
    )
    number = critical.add_argument
    number("--length", type=float, required=True, metavar="M", help="length of the strip, m")
    number("--eta-b", type=float, required=True, metavar="X", help="weight-to-bending-stiffness ratio, m^-4 s^2")
    number("--height", type=float, required=True, metavar="M", help="height of the gripper, m")
    number("--eta-m", type=float, default=1e-3, metavar="X", help="weight-to-membrane-stiffness ratio, m^-2 s^2 [1e-3]")
    number("--nu", type=float, default=0.0, metavar="X", help="Poisson's ratio [0]")
    number(
        "--model",
        choices=("solid", "rod", "elastica", "auto"),
        default="solid",
        help="the paper's finite elements, a rod (several times as fast), the thin limit, or the cheapest of them that "
        "is within the accuracy of the first [solid]",
    )
    number("--accuracy", type=float, default=1e-3, metavar="X", help="wanted relative accuracy of lambda_c [1e-3]")
    critical.add_argument("--json", action="store_true", help="print one JSON object")

    eta = commands.add_parser(
        "eta",
        help="eta_b from the height of a folded strip, or from a picture",
        description="The weight-to-bending-stiffness ratio from the height of the loop of a strip folded in half, or"
        " from a picture of such a loop or of a strip that hangs out of a clamp.",
        allow_abbrev=False,
    )
    given = eta.add_mutually_exclusive_group(required=True)
    given.add_argument("--fold-height", type=float, metavar="M", help="largest height of the loop, m")
    cli_vision.add_to_eta(eta, given)
    eta.add_argument("--json", action="store_true", help="print one JSON object")

    simulate = commands.add_parser(
        "simulate",
        help="one strip through its collapse: statics, fall, statics again",
        description="Move a strip's gripper to the critical point, let the strip fall to rest, and move on.",
        allow_abbrev=False,
    )
    simulate.add_argument("scene", metavar="SCENE.yaml", help="the strip, the height, how it is let go")
    simulate.add_argument("--output", metavar="RESULT.nc", help="where to write [the scene's name with .nc, here]")

    film = commands.add_parser(
        "film",
        help="a film of a simulated collapse",
        description="Draw what `stripfold simulate` stored as an MP4 film.",
        allow_abbrev=False,
    )
    film.add_argument("result", metavar="RESULT.nc", help="from stripfold simulate")
    film.add_argument("--output", metavar="FILM.mp4", help="where to write [the result's name with .mp4, here]")
    cli_paths.add_to(commands)
    cli_record.add_to(commands)
    cli_vision.add_to(commands)
    return parser


def _critical(arguments: argparse.Namespace) -> str:
    from stripfold.analysis.critical_point import find
    from stripfold.inputs import Scene

    keys = ("length", "height", "eta_b", "eta_m", "nu", "model", "accuracy")
    scene = Scene(**{key: getattr(arguments, key) for key in keys})
    scene.require_long_enough()
    with progress() as say:
        result = find(scene, say)
    return as_json(_fields(result)) if arguments.json else _as_text(scene, result)


def _fields(result: CriticalResult) -> dict[str, Any]:
    names = ("lambda_c", "x_c", "error", "free_length", "snap", "reason", "seconds")
    more = ("lambda_c_lower", "lambda_c_upper", "lambda_0", "model", "model_error")
    return {name: getattr(result, name) for name in names + more}


def _as_text(scene: Scene, result: CriticalResult) -> str:
    star = scene.material.gravity_length
    lines = [
        (
            "model",
            f"{result.model}; L* = {star:.5g} m, length {scene.length_star:.4g} L*, height {scene.height_star:.4g} L*",
        ),
        ("snap", f"{'yes' if result.snap else 'no'}: {result.reason}"),
        ("lambda_0", metres(result.lambda_0, "advance of the gripper without horizontal force")),
        ("lambda_c", metres(result.lambda_c, "advance past the flat end at the snap")),
        ("  between", f"{result.lambda_c_lower:.9f} and {result.lambda_c_upper:.9f} m" if result.snap else "-"),
        ("  error", metres(result.error, "estimated, of mesh and bracket")),
        ("  model", metres(result.model_error, "estimated distance from the solid's lambda_c")),
        ("x_c", metres(result.x_c, "gripper in the frame with its origin mid-strip")),
        ("free length", metres(result.free_length, "off the floor where the advance ends")),
        ("time", f"{result.seconds:.2f} s"),
    ]
    return "\n".join(f"{name:<12} {text}" for name, text in lines)


def _eta(arguments: argparse.Namespace) -> str:
    from stripfold import elastica
    from stripfold.inputs import ETA_B
    from stripfold.material import Material

    if arguments.image is not None:
        return cli_vision.eta(arguments)
    cli_vision.refuse_without_image(arguments)
    height, unit_height = arguments.fold_height, elastica.folded_loop().height
    # From the limits of eta_b: they also catch a height in millimetres.
    highest, lowest = (unit_height * Material(eta_b).gravity_length for eta_b in ETA_B)
    if not lowest <= height <= highest:
        raise InvalidInputError("fold_height", height, f"from {lowest:.3g} to {highest:.3g} m", "the unit is m")
    eta_b = elastica.eta_b_from_fold_height(height)
    values = {"eta_b": eta_b, "gravity_length": Material(eta_b).gravity_length}
    if arguments.json:
        return as_json(values)
    return f"eta_b        {eta_b:.6g} m^-4 s^2\nL*           {values['gravity_length']:.6g} m"


def _simulate(arguments: argparse.Namespace) -> str:
    from stripfold import store
    from stripfold.analysis import collapse_data
    from stripfold.inputs import Simulation

    asked = Simulation.read(arguments.scene)
    path = output_path(arguments.output, arguments.scene, ".nc")
    try:
        with progress() as say:
            data = collapse_data.run(asked, say)
    except TimeStepError as error:
        rescue = path.with_suffix(".last-good.nc")
        store.write(collapse_data.last_good(asked, error), rescue, title="last good state", config=asked.as_config())
        raise SolveError(f"{error}; the last good state is in {rescue}") from error
    store.write(data, path, title="a strip through its collapse", config=asked.as_config())
    attrs = data.attrs
    for name in filter(None, attrs["missing"].split(", ")):
        reason = data["reason"].sel(effect=name).item()
        print(f"stripfold: warning: {name} is off and needed: {reason}", file=sys.stderr)
    touched = isfinite(attrs["touch_time"])
    lines = [
        ("lambda_c", metres(attrs["lambda_c"], "advance of the gripper past the flat end at the snap")),
        ("touch", f"after {attrs['touch_time']:.4g} s at x = {attrs['touch_x']:.4g} m" if touched else "-"),
        ("rest", f"after {attrs['settle_time']:.4g} s" if isfinite(attrs["settle_time"]) else "-"),
        ("effects", ", ".join(str(name) for name in data["effect"].values[data["active"].values == 1.0])),
        ("end", attrs["end"]),
        ("written", str(path)),
    ]
    return "\n".join(f"{name:<12} {text}" for name, text in lines)


def _film(arguments: argparse.Namespace) -> str:
    from stripfold import store
    from stripfold.plots.film import film

    path = output_path(arguments.output, arguments.result, ".mp4")
    data = store.read(arguments.result)
    with progress() as say:
        film(data, path, progress=say)
    return f"written      {path}"
