"""The first look at every form: promises against NumPy's least squares, and what is not looked at."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch
from first_step import first_step
from hidden_beds import ALONE, BLOCK, question, table_of
from hypothesis import given, settings
from hypothesis import strategies as st
from linear_bed import ACCURACY, LinearBed, bench
from nightly import usually
from outside_tables import asked, measured

from freelearn.discovery.fits.derivatives import none_vector
from freelearn.discovery.fits.white_fit import ONE as UNIT
from freelearn.discovery.proposals.propose import guessed, shortlist
from freelearn.discovery.proposals.pushes import pushes
from freelearn.discovery.proposals.scan import Gram, Scan, Terms
from freelearn.discovery.search.search import search
from freelearn.discovery.thresholds import FITTED, ONE_PLACE
from freelearn.fitting.problem import Problem
from freelearn.physics.effects.registry import EFFECTS, lent
from freelearn.physics.written.forms import ONE, TWO, Form
from freelearn.physics.written.places import PRESSURE, TWIST
from freelearn.physics.written.source import effect_class


def looked_at(question):
    prepared, first = first_step(question)
    seen = pushes(first.fit, prepared.rows, question.build)
    scan = Scan(first.fit, prepared.rows, first.whiten, first.left.scale**2, question.build)
    return prepared, first, seen, scan.guesses(seen)


def bent(s, loads):
    return loads + np.stack([0.02 * loads[:, 0] ** 2, 0 * loads[:, 0]], axis=1)


@pytest.fixture(scope="module")
def springs():
    """A bed of springs one of whose cells bends: no mechanics, so that everything may be looked at in a second."""

    return looked_at(bench(4, extra=bent).question())


@pytest.fixture(scope="module")
def tube():
    return looked_at(asked(measured(states=12, pressures=3, samples=(3,)).table))


def lost(first, columns) -> float:
    """How much of the sum of squares columns (N, 2, k) explain beside the fit's own, by NumPy."""
    fit = first.fit
    own = fit.jacobian.reshape(-1, fit.jacobian.shape[-1]).numpy()
    more = first.whiten(columns).reshape(-1, columns.shape[-1]).numpy()
    residual = fit.residual.reshape(-1).numpy()

    def left(design):
        # Columns of one length: their units are SI's.
        design = design / np.linalg.norm(design, axis=0)
        solution = np.linalg.lstsq(design, residual, rcond=1e-13)[0]
        return float(((residual - design @ solution) ** 2).sum())

    return left(own) - left(np.concatenate([own, more], axis=1))


def columns_of(guess, seen):
    """What the guess's terms change of the readings, to first order."""
    inputs = [seen.inputs[i.name][:, 0] / s for i, s in zip(guess.inputs, guess.scales, strict=True)]
    terms = guess.form.values(inputs, guess.shapes)
    return torch.stack([seen.by[guess.place.name][:, :, 0] * term[:, None] for term in terms], dim=-1)


@pytest.mark.parametrize("terms", [1, 2])
@pytest.mark.parametrize("bed", ["springs", "tube"])
def test_a_guess_promises_what_least_squares_explain(bed, terms, request):
    _, first, seen, guesses = request.getfixturevalue(bed)
    own = [g for g in guesses if g.place.name in seen.by and len(g.form.terms) == terms]
    assert len({g.place.name for g in own}) > 8
    for guess in own[:: max(1, len(own) // 60)]:
        expected = lost(first, columns_of(guess, seen)) / first.left.scale**2
        assert guess.gain == pytest.approx(expected, rel=1e-4, abs=1e-4), (guess.key, guess.form.word)


def test_a_guesss_amounts_are_those_of_least_squares(springs):
    _, first, seen, guesses = springs
    fit = first.fit
    own = fit.jacobian.reshape(-1, fit.jacobian.shape[-1]).numpy()
    for guess in [g for g in guesses if g.place.name in seen.by][:40]:
        more = first.whiten(columns_of(guess, seen)).reshape(len(own), -1).numpy()
        design = np.concatenate([own, more], axis=1)
        size = np.linalg.norm(design, axis=0)
        solution = np.linalg.lstsq(design / size, -fit.residual.reshape(-1).numpy(), rcond=1e-13)[0] / size
        found = np.array(guess.amounts)
        scale = np.abs(solution[-len(found) :]).max()
        np.testing.assert_allclose(found, solution[-len(found) :], rtol=1e-3, atol=1e-3 * scale)
        # A fit sets out from there, in SI.
        starts = guess.written().starts
        assert [starts[c.name] for c in guess.written().constants() if c.amount] == list(guess.amounts)


def agree(prepared, first, guesses):
    """Promises are those of the derivatives of the model with the effect itself, at no amount."""
    assert guesses
    for guess in guesses:
        written = guess.written()
        kind = effect_class(written)
        with lent([kind]):
            model = prepared.question.build([kind.name])
        raw = Problem(model, prepared.rows, UNIT).jacobians(none_vector(model, first.fit)[None])[0]
        places = [
            i
            for i, label in enumerate(model.labels())
            if label.startswith((f"{kind.name}.amount", f"{kind.name}.second"))
        ]
        assert len(places) == len(guess.form.terms)
        expected = lost(first, raw.reshape(len(prepared.rows), 2, -1)[:, :, places]) / first.left.scale**2
        assert guess.gain == pytest.approx(expected, rel=1e-3, abs=1e-3), (guess.key, guess.form.word)


@pytest.mark.parametrize(
    "place", ["energy i1", "energy i4", "parallel both", "boundary length", "geometry outer_radius"]
)
def test_a_promise_is_that_of_the_models_own_derivatives(tube, place):
    prepared, first, _, guesses = tube
    own = [g for g in guesses if g.place.name == place]
    agree(prepared, first, [*own[:3], *own[-2:]])


@pytest.mark.parametrize("bed", usually("isometric", nightly=[*(bed for bed in ALONE if bed != "isometric"), BLOCK]))
@pytest.mark.parametrize("place", ["energy i1", "parallel both", "boundary pressure", "measurement force"])
def test_so_it_is_on_every_bed(bed, place):
    """Where a load hangs on it, an element beside the actuator shows in length and twist."""
    if bed == "isometric" and place == "parallel both":
        pytest.skip("a bed that does not twist tells no potential of the twist")
    prepared, first, _, guesses = on_bed(bed)
    own = [g for g in guesses if g.place.name == place]
    if place == "boundary pressure":
        own = [g for g in own if g.key[1] == ("pressure",)]
    agree(prepared, first, own[:3])


@cache
def on_bed(bed):
    return looked_at(question(table_of(bed, seed=3, coarse=2)))


def test_the_best_guess_is_the_cell_that_bends(springs):
    """Of all places the right one, or the piston that bends alike; the scan leaves nothing registered."""
    *_, guesses = springs
    assert guesses[0].gain > 100
    best = [g for g in guesses if g.worth > guesses[0].worth - 6]
    assert any(g.key == ("measurement force", ("force",)) and g.form.word == "square" for g in best)
    assert [g.worth for g in guesses] == sorted((g.worth for g in guesses), reverse=True)
    assert not [name for name in EFFECTS if "_of_" in name or "energy_" in name]


def test_what_the_fit_absorbs_promises_nothing(springs):
    """A spring in proportion to the elongation or the twist, and a piston's area, are the model's own."""
    *_, guesses = springs
    tried = {(g.place.name, tuple(i.name for i in g.inputs), g.form.word) for g in guesses}
    for place, name in (
        ("parallel axial", "elongation"),
        ("parallel torsional", "twist"),
        ("boundary length", "elongation"),
        ("boundary twist", "twist"),
        ("geometry reference_length", "elongation"),
    ):
        assert (place, (name,), "linear") not in tried
        assert (place, (name,), "cube") in tried
    # What moves no load at all.
    assert not [key for key in tried if key[0] in ("geometry fiber_angle", "geometry outer_radius")]
    assert all(math.isfinite(g.gain) for g in guesses)


def test_only_one_of_two_ports_that_show_alike_is_looked_at(springs):
    """The element beside the actuator stands for the cell that shows more in dependence of the elongation."""
    *_, guesses = springs
    keys = {g.key for g in guesses}
    assert ("parallel axial", ("elongation",)) in keys
    for other in (
        ("measurement force", ("elongation",)),
        ("measurement force", ("pressure",)),
        ("measurement moment", ("twist",)),
        ("measurement moment", ("twist", "pressure")),
        ("parallel both", ("elongation",)),
        ("parallel both", ("twist",)),
    ):
        assert other not in keys
    assert ("measurement force", ("twist",)) in keys


def test_an_input_that_does_not_vary_is_not_looked_at():
    table = measured(states=10, pressures=3, samples=(3,)).table.assign(elongation_mm=2.0)
    *_, seen, guesses = looked_at(asked(table))
    assert not seen.told(next(i for g in guesses for i in g.place.inputs if i.name == "elongation"))
    assert all("elongation" not in g.key[1] for g in guesses)


# --- levels -----------------------------------------------------------------------------------------------------------


def test_no_form_is_quicker_than_the_levels_of_its_input_tell(tube):
    """A quarter of a turn of a wave from one level to the next at most: at half a turn it may be zero at them all."""
    _, _, seen, guesses = tube
    levels = np.unique(np.round(seen.scaled(PRESSURE)[:, 0].numpy(), 1))
    quickest = math.pi / 2 / np.diff(levels).max()
    waves = [g for g in guesses if "rate" in g.shapes and g.inputs[g.form.shapes[0].place] is PRESSURE]
    assert waves
    # Noise of the levels aside.
    assert all(g.shapes["rate"] <= 1.2 * quickest for g in waves)
    assert quickest < max(s for form in ONE if form.word == "sine" for s in form.shapes[0].grid)
    for guess in waves:
        (rate,) = [c for c in guess.written().constants() if c.name == "rate"]
        assert rate.start <= rate.upper * (1 + 1e-9)
    # The twist was measured at as many places as there are states.
    finer = [s.upper for g in guesses if g.inputs == (TWIST,) for s in g.form.shapes if s.name == "rate"]
    assert max(finer) > 1.5 * quickest


@given(
    gaps=st.lists(st.floats(1e-3, 0.7), min_size=1, max_size=30),
    first=st.floats(-1, 0),
    form=st.sampled_from(ONE + TWO),
)
def test_a_form_told_by_levels_keeps_its_grid_within_its_bounds(gaps, first, form):
    levels = np.cumsum([first, *gaps]).clip(-1, 1).tolist()
    levels = sorted(set(levels))
    told = form.told_by([levels, levels])
    assert told.terms == form.terms
    if not told.has_room:
        # Only a bend can be left without any: there are no two levels on either side of a place that it may be at.
        (knee,) = {(s.lower, s.upper) for s in form.shapes if s.name == "knee"}
        assert max(knee[0], levels[1]) >= min(knee[1], levels[-2])
        return
    for shape, before in zip(told.shapes, form.shapes, strict=True):
        assert shape.grid
        assert before.lower <= shape.lower < shape.upper <= before.upper
        assert all(shape.lower <= value <= shape.upper for value in shape.grid)
        if shape.name == "knee" and len(levels) >= 4:
            # Two levels on either side.
            assert all(sum(x <= value for x in levels) >= 2 for value in shape.grid)
            assert all(sum(x >= value for x in levels) >= 2 for value in shape.grid)
    # What lies everywhere limits nothing but a bend at the very ends.
    fine = np.linspace(-1, 1, 2001).tolist()
    same = form.told_by([fine, fine])
    assert [s.grid for s in same.shapes] == [s.grid for s in form.shapes]


# --- terms ------------------------------------------------------------------------------------------------------------


def gram_of(columns: torch.Tensor, residual: torch.Tensor) -> Gram:
    square = columns.square().sum(0).numpy()
    return Gram(columns, square, (columns.T @ residual).numpy(), square > 0)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_gains_of_random_columns_are_those_of_least_squares(seed):
    generator = torch.Generator().manual_seed(seed)
    one = Form("one", "one", ("{x}",), "{a} {x}")
    two = Form("two", "two", ("{x}", "{y}"), "{a} {x} + {b} {y}")
    rows = 20
    parts = iter(torch.randn(3, rows, dtype=torch.float64, generator=generator))
    terms = Terms.of_forms([one, two], True, lambda form, shapes: [next(parts) for _ in form.terms])
    residual = torch.randn(rows, dtype=torch.float64, generator=generator)
    gains, amounts = terms.gains(gram_of(terms.values, residual))
    whole = float(residual.square().sum())
    for gain, found, places in zip(gains, amounts, ([0], [1, 2]), strict=True):
        design = terms.values[:, places].numpy()
        solution, *_ = np.linalg.lstsq(design, -residual.numpy(), rcond=None)
        left = float(((residual.numpy() + design @ solution) ** 2).sum())
        assert gain == pytest.approx(whole - left, rel=1e-9, abs=1e-12)
        np.testing.assert_allclose(found[: len(places)], solution, rtol=1e-8, atol=1e-12)


def test_terms_that_are_one_and_columns_that_are_nothing_promise_nothing():
    twice = Form("twice", "twice", ("{x}", "{x}"), "{a} {x} + {b} {x}")
    none = Form("none", "none", ("0 * {x}",), "{a} 0")
    column = torch.linspace(-1, 1, 9, dtype=torch.float64)
    values = iter([column, 2 * column, 0 * column])
    terms = Terms.of_forms([twice, none], True, lambda form, shapes: [next(values) for _ in form.terms])
    gains, _ = terms.gains(gram_of(terms.values, column))
    assert (gains == -np.inf).all()
    assert list(terms.best(gains)) == []


def test_forms_of_both_signs_are_tried_where_there_are_both_and_the_best_shape_of_each_is_kept():
    x = torch.linspace(0.05, 1, 30, dtype=torch.float64)

    def evaluate(form, shapes):
        return form.values([x], shapes)

    some = Terms.of_forms(ONE, False, evaluate)
    every = Terms.of_forms(ONE, True, evaluate)
    assert {f.word for f in every.forms} == {f.word for f in ONE}
    assert {f.word for f in ONE} - {f.word for f in some.forms} == {f.word for f in ONE if f.signed}
    assert len(some.of) == sum(len(list(f.grid())) for f in some.forms)
    # A hinge at a knee of the grid finds that.
    knee = next(f for f in ONE if f.word == "hinge").shapes[0].grid[5]
    gains, _ = some.gains(gram_of(some.values, torch.relu(x - knee)))
    best = {form.word: trial for form, trial in some.best(gains)}
    assert len(best) == len(some.forms)
    assert some.shapes[best["hinge"]] == {"knee": knee}


@pytest.mark.slow
@pytest.mark.nightly
def test_noise_alone_promises_nothing():
    """A bound over thousands of forms (Bonferroni): of 12 beds with nothing hidden, three below 0.05 happen once in
    fifty tries at most; of 6, two once in thirty."""
    least = [looked_at(bench(seed).question())[3][0].p_value for seed in range(100, 112)]
    assert sum(p <= 0.05 for p in least) < 3


def test_what_is_there_promises_more_than_any_noise(springs):
    *_, guesses = springs
    assert guesses[0].p_value < 1e-12
    assert all(0 <= g.p_value <= 1 for g in guesses)


def test_the_shortlist_has_the_most_worthy_of_several_places(springs):
    *_, guesses = springs
    taken = shortlist(guesses)
    assert 0 < len(taken) <= FITTED
    assert all(g.worth > 0 for g in taken)
    keys = [g.key for g in taken]
    assert max(keys.count(key) for key in keys) <= ONE_PLACE
    assert taken[0] is guesses[0]
    # Nothing that is worth more was left out for another place's sake but of a place that is full.
    worst = min(g.worth for g in taken)
    for guess in guesses:
        if guess.worth > worst and guess not in taken:
            assert keys.count(guess.key) == ONE_PLACE
    assert shortlist([replace(g, worth=-1.0) for g in guesses]) == []


# --- one written effect -----------------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_of_springs_whose_cell_bends_the_bend_is_written():
    """Its amount is the one that was hidden, 0.02/N, within five of its standard errors and the noise of its input."""
    before = set(EFFECTS)
    found = search(bench(4, extra=bent).question())
    assert found.claimed == "proposed"
    (proposal,) = found.proposals
    written = proposal.written
    assert (written.place.name, [i.name for i in written.inputs], written.form.word) == (
        "measurement force",
        ["force"],
        "square",
    )
    (amount,) = [c.start for c in written.constants()]
    assert amount / written.scales[0] ** 2 == pytest.approx(0.02, rel=0.1)
    assert found.final.E_heldout < 0.6 * found.steps[0].E_heldout
    assert set(EFFECTS) == before


@pytest.mark.nightly
def test_where_springs_lack_nothing_nothing_is_written():
    for seed in range(2):
        found = search(bench(20 + seed).question(accuracy=ACCURACY))
        assert isinstance(found.final.fit.model, LinearBed)
        assert found.proposals == []
        assert found.effects == []


def test_guesses_of_a_fit_are_those_of_its_scan(springs):
    prepared, first, _, guesses = springs
    again = guessed(prepared, first.fit, first.whiten)
    assert [(g.key, g.form.word, g.gain) for g in again] == [(g.key, g.form.word, g.gain) for g in guesses]
