"""Gains of each sample's own: against the loads without them, as samples, and beside an end block."""

import pytest
import torch
from test_members import DESIGNS, alone, block, loads, made, table_of

from freelearn.common.errors import UserError
from freelearn.data.rows import Rows
from freelearn.discovery.search.testable import unseen
from freelearn.physics.effects.effect_check import check_effects
from freelearn.physics.models.build import build_model

MATERIAL = {"C1": 8e5, "C2": 2e7}
# Of three samples, over the first one's.
OWN = {1: 0.0, 2: -0.02, 3: 0.05}
GAINS = ("own_force_gain", "own_moment_gain", "own_pressure_gain")
each = pytest.mark.parametrize("name", GAINS)


def several(name):
    return build_model("continuum", MATERIAL | {f"{name}.gain[{n}]": OWN[n] for n in (2, 3)}, [name], [1, 2, 3])


def sample(number):
    """Rows of one actuator as this sample."""
    states = alone(table_of(8), DESIGNS[0])
    return states.replace(sample=torch.full_like(states.sample, number))


@each
@pytest.mark.parametrize(("number", "gain"), [*OWN.items(), (9, sum(OWN.values()) / 3)])
def test_each_sample_has_its_own_and_one_not_fitted_their_mean(name, number, gain):
    states, plain = sample(number), build_model("continuum", MATERIAL)
    if name == "own_pressure_gain":
        expected = loads(plain, states.replace(pressure=states.pressure * (1 + gain)))
    else:
        factor = [1 + gain, 1.0] if name == "own_force_gain" else [1.0, 1 + gain]
        expected = loads(plain, states) * torch.tensor(factor, dtype=torch.float64)
    torch.testing.assert_close(loads(several(name), states), expected, rtol=1e-10, atol=1e-10)


@each
def test_the_first_has_none_and_what_all_share_is_another_effect(name):
    model = build_model("continuum", MATERIAL, [name, name.removeprefix("own_")], [1, 2, 3])
    gains = [label for label in model.declared if "gain" in label]
    assert sorted(gains) == sorted([f"{name}.gain[2]", f"{name}.gain[3]", f"{name.removeprefix('own_')}.gain"])


@each
def test_of_one_sample_alone_there_is_nothing_to_compare(name):
    states = sample(1)
    model = build_model("continuum", MATERIAL, [name], [1])
    with pytest.raises(UserError, match="nothing to compare"):
        check_effects(model.effects, model.values(), states)
    assert "several samples" in unseen(name, [], Rows.whole(states, loads(model, states)))


@each
def test_on_one_end_block_it_is_not_asked_of_one_sample(name):
    states = block(table_of(8))
    asked = unseen(name, [], Rows.whole(states, loads(made("continuum"), states)))
    assert ("pressure_gain" if name == "own_pressure_gain" else "several samples") in asked
