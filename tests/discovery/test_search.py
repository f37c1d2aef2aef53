"""The search: what is given, what may be exchanged, and when a fit counts."""

import dataclasses

import numpy as np
import pytest
import torch
from first_step import first_step
from hidden_tables import table

from freelearn.data.accuracy import PAPER
from freelearn.data.rows import Rows
from freelearn.discovery.fits import white_fit as white_fit_module
from freelearn.discovery.fits.derivatives import none_vector
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.fits.white_fit import WhiteProblem, _ended, _slow, promise, white_fit
from freelearn.discovery.search.search import search
from freelearn.fitting.solver import Termination
from freelearn.physics.models.build import build_model

FRICTION = {"friction_hysteresis": {"force": 0.6, "moment": 0.02}}
LIBRARY = ["friction_hysteresis", "force_offset", "moment_offset", "pressure_offset"]


def question(effects, given=(), candidates=LIBRARY, share=0.2) -> Question:
    data = table(effects, share=share)
    rows = Rows.from_table(data)
    rows = rows[torch.as_tensor(np.flatnonzero(data["buckled"] == 0))]
    left = [name for name in candidates if name not in given]
    return Question(lambda names: build_model("continuum", {}, names, [3, 6]), left, rows, PAPER, 0, given)


def test_what_is_given_is_not_missing():
    found = search(question(FRICTION, given=("friction_hysteresis",)))
    assert (found.verdict, found.effects, found.classes) == ("adequate", [], [])
    assert found.steps[0].effects == ["friction_hysteresis"]


@pytest.mark.nightly
def test_what_is_given_is_kept_even_where_it_does_nothing():
    # There is no force offset: an added one would be taken out again, or exchanged.
    found = search(question(FRICTION, given=("force_offset",)))
    assert (found.verdict, found.effects) == ("named", ["friction_hysteresis"])
    assert [list(members) for members in found.classes] == [["friction_hysteresis"]]
    assert all("force_offset" in step.effects for step in found.steps)
    assert found.steps[0].effects == ["force_offset"]
    offsets = [value for name, value in found.final.fit.values().items() if name.startswith("force_offset.force[")]
    assert offsets == pytest.approx([0.0, 0.0], abs=0.1)
    # The candidates of the first step are the first, whatever was given.
    assert {c["step"] for c in found.steps[0].candidates} == {0}


@pytest.mark.nightly
def test_the_given_effects_are_no_rivals_of_what_is_added():
    asked = question(FRICTION, given=("force_offset", "moment_offset"))
    found = search(asked)
    assert all(not set(members) & set(asked.given) for members in found.classes)


def test_what_was_found_cannot_be_changed():
    prepared, base = first_step(question(FRICTION))
    for frozen, name in ((base, "E_heldout"), (prepared, "fold"), (prepared.question, "seed")):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(frozen, name, None)
    left = base.left
    assert base.tried([{}]).left is left


@pytest.fixture(scope="module")
def optimum():
    asked = question(FRICTION, share=0.1)
    prepared, base = first_step(asked)
    return asked, prepared, base


def test_a_fit_cut_short_is_not_at_a_minimum(optimum, monkeypatch):
    asked, prepared, base = optimum
    start = base.fit.vector + torch.tensor([1.0, -1.0], dtype=torch.float64)
    assert white_fit(asked.build([]), prepared.rows, base.whiten, start).converged
    monkeypatch.setattr(white_fit_module, "MAX_ITERATIONS", 1)
    assert not white_fit(asked.build([]), prepared.rows, base.whiten, start).converged
    # At the minimum no step is needed.
    assert white_fit(asked.build([]), prepared.rows, base.whiten, base.fit.vector).converged


@pytest.mark.parametrize("status", [Termination.NO_PROGRESS, Termination.MAX_ITERATIONS])
def test_without_progress_only_a_minimum_counts(optimum, status):
    asked, prepared, base = optimum
    problem = WhiteProblem(asked.build([]), prepared.rows, base.whiten, base.fit.prior)
    assert _ended(problem, base.fit.vector, status, "stopped").converged
    assert not _ended(problem, base.fit.vector + 0.1, status, "stopped").converged


def test_the_promise_of_a_linear_problem_is_what_solving_it_gains():
    generator = torch.Generator().manual_seed(5)
    jacobian = torch.randn(30, 3, dtype=torch.float64, generator=generator)
    residual = torch.randn(30, dtype=torch.float64, generator=generator)
    zero, free = torch.zeros(3, dtype=torch.float64), torch.full((3,), torch.inf, dtype=torch.float64)
    best = residual - jacobian @ torch.linalg.lstsq(jacobian, residual[:, None]).solution[:, 0]
    gain = float(residual.square().sum() - best.square().sum())
    assert promise(residual, jacobian, zero, -free, free) == pytest.approx(gain)
    # On bounds that descent points out of, nothing is promised.
    side = (jacobian.T @ residual).sign()
    low, high = torch.where(side > 0, zero, -free), torch.where(side < 0, zero, free)
    assert promise(residual, jacobian, zero, low, high) == 0.0


def test_a_fit_that_cannot_come_near_a_rival_ends_early_and_is_far_behind(optimum):
    asked, prepared, base = optimum
    start = base.fit.vector + torch.tensor([3.0, -3.0], dtype=torch.float64)
    friction = white_fit(
        asked.build(["friction_hysteresis"]), prepared.rows, base.whiten,
        none_vector(asked.build(["friction_hysteresis"]), base.fit),
    )  # fmt: skip
    assert friction.chi2 < 0.5 * base.fit.chi2
    ended_early = white_fit(asked.build([]), prepared.rows, base.whiten, start, rival=friction.chi2)
    assert ended_early.message.startswith("Ended: another model fits far better")
    whole = white_fit(asked.build([]), prepared.rows, base.whiten, start)
    assert friction.chi2 < whole.chi2 <= ended_early.chi2


def test_a_search_whose_steps_bring_too_little_to_come_near_a_rival_is_slow():
    stuck = [3.7e5, 3.01e5, 3.0e5, 2.99e5, 2.985e5, 2.98e5, 2.97e5]
    assert _slow(stuck, rival=640.0)
    # A tenth of it again and again is enough, and so is a rival that is near.
    assert not _slow([3.7e5 * 0.9**k for k in range(6)], rival=640.0)
    assert not _slow(stuck, rival=2.96e5)
