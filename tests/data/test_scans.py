"""Scans against loops over the samples."""

import numpy as np
import pytest
import torch

from freelearn.data.blocks import BLOCKS
from freelearn.data.recordings import followed, recurred, stopped, turned
from freelearn.data.stops import Spread, stops

# With blocks of one sample, of two, of several, the last of which are not full.
COUNTS = [1, 2, 3, 4, 5, 8, 13, 1000, BLOCKS, BLOCKS + 1, 2 * BLOCKS + 3, 5 * BLOCKS - 4]


@pytest.mark.parametrize("count", COUNTS)
def test_a_recurrence_is_the_loops(count):
    generator = np.random.default_rng(count)
    factor, added = generator.uniform(0, 1, count), generator.normal(size=count)
    value, expected = 0.0, []
    for a, b in zip(factor, added, strict=True):
        value = a * value + b
        expected.append(value)
    np.testing.assert_allclose(recurred(torch.tensor(factor), torch.tensor(added)), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("count", COUNTS)
def test_a_stop_is_the_loops(count):
    """With bounds that move, and that close now and then, where it begins anew."""
    generator = np.random.default_rng(count)
    x, width = generator.normal(size=count).cumsum(), generator.uniform(0, 2, count)
    low, high = -width * (generator.uniform(size=count) > 0.1), 0.7 * width
    low[0] = high[0] = 0.0
    value, expected = 0.0, [0.0]
    for n in range(1, count):
        value = min(max(value + x[n] - x[n - 1], low[n]), high[n])
        expected.append(value)
    np.testing.assert_allclose(stopped(*map(torch.tensor, (x, low, high))), expected, rtol=1e-12, atol=1e-12)


def test_the_derivative_of_a_stop_is_that_of_differences():
    """By the signal and by both bounds, forward and backward; nothing is clamped just there."""
    generator = np.random.default_rng(1)
    x, low = torch.tensor(generator.normal(size=30).cumsum()), -torch.tensor(generator.uniform(0.2, 1, 30))
    low[0] = 0.0

    def of(scale):
        return stopped(scale[0] * x, scale[1] * low, -scale[2] * low)

    at = torch.tensor([1.1, 0.9, 0.7], dtype=torch.float64)
    forward, backward = torch.func.jacfwd(of)(at), torch.func.jacrev(of)(at)
    torch.testing.assert_close(forward, backward)
    for k in range(3):
        step = torch.zeros(3, dtype=torch.float64)
        step[k] = 1e-6
        torch.testing.assert_close(forward[:, k], (of(at + step) - of(at - step)) / 2e-6, rtol=1e-6, atol=1e-8)


SPREAD = Spread((0.3, 1.0, 2.5), (0.5, 0.3, 0.1))


def elements(count):
    """A signal of two columns with bounds that stay, of three sizes, begun anew now and then."""
    generator = np.random.default_rng(count)
    signal = generator.normal(size=(count, 2)).cumsum(0)
    return signal, np.array([-0.7, -0.4]), np.array([0.9, 0.6]), SPREAD, generator.uniform(size=count) < 0.02


def held_one_by_one(signal, low, high, spread, anew):
    """What the stops hold together, sample by sample."""
    ratios, shares = spread
    z, found = np.zeros((len(ratios), 2)), np.zeros_like(signal)
    for n, x in enumerate(signal):
        for i, ratio in enumerate(ratios):
            z[i] = 0.0 if anew[n] else np.clip(z[i] + (x - signal[n - 1] if n else 0.0), ratio * low, ratio * high)
        found[n] = np.array(shares) @ z
    return found


@pytest.mark.parametrize("count", [1, 7, 2 * BLOCKS + 3])
def test_elements_with_bounds_that_stay_are_the_loops(count):
    signal, low, high, spread, anew = elements(count)
    found = stops(*map(torch.tensor, (signal, low[None], high[None])), spread, torch.tensor(anew))
    np.testing.assert_allclose(found, held_one_by_one(signal, low, high, spread, anew), rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("moving", [False, True])
def test_derivatives_of_elements_are_those_of_the_loop(moving):
    """Forward and backward through several blocks, and of a batch of signals, against differences of the loop."""
    signal, low, high, spread, anew = elements(2 * BLOCKS + 3)
    x, bottom, top = (torch.tensor(each) for each in (signal, low[None], high[None]))
    if moving:
        bottom, top = bottom.expand_as(x), top.expand_as(x)

    def of(scale):
        return stops(scale[0] * x, scale[1] * bottom, scale[2] * top, spread, torch.tensor(anew))

    at, step = np.array([1.1, 0.9, 0.7]), 1e-6
    forward = torch.func.jacfwd(of)(torch.tensor(at))
    weights = torch.tensor(np.random.default_rng(0).normal(size=x.shape))
    backward = torch.func.grad(lambda scale: (weights * of(scale)).sum())(torch.tensor(at))
    batch = torch.func.vmap(of)(torch.tensor(np.array([at, 2 * at])))
    torch.testing.assert_close(backward, torch.einsum("nc,nck->k", weights, forward))
    for k, unit in enumerate(np.eye(3)):
        ahead, behind = (
            held_one_by_one(a * signal, b * low, c * high, spread, anew)
            for a, b, c in (at + step * unit, at - step * unit)
        )
        # But for the few samples at which something is clamped in between.
        differs = np.abs(forward[..., k].numpy() - (ahead - behind) / (2 * step)) > 1e-6
        assert differs.mean() < 1e-3
    np.testing.assert_allclose(batch[1], of(torch.tensor(2 * at)), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("count", [4, 2 * BLOCKS + 3])
def test_derivatives_of_a_recurrence_are_those_of_differences(count):
    """By factors that columns share and by what is added, forward, backward, and of a batch."""
    generator = np.random.default_rng(count)
    factor, added = (torch.tensor(generator.uniform(size=(count, columns))) for columns in (1, 3))

    def of(scale):
        return recurred(scale[0] * factor, scale[1] * added)

    at = torch.tensor([0.9, 1.3], dtype=torch.float64)
    forward = torch.func.jacfwd(of)(at)
    weights = torch.tensor(generator.normal(size=added.shape))
    torch.testing.assert_close(
        torch.func.grad(lambda scale: (weights * of(scale)).sum())(at), torch.einsum("nc,nck->k", weights, forward)
    )
    for k in range(2):
        step = 1e-6 * torch.eye(2, dtype=torch.float64)[k]
        torch.testing.assert_close(forward[..., k], (of(at + step) - of(at - step)) / 2e-6, rtol=1e-6, atol=1e-8)
    torch.testing.assert_close(torch.func.vmap(of)(torch.stack([at, at / 2]))[1], of(at / 2))


@pytest.mark.parametrize("count", [1, 2, 5, 64, 301])
def test_pairs_that_turn_are_the_loops(count):
    generator = np.random.default_rng(count)
    matrix, added = generator.normal(size=(count, 2, 2)) / 2, generator.normal(size=(count, 2))
    value, expected = np.zeros(2), []
    for a, b in zip(matrix, added, strict=True):
        value = a @ value + b
        expected.append(value)
    entries = [[torch.tensor(matrix[:, i, j]) for j in (0, 1)] for i in (0, 1)]
    found = turned((tuple(entries[0]), tuple(entries[1])), tuple(torch.tensor(added).unbind(1)))
    np.testing.assert_allclose(torch.stack(found, dim=1), expected, rtol=1e-12, atol=1e-12)


def test_whatever_is_followed_is_the_loop_with_its_derivatives():
    """Through a saturating map of each sample's own, begun anew in the middle; by a parameter, against differences."""
    drive = torch.tensor(np.random.default_rng(2).normal(size=80))
    anew = torch.zeros(80, dtype=torch.bool)
    anew[0] = anew[50] = True

    def of(a):
        return followed(lambda x, a: torch.tanh(a * x + drive), (a,), anew, drive, 0 * drive)

    value, expected = 0.0, []
    for u, new in zip(drive.tolist(), anew.tolist(), strict=True):
        value = u if new else np.tanh(0.8 * value + u)
        expected.append(value)
    a = torch.tensor(0.8, dtype=torch.float64)
    np.testing.assert_allclose(of(a), expected, rtol=1e-12)
    forward, backward = torch.func.jacfwd(of)(a), torch.func.jacrev(of)(a)
    torch.testing.assert_close(forward, (of(a + 1e-6) - of(a - 1e-6)) / 2e-6, rtol=1e-7, atol=1e-9)
    torch.testing.assert_close(forward, backward)
