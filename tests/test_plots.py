"""Figures of the x-axis motion and of many materials show what they should; the table, the style, the files."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import import_module
from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_hex

import made_up
import plots
from plots import (
    critical_points,
    deflection,
    geometry,
    master_curve,
    measured,
    motion,
    paths,
    real_paths,
    recordings_accuracy,
)
from plots.models import plain_numbers
from plots.pieces import look
from plots.readers import branch, evenly
from plotted import colours, drawn, labelled, legend_texts, lines, named, notes
from stripfold.base.errors import InvalidInputError
from stripfold.draw import colours as palette
from stripfold.draw.save import save, save_as
from stripfold.draw.style import figure

USERS = {"svg.hashsalt": "other", "savefig.dpi": 50, "svg.fonttype": "none", "font.size": 33.0, "axes.edgecolor": "red"}
"""Settings of a user, which must not matter."""
ROOT = Path(__file__).resolve().parents[1]


SOURCES = {
    "geometry": lambda: [made_up.x_axis()],
    "collapse": lambda: [made_up.collapse()],
    "master_curve": lambda: [made_up.materials(), made_up.elastica_curve()],
    "folding": lambda: [made_up.plans()],
    "rpath_curve": lambda: [made_up.assessment(), made_up.two_ways(), made_up.with_friction(), made_up.plans()],
    "friction_needed": lambda: [made_up.frictions()],
}
"""Made-up datasets for a figure of each kind."""


class TestTable:
    @pytest.mark.parametrize("name", SOURCES)
    def test_same_bytes_whatever_the_user_has_set(self, name, tmp_path):
        draw = import_module(f"plots.{name}").draw
        first = save_as(draw(*SOURCES[name]()), tmp_path / "first.svg")
        with mpl.rc_context(USERS):
            before = dict(mpl.rcParams)
            second = save_as(draw(*SOURCES[name]()), tmp_path / "second.svg")
            assert dict(mpl.rcParams) == before
        assert first.read_bytes() == second.read_bytes()

    def test_gallery_shows_every_figure(self):
        page = (ROOT / "docs" / "figures.md").read_text(encoding="utf-8")
        assert page == plots.gallery_markdown()
        shown = re.findall(r"\(\.\./figures/(\w+)\.png\)", page)
        assert sorted(shown) == sorted(path.stem for path in (ROOT / "figures").glob("*.png"))
        assert set(shown) == set(plots.FIGURES)

    def test_what_is_imported(self):
        """The table imports no matplotlib, no figure pyplot, none of the package vision."""
        code = (
            "import sys, plots; assert 'matplotlib' not in sys.modules\n"
            "from importlib import import_module\n"
            "for name in ('film', 'collapse_curve', 'results', 'save'): import_module(f'stripfold.draw.{name}')\n"
            "assert not any(name.startswith('stripfold.film') for name in sys.modules)\n"
            "for name in plots.FIGURES: import_module(f'plots.{name}')\n"
            "sys.exit('matplotlib.pyplot' in sys.modules)"
        )
        assert subprocess.run([sys.executable, "-c", code]).returncode == 0


class TestSave:
    def test_files(self, tmp_path):
        png, svg = save(deflection.draw(made_up.x_axis()), tmp_path / "new" / "figure.v1")
        assert [path.name for path in (png, svg)] == ["figure.v1.png", "figure.v1.svg"]
        assert png.read_bytes().startswith(b"\x89PNG")
        assert b"Software" not in png.read_bytes()
        text = svg.read_text()
        assert "<dc:date>" not in text
        assert "<text" not in text
        ids = re.findall(r' id="([^"]*)"', text)
        assert len(ids) == len(set(ids)) > 20
        assert sorted(path.name for path in png.parent.iterdir()) == ["figure.v1.png", "figure.v1.svg"]

    def test_the_same_figure_again(self, tmp_path):
        fig = deflection.draw(made_up.x_axis())
        runs = [save(fig, tmp_path / "first"), save(fig, tmp_path / "again")]
        for files in zip(*runs, strict=True):
            assert len({path.read_bytes() for path in files}) == 1

    def test_a_figure_drawn_anew(self, tmp_path):
        """Unrounded, places of axes differ in their last digits from one figure to the next, and ids with them."""
        seen = set()
        for number in range(25):
            fig = figure(6.6)
            for ax in fig.subplots(3, 1, height_ratios=(1.2, 1.0, 1.0)):
                ax.plot([0, 1], [0, 3])
                ax.set(xlabel="x", ylabel="y")
            seen.add(save_as(fig, tmp_path / f"{number}.svg").read_bytes())
        assert len(seen) == 1

    def test_rounding_errors_in_the_data_rename_nothing(self, tmp_path):
        seen = set()
        for rounding in (0.0, 1e-14):
            fig = figure(2.0)
            ax = fig.subplots()
            ax.plot([0.0, 1.0 + rounding, 2.0], [0.0, 0.3, 1.0 + rounding], "o-")
            ax.set_aspect("equal")
            seen.add(save_as(fig, tmp_path / f"{rounding}.svg").read_bytes())
        assert len(seen) == 1

    def test_a_failure_leaves_the_old_file(self, tmp_path, monkeypatch):
        fig = motion.draw(made_up.x_axis())
        png, _ = save(fig, tmp_path / "figure")
        before = png.read_bytes()

        def broken(path, **_):
            path.write_bytes(b"half")
            raise OSError("no space left on device")

        monkeypatch.setattr(fig, "savefig", broken)
        with pytest.raises(OSError, match="no space"):
            save(fig, tmp_path / "figure")
        assert png.read_bytes() == before
        assert sorted(path.name for path in tmp_path.iterdir()) == ["figure.png", "figure.svg"]


class TestBranch:
    def test_padding_is_gone(self):
        chosen = branch(made_up.x_axis(), 5.0)
        assert chosen.height == pytest.approx(3.0 * made_up.UNIT)
        assert [state.shape for state in chosen.states] == [(40, 2)] * 8
        assert chosen.critical == 5

    def test_no_snap_is_refused(self):
        with pytest.raises(InvalidInputError, match="snap"):
            branch(made_up.x_axis().assign(snap=("height", [0, 0])), 5.0)

    def test_even_indices(self):
        values = np.array([0.0, 1.0, 2.0, 3.0, 10.0])
        assert evenly(values, 0, 4, 3) == [0, 3, 4]
        assert evenly(values, 1, 3, 9) == [1, 2, 3]
        assert evenly(values, 2, 2, 5) == [2]


class TestXAxis:
    def test_geometry(self):
        fig = geometry.draw(made_up.x_axis())
        assert [ax.get_aspect() for ax in fig.axes] == [1.0, 1.0]
        expected = {"mid-surface": palette.RED, "holding-point": palette.BLUE, "grasping-point": palette.PURPLE}
        for name, colour in expected.items():
            assert len(named(fig, name)) == 2
            assert colours(fig, name) == {colour}
        assert len(named(fig, "floor")) == 2
        texts = [text.get_text() for ax in fig.axes for text in ax.texts]
        assert {"$l$", "$h$", "$x$", "$z$", "thickness drawn\n10 times too large"} <= set(texts)
        # In lengths of the strip.
        flat, bent = (np.array(line.get_data()).T for line in named(fig, "mid-surface"))
        np.testing.assert_allclose(flat, [[-0.5, 0.0], [0.5, 0.0]])
        assert bent[0, 1] == pytest.approx(3.0 * made_up.UNIT / made_up.LENGTH)

    def test_outline_is_offset_by_half_the_thickness(self):
        angle = np.linspace(0.0, np.pi, 400)
        arc = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        radius = np.linalg.norm(geometry.outline(arc, 0.2), axis=1)
        np.testing.assert_allclose(radius, np.repeat([0.9, 1.1], 400), atol=1e-5)

    def test_motion(self):
        fig = motion.draw(made_up.x_axis())
        (ax,) = fig.axes
        assert ax.get_aspect() == 1.0
        for name, x in (("lambda_0", 6.0 - 30.0), ("lambda_c", 26.0 - 30.0)):
            assert drawn(ax, name)[0, 0, 0] == pytest.approx(x)
            assert colours(ax, name) == {palette.BLACK}
        assert colours(ax, "gripper") == {palette.PURPLE}
        dashed = lines(ax, "--")
        assert len(dashed) == len(named(ax, "unstable")) == 2
        assert all(line[0, 0] < 26.0 - 30.0 for line in dashed)
        greys = [float(line.get_color()) for line in named(ax, "stable")]
        assert len(greys) == 4
        assert all(a > b for a, b in pairwise(greys))
        assert legend_texts(fig) == ["stable", "unstable"]

    def test_deflection(self):
        fig = deflection.draw(made_up.x_axis())
        ax = fig.axes[0]
        assert "rms displacement" in ax.get_xlabel()
        (curve,) = lines(ax, "--")
        assert np.all(np.diff(curve[:, 0]) > 0.0)
        for state in ((10.0, 26.0), (12.0, 22.0), (14.0, 18.0)):
            assert np.abs(curve - state).sum(axis=1).min() < 0.3
        np.testing.assert_allclose(labelled(ax, "stable")[[0, -1], 0], [0.0, 10.0], atol=0.1)
        for name, value in (("lambda_0", 6.0), ("lambda_c", 26.0)):
            np.testing.assert_allclose(drawn(ax, name)[0, :, 1], value)
            assert colours(ax, name) == {palette.GREEN}
        assert legend_texts(fig) == ["stable", "unstable", "critical point"]
        assert len(ax.child_axes) == 1

    def test_deflection_without_unstable_points(self):
        ax = deflection.draw(made_up.x_axis().isel(step=slice(0, 6))).axes[0]
        assert not lines(ax, "--")
        assert not ax.child_axes


class TestManyHeights:
    def test_paths_and_their_ends(self):
        fig = paths.draw(made_up.materials(), "softer")
        (ax,) = fig.axes
        assert ax.get_aspect() == 1.0
        assert len(named(fig, "path")) == 4
        # x = lambda - l/2, in cm
        x = np.array([9.0, 10.0, 12.0]) - 0.02 - 10.0
        np.testing.assert_allclose(drawn(fig, "lambda_c"), [3.0 * np.stack([x, [2.0, 3.0, 5.0]], axis=1)])
        np.testing.assert_allclose(drawn(fig, "no-snap"), [[(3.0 * (8.38 - 10.0), 3.6)]])
        assert critical_points.NO_SNAP in legend_texts(fig)

    def test_no_cross_where_all_snap(self):
        fig = paths.draw(made_up.materials().isel(height_index=[0, 2, 3]), "soft")
        assert not named(fig, "no-snap")
        assert critical_points.NO_SNAP not in legend_texts(fig)

    def test_unknown_material(self):
        with pytest.raises(InvalidInputError, match="soft, softer, textile"):
            paths.draw(made_up.materials(), "paper")

    def test_critical_points(self):
        fig = critical_points.draw(made_up.materials().isel(material=[0, 1]))
        (ax,) = fig.axes
        first, second = ax.containers
        np.testing.assert_allclose(first.lines[0].get_ydata(), 5.0 * (np.array([9.0, 10.0, 12.0]) - 0.01))
        assert first.has_yerr
        assert first.lines[0].get_linestyle() == second.lines[0].get_linestyle() == "-"
        assert first.lines[0].get_color() != second.lines[0].get_color()
        np.testing.assert_allclose(drawn(fig, "no-snap")[:, 0], [(6.0, 5.0 * 8.39), (3.6, 3.0 * 8.38)])
        assert legend_texts(fig) == ["820", "12700", critical_points.NO_SNAP]

    def test_a_large_material_gets_a_second_panel(self):
        data = made_up.materials()
        data["gripper_height"][2] *= 2.0
        fig = critical_points.draw(data)
        assert len(fig.axes) == 2
        # Each of its own, the large one below.
        assert [len(ax.containers) for ax in fig.axes] == [2, 1]
        assert fig.axes[1].get_xlim()[1] > 1.8 * fig.axes[0].get_xlim()[1]
        assert legend_texts(fig)[2] == r"94.9: textile, secant $\eta_b$"

    def test_master_curve(self):
        fig = master_curve.draw(made_up.materials(), made_up.elastica_curve())
        top, bottom = fig.axes
        np.testing.assert_allclose(drawn(top, "elastica")[0, :, 1], made_up.elastica_curve()["lambda_c"])
        for below, container in zip((0.01, 0.02, 0.03), bottom.containers, strict=True):
            np.testing.assert_allclose(container.lines[0].get_xydata(), [(z, -below) for z in (2.0, 3.0, 5.0)])
        for container in top.containers:
            np.testing.assert_allclose(container.lines[0].get_xdata(), [2.0, 3.0, 5.0])
        assert len(named(fig, "no-snap")) == 3
        assert [shade.get_width() for shade in named(fig, "touch")] == pytest.approx(
            [made_up.TOUCH_LIMIT, made_up.TOUCH_LIMIT]
        )
        assert "elastica" in legend_texts(fig)

    def test_no_extrapolation(self):
        assert np.isnan(master_curve.elastica_at(made_up.elastica_curve(), np.array([1.5, 9.5]))).all()

    def test_looks_of_materials_differ(self):
        assert len({look(i) for i in range(30)}) == 30
        assert len({look(i).color for i in range(7)}) == 7


class TestRecordings:
    def test_measured_values_stand_above_the_line(self):
        top, bottom = measured.draw(made_up.recordings()).axes
        np.testing.assert_allclose(lines(top, "-")[0], [[10.0, 30.0], [20.0, 60.0]])
        dots = np.concatenate([container[0].get_xydata() for container in bottom.containers])
        assert len(dots) == 7
        np.testing.assert_allclose(np.unique(np.round(dots[:, 1], 6)), [0.5, 1.0])
        assert {container[0].get_linestyle() for container in bottom.containers} == {"-", "--"}
        assert notes(top) == [r"synthetic recordings; lines: $\lambda_c$ without friction"]

    def test_paths_end_where_the_strip_snapped(self):
        shown = np.full((3, 4, 5), 7, dtype=np.uint8)
        film = xr.Dataset({"frame": (("instant", "row", "column"), shown)}, {"instant": [-9.0, 0.01, 1.0]})
        film.attrs["recording"] = "a"
        *pictures, left, right = real_paths.draw(made_up.recordings(), film).axes
        assert [ax.get_title() for ax in pictures] == ["-9.0 s", "onset of the snap", "+1.0 s"]
        assert all(ax.images[0].get_array().shape == (4, 5) for ax in pictures)
        axes = (left, right)
        for ax, snaps in zip(axes, (4, 3), strict=True):
            tracks = [line.get_xydata() for line in ax.lines if to_hex(line.get_color()).upper() == palette.PURPLE]
            slow, fast = [line for line in ax.lines if line.get_linestyle() == "None"]
            assert slow.get_markersize() < fast.get_markersize()
            dots = np.concatenate([slow.get_xydata(), fast.get_xydata()])
            assert (len(tracks), len(dots)) == (4, snaps)
            ends = np.array([track[-1] for track in tracks])
            assert all(np.abs(ends - dot).max(axis=1).min() < 1e-9 for dot in dots)
            np.testing.assert_allclose(lines(ax, ":"), [[(30.0, 10.0), (60.0, 20.0)]])

    def test_errors_and_share_of_intervals_that_hold_the_truth(self):
        off = np.linspace(-1.0, 1.0, 20) * 1e-4
        off[3] = 9e-4
        columns = {
            "event": 0.3 + np.append(off, np.nan),
            "truth": np.full(21, 0.3),
            "sd": np.append(np.full(20, 1e-4), np.nan),
            "outcome": np.array(["measured"] * 20 + ["refused"], dtype=object),
            "flags": np.array([""] * 10 + ["warning: fast"] * 11, dtype=object),
            "generator": np.array(["shapes"] * 15 + ["chain"] * 6, dtype=object),
        }
        data = xr.Dataset({name: ("case", values) for name, values in columns.items()})
        top, bottom = recordings_accuracy.draw(data).axes
        said = "95 % intervals: 95.0 % of 20 hold the truth\n(chain: 100.0 % of 5, shapes: 93.3 % of 15)"
        assert top.get_title(loc="left") == said
        assert sum(patch.get_height() for patch in bottom.patches) == pytest.approx(20.0)
        recordings_accuracy.draw(data.isel(case=slice(20, None)))


def test_labels_over_a_decade_do_not_overlap():
    ax = figure(2.0).subplots()
    ax.set(xscale="log", xlim=(0.015, 0.55))
    plain_numbers(ax.xaxis)
    ax.figure.draw_without_rendering()
    ticks = [text for which in (False, True) for text in ax.get_xticklabels(minor=which) if text.get_text()]
    extents = [text.get_window_extent().extents for text in ticks if 0.015 < text.get_position()[0] < 0.55]
    shown = sorted((left, right) for left, _, right, _ in extents)
    assert len(shown) == 5
    assert all(one[1] < other[0] for one, other in pairwise(shown))
