"""The search on every bed, on data of the reference physics: calibration of the noise, and what is found."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from first_step import first_step
from hidden_beds import ALONE, BLOCK, MATERIAL, TUBES, blanked, model_of, question, rows_of, table_of
from nightly import chosen, usually
from scipy import stats

from freelearn.api.tasks import preparation
from freelearn.api.tasks.preparation import estimated
from freelearn.data.accuracy import PAPER
from freelearn.data.bed_accuracy import sensors, shared
from freelearn.data.beds import DEAD_LOAD, bed_of
from freelearn.discovery.fits.estimated_accuracy import SMOOTH, estimate
from freelearn.discovery.fits.white_fit import evaluated
from freelearn.discovery.noise.noise import Whitener, sensitivities
from freelearn.discovery.noise.structure import structure
from freelearn.discovery.residuals.suspects import suspects
from freelearn.discovery.search.next_states import next_states
from freelearn.discovery.search.search import search
from freelearn.testing.reference.other_beds import measure, nominal

BEDS = (*ALONE, BLOCK)
FEW = usually("isometric", "inflation", nightly=["dead_load", BLOCK])
READ = {
    "isometric": ["force_n"],
    "dead_load": ["elongation_mm", "twist_deg"],
    "inflation": ["force_n", "outer_diameter_mm"],
    BLOCK: ["force_n", "moment_nmm"],
}


def coarse(bed: str) -> int:
    """Every so manieth state: coming to rest under a load takes the reference long."""
    return 2 if bed == "dead_load" else 1


def truth(table):
    """The model that the reference bed is, and the table's rows."""
    model, rows = model_of(table), rows_of(table)
    model.set_values(dict(zip(("C1", "C2"), MATERIAL, strict=True)))
    return model, rows


def stated(model, rows) -> Whitener:
    state = torch.as_tensor(rows.state)
    return Whitener(sensitivities(model, rows.states), state, PAPER, None, rows.states.bed, rows.readings.present)


@pytest.mark.parametrize("blank", [0.0, 0.4])
@pytest.mark.parametrize("bed", BEDS)
def test_the_noise_stated_is_the_noise_that_the_reference_bed_makes(bed, blank):
    """χ² of the true model's whitened residuals per reading: one, within four of its standard deviations √(2/n). What
    a state's rows share (a place, or the loads as hung) and what each has of its own must both be right for that."""
    total, count = 0.0, 0
    for seed in chosen(range(3), 1):
        table = table_of(bed, seed=seed, coarse=coarse(bed))
        model, rows = truth(blanked(table, READ[bed], blank, seed))
        whiten = stated(model, rows)
        with torch.no_grad():
            shown, status = model(rows.states)
        assert (status == 0).all()
        total += float(whiten(rows.readings.missed(shown)).square().sum())
        count += whiten.count
    assert total / count == pytest.approx(1.0, abs=4 * np.sqrt(2 / count))


def test_under_a_dead_load_the_hung_weights_error_is_a_states_and_the_places_each_rows():
    """Exact weights, then exact places: either alone is what the whitener says of it."""
    places = np.array([[f, m] for f in (-3.0, 0.0, 3.0) for m in (-20.0, 10.0, 20.0)])
    plan = nominal("dead_load", TUBES, places, np.linspace(0, 70, 6))
    nothing = dict.fromkeys(("elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm"), 0.0)
    for kind, names in (("weights", ("force_n", "moment_nmm")), ("places", ("elongation_mm", "twist_deg"))):
        size = {"force_n": 0.05, "moment_nmm": 1.0, "elongation_mm": 0.05, "twist_deg": 0.2}
        table = measure("dead_load", plan, *MATERIAL, {}, 1, nothing | {n: size[n] for n in names})
        model, rows = truth(table)
        with torch.no_grad():
            missed = rows.readings.missed(model(rows.states).loads).numpy()
        if kind == "places":
            np.testing.assert_allclose(missed.std(0), [0.05e-3, np.deg2rad(0.2)], rtol=4 / np.sqrt(2 * len(rows)))
            continue
        slope = sensitivities(model, rows.states).numpy()[:, :, :2]
        for state in np.unique(rows.state):
            inside = np.flatnonzero(rows.state == state)
            # One weight explains all rows of a state: what is left is of second order in it.
            design, target = slope[inside].reshape(-1, 2), missed[inside].reshape(-1)
            error, *_ = np.linalg.lstsq(design / [1, 1], target, rcond=None)
            assert np.abs(target - design @ error).max() < 0.02 * np.abs(target).max() + 1e-9
            assert (np.abs(error) < 4.5 * np.array([0.05, 1e-3])).all()


def test_each_bed_knows_which_errors_are_whose():
    assert sensors(PAPER, DEAD_LOAD).tolist() == [PAPER.length, PAPER.twist]
    assert shared(PAPER, DEAD_LOAD).tolist() == [PAPER.force, PAPER.moment]
    inflation = bed_of(table_of("inflation", coarse=8))
    assert sensors(PAPER, inflation).tolist() == [PAPER.force, PAPER.diameter]
    assert shared(PAPER, inflation).tolist() == [PAPER.length, PAPER.twist]


@pytest.mark.parametrize("bed", FEW)
def test_small_p_values_are_as_rare_as_they_say(bed):
    """Noise as stated, four readings in ten blank, no fit: p-values times the number of bases, so a one-sided
    Kolmogorov–Smirnov test; and the noise's size is found."""
    model, rows = truth(blanked(table_of(bed, seed=4), READ[bed], 0.4, 4))
    whiten = stated(model, rows)
    nothing = torch.zeros(len(rows), 2, 1, dtype=torch.float64)
    p_values, sizes = [], []
    for seed in range(30):
        white = np.random.default_rng([seed, 8]).normal(size=(len(rows), 2)) * rows.readings.present.numpy()
        found = structure(torch.as_tensor(white), nothing, rows.states, whiten)
        p_values.append(found.p_value)
        sizes.append(found.scale)
    assert stats.kstest(p_values, "uniform", alternative="greater").pvalue > 1e-3
    # Drawing in what is beyond four standard deviations takes next to nothing.
    assert np.mean(sizes) == pytest.approx(1.0, abs=0.03)


def test_the_accuracy_of_an_inflation_bed_is_estimated():
    """Of forces and diameters, twice as noisy as the paper's and the camera's: to a fifth."""
    table = table_of("inflation", seed=5)
    generator = np.random.default_rng(9)
    for name, size in (("force_n", 0.03), ("outer_diameter_mm", 0.02)):
        table[name] += generator.normal(0, np.sqrt(3) * size, len(table))
    model, rows = truth(table)
    found, how = estimate(evaluated(model, rows, model.vector().detach()), rows, PAPER)
    assert how == SMOOTH
    assert found.diameter == pytest.approx(2 * PAPER.diameter, rel=0.2)
    # The pressure's error cannot be told from the load cell's own.
    assert found.force == pytest.approx(2 * PAPER.force, rel=0.25)


def test_of_a_model_that_has_run_away_no_doubt_of_what_was_set_is_told(monkeypatch):
    model, rows = truth(table_of("dead_load", seed=5, coarse=2))
    fit = evaluated(model, rows, model.vector().detach())
    (note,) = estimated(fit, rows).notes
    assert "force 0." in note
    # As a stiffness of 1e19 Pa makes of repeats, measured at 40 degrees.
    lost = replace(PAPER, force=9e11, moment=2e10)
    monkeypatch.setattr(preparation, "estimate", lambda *_: (lost, "how repeats differ"))
    (note,) = estimated(fit, rows).notes
    assert "of force and moment nothing can be told" in note
    assert "e+" not in note


HIDDEN = {
    "isometric": [{"friction_hysteresis": {"force": 0.5}}, {"wall_stiffening": {"C20": 3e5}}],
    "dead_load": [{"pressure_gain": {"gain": 0.04}}],
    "inflation": [{"wall_stiffening": {"C20": 3e5}}, {"force_offset": {"force": 0.3}}],
    BLOCK: [{2: {"fiber_misalignment": {"angle": 0.03}}}, {1: {"pressure_gain": {"gain": -0.03}}}],
}
# A few from each port, so that a search takes seconds.
LIBRARY = ["wall_stiffening", "fiber_misalignment", "length_offset", "pressure_gain", "friction_hysteresis"]
CASES = [(bed, i) for bed in BEDS for i in range(len(HIDDEN[bed]))]
QUICK = [("isometric", 0), ("inflation", 0)]


def names_in(bed: str, hidden) -> set[str]:
    return {name for part in hidden.values() for name in part} if bed == BLOCK else set(hidden)


@pytest.mark.slow
@pytest.mark.parametrize("seed", usually(0, nightly=[1]))
@pytest.mark.parametrize(
    ("bed", "case"), [pytest.param(*case, marks=[] if case in QUICK else pytest.mark.nightly) for case in CASES]
)
def test_what_is_hidden_on_each_bed_is_found(bed, case, seed):
    """It, or a class that holds it, and nothing else; the held-out error then is the noise's, three of whose standard
    deviations are 3/√(2n) of it: the n states' shared errors make the most of it."""
    hidden = HIDDEN[bed][case]
    found = search(question(table_of(bed, hidden, 20 + seed), [*LIBRARY, "force_offset"], seed))
    names = names_in(bed, hidden)
    assert found.verdict in ("named", "class")
    assert len(found.classes) == len(names)
    for name in names:
        assert any(name in members for members in found.classes)
    states = len(np.unique(found.rows.state))
    assert found.final.E_heldout < (1 + 3 / np.sqrt(2 * states)) * found.noise_floor
    assert not found.suspects


@pytest.mark.parametrize("seed", usually(0, nightly=[1]))
@pytest.mark.parametrize("bed", FEW)
def test_where_nothing_is_hidden_nothing_is_found(bed, seed):
    found = search(question(table_of(bed, None, 30 + seed, coarse(bed)), LIBRARY, seed))
    assert (found.verdict, found.effects, found.suspects) == ("adequate", [], [])


def test_under_a_dead_load_a_model_that_is_wrong_is_told_by_where_it_rests():
    """Not by two steps from where the actuator was seen to rest, which a search for effects begins with: these would
    take a wrong model for better than it is."""
    table = table_of("dead_load", {"pressure_gain": {"gain": 0.2}}, 45, coarse=4)
    found = search(question(table, ["pressure_gain"]))
    assert found.effects == ["pressure_gain"]
    for step in found.steps:
        with torch.no_grad():
            rest = step.fit.model(found.rows.states).loads
        torch.testing.assert_close(step.fit.shown, rest, rtol=1e-7, atol=1e-9)


def test_which_member_is_at_fault_is_told():
    """A second actuator's fibers lie three hundredths of a radian off: its parameter says so, the others' nothing."""
    found = search(question(table_of(BLOCK, {2: {"fiber_misalignment": {"angle": 0.03}}}, 40), LIBRARY))
    assert found.effects == ["fiber_misalignment"]
    values = found.final.fit.values()
    angles = [values[f"fiber_misalignment.angle[{n}]"] for n in (1, 2, 3)]
    # A few standard errors of 0.001 rad.
    np.testing.assert_allclose(angles, [0.0, 0.03, 0.0], atol=0.004)


@pytest.mark.nightly
@pytest.mark.parametrize("hidden", ["wall_modulus", "fiber_modulus"])
def test_a_tube_of_another_stock_is_found_among_three(hidden):
    """The third tube's modulus is ×1.8 that of the others, which a length and a gain could try to stand for."""
    table = table_of(BLOCK, {3: {hidden: {"log_ratio": 0.6}}}, 41)
    found = search(question(table, [*LIBRARY, "wall_modulus", "fiber_modulus"]))
    assert found.effects == [hidden]
    values = found.final.fit.values()
    # C1 and C2 are the first one's. By five such tables the third's ratio scatters by 0.03, and 0.05.
    ratios = [values[f"{hidden}.log_ratio[{n}]"] for n in (2, 3)]
    np.testing.assert_allclose(ratios, [0.0, 0.6], atol=0.1)


def test_an_effect_is_found_among_blanks():
    table = blanked(table_of("isometric", {"friction_hysteresis": {"force": 0.5}}, 21), ["force_n"], 0.4, 21)
    found = search(question(table, LIBRARY))
    assert found.effects == ["friction_hysteresis"]


SLIPS = [
    ("isometric", "force_n", "force"),
    ("inflation", "force_n", "force"),
    ("inflation", "outer_diameter_mm", "outer diameter"),
]


@pytest.mark.parametrize(("bed", "column", "load"), SLIPS)
def test_a_slipped_reading_is_suspected_on_its_bed(bed, column, load):
    """A decimal point in the wrong place in one reading, four in ten others blank."""
    table = blanked(table_of(bed, seed=22), [column], 0.4, 22)
    row = int(table[column].abs().idxmax())
    table.loc[row, column] *= 0.1
    prepared, step = first_step(question(table))
    (found,) = suspects(step, prepared.rows, prepared.kept)
    assert (found.row, found.load) == (row, load)
    assert "decimal shift" in found.slip


@pytest.mark.parametrize("bed", FEW)
def test_the_next_state_is_one_that_the_bed_can_impose(bed):
    """Two models that differ in a modulus: the state proposed lies within what the bed went to."""
    table = table_of(bed, {}, 23, coarse(bed))
    prepared, step = first_step(question(table))
    other = prepared.question.build([])
    other.set_values({name: 1.1 * value for name, value in step.fit.values().items()})
    fit = evaluated(other, prepared.rows, other.vector().detach())
    (proposed,) = next_states({"one": step, "other": prepared.step(fit, step.whiten)}, table, PAPER)
    columns = {q.column for q in bed_of(table).state}
    for name in ("elongation_mm", "twist_deg", "force_n", "moment_nmm"):
        value = getattr(proposed, name)
        assert (value is not None) == (name in columns)
        if value is not None:
            assert table[name].min() - 1e-9 <= value <= table[name].max() + 1e-9
    assert len(proposed.pressures_kpa) == (3 if bed == BLOCK else 0)
    assert proposed.expected_z > 1
    assert prepared.rows.states.bed is bed_of(table)
