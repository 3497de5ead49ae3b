"""Figures of the folding paths show what they should, from made-up assessments."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import made_up
from plots import (
    evolutions,
    folding,
    friction_needed,
    path_readers,
    planned_paths,
    rpath_curve,
    rpath_friction,
    touch_error,
)
from plots.pieces import PATH_LOOKS
from plotted import colours, drawn, indices_of, labelled, legend_texts, named, notes, states_of
from stripfold.base.errors import InvalidInputError
from stripfold.draw import colours as palette


class TestReaders:
    def test_parts(self):
        data = made_up.assessment()
        found = path_readers.parts(data)
        assert [part.phase for part in found] == ["static", "fall", "static"]
        assert [len(part.pseudo_time) for part in found] == [21, 11, 13]
        np.testing.assert_allclose(100.0 * found[1].states[3], states_of(data)[24])

    def test_even_states_include_both_ends(self):
        part = path_readers.parts(made_up.assessment())[0]
        # A leg that turns at a constant rate.
        assert part.evenly(5) == [0, 5, 10, 15, 20]
        assert part.evenly(1) == [0]

    def test_displacement_and_height(self):
        s = np.linspace(0.0, 2.0, 5)
        flat = np.stack([s - 1.0, 0.0 * s], axis=1)
        moved = np.array([flat, flat + np.array([0.3, 0.4])])
        part = path_readers.Part("static", np.array([0.0, 1.0]), moved, s)
        np.testing.assert_allclose(part.displacement(), [0.0, 0.5], atol=1e-15)
        plan = path_readers.Part("static", np.array([0.0, 2.0]), np.array([flat, flat + np.array([0.0, 0.6])]), s)
        # At the time 1 the plan is 0.3 high.
        np.testing.assert_allclose(part.above(plan), [0.0, 0.1], atol=1e-15)

    def test_the_branch_that_touches_is_first(self):
        data = made_up.two_ways()
        first, second = path_readers.post_critical(data)
        assert first.touch_x == -0.04
        assert (first.touches, second.touches) == (True, False)
        np.testing.assert_array_equal(100.0 * first.fall.states[-1], states_of(data)[24])
        assert second.after.pseudo_time[-1] == 0.7
        assert path_readers.post_critical(made_up.without_ways()) == []

    @pytest.mark.parametrize(
        ("break_it", "message"),
        [
            (lambda data: data.drop_vars("phase"), "without phase"),
            (lambda data: data.drop_vars(["x", "arc"]), "without x, arc"),
            (lambda data: data.assign(z=data["z"].where(data["state"] != 4)), "not finite"),
            (lambda data: data.assign(pseudo_time=data["pseudo_time"] * np.nan), "not finite"),
            (lambda data: data.assign(part=0 * data["part"]), "both static and in a fall"),
            (lambda data: data.assign_coords(phase=("state", ["after"] * data.sizes["state"])), "phases after"),
        ],
    )
    def test_other_data_are_refused(self, break_it, message):
        with pytest.raises(InvalidInputError, match=message):
            path_readers.parts(break_it(made_up.assessment().assign_coords(state=np.arange(45))))

    def test_half_a_branch_and_unknown_names_are_refused(self):
        data = made_up.two_ways()
        with pytest.raises(InvalidInputError, match="branch 1 without one fall"):
            path_readers.post_critical(data.isel(state=np.flatnonzero(data["part"] < 3)))
        with pytest.raises(InvalidInputError, match=r"path = 'square' .* one of r-path"):
            path_readers.planned(made_up.plans(), "square")
        with pytest.raises(InvalidInputError, match=r"law = 'glue' .* one of pull"):
            path_readers.with_friction(made_up.with_friction(), "glue")


class TestPlannedStates:
    def test_folding(self):
        data = made_up.plans()
        fig = folding.draw(data)
        assert [ax.get_aspect() for ax in fig.axes] == [1.0, 1.0]
        flat, folded = drawn(fig, "front")
        plan = states_of(data.sel(path="r-path")) / 100.0
        np.testing.assert_allclose(flat, plan[0])
        np.testing.assert_allclose(folded[:, 0], plan[-1, :, 0])
        assert len(named(fig, "fold-line")) == 2
        assert (colours(fig, "fold-line"), colours(fig, "gripper")) == ({palette.BLUE}, {palette.PURPLE})
        (path,) = drawn(fig, "path")
        np.testing.assert_allclose(path - path[0], plan[:, 0] - plan[0, 0], atol=1e-12)
        # The flat strip shows its upper face, and a strip turned over the other.
        faces = [ax.findobj(PolyCollection)[0].get_facecolor()[::2, 0] for ax in fig.axes]
        np.testing.assert_allclose(faces[0], folding.FACE)
        assert set(np.round(faces[1], 6)) == {folding.FACE, folding.REVERSE}

    def test_layers_are_drawn_apart(self):
        x = np.array([3.0, 2.0, 1.0, 0.5, 1.0, 2.0, 3.0])
        z = np.array([0.0, 0.0, 0.2, 0.2, 0.2, 0.0, 0.0])
        state = folding.layered(np.stack([x, z], axis=1), 0.1)
        np.testing.assert_allclose(state[:, 1], [0.1, 0.1, 0.3, 0.25, 0.2, 0.0, 0.0])
        flat = np.stack([x, 0.0 * z], axis=1)
        np.testing.assert_array_equal(folding.layered(flat, 0.1), flat)

    def test_planned_paths(self):
        data = made_up.plans()
        data["x"][1] = data["x"][1] + 0.01
        fig = planned_paths.draw(data)
        for ax, name in zip(fig.axes, ("triangular", "circular", "r-path"), strict=True):
            one = data.sel(path=name)
            assert ax.get_aspect() == 1.0
            np.testing.assert_allclose(drawn(ax, "path"), [states_of(one)[:, 0]])
            assert named(ax, "path")[0].get_linestyle() == "--"
            chosen = indices_of(one, drawn(ax, "state"))
            assert len(chosen) == planned_paths.STATES
            assert (chosen[0], chosen[-1]) == (0, 50)
            greys = [float(line.get_color()) for line in named(ax, "state")]
            assert greys == sorted(greys, reverse=True)
            np.testing.assert_array_equal(drawn(ax, "fold-line"), [[[0.0, 0.0]]])
        assert [notes(ax)[0][4:] for ax in fig.axes] == ["triangular path", "circular path", "R-path"]
        assert (colours(fig, "fold-line"), colours(fig, "path")) == ({palette.BLUE}, {palette.PURPLE})
        assert [ax.xaxis.get_tick_params()["labelbottom"] for ax in fig.axes] == [False, False, True]

    def test_evolutions(self):
        data, smooth = made_up.assessment(), made_up.assessment(critical=False)
        fig = evolutions.draw(data, data, smooth, made_up.plans())
        for ax in fig.axes[:2]:
            assert len(named(ax, "static")) == evolutions.SHOWN - 1
            assert max(indices_of(data, drawn(ax, "static"))) < 20
            assert indices_of(data, drawn(ax, "critical")) == [20]
            assert set(indices_of(data, drawn(ax, "fall"))) <= set(range(21, 32))
            np.testing.assert_allclose(drawn(ax, "touch"), [[[-5.0, 0.0]]])
        assert not named(fig.axes[2], "critical")
        assert not named(fig.axes[2], "touch")
        assert indices_of(smooth, drawn(fig.axes[2], "static")[-1:]) == [20]
        assert ["no critical point" in notes(ax)[0] for ax in fig.axes] == [False, False, True]
        for ax in fig.axes:
            assert ax.get_aspect() == 1.0
            np.testing.assert_allclose(drawn(ax, "planned-touch"), [[[5.0, 0.0]]])
            np.testing.assert_allclose(drawn(ax, "lying"), [[[100.0 * (made_up.LENGTH / 2.0 - 0.26), 0.0]]])
            np.testing.assert_allclose(drawn(ax, "path")[0], states_of(made_up.plans().isel(path=0))[:, 0])
        expected = {"static": palette.STATIC, "critical": palette.BLACK, "lying": palette.MAGENTA}
        for name, colour in expected.items():
            assert {line.get_color() for line in named(fig, name)} == {colour}


class TestRPathFriction:
    @pytest.fixture
    def fig(self) -> Figure:
        return rpath_friction.draw(made_up.assessment(), made_up.two_ways(), made_up.with_friction(), made_up.plans())

    def test_without_friction(self, fig):
        whole, near, _ = fig.axes
        data = made_up.two_ways()
        assert indices_of(made_up.assessment(), drawn(whole, "critical")) == [20]
        for ax in (whole, near):
            np.testing.assert_allclose(drawn(ax, "planned")[0], states_of(data)[0])
            np.testing.assert_allclose(drawn(ax, "touch"), [[[-4.0, 0.0]]])
        for name, colour, first in (("touching", palette.RED, 16), ("hanging", palette.BLUE, 0)):
            assert colours(near, f"{name}-fall") == {colour}
            chosen = indices_of(data, drawn(near, f"{name}-fall"))
            assert len(chosen) == rpath_friction.FALLS
            assert first < min(chosen)
            assert max(chosen) == first + 8
            assert len(named(whole, f"{name}-static")) > 2
        assert [ax.get_aspect() for ax in fig.axes] == [1.0] * 3

    def test_with_friction(self, fig):
        data = made_up.with_friction().sel(law="pull")
        # The plan at the times of what is drawn.
        assert len(named(fig.axes[2], "planned")) == len(named(fig.axes[2], "held")) + len(named(fig.axes[2], "static"))
        held, free = (indices_of(data, drawn(fig.axes[2], name)) for name in ("held", "static"))
        assert colours(fig.axes[2], "held") == {palette.ORANGE}
        assert {20, 24} <= set(held) <= set(range(20, 25))
        assert {0, 40} <= set(free) <= {*range(20), *range(25, 41)}
        data = made_up.with_friction()
        data["eigenvalue"] = abs(data["eigenvalue"])
        fig = rpath_friction.draw(made_up.assessment(), made_up.two_ways(), data, made_up.plans())
        assert not named(fig, "held")
        assert "stable by friction alone" not in legend_texts(fig)

    def test_what_moves_is_in_view(self, fig):
        near = fig.axes[1]
        low, high = near.get_xlim()
        fall = drawn(near, "hanging-fall")
        moved = np.abs(fall - fall[0]).max(axis=(0, 2))
        assert low < fall[:, moved.argmax(), 0].min()
        assert high > fall[:, moved.argmax(), 0].max()
        assert high - low < 40.0
        # Of what is high only the lower part: it would make the panel long.
        assert near.get_ylim()[0] < 0.0
        assert 0.4 < near.get_ylim()[1] / (high - low) < 0.7

    def test_without_ways(self):
        smooth, ways = made_up.assessment(critical=False), made_up.without_ways()
        fig = rpath_friction.draw(smooth, ways, made_up.with_friction(), made_up.plans())
        whole, held = fig.axes
        assert "no unstable planned state" in notes(whole)[0]
        # k_f of 0.08 g/L* with steps of 0.1 L*.
        assert notes(held) == ["(b) with friction: pull,\n$k_f\\,\\Delta s$ = 0.008 $g$"]
        for name in ("critical", "touch", "touching-fall"):
            assert not named(fig, name)
        assert "falls and touches" not in legend_texts(fig)


class TestRPathCurve:
    @pytest.fixture
    def fig(self) -> Figure:
        return rpath_curve.draw(made_up.assessment(), made_up.two_ways(), made_up.with_friction(), made_up.plans())

    def test_displacement(self, fig):
        top, _ = fig.axes
        data = made_up.assessment()
        curve = labelled(top, rpath_curve.BEFORE)
        np.testing.assert_allclose(curve[:, 1], np.linspace(0.0, 0.5, 21))
        s = data["arc"].values
        away = states_of(data)[20] - np.stack([100.0 * (s - made_up.LENGTH / 2.0), 0.0 * s], axis=1)
        rms = np.sqrt(np.trapezoid(np.sum(away**2, axis=1), s) / made_up.LENGTH)
        assert curve[-1, 0] == pytest.approx(rms)
        np.testing.assert_allclose(labelled(top, "_critical-point"), [[rms, 0.5]])

    def test_mean_height_over_the_plan(self, fig):
        _, bottom = fig.axes
        # The dip is a parabola of height 1/4 times its factor over a third of the strip: 0.1 is a mean of 5.556 mm.
        touching = labelled(bottom, rpath_curve.TOUCHES)
        np.testing.assert_allclose(touching[:, 0], -1e3 * 0.1 / 6.0 / 3.0, rtol=5e-3, atol=0.05)
        np.testing.assert_allclose(labelled(bottom, f"_{rpath_curve.TOUCHES}")[:, 1], 0.6)
        hanging = labelled(bottom, f"_{rpath_curve.HANGS}")
        assert hanging[-1, 0] == pytest.approx(2e3 * 0.1 / 6.0 / 3.0, rel=5e-3, abs=0.05)
        np.testing.assert_allclose(labelled(bottom, rpath_curve.PLANNED)[:, 0], 0.0, atol=1e-9)
        low, high = bottom.get_ylim()
        assert low < 0.5 < 0.6 < high < 0.8

    def test_colours(self, fig):
        expected = {
            rpath_curve.BEFORE: (palette.BLACK, "-"),
            rpath_curve.AFTER: (palette.GREEN, "-"),
            rpath_curve.TOUCHES: (palette.RED, "-"),
            rpath_curve.HANGS: (palette.BLUE, "-"),
            rpath_curve.HELD: (palette.ORANGE, "-"),
            rpath_curve.PLANNED: (palette.BLACK, ":"),
        }
        for ax in fig.axes:
            found = {line.get_label(): (line.get_color(), line.get_linestyle()) for line in ax.lines}
            assert {name: found[name] for name in expected} == expected
        assert set(legend_texts(fig)) == set(expected)

    def test_friction_is_the_pull(self, fig):
        np.testing.assert_allclose(labelled(fig.axes[1], rpath_curve.HELD)[-1, 0], -1e3 * 0.02 / 6.0 / 3.0, rtol=5e-3)

    def test_without_a_critical_point_and_ways(self):
        fig = rpath_curve.draw(
            made_up.assessment(critical=False), made_up.without_ways(), made_up.with_friction(), made_up.plans()
        )
        assert set(legend_texts(fig)) == {rpath_curve.PLANNED, rpath_curve.HELD, rpath_curve.BEFORE}


class TestTouchError:
    def test_points(self):
        (ax,) = touch_error.draw(made_up.assessments()).axes
        for name, errors in made_up.TOUCH_ERRORS.items():
            assert colours(ax, f"{name}-filled") == {PATH_LOOKS[name][1].color}
            filled, hollow = drawn(ax, f"{name}-filled")[0], drawn(ax, f"{name}-hollow")[0]
            # In the order of the length, 12 and 20 L*; the third material is the one that does not fall.
            np.testing.assert_allclose(filled, [(12.0, errors[1]), (20.0, errors[0])])
            np.testing.assert_allclose(hollow, [(20.0, errors[2])])
            assert named(ax, f"{name}-hollow")[0].get_markerfacecolor() == "white"
        bars = [segment for c in ax.collections for segment in c.get_segments()]
        assert len(bars) == 9
        np.testing.assert_allclose(bars[0], [(20.0, -0.35), (20.0, -0.25)])
        np.testing.assert_allclose(drawn(ax, "landing")[0][:, 1], 1.0)
        np.testing.assert_allclose(drawn(ax, "line")[0][:, 1], -2.6)
        # No line goes where there is no touch.
        np.testing.assert_allclose(drawn(ax, "circular-line")[0], [(20.0, 0.7), (20.0, 0.6)])

    def test_legend(self):
        data = made_up.assessments()
        assert "laid down without a fall" in legend_texts(touch_error.draw(data))
        data["fell"][:] = 1.0
        assert "laid down without a fall" not in legend_texts(touch_error.draw(data))


def test_friction_needed():
    top, bottom = friction_needed.draw(made_up.frictions()).axes
    # k_f / (g/L*) times the step of 0.1 L*; lengths of 20, 12 and 20 L*.
    np.testing.assert_allclose(labelled(top, friction_needed.PULL), [(20.0, 0.008), (12.0, 0.010), (20.0, 0.012)])
    np.testing.assert_allclose(labelled(top, friction_needed.MOMENT), [(20.0, 0.009), (12.0, 0.007), (20.0, 0.005)])
    # Up to the first touch, at the pseudo time 0.6; the median is at 0.3.
    np.testing.assert_allclose(labelled(bottom, "largest")[:, 1], 0.037)
    np.testing.assert_allclose(labelled(bottom, "median")[:, 1], 0.010)
    assert legend_texts(top) == [friction_needed.PULL, friction_needed.MOMENT]
    assert legend_texts(bottom) == ["largest", "median"]
