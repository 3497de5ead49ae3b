"""Effects on demand: what a scene may ask, when an effect is needed, and what the dataset says of it."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold.ask import collapse_record
from stripfold.ask.inputs import Effects, Simulation
from stripfold.ask.model_error import model_error
from stripfold.base.errors import InvalidInputError

STRIP = {"length": 0.6, "height": 0.15, "eta_b": 3780.0}


@pytest.mark.parametrize(
    ("given", "key", "says"),
    [
        ("always", "effects", "auto, or keys and values"),
        ({"self_contcat": "off"}, "effects.self_contcat", "did you mean self_contact"),
        ({"inertia": "perhaps"}, "effects.inertia", "auto, on, off"),
        ({"inertia": ["on"]}, "effects.inertia", "auto, on, off"),
        ({"contact": "off"}, "effects.contact", "starts lying on the floor"),
        ({"friction": "on"}, "effects.friction", "stripfold assess"),
    ],
)
def test_bad_input_names_the_key(given: object, key: str, says: str) -> None:
    with pytest.raises(InvalidInputError, match=says) as caught:
        Simulation(**STRIP, effects=given)
    assert caught.value.key == key


def test_yamls_on_and_off() -> None:
    assert Effects(**{"inertia": False, "solid": True}) == Effects(inertia="off", solid="on")


def test_the_model_is_the_given_one_or_chosen_by_accuracy() -> None:
    assert Simulation(**STRIP).model == "solid"
    assert Simulation(**STRIP, effects="auto").model == "rod"
    assert Simulation(**STRIP, effects="auto", accuracy=1e-5).model == "solid"
    assert Simulation(**STRIP, effects="auto", model="solid").model == "solid"
    assert Simulation(**STRIP, effects={"solid": "on"}).model == "solid"
    assert Simulation(**STRIP, effects={"solid": "off"}, accuracy=1e-6).model == "rod"
    with pytest.raises(InvalidInputError, match="give only one"):
        Simulation(**STRIP, effects={"solid": "off"}, model="solid")


@pytest.mark.parametrize("given", ["auto", {"self_contact": "off", "inertia": "on"}, {"solid": "off"}])
def test_resolved_keys_run_the_same(given: object) -> None:
    asked = Simulation(**STRIP, effects=given)
    again = Simulation(**asked.as_config())
    assert again.as_config() == asked.as_config()


def test_needs_are_comparisons() -> None:
    assert collapse_record.need_of_contact(0.0).needed
    assert not collapse_record.need_of_contact(0.1).needed
    assert collapse_record.need_of_self_contact(-1e-6).needed
    assert not collapse_record.need_of_self_contact(1e-6).needed
    assert not collapse_record.need_of_self_contact(np.inf).needed
    assert collapse_record.need_of_inertia(0.0, 0.1).needed
    assert not collapse_record.need_of_inertia(0.5, None).needed
    assert not collapse_record.need_of_friction().needed
    # A Poisson's ratio is what a rod has not.
    for nu, needed in ((0.0, False), (0.45, True)):
        need = collapse_record.need_of_solid(model_error("rod", 0.2, nu, 3.0, 20.0), 1e-3)
        assert (need.needed, need.threshold) == (need.value > 1e-3, 1e-3) == (needed, 1e-3)
