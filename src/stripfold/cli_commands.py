"""The commands: options from the input models, and the functions that run them.  Heavy imports wait until needed."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from stripfold.base.errors import MISSING, InvalidInputError, SolveError, TimeStepError
from stripfold.cli_messages import Say, logger
from stripfold.files.json_output import as_json, document

if TYPE_CHECKING:
    from stripfold.base.validation import Input
    from stripfold.files.reporting import Result
    from stripfold.paths import FoldPath

STRIP = ("length", "eta_b")
SHEET = ("eta_m", "nu")


def number(text: str, unit: str = "") -> float:
    """A number in a unit; without one it may be in per cent."""
    try:
        return float(text[:-1]) / 100.0 if text.endswith("%") and not unit else float(text)
    except ValueError:
        from stripfold.base.validation import number_meant

        said = f"{text!r} is not a number{f' in {unit}' if unit else ''}"
        raise argparse.ArgumentTypeError(": ".join(filter(None, (said, number_meant(text, unit))))) from None


metres = partial(number, unit="m")


def _option(parser: argparse._ActionsContainer, model: type[Input], name: str, **more: Any) -> None:
    """An option from the field of an input model: its help, unit, choices and default."""
    field = model.model_fields[name]
    extra = field.json_schema_extra
    unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
    kinds = [kind for kind in (field.annotation, *get_args(field.annotation)) if get_origin(kind) is Literal]
    text = f"{field.description}, {unit}" if unit else f"{field.description}"
    if field.is_required():
        more.setdefault("required", True)
    elif field.default is not None:
        default = field.default if isinstance(field.default, str) else f"{field.default:g}"
        more["default"], text = field.default, f"{text} [{default}]"
    if kinds:
        more["choices"] = get_args(kinds[0])
    elif field.annotation is not str and "metavar" not in more:
        more |= {"type": partial(number, unit=unit), "metavar": "M" if unit == "m" else "X"}
    parser.add_argument(f"--{name.replace('_', '-')}", help=text.replace("%", "%%"), **more)


def _options(parser: argparse.ArgumentParser, model: type[Input], names: Sequence[str]) -> None:
    for name in names:
        _option(parser, model, name)


def _given(arguments: argparse.Namespace, model: type[Input]) -> dict[str, Any]:
    """The options that were given for the fields of a model."""
    return {key: value for key, value in vars(arguments).items() if key in model.model_fields and value is not None}


INPUTS = ("grid", "scene", "result", "path", "image")
"""Arguments that name a file which a command reads."""


def _output(arguments: argparse.Namespace, option: str, suffix: str, source: str) -> Path:
    """Where to write: as given, or in the working folder under the name of the source."""
    given = getattr(arguments, option)
    path = Path(f"{Path(source).stem}{suffix}" if given is None else given)
    if path.suffix != suffix:
        raise InvalidInputError(option, given or "", f"a name that ends in {suffix}")
    return _writable(path, arguments, option)


def _asked_output(arguments: argparse.Namespace, option: str, suffix: str) -> Path | None:
    """Where to write, if that is given."""
    return None if getattr(arguments, option) is None else _output(arguments, option, suffix, "")


def _writable(path: Path, arguments: argparse.Namespace, option: str = "output") -> Path:
    """Refuse, by trying, what would only be found out when all is computed, and to replace what the command reads."""
    from stripfold.files.store import literal

    literal(path)
    if os.path.isdir(path):
        raise InvalidInputError(option, str(path), "a file, or nothing yet", "remove the folder")
    if not os.path.isdir(path.parent):
        raise InvalidInputError(option, str(path), "a path in an existing folder", f"make {path.parent} first")
    inputs = [getattr(arguments, name, None) for name in INPUTS]
    if path.exists() and any(name and os.path.exists(name) and path.samefile(name) for name in inputs):
        raise InvalidInputError(option, str(path), "another file than the input", "it would be replaced")
    try:
        with TemporaryDirectory(prefix=".stripfold-", dir=path.parent) as folder:
            (Path(folder) / path.name).touch()
    except OSError as error:
        raise InvalidInputError(option, str(path), "a file that can be written", error.strerror or "") from error
    return path


def _lines(rows: Sequence[tuple[str, str]]) -> str:
    # A name may have line ends.
    return "\n".join(f"{name:<12} " + text.replace("\n", "\\n") for name, text in rows)


def _said(result: Result, arguments: argparse.Namespace) -> str:
    return as_json(document(result.to_dict(), result.config())) if arguments.json else str(result)


def _json_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _plot_option(parser: argparse.ArgumentParser, what: str, name: str = "plot") -> None:
    parser.add_argument(f"--{name}", metavar="OUT.png", help=f"where to draw {what}")


def _plot_file(arguments: argparse.Namespace, option: str = "plot") -> Path | None:
    """Where to draw, if that is asked for, checked before anything is computed."""
    if getattr(arguments, option) is not None:
        from stripfold.base.extras import require

        require("plot")
    return _asked_output(arguments, option, ".png")


def _draw(result: Result | FoldPath, target: Path | None) -> None:
    if target is not None:
        from stripfold.draw.save import save_as

        save_as(result.plot(), target)


def critical_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import Scene

    _options(parser, Scene, (*STRIP, "height", *SHEET, "model", "accuracy", "eta_b_uncertainty"))
    _second_gripper_option(parser)
    _plot_option(parser, "the strip there")
    _json_option(parser)


def _second_gripper_option(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import Scene

    text = f"{Scene.model_fields['second_gripper'].description}, m"
    parser.add_argument("--second-gripper", type=place_or_auto, metavar="M|auto", help=text)


def place_or_auto(text: str) -> float | str:
    return text if text == "auto" else metres(text)


def critical(arguments: argparse.Namespace, say: Say) -> str:
    from stripfold.ask.inputs import Scene

    scene = Scene(**_given(arguments, Scene))
    scene.require_long_enough()
    target = _plot_file(arguments)
    from stripfold.ask.results import CriticalPoint

    found = CriticalPoint.of(scene, say)
    _draw(found, target)
    return _said(found, arguments)


def sweep_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("grid", metavar="GRID.yaml", help="values of length, height, eta_b ...: docs/sweep.md")
    parser.add_argument("--output", metavar="SWEEP.nc", help="where to write [the grid's name with .nc, here]")
    parser.add_argument("--cores", type=int, metavar="N", help="most processes at a time [one for each core]")
    _json_option(parser)


def sweep(arguments: argparse.Namespace, say: Say) -> str:
    from stripfold.base.validation import read_yaml

    grid = read_yaml(arguments.grid, "grid", "length: 0.6")
    target = _output(arguments, "output", ".nc", arguments.grid)
    from stripfold.ask.sweep import run

    found = run(grid, target, arguments.cores, say)
    snap, touch = found.lambda_c.notnull(), found.lambda_touch.notnull()
    counts = {"cases": int(found.reason.size), "snap": int(snap.sum()), "touch": int(touch.sum())}
    failed = found.reason.values[~(snap | touch).values]
    if arguments.json:
        return as_json(document({**counts, "no_result": int(failed.size), "written": str(target)}, dict(grid)))
    without = [("no result", f"{failed.size}, the first: {failed[0]}")] if failed.size else []
    return _lines([*((name, str(count)) for name, count in counts.items()), *without, ("written", str(target))])


def simulate_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.simulation import Simulation

    text = "the strip, the height, and how it is released (stripfold new scene); or the options of the strip"
    parser.add_argument("scene", nargs="?", metavar="SCENE.yaml", help=text)
    for name in (names := (*STRIP, "height", *SHEET, "model", "accuracy")):
        _option(parser, Simulation, name, required=False)
    # What is not given is the model's to fill in, and must not come with a scene.
    parser.set_defaults(**dict.fromkeys(names))
    text = "where to write [the scene's name, or collapse, with .nc, here]"
    parser.add_argument("--output", metavar="RESULT.nc", help=text)
    _plot_option(parser, "lambda over the deflection")
    _json_option(parser)


def simulate(arguments: argparse.Namespace, say: Say) -> str:
    from stripfold.ask.simulation import Simulation

    given, scene = _given(arguments, Simulation), arguments.scene
    if scene is None and not given:
        allowed = "SCENE.yaml, or --length, --eta-b and --height"
        raise InvalidInputError("scene", MISSING, allowed, "`stripfold new scene` prints one to start from")
    if scene is not None and given:
        key, value = next(iter(given.items()))
        raise InvalidInputError(key, value, "a scene, or options of the strip", f"leave it out, or put it into {scene}")
    simulation = Simulation(**given) if scene is None else Simulation.read(scene)
    # For the units of messages.
    arguments.eta_b, arguments.gravity = simulation.eta_b, simulation.gravity
    path, target = _output(arguments, "output", ".nc", scene or "collapse"), _plot_file(arguments)
    from stripfold.ask import collapse_record
    from stripfold.ask.results import StripCollapse
    from stripfold.files import store

    try:
        found = StripCollapse.of(simulation, say)
    except TimeStepError as error:
        rescue = path.with_suffix(".last-good.nc")
        state = collapse_record.last_good(simulation, error)
        store.write(state, rescue, title="last good state", config=simulation.as_config())
        raise SolveError(f"{error}; the last good state is in {rescue}") from error
    found.to_netcdf(path)
    _draw(found, target)
    for warning in found.warnings:
        logger.warning(warning)
    if arguments.json:
        return as_json(document({**found.to_dict(), "written": str(path)}, found.config()))
    return _lines([*found.rows(), ("written", str(path))])


def film_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("result", metavar="RESULT.nc", help="from stripfold simulate")
    parser.add_argument("--output", metavar="FILM.mp4", help="where to write [the result's name with .mp4, here]")
    _json_option(parser)


def film(arguments: argparse.Namespace, say: Say) -> str:
    from stripfold.base.extras import require
    from stripfold.files import store

    require("vision")
    path = _output(arguments, "output", ".mp4", arguments.result)
    from stripfold.draw.film import film

    film(store.read(arguments.result), path, progress=say)
    if arguments.json:
        return as_json(document({"written": str(path)}, {"result": arguments.result}))
    return _lines([("written", str(path))])


def new_options(parser: argparse.ArgumentParser) -> None:
    text = "scene: for simulate and record; recording: recording.yaml, for measure; grid: for sweep"
    parser.add_argument("kind", choices=("scene", "recording", "grid"), help=text)
    parser.add_argument("--output", metavar="FILE.yaml", help="write it there, a new file, instead of printing it")


def new(arguments: argparse.Namespace, say: Say) -> str:
    text = (Path(__file__).parent / "templates" / f"{arguments.kind}.yaml").read_text(encoding="utf-8")
    if arguments.output is None:
        return text.rstrip()
    path = _output(arguments, "output", ".yaml", "")
    if os.path.lexists(path):
        raise InvalidInputError("output", str(path), "a file that is not there yet", "remove it, or choose another")
    from stripfold.files.store import write_text

    write_text(text, path)
    return _lines([("written", str(path))])
