"""Whatever unit a parameter is counted in, as much is known of it, and as much is promised on top of it."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from first_step import first_step
from hypothesis import given
from hypothesis import strategies as st
from linear_bed import SHORT, bench
from torch import Tensor

from freelearn.discovery.fits.prepare import prepare
from freelearn.discovery.referee.case import Case
from freelearn.discovery.search.hypotheses import Hypotheses, needed
from freelearn.physics.chain.parameters import Parameters, parameter
from freelearn.physics.chain.ports import MeasurementEffect
from freelearn.physics.chain.priors import RawPrior
from freelearn.physics.effects.registry import EFFECTS

# Of one newton: so many stand for it where a parameter is counted in small units, as a stiffness is in pascals.
SMALL = 1e8
COUNTED = ["spring", "small_spring"]


def stretched(states) -> Tensor:
    """In units of 5 mm: about one."""
    return (states.length - states.reference_length) / 5e-3


class InNewtons(Parameters):
    size: Tensor = parameter("s", "N", start=0.0, lower=-1e3, upper=1e3, none=0.0, scale=1.0)


class InSmallUnits(Parameters):
    size: Tensor = parameter("s", "10 nN", start=0.0, lower=-1e3 * SMALL, upper=1e3 * SMALL, none=0.0, scale=SMALL)


class Spring(MeasurementEffect[InNewtons]):
    name, unit = "spring", 1.0
    parameter_class = InNewtons

    def sense(self, loads: Tensor, states, p) -> Tensor:
        return loads + torch.stack([p.size / self.unit * stretched(states).pow(3), 0 * states.length], dim=-1)


class SmallSpring(Spring):
    name, unit = "small_spring", SMALL
    parameter_class = InSmallUnits


class Softening(MeasurementEffect[InNewtons]):
    """Much as the spring, but for a part that is not: what is promised for it hangs on how far that gives way."""

    name = "softening"
    parameter_class = InNewtons

    def sense(self, loads: Tensor, states, p: InNewtons) -> Tensor:
        x = stretched(states)
        return loads + torch.stack([p.size * (x.pow(3) + 0.1 * torch.sin(6 * x)), 0 * x], dim=-1)


@pytest.fixture(autouse=True)
def known(monkeypatch):
    for effect in (Spring, SmallSpring, Softening):
        monkeypatch.setitem(EFFECTS, effect.name, effect)


@pytest.fixture(scope="module")
def base():
    """A model's fit without anything missing."""
    return first_step(bench(3, **SHORT).question())[1].fit


def hidden(states, loads):
    x = stretched(states).numpy()
    return loads + np.stack([2 * x**3 + 0.5 * (x**3 + 0.1 * np.sin(6 * x)), 0 * x], axis=1)


def sets_with(name: str):
    """A search's sets and the one with an effect alone."""
    question = bench(3, extra=hidden).question([name, "softening", "force_offset"])
    prepared, fit, noise = prepare(question)
    sets = Hypotheses(question, prepared.rows, noise.whitener(), prepared.spans)
    nothing = sets.fit((), fit.vector, fit)
    return sets, sets.joined(nothing, name)


def test_what_is_promised_does_not_hang_on_a_unit():
    one, other = ({p.effect: p for p in sets.rank(made).promises()} for sets, made in map(sets_with, COUNTED))
    assert one["softening"].chi2 > 1.0
    for name in ("softening", "force_offset"):
        assert other[name].chi2 == pytest.approx(one[name].chi2, rel=1e-3)
        assert other[name].evidence == pytest.approx(one[name].evidence, abs=0.02)


def test_that_an_effect_is_needed_does_not_hang_on_a_unit():
    """An offset that is nearly none, on top of a spring that the rows need."""
    for name in COUNTED:
        sets, made = sets_with(name)
        both = sets.joined(made, "force_offset")
        assert needed(both, name)
        assert not needed(both, "force_offset")


def test_what_the_referee_takes_for_known_does_not_hang_on_a_unit():
    told = []
    for name in COUNTED:
        question = bench(3, extra=hidden).question([name])
        prepared, step = first_step(question)
        made = sets_with(name)[1]
        case = Case(made.fit, step.fit, prepared.rows, step.whiten, prepared.scale, question.accuracy, prepared.fold)
        some = torch.arange(len(prepared.rows)) % 3 > 0
        by, covariance = made.fit.raw_jacobian, case.covariance_from(some)
        told.append(torch.einsum("ncp,pq,ncq->nc", by, covariance, by))
    torch.testing.assert_close(told[1], told[0], rtol=1e-2, atol=0)


@given(st.integers(0, 1000), st.lists(st.floats(-7, 7), min_size=3, max_size=3))
def test_a_covariance_is_the_textbooks_whatever_the_units(base, seed, decades):
    """(JᵀJ + Σ⁻¹)⁻¹ by NumPy at units of one, moved to others."""
    generator = np.random.default_rng(seed)
    jacobian, deviation = generator.normal(size=(12, 2, 3)), generator.uniform(0.5, 2, 3)
    flat = jacobian[4:].reshape(-1, 3)
    expected = np.linalg.inv(0.7 * flat.T @ flat + np.diag(deviation**-2.0))
    unit = 10.0 ** np.array(decades)
    prior = RawPrior(torch.zeros(3, dtype=torch.float64), torch.as_tensor(np.diag((deviation * unit) ** 2)))
    fit = replace(base, jacobian=torch.as_tensor(jacobian / unit), prior=prior)
    rows = torch.arange(12) >= 4
    np.testing.assert_allclose(fit.covariance(rows, 0.7).numpy() / unit / unit[:, None], expected, rtol=1e-9)


def test_a_row_without_an_answer_tells_nothing(base):
    jacobian = base.jacobian.clone()
    jacobian[2] = torch.nan
    others = torch.arange(len(jacobian)) != 2
    blank = replace(base, jacobian=jacobian)
    torch.testing.assert_close(blank.covariance(), base.covariance(others))
