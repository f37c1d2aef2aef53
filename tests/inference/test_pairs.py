"""Two effects that hide one another are found together; what stays unexplained ends with few."""

import numpy as np
import pytest
import torch
from linear_bed import NOISE, bench
from torch import Tensor

from freelearn.inference.derivatives import none_vector
from freelearn.inference.look_ahead import look_ahead, promising
from freelearn.inference.prepare import prepare
from freelearn.inference.rank import rank
from freelearn.inference.refit import refit, rewhitened
from freelearn.inference.score import EffectScore
from freelearn.inference.search import advance, search
from freelearn.inference.smallest import smallest
from freelearn.inference.thresholds import ALPHA, LEFT
from freelearn.inference.white_fit import white_fit
from freelearn.models.effects.registry import EFFECTS
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import MeasurementEffect

# How far the two signatures are from opposite.
TILT = 0.05
HOW = {"states": 30, "pressures": 4, "falling": 1}


class Size(Parameters):
    size: Tensor = parameter("s", "N", start=0.0, lower=-1e3, upper=1e3, none=0.0, scale=0.1)


def ripples(states):
    x = 6 * (states.length - states.reference_length) / 5e-3
    return torch.sin(x), torch.cos(x)


class Lift(MeasurementEffect[Size]):
    name = "lift"
    parameter_class = Size

    def sense(self, loads: Tensor, states, p: Size) -> Tensor:
        one, other = ripples(states)
        return loads + torch.stack([p.size * (one + TILT * other), 0 * one], dim=-1)


class Drop(MeasurementEffect[Size]):
    name = "drop"
    parameter_class = Size

    def sense(self, loads: Tensor, states, p: Size) -> Tensor:
        one, other = ripples(states)
        return loads + torch.stack([p.size * (TILT * other - one), 0 * one], dim=-1)


@pytest.fixture(autouse=True)
def known(monkeypatch):
    for effect in (Lift, Drop):
        monkeypatch.setitem(EFFECTS, effect.name, effect)


def hidden(size):
    """Both effects with the same size [N]: what shows is a twentieth of each, twice."""

    def extra(s, loads):
        return loads + np.stack([2 * size * TILT * ripples(s)[1].numpy(), np.zeros(len(loads))], axis=1)

    return extra


LIBRARY = ["lift", "drop", "force_offset", "friction_hysteresis"]


@pytest.mark.parametrize("seed", range(3))
def test_two_effects_that_cancel_are_found_together(seed):
    """3 N each, which leave 0.3 N; alone either takes a four-hundredth of what both take of χ²: 0.0025 × 300 / 2."""
    made = bench(seed, **HOW, extra=hidden(3.0))
    prepared, step = prepare(made.question(LIBRARY))
    assert step.left.p_value < LEFT
    tried, best = advance(prepared, step, 0)
    assert best is None
    assert all(c["p_value"] > ALPHA for c in tried.candidates)
    both = look_ahead(prepared, step)
    assert set(both.effects) == {"lift", "drop"}
    findings = search(made.question(LIBRARY))
    assert (findings.verdict, set(findings.effects)) == ("named", {"lift", "drop"})
    values = findings.final.fit.values()
    # Each is known as badly as the twentieth by which they differ lets it be.
    assert values["lift.size"] == pytest.approx(3.0, abs=0.5)
    assert values["lift.size"] - values["drop.size"] == pytest.approx(0, abs=4 * NOISE[0])


@pytest.mark.parametrize("seed", range(3))
def test_where_nothing_is_missing_no_pair_is_found(seed):
    prepared, step = prepare(bench(seed, **HOW).question(LIBRARY))
    assert look_ahead(prepared, step) is None


def test_of_three_effects_a_wrong_one_is_exchanged_for_two():
    """The model has an effect too many: the pair stands in its place, or beside it."""
    made = bench(1, **HOW, extra=hidden(3.0))
    prepared, step = prepare(made.question([*LIBRARY, "moment_offset"]))
    scores = rank(prepared, step, ["moment_offset"], step.left.scale)
    wrong = refit(prepared, step, scores)[0]["moment_offset"]
    both = look_ahead(prepared, rewhitened(prepared, wrong))
    assert {"lift", "drop"} <= set(both.effects)


def test_pairs_are_ranked_by_what_both_take_off_together():
    """Against all pairs solved by least squares, of signatures that lean on one another."""
    generator = np.random.default_rng(3)
    common = generator.normal(size=(200, 1))
    parts = {name: common + 0.5 * generator.normal(size=(200, 1)) for name in "abcd"}
    residual = parts["a"][:, 0] - parts["c"][:, 0] + 0.3 * generator.normal(size=200)

    def score(name):
        free = np.full(1, np.inf)
        return EffectScore(name, signature=torch.as_tensor(parts[name]), low=-free, high=free)

    pairs = promising([score(name) for name in parts], torch.as_tensor(residual), 1.0)

    def gain(one, other):
        columns = np.hstack([parts[one], parts[other]])
        return residual @ columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]

    expected = sorted(
        ((one, other) for i, one in enumerate(parts) for other in list(parts)[i + 1 :]), key=lambda p: -gain(*p)
    )
    assert [(one.effect, other.effect) for one, other in pairs] == expected
    assert expected[0] == ("a", "c")


def outside(size):
    """What no effect of the library does: a force and a moment that wave with length and with twist."""

    def extra(s, loads):
        x, y, p = (s.length - s.reference_length) / 5e-3, s.twist, s.pressure / 7e4
        waves = torch.stack([torch.sin(3 * x), torch.sin(3 * y) * p], dim=-1).numpy()
        return loads + size * NOISE * waves

    return extra


OWN = [name for name, effect in EFFECTS.items() if "own" in effect.families()]


@pytest.mark.parametrize("size", [3, 10, 30])
def test_what_is_not_in_the_library_does_not_end_in_a_pile_of_effects(size):
    for seed in range(2):
        findings = search(bench(seed, extra=outside(size)).question(OWN))
        # Two waves, each a product or less: the search may write both. Nothing of the library is one of them.
        assert findings.verdict in ("unexplained", "proposed")
        written = {proposal.written.name for proposal in findings.proposals}
        assert len(set(findings.effects) - written) <= 1


def with_effects(prepared, step, names):
    """The step's model with all of these, fitted from no effect."""
    model = prepared.question.build(names)
    fit = white_fit(model, prepared.rows, step.whiten, none_vector(model, step.fit))
    return rewhitened(prepared, prepared.step(list(names), fit, step.whiten))


def test_the_smallest_model_keeps_what_explains_much_and_nothing_else():
    def extra(s, loads):
        rubbed = loads - s.direction.numpy()[:, None] * 30 * NOISE
        return outside(10)(s, rubbed)

    names = ["friction_hysteresis", "moment_offset", "force_gain", "sensor_drift"]
    prepared, first = prepare(bench(2, extra=extra).question(names))
    pile = with_effects(prepared, first, names)
    kept = smallest(prepared, pile)
    assert kept.effects == ["friction_hysteresis"]
    # The pile was no better by anything that matters beside the waves; friction takes more than what they leave.
    left = kept.heldout.loss.sum() - 2 * len(kept.states)
    assert left > 0
    assert kept.heldout.loss.sum() - pile.heldout.loss.sum() < left / 2
    assert first.heldout.loss.sum() - kept.heldout.loss.sum() > left / 2
    assert kept.E_heldout < 1.1 * pile.E_heldout < 0.5 * first.E_heldout
    assert kept.fit.converged
    # What is as small as it can be stays the very same.
    assert smallest(prepared, kept) is kept
    assert smallest(prepared, first) is first
