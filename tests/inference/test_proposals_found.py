"""What no effect of the library is, in data of the second test bed: written down at its place, with its inputs."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_beds import ALONE, BLOCK, MEMBERS, question, table_of
from outside_tables import KINDS, asked, measured

from freelearn.inference.beyond import Beyond
from freelearn.inference.prepare import prepare
from freelearn.inference.proposals.propose import proposed
from freelearn.inference.search import grow, search, verdict
from freelearn.inference.thresholds import LEFT
from freelearn.inference.white_fit import white_fit
from freelearn.models.effects.registry import EFFECTS, lent

# A few of each port, those that resemble what is hidden among them.
LIBRARY = [
    *("wall_stiffening", "second_invariant", "end_clamps", "wall_thickness", "fiber_misalignment", "twist_offset"),
    *("length_compliance", "pressure_gain", "friction_hysteresis", "force_gain", "force_offset", "moment_offset"),
    "sensor_drift",
]
SEEDS = range(6)


@pytest.fixture(autouse=True)
def library():
    """After a search the library is what it was."""
    before = dict(EFFECTS)
    yield
    assert before == EFFECTS


def is_the_kind(written, kind) -> bool:
    """Its place, or the one that shows the very same loads; its inputs; its family or one that stands for it."""
    places = {written.place.name, written.same_as}
    return bool(places & set(kind.places)) and tuple(i.name for i in written.inputs) == kind.inputs


@pytest.fixture(scope="module", params=["bent_force_cell", "squeezed"])
def found(request):
    kind = KINDS[request.param]
    question = asked(measured(kind.extra, samples=(3,), states=30).table)
    prepared, first = prepare(question)
    return kind, prepared, first, proposed(prepared, first)


def test_one_written_effect_leaves_nothing_and_is_of_the_right_place(found):
    kind, _, first, best = found
    assert first.left.p_value < LEFT
    written = best.chosen.fitted()
    assert is_the_kind(written, kind)
    assert written.form.family in kind.families
    step = best.chosen.step
    assert step.left.p_value >= LEFT
    # 30 states: what is left is the noise within some standard errors of it.
    assert step.E_heldout < 1.35 * step.floor
    assert step.E_heldout < first.E_heldout
    # Of χ² with the noise of the first model, at least as much as a hundred constants cost by chance.
    assert best.gain > 500
    assert best.base is first


def test_its_twins_explain_as_much_and_none_is_cheaper_by_far(found):
    """In χ², whitened by the same noise."""
    *_, best = found
    written = {t.written.name for t in best.twins}
    assert best.chosen.written.name not in written
    assert len(written) == len(best.twins)
    for twin in best.twins:
        assert twin.step.fit.chi2 == pytest.approx(best.chosen.step.fit.chi2, rel=0.05)


def test_what_was_fitted_is_what_the_file_begins_from(found):
    *_, best = found
    written, values = best.chosen.fitted(), best.chosen.step.fit.values()
    for c in written.constants():
        assert c.start == values[f"{written.name}.{c.name}"]
        assert c.lower <= c.start <= c.upper
    # Starts and formula aside it is the trial's.
    assert replace(written, starts=best.chosen.written.starts) == best.chosen.written


def test_a_mistaken_amount_of_nothing_is_not_written(found):
    """On top of the model that has it, nothing more helps."""
    _, prepared, _, best = found
    with lent([best.chosen.kind]):
        assert proposed(prepared, best.chosen.step) is None


# --- searches ---------------------------------------------------------------------------------------------------------


def test_where_nothing_is_missing_nothing_is_written():
    """Not even asked for by the search; and asked for all the same."""
    question = asked(measured(samples=(3,), states=30, seed=5).table, LIBRARY[:4])
    result = search(question)
    assert (result.verdict, result.effects, result.proposals) == ("adequate", [], [])
    prepared, first = prepare(question)
    beyond = Beyond(prepared, first, lambda steps: None)
    assert not beyond.ends(first)
    assert proposed(prepared, first) is None
    assert beyond.instead(first) is None


def test_what_the_library_explains_as_well_stays_the_librarys():
    hidden = {"wall_stiffening": {"C20": 3e5}}
    table = measured(effects=hidden, samples=(3,), states=30, seed=5).table
    result = search(asked(table, ["wall_stiffening", "force_offset", "pressure_gain"]))
    assert result.verdict == "named"
    assert result.effects == ["wall_stiffening"]
    assert result.proposals == []


def test_a_constant_that_nothing_asks_for_is_no_reason_to_exchange_an_effect_of_the_library(monkeypatch):
    """Of a drift of the moment alone a written function of the time has one constant, and the library's drift two."""
    hidden = {"sensor_drift": {"force_rate": 0.0, "moment_rate": 6e-7}}
    question = asked(measured(effects=hidden, samples=(3,), states=30, seed=5).table, ["sensor_drift", "force_offset"])
    prepared, first = prepare(question)
    steps = [first]
    grow(prepared, steps)
    last, written = steps[-1], proposed(prepared, first).chosen.step
    assert last.effects == ["sensor_drift"]
    assert len(written.fit.vector) < len(last.fit.vector)
    beyond = Beyond(prepared, first, lambda more: None)
    # What it explains more than the drift, in units of the noise, and a little: its constants do not add to it.
    again = white_fit(last.fit.model, prepared.rows, written.whiten, last.fit.vector)
    more = (again.chi2 - written.fit.chi2) / written.left.scale**2
    for threshold, better in ((more - 1, True), (more + 1, False)):
        monkeypatch.setattr("freelearn.inference.beyond.CHEAPER", threshold)
        assert beyond._cheaper(written, last) == better
    # In the place of several effects they do.
    monkeypatch.setattr("freelearn.inference.beyond.MANY", 1)
    assert beyond._cheaper(written, last)


def test_a_model_with_a_written_effect_is_proposed_only_where_nothing_is_left(found):
    _, _, first, best = found
    step = best.chosen.step
    assert verdict(step, [{"x": step}], wrote=True) == "proposed"
    assert verdict(step, [{"x": step}, {"y": step, "z": step}], wrote=True) == "proposed"
    assert verdict(first, [{"x": step}], wrote=True) == "unexplained"
    assert verdict(step, [{"x": step}]) == "named"


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_each_kind_is_proposed_by_a_search(name):
    kind = KINDS[name]
    result = search(asked(measured(kind.extra, seed=2).table, LIBRARY))
    assert result.verdict == "proposed"
    (proposal,) = result.proposals
    written = proposal.written
    assert is_the_kind(written, kind), written.name
    assert written.form.family in {*kind.families, *(t.family for t in proposal.twins)}
    assert written.form.family in kind.families
    assert result.effects == [written.name]
    assert [next(iter(members)) for members in result.classes] == [written.name]
    step = result.final
    assert proposal.step.effects == step.effects
    assert proposal.base.effects == []
    assert step.E_heldout < 1.25 * step.floor
    # The other place that shows the very same is told, where there is one, and first.
    same = [t for t in proposal.twins if t.E_heldout is None]
    assert [f"{t.port} {t.where}" for t in same] == ([written.same_as] if written.same_as else [])
    assert proposal.twins[: len(same)] == same
    if proposal.resembles:
        effect, share = proposal.resembles
        assert effect in LIBRARY
        assert 0 < share <= 1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cogging", "squeezed"])
def test_slipped_readings_do_not_hide_it(name):
    """One row in a hundred with another row's reading or a turned sign: pointed out, and the form is found."""
    kind = KINDS[name]
    made = measured(kind.extra, seed=3, slipped=0.01)
    # Those that stand out of the noise by far.
    slips = made.slips[made.slips["all_sigmas"] > 8]
    assert len(slips) >= 2
    result = search(asked(made.table, LIBRARY))
    assert result.verdict == "proposed"
    (proposal,) = result.proposals
    assert is_the_kind(proposal.written, kind)
    # The question's rows are the table's that are not buckled.
    rows = np.flatnonzero(made.table["buckled"] == 0)[result.kept]
    pointed_out = {int(rows[s.row]) for s in result.suspects}
    assert set(slips["row"]) <= pointed_out
    assert len(pointed_out) <= len(made.slips) + 2


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_is_written_where_nothing_is_missing(seed):
    result = search(asked(measured(seed=40 + seed).table, LIBRARY, seed))
    assert (result.verdict, result.effects, result.proposals) == ("adequate", [], [])


HIDDEN = [
    {"wall_stiffening": {"C20": 2e5}},
    {"friction_hysteresis": {"force": 0.4, "moment": 0.01}},
    {"fiber_misalignment": {"angle": 0.02}},
    {"length_compliance": {"compliance": 2e-5}},
    {"force_gain": {"gain": 0.06}, "friction_hysteresis": {"force": 0.4, "moment": 0.01}},
    {"twist_offset": {"angle": 0.05}, "end_clamps": {"clamp_length": 3e-3}},
]


@pytest.mark.slow
@pytest.mark.parametrize("case", range(len(HIDDEN)))
def test_nothing_is_written_where_the_library_has_it(case):
    """One of the library, or two."""
    result = search(asked(measured(effects=HIDDEN[case], seed=60 + case).table, LIBRARY, case))
    assert result.verdict in ("named", "class")
    assert result.proposals == []
    for name in HIDDEN[case]:
        assert any(name in members for members in result.classes)


@pytest.mark.slow
def test_the_same_seed_writes_the_same_and_the_order_of_states_the_same_form():
    kind = KINDS["cogging"]
    table = measured(kind.extra, samples=(3,), seed=7).table
    first, second = (search(asked(table, LIBRARY)) for _ in range(2))
    assert first.proposals[0].written == second.proposals[0].written
    assert first.final.E_heldout == second.final.E_heldout
    state = np.cumsum(table["step"] == 0)
    order = np.random.default_rng(0).permutation(np.unique(state))
    shuffled = table.iloc[np.concatenate([np.flatnonzero(state == n) for n in order])].reset_index(drop=True)
    other = search(asked(shuffled.drop(columns="time_s"), LIBRARY))
    one, two = (r.proposals[0].written for r in (first, other))
    assert one.name == two.name
    for c, d in zip(one.constants(), two.constants(), strict=True):
        assert d.start == pytest.approx(c.start, rel=0.05)


def bent_gauge(table, columns, top: float, share: float):
    """The table of a gauge that shows more, beyond four tenths of its range: what it shows is not what there is."""
    over = {c: table[c] + share * top * np.maximum(table[c] / top - 0.4, 0) for c in columns}
    return table.assign(**over)


@pytest.mark.slow
@pytest.mark.parametrize("bed", [*ALONE, BLOCK])
def test_a_gauge_that_bends_is_found_on_every_bed(bed):
    """On an end block all three actuators' gauges bend alike."""
    table = table_of(bed, seed=3)
    columns = [f"pressure_{n}_kpa" for n in MEMBERS] if bed == BLOCK else ["pressure_kpa"]
    bent = bent_gauge(table, columns, float(table[columns].to_numpy().max()), 0.08)
    result = search(question(bent, ["pressure_gain", "pressure_offset", "force_gain", "wall_stiffening"]))
    assert result.verdict == "proposed"
    (proposal,) = result.proposals
    written = proposal.written
    assert written.place.name == "boundary pressure"
    assert [i.name for i in written.inputs] == ["pressure"]
    assert written.form.family == "hinge"
    assert proposal.step.fit.values()[f"{written.name}.amount"] < 0
