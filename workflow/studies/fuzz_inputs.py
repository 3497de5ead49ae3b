"""Malformed and odd inputs of the command line, as Hypothesis draws them: arguments, scenes and tables."""

from __future__ import annotations

import argparse
import copy
import json
from collections.abc import Iterator
from functools import cache
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from stripfold import cli
from studies.fuzz import FOLDER, PIPE, Case
from studies.fuzz_files import BOARD, Draw, damaged

_STRIP = "--length 0.5 --eta-b 3780"
# Calls that are accepted, as far as they are followed.
CALLS = (
    f"critical {_STRIP} --height 0.09 --model elastica",
    f"critical {_STRIP} --height 0.09 --model elastica --second-gripper 0.1",
    f"critical {_STRIP} --height 0.09 --model elastica --eta-b-uncertainty 20%",
    "sweep @grid.yaml --cores 1 --output sweep.nc",
    "eta --fold-height 0.0272",
    "eta --loop heart --length 0.2 --height 0.05",
    "eta --kes-b 0.05 --kes-2hb 0.03 --gsm 150",
    "eta --rigidity 1e-5 --gsm 150",
    "simulate @scene.yaml --output scene.nc",
    "film @scene.nc --output film.mp4",
    f"path triangular {_STRIP}",
    f"path r-path {_STRIP} --csv path.csv",
    f"plan {_STRIP} --margin 0.01",
    f"plan {_STRIP} --eta-b-uncertainty 10% --friction-moment 1e-4 --yield-curvature 10 --speed 0.1 --acceleration 0.5"
    " --csv plan.csv",
    f"map {_STRIP} --output map.nc",
    f"assess @path.csv {_STRIP} --model rod --fall",
    f"assess @path.csv {_STRIP} --friction 1.0 --step 0.01",
    f"assess @path.csv {_STRIP} --columns t,x,z --unit m --frame 0,0 --smooth 1e-3",
    "record @filmed.yaml --output filmed",
    f"calibrate @views {BOARD} --output camera.yaml",
    "measure @recording --json",
    "new grid --output new.yaml",
    "doctor --json",
    "completion bash",
)
SCENES: dict[str, tuple[str, dict[str, Any]]] = {
    "simulate": (
        "scene.yaml",
        {"length": 0.5, "height": 0.09, "eta_b": 3780, "eta_m": 1e-3, "model": "rod", "until": "touch"}
        | {"air": 2.0, "effects": {"self_contact": "off", "solid": "auto"}},
    ),
    "sweep": (
        "grid.yaml",
        {"length": 0.6, "model": "rod", "height": [0.06, 0.09], "eta_b": {"from": 2000.0, "to": 4000.0, "count": 3}},
    ),
    "record": (
        "filmed.yaml",
        {
            "length": 0.45,
            "eta_b": 3780.0,
            "height": 0.1,
            "speed": 0.01,
            "strip": {"colour": [0.1, 0.2, 0.3]},
            "gripper": {"direction": 1, "offset": [0.0, -0.03]},
            "filming": {"size": [320, 240], "frame_rate": 30.0, "codec": "mjpeg", "container": "avi"},
            "motion": {"law": "cubic", "before": 0.02, "after": 1.0},
            "generator": "shapes",
            "seed": 3,
        },
    ),
}
_MATRIX = {"rows": 3, "cols": 3, "dt": "d", "data": [400.0, 0.0, 160.0, 0.0, 400.0, 120.0, 0.0, 0.0, 1.0]}
RECORDING: dict[str, dict[str, Any]] = {
    "recording.yaml": {
        "title": "a strip",
        "strip": {"length": 0.45, "eta_b": 3780.0, "width": 0.03, "material": "cotton"},
        "gripper": {"height": 0.1, "speed": 0.02, "flat_end": -0.225, "direction": 1}
        | {"marker": {"dictionary": "4x4_50", "id": 7, "size": 0.024, "offset": [0.0, -0.032]}},
        "video": "video.mkv",
        "robot_log": "robot.csv",
        "camera": {"intrinsics": "camera.yaml", "rolling_shutter": 0.0},
        "plane": {"image": "plane.png", "board": {"type": "chessboard", "columns": 8, "rows": 5, "square": 0.024}},
        "robot": {"grid": "grid.csv"},
    },
    "manual_onset.yaml": {"event_time": 1.5, "sd": 0.01, "reason": "the video shows it"},
    "camera.yaml": {
        "image_width": 320,
        "image_height": 240,
        "camera_matrix": _MATRIX,
        "distortion_coefficients": {"rows": 1, "cols": 5, "dt": "d", "data": [-0.1, 0.01, 0.0, 0.0, 0.0]},
        "avg_reprojection_error": 0.2,
    },
}
TABLES = {
    "robot.csv": [["t", "x", "z"], *([f"{0.1 * i:.1f}", f"{-0.225 + 0.002 * i:.4f}", "0.1"] for i in range(12))],
    "grid.csv": [
        ["image", "x", "z"],
        *([f"stop-{i}.png", f"{0.05 * i:.2f}", f"{0.1 + 0.01 * i:.2f}"] for i in range(9)),
    ],
}
PATH = [["t", "x", "z"], ["0", "-0.25", "0"], ["1", "-0.2", "0.05"], ["2", "-0.1", "0.1"], ["3", "0.1", "0.1"]]

ODD_WORDS = (
    *("", " ", "nan", "-nan", "inf", "-inf", "1e400", "-1e400", "1e300", "1e-320", "-0.0", "0", "-1", "9" * 400, "1e"),
    *("10%", "-5%", "nan%", "%", "1_000", "0x10", "１２", "1,5", "1.5.2", "auto", "on", "null", "~", "true", "--", "-"),
    *("../x", "/", ".", "..", "\udcff", "a\tb", "a\nb", "é", "\u202e", "x" * 300, "%s", "{0}", "{length}", "~root"),
    *("@missing", "@", "@scene.nc", "@pipe", "@views", "@fold.png", "@scene.yaml", "out.png", "/dev/null"),
)
ODD_YAML = (
    *("[" * 60 + "]" * 60, "{a: " * 40 + "1" + "}" * 40, "!!python/object/apply:os.getcwd []", "!!binary 1"),
    *("2001-01-01", "1:30:00", "0o17", ".inf", "-.inf", ".nan", "1e400", "9" * 5000, "1.0e400"),
    *("!!float 9" + "9" * 400, "[0.5, .nan]", "{}", "[]", "!!set {a, b}", "!!omap [a: 1]", "? [a, b]", "*a", "&a [*a]"),
    *("<<: 1", "=", "!!int '0b'", "!!timestamp 1", "!!null x", "!!bool x", "2001-99-99", "9999-12-31 25:61:61"),
    *("!!int x", "!!float x", "!!int ''", "0b", "0x", "+", "-", "-0x_", "1__2", "190:20:30.15", "999999999:59:59"),
    *("0b2", "1e+", ".", "._", "+.inf"),
)
ALIASES = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 10)
)
WHOLE_YAML = (
    *(ALIASES, "", "- 1", "a", "\t", "a: b: c", "%YAML 9.9\n---\na: 1", "--- 1\n--- 2", "[" * 20_000, "{" * 5000),
)
LONGEST_INT = 10**400

plain_text = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=12)
# Of any size, which a limit alone keeps out.
magnitudes = st.builds(lambda sign, power: sign * 10.0**power, st.sampled_from((1.0, -1.0)), st.integers(-320, 300))
words = st.one_of(
    st.sampled_from(ODD_WORDS),
    magnitudes.map(repr),
    st.floats().map(repr),
    st.integers().map(str),
    st.floats(0.0, 1.0).map(repr),
    plain_text,
)
leaves = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    plain_text,
    st.sampled_from((LONGEST_INT, -LONGEST_INT, 1e300)),
)
values = st.recursive(
    leaves, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(plain_text, inner, max_size=3), max_leaves=5
)


@cache
def options_of(command: str) -> tuple[str, ...]:
    """Names of all options of a command."""
    parser = cli._parser([command])
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return tuple(name for action in commands.choices[command]._actions for name in action.option_strings)


def _parts(call: str) -> tuple[str, list[str], dict[str, str | None]]:
    """Of a call: the command, words without a name, and the options."""
    (command, *unnamed), *given = (part.split() for part in call.split(" --"))
    return command, unnamed, {f"--{name}": value[0] if value else None for name, *value in given}


@st.composite
def of_arguments(draw: Draw) -> Case:
    """A call with words replaced, added or left out."""
    command, unnamed, named = _parts(draw(st.sampled_from(CALLS)))
    for _ in range(draw(st.integers(1, 3))):
        change = draw(st.integers(0, 9))
        if change == 0 and unnamed:
            unnamed[0] = draw(words)
        elif change == 1 and named:
            del named[draw(st.sampled_from(sorted(named)))]
        elif change == 2:
            unnamed.append(draw(words))
        elif change < 6:
            named[draw(st.sampled_from(options_of(command)))] = draw(st.none() | words)
        elif named:
            named[draw(st.sampled_from(sorted(named)))] = draw(words)
    given_words = [word for name, value in named.items() for word in ((name,) if value is None else (name, value))]
    return Case((command, *unnamed, *given_words), {})


def _places(tree: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, item in items:
        yield (*at, key)
        yield from _places(item, (*at, key))


def _changed(draw: Draw, tree: dict[str, Any]) -> dict[str, Any]:
    """A tree of keys and values with one to three entries replaced, renamed or left out."""
    tree = copy.deepcopy(tree)
    for _ in range(draw(st.integers(1, 3))):
        places = list(_places(tree))
        if not places:
            break
        *way, key = draw(st.sampled_from(places))
        inside: Any = tree
        for step in way:
            inside = inside[step]
        change = draw(st.integers(0, 5))
        if change == 0:
            del inside[key]
        elif change == 1 and isinstance(inside, dict):
            inside[draw(plain_text)] = inside.pop(key)
        elif change == 3 and isinstance(inside[key], float):
            inside[key] = draw(magnitudes)
        elif change == 2:
            inside[key] = f"\0{draw(st.sampled_from(ODD_YAML))}\0"
        else:
            inside[key] = draw(values)
    return tree


def _as_yaml(tree: Any) -> str:
    """JSON is YAML; what stands between two zeros is put in as it is."""
    return json.dumps(tree).replace('"\\u0000', "").replace('\\u0000"', "")


def _yaml(draw: Draw, tree: dict[str, Any]) -> bytes:
    kind = draw(st.integers(0, 19))
    if kind == 0:
        return bytes(draw(st.binary(max_size=60)))
    if kind == 1:
        return str(draw(st.sampled_from(WHOLE_YAML))).encode()
    if kind == 2:
        return bytes(draw(st.sampled_from((PIPE, FOLDER))))
    text = _as_yaml(_changed(draw, tree)).encode()
    return damaged(draw, text) if kind == 3 else text


@st.composite
def of_yaml(draw: Draw) -> Case:
    """A scene, a grid or the description of a recording with entries changed, or what is no YAML."""
    if draw(st.booleans()):
        command = draw(st.sampled_from(sorted(SCENES)))
        name, tree = SCENES[command]
        return Case((command, name), {name: _yaml(draw, tree)})
    changed = draw(st.sampled_from(sorted(RECORDING)))
    return Case(("measure", "."), recording() | {changed: _yaml(draw, RECORDING[changed])})


def recording() -> dict[str, bytes]:
    """The files of a recording that is described and not filmed."""
    files = {name: _as_yaml(tree).encode() for name, tree in RECORDING.items()}
    del files["manual_onset.yaml"]
    return files | {name: as_csv(rows) for name, rows in TABLES.items()} | {"video.mkv": b"", "plane.png": b""}


def as_csv(rows: list[list[str]]) -> bytes:
    """A table in UTF-8."""
    return "\n".join(",".join(row) for row in rows).encode("utf-8", "surrogateescape")


def _table(draw: Draw, table: list[list[str]]) -> bytes:
    rows = copy.deepcopy(table)
    kind = draw(st.integers(0, 14))
    if kind == 0:
        return bytes(draw(st.binary(max_size=60)))
    if kind == 1:
        whole = (PIPE, FOLDER, b"", b"\n" * 100, b'"' + b"x," * 200_000, b"t,x,z\n" * 30_000)
        return bytes(draw(st.sampled_from(whole)))
    for _ in range(draw(st.integers(1, 3))):
        row = draw(st.integers(0, len(rows) - 1))
        change = draw(st.integers(0, 5))
        if change == 0 and len(rows) > 1:
            del rows[row]
        elif change == 1:
            rows.insert(row, rows[draw(st.integers(0, len(rows) - 1))])
        elif change == 2:
            rows[row] = draw(st.lists(words, max_size=4))
        elif rows[row]:
            rows[row] = [*rows[row]]
            rows[row][draw(st.integers(0, len(rows[row]) - 1))] = draw(words)
    return damaged(draw, as_csv(rows)) if kind == 2 else as_csv(rows)


@st.composite
def of_tables(draw: Draw) -> Case:
    """A gripper path or a table of a recording with cells or rows changed, or what is no table."""
    if draw(st.booleans()):
        return Case(("assess", "path.csv", *_STRIP.split()), {"path.csv": _table(draw, PATH)})
    changed = draw(st.sampled_from(sorted(TABLES)))
    return Case(("measure", "."), recording() | {changed: _table(draw, TABLES[changed])})


def drawn(strategy: st.SearchStrategy[Case], count: int, number: int) -> list[Case]:
    """``count`` cases, the same for the same seed ``number``."""
    found: list[Case] = []

    @seed(number)
    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(strategy)
    def collect(case: Case) -> None:
        found.append(case)

    collect()
    return found[:count]
