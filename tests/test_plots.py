"""Figures show what they should, from small made-up datasets; files are the same bytes in every run."""

from __future__ import annotations

import re
import subprocess
import sys
from itertools import pairwise

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from stripfold.errors import InvalidInputError
from stripfold.models.laws import LAWS
from stripfold.plots import critical_points, deflection, geometry, master_curve, motion, paths, style
from stripfold.plots.save import save
from stripfold.plots.states import branch
from studies import printed_law as law_study
from studies.plots import printed_law

UNIT = 0.03
LENGTH = 0.6
LIMIT = 1.6


@pytest.fixture
def states() -> xr.Dataset:
    """Two heights, 8 and 6 steps padded to 9, 40 nodes padded to 44; the lower height has no snap."""
    steps, nodes = (6, 8), 40
    shape = (2, 9)
    lam, deflections, negatives = (np.full(shape, np.nan) for _ in range(3))
    x, z = np.full((*shape, 44), np.nan), np.full((*shape, 44), np.nan)
    heights = np.array([1.2, 3.0]) * UNIT
    s = np.linspace(0.0, LENGTH, nodes)
    for i, count in enumerate(steps):
        way = np.arange(count) / 5.0
        # On the second height lambda rises to step 5 and falls after it.
        lam[i, :count] = 0.06 + 0.2 * np.where(way <= 1.0, way, 2.0 - way)
        deflections[i, :count] = 0.1 * way
        negatives[i, :count] = way > 1.0
        for j in range(count):
            x[i, j, :nodes] = np.maximum(s - LENGTH / 2.0, lam[i, j] - LENGTH / 2.0 + 0.2 * s)
            z[i, j, :nodes] = heights[i] * np.maximum(1.0 - s / (0.15 + 0.1 * way[j]), 0.0) ** 2
    at = ("height", "step")
    return xr.Dataset(
        {
            "lambda": (at, lam),
            "deflection": (at, deflections),
            "negatives": (at, negatives),
            "x": ((*at, "node"), x),
            "z": ((*at, "node"), z),
            "snap": ("height", [0, 1]),
            "lambda_0": ("height", [0.06, 0.06]),
            "lambda_c": ("height", [np.nan, 0.26]),
        },
        coords={"height": heights},
        attrs={"length": LENGTH, "gravity_length": UNIT, "thickness": 0.0018},
    )


def curve_at(z: np.ndarray) -> np.ndarray:
    return np.where(z >= LIMIT, 7.0 + z, np.nan)


@pytest.fixture
def curve() -> xr.Dataset:
    """A made-up elastica: lambda_c = 7 + z from the touch limit on."""
    z = np.linspace(1.0, 9.0, 41)
    return xr.Dataset({"lambda_c": ("z", curve_at(z))}, coords={"z": z}, attrs={"touch_limit": LIMIT})


@pytest.fixture
def materials() -> xr.Dataset:
    """Three materials, 0.01 L*, 0.02 L*, 0.03 L* below the made-up elastica; heights in no order, padded."""
    units = np.array([0.05, 0.03, 0.1])
    z = np.array([3.0, 1.2, 2.0, 5.0, np.nan])
    snap = np.where(np.isnan(z), np.nan, z > LIMIT)
    end = np.where(snap == 1.0, curve_at(z), 8.4) - 0.01 * np.arange(1, 4)[:, None]
    end = np.where(np.isnan(z), np.nan, end)
    lambda_0, snaps = np.broadcast_to(z - 0.5, (3, 5)), np.broadcast_to(snap, (3, 5))
    scale = units[:, None]
    rows = {
        "height": scale * z,
        "snap": snaps,
        "lambda_end": scale * end,
        "lambda_c": scale * np.where(snaps == 1.0, end, np.nan),
        "lambda_0": scale * lambda_0,
        "lambda_error": scale * np.where(np.isnan(z), np.nan, 0.002) * np.ones((3, 1)),
    }
    data = xr.Dataset({name: (("material", "height_index"), row) for name, row in rows.items()})
    data["eta_b"] = ("material", [820.0, 12700.0, 94.93])
    data["gravity_length"], data["length"] = ("material", units), ("material", 20.0 * units)
    data["label"] = ("material", ["η_b = 820 m⁻⁴ s²", "η_b = 12700 m⁻⁴ s²", "textile, secant η_b"])
    return data.assign_coords(material=["soft", "softer", "textile"])


def named(fig: Figure | Axes, name: str) -> list[Artist]:
    """Artists with this name as their id, or as a label that no legend shows."""
    return fig.findobj(lambda artist: artist.get_gid() == name or artist.get_label() == f"_{name}")


def lines(ax: Axes, style: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Data of the lines of more than one point with this style."""
    drawn = [line for line in ax.lines if line.get_linestyle() == style and len(line.get_xdata()) > 1]
    return [(np.asarray(line.get_xdata()), np.asarray(line.get_ydata())) for line in drawn]


def legend_texts(fig: Figure) -> list[str]:
    legends = [*fig.legends, *(ax.get_legend() for ax in fig.axes if ax.get_legend())]
    return [text.get_text() for legend in legends for text in legend.get_texts()]


class TestBranch:
    def test_padding_is_gone_and_stability_told(self, states):
        chosen = branch(states)
        assert chosen.height == pytest.approx(3.0 * UNIT)
        assert len(chosen.states) == 8
        assert {state.shape for state in chosen.states} == {(40, 2)}
        assert chosen.critical == 5
        assert chosen.runs() == [(slice(0, 6), True), (slice(5, 9), False)]

    def test_two_unstable_runs(self, states):
        states["negatives"][1, :8] = [0, 0, 1, 0, 0, 0, 1, 1]
        runs = branch(states).runs()
        assert runs == [
            (slice(0, 2), True),
            (slice(1, 4), False),
            (slice(3, 6), True),
            (slice(5, 9), False),
        ]

    def test_even_states_lie_between(self, states):
        assert branch(states).evenly(0, 5, 2) == [2, 3]
        assert branch(states).evenly(0, 1, 2) == []

    def test_no_snap_is_refused(self, states):
        states["snap"][:] = 0
        with pytest.raises(InvalidInputError, match="snap"):
            branch(states)


class TestGeometry:
    def test_both_configurations(self, states):
        fig = geometry.draw(states)
        assert [ax.get_aspect() for ax in fig.axes] == [1.0, 1.0]
        for name in ("mid-surface", "holding-point", "grasping-point", "floor"):
            assert len(named(fig, name)) == 2, name
        texts = [text.get_text() for ax in fig.axes for text in ax.texts]
        assert {"$l$", "$h$", "$x$", "$z$"} <= set(texts)
        assert any("drawn\n10 times too large" in text for text in texts)
        flat, bent = (np.array(line.get_data()).T for line in named(fig, "mid-surface"))
        np.testing.assert_allclose(flat, [[-0.3, 0.0], [0.3, 0.0]])
        assert bent[0, 1] == pytest.approx(3.0 * UNIT)

    def test_outline_is_offset_by_half_the_thickness(self):
        angle = np.linspace(0.0, np.pi, 400)
        arc = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        radius = np.linalg.norm(geometry.outline(arc, 0.2), axis=1)
        np.testing.assert_allclose(radius, np.repeat([0.9, 1.1], 400), atol=1e-5)


class TestMotion:
    def test_states(self, states):
        fig = motion.draw(states)
        (ax,) = fig.axes
        assert ax.get_aspect() == 1.0
        starts = {"lambda_0": 6.0 - 30.0, "lambda_c": 26.0 - 30.0}
        for name, x in starts.items():
            (line,) = named(fig, name)
            assert line.get_xdata()[0] == pytest.approx(x)
            assert to_hex(line.get_color()) == "#000000"
        dashed = lines(ax, "--")
        assert len(dashed) == 2
        assert all(x[0] < starts["lambda_c"] for x, _ in dashed)
        shades = [str(line.get_color()) for line in ax.lines]
        greys = [float(shade) for shade in shades if shade.startswith("0.")]
        assert len(greys) == 4
        assert all(a > b for a, b in pairwise(greys))
        assert all(np.isfinite(x).all() for x, _ in lines(ax, "-"))


class TestDeflection:
    def test_curve(self, states):
        fig = deflection.draw(states)
        ax = fig.axes[0]
        assert "rms displacement" in ax.get_xlabel()
        ((x, y),) = lines(ax, "--")
        np.testing.assert_allclose(x, [10.0, 12.0, 14.0])
        np.testing.assert_allclose(y, [26.0, 22.0, 18.0])
        solid = [line for line in ax.lines if line.get_label() == "stable"]
        np.testing.assert_allclose(solid[0].get_xdata(), 2.0 * np.arange(6))
        for name, value in (("lambda_0", 6.0), ("lambda_c", 26.0)):
            (level,) = named(fig, name)
            assert to_hex(level.get_color()) == style.GREEN.lower()
            assert set(level.get_ydata()) == {value}
        assert legend_texts(fig) == ["stable", "unstable", "critical point"]

    def test_without_unstable_points(self, states):
        ax = deflection.draw(states.isel(step=slice(0, 6))).axes[0]
        assert not lines(ax, "--")
        assert not ax.child_axes


class TestPaths:
    def test_paths_and_their_ends(self, materials):
        fig = paths.draw(materials, "softer")
        (ax,) = fig.axes
        assert ax.get_aspect() == 1.0
        assert len(named(fig, "path")) == 4
        ((x, z),) = lines(ax, ":")
        np.testing.assert_allclose(z, 3.0 * np.array([2.0, 3.0, 5.0]))
        # x = lambda - l/2, in cm
        np.testing.assert_allclose(x, 3.0 * (np.array([9.0, 10.0, 12.0]) - 0.02 - 10.0))
        (cross,) = named(fig, "no-snap")
        assert cross.get_marker() == "x"
        np.testing.assert_allclose(np.array(cross.get_data()).ravel(), [3.0 * (8.38 - 10.0), 3.6])
        assert any("no snap" in text for text in legend_texts(fig))

    def test_no_cross_where_all_snap(self, materials):
        fig = paths.draw(materials.isel(height_index=[0, 2, 3]), "soft")
        assert not named(fig, "no-snap")
        assert not any("no snap" in text for text in legend_texts(fig))

    def test_unknown_material(self, materials):
        with pytest.raises(InvalidInputError, match="soft, softer, textile"):
            paths.draw(materials, "paper")


class TestCriticalPoints:
    def test_points(self, materials):
        fig = critical_points.draw(materials.isel(material=[0, 1]))
        (ax,) = fig.axes
        first, second = ax.containers
        np.testing.assert_allclose(first.lines[0].get_ydata(), 5.0 * (np.array([9.0, 10.0, 12.0]) - 0.01))
        assert first.has_yerr
        assert first.lines[0].get_linestyle() == second.lines[0].get_linestyle() == "-"
        assert first.lines[0].get_color() != second.lines[0].get_color()
        crosses = [tuple(np.array(line.get_data()).ravel()) for line in named(fig, "no-snap")]
        np.testing.assert_allclose(crosses, [(6.0, 5.0 * 8.39), (3.6, 3.0 * 8.38)])
        assert legend_texts(fig) == ["820", "12700", "sag touches first: no snap"]

    def test_a_large_material_gets_a_second_panel(self, materials):
        materials["height"][2] *= 2.0
        fig = critical_points.draw(materials)
        assert len(fig.axes) == 2
        assert fig.axes[1].get_xlim()[1] == pytest.approx(1.05 * 25.0)
        assert legend_texts(fig)[2] == r"94.9: textile, secant $\eta_b$"


class TestMasterCurve:
    def test_collapse_and_difference(self, materials, curve):
        fig = master_curve.draw(materials, curve)
        top, bottom = fig.axes
        (elastica,) = named(top, "elastica")
        np.testing.assert_allclose(elastica.get_ydata(), curve["lambda_c"])
        for below, container in zip((0.01, 0.02, 0.03), bottom.containers, strict=True):
            np.testing.assert_allclose(container.lines[0].get_ydata(), -below)
        for container in top.containers:
            np.testing.assert_allclose(container.lines[0].get_xdata(), [2.0, 3.0, 5.0])
        assert len(named(fig, "no-snap")) == 3
        for shade in named(fig, "touch"):
            assert shade.get_width() == pytest.approx(LIMIT)
        assert len(named(fig, "touch")) == 2
        assert "sag touches first" in [text.get_text() for text in top.texts]
        assert "elastica" in legend_texts(fig)

    def test_no_extrapolation(self, curve):
        assert np.isnan(master_curve.elastica_at(curve, np.array([1.5, 9.5]))).all()


class TestPrintedLaw:
    def test_stress(self):
        data = law_study.run(np.array([0.0, 45.0, 90.0, 180.0]))
        np.testing.assert_allclose(data["stress_svk"], 0.105, rtol=1e-12)
        expected = 0.105 / 1.1 * np.array([1.0, 0.5, 0.0, 1.0])
        np.testing.assert_allclose(data["stress_printed"], expected, atol=1e-15)

    def test_stiffness(self):
        data = law_study.run()
        np.testing.assert_allclose(data["stiffness_svk"], 1.0, rtol=1e-12)
        expected = np.cos(np.radians(data["angle"])) ** 2
        np.testing.assert_allclose(data["stiffness_printed"], expected, atol=1e-14)

    @pytest.mark.parametrize("name", ["svk", "printed"])
    def test_stiffness_is_the_moment_of_the_stress(self, name):
        """By finite differences of the moment of the stresses, without the law's tangent."""
        angle = np.array([20.0, 70.0])
        r = law_study.rotation(angle)
        zeta, weight = np.polynomial.legendre.leggauss(6)

        def moment(kappa: float) -> np.ndarray:
            total = np.zeros(2)
            for z, w in zip(zeta, weight, strict=True):
                p = LAWS[name].stress(r @ np.diag([1.0 - kappa * z, 1.0]), law_study._LAME)
                total -= w * z * np.einsum("mi,mi->m", r[..., 0], p[..., 0])
            return total

        slope = (moment(1e-4) - moment(-1e-4)) / 2e-4 / (2.0 / 3.0)
        np.testing.assert_allclose(slope, law_study.stiffness(LAWS[name], angle), atol=1e-7)

    def test_attributes(self):
        for variable in law_study.run().variables.values():
            assert variable.attrs["units"]
            assert variable.attrs["long_name"]

    def test_figure(self):
        fig = printed_law.draw(law_study.run())
        assert len(fig.axes) == 2
        for ax, highest in zip(fig.axes, (0.105 / 1.1, 1.0), strict=True):
            ((_, printed),) = lines(ax, "--")
            assert printed[0] == pytest.approx(highest)
            assert printed[-1] == pytest.approx(0.0, abs=1e-15)
            ((_, svk),) = lines(ax, "-")
            assert np.ptp(svk) < 1e-12
        assert [text.get_text() for text in fig.axes[0].texts] == ["0.0955", "0.0477", "0"]


class TestStyle:
    def test_materials_look_different(self):
        assert len({style.look(i) for i in range(30)}) == 30
        assert len({style.look(i).colour for i in range(7)}) == 7

    def test_nothing_global_changes(self, states):
        with mpl.rc_context({"font.size": 33.0, "lines.linewidth": 7.0}):
            before = dict(mpl.rcParams)
            fig = motion.draw(states)
            assert dict(mpl.rcParams) == before
        assert fig.axes[0].xaxis.label.get_size() == 9.0

    def test_pyplot_is_not_needed(self):
        modules = "critical_points, deflection, geometry, master_curve, motion, paths, save"
        found = "'matplotlib.pyplot' in sys.modules"
        code = f"import sys; from stripfold.plots import {modules}; sys.exit({found})"
        assert subprocess.run([sys.executable, "-c", code]).returncode == 0


class TestSave:
    def test_same_bytes(self, states, materials, curve, tmp_path):
        draws = {
            "geometry": lambda: geometry.draw(states),
            "deflection": lambda: deflection.draw(states),
            "curve": lambda: master_curve.draw(materials, curve),
        }
        for name, draw in draws.items():
            fig = draw()
            runs = [
                save(fig, tmp_path / "a" / name),
                save(fig, tmp_path / "b" / name),
                save(draw(), tmp_path / "c" / name),
            ]
            for kind in zip(*runs, strict=True):
                assert len({path.read_bytes() for path in kind}) == 1, name

    def test_files(self, states, tmp_path):
        png, svg = save(deflection.draw(states), tmp_path / "new" / "figure.v1")
        assert [path.name for path in (png, svg)] == ["figure.v1.png", "figure.v1.svg"]
        assert png.read_bytes().startswith(b"\x89PNG")
        assert b"Software" not in png.read_bytes()
        text = svg.read_text()
        assert "<dc:date>" not in text
        assert "<text" not in text
        ids = re.findall(r' id="([^"]*)"', text)
        assert len(ids) == len(set(ids)) > 20
        assert sorted(path.name for path in png.parent.iterdir()) == ["figure.v1.png", "figure.v1.svg"]

    def test_user_settings_do_not_matter(self, states, tmp_path):
        first = save(deflection.draw(states), tmp_path / "first")
        users = {"svg.hashsalt": "other", "savefig.dpi": 50, "svg.fonttype": "none", "axes.edgecolor": "red"}
        with mpl.rc_context(users):
            second = save(deflection.draw(states), tmp_path / "second")
        assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]

    def test_a_failure_leaves_the_old_file(self, states, tmp_path, monkeypatch):
        png, _ = save(deflection.draw(states), tmp_path / "figure")
        before = png.read_bytes()
        fig = motion.draw(states)

        def broken(path, **_):
            path.write_bytes(b"half")
            raise OSError("no space left on device")

        monkeypatch.setattr(fig, "savefig", broken)
        with pytest.raises(OSError, match="no space"):
            save(fig, tmp_path / "figure")
        assert png.read_bytes() == before
        assert sorted(path.name for path in tmp_path.iterdir()) == ["figure.png", "figure.svg"]
