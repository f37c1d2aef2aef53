"""Whitening, as stated and where every reading counts with a precision of its own, against dense linear algebra."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from freelearn.data.accuracy import Accuracy
from freelearn.data.levels import Levels
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.noise.scatter import huber
from freelearn.discovery.noise.tails import Tails

ACCURACY = Accuracy(length=7e-5, twist=3e-3, pressure=150.0, force=0.03, moment=6e-4)
STATE = np.array([0, 0, 0, 5, 5, 9, 9, 9, 9, 2, 0, 5])
ROWS = len(STATE)


@pytest.fixture
def sensitivity():
    generator = torch.Generator().manual_seed(1)
    typical = torch.tensor([[3e4, 5.0, 1e-4], [5.0, 0.3, 1e-7]], dtype=torch.float64)
    return typical * torch.randn(ROWS, 2, 3, dtype=torch.float64, generator=generator)


@pytest.fixture
def found():
    """Precisions between 0.1 and 3 of readings, 0.2 and 2 of states; positions 1.7 times as uncertain as stated."""
    generator = np.random.default_rng(3)
    reading = torch.as_tensor(generator.uniform(0.1, 3, (ROWS, 2)))
    of_state = generator.uniform(0.2, 2, STATE.max() + 1)
    unknown = huber(torch.ones(ROWS, 2, dtype=torch.float64), ACCURACY)
    return replace(unknown, reading=reading, state=torch.as_tensor(of_state[STATE]), position=1.7)


def dense_covariance(sensitivity, found):
    """Entry by entry from what each error does: (2N, 2N). found: None, and all is as stated."""
    total = np.zeros((2 * ROWS, 2 * ROWS))
    by = sensitivity.numpy().reshape(2 * ROWS, 3)
    own = np.ones(2 * ROWS) if found is None else 1 / np.sqrt(found.reading.numpy().reshape(-1))
    shared = np.ones(ROWS) if found is None else found.position**2 / found.state.numpy()
    for a in range(2 * ROWS):
        for b in range(2 * ROWS):
            if a == b:
                total[a, b] += (ACCURACY.force if a % 2 == 0 else ACCURACY.moment) ** 2 * own[a] ** 2
            if a // 2 == b // 2:
                total[a, b] += by[a, 2] * by[b, 2] * ACCURACY.pressure**2 * own[a] * own[b]
            if STATE[a // 2] == STATE[b // 2]:
                moved = by[a, 0] * by[b, 0] * ACCURACY.length**2 + by[a, 1] * by[b, 1] * ACCURACY.twist**2
                total[a, b] += moved * shared[a // 2]
    return total


def root_of(whiten):
    return whiten(torch.eye(2 * ROWS, dtype=torch.float64).reshape(ROWS, 2, -1)).reshape(2 * ROWS, -1).numpy()


@pytest.mark.parametrize("known", [False, True], ids=["stated", "precisions"])
def test_whitening_turns_the_dense_covariance_into_the_identity(sensitivity, found, known):
    scatter = found if known else None
    whiten = Whitener(sensitivity, torch.as_tensor(STATE), ACCURACY, scatter)
    root, covariance = root_of(whiten), dense_covariance(sensitivity, scatter)
    np.testing.assert_allclose(root @ covariance @ root.T, np.eye(2 * ROWS), atol=1e-9)
    stated = dense_covariance(sensitivity, None).diagonal()
    np.testing.assert_allclose(whiten.variance.numpy().reshape(-1), stated, rtol=1e-12)


LEVEL = np.array([0, 1, 2, 0, 1, 0, 1, 2, 7, 2, 1, 7])


@pytest.mark.parametrize("known", [False, True], ids=["stated", "precisions"])
def test_rows_of_one_level_err_alike_whatever_their_state(sensitivity, found, known):
    """By as much as their level's mean, each seen through the row's own answer to the pressure."""
    scatter, error = found if known else None, np.where(LEVEL == 7, 0.0, 60.0 + 40.0 * LEVEL)
    levels = Levels(torch.as_tensor(LEVEL)[:, None], torch.as_tensor(error)[:, None])
    whiten = Whitener(sensitivity, torch.as_tensor(STATE), ACCURACY, scatter, levels=levels)
    by, level, own = sensitivity[:, :, 2].numpy().reshape(-1), np.repeat(LEVEL, 2), np.repeat(error, 2)
    alike = np.where(level[:, None] == level, np.outer(by * own, by * own), 0.0)
    covariance = dense_covariance(sensitivity, scatter) + alike
    root = root_of(whiten)
    np.testing.assert_allclose(root @ covariance @ root.T, np.eye(2 * ROWS), atol=1e-9)
    stated = (dense_covariance(sensitivity, None) + alike).diagonal()
    np.testing.assert_allclose(whiten.variance.numpy().reshape(-1), stated, rtol=1e-12)
    # Of some states alone the levels' errors are the same ones.
    some = torch.as_tensor(np.flatnonzero(np.isin(STATE, [0, 9])))
    part = Whitener(
        sensitivity[some], torch.as_tensor(STATE)[some], ACCURACY, None if scatter is None else scatter.of(some),
        levels=levels.of(some),
    )  # fmt: skip
    loads = torch.randn(len(some), 2, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(2))
    torch.testing.assert_close(whiten.part(some)(loads), part(loads), rtol=1e-10, atol=1e-10)
    # What is drawn scatters so: 40,000 draws tell a variance to 0.7 %.
    generator = torch.Generator().manual_seed(3)
    drawn = torch.stack([whiten.drawn(generator).reshape(-1) for _ in range(40_000)]).numpy()
    np.testing.assert_allclose(drawn.var(0), covariance.diagonal(), rtol=0.04)
    first, second = 0, 6  # forces of the rows 0 and 3: of one level, in two states
    assert np.corrcoef(drawn[:, first], drawn[:, second])[0, 1] == pytest.approx(
        covariance[first, second] / np.sqrt(covariance[first, first] * covariance[second, second]), abs=0.02
    )


def test_about_a_model_far_off_readings_weigh_alike_and_a_place_takes_nothing(sensitivity, found):
    """Of usual precision one: errors as stated and the doubt, each reading by itself; one that slipped is gone."""
    usual, doubt = replace(found, weight=found.reading), torch.tensor([0.2, 3e-3], dtype=torch.float64)
    whiten = Whitener(sensitivity, torch.as_tensor(STATE), ACCURACY, usual, doubt=doubt, even=True)
    even = replace(found, reading=torch.ones_like(found.reading), position=0.0)
    covariance = dense_covariance(sensitivity, even) + np.diag(doubt.square().repeat(ROWS).numpy())
    root = root_of(whiten)
    np.testing.assert_allclose(root @ covariance @ root.T, np.eye(2 * ROWS), atol=1e-9)
    # What is told of the noise itself stays as it was found.
    torch.testing.assert_close(
        whiten.scattered, Whitener(sensitivity, torch.as_tensor(STATE), ACCURACY, usual).scattered
    )
    z = usual.z.clone()
    z[4, 1] = 100.0
    slipped = Whitener(sensitivity, torch.as_tensor(STATE), ACCURACY, replace(usual, z=z), doubt=doubt, even=True)
    white = slipped(torch.ones(ROWS, 2, dtype=torch.float64))
    assert float(white[4, 1]) == 0.0
    assert float(white[4, 0]) != 0.0


def test_whitening_takes_one_column_or_several(sensitivity, found):
    whiten = Whitener(sensitivity, torch.as_tensor(STATE), ACCURACY, found)
    loads = torch.randn(ROWS, 2, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    for k in range(3):
        torch.testing.assert_close(whiten(loads)[..., k], whiten(loads[..., k]))


def test_precisions_of_one_change_nothing(sensitivity, found):
    one = replace(found, reading=torch.ones_like(found.reading), state=torch.ones_like(found.state), position=1.0)
    state = torch.as_tensor(STATE)
    np.testing.assert_allclose(
        root_of(Whitener(sensitivity, state, ACCURACY, one)), root_of(Whitener(sensitivity, state, ACCURACY))
    )


def test_without_a_reading_the_others_are_as_if_it_were_not_there(sensitivity, found):
    """Row 6 of state 9 has lost both readings: neither they nor their share of the position error are left."""
    reading = found.reading.clone()
    reading[6] = 0
    state, left = torch.as_tensor(STATE), torch.arange(ROWS) != 6
    whole = Whitener(sensitivity, state, ACCURACY, replace(found, reading=reading))
    part = replace(found, reading=reading[left], state=found.state[left])
    without = Whitener(sensitivity[left], state[left], ACCURACY, part)
    loads = torch.randn(ROWS, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    white = whole(loads)
    assert bool((white[6] == 0).all())
    torch.testing.assert_close(white[left], without(loads[left]))
    loads[6] = 1e12
    torch.testing.assert_close(whole(loads)[left], white[left])


@pytest.mark.parametrize("known", [False, True], ids=["stated", "precisions"])
def test_parts_are_whitened_as_the_whole(sensitivity, found, known):
    state = torch.as_tensor(STATE)
    whiten = Whitener(sensitivity, state, ACCURACY, found if known else None)
    rows = torch.nonzero((state == 9) | (state == 5))[:, 0]
    loads = torch.randn(ROWS, 2, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    torch.testing.assert_close(whiten.part(rows)(loads[rows]), whiten(loads)[rows])
    with pytest.raises(ValueError, match="whole kinematic states"):
        whiten.part(rows[1:])


def test_the_noise_floor_is_the_stated_one(sensitivity, found):
    state = torch.as_tensor(STATE)
    told, known = (Whitener(sensitivity, state, ACCURACY, f) for f in (None, found))
    torch.testing.assert_close(told.variance, known.variance)
    assert (told.efficiency, known.efficiency) == (1.0, 1.0)
    heavy = Whitener(sensitivity, state, ACCURACY, replace(found, tails=Tails(4.0)))
    assert heavy.efficiency == pytest.approx(5 / 7)


@pytest.mark.parametrize("known", [False, True], ids=["stated", "precisions"])
def test_noise_that_is_drawn_has_the_dense_covariance(sensitivity, found, known):
    """Of 4,000 draws every entry within five standard errors: √(C_aa C_bb + C_ab²) / √draws."""
    scatter = found if known else None
    whiten = Whitener(sensitivity, torch.as_tensor(STATE), ACCURACY, scatter)
    generator = torch.Generator().manual_seed(2)
    draws = torch.stack([whiten.drawn(generator).reshape(-1) for _ in range(4000)]).numpy()
    expected = dense_covariance(sensitivity, scatter)
    size = np.sqrt((np.outer(expected.diagonal(), expected.diagonal()) + expected**2) / len(draws))
    np.testing.assert_array_less(np.abs(draws.T @ draws / len(draws) - expected), 5 * size)
    again = torch.Generator().manual_seed(2)
    np.testing.assert_array_equal(whiten.drawn(again).reshape(-1).numpy(), draws[0])


@pytest.mark.parametrize("known", [False, True], ids=["stated", "precisions"])
def test_what_places_do_and_what_rows_have_of_their_own_add_up_to_the_dense_variance(sensitivity, found, known):
    scatter = found if known else None
    whiten = Whitener(sensitivity, torch.as_tensor(STATE), ACCURACY, scatter)
    variance = whiten.own.square() + whiten.places.square().sum(-1)
    expected = dense_covariance(sensitivity, scatter).diagonal().reshape(ROWS, 2)
    np.testing.assert_allclose(variance.numpy(), expected, rtol=1e-9)


def test_a_reading_that_hardly_counts_leaves_numbers(sensitivity, found):
    """A weight that is next to nothing is none: what is divided by it would be no number, nor would its state be."""
    reading = found.reading.clone()
    reading[0] = torch.tensor([1e-269, 1e-78])
    reading[1] = torch.tensor([1e-318, 1e-106])
    gone = replace(found, reading=torch.where(reading < 1e-12, 0.0, reading))
    loads = torch.randn(ROWS, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(2))
    white = Whitener(sensitivity, torch.as_tensor(STATE), ACCURACY, replace(found, reading=reading))(loads)
    assert bool(white.isfinite().all())
    torch.testing.assert_close(white, Whitener(sensitivity, torch.as_tensor(STATE), ACCURACY, gone)(loads))
