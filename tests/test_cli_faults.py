"""Whatever the system refuses: one line, an exit code, nothing half-written, and nothing computed in vain."""

from __future__ import annotations

import os
import subprocess
import sys
from io import BytesIO
from pathlib import Path

import netCDF4
import pytest
from PIL import Image

from made_up import INPUTS
from stripfold import cli
from stripfold.base.errors import InvalidInputError, SolveError
from stripfold.cli import main
from stripfold.files import store
from stripfold.film.pictures import MAX_SCANS, read_grey

PATH = "t,x,z\n0,-0.25,0\n1,0,0.25\n2,0.25,0\n"
STRIP = ["critical", "--length", "0.4", "--eta-b", "3780", "--height", "0.09", "--model", "elastica"]


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    code, captured = main(arguments), capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("stripfold: error: ")
    assert captured.err.count("\n") == 1
    return code, captured.err


_ASKED = "--length 0.5 --eta-b 3780"
_FIRST_OF_ALL = (
    (f"assess path.csv {_ASKED}", ("output .nc", "plot .png", "film .mp4")),
    ("calibrate . --board chessboard --columns 8 --rows 5 --square 1", ("output .yaml",)),
    ("eta --image fold.png --scale 1e-4 --method fold", ("picture .png",)),
    ("film fall.nc", ("output .mp4",)),
    (f"map {_ASKED}", ("output .nc", "plot .png")),
    (f"plan {_ASKED}", ("csv .csv", "json .json", "report .html", "plot .png")),
    ("record filmed.yaml", ("output ",)),
    ("simulate scene.yaml", ("output .nc", "plot .png")),
    ("sweep grid.yaml", ("output .nc",)),
)


@pytest.mark.parametrize(
    ("error", "code", "parts"),
    [
        (OSError(28, "No space left on device", "out.nc"), 2, ("out.nc", "No space left", "check")),
        (MemoryError("Unable to allocate 8 GiB"), 2, ("8 GiB", "accuracy")),
        (RecursionError("too deep"), 5, ("RecursionError in test_cli_faults.py, line", "too deep", "report")),
        (KeyError("phase"), 5, ("KeyError", "'phase'")),
        (SolveError("0.3 L* from\nthe floor"), 3, ("0.008996 m from the floor",)),
    ],
)
def test_other_errors_are_one_line_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: Exception, code: int, parts: tuple[str]
) -> None:
    def fail(*_: object) -> str:
        raise error

    monkeypatch.setitem(cli.COMMANDS, "critical", cli.COMMANDS["critical"]._replace(run=fail))
    got, said = refused(capsys, *STRIP)
    assert got == code
    assert all(part in said for part in parts), said


WRITTEN = {
    "out.nc": (
        "store.write(xr.Dataset({'x': ('node', random(9999), {'units': 'm', 'long_name': 'x'})}), OUT, title='x')"
    ),
    "out.txt": "store.write_text('x' * 9999, OUT)",
    "out.png": "save_as(Figure(), OUT)",
    "out": "calibration.write_calibration(Scene.of({'filming': {'size': [640, 360]}}), OUT)",
    "out.mp4": "film(made_up.collapse(), OUT)",
}


@pytest.mark.parametrize(
    "names", [["out.nc", "out.txt", "out.png", "out"], pytest.param(["out.mp4"], marks=pytest.mark.slow)]
)
def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path: Path, names: list[str]) -> None:
    """A file that may not grow is what a full disk is."""
    code = (
        "import resource, sys\nimport xarray as xr\nfrom matplotlib.figure import Figure\n"
        "from numpy.random import random\nimport made_up\nfrom stripfold import cli\n"
        "from stripfold.files import store\n"
        "from stripfold.draw.film import film\nfrom stripfold.draw.save import save_as\n"
        "from stripfold.synthetic import recording as calibration\nfrom stripfold.synthetic.scene import Scene\n"
        # Python itself would leave the bytecode of what is imported from here on cut, for all later processes.
        "sys.dont_write_bytecode = True\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (500, -1))\n"
        + "".join(
            f"cli.COMMANDS['critical'] = cli.COMMANDS['critical']._replace(run=lambda *_: {WRITTEN[name]})\n"
            f"assert cli.main({STRIP!r}) == 2\n".replace("OUT", repr(name))
            for name in names
        )
    )
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent)}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stdout, os.listdir(tmp_path)) == (0, "", []), done.stderr
    said = done.stderr.splitlines()
    assert len(said) == len(names)
    for line, name in zip(said, names, strict=True):
        assert line.startswith(f"stripfold: error: {name}")


def test_a_file_that_declares_too_much_is_refused(tmp_path: Path) -> None:
    with netCDF4.Dataset(tmp_path / "large.nc", "w") as file:
        file.createDimension("state", 100_000_000_000)
        file.createVariable("x", "f8", ("state",), chunksizes=(1000,), zlib=True)
    with pytest.raises(InvalidInputError, match=r"declares 8e\+11 bytes"):
        store.read(tmp_path / "large.nc")


def test_a_jpeg_of_many_scans_is_refused(tmp_path: Path) -> None:
    written = BytesIO()
    Image.linear_gradient("L").save(written, "JPEG", progressive=True)
    usual, path = written.getvalue(), tmp_path / "strip.jpg"
    path.write_bytes(usual)
    assert read_grey(path).shape == (256, 256)
    scan = usual[usual.rindex(b"\xff\xda") : -2]
    path.write_bytes(usual[:-2] + MAX_SCANS * scan + usual[-2:])
    with pytest.raises(InvalidInputError, match="scans"):
        read_grey(path)


@pytest.mark.parametrize("output", ["--output", ""])
def test_an_empty_name_is_refused_and_none_is_that_of_the_source(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], output: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("grid.v2.yaml").write_text("{length: 0.6, eta_b: 3780, height: 0.09, model: elastica}")
    if output:
        code, said = refused(capsys, "sweep", "grid.v2.yaml", "--output", "")
        assert (code, "ends in .nc" in said) == (2, True)
    else:
        assert main(["sweep", "grid.v2.yaml"]) == 0
        assert Path("grid.v2.nc").is_file()


@pytest.mark.parametrize(
    ("command", "option", "suffix"),
    [
        (command, option, suffix)
        for command, outputs in _FIRST_OF_ALL
        for option, suffix in (output.split(" ") for output in outputs)
        if not command.startswith(("calibrate", "map", "plan", "record"))  # these read no file, or write a folder
    ],
)
@pytest.mark.parametrize("link", [False, True])
def test_no_output_replaces_the_input(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: str,
    option: str,
    suffix: str,
    link: bool,
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in {**INPUTS, "path.csv": PATH}.items():
        Path(name).write_text(text)
    source = next(word for word in command.split() if Path(word).is_file() or word.endswith((".png", ".nc")))
    Path(f"self{suffix}").write_text(Path(source).read_text() if Path(source).exists() else "a picture")
    before = Path(f"self{suffix}").read_text()
    if link:
        Path(f"link{suffix}").symlink_to(f"self{suffix}")
    target = f"./link{suffix}" if link else f"../{tmp_path.name}/self{suffix}"
    code, said = refused(capsys, *command.replace(source, f"self{suffix}").split(), f"--{option}", target)
    assert (code, "another file than the input; it would be replaced" in said) == (2, True), said
    assert Path(f"self{suffix}").read_text() == before


@pytest.mark.parametrize(
    "value", ["!!int ''", "!!timestamp 1", "!!bool x", "!!binary 1", "!!set {a}", "!mine 3", "! 3"]
)
def test_yaml_with_tags_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], value: str) -> None:
    """What a tag converts may end in an error of any type."""
    path = tmp_path / "scene.yaml"
    path.write_text(f"length: {value}\n")
    code, said = refused(capsys, "simulate", str(path))
    assert (code, "without tags" in said) == (2, True)


ALIASES = "a0: &a0 [x, x]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12))


@pytest.mark.parametrize(("text", "part"), [(ALIASES, "without aliases"), ("a: " + "[" * 50_000, "levels deep")])
@pytest.mark.parametrize("command", ["simulate scene.yaml", "measure ."])
def test_yaml_that_takes_long_to_load_is_refused_at_once(tmp_path: Path, text: str, part: str, command: str) -> None:
    """A billion entries, or brackets that each cost a pass: where nothing refuses them the limits end the process."""
    for name in ("scene.yaml", "recording.yaml"):
        (tmp_path / name).write_text(text)
    limits = "resource.setrlimit(resource.RLIMIT_CPU, (10, 10)); resource.setrlimit(resource.RLIMIT_AS, (4 << 30, -1))"
    code = f"import resource, sys; {limits}\nfrom stripfold.cli import main\nsys.exit(main({command.split()!r}))"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, part in done.stderr) == (2, True), done


def test_a_picture_with_a_part_that_declares_too_much_is_refused(tmp_path: Path) -> None:
    written, path = BytesIO(), tmp_path / "strip.png"
    Image.linear_gradient("L").save(written, "PNG")
    whole = written.getvalue()
    at = whole.index(b"IDAT") - 4
    path.write_bytes(whole[:at] + b"\xf0\0\0\0" + whole[at + 4 :])
    limit = "import resource; resource.setrlimit(resource.RLIMIT_AS, (3_000_000_000, -1))"
    code = f"{limit}\nfrom stripfold.cli import main\nmain(['eta', '--image', {str(path)!r}"
    code += ", '--scale', '3e-4', '--method', 'fold'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr.startswith("stripfold: error: image = ")
    assert "declares more than the memory" in done.stderr


def test_an_argument_with_line_ends_is_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([*STRIP, "a\nb\x1ec"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.splitlines()[-1] == "stripfold: error: unrecognized arguments: a b c"
