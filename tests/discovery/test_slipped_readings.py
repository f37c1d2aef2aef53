"""How a reading probably slipped: said of each kind, of no good reading, and with no other answer for it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch
from first_step import first_step
from linear_bed import ACCURACY, NOISE, SHORT, TRUE, bench, student
from nightly import usually

from freelearn.data.accuracy import PAPER, Accuracy
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question, prepare
from freelearn.discovery.referee.case import Case
from freelearn.discovery.residuals.suspects import UNITS, state_outliers, suspects
from freelearn.discovery.search.search import search
from freelearn.physics.models.build import build_model
from freelearn.testing.reference import laboratory, other_beds
from freelearn.testing.reference.laboratory import Laboratory

MADE = bench(2, **SHORT)
# Large loads of either sample, and rows of other states of the same samples with loads that are quite different.
ROWS = {1: 87, 2: 147}
OTHER = {87: 4, 147: 184}
LOADS = ("force", "moment")


def suspected(made):
    prepared, step = first_step(made.question())
    return suspects(step, prepared.rows, prepared.kept)


def one_that_shows(row, load, reading):
    (found,) = suspected(MADE.showing({(row, load): reading}))
    right = MADE.loads[row, load]
    assert (found.row, found.load, found.rows) == (row, LOADS[load], (row,))
    assert found.shown == reading
    # What is expected is what its neighbors and the model say, its own error and theirs apart.
    assert abs(found.expected - right) < 6 * NOISE[load]
    assert found.sigmas == pytest.approx((reading - found.expected) / NOISE[load], rel=0.3)
    return found


@pytest.mark.parametrize("load", [0, 1], ids=LOADS)
@pytest.mark.parametrize("row", ROWS.values())
@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (-1.0, "sign turned"),
        (10.0, "10 times too large"),
        (0.1, "10 times too small"),
        (100.0, "100 times too large"),
        (1e-3, "1000 times too small"),
    ],
)
def test_wrong_signs_and_decimals_are_named(row, load, factor, said):
    found = one_that_shows(row, load, factor * MADE.loads[row, load])
    assert found.slip.endswith(said)
    assert found.source is None


@pytest.mark.parametrize(
    ("load", "unit", "times"),
    [
        # N in a pound-force, a kilogram-force and an ounce-force; N·mm in an inch-pound.
        (0, "pounds-force", 4.4482216),
        (0, "kilograms-force", 9.80665),
        (0, "ounces-force", 0.2780139),
        (1, "inch-pounds", 112.98483),
    ],
)
def test_wrong_units_are_named(load, unit, times):
    """Where no power of ten does as well within the noise."""
    row = int(np.abs(MADE.loads[:, load]).argmax())
    found = one_that_shows(row, load, MADE.loads[row, load] / times)
    assert found.slip == f"unit factor: in {unit}"
    assert UNITS[LOADS[load]][unit] == pytest.approx(times, rel=1e-6)


@pytest.mark.parametrize("load", [0, 1], ids=LOADS)
@pytest.mark.parametrize("row", ROWS.values())
def test_readings_of_other_rows_are_traced(row, load):
    found = one_that_shows(row, load, MADE.loads[OTHER[row], load])
    assert (found.slip, found.source) == ("another row's reading", OTHER[row])
    # The row before is of the same state; its pressure makes it differ by dozens of standard deviations.
    assert abs(MADE.loads[row, load] - MADE.loads[row - 1, load]) > 20 * NOISE[load]
    found = one_that_shows(row, load, MADE.loads[row - 1, load])
    assert found.slip.startswith("stuck")
    assert found.source == row - 1


def test_two_readings_that_changed_places_are_told_so():
    one, other = ROWS[1], OTHER[ROWS[1]]
    both = suspected(MADE.showing({(one, 0): MADE.loads[other, 0], (other, 0): MADE.loads[one, 0]}))
    assert {s.row for s in both} == {one, other}
    assert {s.slip for s in both} == {"swapped with another row's reading"}


def test_a_slip_that_is_like_nothing_gets_no_story():
    row = ROWS[1]
    found = one_that_shows(row, 0, MADE.loads[row, 0] + 60 * NOISE[0])
    assert (found.slip, found.source) == ("", None)


def test_a_table_that_is_rounded_coarsely_repeats_itself_by_chance():
    """To a quarter of a newton: that some other row shows the same says nothing, where in a fine table it says all."""
    step = 0.25
    coarse = MADE.showing({(i, 0): float(np.round(MADE.loads[i, 0] / step) * step) for i in range(len(MADE.loads))})
    # Two rows of one sample of which one shows what the other would with its sign turned.
    first = coarse.loads[:120, 0]
    row, other = next((i, j) for i in range(120) for j in range(120) if first[i] > 6 and first[j] == -first[i])
    shown = coarse.loads[other, 0]
    assert len(np.unique(coarse.loads[:, 0])) < 0.5 * len(coarse.loads)
    (found,) = suspected(coarse.showing({(row, 0): shown}))
    assert (found.row, found.slip) == (row, "sign turned")
    fine = one_that_shows(row, 0, MADE.loads[other, 0])
    assert (fine.slip, fine.source) == ("another row's reading", other)


@pytest.mark.parametrize("noise", usually({"noise": student(4)}, nightly=[{}]), ids=["heavy", "normal"])
def test_good_readings_are_seldom_suspected(noise):
    """At most one in 2,500 by design: of 10 × 480, more than 8 with a chance below one in a thousand."""
    assert sum(len(suspected(bench(seed, **SHORT, **noise))) for seed in range(10)) <= 8


def test_places_are_those_of_the_rows_that_were_asked_about():
    """A model without an answer in the first state's rows: its suspects are still counted from the table's first."""
    row = ROWS[1]
    made = MADE.showing({(row, 0): -MADE.loads[row, 0]})
    prepared, step = first_step(made.question())
    kept = np.r_[np.zeros(10, dtype=bool), prepared.kept]
    (found,) = suspects(step, prepared.rows, kept)
    assert (found.row, found.rows) == (row + 10, (row + 10,))


NOISY = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}


def test_of_real_mechanics_too_the_slips_are_found_and_traced():
    """The paper's actuators at 240 rows, of the continuum model: what was done to twelve readings is known."""
    actuators = {3: (36.0, 98.42, 4.77, 6.74), 6: (62.0, 99.0, 4.77, 6.36)}
    how = Laboratory(**SHORT, slipped=0.05, kinds=("sign", "decimal", "stuck", "other_row"), forms="package")
    measured = laboratory.measure(how, actuators, 8e5, 2e7, {}, NOISY, 4)
    table = measured.table
    rows = Rows.from_table(table)
    place = np.flatnonzero(table["buckled"] == 0)
    asked = Question(
        lambda names: build_model("continuum", {}, names, [3, 6]), [], rows[torch.as_tensor(place)], PAPER, 0
    )
    prepared, step = first_step(asked)
    found = {(int(place[s.row]), s.load): s for s in suspects(step, prepared.rows, prepared.kept)}
    columns = {"force_n": "force", "moment_nmm": "moment"}
    large = measured.slips[measured.slips["all_sigmas"] > 8]
    assert len(large) >= 6
    names = {"sign": "sign turned", "decimal": "decimal shift", "stuck": "the row before", "other_row": "row"}
    for slip in large.to_dict("records"):
        assert names[slip["kind"]] in found[slip["row"], columns[slip["load"]]].slip
    slipped = {(row, columns[load]) for row, load in zip(measured.slips["row"], measured.slips["load"], strict=True)}
    assert len(set(found) - slipped) <= 1


def test_a_slipped_reading_counts_for_nothing_where_states_are_left_out():
    """What the referee measures errors on: else one turned sign would refute every model."""
    prepared, step = first_step(MADE.showing({(87, 0): -10 * MADE.loads[87, 0]}).question())
    accuracy, scatter = prepared.question.accuracy, step.whiten.scatter
    # Under heavy tails one that slipped keeps a little weight.
    step.whiten.scatter = replace(scatter, reading=scatter.reading.clamp_min(1e-6))
    case = Case(step.fit, None, prepared.rows, step.whiten, prepared.scale, accuracy, prepared.fold)
    assert (~case.present).nonzero().tolist() == [[87, 0]]


@pytest.mark.parametrize(("load", "moved"), [(0, 0.6e-3), (0, -0.4e-3), (1, 0.1)])
def test_a_state_that_was_elsewhere_is_pointed_out_with_its_place(load, moved):
    """All rows of one state show the loads of another length, or twist."""

    def extra(s, loads):
        loads = loads.copy()
        loads[40:45, load] -= TRUE[load] * moved
        return loads

    made = bench(4, **SHORT, extra=extra)
    prepared, step = first_step(made.question())
    (found,) = state_outliers(step, prepared.rows, prepared.kept)
    assert found.rows == (40, 41, 42, 43, 44)
    assert found.load == ("elongation", "twist")[load]
    # Where it stands by the table, moved by as much as was hidden, but for its own position error.
    column, unit = (("elongation_mm", 1e-3), ("twist_deg", np.pi / 180))[load]
    assert found.shown == pytest.approx(made.table[column][40] * unit)
    assert found.expected - found.shown == pytest.approx(moved, abs=4 * (ACCURACY.length, ACCURACY.twist)[load])
    assert "all of its 5 rows agree" in found.slip


def test_no_state_is_pointed_out_where_all_were_where_they_are_said_to_be():
    prepared, step = first_step(bench(4, **SHORT).question())
    assert state_outliers(step, prepared.rows, prepared.kept) == []


def test_a_search_of_a_table_that_one_state_spoils_points_at_it():
    """Farther off than any noise: no effect explains it, and the answer says where to look."""

    def extra(s, loads):
        loads = loads.copy()
        loads[40:45, 0] -= TRUE[0] * 2e-3
        return loads

    found = search(bench(4, **SHORT, extra=extra).question(["friction_hysteresis", "force_offset"]))
    assert found.verdict == "unexplained"
    assert [(s.load, s.rows) for s in found.suspects] == [("elongation", (40, 41, 42, 43, 44))]


@pytest.mark.nightly
def test_where_the_model_lacks_something_everywhere_no_state_is_blamed():
    """A pressure that acts with its square too, in every state."""

    def extra(s, loads):
        return loads + (s.pressure.numpy()[:, None] / 6e4) ** 2 * [1.0, 0.01]

    found = search(bench(4, **SHORT, extra=extra).question(["friction_hysteresis", "force_offset"]))
    assert found.verdict != "adequate"
    assert not [s for s in found.suspects if s.load in ("elongation", "twist")]


DESIGN = {1: (28.0, -28.0, 180.0, 6.0, 7.2)}
LENGTHS, PRESSURES, ALONE_AT = np.array([0.0, -6.0, -12.0, -18.0]), np.linspace(60, 500, 9), -24.0


@pytest.fixture(scope="module")
def muscle():
    """Four lengths of a muscle with its noise, and of a fifth one row."""

    def measured(lengths, pressures, seed):
        asked = other_beds.nominal("isometric", DESIGN, np.stack([lengths, 0 * lengths], axis=1), pressures)
        return other_beds.measure("isometric", asked, 1.2e6, 2e8, {}, seed)

    alone = measured(np.array([ALONE_AT]), PRESSURES[-1:], 2)
    return pd.concat([measured(LENGTHS, PRESSURES, 1), alone], ignore_index=True)


def asked_of(table):
    accuracy = Accuracy.engineering(**other_beds.ACCURACY)
    return Question(lambda names: build_model("continuum", {}, names, [1]), [], Rows.from_table(table), accuracy, 0)


def said_of_the_last(table):
    found = search(asked_of(table))
    return found, [s for s in found.suspects if s.row == len(table) - 1]


def test_one_row_at_a_length_of_its_own_that_is_grossly_wrong_spoils_nothing(muscle):
    """No neighbor says what it should be, and 800 N against 300 bend all that is fitted to it."""
    largest = muscle["force_n"].abs().max()
    last = muscle.index == len(muscle) - 1
    for wrong in (-2.5 * largest, 3 * largest):
        found, (suspect,) = said_of_the_last(muscle.assign(force_n=muscle["force_n"].mask(last, wrong)))
        assert found.verdict == "adequate"
        assert suspect.shown == pytest.approx(wrong)
        # What the other lengths say of this one.
        assert suspect.expected == pytest.approx(float(muscle["force_n"].iloc[-1]), abs=0.03 * largest)
        assert found.final.fit.values()["C1"] == pytest.approx(1.2e6, rel=0.05)


def test_a_row_alone_at_its_length_is_no_suspect_where_it_is_right_or_where_the_model_errs(muscle):
    found, none = said_of_the_last(muscle)
    assert (found.verdict, none) == ("adequate", [])
    # Twice what the model expects, which is less than what the others show: a misfit, perhaps.
    last = muscle.index == len(muscle) - 1
    twice = muscle["force_n"].mask(last, 2 * muscle["force_n"])
    assert twice.iloc[-1] > twice.min()
    _, _, noise = prepare(asked_of(muscle.assign(force_n=twice)))
    assert not noise.scatter.slipped[-1].any()
