"""Reading videos: frame times, grey values, limits, damaged and malicious files."""

from __future__ import annotations

import os
import random
import struct
import sys
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from filmed import CONTAINERS, landscape, write_video
from stripfold.base.errors import InvalidInputError
from stripfold.film import (
    video,
)

BASE = Fraction(1, 600)


STAMPS = [0, 20, 41, 60, 80, 140, 160, 181, 200, 220]
"""In units of BASE, with jitter and two dropped frames."""


IMAGES = [landscape(seed) for seed in range(len(STAMPS))]


@pytest.fixture(scope="module")
def films(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("films")
    return {
        codec: write_video(folder / f"{codec}.{suffix}", codec, IMAGES, STAMPS, BASE)
        for codec, suffix in CONTAINERS.items()
        if suffix != "avi"  # an avi has a constant rate
    } | {"mjpeg": write_video(folder / "mjpeg.avi", "mjpeg", IMAGES, range(len(IMAGES)), Fraction(1, 30))}


@pytest.mark.parametrize("codec", CONTAINERS)
def test_times_and_greys(films: dict[str, Path], codec: str) -> None:
    with video.read(films[codec]) as reader:
        frames = list(reader)
    stamps = [k * Fraction(1, 30) for k in range(10)] if codec == "mjpeg" else [k * BASE for k in STAMPS]
    # Matroska stores whole milliseconds; the other containers keep these times.
    if codec == "ffv1":
        stamps = [Fraction(round(1000 * stamp), 1000) for stamp in stamps]
    assert [frame.time for frame in frames] == [float(stamp) for stamp in stamps]
    assert [frame.index for frame in frames] == list(range(10))
    for frame, image in zip(frames, IMAGES, strict=True):
        difference = frame.image.astype(float) - image
        assert np.abs(difference).max() <= (0 if codec == "ffv1" else 16)
        assert abs(difference.mean()) < 0.5
        assert not frame.image.flags.writeable
    assert reader.report.problems == ()


def test_wrong_number_of_frames_in_a_header(images: Path) -> None:
    with video.read(images / "opencv_video" / "tree.avi") as reader:
        times = [frame.time for frame in reader]
    assert reader.report.decoded == len(times) == 68
    assert reader.report.problems == ("the header declares 444 frames, 68 were decoded",)
    assert not reader.report.truncated
    assert times[-1] == pytest.approx(443 * 0.066667, abs=1e-9)


def table(path: Path, rows: list[str], header: str = "frame,t") -> Path:
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def test_own_times(films: dict[str, Path], tmp_path: Path) -> None:
    times = [0.5 + 0.031 * k for k in range(10)]
    stamps = table(tmp_path / "t.csv", [f"{k},{t!r}" for k, t in enumerate(times)])
    assert [frame.time for frame in video.read(films["ffv1"], stamps)] == times
    for rows in (9, 11):
        stamps = table(tmp_path / "t.csv", [f"{k},{k}" for k in range(rows)])
        with pytest.raises(InvalidInputError, match=f"{rows} rows"):
            list(video.read(films["ffv1"], stamps))


@pytest.mark.parametrize(
    ("rows", "header", "message"),
    [
        (["0,0"], "index,t", "header"),
        (["0,0", "1,zero"], "frame,t", "row 3"),
        (["0,0", "1"], "frame,t", "row 3"),
        (["0,0", "1,nan"], "frame,t", "row 3"),
        (["0,0", "2,1"], "frame,t", "row 3"),
        (["0,0", "1,1", "2,1"], "frame,t", "row 4"),
        ([], "frame,t", "0 rows"),
    ],
)
def test_bad_tables_of_times(tmp_path: Path, rows: list[str], header: str, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        video.read_timestamps(table(tmp_path / "t.csv", rows, header))


def test_doubled_frames(tmp_path: Path) -> None:
    shown = [IMAGES[k] for k in (0, 1, 1, 2, 3)]
    path = write_video(tmp_path / "d.mkv", "ffv1", shown, range(5), Fraction(1, 25))
    with video.read(path) as reader:
        assert [frame.doubled for frame in reader] == [False, False, True, False, False]


@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_a_folder_of_frames(tmp_path: Path, suffix: str) -> None:
    folder = tmp_path / "frames"
    folder.mkdir()
    for k, image in enumerate(IMAGES):
        cv2.imwrite(str(folder / f"{k:04d}.{suffix}"), image)
    with pytest.raises(InvalidInputError, match="timestamps"):
        video.read(folder)
    stamps = table(tmp_path / "t.csv", [f"{k},{k / 7!r}" for k in range(10)])
    with video.read(folder, stamps) as reader:
        frames = list(reader)
    assert [frame.time for frame in frames] == [k / 7 for k in range(10)]
    assert np.abs(frames[3].image.astype(int) - IMAGES[3]).max() <= (0 if suffix == "png" else 16)
    assert reader.report.declared == 10
    (folder / "9.png").write_bytes(b"")
    with pytest.raises(InvalidInputError, match="pad the numbers with zeros"):
        video.read(folder, stamps)


def refused(path: Path, match: str) -> None:
    with pytest.raises(InvalidInputError, match=match):
        list(video.read(path))


def test_no_videos(tmp_path: Path) -> None:
    refused(tmp_path / "none.mp4", "No such file")
    refused(tmp_path / "nul\0.mp4", "null")
    refused(tmp_path, "no frame")
    (tmp_path / "empty.mp4").touch()
    refused(tmp_path / "empty.mp4", "empty")
    os.mkfifo(tmp_path / "pipe.mp4")
    refused(tmp_path / "pipe.mp4", "neither")
    refused(Path("/dev/zero"), "neither")
    (tmp_path / "text.mp4").write_text("frame,t\n" * 1000, encoding="utf-8")
    refused(tmp_path / "text.mp4", "cannot be opened")
    # A playlist would open other files.
    write_video(tmp_path / "film.mkv", "ffv1", IMAGES[:2], [0, 1], Fraction(1, 30))
    (tmp_path / "list.avi").write_text("ffconcat version 1.0\nfile film.mkv\n", encoding="utf-8")
    refused(tmp_path / "list.avi", "cannot be opened")
    (tmp_path / "zeros.avi").write_bytes(b"")
    os.truncate(tmp_path / "zeros.avi", 20 << 30)  # takes no room on the disk
    refused(tmp_path / "zeros.avi", "cannot be opened")


def shortened(path: Path, missing: int, folder: Path) -> Path:
    """A copy that lacks the last bytes."""
    cut = folder / f"cut{path.suffix}"
    cut.write_bytes(path.read_bytes()[:-missing])
    return cut


def test_truncated(films: dict[str, Path], tmp_path: Path) -> None:
    for codec, path in films.items():
        data = path.read_bytes()
        cut = tmp_path / path.name
        cut.write_bytes(data[: len(data) * 6 // 10])
        if path.suffix == ".mp4":  # its index is at its end
            refused(cut, "its index is missing: it was cut off .*copy it again")
            refused(shortened(path, 400, tmp_path), "its index is missing")
            continue
        with video.read(cut) as reader:
            frames = list(reader)
        assert 3 <= len(frames) < 10
        assert reader.report.truncated
        for frame, image in zip(frames, IMAGES, strict=False):
            assert frame.damaged or np.abs(frame.image.astype(float) - image).mean() < 2.0, codec
        if codec == "mjpeg":
            assert "declares 10 frames" in reader.report.problems[0]


def test_a_huge_picture(films: dict[str, Path], tmp_path: Path) -> None:
    data = bytearray(films["mjpeg"].read_bytes())
    struct.pack_into("<ii", data, data.index(b"strf") + 12, 60_000, 60_000)
    while (place := data.find(b"\xff\xc0")) >= 0:  # the pictures' own headers
        data[place + 1] = 0xC1
        struct.pack_into(">HH", data, place + 5, 60_000, 60_000)
    (tmp_path / "huge.avi").write_bytes(data)
    refused(tmp_path / "huge.avi", "its header declares")


def test_a_decoder_that_crashes(films: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    crash = tmp_path / "python"
    crash.write_text("#!/bin/sh\nkill -SEGV $$\n", encoding="utf-8")
    crash.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(crash))
    refused(films["ffv1"], "SIGSEGV")


def test_altered_files(films: dict[str, Path], tmp_path: Path) -> None:
    """Random changes of bytes give frames or one typed error."""
    outcomes = []
    for k in range(16):
        chance = random.Random(k)
        path = list(films.values())[k % len(films)]
        data = bytearray(path.read_bytes())
        for _ in range(chance.choice([1, 3, 10, 50])):
            data[chance.randrange(600 if chance.random() < 0.5 else len(data))] = chance.randrange(256)
        altered = tmp_path / f"altered{path.suffix}"
        altered.write_bytes(data)
        try:
            with video.read(altered) as reader:
                times = [frame.time for frame in reader]
            assert np.all(np.diff(times) > 0.0)
            outcomes.append("read")
        except InvalidInputError as error:
            outcomes.append("refused" if str(altered) in str(error) else str(error))
    assert set(outcomes) == {"read", "refused"}


@pytest.mark.parametrize("codec", ["ffv1", "mpeg4", "libx264"])
def test_damage_is_flagged(tmp_path: Path, codec: str) -> None:
    """Frames after an overwritten block differ, and are flagged."""
    shown = [np.roll(IMAGES[0], 2 * k, axis=1) for k in range(10)]
    path = write_video(tmp_path / f"film.{CONTAINERS[codec]}", codec, shown, range(10), Fraction(1, 30))
    clean = {frame.time: frame.image for frame in video.read(path)}
    data = bytearray(path.read_bytes())
    with av.open(path) as container:
        packet = [packet for packet in container.demux(video=0) if packet.size][4]
    for place in range(packet.pos + packet.size // 3, packet.pos + packet.size * 2 // 3):
        data[place] ^= 0x5A
    path.write_bytes(data)
    with video.read(path) as reader:
        frames = list(reader)
    wrong = [frame for frame in frames if not np.array_equal(frame.image, clean[frame.time])]
    assert reader.report.damaged + reader.report.errors > 0
    assert all(frame.damaged for frame in wrong)
    assert sum(np.array_equal(frame.image, clean[frame.time]) for frame in frames) >= 3


def test_stopping_early_ends_the_decoder(films: dict[str, Path]) -> None:
    reader = video.read(films["ffv1"])
    next(reader)
    process = reader._process
    reader.close()
    assert process.returncode is not None
    with pytest.raises(StopIteration):
        next(reader)
