"""Figures of a collapse show what they should, from a made-up one."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import made_up
from plots import collapse, energy
from plots.readers import travel
from plotted import colours, drawn, indices_of, labelled, legend_texts, named, states_of
from stripfold.base.errors import InvalidInputError
from stripfold.draw import collapse_curve, readers
from stripfold.draw import colours as palette
from stripfold.follow.phases import PHASES

FIRST_FALL = made_up.COUNTS["before"]


@pytest.fixture
def data() -> xr.Dataset:
    return made_up.collapse()


class TestReader:
    def test_parts(self, data):
        found = readers.collapse(data)
        assert [len(found.part(phase)) for phase in PHASES] == list(made_up.COUNTS.values())
        assert found.critical == FIRST_FALL - 1
        # The times are 2 s (i / 40)^2: 0.5 s at i = 20.
        assert found.touch == FIRST_FALL + 20
        without = readers.collapse(data.assign(touch_time=np.nan))
        assert without.touch == FIRST_FALL + made_up.COUNTS["fall"] - 1

    def test_travel_is_the_sum_of_rms_displacements(self, data):
        # All nodes move by 3 and 4 mm in turn, there and back: 5 mm in each step.
        steps = np.arange(data.sizes["state"]) % 2
        data["x"][:] = 0.003 * steps[:, None]
        data["z"][:] = 0.004 * steps[:, None]
        way = travel(readers.collapse(data).states, data["arc"].values)
        np.testing.assert_allclose(way, 0.005 * np.arange(len(steps)), atol=1e-15)

    @pytest.mark.parametrize(
        ("break_it", "message"),
        [
            (lambda data: data.drop_vars("phase"), "without phase"),
            (lambda data: data.drop_vars(["x", "arc"]), "without x, arc"),
            (lambda data: data.drop_vars("gripper_height"), "without gripper_height"),
            (lambda data: data.isel(state=slice(None, None, -1)), "phases after, fall, before"),
            (lambda data: data.isel(state=slice(0, 5)), "phases before"),
            (lambda data: data.isel(state=slice(0, 0)), "phases none"),
            (lambda data: data.assign(z=data["z"].where(data["state"] != 40)), "unusable x or z"),
            (lambda data: data.assign({"advance": data["advance"] * np.nan}), "unusable advance"),
            (lambda data: data.assign(time=data["time"] * np.nan), "unusable times"),
            (lambda data: data.assign(time=-data["time"]), "unusable times"),
        ],
    )
    def test_other_data_are_refused(self, data, break_it, message):
        with pytest.raises(InvalidInputError, match=message):
            collapse.draw(break_it(data))


class TestCollapse:
    def test_states_and_colours_of_each_part(self, data):
        near, whole = collapse.draw(data).axes
        assert whole.get_aspect() == near.get_aspect() == 1.0
        expected = {"before": palette.STATIC, "lambda_c": palette.BLACK, "fall": palette.RED, "after": palette.GREEN}
        for name, colour in expected.items():
            assert {line.get_color() for line in named(whole, name)} == {colour}, name
        for name in ("before", "after"):
            chosen = indices_of(data, drawn(whole, name), last=True)
            assert len(chosen) == collapse.STATES
            assert set(data["phase"].values[chosen]) == {name}
            assert not named(near, name)
        assert indices_of(data, drawn(whole, "before"))[0] == 0
        assert indices_of(data, drawn(whole, "after"), last=True)[-1] == data.sizes["state"] - 1
        np.testing.assert_allclose(drawn(whole, "lambda_c")[0], states_of(data)[FIRST_FALL - 1])
        np.testing.assert_allclose(drawn(near, "fall"), drawn(whole, "fall"))

    def test_the_fall_is_even_up_to_the_touch(self, data):
        fall = drawn(collapse.draw(data).axes[1], "fall")
        # The sag is highest at 0.25 m along the strip; it goes down from 2 cm to the floor.
        lowest = fall[:, np.argmax(states_of(data)[0, :, 1] * (data["arc"].values > 0.2)), 1]
        np.testing.assert_allclose(lowest[: collapse.TO_TOUCH], 2.0 * np.array([0.8, 0.6, 0.4, 0.2, 0.0]), atol=0.08)
        assert indices_of(data, fall[-1:], last=True)[0] >= FIRST_FALL + 20

    def test_gripper_touch_and_view(self, data):
        near, whole = collapse.draw(data).axes
        np.testing.assert_allclose(drawn(whole, "gripper"), [[(12.0 - 30.0, 15.0)]])
        np.testing.assert_allclose(drawn(whole, "held-end"), [[(30.0, 0.0)]], atol=1e-12)
        assert (colours(whole, "gripper"), colours(whole, "held-end")) == ({palette.PURPLE}, {palette.BLUE})
        for ax in (whole, near):
            np.testing.assert_allclose(drawn(ax, "touch"), [[(-5.0, 0.0)]])
            assert len(named(ax, "floor")) == 1
        texts = [text.get_text() for text in whole.texts]
        assert {r"$\lambda_0$", r"$\lambda_c$", "gripper, $z$ = 15.0 cm"} <= set(texts)
        states = states_of(data)
        for k, (low, high) in enumerate((whole.get_xlim(), whole.get_ylim())):
            assert low < states[..., k].min()
            assert high > states[..., k].max()
        # The nodes that move in the fall lie from 20 to 30 cm along the strip.
        assert -12.0 < near.get_xlim()[0] < -7.0
        assert -3.0 < near.get_xlim()[1] < 2.0

    def test_to_the_touch_only(self, data):
        fig = collapse.draw(made_up.until_touch(data))
        assert not named(fig, "after")
        assert len(named(fig.axes[1], "fall")) == collapse.TO_TOUCH
        assert legend_texts(fig) == ["static, before", r"critical state, $\lambda_c$", "fall"]


class TestCollapseCurve:
    def test_parts_and_levels(self, data):
        fig = collapse_curve.draw(data)
        ax, below = fig.axes
        for phase, colour in zip(PHASES, (palette.BLACK, palette.RED, palette.GREEN), strict=True):
            part = data.isel(state=np.flatnonzero(data["phase"] == phase))
            label = collapse_curve.LABELS[phase]
            expected = 100.0 * np.stack([part["deflection"], part["advance"]], axis=1)
            curve = labelled(ax, label)
            np.testing.assert_allclose(curve[[0, -1]], expected[[0, -1]])
            # A smooth curve goes through the states.
            distance = np.abs(curve - expected[:, None]).sum(axis=2).min(axis=1)
            assert distance.max() < 0.01 * np.ptp(expected, axis=0).sum() + 1e-9
            assert next(line for line in ax.lines if line.get_label() == label).get_color() == colour
        for name, value in (("lambda_0", 12.0), ("lambda_c", 36.0)):
            assert colours(ax, name) == {palette.GREEN}
            np.testing.assert_allclose(drawn(ax, name)[0, :, 1], value)
        assert [text.get_text() for text in ax.texts] == [
            r"$\lambda_0$ = 12.00 cm",
            r"$\lambda_c$ = 36.00 cm",
            "(a)",
        ]
        assert "rms displacement" in ax.get_xlabel()
        assert legend_texts(fig) == list(collapse_curve.LABELS.values())
        assert "sag" in below.get_xlabel()
        assert below.get_ylim()[0] < 36.0 < below.get_ylim()[1]
        left, right = below.get_xlim()
        assert left > 0.0 > right

    def test_height_of_the_sag(self):
        """By hand: from the gripper down to 1, over a loop of 2, and down; none where the strip only comes down."""
        x = np.arange(6.0)
        states = [np.stack([x, z], axis=1) for z in ([5.0, 3.0, 1.0, 2.0, 0.0, 0.0], [5.0, 3.0, 1.0, 0.5, 0.0, 0.0])]
        np.testing.assert_array_equal(collapse_curve.sag_heights(np.array(states)), [1.0, np.nan])

    def test_to_the_touch_only(self, data):
        assert legend_texts(collapse_curve.draw(made_up.until_touch(data))) == ["static, before", "fall"]


class TestEnergy:
    share = np.linspace(0.0, 1.0, made_up.COUNTS["fall"]) ** 2
    released = staticmethod(lambda data: labelled(energy.draw(data).axes[1], "released")[:, 1])

    def test_elastic_and_gravity_since_the_start(self, data):
        top = energy.draw(data).axes[0]
        for name, at_rest in (("elastic", 2.0), ("gravity", -3.0)):
            expected = np.stack([made_up.SETTLE * self.share, at_rest * self.share], axis=1)
            np.testing.assert_allclose(labelled(top, name), expected, atol=1e-12)

    def test_kinetic_energy_and_dissipation_fill_what_was_released(self, data):
        fig = energy.draw(data)
        np.testing.assert_allclose(self.released(data), self.share, atol=1e-12)
        tops = [area.get_paths()[0].vertices[:, 1].max() for area in fig.axes[1].collections]
        # At rest nothing moves; air 0.5, fabric 0.3, impacts 0.1, scheme 0.1 mJ/m.
        np.testing.assert_allclose(tops, [0.05, 0.5, 0.8, 0.9, 1.0], atol=1e-3)
        stacked = [label for label, _ in energy.STACKED.values()]
        assert legend_texts(fig) == ["elastic", "gravity", "released", *reversed(stacked)]

    def test_gripper_and_disturbance_give_energy_too(self, data):
        pulled = data.assign(work=data["work"] + xr.where(data["time"] > 0.0, 1e-4, 0.0))
        np.testing.assert_allclose(self.released(pulled)[[0, -1]], [0.0, 1.1], atol=1e-12)
        pushed = data.assign(kinetic=data["kinetic"] + 1e-4)
        np.testing.assert_allclose(self.released(pushed)[[0, -1]], [0.1, 1.1])

    def test_closing_error(self, data):
        bottom = energy.draw(data).axes[2]
        assert bottom.get_yscale() == "log"
        # Of 3 mJ/m exchanged 3e-15 J/m are lacking; at the start nothing is.
        error = drawn(bottom, "closing")[0, :, 1]
        np.testing.assert_allclose(error[1:], 1e-12)
        assert np.isnan(error[0])

    def test_touch_and_rest(self, data):
        def times(fig: Figure, name: str) -> list[float]:
            return [line[0, 0] for line in drawn(fig, name)]

        fig = energy.draw(data)
        assert times(fig, "touch") == [made_up.TOUCH] * 3
        assert times(fig, "settle") == [made_up.SETTLE] * 3
        assert {text.get_text() for text in fig.axes[0].texts} == {"touch\n0.50 s", "at rest\n2.00 s"}
        fig = energy.draw(made_up.until_touch(data))
        assert (times(fig, "touch"), times(fig, "settle")) == ([made_up.TOUCH] * 3, [])

    def test_energies_are_needed(self, data):
        with pytest.raises(InvalidInputError, match="without kinetic, air"):
            energy.draw(data.drop_vars(["kinetic", "air"]))
