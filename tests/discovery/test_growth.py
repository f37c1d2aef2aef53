"""Noise that grows is found where it grows, and nowhere else."""

import numpy as np
import pytest
import torch

from freelearn.discovery.noise.tails import EVEN, LOAD, PRESSURE, STEPS, Growth, Tails, grown

COUNT = 600


def places(seed, count=COUNT):
    """Loads (N, 2) and pressures (N,) that have nothing to do with each other."""
    generator = np.random.default_rng([seed, 1])
    loads = generator.uniform(-1, 1, (count, 2)) * [12.0, 0.2]
    return torch.as_tensor(loads), torch.as_tensor(generator.uniform(0, 7e4, count))


def relative(kind, loads, pressure):
    size = loads.abs().numpy() if kind == LOAD else pressure[:, None].numpy() * np.ones(2)
    return size / size.max(0)


def errors(seed, freedom=np.inf, count=COUNT):
    generator = np.random.default_rng([seed, 2])
    shape = (count, 2)
    return generator.normal(size=shape) if np.isinf(freedom) else generator.standard_t(freedom, shape)


def neighbors(amount):
    """The step itself and the next on either side: half of one is 3 standard errors of an amount from 1,200 errors."""
    steps = [0.0, *STEPS]
    at = steps.index(amount)
    return steps[max(at - 1, 1) : at + 2]


@pytest.mark.parametrize("freedom", [np.inf, 4.0])
@pytest.mark.parametrize("kind", [LOAD, PRESSURE])
@pytest.mark.parametrize("amount", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("slipped", [0.0, 4e-4])
def test_growth_is_found_where_it_is(kind, amount, freedom, slipped):
    """Also where one reading of 2,500 is thought to have slipped: none has."""
    loads, pressure = places(3)
    factor = 1 + amount * relative(kind, loads, pressure)
    base = np.array([0.7, 1.6])
    raw = errors(3, freedom) * factor * base
    # In a unit in which they are about one, as whoever asks has them.
    size = 1.4826 * np.median(np.abs(raw), axis=0)
    found, unit = grown(torch.as_tensor(raw / size), loads, pressure, Tails(freedom, slipped))
    assert found.kind == kind
    assert found.amount in neighbors(amount)
    # What is left is even. Information of a t's scale, of N errors: 2 N ν/(ν + 3); for the amount, twice the error.
    share = 1.0 if np.isinf(freedom) else freedom / (freedom + 3)
    tolerance = 2 * 4 / np.sqrt(2 * COUNT * share)
    at_middle = float((1 + found.amount / 2) / (1 + amount / 2))
    np.testing.assert_allclose(unit.numpy() * size * at_middle, base, rtol=tolerance)


@pytest.mark.parametrize("count", [50, COUNT])
@pytest.mark.parametrize("freedom", [np.inf, 4.0])
def test_even_noise_does_not_grow(freedom, count):
    """Ten alternatives, each a χ² of one degree that must exceed 12: 0.5 % of all cases at most, more than 3 of 60 with
    a chance of one in ten thousand. In 50 rows it is chance alone that keeps a growth by half from being seen."""
    grew = 0
    for seed in range(60):
        z = torch.as_tensor(errors(seed, freedom, count))
        found, unit = grown(z, *places(seed, count), Tails(freedom))
        grew += found != EVEN
        if found == EVEN:
            # 5 standard errors of a scale, of Student's t with 4 degrees of freedom.
            np.testing.assert_allclose(unit, 1, atol=5 / np.sqrt(2 * count * 4 / 7))
    assert grew <= 3


def test_what_is_measured_at_no_load_has_nothing_to_grow_with():
    loads, pressure = torch.zeros(COUNT, 2, dtype=torch.float64), torch.zeros(COUNT, dtype=torch.float64)
    found, unit = grown(torch.as_tensor(errors(0)), loads, pressure, Tails())
    assert found == EVEN
    assert bool(unit.isfinite().all())
    assert bool((Growth(LOAD, 2.0).factor(loads, pressure) == 1).all())


def test_slipped_readings_at_large_loads_are_no_growth():
    loads, pressure = places(6)
    z = errors(6)
    largest = np.argsort(-loads[:, 0].abs().numpy())
    z[largest[:120:3], 0] = 12.0
    assert grown(torch.as_tensor(z), loads, pressure, Tails(slipped=0.03))[0] == EVEN
    # Taken for noise they would be growth.
    assert grown(torch.as_tensor(z), loads, pressure, Tails())[0].kind == LOAD
