"""The explorer: the tables in which its page interpolates, and the page in a browser against the solver.

The page is driven in headless Chromium as a reader would: the gripper is dragged to places, and what is drawn there is
compared with states computed for them.  Lengths in L*.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from html import unescape
from itertools import pairwise
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.files.schema import Values
from stripfold.paths.rpath import Part, PlannedState, plan_r_path
from tasks import explorer as page
from tasks.explorer_states import Row, contact_states, free_states, lifted_states
from verification.common import dataset
from verification.numbers import Facts, Number, seed_of

UNITS = {"rad": "above_angles below_angles contact_angles lifted_angles loop_angles"}

LOWEST, HIGHEST = 0.3, 25.0
"""Heights in the tables."""
HEIGHTS = {"below": 44, "above": 50, "contact": 40}
"""Number of heights below the touch limit, above it, and of states with the sag in contact."""
STATES = {"below": 81, "above": 49, "contact": 17}
"""Number of states at a height."""
LENGTHS = np.geomspace(8.0, 46.0, 24)
"""Strips whose R-paths are stored: longer ones are lifted higher than the tables reach."""
MIDDLE = {"carry": 36, "roll": 12}
"""Places of an R-path in its middle phases."""
DRAWN, COMPUTED = 400, 5000
"""Points on a drawn part, and per L* of a computed one."""
UNSEEN: dict[str, Any] = {"drawn": [], "falls": [], "warns": False, "keyboard": np.nan, "narrow": np.nan}
"""Answers of a page that no browser shows."""
NARROW = 360
"""Width of a narrow screen, pixels."""


class Place(NamedTuple):
    """A gripper position that is reached over others, and the strip there."""

    kind: str
    way: list[tuple[float, float]]
    state: PlannedState


def run(length_star: float = 20.0, seed: int = 1, cases: int = 3, coarser: int = 1) -> xr.Dataset:
    """Tables, and the errors of what the page draws, over ``place``; of no place where there is no Chromium.

    ``length_star``: the strip on the page.  ``seed``, ``cases``: of the gripper positions: so many of each kind, free
    below and above the touch limit, in contact, folded.  ``coarser``: tables have so many times fewer heights
    and lengths.
    """
    tables = make_tables(coarser)
    browser = which("chromium") or which("chromium-browser") or which("google-chrome")
    wanted = draw_places(length_star, np.random.default_rng(seed), cases) if browser else []
    answers = drive(browser, tables, length_star, [place.way for place in wanted]) if browser else UNSEEN
    errors = [distance(place.state, np.array(found)) for place, found in zip(wanted, answers["drawn"], strict=True)]
    checked = {
        "error": ("place", errors),
        **{name: ((), float(answers[name])) for name in ("warns", "keyboard", "narrow")},
    }
    return tables.merge(dataset(checked)).assign_attrs(seed=seed, falls=" ".join(answers["falls"]))


def make_tables(coarser: int = 1) -> xr.Dataset:
    """The tables of the page, one group of variables for each kind of state."""
    limit, loop = elastica.touch_limit(), elastica.folded_loop()
    heights = {
        "below": np.geomspace(LOWEST, limit, HEIGHTS["below"] // coarser),
        "above": np.geomspace(limit, HIGHEST, HEIGHTS["above"] // coarser),
        "contact": np.geomspace(LOWEST, HIGHEST, HEIGHTS["contact"] // coarser),
    }
    of: dict[str, Callable[[float, int], Row]] = {"below": free_states, "above": free_states, "contact": contact_states}
    values: dict[str, Any] = {}
    for name, at in heights.items():
        values |= _variables(name, at, [of[name](float(z), STATES[name]) for z in at])
    lifted = zip(("height", "length", "angles"), lifted_states(HIGHEST + 2.0), strict=True)
    values |= {f"lifted_{name}": (("lifted_height", "node")[: found.ndim], found) for name, found in lifted}
    values["loop_angles"] = ("node", contact_states(1.0, 2).angles[-1, 0])
    lengths = LENGTHS[::coarser]
    values["r_path_length"] = ("r_path_length", lengths)
    places = np.array([_middle(length) for length in lengths])
    values["r_path"] = (("r_path_length", "r_path_place", "axis"), places)
    attrs = {"touch_limit": limit, "arc": loop.arc, "offset": loop.offset, "fold_height": loop.height}
    return dataset(values, attrs, units=UNITS)


def _variables(name: str, heights: Array, rows: list[Row]) -> Values:
    dims = (f"{name}_height", f"{name}_state")
    return {
        f"{name}_height": (dims[0], heights),
        f"{name}_advance": (dims, np.array([row.advance for row in rows])),
        f"{name}_lengths": ((*dims, f"{name}_part"), np.array([row.lengths for row in rows])),
        f"{name}_angles": ((*dims, f"{name}_part", "node"), np.array([row.angles for row in rows], dtype="f4")),
    }


def _middle(length: float) -> Array:
    """Places of the R-path's middle phases, shape (n, 2)."""
    pieces = {piece.name: piece for piece in plan_r_path(length).path.pieces}
    shares = {name: np.linspace(pieces[name].start, pieces[name].end, count) for name, count in MIDDLE.items()}
    return np.array([pieces[name].position(s) for name, at in shares.items() for s in at])


def draw_places(length: float, rng: np.random.Generator, count: int) -> list[Place]:
    """Random gripper positions of each kind, and the strip there."""
    out, limit, half = [], elastica.touch_limit(), length / 2.0
    for kind, low, high in (("below", LOWEST, limit), ("above", limit, 0.4 * length)):
        for _ in range(count):
            z = float(np.exp(rng.uniform(np.log(low), np.log(high))))
            first, last = elastica.state_no_horizontal_force(z), elastica.critical(z).state
            state = elastica.state_at_advance(z, float(rng.uniform(first.advance, last.advance)))
            x = state.advance - half
            way = [(first.advance - half, z), (x, z)]
            out.append(Place(kind, way, PlannedState.of(length, Part(state, state.length - half, -1.0))))
    plan, z = plan_r_path(length), 0.8 * limit
    start = elastica.state_no_horizontal_force(z).advance - half
    for kind, parts in (("contact", 0.0), ("fold", 1.0)):
        chosen = [one for one in plan.states if len(one.parts) == 2 and (one.parts[1].direction > 0.0) == bool(parts)]
        chosen = chosen[1:]  # the first is where the sag touches: there it lies or not by the last digit
        for i in rng.choice(len(chosen), count):
            x, height = chosen[i].gripper
            way = [(start, z), (half if kind == "fold" else x, z), (x, height)]
            out.append(Place(kind, way, chosen[i]))
    return out


def distance(truth: PlannedState, drawn: Array) -> float:
    """Largest distance of drawn points, shape (n, 2), from the strip's mid-surface."""
    from scipy.spatial import KDTree

    _, places = truth.mid_surface(per_length=COMPUTED)
    # Points on the straight parts, too.
    steps = [np.linspace(a, b, max(2, int(COMPUTED * np.hypot(*(b - a))))) for a, b in pairwise(places)]
    return float(KDTree(np.vstack(steps)).query(drawn)[0].max())


def drive(browser: str, tables: xr.Dataset, length: float, ways: list[list[tuple[float, float]]]) -> dict[str, Any]:
    """What the page answers in a headless browser; raises SolveError: it did not answer."""
    text = page.of_tables(tables)
    driver = (page.SOURCES / "driver.js").read_text(encoding="utf-8")
    off, falls, near = float(contact_states(3.0, 2).advance[0]), elastica.critical(3.0).state.advance, 2e-3
    loop = [off + near, off - near, falls - near, falls + near]
    asked = json.dumps({"length": length, "ways": ways, "points": DRAWN, "narrow": NARROW, "loop": loop})
    with TemporaryDirectory() as folder:
        (Path(folder) / "page.html").write_text(text, encoding="utf-8")
        shown = text.replace("</body>", f"<script>const ASKED = {asked};\n{driver}</script></body>")
        (Path(folder) / "driven.html").write_text(shown, encoding="utf-8")
        options = ["--headless=new", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}/profile"]
        options += ["--allow-file-access-from-files", "--virtual-time-budget=60000", "--dump-dom"]
        command = [browser, *options, f"file://{folder}/driven.html"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    _, found, rest = done.stdout.partition('<pre id="answers">')
    if not found:
        raise SolveError("the page did not answer", details={"chromium": done.stderr[-400:]})
    answers: dict[str, Any] = json.loads(unescape(rest.partition("</pre>")[0]))
    if "error" in answers:
        raise SolveError(f"the page failed: {answers['error']}")
    return answers


def facts(d: xr.Dataset) -> Facts:
    return {
        "error": d.error.max() if d.sizes["place"] else np.nan,
        "places": d.sizes["place"],
        "seed": seed_of(d),
        "warns": d.warns,
        "falls": d.attrs["falls"],
        "keyboard": d.keyboard,
        "narrow": d.narrow,
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("explorer_error", "error", "L*",
            "< 2e-3 L*; warns of a fall, keyboard, narrow screen",
            "largest distance of a strip drawn in the explorer from the solver's, {places} gripper positions ({seed}), "
            "dragged to in headless Chromium; paths that fall there: {falls}",
            lambda f: bool(f.warns) and abs(f.keyboard - 0.2) < 1e-6 and f.narrow <= 0
            and f.falls == "triangular circular r-path"),
    ),
}
# fmt: on
