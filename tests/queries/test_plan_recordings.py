"""Plans of recordings: where rows are samples of a log, which rate, hold and reversal tells most."""

import json
from dataclasses import replace
from itertools import combinations

import numpy as np
import pandas as pd
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

import freelearn
from freelearn.api.tasks.plan_source import source_of
from freelearn.common.errors import UserError
from freelearn.data.accuracy import PAPER
from freelearn.data.logs import run_numbers
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.data.table.measurement_table import read_table
from freelearn.discovery.fits.prepare import Question, prepare
from freelearn.discovery.noise.memory import Memory
from freelearn.discovery.search.next_states import telling
from freelearn.physics.models.build import build_model
from freelearn.queries.next_measurements.courses import course_in_words, courses, in_words
from freelearn.queries.next_measurements.goals import Discriminate, Narrow, score
from freelearn.queries.next_measurements.known_rows import Known, ahead, standing
from freelearn.queries.next_measurements.next_recordings import next_recordings
from freelearn.queries.next_measurements.recordings import in_order, paths, recordings
from freelearn.report.tables.discovery_tables import next_state_lines, next_states
from freelearn.report.tables.plan_tables import mounting_table, plan_lines
from freelearn.testing.reference.simulated_logs import log, measured

CREEP = {"creep": {"share": 0.1, "time": 3.0}}


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A run with creep in it, and its log."""
    table = log(CREEP, 3, (4,), 4, rate=5.0, seconds=10.0)
    run = freelearn.fit(table, model="continuum", effects=["creep"], train="all", progress=False)
    return run.save(tmp_path_factory.mktemp("run") / "creep"), table


@given(count=st.integers(8, 400), fastest=st.floats(0.01, 500))
def test_courses_stay_within_what_the_bed_can_do(count, fastest):
    found = courses(count, fastest)
    assert len({(c.rows, c.levels) for c in found}) == len(found)
    for course in found:
        level = course.along(count)
        assert len(level) == count
        assert level[0] == 0
        assert level.min() >= 0
        assert 0 < level.max() <= 1
        # From no row to the next it goes farther than the bed does.
        assert np.abs(np.diff(level)).max() <= 1 / fastest * (1 + 1e-6) + 1e-9
        assert list(course.rows) == sorted(set(course.rows))
        assert course.rows[-1] == count - 1


def test_words_of_a_course_hold_all_that_it_does():
    time = np.arange(0, 30.5, 0.5)
    cycles = 50 * (1 - np.abs((time % 6) / 3 - 1))
    assert in_words(time, cycles, "kPa") == "5 times: in 3 s to 50 kPa, in 3 s to 0 kPa"
    assert in_words(time, np.full_like(time, 7.0), "mm") == "stay at 7 mm"
    jagged = np.interp(time, np.arange(0, 31, 2.5), np.arange(13) ** 2 % 7)
    told = in_words(time, jagged, "kPa")
    assert told.count(";") < 10
    assert "more such moves" in told


def test_candidates_drive_what_was_driven_as_fast_as_it_went():
    table = log({}, 1, (4,), 4, rate=5.0, seconds=10.0)
    found = paths(table, 50, {}, 20_000)
    assert set(run_numbers(found)) == set(range(len(found) // 50))
    for name in ("elongation_mm", "twist_deg", "pressure_kpa"):
        assert found[name].min() >= table[name].min() - 1e-9
        assert found[name].max() <= table[name].max() + 1e-9
        fastest = (table[name].diff() / table["time_s"].diff()).abs()[table["run"].diff() == 0].max()
        steps = (found[name].diff() / found["time_s"].diff()).abs()[found["run"].diff() == 0]
        assert steps.max() <= fastest * 1.05
        assert steps.max() > 0
    # Every other recording of the log moves its place; one whose place stands has none that is driven.
    still = table[table["run"] % 2 == 1]
    held = paths(still, 50, {}, 20_000)
    assert (held.groupby("run")[["elongation_mm", "twist_deg"]].nunique() == 1).all(axis=None)
    moved = paths(still, 50, {"twist_deg_per_s": (0.0, 60.0)}, 20_000)
    assert (moved.groupby("run")["twist_deg"].nunique() > 1).any()


def test_a_candidate_is_judged_as_the_next_recording_whatever_stands_beside_it(fitted):
    """Softening remembers the harshest sample so far: that of other candidates is none."""
    _, table = fitted
    rows = Rows.from_table(table)
    model = build_model("continuum", {}, ["stress_softening"], [4])
    start = model.vector().detach().clone()
    start[model.labels().index("stress_softening.depth")] = 0.2
    known = Known.from_rows(table, rows, model, start, PAPER)
    goal = Narrow("narrow", (("C1",),), known.fit, ("C1",), (1.0,))
    there = recordings(known, goal, 20, looked_at=3000)
    (view,) = there.objective.views
    for number in (1, len(there.table) // 20 - 1):
        alone = there.rows_of(number)
        (gain,) = score(known, goal, alone).gains
        added = there.objective.values([view.known + there.objective.each(np.array([number]))[0][0]])[0]
        # What no row has told of has a little information of its own, and units of columns depend on the candidates.
        assert gain.gain + gain.prior == pytest.approx(float(added), rel=1e-4)


def test_noise_that_goes_on_is_that_of_a_dense_covariance(fitted):
    _, table = fitted
    rows = Rows.from_table(table)
    model = build_model("continuum", {}, ["creep"], [4])
    known = Known.from_rows(table, rows, model, model.vector().detach().clone(), PAPER)
    assert known.whiten.scatter.memory is None
    memory = Memory(torch.tensor([0.9, 0.9]).double(), torch.tensor([2.0, 2.0]).double())
    scatter = replace(known.whiten.scatter, memory=memory)
    whiten = object.__new__(type(known.whiten))
    whiten.__dict__.update(vars(known.whiten), scatter=scatter)
    states = States.from_table(paths(table, 50, {}, 500).iloc[:50])
    found = replace(known, whiten=whiten).noise(states, torch.zeros(50, dtype=torch.int64))
    columns = ahead(known.fit, states).by_vector
    got = found(columns).flatten(0, 1)
    # The same by a dense covariance of all readings of the recording.
    apart, places = (found.apart(x).transpose(0, 1).flatten(0, 1) for x in (columns, found.places))
    time = torch.arange(50, dtype=torch.float64) * 0.2
    fades = 0.9 * torch.exp(-(time[:, None] - time).abs() / 2.0) + 0.1 * torch.eye(50, dtype=torch.float64)
    covariance = torch.block_diag(fades, fades) + places @ places.T
    assert torch.allclose(got.T @ got, apart.T @ torch.linalg.solve(covariance, apart), rtol=1e-5, atol=1e-5)
    white = known.noise(states, torch.zeros(50, dtype=torch.int64))(columns).flatten(0, 1)
    assert (got.square().sum(0) < 0.9 * white.square().sum(0)).all()


def test_a_planned_recording_narrows_as_it_says_once_it_is_measured(fitted, tmp_path):
    run, table = fitted
    plan = freelearn.plan(run, rows=50, goal="narrow", parameter="creep.time")
    assert list(plan.table.columns[-3:]) == ["time_s", "run", "expected_z"]
    assert plan.table[["force_n", "moment_nmm"]].isna().all(axis=None)
    assert set(plan.table["run"]) == {5}
    (one,) = plan.parameters
    assert 0.3 < one.factor < 0.95
    more = pd.concat([table, measured(plan.table, CREEP, 11)], ignore_index=True)
    more.to_csv(tmp_path / "more.csv", index=False)
    assert read_table(tmp_path / "more.csv").table["run"].nunique() == 5
    before = source_of(run).known
    known = Known.from_rows(more, Rows.from_table(more), before.fit.model, before.fit.vector, PAPER)
    place = known.fit.model.labels().index("creep.time")
    after = float(np.linalg.inv(known.information(known.fit))[place, place]) ** 0.5
    assert after * known.fit.values()["creep.time"] == pytest.approx(one.after, rel=0.25)


def test_what_splits_a_slow_valve_from_a_slow_gauge_moves_the_place(fitted):
    """Both are late alike where the pressure alone goes; a gauge is late where the bed twists, a valve is not."""
    _, table = fitted
    table = table[table["run"] % 2 == 1].reset_index(drop=True)
    table = measured(table, {"supply_lag": {"time": 0.1}}, 5)
    rows, fits = Rows.from_table(table), {}
    for name in ("supply_lag", "sensor_lag"):
        model = build_model("continuum", {}, [name], [4])
        known = Known.from_rows(table, rows, model, model.vector().detach().clone(), PAPER)
        fits[name] = known.fit
    goal = Discriminate.from_fits([fits])
    reach = {"twist_deg_per_s": (0.0, 90.0), "twist_deg": (-90.0, 90.0)}
    there = recordings(known, goal, 50, reach, looked_at=20_000)
    every = np.flatnonzero(there.objective.visits.allowed[:, 0])
    each = zip(there.objective.known, there.objective.each(every), strict=True)
    told = there.objective.values([known + added for known, added in each]).min(0)
    best, moves = there.rows_of(int(every[told.argmax()])), there.table.groupby("run")["twist_deg"].nunique() > 1
    assert best["twist_deg"].nunique() > 1
    assert told[~moves.to_numpy()[every]].max() < 0.2 * told.max()
    assert "twist" not in course_in_words(best)
    assert course_in_words(best).startswith("at P ")


def test_a_search_tells_which_recording_splits_its_class(fitted):
    _, table = fitted
    table = measured(table, {"supply_lag": {"time": 0.1}}, 5)
    rows, steps = Rows.from_table(table), {}
    for name in ("supply_lag", "sensor_lag", "creep"):
        question = Question(lambda more: build_model("continuum", {}, list(more), [4]), [], rows, PAPER, 0, [name])
        prepared, fit, noise = prepare(question)
        steps[name] = prepared.step(fit, noise.whitener())
    proposed = next_recordings(steps, table, rows)
    assert [p.expected_z for p in proposed] == sorted((p.expected_z for p in proposed), reverse=True)
    assert {frozenset(p.separates) for p in proposed} == {frozenset(pair) for pair in combinations(steps, 2)}
    for p in proposed:
        assert table["elongation_mm"].min() <= p.elongation_mm <= table["elongation_mm"].max()
        assert 0 <= p.pressure_kpa <= table["pressure_kpa"].max()
        assert " s" in p.course
    shown = next_states(proposed)
    assert shown.rows[0][-1] == proposed[0].course
    (line, *_) = next_state_lines(proposed, 1)
    assert line.startswith("record sample 4 at ")
    assert proposed[0].course in line
    useful, twins = telling([replace(proposed[0], expected_z=0.2)], "recording")
    assert not useful
    assert twins[0].startswith("no recording within the bed's reach would tell")


def test_a_plan_of_ones_own_recordings_is_scored_alike(fitted, tmp_path):
    run, _ = fitted
    made = freelearn.plan(run, rows=40, per_state=20, goal="detect", effect="maxwell_slip")
    assert made.mountings == 2
    assert made.table.groupby("run").size().tolist() == [20, 20]
    made.table.to_csv(tmp_path / "mine.csv", index=False)
    mine = freelearn.plan(run, path=tmp_path / "mine.csv", goal="detect", effect="maxwell_slip")
    assert mine.weakest.after == pytest.approx(made.weakest.after)
    assert mine.certificate.value == pytest.approx(made.certificate.value)
    assert "of as many recordings of these kinds" in plan_lines(made)[1]
    assert " recording" in plan_lines(made)[2]
    assert (made.rows_needed > 0) == (made.weakest.before < 5)
    table = mounting_table(made)
    assert len(table.rows) == 2
    assert "s to" in table.rows[0][-1]
    made.save(tmp_path / "plan")
    content = json.loads((tmp_path / "plan" / "plan.json").read_text())
    assert [each["do"] for each in content["recordings"]] == [row[-1] for row in table.rows]
    assert [each["run"] for each in content["recordings"]] == ["5", "6"]
    assert (tmp_path / "plan" / "plan_places.png").stat().st_size > 5000


def test_too_few_rows_for_a_recording_are_refused(fitted, tmp_path):
    run, _ = fitted
    with pytest.raises(UserError, match="8 rows at least: 4 are too few"):
        freelearn.plan(run, rows=4, goal="narrow", parameter="C1")
    pd.DataFrame({"sample": [4], "step": [0], "elongation_mm": 0.0, "twist_deg": 0.0, "pressure_kpa": 9.0}).to_csv(
        tmp_path / "table.csv", index=False
    )
    with pytest.raises(UserError, match="lacks the columns time_s, run"):
        freelearn.plan(run, path=tmp_path / "table.csv", goal="narrow", parameter="C1")


def test_runs_are_counted_on_and_their_names_may_be_words(fitted):
    _, table = fitted
    rows = Rows.from_table(table)
    model = build_model("continuum", {}, ["creep"], [4])
    known = Known.from_rows(table, rows, model, model.vector().detach().clone(), PAPER)
    there = recordings(known, Narrow("narrow", (("C1",),), known.fit, ("C1",), (1.0,)), 20, looked_at=2000)
    assert in_order(there, np.array([3, 1]), table, 0)["run"].unique().tolist() == [5, 6]
    assert in_order(there, np.array([3]), table.assign(run="pull"), 0)["run"].unique().tolist() == [1]
    later = standing(States.from_table(there.rows_of(1)), rows.states)
    assert later.recording is not None
    assert float(later.recording.states.past_severity.min()) >= float(rows.states.past_severity.max()) * (1 - 1e-12)
