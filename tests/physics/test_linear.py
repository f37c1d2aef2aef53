"""The linear model against the textbook, its edge, and its marks."""

import math

import numpy as np
import pytest
import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st

from freelearn.common.errors import UserError
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import load_model
from freelearn.physics.models.linear import Linear
from freelearn.testing.reference import textbook


def test_agrees_with_the_textbook(random_states):
    states = random_states(60)
    model = Linear(ka=900.0, kb=0.05, kc=-1.5)
    loads = model(states).loads.detach().numpy()
    expected = [
        textbook.linear_row(*map(float, row), ka=900.0, kb=0.05, kc=-1.5)
        for row in zip(
            states.fiber_angle,
            states.reference_length,
            states.outer_radius,
            states.length,
            states.twist,
            states.pressure,
            strict=True,
        )
    ]
    assert (np.abs(loads - expected).max(0) / np.abs(expected).max(0)).max() < 1e-7


@settings(max_examples=50, deadline=None)
@given(st.floats(-12, 12), st.floats(-12, 12), st.floats(-2, 2))
@example(5.0, 11.999999999999998, 1.0)
def test_stiffness_is_positive_definite_within_the_bounds_of_a_fit(a, b, coupling):
    raw = torch.tensor([a, b, coupling], dtype=torch.float64).clamp(*Linear().raw_bounds())
    values = Linear().physical(raw)
    ka, kb, kc = (values[name] for name in ("ka", "kb", "kc"))
    assert ka > 0
    assert kb > 0
    # kc is made of a sum of two exponents of at most 12, which is rounded by 2e-15; products add their share.
    assert ka * kb - kc * kc >= -4e-15 * ka * kb


@settings(max_examples=50, deadline=None)
@given(st.floats(1e-3, 1e5), st.floats(1e-5, 10), st.floats(-0.99, 0.99))
def test_values_survive_the_raw_form(ka, kb, share):
    kc = share * (ka * kb) ** 0.5
    values = Linear(ka=ka, kb=kb, kc=kc).scalars()
    assert values == pytest.approx({"ka": ka, "kb": kb, "kc": kc}, rel=1e-9, abs=1e-12)


def test_the_papers_start_is_allowed_and_worse_ones_are_not():
    assert Linear(ka=1.0, kb=1.0, kc=1.0).scalars()["kc"] == pytest.approx(1.0)
    with pytest.raises(UserError, match="positive definite"):
        Linear(ka=1.0, kb=1.0, kc=1.1)


def test_marks_overstretched_and_singular_rows(random_states):
    states = random_states(3)
    fiber = states.reference_length / torch.cos(states.fiber_angle)
    wrap = states.reference_length / states.outer_radius * torch.tan(states.fiber_angle)
    length = torch.stack([fiber[0] * 1.001, states.length[1], fiber[2] * 0.999])
    twist = torch.stack([states.twist[0], -wrap[1] * 1.001, states.twist[2]])
    prediction = Linear()(states.replace(length=length, twist=twist))
    assert prediction.status.tolist() == [Status.OVERSTRETCHED, Status.SINGULAR, Status.OK]
    assert prediction.loads.isfinite().all()


def test_reciprocity(random_states):
    states = random_states(20)
    model = Linear(kc=2.0)

    def total(length: torch.Tensor, twist: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        force, moment = model(states.replace(length=length, twist=twist)).loads.unbind(-1)
        return force.sum(), moment.sum()

    jacobian = torch.func.jacrev(total, argnums=(0, 1))(states.length, states.twist)
    torch.testing.assert_close(jacobian[0][1], jacobian[1][0], rtol=1e-9, atol=1e-9)


def test_a_checkpoint_that_kept_factors_of_the_matrix_is_read_as_it_was_meant(tmp_path):
    """As versions wrote it that moved C of K = C Cᵀ, C = [[e^a, 0], [c, e^b]]."""
    model = Linear()
    state = model.state() | {
        "raw.ka": torch.tensor(math.log(900.0) / 2, dtype=torch.float64),
        "raw.kb": torch.tensor(math.log(0.05 - 1.5**2 / 900.0) / 2, dtype=torch.float64),
        "raw.kc": torch.tensor(-1.5 / 30.0, dtype=torch.float64),
    }
    older = {name: value for name, value in model.description().items() if name != "raw_form"} | {"state": state}
    torch.save({"freelearn": older}, tmp_path / "checkpoint.ckpt")
    found = load_model(tmp_path / "checkpoint.ckpt").scalars()
    assert found == pytest.approx({"ka": 900.0, "kb": 0.05, "kc": -1.5}, rel=1e-12)
