"""Tables of few states, and the forward selection that the search is put beside: experiments/ that others rely on."""

import importlib
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from freelearn.discovery.fits.prepare import prepare

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"


@pytest.fixture
def module(monkeypatch):
    monkeypatch.syspath_prepend(str(EXPERIMENTS))
    return importlib.import_module


@pytest.fixture
def muscle(module):
    """A muscle with one large effect, and its truth."""
    few = module("hidden_effects.few")
    job = {"tubes": "muscle", "kind": "one", "hidden": ["fiber_misalignment"], "unknown": "", "states": 5, "seed": 7}
    return few.make(job | {"misstated": 1.0})


def result(**said):
    plain = {"number": 0, "kind": "none", "tubes": "muscle", "states": 5, "misstated": 1.0, "unknown": "", "hidden": []}
    return plain | {
        "values": {}, "sizes": {}, "alone": {}, "verdict": "adequate", "effects": [], "classes": [], "formulas": [],
        "stopped": [], "fresh": 1.0, "fresh_together": 1.0, "banded": [0.9, 1.5], "seconds": 1.0, "ahead": None,
    } | said  # fmt: skip


def test_each_quarter_hides_what_its_kind_says(module):
    jobs = module("hidden_effects.few").few(1)
    kinds = [job["kind"] for job in jobs]
    assert all(kinds.count(kind) == 6 for kind in ("none", "one", "unknown", "several"))
    counts = {"none": {0}, "one": {1}, "unknown": {0}, "several": {3, 4}}
    assert all(len(job["hidden"]) in counts[job["kind"]] for job in jobs)
    assert all(bool(job["unknown"]) == (job["kind"] == "unknown") for job in jobs)


def test_the_true_model_is_at_the_floor_between_the_states_and_one_without_the_effect_is_not(module, muscle):
    examined = module("hidden_effects.examine_few")
    plain, whole = examined.build([]), examined.build(["fiber_misalignment"])
    values = dict(zip(("C1", "C2"), muscle.material, strict=True))
    plain.set_values(values)
    whole.set_values(values | {f"fiber_misalignment.{n}": v for n, v in muscle.hidden["fiber_misalignment"].items()})
    assert examined.fresh(whole, muscle) < 1.1
    assert examined.fresh(plain, muscle) > 2
    # Together, as good on states left out, and with most of the probability on the true one, they are between.
    question = SimpleNamespace(
        candidates=["fiber_misalignment"], given=[], build=examined.build, rows=examined.between(muscle)
    )
    told = [
        SimpleNamespace(effects=effects, parameters=model.scalars(), probability=share, E_heldout=0.01)
        for effects, model, share in (([], plain, 0.2), (["fiber_misalignment"], whole, 0.8))
    ]
    found = SimpleNamespace(models=told, final=SimpleNamespace(fit=SimpleNamespace(model=plain)))
    together = examined.fresh_together(found, question, muscle)
    assert examined.fresh(whole, muscle) < together < examined.fresh(plain, muscle)
    # A fifth of what the plain one misses, the true one missing nothing: squares add to those of the noise, which is 1.
    assert together**2 - 1 == pytest.approx(0.2**2 * (examined.fresh(plain, muscle) ** 2 - 1), rel=0.5)
    sizes, alone = examined.sizes(muscle)
    assert sizes["fiber_misalignment"] > 15
    # Nothing else is hidden that could stand in for it.
    assert alone == sizes


def test_what_another_hidden_effect_does_as_well_is_not_one_s_own(module, muscle):
    examined = module("hidden_effects.examine_few")
    twice = replace(muscle, without=muscle.without | {"twin": muscle.without["fiber_misalignment"]})
    sizes, alone = examined.sizes(twice)
    assert sizes["twin"] == sizes["fiber_misalignment"] > 15
    assert max(alone.values()) < 1e-6


def test_what_was_hidden_is_ahead_of_answers_that_lack_it_alone(module, muscle):
    examined, measured = module("hidden_effects.examine_few"), module("hidden_effects.ahead")
    seen = examined.as_read(muscle.table, muscle.bed)
    question = replace(examined.asked(seen, muscle.told, 0), candidates=["fiber_misalignment", "force_offset"])
    prepared, fit, noise = prepare(question)
    last = SimpleNamespace(fit=fit, whiten=noise.whitener())

    def ahead(*told, made=muscle):
        models = [SimpleNamespace(effects=effects, parameters={}) for effects in told]
        return measured.ahead(SimpleNamespace(models=models, final=last, rows=prepared.rows), question, made)

    # Half the square of 15 σ and more, less what one parameter costs.
    assert ahead([]) == ahead() > 100
    assert ahead([], ["fiber_misalignment"]) == pytest.approx(0, abs=0.01)
    # The true set still has an effect less than this one.
    assert ahead(["fiber_misalignment", "force_offset"]) > 0
    assert ahead([], made=replace(muscle, hidden={})) is None
    assert ahead([], made=replace(muscle, hidden={"end_clamps": {"clamp_length": 1e-3}})) is None


def test_a_search_that_takes_too_long_is_a_result_too(module, monkeypatch):
    examined, few = module("hidden_effects.examine_few"), module("hidden_effects.few")
    monkeypatch.setattr(examined, "LIMIT", 1)
    monkeypatch.setattr(examined, "search", lambda question: time.sleep(30))
    told = examined.examine_few(few.few(1)[1])
    assert told["verdict"] == "failed"
    assert told["reason"] == "TimeoutError: no answer in 1 s"


def test_what_is_claimed_is_counted_and_what_is_only_listed_is_not(module):
    report = module("hidden_effects.report_few")
    several = {"kind": "several", "hidden": ["end_clamps", "force_gain", "wall_thickness"],
               "alone": {"end_clamps": 20.0, "force_gain": 30.0, "wall_thickness": 2.0}}  # fmt: skip
    rows = {
        what: (count, value)
        for what, count, value, _ in report.rates(
            report.told([
                result(),
                result(verdict="named", effects=["end_taper"], classes=[["end_taper"]], fresh=2.5),
                result(kind="one", hidden=["end_clamps"], sizes={"end_clamps": 40.0}, verdict="class",
                       effects=["end_taper"], classes=[["end_taper", "end_clamps"]]),
                result(**several, verdict="named", effects=["end_clamps"], classes=[["end_clamps"], ["end_taper"]],
                       ahead=4.0),
                result(**several, verdict="unexplained", effects=["force_gain"], classes=[["force_gain"]], fresh=9.0),
                result(kind="unknown", unknown="cell_bends", verdict="failed", fresh=None, banded=None),
            ])
        )
    }  # fmt: skip
    assert rows["nothing hidden: nothing named"] == (2, "50.0")
    assert rows["one effect, ≥ 15 σ, ≥ 5 states: in the answer"] == (1, "100.0")
    assert rows["three or four: effects in the answer"] == (6, "16.7")
    assert rows["three or four: effects listed, claimed or not"] == (6, "33.3")
    assert rows["three or four: what was hidden is more probable than all that is told (odds of 20 to 1)"] == (
        1,
        "100.0",
    )
    own = "… that the others cannot stand in for by"
    assert rows[f"{own} ≥ 15 σ: in the answer"] == (4, "25.0")
    assert rows[f"{own} 0 to 4 σ: in the answer"] == (2, "0.0")
    assert rows["three or four: tables with nothing wrong named"] == (2, "50.0")
    assert rows["claims that states in between refute (> 2 floors)"] == (4, "25.0")
    assert rows["effects kept where unexplained: median, most (not %)"] == (1, "1, 1")
    # Of the one without an answer nothing.
    assert rows["a new measurement in between within the bands: mean, median"] == (5, "90.0, 90.0")
    assert rows["… their σ over what is missed: median (not %)"] == (
        5,
        "1.50",
    )


def test_the_report_is_printed_and_written(module, tmp_path, capsys):
    hidden = {"hidden": ["end_clamps"], "sizes": {"end_clamps": 40.0}, "verdict": "class", "effects": ["end_taper"]}
    results = [result(), result(kind="one", **hidden, classes=[["end_taper", "end_clamps"]])]
    module("hidden_effects.report_few").report_few(results, tmp_path)
    assert "end_clamps 40 σ → class: end_taper/end_clamps" in capsys.readouterr().out
    assert "| one effect, ≥ 15 σ, ≥ 5 states: in the answer | 1 | 100.0 | ≥ 80 |" in (tmp_path / "rates.md").read_text()
    assert "end_taper/end_clamps" in (tmp_path / "tables.csv").read_text()


def test_the_forward_selection_finds_the_one_effect_and_fits_it(module, muscle):
    peer, examined = module("benchmark.peer"), module("hidden_effects.examine_few")
    rows = examined.Rows.from_table(examined.as_read(muscle.table, muscle.bed))
    found = peer.selected(examined.build, rows, ["force_offset", "fiber_misalignment"])
    assert found.effects[0] == "fiber_misalignment"
    plain = peer.refitted(peer.fitted(examined.build, rows, []), rows)
    assert found.left_out < 0.5 * plain.left_out
    assert torch.allclose(found.model.vector().detach(), torch.as_tensor(found.x))


def test_one_state_is_left_out_in_six_parts(module):
    peer = module("benchmark.peer")

    one, many = (SimpleNamespace(state=state) for state in (np.zeros(20), np.repeat(np.arange(30), 2)))
    assert len(np.unique(peer.parts_of(one))) == 6
    part = peer.parts_of(many)
    assert len(np.unique(part)) == 6
    assert (part[::2] == part[1::2]).all()
