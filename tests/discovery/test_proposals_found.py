"""What no effect of the library is, in data of the second test bed: written down at its place, with its inputs."""

from contextlib import ExitStack

import numpy as np
import pytest
import torch
from hidden_beds import ALONE, BLOCK, MEMBERS, question, table_of
from nightly import usually
from outside_tables import KINDS, asked, measured

from freelearn.discovery.fits.prepare import prepare
from freelearn.discovery.fits.step import parameter_covariance
from freelearn.discovery.fits.white_fit import refitted
from freelearn.discovery.proposals.propose import promised_alone
from freelearn.discovery.proposals.unknown_function import unknown
from freelearn.discovery.search.answer import ended
from freelearn.discovery.search.beyond import asked_beyond, beyond
from freelearn.discovery.search.search import search
from freelearn.discovery.search.stages import explored
from freelearn.discovery.thresholds import ALIKE, ALPHA_STRUCTURE, SEVERAL
from freelearn.physics.effects.registry import EFFECTS, lent
from freelearn.physics.models.build import build_model
from freelearn.physics.written.source import effect_class
from freelearn.physics.written.written_effect import scaled

# A few of each port, those that resemble what is hidden among them.
LIBRARY = [
    *("wall_stiffening", "second_invariant", "end_clamps", "wall_thickness", "fiber_misalignment", "twist_offset"),
    *("length_compliance", "pressure_gain", "friction_hysteresis", "force_gain", "force_offset", "moment_offset"),
    "sensor_drift",
]


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


@pytest.fixture(scope="module", params=usually("bent_force_cell", nightly=["squeezed"]))
def found(request):
    kind = KINDS[request.param]
    return kind, search(asked(measured(kind.extra, samples=(3,), states=30).table, LIBRARY[:4]))


def test_one_written_effect_leaves_nothing_and_is_of_the_right_place(found):
    kind, result = found
    assert result.steps[0].left.p_value < ALPHA_STRUCTURE
    (proposal,) = result.proposals
    assert is_the_kind(proposal.written, kind)
    assert proposal.written.form.family in kind.families
    step = result.final
    assert step.left.p_value >= ALPHA_STRUCTURE
    # 30 states: what is left is the noise within some standard errors of it.
    assert step.E_heldout < 1.35 * step.floor
    assert step.E_heldout < result.steps[0].E_heldout
    assert proposal.base.effects == []


def test_its_twins_explain_as_much(found):
    """What stands in for it predicts what was left out as well, and is none of it."""
    _, result = found
    (proposal,) = result.proposals
    for twin in proposal.twins:
        assert twin.E_heldout is None or twin.E_heldout < 1.3 * result.final.E_heldout
    formulas = [(t.port, t.where, t.formula) for t in proposal.twins]
    assert len(set(formulas)) == len(formulas)


def test_what_was_fitted_is_what_the_file_begins_from(found):
    _, result = found
    (proposal,) = result.proposals
    written, values = proposal.written, result.final.fit.values()
    for c in written.constants():
        assert c.start == values[f"{written.name}.{c.name}"]
        assert c.lower <= c.start <= c.upper


def test_a_free_function_is_known_no_better_than_the_forms_own_constants(found):
    """By draws of these, as the fit knows them."""
    _, result = found
    (proposal,) = result.proposals
    written, step = proposal.written, proposal.step
    samples = sorted(set(result.rows.states.sample.tolist()))
    with lent([effect_class(written)]):
        curve = unknown(
            proposal, result.rows, lambda names: build_model("continuum", {}, [written.name, *names], samples)
        )
    constants = written.constants()
    own = [list(step.fit.model.declared).index(f"{written.name}.{c.name}") for c in constants]
    covariance = parameter_covariance(step)[own][:, own].numpy()
    drawn = np.random.default_rng(0).multivariate_normal([c.start for c in constants], covariance, 400)
    names, at = [c.name for c in constants], torch.as_tensor(curve.at) / written.scales[0]
    values = []
    for each in drawn:
        known = dict(zip(names, each.tolist(), strict=True))
        shapes = {s.name: known[s.name] / scaled(s, written.scales[0]) for s in written.form.shapes}
        amounts = [known[c.name] for c in constants if c.amount]
        terms = written.form.values([at], shapes)
        values.append(sum(a * t for a, t in zip(amounts, terms, strict=True)).numpy())
    half = (curve.high - curve.low) / 2
    # 400 draws tell a deviation within a tenth.
    assert (half >= 0.85 * 1.96 * np.std(values, axis=0)).all()
    assert ((curve.low <= curve.free) & (curve.free <= curve.high)).all()


# --- searches ---------------------------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_where_nothing_is_missing_nothing_is_written():
    """Not even where it is asked for."""
    question = asked(measured(samples=(3,), states=30, seed=5).table, LIBRARY[:4])
    result = search(question)
    assert (result.verdict, result.effects, result.proposals) == ("adequate", [], [])
    prepared, fit, noise = prepare(question)
    known = explored(prepared, fit, noise)
    before = ended(prepared, known)
    with ExitStack() as stack:
        after = beyond(prepared, known, before, stack)
    assert after.answer.shown.effects == ()
    assert after.proposals == []


def test_what_the_library_explains_as_well_stays_the_librarys():
    hidden = {"wall_stiffening": {"C20": 3e5}}
    table = measured(effects=hidden, samples=(3,), states=30, seed=5).table
    result = search(asked(table, ["wall_stiffening", "force_offset", "pressure_gain"]))
    assert result.verdict == "named"
    assert result.effects == ["wall_stiffening"]
    assert result.proposals == []


@pytest.mark.nightly
def test_a_drift_is_the_librarys_though_a_written_function_of_time_has_a_constant_fewer():
    """Of a drift of the moment alone a written function of the time has one constant, and the library's drift two."""
    hidden = {"sensor_drift": {"force_rate": 0.0, "moment_rate": 6e-7}}
    question = asked(measured(effects=hidden, samples=(3,), states=30, seed=5).table, ["sensor_drift", "force_offset"])
    prepared, fit, noise = prepare(question)
    known = explored(prepared, fit, noise)
    before = ended(prepared, known)
    assert before.answer.shown.effects == ("sensor_drift",)
    with ExitStack() as stack:
        after = beyond(prepared, known, before, stack)
        assert after.answer.shown.effects == ("sensor_drift",)
        assert after.proposals == []


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("name", KINDS)
def test_each_kind_is_proposed_by_a_search(name):
    kind = KINDS[name]
    result = search(asked(measured(kind.extra, samples=(3, 6), seed=2).table, LIBRARY))
    assert result.verdict == "proposed"
    (proposal,) = result.proposals
    written = proposal.written
    assert is_the_kind(written, kind), written.name
    # Of forms that explain the rows alike either may stand first; the others are its twins.
    assert {written.form.family, *(t.family for t in proposal.twins)} & set(kind.families)
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
@pytest.mark.nightly
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
@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(6))
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
@pytest.mark.nightly
@pytest.mark.parametrize("case", range(6))
def test_nothing_is_written_where_the_library_has_it(case):
    """One of the library, or two."""
    result = search(asked(measured(effects=HIDDEN[case], seed=60 + case).table, LIBRARY, case))
    assert result.verdict in ("named", "class")
    assert result.proposals == []
    for name in HIDDEN[case]:
        assert any(name in members for members in result.classes)


def promised(table) -> float:
    """By the best form of one input, as a share of what the model leaves beside the noise."""
    prepared, fit, noise = prepare(asked(table, LIBRARY))
    whiten = noise.whitener()
    first = refitted(fit, prepared.rows, whiten)
    return promised_alone(prepared, first, whiten) / (first.chi2 - whiten.count)


def test_one_form_promises_all_of_what_is_one_thing_and_not_of_what_are_two():
    """So two effects are told from one that no library has, for which two may stand."""
    table = measured(samples=(3,), states=30).table
    bent = bent_gauge(table, ["pressure_kpa"], float(table["pressure_kpa"].max()), 0.08)
    assert promised(bent) > ALIKE
    assert promised(measured(effects=HIDDEN[4], samples=(3,), states=30).table) < ALIKE


def test_of_two_effects_for_which_no_form_does_nothing_is_written():
    prepared, fit, noise = prepare(asked(measured(effects=HIDDEN[5], samples=(3,), states=30).table, LIBRARY))
    known = explored(prepared, fit, noise)
    before = ended(prepared, known)
    assert len(before.answer.shown.effects) == SEVERAL
    assert not asked_beyond(prepared, known, before)


@pytest.mark.slow
@pytest.mark.nightly
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
    # Its constants give way to one another; what they make together is the same.
    assert other.final.E_train == pytest.approx(first.final.E_train, rel=0.02)
    assert other.final.E_heldout == pytest.approx(first.final.E_heldout, rel=0.1)


def bent_gauge(table, columns, top: float, share: float):
    """The table of a gauge that shows more, beyond four tenths of its range: what it shows is not what there is."""
    over = {c: table[c] + share * top * np.maximum(table[c] / top - 0.4, 0) for c in columns}
    return table.assign(**over)


@pytest.mark.slow
@pytest.mark.nightly
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
