"""The network: its size, its scaling, its removed inputs."""

import torch

from freelearn.data.rows import Rows
from freelearn.fitting.starts import starts
from freelearn.physics.models.mlp import INPUT_NAMES, MLP, inputs


def test_has_the_papers_62_parameters():
    model = MLP()
    assert len(model.vector()) == 62
    assert len(model.labels()) == len(set(model.labels())) == 62


def test_constant_inputs_are_removed_and_another_sample_still_predicted(random_states):
    states = random_states(200)
    one = states[states.sample == 3]
    loads = torch.randn(len(one), 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    model = MLP()
    model.prepare(Rows.whole(one, loads))
    assert [n for n, g in zip(INPUT_NAMES, model.input_gain, strict=True) if g] == ["length", "twist", "pressure"]
    model.set_vector(starts(model, Rows.whole(one, loads), 1, torch.Generator().manual_seed(1))[0])
    redesigned = one.replace(fiber_angle=one.fiber_angle + 0.3, outer_radius=one.outer_radius * 1.1)
    torch.testing.assert_close(model(redesigned).loads, model(one).loads)
    assert model(states).loads.isfinite().all()


def test_scaled_inputs_and_loads_fill_minus_one_to_one(random_states):
    states = random_states(300)
    loads = torch.randn(300, 2, dtype=torch.float64) * torch.tensor([30.0, 0.02])
    model = MLP()
    model.prepare(Rows.whole(states, loads))
    x = (inputs(states) - model.input_center) * model.input_gain
    varying = model.input_gain != 0
    torch.testing.assert_close(x.amax(0)[varying], torch.ones(int(varying.sum())).double())
    torch.testing.assert_close(x.amin(0)[varying], -torch.ones(int(varying.sum())).double())
    # With all weights zero the network says the center of the loads' range.
    torch.testing.assert_close(model(states).loads[0], (loads.amin(0) + loads.amax(0)) / 2)


def test_one_weight_set_per_row_equals_shared_weights(random_states):
    states = random_states(10)
    model = MLP()
    model.prepare(Rows.whole(states, torch.randn(10, 2, dtype=torch.float64)))
    vector = torch.randn(62, dtype=torch.float64)
    shared = model(states, model.physical(vector)).loads
    torch.testing.assert_close(model.chain(states, model.physical(vector.expand(10, -1))).loads, shared)


def test_the_hand_written_jacobian_is_the_derivative_of_the_loads(random_states):
    states = random_states(40)
    loads = torch.randn(40, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(2))
    model = MLP()
    model.prepare(Rows.whole(states, loads))
    vector = starts(model, Rows.whole(states, loads), 1, torch.Generator().manual_seed(5))[0]
    by_autograd = torch.func.jacfwd(lambda v: model(states, model.physical(v)).loads)(vector)
    torch.testing.assert_close(model.row_jacobian(states, vector), by_autograd, rtol=1e-11, atol=1e-13)
