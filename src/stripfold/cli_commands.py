"""The commands: options from the input models, and the functions that run them.  Heavy imports wait until needed."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Sequence
from functools import partial
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar, get_args, get_origin

from stripfold.base.errors import MISSING, InvalidInputError, SolveError, TimeStepError, require
from stripfold.cli_messages import Say, logger
from stripfold.files.reporting import as_json, document

if TYPE_CHECKING:
    from stripfold.ask.inputs import Strip
    from stripfold.base.validation import Input
    from stripfold.files.reporting import Result
    from stripfold.paths import FoldPath

    M = TypeVar("M", bound=Input)

STRIP = ("length", "eta_b")
SHEET = ("eta_m", "nu")
EXTRAS = {".png": "plot", ".html": "plot", ".mp4": "vision", ".pdf": "vision"}
"""Optional part of the package that makes a file, by the end of its name."""
INPUTS = ("grid", "scene", "result", "path", "image", "bending_test")
"""Arguments that name a file which a command reads."""
LOG = ("columns", "unit", "frame", "smooth")
"""Options of a path as a robot writes it."""
TOO_LOW, TOO_HIGH = 0.44, 0.02
"""Distance of the first touch on an R-path from the planned one where the plan's eta_b is 5 % too low and too high, L*:
a strip without friction, study disturbed_rpath (docs/physics.md, section 9)."""


class Command(NamedTuple):
    """A sub-command: a line on what it does, its options, and the function that does it, whose docstring describes it.

    The function returns what is printed, and an exit code where that is part of the result.  ``named_after`` is that of
    :func:`check_outputs`; ``json``: whether it has the common ``--json``.
    """

    help: str
    options: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace, Say], str | tuple[str, int]]
    named_after: Sequence[str]
    json: bool


COMMANDS: dict[str, Command] = {}
R = TypeVar("R", str, tuple[str, int])


def command(
    text: str, options: Callable[[argparse.ArgumentParser], None], named_after: Sequence[str] = (), json: bool = True
) -> Callable[[Callable[[argparse.Namespace, Say], R]], Callable[[argparse.Namespace, Say], R]]:
    """Make a function a command of its name."""

    def register(run: Callable[[argparse.Namespace, Say], R]) -> Callable[[argparse.Namespace, Say], R]:
        COMMANDS[run.__name__.rstrip("_")] = Command(text, options, run, named_after, json)
        return run

    return register


# -- options


def number(text: str, unit: str = "") -> float:
    """Read a number in a unit; without one it may be in per cent."""
    try:
        return float(text[:-1]) / 100.0 if text.endswith("%") and not unit else float(text)
    except ValueError:
        from stripfold.base.validation import number_meant

        said = f"{text!r} is not a number{f' in {unit}' if unit else ''}"
        raise argparse.ArgumentTypeError(": ".join(filter(None, (said, number_meant(text, unit))))) from None


metres = partial(number, unit="m")


def number_or(word: str, text: str, unit: str) -> float | str:
    """Read a number in a unit, or a word."""
    try:
        return text if text == word else number(text, unit)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{error}, or {word}") from None


def options(parser: argparse._ActionsContainer, model: type[Input], names: Sequence[str], **more: Any) -> None:
    """Add options from fields of an input model: help, unit, choices and default; ``more``: other settings of them."""
    from stripfold.base.validation import Text

    for name in names:
        field, settings = model.model_fields[name], dict(more)
        extra = field.json_schema_extra
        unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
        kinds = [field.annotation, *get_args(field.annotation)]
        choices = next((get_args(kind) for kind in kinds if get_origin(kind) is Literal), ())
        text = f"{field.description}, {unit}" if unit else f"{field.description}"
        if field.annotation is bool:
            settings["action"] = "store_true"
        elif field.is_required():
            settings.setdefault("required", True)
        elif field.default is not None:
            default = field.default if isinstance(field.default, str) else f"{field.default:g}"
            settings["default"], text = field.default, f"{text} [{default}]"
        letter = "M" if unit == "m" else "X"
        if len(choices) == 1:
            settings |= {"type": partial(number_or, choices[0], unit=unit), "metavar": f"{letter}|{choices[0]}"}
        elif choices:
            settings["choices"] = choices
        elif Text in kinds:
            settings.setdefault("metavar", "TABLE.csv")
        elif field.annotation is not bool and "metavar" not in settings:
            settings |= {"type": partial(number, unit=unit), "metavar": letter}
        parser.add_argument(f"--{name.replace('_', '-')}", help=text.replace("%", "%%"), **settings)


def given(arguments: argparse.Namespace, model: type[Input]) -> dict[str, Any]:
    """Return the options that were given for the fields of a model."""
    return {key: value for key, value in vars(arguments).items() if key in model.model_fields and value is not None}


def _asked(arguments: argparse.Namespace, model: type[M], **more: Any) -> M:
    return model(**given(arguments, model), **more)


# -- files that are written, and what is printed


def check_outputs(arguments: argparse.Namespace, parser: argparse.ArgumentParser, named_after: Sequence[str]) -> None:
    """Check up front that the output files can be written, and put their paths in the place of their names.

    They are those of the options whose example of a value has an ending.  ``named_after``: without ``--output`` it is
    called, in the working folder, after the file of the first of these arguments that is given, or else has this name.
    """
    for action in parser._actions:
        name, suffix = action.dest, Path(action.metavar if isinstance(action.metavar, str) else "").suffix
        if not suffix or not action.option_strings or name in INPUTS:
            continue
        said = getattr(arguments, name)
        if named_after and name == "output" and said is None:
            sources = (getattr(arguments, name, None) for name in named_after)
            said = f"{Path(next(filter(None, sources), named_after[-1])).stem}{suffix}"
        if not isinstance(said, str):  # not given, or to be printed
            continue
        if suffix in EXTRAS:
            require(EXTRAS[suffix])
        if Path(said).suffix != suffix:
            raise InvalidInputError(name, getattr(arguments, name) or "", f"a name that ends in {suffix}")
        setattr(arguments, name, writable(Path(said), arguments, name))


def writable(path: Path, arguments: argparse.Namespace, name: str = "output") -> Path:
    """Check by trying that a file can be written, and that it does not replace what the command reads."""
    from stripfold.files.store import literal

    literal(path)
    if os.path.isdir(path):
        raise InvalidInputError(name, str(path), "a file, or nothing yet", "remove the folder")
    if not os.path.isdir(path.parent):
        raise InvalidInputError(name, str(path), "a path in an existing folder", f"make {path.parent} first")
    named = [getattr(arguments, key, None) for key in INPUTS]
    inputs = [file for one in named for file in (one if isinstance(one, list) else [one]) if file]
    if path.exists() and any(os.path.exists(file) and path.samefile(file) for file in inputs):
        raise InvalidInputError(name, str(path), "another file than the input", "it would be replaced")
    try:
        with TemporaryDirectory(prefix=".stripfold-", dir=path.parent) as folder:
            (Path(folder) / path.name).touch()
    except OSError as error:
        raise InvalidInputError(name, str(path), "a file that can be written", error.strerror or "") from error
    return path


def lines(rows: Sequence[tuple[str, str]]) -> str:
    """Return names and values as lines; a name of a file may have line ends."""
    return "\n".join(f"{name:<12} " + text.replace("\n", "\\n") for name, text in rows)


def draw(found: Any, target: Path | None) -> None:
    """Draw a result or a path, if that is asked for."""
    if target is not None:
        from stripfold.draw.save import save_as

        save_as(found.plot(), target)


def answer(found: Result, arguments: argparse.Namespace) -> str:
    """Write and draw a result as asked for, and return what is printed."""
    if getattr(arguments, "output", None) is not None:
        found.to_netcdf(arguments.output)
    draw(found, arguments.plot)
    return as_json(document(found.to_dict(), found.config())) if arguments.json else str(found)


def plot_option(parser: argparse.ArgumentParser, what: str, name: str = "plot") -> None:
    """Add the option that draws."""
    parser.add_argument(f"--{name}", metavar="OUT.png", help=f"where to draw {what}")


# -- commands


def critical_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import Scene

    names = (*STRIP, "height", *SHEET, "model", "accuracy", "eta_b_uncertainty", "second_gripper", "clamp", "curl")
    options(parser, Scene, names)
    plot_option(parser, "the strip there")


@command("critical point of a strip whose gripper advances at constant height", critical_options)
def critical(arguments: argparse.Namespace, say: Say) -> str:
    """Find where a strip snaps through that lies flat, is lifted at one end and is then drawn over itself."""
    from stripfold.ask.inputs import Scene

    scene = _asked(arguments, Scene)
    from stripfold.ask.critical import find

    return answer(find(scene, say), arguments)


def sweep_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("grid", metavar="GRID.yaml", help="values of length, height, eta_b ...: docs/sweep.md")
    parser.add_argument("--output", metavar="SWEEP.nc", help="where to write [the grid's name with .nc, here]")
    _cores_option(parser)


def _cores_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--cores", type=int, metavar="N", help="most processes at a time [one for each core]")


@command("a question asked of a grid of strips, on all cores", sweep_options, named_after=("grid",))
def sweep(arguments: argparse.Namespace, say: Say) -> str:
    """Find critical points, assess paths or plan for all combinations of values, or for samples; a sweep that was
    interrupted goes on."""
    from stripfold.base.validation import read_yaml

    grid = read_yaml(arguments.grid, "grid", "length: 0.6")
    import numpy as np

    from stripfold.ask.sweep import question_of, run

    found = run(grid, arguments.output, arguments.cores, say)
    known = {what: found[name].notnull().values for what, name in question_of(grid).counted.items()}
    counts = {"cases": int(found.reason.size)} | {what: int(of.sum()) for what, of in known.items()}
    failed, file = found.reason.values[~np.any(list(known.values()), axis=0)], str(arguments.output)
    if arguments.json:
        return as_json(document({**counts, "no_result": int(failed.size), "written": file}, dict(grid)))
    without = [("no result", f"{failed.size}, the first: {failed[0]}")] if failed.size else []
    return lines([*((name, str(count)) for name, count in counts.items()), *without, ("written", file)])


def simulate_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import Simulation

    text = "the strip, the height, and how it is released (stripfold new scene); or the options of the strip"
    parser.add_argument("scene", nargs="?", metavar="SCENE.yaml", help=text)
    names = (*STRIP, "height", *SHEET, "model", "friction_moment", "clamp", "curl", "accuracy")
    options(parser, Simulation, names, required=False)
    # What is not given is the model's to fill in, and must not come with a scene.
    parser.set_defaults(**dict.fromkeys(names))
    text = "where to write [the scene's name, or collapse, with .nc, here]"
    parser.add_argument("--output", metavar="RESULT.nc", help=text)
    plot_option(parser, "lambda over the deflection")


@command("simulation of a collapse: statics, fall, statics again", simulate_options, named_after=("scene", "collapse"))
def simulate(arguments: argparse.Namespace, say: Say) -> str:
    """Move a strip's gripper to the critical point, let the strip fall to rest, and move on."""
    from stripfold.ask.inputs import Simulation

    options_given, scene = given(arguments, Simulation), arguments.scene
    if scene is None and not options_given:
        allowed = "SCENE.yaml, or --length, --eta-b and --height"
        raise InvalidInputError("scene", MISSING, allowed, "`stripfold new scene` prints one to start from")
    if scene is not None and options_given:
        key, value = next(iter(options_given.items()))
        raise InvalidInputError(key, value, "a scene, or options of the strip", f"leave it out, or put it into {scene}")
    simulation = Simulation(**options_given) if scene is None else Simulation.read(scene)
    # For the units of messages.
    arguments.eta_b, arguments.gravity = simulation.eta_b, simulation.gravity
    from stripfold.ask.collapse import StripCollapse, last_good
    from stripfold.files import store

    try:
        found = StripCollapse.of(simulation, say)
    except TimeStepError as error:
        rescue = arguments.output.with_suffix(".last-good.nc")
        state = last_good(simulation, error)
        store.write(state, rescue, title="last good state", config=simulation.as_config())
        raise SolveError(f"{error}; the last good state is in {rescue}") from error
    for warning in found.warnings:
        logger.warning(warning)
    said, file = answer(found, arguments), str(arguments.output)
    if arguments.json:
        return as_json(document({**found.to_dict(), "written": file}, found.config()))
    return f"{said}\n{lines([('written', file)])}"


def film_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("result", metavar="RESULT.nc", help="from stripfold simulate")
    parser.add_argument("--output", metavar="FILM.mp4", help="where to write [the result's name with .mp4, here]")


@command("film of a simulated collapse", film_options, named_after=("result",))
def film(arguments: argparse.Namespace, say: Say) -> str:
    """Draw the result of `stripfold simulate` as an MP4 film."""
    from stripfold.draw.film import film
    from stripfold.files import store

    film(store.read(arguments.result), arguments.output, progress=say)
    written = {"written": str(arguments.output)}
    return as_json(document(written, {"result": arguments.result})) if arguments.json else lines([*written.items()])


def _fold_option(parser: argparse.ArgumentParser) -> None:
    text = "distance of the fold line from the gripped end, m [half the length]"
    parser.add_argument("--fold-at", type=metres, metavar="M", help=text)


def path_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import Strip

    parser.add_argument("kind", choices=("r-path", "triangular", "circular", "low"), help="which path")
    options(parser, Strip, STRIP)
    parser.add_argument("--height", type=metres, metavar="M", help="of the gripper on the low path, m")
    _fold_option(parser)
    parser.add_argument("--csv", metavar="FILE.csv", help="write it there instead of printing it")
    plot_option(parser, "the path")


@command("gripper path of a half fold", path_options)
def path(arguments: argparse.Namespace, say: Say) -> str:
    """Plan a folding path and print it as t,x,z: pseudo time, metres, origin mid-strip on the floor."""
    from stripfold.ask.inputs import UNSTRETCHED, Strip
    from stripfold.paths import PLANS, low

    # A path is planned for a strip that hardly stretches: this command has no eta_m.
    strip, height = _asked(arguments, Strip, eta_m=UNSTRETCHED), arguments.height
    if (arguments.kind == "low") != (height is not None):
        raise InvalidInputError("height", MISSING if height is None else height, "a height with the low path only")
    fold_at = arguments.fold_at
    planned = PLANS[arguments.kind](strip, fold_at) if height is None else low(strip, height, fold_at)
    if arguments.kind == "r-path":
        logger.info(safe_side(strip.gravity_length))
    draw(planned, arguments.plot)
    if arguments.csv is not None:
        planned.to_csv(arguments.csv)
    if arguments.json:
        return as_json(document(planned.to_dict(), {**given(arguments, Strip), "fold_at": fold_at}))
    if arguments.csv is None:
        return planned.as_text().rstrip()
    return lines([("written", f"{arguments.csv}, {len(planned.places)} rows")])


def safe_side(gravity_length: float) -> str:
    """Say on which side an R-path should be planned where eta_b is not known well."""
    low, high = (1e3 * gravity_length * share for share in (TOO_LOW, TOO_HIGH))
    cost = f"an eta_b 5 % too low moves the first touch by {low:.2g} mm, one 5 % too high by {high:.2g} mm"
    return f"plan an R-path for the largest eta_b that the strip may have: without friction {cost}"


def plan_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import PlanInputs

    options(parser, PlanInputs, ("length",))
    options(parser, PlanInputs, ("eta_b",), required=False)
    text = "a measured fabric: its eta_b with the spread of warp and weft, rho_a and M_0, where they are not given"
    parser.add_argument("--fabric", metavar="NAME", help=text)
    options(parser, PlanInputs, ("eta_m", "rho_a", "eta_b_uncertainty", "goal", "gripper_accuracy"))
    # What is not given is the fabric's to fill in, or the model's.
    parser.set_defaults(rho_a=None, eta_b_uncertainty=None)
    parser.add_argument("--path", metavar="MINE.csv", help="a path of yours to rank among the known ones: t,x,z")
    _log_options(parser)
    options(parser, PlanInputs, ("max_snap", "max_slide", "margin", "tool", "layer_friction"))
    text = "M_0 of the fabric's bending hysteresis, N, and its kappa_y, 1/m [0.05 / L*, of more friction M_0 / 4 B]"
    parser.add_argument("--friction-moment", metavar="M0[,KAPPA_Y]", help=text)
    options(parser, PlanInputs, ("friction_uncertainty", "speed", "acceleration", "jerk", "flatness"))
    options(parser, PlanInputs, ("table_friction", "curl"))
    _cores_option(parser)
    parser.add_argument("--csv", metavar="PATH.csv", help="write the path there: t,x,z,angle in s, m, m and degrees")
    text = "the plan with the path as one JSON object: printed, or written there"
    parser.add_argument("--json", nargs="?", const=True, metavar="PLAN.json", help=text)
    text = "write the poses of the robot's tool there: a URScript, a ROS 2 message as YAML, JSON or CSV"
    parser.add_argument("--export", metavar="POSES", help=f"{text}, as the name ends: .script, .yaml, .json, .csv")
    text = "middle of the flat strip in the frame of the robot's base, m, and yaw of the direction of folding, degrees"
    parser.add_argument("--base", metavar="X,Y,Z,YAW", help=f"{text}; --base=-0.4,0,0,90 [0,0,0,0]")
    text = "write a page there: map, path, margin along the path, worst case, reasons"
    parser.add_argument("--report", metavar="PLAN.html", help=text)
    plot_option(parser, "the strip along the path")


@command("the gripper paths that fold a strip, ranked by what comes of them", plan_options, json=False)
def plan(arguments: argparse.Namespace, say: Say) -> str:
    """Follow all known paths with every eta_b of an interval, rank them, and write the best for a robot."""
    from stripfold.ask.inputs import PlanInputs

    said = given(arguments, PlanInputs) | _friction(arguments.friction_moment)
    if arguments.fabric is not None:
        from stripfold.ask.fabric import fabric

        cloth = fabric(arguments.fabric)
        logger.info(str(cloth))
        said = cloth.values | said
    elif arguments.eta_b is None:
        raise InvalidInputError("eta_b", MISSING, "--eta-b, or --fabric with a measured one: docs/plan.md")
    asked = PlanInputs(**said)
    from stripfold.ask.export import base_of, checked_name
    from stripfold.ask.plan import FoldingPlan

    base, export = base_of(arguments.base or "0,0,0,0"), arguments.export
    if arguments.base is not None and export is None:
        raise InvalidInputError("base", arguments.base, "a base together with export")
    if export is not None:
        export = writable(checked_name(export), arguments, "export")
    of_path = next((name for name in LOG if getattr(arguments, name) is not None), None)
    if of_path is not None and arguments.path is None:
        raise InvalidInputError(of_path, getattr(arguments, of_path), "this together with path")
    mine = None if arguments.path is None else _read_path(arguments, asked)
    found = FoldingPlan.of(asked, say, mine, arguments.cores)
    writers = {"csv": found.to_csv, "json": found.to_json, "report": found.report}
    targets = {name: target for name in writers if isinstance(target := getattr(arguments, name), Path)}
    for name, target in targets.items():
        writers[name](target)
    if export is not None:
        found.export(targets.setdefault("export", export), base)
    draw(found, arguments.plot)
    if arguments.json is True:
        return as_json(found.to_dict())
    return f"{found}\n{lines([('written', str(target)) for target in targets.values()])}".rstrip()


def _friction(said: str | None) -> dict[str, float]:
    """Read M_0 and kappa_y from ``M0`` or ``M0,KAPPA_Y``."""
    if said is None:
        return {}
    try:
        return dict(zip(("friction_moment", "yield_curvature"), map(float, said.split(",", 1)), strict=False))
    except ValueError as error:
        allowed = "M_0 in N, or M_0 and kappa_y in 1/m with a comma between them"
        raise InvalidInputError("friction_moment", said, allowed) from error


def map_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import MapInputs

    options(parser, MapInputs, (*STRIP, "rho_a", "friction_moment"))
    parser.add_argument("--output", metavar="MAP.nc", help="write it there")
    plot_option(parser, "the map")


@command("stability map: the gripper places that a strip follows", map_options)
def map_(arguments: argparse.Namespace, say: Say) -> str:
    """Follow the boundary of the gripper places at which a strip snaps, and how far the others are from it."""
    from stripfold.ask.inputs import UNSTRETCHED, MapInputs

    asked = _asked(arguments, MapInputs, eta_m=UNSTRETCHED)
    from stripfold.ask.map import StabilityMap

    return answer(StabilityMap.of(asked, say), arguments)


def monitor_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import MapInputs

    options(parser, MapInputs, (*STRIP, "rho_a"))


@command("margins of places that come line by line, while a robot moves", monitor_options)
def monitor(arguments: argparse.Namespace, say: Say) -> str:
    """Read x and z of the grasp, m, origin mid-strip on the floor, from lines of standard input, and print for each how
    far it is from where the strip snaps, m, the nearest such place, m, and the energy of a fall, J/m."""
    from stripfold.ask.inputs import UNSTRETCHED, MapInputs

    asked = _asked(arguments, MapInputs, eta_m=UNSTRETCHED)
    from stripfold.ask.monitor import Monitor
    from stripfold.ask.strip import Strip
    from stripfold.cli_messages import write

    reading = Monitor(Strip(asked.length, asked.eta_b, rho_a=asked.rho_a))
    names = ("x", "z", "margin", "x_near", "z_near", "energy")
    if not arguments.json:
        write(",".join(names))
    for number, line in enumerate(sys.stdin, 1):
        try:
            x, z = map(float, line.replace(",", " ").split())
            if not (isfinite(x) and isfinite(z)):
                raise ValueError
        except ValueError:
            raise InvalidInputError(f"line {number}", line.strip()[:40], "x and z in m, as -0.05,0.09") from None
        values = [float(f"{value:.6g}") for value in (x, z, *map(float, reading(x, z)))]
        row = {name: value if isfinite(value) else None for name, value in zip(names, values, strict=True)}
        write(json.dumps(row) if arguments.json else ",".join(f"{value:g}" for value in values))
    return ""


def _log_options(parser: argparse.ArgumentParser) -> None:
    log = parser.add_argument_group("a robot's log")
    log.add_argument("--columns", metavar="T,X,Z", help="names or numbers of its columns of time, x and z")
    log.add_argument("--unit", metavar="m|cm|mm", help="of its positions [as its header says, or m]")
    text = "the point under the middle of the strip in its frame, m; flip: its x runs against the folding; --frame=-1,0"
    log.add_argument("--frame", metavar="X0,Z0[,flip]", help=text)
    text = "largest distance of the path from the rows of a log with noise, m"
    log.add_argument("--smooth", type=metres, metavar="M", help=text)


def _read_path(arguments: argparse.Namespace, strip: Strip, fold_at: float | None = None) -> FoldPath:
    """Read a user's path, and say what was moved of it."""
    from stripfold import paths

    if arguments.path in paths.PLANS and not os.path.exists(arguments.path):
        advice = f"`stripfold path {arguments.path}` with --csv writes it, and `stripfold plan` ranks all paths"
        raise InvalidInputError("path", arguments.path, "a table t,x,z", advice)
    log = {name: getattr(arguments, name) for name in LOG}
    path = paths.read(arguments.path, strip, fold_at=fold_at, **log)
    for warning in path.curve.warnings:
        logger.warning(warning)
    return path


def assess_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import PathInputs

    parser.add_argument("path", metavar="PATH.csv", help="t,x,z, and angle if known, as stripfold path writes it")
    options(parser, PathInputs, (*STRIP, *SHEET, "rho_a", "model"))
    _fold_option(parser)
    _log_options(parser)
    options(parser, PathInputs, ("fall",))
    options(parser.add_mutually_exclusive_group(), PathInputs, ("friction_moment", "pull"))
    options(parser, PathInputs, ("layer_friction", "speed", "step", "second_gripper", "gripper", "flatness"))
    options(parser, PathInputs, ("table_friction", "curl", "bending_test"))
    parser.add_argument("--output", metavar="RESULT.nc", help="write the verdict with all states there")
    plot_option(parser, "the strip along the path")
    parser.add_argument("--film", metavar="FILM.mp4", help="where to draw it as a film, with the falls")
    text = (
        "exit with code 1 where the strip does not follow all of the path, is not folded at its end (5 mm, 5 %% of the "
        "length), may ruck under the push (--flatness), slides at once (--table-friction), or does not follow it on "
        "another mesh"
    )
    parser.add_argument("--check", action="store_true", help=text)
    text = "with --check: largest error of the fold, what it slides on the table included, m"
    parser.add_argument("--max-error", type=metres, metavar="M", help=text)


@command("assessment of a gripper path: critical points, falls, touch, forces", assess_options)
def assess(arguments: argparse.Namespace, say: Say) -> tuple[str, int]:
    """Follow a path statically to its critical points, let the strip fall there, and go on to its end."""
    from stripfold.ask.inputs import PathInputs

    asked, most = _asked(arguments, PathInputs), arguments.max_error
    if most is not None and not arguments.check:
        raise InvalidInputError("max_error", most, "a limit together with check")
    from stripfold.ask.assess import assess

    path = _read_path(arguments, asked, arguments.fold_at)
    found = assess(asked, path, say)
    said = answer(found, arguments)
    if arguments.film is not None:
        found.film(arguments.film, say)
    doubtful = found.may_ruck or not found.slide_known or found.mesh_dependence
    accurate = most is None or found.shape_error + abs(found.slide) <= most
    passed = found.stable and found.folded and accurate and not doubtful
    return said, 1 if arguments.check and not passed else 0


def new_options(parser: argparse.ArgumentParser) -> None:
    text = "scene: for simulate and record; recording: recording.yaml, for measure; grid: for sweep"
    parser.add_argument("kind", choices=("scene", "recording", "grid"), help=text)
    parser.add_argument("--output", metavar="FILE.yaml", help="write it there, a new file, instead of printing it")


@command("a commented file to start from: a scene, a recording or a grid", new_options, json=False)
def new(arguments: argparse.Namespace, say: Say) -> str:
    """Print a file that simulate and record, measure, or sweep read as it is, with all of its keys explained."""
    text = (Path(__file__).parent / "templates" / f"{arguments.kind}.yaml").read_text(encoding="utf-8")
    path = arguments.output
    if path is None:
        return text.rstrip()
    if os.path.lexists(path):
        raise InvalidInputError("output", str(path), "a file that is not there yet", "remove it, or choose another")
    from stripfold.files.store import write_text

    write_text(text, path)
    return lines([("written", str(path))])
