"""A written effect as plain values, as sentences and as a file of its own, from fits that were made by hand."""

import ast
import re

import numpy as np
import pytest
import torch
from first_step import first_step
from outside_tables import asked, measured
from written_samples import PLACE

from freelearn.discovery.fits.white_fit import white_fit
from freelearn.discovery.proposals.proposal import Guess, Proposal, Twin
from freelearn.discovery.proposals.scan import price
from freelearn.physics.effects.registry import EFFECTS, lent
from freelearn.physics.written.forms import ONE
from freelearn.physics.written.source import effect_class
from freelearn.physics.written.written_effect import Written
from freelearn.records.written_effects import (
    constants_told,
    file_of,
    proposal_entry,
    proposal_lines,
    proposal_source,
    units_told,
    write_proposals,
)

# N beyond the knee, in units of 5 mm; and the knee in m.
AMOUNT, KNEE, SCALE, FLOOR = 3.0, 1e-3, 5e-3, 0.004
TWIN = Twin("boundary", "length", ["elongation"], "hinge", "Δl = a max(Δl − Δl₀, 0)", 0.0123)
SAME = Twin("measurement", "force", ["elongation"], "hinge", "ΔF = a max(Δl − Δl₀, 0)", None)


def cable(s, loads):
    """A cable beside the tube that pulls once stretched past its slack."""
    over = np.maximum(s["length"] - s["reference"] - KNEE, 0) / SCALE
    return loads + np.stack([AMOUNT * over, 0 * over], axis=1)


@pytest.fixture(scope="module")
def proposal():
    before = dict(EFFECTS)
    prepared, first = first_step(asked(measured(cable, samples=(3,), states=30, seed=8).table))
    place = PLACE["parallel axial"]
    (elongation,) = [i for i in place.inputs if i.name == "elongation"]
    hinge = next(form for form in ONE if form.word == "hinge")
    written = Written(place, (elongation,), (SCALE,), hinge, {"amount": 1.0, "knee": 5e-4})
    kind = effect_class(written)
    with lent([kind]):
        model = prepared.question.build([kind.name])
        known = dict(zip(first.fit.model.labels(), first.fit.vector, strict=True))
        own = zip(model.labels(), model.vector().detach(), strict=True)
        start = torch.stack([known.get(label, value) for label, value in own])
        fit = white_fit(model, prepared.rows, first.whiten, start)
        step = prepared.step(fit, first.whiten)
    assert step.fit.proper
    assert before == EFFECTS
    values = step.fit.values()
    written = written.started({c.name: values[f"{kind.name}.{c.name}"] for c in written.constants()})
    guess = Guess(place, (elongation,), hinge, 400.0, 380.0, (SCALE,), (1.0,), {"knee": 0.1}, 0.005)
    return Proposal(written, first, step, [SAME, TWIN], [guess], ("wall_stiffening", 0.42))


def test_what_was_hidden_is_fitted_and_its_errors_hold_it(proposal):
    entry = proposal_entry(proposal, FLOOR)
    for name, true in (("amount", AMOUNT), ("knee", KNEE)):
        told = entry["parameters"][name]
        assert 0 < told["stderr"] < 0.3 * true
        assert abs(told["value"] - true) < 4 * told["stderr"]
    assert (entry["parameters"]["amount"]["unit"], entry["parameters"]["knee"]["unit"]) == ("N", "m")
    assert entry["in_units_of"] == {"elongation": {"value": SCALE, "unit": "m"}}
    assert entry["error"] == {
        "before": proposal.base.E_heldout,
        "after": proposal.step.E_heldout,
        "noise_floor": FLOOR,
    }
    assert (entry["port"], entry["where"], entry["inputs"], entry["form"]) == (
        "parallel",
        "axial",
        ["elongation"],
        "hinge",
    )
    assert [t["E_heldout"] for t in entry["twins"]] == [None, 0.0123]
    # What a place promised is told in σ: the root of the reduction of χ².
    (place,) = entry["places"]
    assert (place["port"], place["where"], place["inputs"]) == ("parallel", "axial", ["elongation"])
    assert place["sigmas"] == 20.0
    assert place["p_value"] == 0.005
    assert entry["resembles"] == {"effect": "wall_stiffening", "share": 0.42}
    assert entry["file"] == file_of(proposal) == f"proposed_{entry['name']}.py"


def test_constants_are_told_in_the_units_of_tables(proposal):
    """mm and N, each with its error."""
    amount, knee = constants_told(proposal_entry(proposal, FLOOR), proposal.written)
    number = r"(-?[\d.]+(?:e[+-]?\d+)?)"
    found = re.fullmatch(rf"a = {number} ± {number} N", amount)
    assert found
    values = {c.name: c.start for c in proposal.written.constants()}
    assert float(found[1]) == pytest.approx(values["amount"], rel=1e-3)
    found = re.fullmatch(rf"Δl₀ = {number} ± {number} mm", knee)
    assert found
    assert float(found[1]) == pytest.approx(1e3 * values["knee"], rel=1e-3)
    assert units_told(proposal.written) == "Δl in units of 5 mm"


def test_the_sentences_name_place_inputs_errors_twins_and_what_it_resembles(proposal):
    told = "\n".join(proposal_lines(proposal_entry(proposal, FLOOR), proposal.written))
    assert proposal.written.formula == "ΔF = a max(Δl − Δl₀, 0)"
    for part in (
        proposal.written.name,
        "force of an element beside the actuator",
        "depends on the elongation",
        proposal.written.formula,
        f"{100 * proposal.base.E_heldout:.3g}",
        f"{100 * proposal.step.E_heldout:.3g}",
        "0.4",
        "somewhere is 0.5 % at most",
        "at the port measurement (force) the same function would show the very same loads",
        "the data cannot tell it from boundary (length): Δl = a max(Δl − Δl₀, 0)",
        "wall_stiffening",
        "42 %",
    ):
        assert part in told, part


def test_the_file_tells_the_same_and_is_whole(proposal, tmp_path):
    write_proposals([proposal], "continuum", FLOOR, tmp_path)
    (path,) = tmp_path.iterdir()
    assert path.name == file_of(proposal)
    text = path.read_text(encoding="utf-8")
    assert text == proposal_source(proposal, "continuum", FLOOR)
    tree = ast.parse(text)
    docstring = " ".join(ast.get_docstring(tree).split())
    for share in (proposal.base.E_heldout, proposal.step.E_heldout):
        assert f"{100 * share:.3g} %".replace(" %", "") in docstring
    assert all(c in docstring for c in constants_told(proposal_entry(proposal, FLOOR), proposal.written))
    assert f"FREELEARN_EFFECTS={path.name} python train.py model=continuum" in docstring
    assert max(map(len, text.splitlines())) <= 120
    # What begins a fit is what was found, to the last digit.
    numbers = {
        node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, float)
    }
    assert {abs(c.start) for c in proposal.written.constants()} <= numbers


def test_the_friction_of_a_direction_says_so():
    place = PLACE["dissipation force"]
    (pressure,) = [i for i in place.inputs if i.name == "pressure"]
    cube = next(form for form in ONE if form.word == "cube")
    written = Written(place, (pressure,), (7e4,), cube, {"amount": 0.1})
    assert units_told(written) == "P in units of 70 kPa"
    assert written.inputs_named == ["direction", "pressure"]


def test_a_constant_more_costs_what_schwarz_says_and_a_second_input_more_than_that():
    for readings in (100, 1000):
        assert price(2, 1, readings) - price(1, 1, readings) == pytest.approx(np.log(readings))
        assert price(2, 2, readings) - price(2, 1, readings) > np.log(readings)
