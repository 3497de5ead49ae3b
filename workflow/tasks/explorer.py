"""The explorer: one page in which a reader drags the gripper and sees the strip, with its states in tables."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold.base.arrays import Array
from stripfold.files import store
from tasks.explorer_states import nodes_and_integral

SOURCES = Path(__file__).parents[1] / "explorer"


def write(tables: xr.Dataset, output: Sequence[str]) -> None:
    """Write the page; ``tables`` are those of :mod:`verification.explorer`."""
    store.write_text(of_tables(tables), output[0])


def of_tables(tables: xr.Dataset) -> str:
    """The page as text: one file without references to others."""
    page = (SOURCES / "page.html").read_text(encoding="utf-8")
    for name in ("page.css", "strip.js", "page.js"):
        page = page.replace(f"/* {name} */", (SOURCES / name).read_text(encoding="utf-8"))
    return page.replace("/* tables */", json.dumps(_packed_tables(tables), separators=(",", ":")))


def _packed_tables(tables: xr.Dataset) -> dict[str, Any]:
    nodes, integral = nodes_and_integral()
    lifted = np.column_stack([tables.lifted_height.values, tables.lifted_length.values])
    return {
        "touchLimit": float(tables.touch_limit),
        "nodes": nodes.tolist(),
        "integral": _packed(integral),
        **{name: _states(tables, name) for name in ("below", "above", "contact")},
        "lifted": {"lengths": _packed(lifted, "f8"), "angles": _packed(tables.lifted_angles.values)},
        "loop": {
            "arc": float(tables.arc),
            "offset": float(tables.offset),
            "height": float(tables.fold_height),
            "angles": tables.loop_angles.values.tolist(),
        },
        "rPath": {
            "lengths": tables.r_path_length.values.tolist(),
            "width": 2 * tables.sizes["r_path_place"],
            "values": _packed(tables.r_path.values),
        },
    }


def _states(tables: xr.Dataset, name: str) -> dict[str, Any]:
    """States of one kind: advance and lengths of parts together, their angles apart."""
    heights = tables[f"{name}_height"].values
    lengths = [tables[f"{name}_advance"].expand_dims(f"{name}_part", -1), tables[f"{name}_lengths"]]
    return {
        "lowest": float(heights[0]),
        "highest": float(heights[-1]),
        "heights": len(heights),
        "states": tables.sizes[f"{name}_state"],
        "lengths": _packed(xr.concat(lengths, f"{name}_part").values, "f8"),
        "angles": _packed(tables[f"{name}_angles"].values),
    }


def _packed(values: Array, kind: str = "f4") -> dict[str, str]:
    return {kind: base64.b64encode(values.astype("<" + kind).tobytes()).decode()}
