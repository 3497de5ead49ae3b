"""Tables of gripper paths as robots and spreadsheets write them."""

from __future__ import annotations

import codecs
from pathlib import Path

import numpy as np
import pytest

import stripfold as sf
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.files.reporting import as_json
from stripfold.files.tables import read_table
from stripfold.film.clock import read_log
from stripfold.paths.table import LogFormat

STAMPS = ("2026-11-25T10:15:00.5Z", "2026-11-25 10:15:01.5+00:00", "2026-11-25T11:15:02.500+01:00")
STRIP = sf.Strip(length=0.45, eta_b=3780.0)
ROWS = np.array([[0.0, -0.225, 0.0], [1.0, -0.1, 0.15], [2.0, 0.0, 0.2], [3.5, 0.1, 0.15]])


def write(file: Path, rows: Array, header: str = "t,x,z") -> Path:
    np.savetxt(file, rows, delimiter=",", header=header, comments="", fmt="%.12g")
    return file


PLAIN = "t,x,z\n" + "\n".join(",".join(f"{value:g}" for value in row) for row in ROWS) + "\n"
EXCEL = PLAIN.replace(",", ";").replace(".", ",")


@pytest.mark.parametrize(
    "data",
    [
        PLAIN.encode(),
        codecs.BOM_UTF8 + PLAIN.encode(),
        PLAIN.encode("utf-16"),
        PLAIN.replace("\n", "\r\n").encode(),
        PLAIN.replace(",", ";").encode(),
        EXCEL.encode(),
        EXCEL.replace(";", "\t").encode(),
        codecs.BOM_UTF8 + EXCEL.replace("\n", ";\n").encode(),
        PLAIN.removeprefix("t,x,z\n").encode(),
        EXCEL.removeprefix("t;x;z\n").encode(),
        PLAIN.encode("utf-16-le"),
        EXCEL.encode("utf-16-be"),
        PLAIN.replace(",", " ").encode(),
        EXCEL.replace(";", " ").encode(),
        PLAIN.replace(",", " \t ").encode(),
        PLAIN.replace(",", " ,").encode(),
        ("# " + PLAIN).encode(),
        ("% made at noon, by hand\n# " + PLAIN).encode(),
        ("# t, x, z\n" + PLAIN.removeprefix("t,x,z\n").replace(",", " ")).encode(),
        PLAIN.replace("t,x,z", "t [s],x [m],z (m)").encode(),
        PLAIN.replace("t,x,z", "t [s] x [m] z [m]").replace(",", " ").encode(),
        ("Winkel [°];" + EXCEL.replace("\n", "\n7,5;")).removesuffix("7,5;").encode("cp1252"),
        PLAIN.replace("t,x,z", "time,tcp_x,tcp_z").replace("time", "# time").encode(),
        "\n".join(f"{line}," for line in PLAIN.splitlines()).encode(),
        PLAIN.replace("\n", ",,\n").replace("t,x,z,,", "t,x,z").encode(),
        ("# from a robot\nZ, T, force, X\n" + "\n".join(f"{z}, {t}, 7, {x}" for t, x, z in ROWS)).encode(),
    ],
)
def test_one_reader_reads_them_all(tmp_path: Path, data: bytes) -> None:
    file = tmp_path / "own.csv"
    file.write_bytes(data)
    assert read_table("path", file, "t,x,z", (2, 10)).numbers().tolist() == ROWS.tolist()


@pytest.mark.parametrize(
    ("text", "columns", "says"),
    [
        ("0,1,2,3,4\n1,2,3,4,5\n", (), "5 columns without names, with commas"),
        ("a,b,c\n0,1,2\n1,2,3\n", (), "header t,x,z"),
        ("a,b,c\n0,1,2\n1,2,3\n", ("a", "b", "d"), "d' cannot be used; .* its columns are 'a, b, c'"),
        ("a,b,c\n0,1,2\n1,2,3\n", ("1", "2", "4"), "4' cannot be used; .* from 1 to 3"),
        ("a,b,b\n0,1,2\n1,2,3\n", ("a", "b", "1"), "one column of log.csv"),
        ("a,b,c,d\n0,1,2,3\n1,2,3\n", ("a", "b", "c"), "row 3 of log.csv"),
        ("# made\n\nt,x,z\n0,1,2\n\n1,2,x\n", (), "row 6 of log.csv"),
        ("a,b,c\n0,1,2\n1,2,3\n", ("9" * 5000, "a", "b"), "one column of log.csv"),
        ("t,x,z\n0,0,0,5,0,1\n1,0,0,6,0,2\n", (), "decimal mark must be a point"),
        ("t,x [inch],z\n0,1,2\n1,2,3\n", (), "units m, cm, mm"),
        ("t;x;z\n0;1,5;2\n1;1,5,3;2\n", (), "row 3 of log.csv"),
    ],
)
def test_tables_without_the_columns(tmp_path: Path, text: str, columns: tuple[str, ...], says: str) -> None:
    file = tmp_path / "log.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInputError, match=says):
        read_table("path", file, "t,x,z", (2, 10), columns).numbers()


def test_columns_unit_and_frame(tmp_path: Path) -> None:
    """A log in millimetres in the frame of a robot that sees the strip from its other side."""
    t, x, z = ROWS.T
    rows = np.column_stack([1e3 * (z + 0.04), t, 1e3 * (0.7 - x)])
    file = write(tmp_path / "log.csv", rows, "tcp z,time,tcp x")
    found = sf.paths.read(file, STRIP, columns="time,tcp x,tcp z", unit="mm", frame="0.7,0.04,flip")
    plain = sf.paths.read(write(tmp_path / "own.csv", ROWS), STRIP)
    np.testing.assert_allclose(found.places, plain.places, atol=1e-9)
    assert not found.curve.warnings


@pytest.mark.parametrize(("header", "unit"), [("t,x,z", "cm"), ("t [s],x [cm],z [cm]", None), ("t,x (cm),z", "cm")])
def test_a_unit_that_is_given_or_in_the_header(tmp_path: Path, header: str, unit: str | None) -> None:
    plain = sf.paths.read(write(tmp_path / "own.csv", ROWS), STRIP)
    file = write(tmp_path / "log.csv", ROWS * [1.0, 100.0, 100.0], header)
    np.testing.assert_allclose(sf.paths.read(file, STRIP, unit=unit).places, plain.places, atol=1e-9)
    if unit != "cm" or "cm" in header:
        with pytest.raises(InvalidInputError, match=r"unit = 'mm' .* cm, as the header says"):
            sf.paths.read(file, STRIP, unit="mm")


@pytest.mark.parametrize(
    ("unit", "frame", "given", "length", "advice"),
    [
        (1e3, (0.0, 0.0), {}, 0.45, "--unit mm"),
        (1e3, (0.5, 0.02), {}, 0.45, "--unit mm --frame=0.5,0.02"),
        (1e3, (0.5, 0.02), {"frame": "500,20"}, 0.45, "--unit mm --frame=0.5,0.02"),
        (1e3, (0.5, 0.02), {"frame": "500,20", "unit": "mm"}, 0.45, "--frame=0.5,0.02"),
        (1e2, (0.5, 0.02), {"frame": "0.5,0.02"}, 0.45, "--unit cm"),
        (1.0, (0.5, 0.02), {}, 0.45, "--frame=0.5,0.02"),
        (1.0, (0.5, 0.02), {"frame": "0.5,0.02,flip"}, 0.45, "--frame=0.05,0.02,flip"),
        (1.0, (0.0, 0.0), {}, 0.6, "--frame=0.075,0 or --length 0.45"),
    ],
)
def test_a_start_elsewhere_says_how_it_is_read_right(
    tmp_path: Path, unit: float, frame: tuple[float, float], given: dict[str, str], length: float, advice: str
) -> None:
    file = write(tmp_path / "log.csv", (ROWS + np.array([0.0, *frame])) * [1.0, unit, unit])
    with pytest.raises(InvalidInputError) as caught:
        sf.paths.read(file, sf.Strip(length=length, eta_b=3780.0), **given)
    assert str(caught.value).endswith(f"with {advice} it starts there")


@pytest.mark.parametrize("factor", [1.0, 1e9])
def test_a_critical_point_is_found_again_in_the_file(tmp_path: Path, factor: float) -> None:
    """By its row, below two comments, a header and an empty line, and by the time since the first row."""
    rows, _ = logged("triangular", 0.0)
    rows[:, 0] = factor * (1.764e9 + rows[:, 0])
    file = tmp_path / "log.csv"
    np.savetxt(file, rows, delimiter=",", header="# from\n# a robot\n\nt,x,z", comments="", fmt="%.9f")
    found = STRIP.assess(sf.paths.read(file, STRIP), model="rod")
    (event,) = found.critical
    t, x, z = np.array(file.read_text(encoding="utf-8").splitlines()[event["row"] - 1].split(","), dtype=float)
    assert np.hypot(x - event["x"], z - event["z"]) < 1e-3
    assert event["t"] == pytest.approx(t - rows[0, 0], abs=0.02 * factor)
    assert f"row {event['row']}, t = {event['t']:.4g} after the first" in str(found)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"columns": "t,x"}, "three names"),
        ({"unit": "km"}, "m, cm, mm"),
        ({"frame": "0"}, "x0,z0"),
        ({"frame": "0,nan"}, "x0,z0"),
        ({"frame": "0,1,2"}, "x0,z0,flip"),
        ({"frame": "0,1,flip,0"}, "x0,z0,flip"),
        ({"smooth": 0.0}, "more than 0"),
        ({"smooth": float("nan")}, "a number"),
    ],
)
def test_what_is_no_format(given: dict[str, str], says: str) -> None:
    with pytest.raises(InvalidInputError, match=says):
        LogFormat(**given)  # type: ignore[arg-type]


def logged(kind: str, noise: float, seed: int = 0) -> tuple[Array, Array]:
    """A planned path as a robot logs it, shape (1201, 3), with noise; and the path without."""
    curve = getattr(sf.paths, kind)(STRIP).curve
    share = np.linspace(0.0, 1.0, 1201)
    true = np.array([curve.position(float(s)) for s in curve.length * share**2 * (3.0 - 2.0 * share)])
    noisy = true + noise * np.random.default_rng(seed).standard_normal(true.shape)
    return np.column_stack([10.0 * share, noisy]), true


@pytest.mark.parametrize("kind", ["r_path", "triangular", "circular"])
def test_noise_is_smoothed_to_a_tolerance(tmp_path: Path, kind: str) -> None:
    """0.2 mm of noise, at most 0.8: each row was a corner.  The path is within the tolerance of the true one."""
    rows, true = logged(kind, 2e-4)
    file = write(tmp_path / "log.csv", rows)
    found = sf.paths.read(file, STRIP, smooth=1e-3)
    assert len(found.curve.pieces) < 16 < len(sf.paths.read(file, STRIP, smooth=1e-9).curve.pieces)
    s = np.linspace(0.0, found.curve.length, 1000)
    places = np.array([found.curve.position(float(value)) for value in s])
    assert max(np.linalg.norm(true - place, axis=1).min() for place in places) < 1e-3
    verdicts = [STRIP.assess(path, model="rod") for path in (found, getattr(sf.paths, kind)(STRIP))]
    assert "completed" in as_json(verdicts[0].to_dict())
    x, planned = (verdict.critical[0]["x"] for verdict in verdicts)
    assert x == pytest.approx(planned, abs=1e-3)
    # By the log's times: the robot is slow at both ends.
    t = verdicts[0].critical[0]["t"] / 10.0
    assert t**2 * (3.0 - 2.0 * t) == pytest.approx(verdicts[1].critical[0]["t"], abs=5e-3)


def test_times_of_a_log_may_be_dates(tmp_path: Path) -> None:
    """Seconds apart, whatever their zones; columns of other names among many; a date that is none is refused."""
    rows = [f"{stamp},7,{x},0,{z}" for stamp, x, z in zip(STAMPS, (0.1, 0.2, 0.3), (0.09, 0.09, 0.08), strict=True)]
    file = tmp_path / "log.csv"
    file.write_text("\n".join(["stamp,mode,tcp_x,tcp_y,tcp_z", *rows]))
    found = read_log(file, ("stamp", "tcp_x", "tcp_z"))
    np.testing.assert_allclose(np.diff(found.time), 1.0, atol=1e-6)
    np.testing.assert_allclose([found.x, found.z], [[0.1, 0.2, 0.3], [0.09, 0.09, 0.08]])
    file.write_text("\n".join(f"{stamp},{x},0.09" for stamp, x in zip(STAMPS, (0.1, 0.2, 0.3), strict=True)))
    np.testing.assert_allclose(np.diff(read_log(file).time), 1.0, atol=1e-6)
    file.write_text("t,x,z\n2026-13-25T10:15:00Z,0.1,0.1\n2026-13-25T10:15:01Z,0.1,0.1")
    with pytest.raises(InvalidInputError, match="3 numbers in each row"):
        read_log(file)
