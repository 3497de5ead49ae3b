"""Damaged files and files that declare what is not in them, as Hypothesis draws them: data and pictures."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import netCDF4
import numpy as np
from hypothesis import strategies as st
from PIL import Image

from stripfold.files.store import DIGEST
from studies.fuzz import FOLDER, PIPE, Case

Draw = Callable[[st.SearchStrategy[Any]], Any]

BOARD = "--board chessboard --columns 8 --rows 5 --square 0.024"


def damaged(draw: Draw, content: bytes) -> bytes:
    """Cut, with bytes changed, put in, or doubled."""
    kind, at = draw(st.integers(0, 3)), draw(st.integers(0, max(len(content) - 1, 0)))
    if kind == 0:
        return content[:at]
    if kind == 1:
        return content[:at] + bytes(draw(st.binary(min_size=1, max_size=8))) + content[at:]
    changed = bytearray(content)
    for _ in range(draw(st.integers(1, 8)) if content else 0):
        changed[draw(st.integers(0, len(content) - 1))] = draw(st.integers(0, 255))
    return bytes(changed) + (content[at:] if kind == 2 else b"")


@cache
def _stored(result: Path) -> tuple[dict[str, Any], dict[str, tuple[tuple[str, ...], Any]], bytes]:
    """Global attributes and variables of a result, and its bytes."""
    with netCDF4.Dataset(result) as file:
        attrs = {name: file.getncattr(name) for name in file.ncattrs()}
        file.set_auto_mask(False)
        variables = {name: (var.dimensions, var[...]) for name, var in file.variables.items()}
    return attrs, variables, result.read_bytes()


_NUMBERS = (np.nan, np.inf, -np.inf, 1e300, -1.0, 0.0)


def of_data(result: Path) -> st.SearchStrategy[Case]:
    """The result of a simulation with its bytes damaged, or without, or with other variables and attributes."""

    @st.composite
    def drawn(draw: Draw) -> Case:
        attrs, variables, content = _stored(result)
        kind = draw(st.integers(0, 9))
        if kind == 0:
            content = bytes(draw(st.sampled_from((b"", PIPE, FOLDER, b"CDF\x01" + b"\xff" * 60, b"\x89HDF\r\n\x1a\n"))))
        elif kind < 5:
            content = damaged(draw, content)
        else:
            known = {name: value for name, value in attrs.items() if name != DIGEST}
            content = _rewritten(draw, known, dict(variables))
        return Case(("film", "result.nc"), {"result.nc": content})

    return drawn()


def _rewritten(draw: Draw, attrs: dict[str, Any], variables: dict[str, tuple[tuple[str, ...], Any]]) -> bytes:
    sizes = {dim: length for dims, data in variables.values() for dim, length in zip(dims, np.shape(data), strict=True)}
    for _ in range(draw(st.integers(1, 3))):
        change, name = draw(st.integers(0, 6)), draw(st.sampled_from(sorted(variables)))
        dims, data = variables[name]
        if change == 0:
            attrs[draw(st.sampled_from(sorted(attrs)))] = draw(st.sampled_from(("", "x", 0, np.nan, 1e300, [1.0, 2.0])))
        elif change == 1:
            del attrs[draw(st.sampled_from(sorted(attrs)))]
        elif change == 2 and len(variables) > 1:
            del variables[name]
        elif change == 3:
            sizes["large"] = draw(st.sampled_from((0, 1, 3, 10**11)))
            variables[name] = (("large",), None)
        elif change == 4 and data is not None:
            variables[name] = (dims, np.full(np.shape(data), draw(st.sampled_from(("", "fall", "x"))), dtype=object))
        elif data is not None and np.asarray(data).dtype.kind == "f" and np.size(data):
            changed = np.array(data)
            changed.flat[draw(st.integers(0, changed.size - 1))] = draw(st.sampled_from(_NUMBERS))
            variables[name] = (dims, changed)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "changed.nc"
        with netCDF4.Dataset(path, "w") as file:
            for dim, length in sizes.items():
                # None is unlimited; netCDF has no other dimension without a length.
                file.createDimension(dim, length or None)
            for name, (dims, data) in variables.items():
                text = data is not None and np.asarray(data).dtype.kind in "OUS"
                kind: Any = str if text else "f8"
                parts = (1000,) if data is None and sizes["large"] > 1000 else None
                var = file.createVariable(name, kind, dims, zlib=parts is not None, chunksizes=parts)
                var.setncatts({"units": "1", "long_name": name})
                if data is not None:
                    var[...] = np.asarray(data, dtype=object) if text else data
            file.setncatts(attrs)
        return path.read_bytes()


@cache
def _pictures() -> tuple[bytes, ...]:
    """Small pictures of all formats and kinds of pixels."""
    grey = Image.linear_gradient("L").resize((80, 60))
    found = []
    kinds = "L/PNG RGBA/PNG P/PNG 1/PNG LA/PNG I;16/PNG RGB/JPEG L/JPEG/progressive CMYK/JPEG F/TIFF I;16/TIFF"
    kinds += " RGB/TIFF/tiff_lzw RGB/TIFF/tiff_adobe_deflate L/BMP RGB/WEBP L/GIF"
    for mode, kind, *how in (words.split("/") for words in kinds.split()):
        more = {"progressive": True} if how == ["progressive"] else {"compression": how[0]} if how else {}
        written = io.BytesIO()
        picture = Image.fromarray(np.asarray(grey, dtype=np.uint16) * 200) if mode == "I;16" else grey.convert(mode)
        picture.save(written, kind, **more)
        found.append(written.getvalue())
    return tuple(found)


def _png(width: int, height: int, depth: int, colour: int, data: bytes) -> bytes:
    """A PNG whose header says anything, with right check sums."""

    def chunk(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")


def _scans(count: int) -> bytes:
    written = _pictures()[7]
    scan = written[written.rindex(b"\xff\xda") : -2]
    return written[:-2] + count * scan + written[-2:]


@st.composite
def of_pictures(draw: Draw) -> Case:
    """A picture of a fold, or of a board, that is damaged, or declares what is not in it."""
    kind = draw(st.integers(0, 9))
    sides = st.sampled_from((0, 1, 31, 32, 80, 7000, 32_000, 65_535, 2**31 - 1, 2**32 - 1))
    if kind == 0:
        content = bytes(draw(st.sampled_from((b"", PIPE, FOLDER, b"GIF89a", b"RIFF\xff\xff\xff\xffWEBPVP8 "))))
    elif kind == 1:
        content = _scans(draw(st.sampled_from((1, 20, 2000))))
    elif kind < 4:
        depth, colour = draw(st.sampled_from((1, 8, 16, 3))), draw(st.integers(0, 7))
        content = _png(draw(sides), draw(sides), depth, colour, b"\0" * draw(st.sampled_from((0, 100, 10**6))))
    elif kind == 4:
        content = bytes(draw(st.sampled_from(_pictures())))
    else:
        content = damaged(draw, bytes(draw(st.sampled_from(_pictures()))))
    if draw(st.integers(0, 3)) == 0:
        return Case(("calibrate", "views", *BOARD.split()), {f"views/{i}.png": content for i in range(2)})
    method = draw(st.sampled_from(("fold", "cantilever")))
    return Case(("eta", "--image", "fold.png", "--scale", "3e-4", "--method", method), {"fold.png": content})
