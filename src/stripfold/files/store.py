"""Files: netCDF in and out with units and provenance; every write is whole or not at all."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from stripfold.base.arguments import file_name
from stripfold.base.errors import InvalidInputError, StripfoldError
from stripfold.base.version import running_commit, version

if TYPE_CHECKING:
    import xarray as xr

CONVENTIONS = "CF-1.11, ACDD-1.3"
REFERENCES = (
    "V. Petrik, V. Smutny, V. Kyrki: Static Stability of Robotic Fabric Strip Folding, "
    "IEEE/ASME Transactions on Mechatronics 25(5), 2020, https://doi.org/10.1109/TMECH.2020.2980957"
)
LICENSE = "MIT, https://spdx.org/licenses/MIT"
KEYWORDS = "elastica, fabric folding, numerical continuation, reproducible research, stability"
DIGEST = "digest"
"""Global attribute of a file that ends with its digest: where HDF5's data end is noted at its beginning."""
_BEFORE_DIGEST = b"\nSHA-256 of all bytes before this line: "
_TRAILER_SIZE = len(_BEFORE_DIGEST) + 65
LABEL = "_label"
"""What the name of a dimension's texts ends with in a file: CF allows only numbers under the name of a dimension."""
PACKAGES = ("numpy", "scipy", "scikit-fem", "xarray", "netCDF4")
REQUIRED = ("units", "long_name")
MOST_BYTES = 4e9
"""Largest dataset that is read: a damaged file may declare any size."""
PROVENANCE = ("title", "stripfold_version", "git_commit", "packages", "config")
"""Global attributes that every stored dataset has."""


@contextmanager
def atomic(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path to write to; it takes the place of ``path`` when the block ends well.

    Missing folders are made.  When the block raises, or is interrupted, ``path`` is left as it was and the temporary
    file removed; an ``OSError`` names ``path``.  The temporary path has the same name and suffix, in a hidden folder on
    the same file system.
    """
    path = file_name("file", path)
    path.parent.mkdir(parents=True, exist_ok=True)
    # A folder, not a file: the name keeps its suffix, which tells libraries the format, and the file gets the
    # permissions that the user's umask says.
    folder = Path(tempfile.mkdtemp(prefix=".stripfold-", dir=path.parent))
    try:
        yield folder / path.name
        os.replace(folder / path.name, path)
    except OSError as error:
        # Of a full disk Python names no file, and nobody knows the temporary one.
        if error.filename is not None and folder.name not in str(error.filename):
            raise
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def literal(path: str | os.PathLike[str]) -> str:
    """The absolute path, for libraries to which a relative one may be a protocol, an address, an option or a home.

    Raises InvalidInputError: it is not in UTF-8, as these libraries need it.
    """
    found = os.path.abspath(path)
    try:
        found.encode()
    except UnicodeEncodeError:
        raise InvalidInputError("file", os.fspath(path), "a path in UTF-8", "rename it, or its folder") from None
    return found


def write_text(text: str, path: str | os.PathLike[str]) -> None:
    """Write ``text`` as UTF-8 with Unix line ends, atomically."""
    with atomic(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_json(mapping: Mapping[str, Any], path: str | os.PathLike[str]) -> None:
    """Write ``mapping`` as JSON, atomically; numpy's scalars and arrays become numbers and lists.

    Raises StripfoldError: a value that JSON has no word for, such as nan: store None where there is no number.
    """
    write_text(_json(mapping, indent=2) + "\n", path)


def write(
    dataset: xr.Dataset, path: str | os.PathLike[str], *, title: str, config: Mapping[str, Any] | None = None
) -> None:
    """Write ``dataset`` as compressed netCDF-4, atomically; the same content gives the same bytes.

    ``dataset``: each variable and coordinate has the attributes ``units`` ("1" for pure numbers and names) and
    ``long_name``.  ``path``: where to.  ``title``: what the file holds, in one line.  ``config``: the resolved
    configuration that gave it.  Raises StripfoldError: an attribute is missing, or ``config`` is not JSON.
    """
    missing = [
        f"{name} ({key})" for name, var in dataset.variables.items() for key in REQUIRED if not var.attrs.get(key)
    ]
    if missing:
        raise StripfoldError(f"cannot store {Path(path).name}: without {' or '.join(REQUIRED)}: {', '.join(missing)}")
    commit = running_commit()
    made = f"stripfold {version()}, commit {commit}"
    stamped = _labels_apart(dataset).assign_attrs(
        Conventions=CONVENTIONS,
        title=title,
        summary=f"{title[:1].upper()}{title[1:]}: computed with stripfold, a replication of the paper in references.",
        keywords=KEYWORDS,
        source=made,
        # No clock time: the same content gives the same bytes.
        history=f"{made}: written once",
        references=REFERENCES,
        license=LICENSE,
        creator_name="The stripfold developers",
        stripfold_version=version(),
        git_commit=commit,
        packages=_json({name: metadata.version(name) for name in PACKAGES}),
        config=_json(config or {}),
        **{DIGEST: "SHA-256, in the last line of the file"},
    )
    encoding: dict[Any, dict[str, Any]] = {}
    for name, var in stamped.variables.items():
        # netCDF-4 has neither compression nor checksums for scalars and texts.
        numbers = var.ndim and var.dtype.kind in "fiub"
        encoding[name] = {"zlib": True, "complevel": 4, "fletcher32": True} if numbers else {}
        if name in stamped.coords and var.dtype.kind == "f":
            encoding[name]["_FillValue"] = None  # CF: a coordinate has no gaps
    with atomic(path) as temporary:
        try:
            stamped.to_netcdf(literal(temporary), engine="netcdf4", format="NETCDF4", encoding=encoding)
        except RuntimeError as error:
            # Of a full disk the library says no more than that it failed.
            raise OSError(errno.EIO, f"could not be written ({error})", str(path)) from error
        with temporary.open("ab+") as file:
            file.write(_trailer(file, file.tell()))


def _trailer(file: BinaryIO, size: int) -> bytes:
    """What follows the first ``size`` bytes of a whole file."""
    found = hashlib.sha256()
    file.seek(0)
    while size and (block := file.read(min(size, 1 << 20))):
        found.update(block)
        size -= len(block)
    return _BEFORE_DIGEST + found.hexdigest().encode() + b"\n"


def _has_digest(path: Path) -> bool:
    """Whether a file ends with its digest; ValueError if it is not that of its bytes.

    Found without HDF5, whose library may loop without end in a damaged file.
    """
    with path.open("rb") as file:
        size = max(0, file.seek(0, os.SEEK_END) - _TRAILER_SIZE)
        file.seek(size)
        trailer = file.read()
        if not trailer.startswith(_BEFORE_DIGEST):
            return False
        if trailer != _trailer(file, size):
            raise ValueError("its bytes are not those of its digest")
        return True


def _labels_apart(dataset: xr.Dataset) -> xr.Dataset:
    """Texts along their own dimension under a name of their own: :func:`_labels_back` undoes it."""
    labels = [name for name in dataset.dims if name in dataset.coords and dataset[name].dtype.kind not in "fiub"]
    return dataset.drop_indexes(labels).rename_vars({name: f"{name}{LABEL}" for name in labels})


def _labels_back(dataset: xr.Dataset) -> xr.Dataset:
    labels = {name: f"{name}{LABEL}" for name in dataset.dims if f"{name}{LABEL}" in dataset.coords}
    back = {name: dataset.variables[label].copy() for name, label in labels.items()}
    return dataset.drop_vars(list(labels.values())).assign_coords(back)


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator[xr.Dataset]:
    """A netCDF file, not read yet, whose bytes are those of its digest if it has one.

    Raises InvalidInputError: no such file, not netCDF, or damaged, also where that is found only while the block reads.
    """
    import xarray as xr

    path = Path(path)
    if not path.is_file():
        raise InvalidInputError("file", str(path), "an existing netCDF file", "check the name")
    name = literal(path)
    try:
        has_digest = _has_digest(path)
        with xr.open_dataset(name, engine="netcdf4") as dataset:
            if DIGEST in dataset.attrs and not has_digest:  # a file of another program has neither
                raise ValueError("its digest is missing: changed by another program")
            yield dataset
    except (OSError, ArithmeticError, AttributeError, LookupError, MemoryError, RuntimeError, ValueError) as error:
        advice = f"damaged or cut short ({error}): delete it, and make it anew"
        raise InvalidInputError("file", str(path), "a whole netCDF-4 file", advice) from error


def read(path: str | os.PathLike[str], require: Iterable[str] = ()) -> xr.Dataset:
    """Read a dataset that :func:`write` stored, whole into memory.

    ``path``: the file.  ``require``: names of the variables, coordinates or global attributes that it must have.
    Raises InvalidInputError: no such file, not netCDF, damaged (by its digest), or not what was expected.
    """
    with opened(path) as dataset:
        if dataset.nbytes > MOST_BYTES:
            raise ValueError(f"it declares {dataset.nbytes:.2g} bytes, at most {MOST_BYTES:.2g} can be read")
        dataset.load()
    dataset = _labels_back(dataset)
    missing = [name for name in (*PROVENANCE, *require) if name not in dataset.variables and name not in dataset.attrs]
    if missing:
        raise InvalidInputError("file", str(path), f"a file of this package with {', '.join(missing)}", "make it anew")
    return dataset


def _json(value: Any, indent: int | None = None) -> str:
    try:
        return json.dumps(value, indent=indent, sort_keys=True, allow_nan=False, ensure_ascii=False, default=_plain)
    except (TypeError, ValueError) as error:
        raise StripfoldError(f"cannot be stored as JSON: {error}") from error


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{value!r} is neither a number, a text, a list nor a mapping")
