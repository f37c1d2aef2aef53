"""A fit begins its searches for an equilibrium where the last one ended, and finds the same."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from test_hang import hung, made

from freelearn.data.rows import Readings, Rows
from freelearn.data.states import States
from freelearn.data.warm_start import Near
from freelearn.fitting.problem import Problem
from freelearn.physics.chain import dead_load as hang_module
from freelearn.physics.chain import mount as mount_module
from freelearn.physics.mechanics import equilibrium
from freelearn.physics.models.build import build_model
from freelearn.testing.effects import TRUTH, labels_of
from freelearn.testing.small_tables import random_table, recordings

COUNT = 12


def rows_of(states: States) -> Rows:
    return Rows(states, Readings.whole(torch.zeros(len(states), 2, dtype=torch.float64)), np.arange(len(states)))


def hanging():
    return made(), hung(made(), States.from_table(random_table(COUNT, 4)))


def yielding():
    return made(effects=("length_compliance", "twist_compliance")), States.from_table(random_table(COUNT, 4))


CASES = {"dead load": (hanging, hang_module), "mount": (yielding, mount_module)}


@pytest.mark.parametrize("name", CASES)
def test_a_step_on_finds_what_a_fresh_search_finds(name, monkeypatch):
    build, module = CASES[name]
    model, states = build()
    problem = Problem(model, rows_of(states))
    start = model.vector().detach()
    problem.jacobians(start[None])
    moved = 1.001 * start
    calls = []
    real = module.rows_jacobian
    monkeypatch.setattr(module, "rows_jacobian", lambda *a: calls.append(1) or real(*a))
    with torch.no_grad():
        warm = problem.residual(moved)
    warmed = len(calls)
    with torch.no_grad():
        cold = Problem(model, rows_of(states)).residual(moved)
    torch.testing.assert_close(warm, cold, rtol=1e-9, atol=1e-12)
    assert warmed < len(calls) - warmed


@pytest.mark.parametrize("some", [None, slice(3, 40)], ids=["all rows", "some rows"])
def test_a_log_too_goes_on_from_where_its_samples_ended(some, monkeypatch):
    """All samples of its recordings, between its rows too; a step that was tried gives its derivatives the way."""
    values = TRUTH["continuum"] | labels_of("length_compliance", "scale") | labels_of("creep", "scale")
    model, rows = build_model("continuum", values, ["length_compliance", "creep"]), Rows.from_table(recordings())
    rows = rows if some is None else rows[some]
    problem = Problem(model, rows)
    start = model.vector().detach()[None]
    problem.jacobians(start)
    moved = 1.001 * start
    calls = []
    real = mount_module.rows_jacobian
    monkeypatch.setattr(mount_module, "rows_jacobian", lambda *a: calls.append(1) or real(*a))

    def counted(ask):
        calls.clear()
        return ask(), len(calls)

    warm, fewer = counted(lambda: problem.tried(moved))
    cold, more = counted(lambda: Problem(model, rows).tried(moved))
    torch.testing.assert_close(warm, cold, rtol=1e-9, atol=1e-12)
    assert fewer < more
    rates, fewer = counted(lambda: problem.jacobians(moved))
    expected, more = counted(lambda: Problem(model, rows).jacobians(moved))
    torch.testing.assert_close(rates, expected, rtol=1e-6, atol=1e-9)
    assert fewer < more
    # Where nothing was tried, from where derivatives were last taken.
    torch.testing.assert_close(problem.jacobians(start), Problem(model, rows).jacobians(start), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_each_step_of_a_way_begins_at_the_one_before(name, monkeypatch):
    model, states = CASES[name][0]()
    asked = []
    real = equilibrium.balance
    monkeypatch.setattr(equilibrium, "balance", lambda *a: asked.append(a[4] is not None) or real(*a))
    with torch.no_grad():
        fresh = model(states).loads
        assert not any(asked)
        count = len(asked)
        onwards = model(states.replace(near=Near())).loads
    assert asked[count:] == [False] + [True] * (len(asked) - count - 1)
    torch.testing.assert_close(onwards, fresh, rtol=1e-9, atol=1e-12)


def test_only_what_is_found_while_it_keeps_is_remembered():
    near = Near()
    place, settled = torch.ones(3, 2, dtype=torch.float64), torch.tensor([True, False, True])
    other = torch.zeros(3, 2, dtype=torch.float64)
    near.keep("place", place, settled)
    assert torch.equal(near.start("place", other), other)
    assert not near.moved
    with near.keeping():
        near.keep("place", place, settled)
    assert near.start("place", other)[:, 0].tolist() == [1, 0, 1]
    assert torch.equal(near.start("another", other), other)
    # Other rows than those remembered begin afresh.
    assert torch.equal(near.start("place", other[:2]), other[:2])


def test_what_depends_on_no_parameter_is_made_once():
    near, calls = Near(), []
    fixed, moving = torch.zeros(3), torch.zeros(3)
    near.fix([fixed])
    for _ in range(2):
        near.once("of the rows", [fixed, None], lambda: calls.append("fixed"))
        near.once("of a parameter", [fixed, moving], lambda: calls.append("moving"))
    assert calls == ["fixed", "moving", "moving"]


def test_nothing_of_a_batch_is_remembered():
    model, states = hanging()
    states = replace(states, near=Near())
    vectors = torch.stack([model.vector().detach(), model.vector().detach() + 0.01])
    with states.near.keeping():
        torch.func.vmap(lambda vector: model(states, model.physical(vector)).loads)(vectors)
    assert not states.near.moved


@pytest.mark.parametrize("count", [COUNT, 400], ids=["twice", "once"])
@pytest.mark.parametrize("name", CASES)
def test_where_a_step_is_taken_its_derivatives_cost_no_equilibrium_more(name, count, monkeypatch):
    """And one that is not taken leaves nothing behind."""
    build, _ = CASES[name]
    model, few_states = build()
    states = few_states[torch.arange(count) % COUNT]
    problem, other = Problem(model, rows_of(states)), Problem(model, rows_of(states))
    start = model.vector().detach()[None]
    for each in (problem, other):
        each.jacobians(start)
    place = {n: t.clone() for n, t in problem.states.near._last.items()}
    far, near_by = 1.01 * start, 1.001 * start
    problem.tried(far)
    assert all(torch.equal(t, place[n]) for n, t in problem.states.near._last.items())
    torch.testing.assert_close(problem.tried(near_by), other.residuals(near_by), rtol=1e-9, atol=1e-12)
    calls = []
    real = type(model).chain
    monkeypatch.setattr(type(model), "chain", lambda *a: calls.append(1) or real(*a))
    taken = problem.jacobians(near_by)
    assert not calls
    torch.testing.assert_close(taken, other.jacobians(near_by), rtol=1e-6, atol=1e-9)
    assert calls
    assert any(not torch.equal(t, place[n]) for n, t in problem.states.near._last.items())
    # Elsewhere than where it was tried they are taken anew.
    torch.testing.assert_close(problem.jacobians(start), other.jacobians(start), rtol=1e-6, atol=1e-9)
