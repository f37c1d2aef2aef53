"""What a search says about the noise: nothing where it is as stated, else what is wrong, and by how much."""

from copy import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from first_step import first_step
from linear_bed import bench, student
from scipy import stats

from freelearn.data.accuracy import PAPER, Accuracy
from freelearn.discovery.referee.black_box import MATTERS, SUSPECT_MATTERS, black_box
from freelearn.discovery.referee.case import CANNOT, FAIL, PASS, Case
from freelearn.discovery.referee.levels import Expected, LeftOut, _check, levels_left_out
from freelearn.discovery.referee.referee import Referee
from freelearn.discovery.referee.residual_patterns import stated
from freelearn.records.discovery import rise_notes
from freelearn.records.verdict_words import noise_notes


def said(made, **more):
    return noise_notes(first_step(made.question())[1], **more)


def test_noise_as_stated_is_not_worth_a_word():
    assert said(bench(1)) == []


def test_what_is_misstated_is_told_with_its_factor():
    """A force's 0.09 N for 0.03 N, each with the pressure's 0.015 N; a moment's 0.2 N·mm for 0.6, each with 0.15."""
    factors = np.hypot(0.09, 0.015) / np.hypot(0.03, 0.015), np.hypot(0.6, 0.15) / np.hypot(0.2, 0.15)
    note = said(bench(1, true=Accuracy(3e-5, 5e-3, 150.0, 0.09, 2e-4)))[0]
    force, moment = note.split(" than data.accuracy says")[0].split(", ")
    for part, name, factor, way in ((force, "force", factors[0], "larger"), (moment, "moment", factors[1], "smaller")):
        assert part.startswith(f"the {name}'s scatter is ")
        assert part.endswith(f"times {way}")
        # 420 readings: 4 standard errors of a scale, of which shapes take a third, and two digits.
        assert float(part.split(" is ")[1].split()[0]) == pytest.approx(factor, rel=0.17 + 0.02)
    assert "data.accuracy=estimate" in note


def test_as_many_readings_as_parameters_say_nothing_of_their_scatter():
    """Two parameters go through both loads of one row, whatever their noise."""
    made = bench(1, true=Accuracy(3e-5, 5e-3, 150.0, 0.09, 2e-4))
    _, step = first_step(made.question())
    assert any("scatter" in note for note in noise_notes(step))
    whiten = copy(step.whiten)
    whiten.present = whiten.present & (torch.arange(len(whiten.present)) < 1)[:, None]
    assert not any("scatter" in note for note in noise_notes(replace(step, whiten=whiten)))


def test_position_errors_are_told_apart():
    note = said(bench(3, states=60, true=Accuracy(1.5e-4, 2.5e-2, 150.0, 0.03, 6e-4)))[0]
    assert note.startswith("the positions' scatter is")
    assert "force's" not in note
    assert "moment's" not in note


def test_heavy_tails_and_growing_noise_are_told():
    (note,) = said(bench(2, states=60, noise=student(4)))
    assert "heavier tails" in note

    made = bench(2, states=60)
    share = made.rows.states.pressure.numpy()[:, None] / float(made.rows.states.pressure.max())
    grown = made.loads + 3 * share * made.error
    notes = said(made.showing({place: grown[place] for place in np.ndindex(grown.shape)}))
    assert any("grows with the pressure" in note for note in notes)


def test_who_had_the_accuracy_estimated_is_not_told_to_estimate_it():
    note = said(bench(1, true=Accuracy(3e-5, 5e-3, 150.0, 0.09, 2e-4)), stated=False)[0]
    assert "than was estimated from the data" in note
    assert "data.accuracy=estimate" not in note


def test_a_check_that_passes_beyond_its_threshold_says_that_it_is_noise():
    """A force's 0.09 N where 0.03 are stated, drawn anew for each row: each differs from its neighbors by all of it."""
    made = bench(2, states=60, true=Accuracy(3e-5, 5e-3, 150.0, 0.09, 6e-4))
    prepared, step = first_step(made.question())
    case = Case(step.fit, None, prepared.rows, step.whiten, prepared.scale, PAPER, prepared.fold)
    force, moment = (
        check for check in stated(case) if check.name in ("accuracy of the force", "accuracy of the moment")
    )
    assert force.result == moment.result == PASS
    assert force.figure > force.threshold
    assert force.says.endswith("noise, no misfit.")
    assert "misfit" not in moment.says


def test_where_readings_scatter_more_than_was_stated_less_of_a_misfit_is_let_pass():
    """A twentieth of what is left is a function of the pressure: it may pass beside noise that is as it was said, and
    not where the noise is thrice that, which may be more of the same."""
    true = replace(PAPER, force=0.09, moment=1.8e-3)

    def extra(s, loads):
        p = 2 * s.pressure.numpy()[:, None] / float(s.pressure.max()) - 1
        return loads + 0.55 * (5 * p**3 - 3 * p) / 2 * [0.09, 1.8e-3]

    made, results = bench(4, states=40, true=true, extra=extra), {}
    for stated_accuracy in (true, PAPER):
        prepared, step = first_step(made.question(accuracy=stated_accuracy))
        case = Case(step.fit, None, prepared.rows, step.whiten, prepared.scale, stated_accuracy, prepared.fold)
        check = black_box(case)[0]
        assert SUSPECT_MATTERS < check.figure < MATTERS
        results[stated_accuracy] = check.result, check.says.endswith("it would be let pass.")
    assert results == {true: (PASS, False), PAPER: (FAIL, True)}


@pytest.mark.parametrize(("times", "result"), [(1.0, PASS), (2.5, CANNOT), (8.0, FAIL)])
def test_places_that_few_states_do_not_tell_of_may_be_what_a_length_left_out_is_off_by(times, result):
    """Of eight lengths nothing says how well they were set: an error that twice the usual one explains is no misfit."""
    # With seed 5 the other lengths know so little that what is missed is theirs, up to 4 times the usual.
    made = bench(8, states=8, samples=(1,), true=replace(PAPER, length=times * PAPER.length, twist=times * PAPER.twist))
    prepared, step = first_step(made.question(accuracy=PAPER))
    case = Case(step.fit, None, prepared.rows, step.whiten, prepared.scale, PAPER, prepared.fold)
    assert case.places_assumed
    checks = {check.name: check for check in levels_left_out(case)[0]}
    assert checks["each elongation left out"].result == result
    assert ("set some twice" in checks["each elongation left out"].says) == (result == CANNOT)


def test_many_states_tell_how_well_places_were_set():
    prepared, step = first_step(bench(5, states=60).question())
    case = Case(step.fit, None, prepared.rows, step.whiten, prepared.scale, PAPER, prepared.fold)
    assert not case.places_assumed


@pytest.mark.parametrize(("parts", "allowed"), [(5, True), (200, False)], ids=["few", "many"])
def test_what_few_parts_say_of_parameters_is_known_as_student_knows_it(parts, allowed):
    """Misses of four times what the others' parameters make: of 200 parts only a wrong model has them; of five, which
    tell how large errors are by five numbers, it happens once in a hundred."""
    noise, unsure = 0.002, 0.004
    known = (noise**2 + unsure**2) ** 0.5
    each = [(f"elongation {i} mm", 4 * unsure) for i in range(parts)]
    left = LeftOut("each elongation", 4 * unsure, 0.1, 0.1, Expected(noise, known, 1000.0), None, each)
    assert (left.model <= left.most) == allowed
    # With many the quantile is the normal distribution's, three standard deviations; the chance of either is the same.
    quantile = (left.most**2 - (1.6 * noise) ** 2) ** 0.5 / unsure
    assert stats.t.sf(quantile, parts) == pytest.approx(stats.norm.sf(3.0), rel=1e-6)


@pytest.mark.parametrize(("lengths", "often"), [(5, True), (60, False)], ids=["few", "many"])
def test_noise_that_is_errors_of_few_places_is_exceeded_no_more_often_than_that_of_many(lengths, often):
    """Errors of a right model, drawn: of five places beyond 1.6 times their size once in twenty, which is no doubt."""
    true = replace(PAPER, length=20 * PAPER.length)
    made = bench(6, states=lengths, samples=(1,), true=true)
    prepared, step = first_step(made.question(accuracy=true))
    case = Case(step.fit, None, prepared.rows, step.whiten, prepared.scale, true, prepared.fold)
    generator = torch.Generator().manual_seed(1)
    drawn = torch.tensor([case.error(step.whiten.drawn(generator)) for _ in range(4000)]) / case.floor
    assert bool((drawn > 1.6).double().mean() > 0.01) == often
    expected = Expected(case.floor, case.floor, case.draws())
    # One in 741 is meant; Satterthwaite's few draws are those of the variance, whose tail is a little thicker.
    assert float((drawn > expected.most_of_few(lengths) / case.floor).double().mean()) < 0.006
    assert (case.draws() < 12) == often
    # That of the squares is as told: 2 / draws.
    assert float(drawn.square().var()) == pytest.approx(2 / case.draws(), rel=0.15)


@pytest.mark.parametrize(("times", "result", "stands"), [(1.4, CANNOT, True), (2.2, CANNOT, False), (3.0, FAIL, False)])
def test_an_answer_that_only_few_places_excuse_is_not_refuted_and_does_not_stand(times, result, stands):
    """Of two draws 2.57 times the noise happens once in 741: between it and 1.6 times others are asked."""
    noise = 0.01
    left = LeftOut("each elongation", times * noise, None, 0.1, Expected(noise, noise, 2.0), None, [("0 mm", 0.01)])
    check = _check(left)
    assert check.result == result
    assert left.by_few == (1.6 < times < 2.57)
    assert Referee([check], [left]).stands == stands


def test_an_error_that_rises_with_what_is_claimed_is_explained():
    """Errors in percent are mostly those of places; what an effect does shows in standard deviations of the noise."""
    before = first_step(bench(1).question())[1]
    nearer = replace(before.heldout, white=0.9 * before.heldout.white)
    after = replace(before, E_heldout=1.04 * before.E_heldout, heldout=nearer)

    def notes(last, verdict="named"):
        return rise_notes(SimpleNamespace(steps=[before, last], final=last, verdict=verdict, noise_floor=0.0123))

    (note,) = notes(after)
    assert f"from {100 * before.E_heldout:.2f} to {104 * before.E_heldout:.2f} %" in note
    assert "1.23 are measuring's" in note
    assert notes(replace(after, E_heldout=0.9 * before.E_heldout)) == []
    assert notes(replace(after, heldout=before.heldout)) == []
    assert notes(after, "unexplained") == []
    assert notes(before, "adequate") == []
