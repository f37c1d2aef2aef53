"""Derivatives row by row, by two passes or, of rows that stand twice, by one."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from freelearn.physics.chain.prediction import Prediction
from freelearn.physics.chain.row_derivatives import recorded_with_rate, rows_jacobian


def loads(x):
    """Of every row by itself, of any number of quantities."""
    return torch.stack([(x**2).sum(1) + x[:, 0].sin(), x.prod(1) - x[:, -1].exp()], dim=-1)


@settings(deadline=None)
@given(blocks=st.integers(1, 3), rows=st.integers(1, 5), quantities=st.integers(1, 3), seed=st.integers(0, 99))
def test_one_pass_over_rows_that_stand_twice_gives_what_two_give(blocks, rows, quantities, seed):
    generator = torch.Generator().manual_seed(seed)
    each = torch.randn(blocks, 1, rows, quantities, dtype=torch.float64, generator=generator)
    x = each.expand(-1, 2, -1, -1).reshape(-1, quantities)
    value, rate = rows_jacobian(loads, x)
    again, twice = rows_jacobian(loads, x, doubled=blocks)
    torch.testing.assert_close(again, value, rtol=0, atol=0)
    torch.testing.assert_close(twice, rate, rtol=1e-14, atol=0)
    for row in range(len(x)):
        alone = torch.autograd.functional.jacobian(lambda one: loads(one[None])[0], x[row])
        torch.testing.assert_close(twice[row], alone, rtol=1e-12, atol=1e-12)


def test_what_is_recorded_serves_the_rates_and_all_else():
    x = torch.tensor([[0.3, 0.7], [0.3, 0.7]], dtype=torch.float64)
    size = torch.tensor(2.0, dtype=torch.float64, requires_grad=True)
    status = torch.zeros(2, dtype=torch.uint8)
    found, rate = recorded_with_rate(lambda at: Prediction(size * loads(at), status), x, doubled=1)
    torch.testing.assert_close(rate, rows_jacobian(lambda at: size.detach() * loads(at), x)[1], rtol=1e-14, atol=0)
    assert not rate.requires_grad
    (by_size,) = torch.autograd.grad(found.loads.sum(), size)
    assert float(by_size) == pytest.approx(float(loads(x).sum()), rel=1e-14)
