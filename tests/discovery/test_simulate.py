"""Wrong how often, and what could have been seen at all: against tables of known truth."""

import numpy as np
import pytest
import torch
from linear_bed import NOISE, SHORT, TRUE, bench, predicted

from freelearn.discovery.fits.prepare import prepare
from freelearn.discovery.search.hypotheses import Hypotheses
from freelearn.discovery.search.simulated_searches import Searched, searched, simulated, tally
from freelearn.discovery.search.stability import visible

LIBRARY = ["force_offset", "friction_hysteresis"]


def table(number, hidden, verdict, classes):
    return Searched(number, hidden, verdict, [c[0] for c in classes], classes)


def test_the_tally_counts_what_is_claimed_and_nothing_else():
    tables = [
        table(0, ["a"], "named", [["a"]]),
        table(1, ["a"], "class", [["b", "a"]]),
        table(2, ["a"], "named", [["a"], ["c"]]),  # c is wrong
        table(3, [], "named", [["c"]]),  # wrong
        table(4, ["a"], "unexplained", [["c"]]),  # claims nothing
        table(5, [], "adequate", []),
    ]
    told = tally(tables)
    assert (told["wrong"]["count"], told["wrong"]["of"]) == (2, 6)
    assert (told["found"]["a"]["count"], told["found"]["a"]["of"]) == (3, 4)
    # Clopper & Pearson's limits of 2 in 6, as tabulated.
    assert told["wrong"]["low"] == pytest.approx(0.0433, abs=1e-3)
    assert told["wrong"]["high"] == pytest.approx(0.7772, abs=1e-3)


def test_simulated_rows_scatter_about_the_model_as_the_rows_did():
    made = bench(3, **SHORT)
    prepared, fit, noise = prepare(made.question())
    rows, whiten = prepared.rows, noise.whitener()
    some = simulated(fit, rows, whiten, 1)
    assert torch.equal(some.loads, simulated(fit, rows, whiten, 1).loads)
    assert not torch.equal(some.loads, simulated(fit, rows, whiten, 2).loads)
    off = torch.cat([whiten(simulated(fit, rows, whiten, seed).loads - fit.shown) for seed in range(20)])
    assert float(off.square().mean()) == pytest.approx(1.0, abs=4 * np.sqrt(2 / off.numel()))


def test_of_tables_simulated_from_a_model_its_effect_is_found_and_no_other():
    def rubbed(states, loads):
        return loads - states.direction.numpy()[:, None] * 10 * NOISE

    question = bench(2, **SHORT, extra=rubbed).question(LIBRARY)
    prepared, fit, noise = prepare(question)
    sets = Hypotheses(question, prepared.rows, noise.whitener(), prepared.spans)
    sets.fit((), fit.vector, fit)
    best = sets.explore()
    assert best.effects == ("friction_hysteresis",)
    whiten = prepared.noise(best.fit, noise.scatter).whitener()
    with_it = searched(question, best.fit, whiten, best.effects, 5)
    assert (with_it.verdict, with_it.found, with_it.wrong) == ("named", ["friction_hysteresis"], False)
    nothing = sets.found[frozenset()].fit
    without = searched(question, nothing, whiten, [], 6)
    assert (without.verdict, without.wrong) == ("adequate", False)


@pytest.mark.nightly
def test_an_offset_of_the_size_that_could_be_seen_is_found_and_a_third_of_it_is_not():
    question = bench(4, **SHORT).question(LIBRARY)
    prepared, fit, noise = prepare(question)
    sets = Hypotheses(question, prepared.rows, noise.whitener(), prepared.spans)
    sets.fit((), fit.vector, fit)
    size = visible(sets.rank(sets.found[frozenset()]))["force_offset"]["force"]
    assert 0 < size < 10 * NOISE[0]

    def found(share, seed):
        made = bench(seed, **SHORT, extra=lambda s, loads: loads + np.array([share * size, 0.0]))
        prepared, fit, noise = prepare(made.question(LIBRARY))
        sets = Hypotheses(made.question(LIBRARY), prepared.rows, noise.whitener(), prepared.spans)
        sets.fit((), fit.vector, fit)
        return "force_offset" in sets.explore().effects

    assert sum(found(1.2, seed) for seed in range(10, 16)) >= 4
    assert sum(found(1 / 3, seed) for seed in range(10, 16)) <= 1
    assert float(predicted(prepared.rows.states).abs().max()) > TRUE[2]
