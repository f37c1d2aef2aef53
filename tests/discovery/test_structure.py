"""Is anything systematic left? Asked of noise with heavy tails, with slips, and of one odd state."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from first_step import first_step
from linear_bed import ACCURACY, NOISE, SHORT, TRUE, bench, sensitivity, student
from nightly import chosen, usually
from scipy import stats
from scipy.linalg import sqrtm

from freelearn.data.accuracy import Accuracy
from freelearn.data.states import States
from freelearn.discovery.noise.noise import Whitener, whitened_basis
from freelearn.discovery.noise.shapes import bases, dense, place_shapes
from freelearn.discovery.noise.structure import LOOKED_AT, displaced, f_test, structure
from freelearn.discovery.thresholds import ALPHA_STRUCTURE
from freelearn.testing.reference.other_beds import nominal


def left(made):
    """What is left of a bed's first fit."""
    return first_step(made.question())[1].left


def most(chance, of):
    """The number that more of so many cases have with a chance below one in ten thousand."""
    return int(stats.binom.isf(1e-4, of, chance))


@pytest.mark.parametrize(
    ("noise", "slips"),
    [
        pytest.param({}, 0.0, id="normal", marks=pytest.mark.nightly),
        pytest.param({"noise": student(4)}, 0.0, id="heavy", marks=pytest.mark.nightly),
        pytest.param({"noise": student(4)}, 0.03, id="slips"),
    ],
)
def test_levels_hold_under_heavy_tails_and_slips(noise, slips):
    p_values = []
    for seed in chosen(range(20), 10):
        made = bench(seed, **SHORT, **noise)
        if slips:
            made, _ = made.slipped(slips, ("sign", "other_row", "decimal"), seed)
        p_values.append(left(made).p_value)
    p_values = np.array(p_values)
    for level in (0.05, ALPHA_STRUCTURE):
        assert (p_values < level).sum() <= most(level, len(p_values))


def bend(size):
    """A moment that bends with twist and pressure, of so many standard deviations of a reading."""

    def extra(s, loads):
        shape = (s.twist / 2) ** 2 * s.pressure / 7e4
        return loads + size * NOISE * np.stack([0 * shape, shape], axis=1)

    return extra


@pytest.mark.parametrize("noise", usually({"noise": student(4)}, nightly=[{}]), ids=["heavy", "normal"])
def test_a_smooth_effect_is_seen_through_heavy_tails_and_slips(noise):
    """6 σ times a shape of a mean square of 0.03, once the model's own slope is taken off: of 240 moments 240 in χ²,
    on some 60 degrees of freedom of the finest shapes."""
    for seed in chosen(range(5), 2):
        made, _ = bench(seed, **SHORT, **noise, extra=bend(6)).slipped(0.02, ("sign", "other_row"), seed)
        assert left(made).p_value < ALPHA_STRUCTURE


def test_one_odd_state_is_no_structure():
    """All rows of one state off by 20 standard deviations of a reading, a bent hose, say; of three states, it is."""
    made = bench(5, **SHORT)

    def off(states):
        rows = np.flatnonzero(np.isin(made.state, states))
        shape = np.linspace(0.5, 1.5, len(rows))
        return made.showing({(r, 1): made.loads[r, 1] + 20 * NOISE[1] * s for r, s in zip(rows, shape, strict=True)})

    assert left(off([7])).p_value > ALPHA_STRUCTURE


@pytest.fixture
def plain():
    """A prepared question whose residuals are about to be replaced by what a test makes up."""
    return first_step(bench(1, **SHORT).question())


def believed(step):
    """Its whitener, as if there were nothing of which the scatter is known."""
    return Whitener(0 * sensitivity(len(step.states)), step.whiten.state, ACCURACY)


def by_projections(residual, jacobian, states, whiten):
    """The same test by singular value decompositions, SciPy's F, and Bonferroni's factor: p-values with all residuals
    and with those of each state explaining nothing in turn, (1 + states,), and the noise's standard deviation."""
    flat, slopes = residual.reshape(-1).numpy(), jacobian.flatten(0, 1).numpy()
    absorbed = np.linalg.svd(slopes, full_matrices=False)[0]
    of_state = whiten.state.repeat_interleave(2).numpy()
    cases = np.stack([flat, *(np.where(of_state == n, 0.0, flat) for n in range(whiten.states))])
    found = []
    for basis in bases(states):
        columns = whitened_basis(dense(basis, len(states)), whiten).numpy()
        length = np.linalg.norm(columns, axis=0)
        columns = columns[:, length > 0] / length[length > 0]
        left, size, _ = np.linalg.svd(columns - absorbed @ (absorbed.T @ columns), full_matrices=False)
        explained = ((cases @ left[:, size > 1e-5]) ** 2).sum(1)
        found.append((int((size > 1e-5).sum()), explained))
    rank, explained = max(found, key=lambda f: f[0])
    freedom = len(flat) - slopes.shape[1] - rank
    variance = ((flat**2).sum() - explained[0]) / freedom
    chances = [stats.f.sf(part / rank / variance, rank, freedom) for rank, part in found]
    return np.minimum(1.0, len(chances) * np.min(chances, axis=0)), variance**0.5


@pytest.mark.parametrize("size", [0.0, 0.35, 0.7])
def test_it_is_what_projections_give(plain, size):
    _, step = plain
    whiten = believed(step)
    slopes = torch.stack([step.states.twist, step.states.pressure / 7e4], 1)[..., None]
    shape = torch.cos(2 * step.states.twist) * step.states.pressure / 7e4
    residual = torch.as_tensor(np.random.default_rng(2).normal(size=(240, 2))) + size * shape[:, None]
    # No reading is so far off as to be drawn in.
    residual = residual.clamp(-3, 3)
    absorbed = slopes.flatten() / slopes.flatten().norm()
    residual = residual - (absorbed * (absorbed @ residual.flatten())).reshape(240, 2)
    found = structure(residual, slopes, step.states, whiten)
    p_values, scale = by_projections(residual, slopes, step.states, whiten)
    assert found.scale == pytest.approx(scale, rel=1e-6)
    assert (size > 0.5) == (p_values[0] < LOOKED_AT)
    expected = p_values[1:].max() if p_values[0] < LOOKED_AT else p_values[0]
    assert found.p_value == pytest.approx(expected, rel=1e-4)


def leaning(size):
    """A carriage that stands elsewhere by so many errors of its place the more it is turned, whichever way."""

    def extra(s, loads):
        moved = size * ACCURACY.length * np.abs(s.twist.numpy() - 0.3)
        return loads + np.stack([-TRUE[0] * moved, 0 * moved], axis=1)

    return extra


def test_places_that_are_off_by_a_function_of_the_place_are_a_misfit_and_others_are_not():
    """Among 350 readings of 60 states they hardly show: each state has a place of its own to be off by."""
    made = bench(6, states=60, samples=(1,), extra=leaning(2.0))
    prepared, step = first_step(made.question())
    assert displaced(step.fit.residual, prepared.rows.states, step.whiten) < 1e-4
    assert step.left.shows
    coarse = replace(ACCURACY, length=3 * ACCURACY.length, twist=3 * ACCURACY.twist)
    prepared, step = first_step(bench(6, states=60, samples=(1,), true=coarse).question())
    assert step.whiten.scatter.position > 2
    assert displaced(step.fit.residual, prepared.rows.states, step.whiten) > 0.01
    assert not step.left.shows


def test_what_places_have_in_common_is_what_each_state_s_own_least_squares_say():
    """The place of each state by roots of whole matrices, then NumPy's least squares on shapes, SciPy's F, and each
    state left out by a fit of its own."""
    coarse = replace(ACCURACY, twist=4 * ACCURACY.twist)
    made = bench(3, states=24, samples=(1,), pressures=4, falling=1, true=coarse)
    prepared, step = first_step(made.question(accuracy=coarse))
    whiten, states = step.whiten, prepared.rows.states
    targets, designs = [], []
    firsts = [int(np.flatnonzero(whiten.state.numpy() == n)[0]) for n in range(whiten.states)]
    shapes = place_shapes(states[torch.tensor(firsts)]).numpy()
    for n in range(whiten.states):
        own = whiten.state == n
        spread = whiten.shared[own].flatten(0, 1).numpy()
        gram = spread.T @ spread
        root = np.linalg.inv(sqrtm(gram).real)
        targets.append(root @ spread.T @ step.fit.residual[own].reshape(-1).numpy())
        moved = root @ gram @ np.linalg.inv(sqrtm(np.eye(2) + gram).real)
        designs.append(np.einsum("ik,s->iks", moved, shapes[n]).reshape(2, -1))
    flat, design = np.array(targets), np.array(designs)
    assert np.abs(flat).max() < 4 * 1.4826 * np.median(np.abs(flat))

    def chance(kept):
        y, x = flat[kept].reshape(-1), design[kept].reshape(2 * len(kept), -1)
        rest = ((y - x @ np.linalg.lstsq(x, y, rcond=1e-8)[0]) ** 2).sum()
        rank = np.linalg.matrix_rank(design.reshape(-1, design.shape[-1]), tol=1e-6)
        freedom = flat.size - rank
        return stats.f.sf(((y**2).sum() - rest) / rank / (rest / freedom), rank, freedom)

    every = list(range(whiten.states))
    expected = max(chance([n for n in every if n != out]) for out in every)
    assert displaced(step.fit.residual, states, whiten) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_no_p_value_depends_on_the_unit_of_the_noise(plain, size):
    _, step = plain
    whiten = believed(step)
    residual = torch.as_tensor(np.random.default_rng(3).normal(size=(240, 2)))
    nothing = torch.zeros(240, 2, 1, dtype=torch.float64)
    one, other = (structure(factor * residual, nothing, step.states, whiten) for factor in (1.0, size))
    assert other.p_value == pytest.approx(one.p_value, rel=1e-6)
    assert other.scale == pytest.approx(size * one.scale, rel=1e-9)


def test_the_least_p_value_without_any_state_is_what_counts(plain):
    """Bend one state's residuals until the shapes see it: without that state they see nothing."""
    _, step = plain
    whiten = believed(step)
    residual = torch.as_tensor(np.random.default_rng(4).normal(size=(240, 2)))
    nothing = torch.zeros(240, 2, 1, dtype=torch.float64)
    own = whiten.state == int(whiten.state[step.states.length.argmax()])
    odd = residual + 3.9 * own[:, None]
    assert structure(odd, nothing, step.states, whiten).p_value > ALPHA_STRUCTURE
    three = torch.isin(whiten.state, whiten.state[step.states.length.argsort()[-15:]])
    assert structure(residual + 3.9 * three[:, None], nothing, step.states, whiten).p_value < ALPHA_STRUCTURE


def test_fishers_f_against_scipy():
    for ratio, of, over in ((1.0, 3, 200), (4.0, 12, 60), (30.0, 20, 400), (80.0, 2, 900)):
        assert f_test(ratio, of, over) == pytest.approx(stats.f.sf(ratio, of, over), rel=1e-9)


# A gauge of 1 % of the range, beside which a load cell hardly errs, and what the loads change by with length, twist and
# pressure, in SI.
GAUGE = Accuracy(0.0, 0.0, 700.0, 0.01, 1e-4)
SLOPES = torch.tensor([[-2000.0, 0.3, 7e-5], [0.3, -0.05, 2e-7]], dtype=torch.float64)


def regular(seed, bent=0.0):
    """Even steps of pressure at even lengths, one after another, so that the row's number and the length tell what the
    pressure was to be: whitened residuals of the true model, its states and whitener. bent: a push that grows with the
    square of the length, N."""
    places = np.stack([np.linspace(-4, 4, 5), np.zeros(5)], axis=1)
    table = nominal("kinematic", {1: (36.0, np.nan, 98.0, 4.77, 6.7)}, places, np.linspace(0, 70, 9))
    generator = np.random.default_rng(seed)
    error, cell = generator.normal(0, 0.7, len(table)), generator.normal(size=(len(table), 2)) * [0.01, 1e-4]
    states = States.from_table(table.assign(pressure_kpa=table["pressure_kpa"] + error, force_n=0.0, moment_nmm=0.0))
    raw = torch.as_tensor(np.outer(error * 1e3, SLOPES[:, 2]) - cell)
    raw[:, 0] += bent * (states.length - states.reference_length).square() / 16e-6
    by = SLOPES.expand(len(table), 2, 3).clone()
    by[:, :, :2] = 0
    whiten = Whitener(by, torch.arange(len(table)) // 9, GAUGE)
    return whiten(raw), states, whiten


def test_a_gauge_that_errs_more_than_even_steps_is_nothing_systematic():
    """Of the row's number, the length and the reading, which errs, there is a sum that is its error, as the residuals
    are: a test without regard for that gives a chance of 1e-4 to 1e-8."""
    p_values = []
    for seed in range(20):
        residual, states, whiten = regular(seed)
        slope = whiten(torch.stack([states.pressure * 1e-4, states.pressure * 3e-7], 1)[..., None])
        p_values.append(structure(residual, slope, states, whiten).p_value)
    p_values = np.array(p_values)
    for level in (0.05, ALPHA_STRUCTURE):
        assert (p_values < level).sum() <= most(level, len(p_values))


def test_a_misfit_of_even_steps_is_seen_beside_a_gauge_that_errs():
    """0.4 N at the ends against 0.05 N of the gauge: χ² of 1,500 in 45 forces."""
    for seed in range(5):
        residual, states, whiten = regular(seed, bent=0.4)
        slope = whiten(torch.stack([states.pressure * 1e-4, states.pressure * 3e-7], 1)[..., None])
        assert structure(residual, slope, states, whiten).shows
