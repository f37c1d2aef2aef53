"""The discovery's statistics against dense linear algebra, refits and planted answers."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch
from first_step import first_step
from hidden_tables import table
from linear_bed import NOISE, SHORT, bench, jacobian
from nightly import usually

from freelearn.data.accuracy import PAPER, Accuracy
from freelearn.data.rows import Rows
from freelearn.discovery.fits.left_out import HeldOut, folds_of, held_out, left_out, paired, unseen
from freelearn.discovery.fits.prepare import Question, prepare
from freelearn.discovery.fits.white_fit import evaluated, white_fit
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.discovery.noise.structure import structure
from freelearn.discovery.residuals.failures import failures, inputs_of, split_errors
from freelearn.discovery.residuals.hysteresis import rising_falling
from freelearn.discovery.residuals.reciprocity import reciprocity
from freelearn.discovery.residuals.residual_summary import summarize_residuals
from freelearn.physics.chain import chain
from freelearn.physics.models.build import build_model


@pytest.mark.parametrize("name", ["continuum", "linear"])
def test_sensitivities_are_finite_differences(name, random_states):
    model = build_model(name, {"C1": 1e6, "C2": 2e7} if name == "continuum" else {})
    states = random_states(20)
    found = sensitivities(model, states)
    for k, (field, step) in enumerate((("length", 1e-8), ("twist", 1e-6), ("pressure", 1.0))):
        up = model(states.replace(**{field: getattr(states, field) + step})).loads
        down = model(states.replace(**{field: getattr(states, field) - step})).loads
        expected = ((up - down) / (2 * step)).detach()
        torch.testing.assert_close(found[:, :, k], expected, rtol=1e-4, atol=1e-6 * float(expected.abs().max()))


def question_of(effects, extra=None) -> Question:
    data = table(effects, extra=extra)
    rows = Rows.from_table(data)
    rows = rows[torch.as_tensor(np.flatnonzero(data["buckled"] == 0))]
    return Question(lambda names: build_model("continuum", {}, names, [3, 6]), [], rows, PAPER, 0)


def test_held_out_residuals_are_those_of_refits_without_the_fold():
    """A model that is linear in its numbers, by NumPy's least squares."""
    made = bench(3, **SHORT)
    prepared, step = first_step(made.question())
    rows, whiten = prepared.rows, step.whiten
    fold = folds_of(rows.state, seed=3)
    assert all(len(np.unique(fold[rows.state == g])) == 1 for g in np.unique(rows.state))
    fit = replace(step.fit, prior=None)
    found = held_out(fit, rows, whiten, fold, rows.state)
    slopes = jacobian(rows.states)
    design, target = whiten(slopes), whiten(rows.loads)
    size = design.flatten(0, 1).norm(dim=0)
    for f in np.unique(fold):
        out = torch.as_tensor(fold == f)
        white = (design[~out] / size).flatten(0, 1), target[~out].reshape(-1)
        best = np.linalg.lstsq(white[0].numpy(), white[1].numpy(), rcond=None)[0] / size.numpy()
        left = (slopes[out] @ torch.as_tensor(best) - rows.loads[out]).numpy()
        np.testing.assert_allclose(found.raw[out], left, atol=1e-4 * NOISE.min())
    np.testing.assert_allclose(found.loss.sum(), float(whiten(found.raw).square().sum()))
    assert len(found.loss) == len(np.unique(rows.state))


@pytest.mark.parametrize("block", usually(100, nightly=[chain.BLOCK]))
def test_every_part_left_out_is_a_fit_of_its_own(block, monkeypatch):
    """Of the continuum, whose loads bend with its parameters, beside a fit to the rows that stay; of more rows than are
    evaluated at once too."""
    monkeypatch.setattr(chain, "BLOCK", block)
    prepared, fit, noise = prepare(question_of({}))
    rows, whiten = prepared.rows, noise.whitener()
    parts = [rows.state % 4 == number for number in range(4)]
    found = left_out(fit, rows, whiten, parts)
    raw = unseen(fit, rows, whiten, rows.state % 4)
    for part, vector, chi2 in zip(parts, found.vectors, found.chi2, strict=True):
        with torch.no_grad():
            here = fit.model(rows.states, fit.model.physical(vector)).loads - rows.loads
        np.testing.assert_allclose(raw[part], here[part], rtol=1e-9, atol=1e-12)
        assert float(chi2) == pytest.approx(float(whiten(here)[~part].square().sum()), rel=1e-9)
        stays = torch.as_tensor(np.flatnonzero(~part))
        alone = white_fit(fit.model, rows[stays], noise.whitener(None, stays), fit.vector, fit.prior)
        error = torch.linalg.inv(alone.jacobian.flatten(0, 1).T @ alone.jacobian.flatten(0, 1)).diagonal().sqrt()
        assert float(((vector - alone.vector) / error).abs().max()) < 0.1


def test_a_part_that_moves_the_model_far_is_fitted_to_its_minimum():
    """From a fit that is no minimum of what stays: fifty standard errors off in every parameter."""
    prepared, fit, noise = prepare(question_of({}))
    rows, whiten = prepared.rows, noise.whitener()
    error = torch.linalg.inv(fit.jacobian.flatten(0, 1).T @ fit.jacobian.flatten(0, 1)).diagonal().sqrt()
    off = evaluated(fit.model, rows, fit.vector + 50 * error)
    off = replace(off, prior=fit.prior)
    part = rows.state % 4 == 0
    stays = torch.as_tensor(np.flatnonzero(~part))
    alone = white_fit(fit.model, rows[stays], noise.whitener(None, stays), fit.vector, fit.prior)
    vector = left_out(off, rows, whiten, [part]).vectors[0]
    assert float(((vector - alone.vector) / error).abs().max()) < 0.1


def test_few_states_are_each_left_out_alone_and_one_is_cut_into_runs():
    assert folds_of(np.repeat([4, 2, 9], 5), 0).tolist().count(0) == 5
    assert len(np.unique(folds_of(np.repeat(np.arange(12), 3), 1))) == 12
    assert len(np.unique(folds_of(np.repeat(np.arange(13), 3), 1))) == 5
    runs = folds_of(np.zeros(12, dtype=int), 0)
    assert len(np.unique(runs)) == 5
    assert (np.diff(runs) >= 0).all()


def test_paired_difference_by_hand():
    generator = np.random.default_rng(1)
    losses = generator.chisquare(8, size=(2, 10))
    one, other = (HeldOut(None, None, loss, None) for loss in losses)
    mean, error = paired(one, other)
    assert mean == pytest.approx((losses[1] - losses[0]).mean())
    assert error == pytest.approx(np.std(losses[1] - losses[0], ddof=1) / np.sqrt(10))


@pytest.fixture
def bed(random_states):
    """200 kinematic states of one sample with ten pressures each, unit noise, and a whitener that leaves it alone."""
    generator = np.random.default_rng(4)
    states = random_states(1)[torch.zeros(2000, dtype=torch.int64)]
    place = generator.uniform(-1, 1, size=(200, 2)).repeat(10, axis=0)
    pressure = np.tile(np.r_[np.linspace(0, 7e4, 8), 3.5e4, 0.0], 200)
    direction = np.tile(np.r_[0, np.ones(7), -1, -1], 200).astype(float)
    states = states.replace(
        length=states.reference_length * (1 + 0.05 * torch.as_tensor(place[:, 0])),
        twist=2 * torch.as_tensor(place[:, 1]),
        pressure=torch.as_tensor(pressure),
        direction=torch.as_tensor(direction),
    )
    plain = Accuracy(0.0, 0.0, 0.0, 1.0, 1.0)
    state = np.repeat(np.arange(200), 10)
    whiten = Whitener(torch.zeros(2000, 2, 3, dtype=torch.float64), torch.as_tensor(state), plain)
    noise = torch.as_tensor(generator.normal(size=(2000, 2)))
    return states, state, whiten, noise


NOTHING_FITTED = torch.zeros(2000, 2, 1, dtype=torch.float64)


def test_structure_is_found_when_planted_and_only_then(bed):
    states, _, whiten, noise = bed
    silent = structure(noise, NOTHING_FITTED, states, whiten)
    assert silent.p_value > 0.01
    assert silent.scale == pytest.approx(1.0, abs=0.05)
    wave = torch.stack([0.3 * states.twist**2 * states.pressure / 7e4, torch.zeros(2000, dtype=torch.float64)], 1)
    assert structure(noise + wave, NOTHING_FITTED, states, whiten).p_value < 1e-6
    # What the fit's own parameters can absorb is not structure.
    assert structure(noise + wave, wave[..., None], states, whiten).p_value > 0.01


@pytest.mark.nightly
def test_structure_p_values_of_noise_are_not_too_small(bed):
    states, _, whiten, _ = bed
    generator = np.random.default_rng(9)
    draws = [torch.as_tensor(generator.normal(size=(2000, 2))) for _ in range(60)]
    p_values = np.array([structure(draw, NOTHING_FITTED, states, whiten).p_value for draw in draws])
    # Bonferroni: at most 5 % below 0.05; of 60 draws, 8 or more have a chance below 1 %.
    assert (p_values < 0.05).sum() < 8


def test_rising_and_falling_pressure_are_told_apart_only_by_history(bed):
    states, state, whiten, noise = bed
    assert rising_falling(noise, states, state, whiten).p_value > 0.01
    # A function of state and pressure, however large, is no history.
    smooth = torch.stack([20 * states.twist * states.pressure / 7e4, 5 * states.twist], dim=1)
    assert rising_falling(noise + smooth, states, state, whiten).p_value > 0.01
    friction = states.direction[:, None] * torch.tensor([0.4, 0.0], dtype=torch.float64)
    screen = rising_falling(noise + friction, states, state, whiten)
    assert screen.p_value < 1e-3
    assert "friction_hysteresis" in screen.says


def test_blank_readings_are_no_zeros_to_the_hysteresis_screen(bed):
    states, state, whiten, noise = bed
    friction = states.direction[:, None] * torch.tensor([0.4, 0.0], dtype=torch.float64)
    present = torch.ones(2000, 2, dtype=torch.bool)
    # Two visits in three measured no force: nothing is left of it there.
    present[:, 0] = torch.as_tensor(state % 3 == 0)
    some = Whitener(
        torch.zeros(2000, 2, 3, dtype=torch.float64), torch.as_tensor(state), Accuracy(0, 0, 0, 1, 1), present=present
    )
    shown = rising_falling(torch.where(present, noise + friction, 0.0), states, state, some)
    whole = rising_falling(noise + friction, states, state, whiten)
    assert shown.shows is whole.shows is True
    (amount,) = re.findall(r"by ([+−-][\d.]+) N", shown.says)
    assert abs(float(amount)) == pytest.approx(0.8, abs=0.35)
    # A force that nobody measured is in no statement.
    present[:, 0] = False
    none = rising_falling(torch.where(present, noise + friction, 0.0), states, state, Whitener(
        torch.zeros(2000, 2, 3, dtype=torch.float64), torch.as_tensor(state), Accuracy(0, 0, 0, 1, 1), present=present
    ))  # fmt: skip
    assert none.shows is False
    assert " N and" not in none.says


def test_what_the_hysteresis_screen_leaves_possible_is_told_and_true(bed):
    states, state, whiten, _ = bed
    missed = 0
    for seed in range(40):
        noise = torch.as_tensor(np.random.default_rng(seed).normal(size=(2000, 2)))
        friction = -states.direction[:, None] * torch.tensor([0.03, 0.0], dtype=torch.float64)
        screen = rising_falling(noise + friction, states, state, whiten)
        assert screen.shows is not None
        # Twice the friction lies between rising and falling.
        missed += not screen.shows and screen.at_most[0] < 2 * 0.03
    assert missed <= 2


def test_a_bend_over_the_pressure_is_no_hysteresis(bed):
    states, state, whiten, noise = bed
    bend = torch.stack([30 * (states.pressure / 7e4) ** 2, torch.zeros(2000, dtype=torch.float64)], dim=1)
    assert not rising_falling(noise + bend, states, state, whiten).shows


def test_reciprocity_is_broken_by_what_has_no_potential(bed):
    states, _, whiten, noise = bed
    x, y = (states.length / states.reference_length - 1) / 0.05, states.twist / 2
    # Noise alone: there is nothing to keep or break the law.
    assert "cannot tell" in reciprocity(noise, NOTHING_FITTED, states, whiten).says
    # U = x²y + x y³, in lengths and angles: F = ∂U/∂l, M = ∂U/∂φ.
    per_l, per_phi = 1 / (0.05 * states.reference_length), 0.5
    conservative = torch.stack([(2 * x * y + y**3) * per_l, (x**2 + 3 * x * y**2) * per_phi], dim=1)
    size = conservative.abs().amax(0)
    conservative = conservative / size.max() * 50
    kept = reciprocity(noise + conservative, NOTHING_FITTED, states, whiten)
    assert kept.p_value > 0.01
    assert "keep" in kept.says
    lopsided = torch.stack([torch.zeros_like(x), 2 * x], dim=1)
    assert "break" in reciprocity(noise + lopsided, NOTHING_FITTED, states, whiten).says


@pytest.mark.parametrize("size", usually(3.0, nightly=[1.0, 10.0]))
def test_a_moment_that_twist_alone_decides_keeps_reciprocity(size):
    # A motor's cogging: its potential is the integral of the moment over the twist. Polynomials cannot follow it.
    asked = question_of(
        {}, lambda s, loads: loads + size * 2e-3 * np.stack([0 * s["twist"], np.sin(8 * s["twist"])], 1)
    )
    prepared, base = first_step(asked)
    screen = reciprocity(base.fit.residual, base.fit.jacobian, prepared.rows.states, base.whiten)
    assert "break" not in screen.says


def test_the_systematic_share_does_not_depend_on_the_unit_of_the_noise(bed):
    states, _, whiten, noise = bed
    wave = torch.stack([0.1 * states.twist**2 * states.pressure / 7e4, torch.zeros(2000, dtype=torch.float64)], 1)
    one = summarize_residuals(noise + wave, NOTHING_FITTED, states, whiten, scale=1.0)
    three = summarize_residuals(3 * (noise + wave), NOTHING_FITTED, states, whiten, scale=3.0)
    assert three.share == pytest.approx(one.share)
    assert three.inputs == pytest.approx(one.inputs)
    # Noise three times as large as stated is not systematic for that.
    assert summarize_residuals(3 * noise, NOTHING_FITTED, states, whiten, scale=3.0).share < 0.01


def table_of(states, state) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "sample": 3,
            "elongation_mm": 1e3 * (states.length - states.reference_length).numpy(),
            "twist_deg": np.rad2deg(states.twist.numpy()),
            "pressure_kpa": states.pressure.numpy() / 1e3,
            "step": np.tile(np.arange(10), 200),
        }
    )


def test_the_region_of_failure_is_found_and_put_in_words(bed):
    states, state, _, noise = bed
    table = table_of(states, state)
    inside = (table["twist_deg"] < -40) & (table["pressure_kpa"] > 45)
    residual = noise.numpy() * [0.1, 1e-4]
    residual[inside, 0] += 1.2
    found = failures(inputs_of(table), residual, np.array([10.0, 1.0]), np.tile([0.15, 1e-4], (2000, 1)))
    worst = found[0]
    assert worst.rows == inside.sum()
    assert worst.mean[0] == pytest.approx(1.2, abs=0.05)
    assert worst.sigma[0] == pytest.approx(8, abs=0.4)
    sentence = worst.sentence()
    assert re.search(r"predicted force is 1\.[12]\d? N too high", sentence)
    assert "pressure > 45" in sentence
    assert "twist ≤ −39." in sentence
    assert worst.share_of_squared_error > 0.9
    assert sum(f.share_of_squared_error for f in found) <= 1 + 1e-9


def test_errors_by_group_add_up_to_the_whole(bed):
    states, state, _, noise = bed
    residual, scale = noise.numpy(), np.array([5.0, 2.0])
    splits = split_errors(inputs_of(table_of(states, state)), residual, scale)
    whole = ((residual / scale) ** 2).sum()
    for _, part in splits.groupby("by"):
        assert part["rows"].sum() == 2000
        assert (part["E"] ** 2 * part["rows"]).sum() == pytest.approx(whole)
