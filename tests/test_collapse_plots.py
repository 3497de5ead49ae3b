"""Figures of a collapse show what they should, from a made-up one."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import made_up
from stripfold.errors import InvalidInputError
from stripfold.plots import collapse, collapse_curve, energy, phases, style
from stripfold.plots.save import save

FIRST_FALL = made_up.COUNTS["before"]


@pytest.fixture
def data() -> xr.Dataset:
    return made_up.collapse()


def named(part: Figure | Axes, name: str) -> list[Artist]:
    """Artists with this name as a label that no legend shows."""
    return part.findobj(lambda artist: artist.get_label() == f"_{name}")


def legend_texts(fig: Figure) -> list[str]:
    legends = [*fig.legends, *(ax.get_legend() for ax in fig.axes if ax.get_legend())]
    return [text.get_text() for legend in legends for text in legend.get_texts()]


def drawn(ax: Axes, name: str) -> np.ndarray:
    """States drawn, shape (states, nodes, 2), cm."""
    return np.array([np.asarray(line.get_data()).T for line in named(ax, name)])


def states_of(data: xr.Dataset) -> np.ndarray:
    return 100.0 * np.stack([data["x"].values, data["z"].values], axis=2)


def indices_of(data: xr.Dataset, shown: np.ndarray) -> list[int]:
    """Which states of the dataset they are; the last of those that look the same."""
    states = states_of(data)
    return [int(np.flatnonzero(np.abs(states - one).max(axis=(1, 2)) < 1e-9)[-1]) for one in shown]


class TestPhases:
    def test_parts(self, data):
        found = phases.collapse(data)
        assert [len(found.part(phase)) for phase in phases.PHASES] == list(made_up.COUNTS.values())
        assert found.critical == FIRST_FALL - 1
        # The times are 2 s (i / 40)^2: 0.5 s at i = 20.
        assert found.touch == FIRST_FALL + 20

    def test_without_a_touch(self, data):
        found = phases.collapse(data.assign_attrs(touch_time=np.nan))
        assert found.touch == FIRST_FALL + made_up.COUNTS["fall"] - 1

    def test_way_is_the_sum_of_rms_displacements(self):
        data = made_up.collapse()
        # All nodes move by 3 and 4 mm in turn, there and back: 5 mm in each step.
        steps = np.arange(data.sizes["state"]) % 2
        data["x"][:] = 0.003 * steps[:, None]
        data["z"][:] = 0.004 * steps[:, None]
        np.testing.assert_allclose(phases.collapse(data).way, 0.005 * np.arange(len(steps)), atol=1e-15)

    def test_even_states_include_both_ends(self, data):
        found = phases.collapse(data)
        # The sag goes down in proportion to time: even in way are times 0, 1/4, 1/2, 3/4, 1 of the touch's.
        chosen = found.evenly(FIRST_FALL, found.touch, 5)
        assert chosen == [FIRST_FALL + i for i in (0, 10, 14, 17, 20)]
        assert found.evenly(3, 3, 4) == [3]

    @pytest.mark.parametrize(
        ("break_it", "told"),
        [
            (lambda data: data.drop_vars("phase"), "without phase"),
            (lambda data: data.drop_vars(["x", "arc"]), "without x, arc"),
            (lambda data: data.drop_attrs(), "without height"),
            (lambda data: data.isel(state=slice(None, None, -1)), "phases after, fall, before"),
            (lambda data: data.isel(state=slice(0, 5)), "phases before"),
            (lambda data: data.isel(state=slice(0, 0)), "phases none"),
            (lambda data: data.assign(z=data["z"].where(data["state"] != 40)), "unusable x or z"),
            (lambda data: data.assign({"lambda": data["lambda"] * np.nan}), "unusable lambda"),
            (lambda data: data.assign(time=data["time"] * np.nan), "unusable times"),
            (lambda data: data.assign(time=-data["time"]), "unusable times"),
        ],
    )
    @pytest.mark.parametrize("draw", [collapse.draw, collapse_curve.draw, energy.draw])
    def test_other_data_are_refused(self, data, draw, break_it, told):
        with pytest.raises(InvalidInputError, match=told):
            draw(break_it(data))


class TestCollapse:
    def test_colours(self, data):
        whole, near = collapse.draw(data).axes
        for name, colour in (("fall", style.RED), ("lambda_c", style.BLACK), ("after", style.GREEN)):
            assert {to_hex(line.get_color()) for line in named(whole, name)} == {colour.lower()}, name
        assert {line.get_color() for line in named(whole, "before")} == {collapse.STATES_GREY}
        assert not named(near, "before")
        assert not named(near, "after")
        assert whole.get_aspect() == near.get_aspect() == 1.0
        for ax in (whole, near):
            assert len(named(ax, "floor")) == 1

    def test_states_of_each_part(self, data):
        whole, near = collapse.draw(data).axes
        phase = data["phase"].values
        for name in ("before", "after"):
            chosen = indices_of(data, drawn(whole, name))
            assert len(chosen) == 12
            assert set(phase[chosen]) == {name}
        assert indices_of(data, drawn(whole, "before"))[0] == 0
        assert indices_of(data, drawn(whole, "after"))[-1] == data.sizes["state"] - 1
        np.testing.assert_allclose(drawn(whole, "lambda_c")[0], states_of(data)[FIRST_FALL - 1])
        np.testing.assert_allclose(drawn(near, "fall"), drawn(whole, "fall"))

    def test_the_fall_is_even_up_to_the_touch(self, data):
        whole, _ = collapse.draw(data).axes
        fall = drawn(whole, "fall")
        lowest = fall[:, np.argmax(states_of(data)[0, :, 1] * (data["arc"].values > 0.2)), 1]
        np.testing.assert_allclose(lowest[: collapse.TO_TOUCH], 2.0 * np.array([0.8, 0.6, 0.4, 0.2, 0.0]), atol=0.08)
        assert indices_of(data, fall[-1:])[0] >= FIRST_FALL + 20

    def test_gripper_and_touch(self, data):
        whole, near = collapse.draw(data).axes
        (start,) = named(whole, "gripper")
        np.testing.assert_allclose(np.ravel(start.get_data()), [12.0 - 30.0, 15.0])
        for ax in (whole, near):
            (touch,) = named(ax, "touch")
            np.testing.assert_allclose(np.ravel(touch.get_data()), [-5.0, 0.0])
        texts = [text.get_text() for text in whole.texts]
        assert {r"$\lambda_0$", r"$\lambda_c$", "gripper, $z$ = 15.0 cm"} <= set(texts)

    def test_all_is_in_view(self, data):
        whole, near = collapse.draw(data).axes
        states = states_of(data)
        for k, (low, high) in enumerate((whole.get_xlim(), whole.get_ylim())):
            assert low < states[..., k].min()
            assert high > states[..., k].max()
        # What moves in the fall lies from 20 to 30 cm along the strip.
        assert -12.0 < near.get_xlim()[0] < -7.0
        assert -3.0 < near.get_xlim()[1] < 2.0

    def test_to_the_touch_only(self, data):
        fig = collapse.draw(made_up.until_touch(data))
        assert not named(fig, "after")
        assert len(named(fig.axes[0], "fall")) == collapse.TO_TOUCH
        assert legend_texts(fig) == ["static, before", r"critical state, $\lambda_c$", "fall"]


class TestCollapseCurve:
    def test_parts_and_levels(self, data):
        fig = collapse_curve.draw(data)
        (ax,) = fig.axes
        for phase, label in collapse_curve.LABELS.items():
            (line,) = [line for line in ax.lines if line.get_label() == label]
            part = data.isel(state=np.flatnonzero(data["phase"] == phase))
            np.testing.assert_allclose(line.get_xdata(), 100.0 * part["deflection"])
            np.testing.assert_allclose(line.get_ydata(), 100.0 * part["lambda"])
            expected = {"before": style.BLACK, "fall": style.RED, "after": style.GREEN}[phase]
            assert to_hex(line.get_color()) == expected.lower()
        for name, value in (("lambda_0", 12.0), ("lambda_c", 36.0)):
            (level,) = named(ax, name)
            assert to_hex(level.get_color()) == style.GREEN.lower()
            np.testing.assert_allclose(level.get_ydata(), value)
        assert [text.get_text() for text in ax.texts] == [r"$\lambda_0$ = 12.00 cm", r"$\lambda_c$ = 36.00 cm"]
        assert "rms displacement" in ax.get_xlabel()
        assert legend_texts(fig) == ["static, before", "fall", "static, after"]

    def test_the_inset_shows_the_whole_fall(self, data):
        (ax,) = collapse_curve.draw(data).axes
        (inset,) = ax.child_axes
        low, high = inset.get_xlim()
        fall = 100.0 * data["deflection"].values[data["phase"] == "fall"]
        assert low < fall.min() < fall.max() < high
        assert inset.get_ylim()[0] < 36.0 < inset.get_ylim()[1]

    def test_a_high_fall_gets_its_inset_below(self, data):
        high = data.copy(deep=True)
        high["lambda"][FIRST_FALL + made_up.COUNTS["fall"] :] = made_up.LAMBDA_C + 0.01
        for one, above in ((data, True), (high, False)):
            (ax,) = collapse_curve.draw(one).axes
            (inset,) = ax.child_axes
            middle = inset.get_position().y0 + 0.5 * inset.get_position().height
            level = ax.transData.transform((0.0, 36.0))[1] / ax.figure.bbox.height
            assert (middle > level) == above

    def test_to_the_touch_only(self, data):
        fig = collapse_curve.draw(made_up.until_touch(data))
        assert legend_texts(fig) == ["static, before", "fall"]


class TestEnergy:
    def test_elastic_and_gravity_since_the_start(self, data):
        top = energy.draw(data).axes[0]
        share = np.linspace(0.0, 1.0, made_up.COUNTS["fall"]) ** 2
        for name, at_rest in (("elastic", 2.0), ("gravity", -3.0)):
            (line,) = [line for line in top.lines if line.get_label() == name]
            np.testing.assert_allclose(line.get_xdata(), made_up.SETTLE * share)
            np.testing.assert_allclose(line.get_ydata(), at_rest * share, atol=1e-12)

    def test_kinetic_energy_and_losses_fill_what_was_released(self, data):
        fig = energy.draw(data)
        middle = fig.axes[1]
        (released,) = [line for line in middle.lines if line.get_label() == "released"]
        share = np.linspace(0.0, 1.0, made_up.COUNTS["fall"]) ** 2
        np.testing.assert_allclose(released.get_ydata(), share, atol=1e-12)
        tops = [area.get_paths()[0].vertices[:, 1].max() for area in middle.collections]
        # At rest nothing moves; air 0.5, fabric 0.3, impacts 0.1, scheme 0.1 mJ/m.
        np.testing.assert_allclose(tops[1:], [0.5, 0.8, 0.9, 1.0], atol=1e-3)
        assert tops[0] == pytest.approx(0.05, abs=1e-3)
        assert legend_texts(fig)[2:] == [
            "released",
            "lost: scheme",
            "lost: impacts",
            "lost: fabric",
            "lost: air",
            "kinetic",
        ]

    def test_the_gripper_gives_energy_too(self, data):
        data["work"] = data["work"] + xr.where(data["time"] > 0.0, 1e-4, 0.0)
        (released,) = [line for line in energy.draw(data).axes[1].lines if line.get_label() == "released"]
        assert released.get_ydata()[-1] == pytest.approx(1.1)

    def test_so_does_the_disturbance(self, data):
        data["kinetic"] = data["kinetic"] + 1e-4
        (released,) = [line for line in energy.draw(data).axes[1].lines if line.get_label() == "released"]
        assert released.get_ydata()[0] == pytest.approx(0.1)
        assert released.get_ydata()[-1] == pytest.approx(1.1)

    def test_closing_error(self, data):
        bottom = energy.draw(data).axes[2]
        assert bottom.get_yscale() == "log"
        (error,) = named(bottom, "closing")
        # Of 3 mJ/m exchanged 3e-15 J/m are lacking; at the start nothing is.
        np.testing.assert_allclose(error.get_ydata()[1:], 1e-12)
        assert np.isnan(error.get_ydata()[0])

    def test_touch_and_rest(self, data):
        fig = energy.draw(data)
        for name, time in (("touch", made_up.TOUCH), ("settle", made_up.SETTLE)):
            lines = named(fig, name)
            assert len(lines) == 3
            assert {line.get_xdata()[0] for line in lines} == {time}
        assert {text.get_text() for text in fig.axes[0].texts} == {"touch\n0.50 s", "at rest\n2.00 s"}

    def test_no_rest_is_no_line(self, data):
        fig = energy.draw(made_up.until_touch(data))
        assert not named(fig, "settle")
        assert len(named(fig, "touch")) == 3

    def test_energies_are_needed(self, data):
        with pytest.raises(InvalidInputError, match="without kinetic, air"):
            energy.draw(data.drop_vars(["kinetic", "air"]))


def test_same_bytes(data, tmp_path):
    for module in (collapse, collapse_curve, energy):
        runs = [save(module.draw(data), tmp_path / run / "figure") for run in ("a", "b")]
        for kind in zip(*runs, strict=True):
            assert len({path.read_bytes() for path in kind}) == 1, module.__name__


def test_pyplot_is_not_needed():
    code = (
        "import sys; from stripfold.plots import film; from stripfold.plots import collapse, collapse_curve, energy; "
        "sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
