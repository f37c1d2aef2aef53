"""Noise where readings are blank: whitening against dense matrices, scatter, suspects, and the test of what is left."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from first_step import first_step
from linear_bed import ACCURACY, NOISE, SHORT, TRUE, LinearBed, bench, jacobian, predicted, sensitivity
from nightly import chosen
from scipy import stats

from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Readings, Rows
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.noise.noise import Whitener, noise_floor, whitened_basis
from freelearn.discovery.noise.scatter import huber, scatter
from freelearn.discovery.noise.shapes import bases, dense
from freelearn.discovery.noise.structure import LOOKED_AT, structure
from freelearn.discovery.residuals.suspects import suspects
from freelearn.discovery.thresholds import ALPHA_STRUCTURE
from freelearn.physics.effects.registry import make_effects

STATE = np.array([0, 0, 0, 5, 5, 9, 9, 9, 9, 2, 0, 5])
COUNT = len(STATE)


@pytest.fixture
def sensitive():
    """Of force and moment by length, twist and the pressures of two members."""
    typical = torch.tensor([[3e4, 5.0, 1e-4, 2e-4], [5.0, 0.3, 1e-6, 3e-6]], dtype=torch.float64)
    generator = torch.Generator().manual_seed(1)
    return typical * torch.randn(COUNT, 2, 4, dtype=torch.float64, generator=generator)


def present_in(seed: int, count: int, share: float = 0.4) -> torch.Tensor:
    return torch.as_tensor(np.random.default_rng(seed).random((count, 2)) >= share)


def dense_covariance(sensitive, reading, shared) -> np.ndarray:
    """(2N, 2N), entry by entry: sensors, each pressure once a row, the position once a state. reading, shared: standard
    deviations in units of the stated ones, of each reading (2N,) and of each row's state's position (N,)."""
    total = np.zeros((2 * COUNT, 2 * COUNT))
    by = sensitive.numpy().reshape(2 * COUNT, 4)
    for a in range(2 * COUNT):
        for b in range(2 * COUNT):
            if a == b:
                total[a, b] += ([ACCURACY.force, ACCURACY.moment][a % 2] * reading[a]) ** 2
            if a // 2 == b // 2:
                total[a, b] += by[a, 2:] @ by[b, 2:] * ACCURACY.pressure**2 * reading[a] * reading[b]
            if STATE[a // 2] == STATE[b // 2]:
                moved = by[a, 0] * by[b, 0] * ACCURACY.length**2 + by[a, 1] * by[b, 1] * ACCURACY.twist**2
                total[a, b] += moved * shared[a // 2] ** 2
    return total


@pytest.mark.parametrize("known", [False, True], ids=["stated", "precisions"])
@pytest.mark.parametrize("seed", range(4))
def test_what_is_left_is_whitened_by_its_marginal_distribution(sensitive, seed, known):
    """rᵀ Σ⁻¹ r and log det of the block of the covariance that belongs to the readings present, by Cholesky."""
    present = present_in(seed, COUNT)
    there = present.reshape(-1).numpy()
    generator = np.random.default_rng(seed)
    reading, shared, found = np.ones(2 * COUNT), np.ones(COUNT), None
    if known:
        precision = generator.uniform(0.2, 3, (COUNT, 2)) * present.numpy()
        of_state = generator.uniform(0.2, 2, 10)[STATE]
        unknown = huber(torch.ones(COUNT, 2, dtype=torch.float64), ACCURACY)
        found = replace(unknown, reading=torch.as_tensor(precision), state=torch.as_tensor(of_state), position=1.7)
        reading[there] = 1 / np.sqrt(precision.reshape(-1)[there])
        shared = 1.7 / np.sqrt(of_state)
    whiten = Whitener(sensitive, torch.as_tensor(STATE), ACCURACY, found, present=present)
    covariance = dense_covariance(sensitive, reading, shared)[np.ix_(there, there)]
    root = whiten(torch.eye(2 * COUNT, dtype=torch.float64).reshape(COUNT, 2, -1)).reshape(2 * COUNT, -1).numpy()
    assert (root[~there] == 0).all()
    assert (root[:, ~there] == 0).all()
    np.testing.assert_allclose(
        root[there][:, there] @ covariance @ root[there][:, there].T, np.eye(there.sum()), atol=1e-9
    )
    residual = generator.normal(size=(COUNT, 2)) * [0.1, 2e-3]
    half = np.linalg.solve(np.linalg.cholesky(covariance), residual.reshape(-1)[there])
    white = whiten(torch.as_tensor(residual))
    assert float(white.square().sum()) == pytest.approx(half @ half, rel=1e-9)
    assert whiten.count == there.sum()


def test_a_blank_reading_is_nothing_whatever_it_is_said_to_be(sensitive):
    present = present_in(5, COUNT)
    whiten = Whitener(sensitive, torch.as_tensor(STATE), ACCURACY, present=present)
    residual = torch.ones(COUNT, 2, dtype=torch.float64)
    wild = torch.where(present, residual, 1e30)
    assert torch.equal(whiten(residual), whiten(wild))


def test_the_noise_floor_is_over_the_readings_that_there_are(sensitive):
    present = present_in(6, COUNT)
    whiten = Whitener(sensitive, torch.as_tensor(STATE), ACCURACY, present=present)
    stated = dense_covariance(sensitive, np.ones(2 * COUNT), np.ones(COUNT)).diagonal().reshape(COUNT, 2)
    scale = torch.tensor([10.0, 0.2], dtype=torch.float64)
    expected = sum(stated[present[:, i].numpy(), i].mean() / float(scale[i]) ** 2 for i in (0, 1)) ** 0.5
    assert whiten.floor(scale) == pytest.approx(expected, rel=1e-12)
    none = torch.zeros(COUNT, 2, dtype=torch.bool)
    assert noise_floor(torch.zeros(COUNT, 2), none, scale) == 0.0


def told_of(made, present) -> Readings:
    return Readings(torch.where(present, made.rows.loads, 0.0), present, torch.zeros(len(present), dtype=torch.bool))


def seen(made, present, like=ACCURACY, wild=None):
    """The scatter about the true numbers; wild: what stands in place of the residuals of blanks."""
    rows = made.rows
    loads, state = predicted(rows.states), torch.as_tensor(rows.state)
    raw = torch.where(present, loads - rows.loads, 0.0 if wild is None else wild)
    slopes = torch.where(present[..., None], jacobian(rows.states), 0.0)
    return scatter(
        raw, slopes, loads, sensitivity(len(rows)), rows.states, state, like, readings=told_of(made, present)
    )


@pytest.mark.parametrize("size", [(1, 1, 1), (3, 2, 0.5), (0.5, 0.5, 3)])
def test_sizes_are_recovered_of_what_is_there(size):
    """Four in ten blank: four standard errors of a scale from 250 readings, a third of them taken by smooth shapes;
    positions to a half, since their states are told by fewer rows."""
    stated = Accuracy(3e-5, 5e-3, 0.0, 0.03, 6e-4)
    place, force, moment = size
    true = Accuracy(3e-5 * place, 5e-3 * place, 0.0, 0.03 * force, 6e-4 * moment)
    made = bench(11, true=true)
    present = present_in(7, len(made.loads))
    found = seen(made, present, stated)
    count = int(present.sum(0).min())
    np.testing.assert_allclose(found.deviations, [force, moment], rtol=4 / np.sqrt(2 * count * 2 / 3))
    assert found.position * found.tails.deviation == pytest.approx(place, rel=0.5)
    assert not found.slipped.any()
    assert (found.reading[~present] == 0).all()


def test_without_any_moment_the_forces_scatter_is_found_and_the_moments_stays_as_stated():
    true = Accuracy(3e-5, 5e-3, 0.0, 0.06, 6e-4)
    made = bench(12, true=true)
    present = torch.ones(len(made.loads), 2, dtype=torch.bool)
    present[:, 1] = False
    found = seen(made, present, Accuracy(3e-5, 5e-3, 0.0, 0.03, 6e-4))
    count = len(made.loads)
    assert float(found.deviations[0]) == pytest.approx(2, rel=4 / np.sqrt(2 * count * 2 / 3))
    # But for what the shape of the tails is worth, which both share.
    assert float(found.scale[1]) == pytest.approx(1.0, rel=0.01)


def test_what_stands_in_place_of_a_blank_tells_nothing_of_the_scatter():
    """Three hundred standard deviations, in readings of no weight (1e-12 of a good one's, to divide by)."""
    made = bench(13, **SHORT)
    present = present_in(8, len(made.loads))
    one, other = seen(made, present), seen(made, present, wild=10.0)
    for name in ("scale", "reading", "state"):
        torch.testing.assert_close(getattr(one, name), getattr(other, name), rtol=1e-5, atol=1e-8)
    assert one.position == pytest.approx(other.position, rel=1e-5)


def question(made, present) -> Question:
    rows = made.rows
    return Question(
        lambda names: LinearBed(make_effects(names, LinearBed.family)),
        [],
        Rows(rows.states, told_of(made, present), rows.state),
        ACCURACY,
        0,
    )


def test_the_fit_that_a_search_stands_on_finds_the_true_numbers():
    """Generalized least squares of a linear model: within four of its standard errors, from whitened slopes."""
    made = bench(14, **SHORT)
    _, step = first_step(question(made, present_in(9, len(made.loads))))
    slopes = step.fit.jacobian.flatten(0, 1).numpy()
    error = np.sqrt(np.linalg.inv(slopes.T @ slopes).diagonal())
    found = np.array(list(step.fit.values().values()))
    assert (np.abs(found - TRUE) < 4 * error).all()


@pytest.mark.parametrize("load", [0, 1], ids=["force", "moment"])
def test_a_slipped_reading_is_suspected_among_blanks(load):
    """Its row's other reading is blank, so that it stands alone; and no blank is ever accused."""
    made = bench(2, **SHORT)
    present = present_in(10, len(made.loads), 0.3)
    large = np.abs(made.loads[:, load]) * present[:, load].numpy()
    row = int(large.argmax())
    present[row, 1 - load] = False
    made = made.showing({(row, load): -made.loads[row, load]})
    prepared, step = first_step(question(made, present))
    (found,) = suspects(step, prepared.rows, prepared.kept)
    assert (found.row, found.load) == (row, ("force", "moment")[load])
    assert found.slip == "sign turned"


def by_projections(residual, slopes, states, whiten):
    """The test of structure by SVD and SciPy's F, with the blanks' numbers struck out: p-values of all residuals and
    with each state explaining nothing in turn."""
    there = whiten.present.reshape(-1).numpy()
    flat, slopes = residual.reshape(-1).numpy()[there], slopes.flatten(0, 1).numpy()[there]
    absorbed = np.linalg.svd(slopes, full_matrices=False)[0]
    of_state = whiten.state.repeat_interleave(2).numpy()[there]
    cases = np.stack([flat, *(np.where(of_state == n, 0.0, flat) for n in range(whiten.states))])
    found = []
    for basis in bases(states):
        columns = whitened_basis(dense(basis, len(states)), whiten).numpy()[there]
        length = np.linalg.norm(columns, axis=0)
        columns = columns[:, length > 0] / length[length > 0]
        left, size, _ = np.linalg.svd(columns - absorbed @ (absorbed.T @ columns), full_matrices=False)
        found.append((int((size > 1e-5).sum()), ((cases @ left[:, size > 1e-5]) ** 2).sum(1)))
    rank, explained = max(found, key=lambda f: f[0])
    freedom = there.sum() - slopes.shape[1] - rank
    variance = ((flat**2).sum() - explained[0]) / freedom
    chances = [stats.f.sf(part / r / variance, r, freedom) for r, part in found]
    return np.minimum(1.0, len(chances) * np.min(chances, axis=0)), variance**0.5


@pytest.mark.parametrize("size", [0.0, 1.0])
def test_structure_is_what_projections_of_the_readings_present_give(size):
    made = bench(1, **SHORT)
    states, present = made.rows.states, present_in(11, len(made.loads))
    whiten = Whitener(0 * sensitivity(len(present)), torch.as_tensor(made.state), ACCURACY, present=present)
    slopes = torch.stack([states.twist, states.pressure / 7e4], 1)[..., None] * present[..., None]
    shape = torch.cos(2 * states.twist) * states.pressure / 7e4
    residual = torch.as_tensor(np.random.default_rng(2).normal(size=(len(present), 2))) + size * shape[:, None]
    residual = residual.clamp(-3, 3) * present
    absorbed = slopes.flatten() / slopes.flatten().norm()
    residual = residual - (absorbed * (absorbed @ residual.flatten())).reshape(-1, 2)
    found = structure(residual, slopes, states, whiten)
    p_values, scale = by_projections(residual, slopes, states, whiten)
    assert found.scale == pytest.approx(scale, rel=1e-6)
    assert (size > 0.5) == (p_values[0] < LOOKED_AT)
    expected = p_values[1:].max() if p_values[0] < LOOKED_AT else p_values[0]
    assert found.p_value == pytest.approx(expected, rel=1e-4)


def test_levels_hold_with_four_in_ten_blank():
    """The p-value is multiplied by the number of bases, so small ones are at most as frequent as they say: a one-sided
    Kolmogorov–Smirnov test over beds without an effect; and with one, they are tiny."""
    p_values = []
    for seed in chosen(range(16), 6):
        made = bench(seed, **SHORT)
        p_values.append(first_step(question(made, present_in(seed, len(made.loads))))[1].left.p_value)
    assert stats.kstest(p_values, "uniform", alternative="greater").pvalue > 1e-3
    assert min(p_values) > ALPHA_STRUCTURE

    def bend(states, loads):
        shape = (states.twist / 2) ** 2 * states.pressure / 7e4
        return loads + 10 * NOISE * np.stack([0 * shape, shape], axis=1)

    for seed in chosen(range(3), 1):
        made = bench(seed, **SHORT, extra=bend)
        assert first_step(question(made, present_in(seed, len(made.loads))))[1].left.p_value < ALPHA_STRUCTURE
