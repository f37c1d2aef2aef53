"""How a bed scattered, of one that is known: sizes, tails, slips, and what is none of them."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch
from linear_bed import ACCURACY, NOISE, SHORT, TRUE, bench, jacobian, predicted, sensitivity, student

from freelearn.data.accuracy import Accuracy
from freelearn.data.columns import with_members
from freelearn.data.states import States
from freelearn.discovery.noise.scatter import scatter
from freelearn.discovery.noise.shapes import generic
from freelearn.discovery.noise.tails import LOAD, PRESSURE
from freelearn.testing.reference.laboratory import KINDS


def seen(made, like=ACCURACY, before=None):
    """The scatter about the true numbers, which the Jacobian may move."""
    rows = made.rows
    loads, state = predicted(rows.states), torch.as_tensor(rows.state)
    slopes, sensitive = jacobian(rows.states), sensitivity(len(rows))
    return scatter(loads - rows.loads, slopes, loads, sensitive, rows.states, state, like, before)


def pointed_out(found):
    return set(map(tuple, torch.nonzero(found.slipped).tolist()))


def tolerance(count, freedom=np.inf):
    """Four standard errors of a scale from `count` readings of which the smooth shapes take a third."""
    share = 1.0 if np.isinf(freedom) else freedom / (freedom + 3)
    return 4 / np.sqrt(2 * count * share * 2 / 3)


# Position errors share their states with bins of states: what both can explain is split. They are told to a third.
PLACED = 1 / 3


@pytest.mark.parametrize("size", [(1, 1, 1), (3, 2, 0.5), (0.5, 0.5, 3), (3, 3, 3), (1 / 3, 1 / 3, 1 / 3)])
def test_sizes_are_recovered_whatever_is_stated(size):
    """The bed's position, force and moment errors are these many times the stated ones; its pressure's none."""
    stated = Accuracy(3e-5, 5e-3, 0.0, 0.03, 6e-4)
    place, force, moment = size
    true = Accuracy(3e-5 * place, 5e-3 * place, 0.0, 0.03 * force, 6e-4 * moment)
    made = bench(11, true=true)
    found = seen(made, stated)
    np.testing.assert_allclose(found.deviations, [force, moment], rtol=tolerance(len(made.loads)))
    assert found.position * found.tails.deviation == pytest.approx(place, rel=PLACED)
    assert np.isinf(found.tails.freedom)
    assert found.growth.amount == 0
    assert not found.slipped.any()


@pytest.mark.nightly
def test_over_many_beds_sizes_are_right_on_average():
    found = [seen(bench(seed)) for seed in range(20)]
    deviations = np.array([f.deviations.tolist() for f in found])
    # The mean of 20, and what rounds of an estimate leave: 2 %.
    np.testing.assert_allclose(deviations.mean(0), 1, atol=tolerance(420) / np.sqrt(20) + 0.02)
    # The states' own scatter is not more than the errors of 420 readings make it.
    assert (deviations.std(0) < tolerance(420) / 2).all()
    assert np.mean([f.position for f in found]) == pytest.approx(1, abs=PLACED / 2)


def test_a_parameter_twice_is_the_model_once():
    """Two effects that move the loads alike, to rounding and of another size, and one that moves none."""
    made = bench(3)
    rows, slopes = made.rows, jacobian(made.rows.states)
    loads, state = predicted(rows.states), torch.as_tensor(rows.state)
    twice = torch.cat([slopes, 1e6 * slopes * (1 + 1e-15), torch.zeros_like(slopes[..., :1])], dim=2)
    one, two = (
        scatter(loads - rows.loads, j, loads, sensitivity(len(rows)), rows.states, state, ACCURACY)
        for j in (slopes, twice)
    )
    torch.testing.assert_close(two.deviations, one.deviations, rtol=1e-6, atol=0)
    torch.testing.assert_close(two.smooth, one.smooth, rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("freedom", [4.0, np.inf])
def test_tails_are_told_apart(freedom):
    noise = {} if np.isinf(freedom) else {"noise": student(freedom)}
    found = [seen(bench(seed, **noise)) for seed in range(8)]
    told = np.array([f.tails.freedom for f in found])
    deviations = np.array([f.deviations.tolist() for f in found])
    if np.isinf(freedom):
        assert np.isinf(told).sum() >= 7
    else:
        # 1/ν = 0.25 ± 0.045 of 840 errors, of which shapes and positions mix a third: sums are more nearly normal.
        assert ((told >= 3) & (told <= 10)).all()
    # A t's standard deviation is told by its tails: less surely than its scale.
    np.testing.assert_allclose(deviations.mean(0), 1, atol=0.1)


@pytest.mark.parametrize("kind", [LOAD, PRESSURE])
def test_noise_that_grows_is_seen_as_that(kind):
    made = bench(2, states=60)
    loads, pressure = predicted(made.rows.states).abs().numpy(), made.rows.states.pressure.numpy()[:, None]
    share = (loads if kind == LOAD else pressure * np.ones(2)) / (loads.max(0) if kind == LOAD else pressure.max())
    found = seen(made.showing({p: made.loads[p] + 2 * share[p] * made.error[p] for p in np.ndindex(made.loads.shape)}))
    assert found.growth.kind == kind
    assert found.growth.amount in (1.0, 2.0, 4.0)
    # At the middle of the way twice the noise.
    np.testing.assert_allclose(found.deviations * (1 + found.growth.amount / 2), 2, rtol=0.2)


@pytest.mark.parametrize("noise", ["normal", "heavy"])
@pytest.mark.parametrize("share", [0.01, 0.05])
def test_slips_are_found_and_leave_the_sizes_alone(share, noise):
    heavy = {"noise": student(5)} if noise == "heavy" else {}
    right = bench(6, **heavy)
    made, truth = right.slipped(share, tuple(KINDS), 6)
    found = seen(made)
    # Beyond what may be pointed out, by three standard deviations: the reading's own error and that of what is
    # expected stand between.
    limit = (found.tails.limit + 3) * found.scale.numpy()[truth["column"]]
    large = truth[(truth["sensor_sigmas"] > limit).to_numpy()]
    assert len(large) > 0.7 * len(truth)
    flagged, true = pointed_out(found), set(zip(truth["row"], truth["column"], strict=True))
    assert set(zip(large["row"], large["column"], strict=True)) <= flagged
    # Of 840 good readings one in 2,500 is pointed out: more than three with a chance of less than one in a thousand.
    assert len(flagged - true) <= 3
    # None pulls a fit by a tenth of what a good reading of one standard deviation does.
    place = large["row"].to_numpy(), large["column"].to_numpy()
    assert (found.reading.numpy()[place] * np.abs(found.z.numpy()[place]) < 0.1).all()
    np.testing.assert_allclose(found.deviations, seen(right).deviations, rtol=0.05)
    # The share is of all readings, two in a row; a few more or less than there were.
    assert found.tails.slipped == pytest.approx(len(large) / made.loads.size, abs=3 / made.loads.size)


def wave(size):
    """Smooth in every input, of so many standard deviations of either load."""

    def extra(s, loads):
        x, y, p = (s.length - s.reference_length) / s.reference_length / 0.05, s.twist / 2, s.pressure / 7e4
        force, moment = y**2 * p + x * y / 2, torch.sin(2 * y + x)
        return loads + size * np.array([0.03, 6e-4]) * torch.stack([force, moment], -1).numpy()

    return extra


@pytest.mark.parametrize("size", [5, 30, 100])
def test_a_smooth_effect_that_is_missing_is_neither_slip_nor_noise(size):
    found, without = seen(bench(3, extra=wave(size))), seen(bench(3))
    assert not found.slipped.any()
    # The shapes follow it to half a percent.
    np.testing.assert_allclose(found.deviations, without.deviations, rtol=0.05 + 0.005 * size)
    # What is smooth is what is missing: all but the errors of the shapes' coefficients.
    made = bench(3, extra=wave(size))
    missing = -wave(size)(made.rows.states, 0.0)
    rest = found.smooth.numpy() - missing
    rest = rest - project(rest, made.rows.states)
    assert (np.abs(rest / NOISE).std(0) < 2).all()


def project(loads, states):
    """The part of loads (N, 2) that the model's own four numbers can absorb."""
    slopes = jacobian(states).flatten(0, 1).numpy()
    scaled = slopes / np.linalg.norm(slopes, axis=0)
    weight = np.tile(1 / NOISE, len(loads))
    best = np.linalg.lstsq(scaled * weight[:, None], loads.reshape(-1) * weight, rcond=None)[0]
    return (scaled @ best).reshape(loads.shape)


def stop(size, share=0.1):
    """Something is touched at the largest lengths, in a share of the rows, and pushes back in proportion."""

    def extra(s, loads):
        x = s.length - s.reference_length
        over = (x - x.quantile(1 - share)).clamp_min(0)
        return loads + size * 0.03 * torch.stack([over / over.max(), 0 * over], -1).numpy()

    return extra


@pytest.mark.parametrize("states", [24, 60])
@pytest.mark.parametrize("size", [10, 30, 100])
def test_a_stop_that_is_touched_in_some_rows_is_not_called_slipped(size, states):
    found = seen(bench(3, states=states, extra=stop(size)))
    assert not found.slipped.any()
    assert (found.deviations < 1.25).all()


@pytest.mark.parametrize("noise", ["normal", "heavy"])
def test_going_on_from_an_earlier_estimate_gives_the_same(noise):
    heavy = {"noise": student(4)} if noise == "heavy" else {}
    made, _ = bench(8, **heavy).slipped(0.02, ("sign", "other_row"), 8)
    first = seen(made)
    again = seen(made, before=first)
    np.testing.assert_allclose(again.deviations, first.deviations, rtol=0.01)
    assert again.position == pytest.approx(first.position, rel=0.03)
    assert (again.growth, pointed_out(again)) == (first.growth, pointed_out(first))
    assert again.tails.slipped == pytest.approx(first.tails.slipped, rel=0.01)
    # Precisions are what fits are weighted with.
    np.testing.assert_allclose(again.reading, first.reading, rtol=0.05, atol=0.02 * float(first.reading.max()))


def test_rows_that_share_a_position_error_do_not_slip_one_by_one():
    """A state that was mounted ten position errors off: its five rows are off by twenty row noises, together."""
    made = bench(4, **SHORT)
    own = made.state == 7
    off = -TRUE[0] * 10 * ACCURACY.length
    assert abs(off) > 15 * NOISE[0]
    found = seen(made.showing({(row, 0): made.loads[row, 0] + off for row in np.flatnonzero(own)}))
    assert not found.slipped.any()
    np.testing.assert_allclose(found.deviations, seen(made).deviations, rtol=0.1)


@pytest.mark.parametrize(("times", "least", "most"), [(1.0, 0.85, 1.2), (3.0, 1.5, 2.0), (1 / 3, 0.5, 0.7)])
def test_of_few_states_places_are_thought_misstated_as_readings_are_by_less(times, least, most):
    """Readings scatter by so many times what is stated, the places by none of it: five states do not tell."""
    true = replace(ACCURACY, force=times * ACCURACY.force, moment=times * ACCURACY.moment, pressure=0.0)
    found = seen(bench(9, states=5, samples=(1,), true=true), replace(ACCURACY, pressure=0.0))
    assert found.assumed
    np.testing.assert_allclose(found.deviations, times, rtol=0.5)
    assert least < found.position < most
    assert not seen(bench(9)).assumed


@pytest.mark.parametrize(("rows", "power", "follows"), [(34, 2, True), (34, 3, False), (60, 3, True), (20, 2, False)])
def test_of_several_pressures_powers_of_each_are_smooth_before_all_products_are(rows, power, follows):
    """A block of four actuators in two places: polynomials in all six quantities would need 112 rows."""
    generator = np.random.default_rng(1)
    columns = {"sample": 1, "step": np.arange(rows) % (rows // 2), "buckled": 0, "force_n": 1.0, "moment_nmm": 1.0}
    place = np.repeat([-2.0, 3.0], rows // 2)
    made = pd.DataFrame({**columns, "elongation_mm": place, "twist_deg": 10 * place, "time_s": np.arange(rows)})
    for n in range(1, 5):
        made[f"pressure_{n}_kpa"] = generator.uniform(0, 60, rows)
    design = {
        "gamma_deg": 40.0,
        "gamma2_deg": np.nan,
        "length_mm": 100.0,
        "inner_radius_mm": 5.0,
        "outer_radius_mm": 6.5,
    }
    states = States.from_table(with_members(made, pd.DataFrame([{"member": n, **design} for n in range(1, 5)])))
    shapes, kind = generic(states, 2)
    smooth = shapes[:, kind == 0].numpy()
    wanted = (made["pressure_2_kpa"].to_numpy() / 60) ** power
    left = wanted - smooth @ np.linalg.lstsq(smooth, wanted, rcond=None)[0]
    assert (np.abs(left).max() < 1e-10) == follows
    assert smooth.shape[1] <= rows / 3 + 1
