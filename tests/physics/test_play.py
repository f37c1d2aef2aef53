"""Play in twist: its definition by brute force, reciprocity, derivatives, and what it costs."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from freelearn.data.states import States
from freelearn.discovery.noise.noise import sensitivities
from freelearn.physics.models.build import build_model
from freelearn.physics.simulated_bed import protocol
from freelearn.testing.effects import TRUTH
from freelearn.testing.small_tables import visits

FAMILIES = ("continuum", "linear")
GRID = 201
FRICTION = {"friction_hysteresis.force": 0.4, "friction_hysteresis.moment": 4e-3}


def with_play(family, w, effects=(), values=None):
    return build_model(family, TRUTH[family] | {"twist_slack.angle": w} | (values or {}), ["twist_slack", *effects])


def near_zero(count=6, seed=0, spread=15.0):
    """States whose moments vanish at small twists, and some that are far from that."""
    table = visits(count=count, seed=seed)
    twist = np.repeat(np.random.default_rng(seed).uniform(-spread, spread, len(table) // 4), 4)
    return States.from_table(table.assign(twist_deg=twist))


def moments(model, states, twists):
    """Moment (N, k) at k twists a row."""
    with torch.no_grad():
        return torch.stack([model(states.replace(twist=t)).loads[:, 1] for t in twists.unbind(1)], dim=1)


@pytest.mark.parametrize("effects", [(), ("friction_hysteresis",), ("relaxation", "end_clamps")])
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("w", [0.15, 0.4])
def test_the_actuator_rests_where_its_moment_is_nearest_zero(family, w, effects):
    values = FRICTION if "friction_hysteresis" in effects else {}
    states = near_zero()
    bare = build_model(family, TRUTH[family] | values, effects)
    grid = states.twist[:, None] + torch.linspace(-w, w, GRID, dtype=torch.float64)
    everywhere = moments(bare, states, grid)
    best = everywhere.abs().argmin(1)
    with torch.no_grad():
        loads = with_play(family, w, effects, values)(states).loads
    nearest = everywhere.gather(1, best[:, None])[:, 0]
    inside = (best > 0) & (best < GRID - 1)
    assert inside.sum() >= 4
    assert (~inside).sum() >= 4
    # At an end the grid has the very place; at a zero the moment is zero.
    torch.testing.assert_close(loads[~inside, 1], nearest[~inside], rtol=1e-9, atol=1e-12)
    assert float(loads[inside, 1].abs().max()) < 1e-9
    at = grid.gather(1, best[:, None])[:, 0]
    with torch.no_grad():
        force = bare(states.replace(twist=at)).loads[:, 0]
    # One step of the grid changes the force by no more than this.
    assert float((loads[:, 0] - force).abs().max()) < 200 * w / GRID
    torch.testing.assert_close(loads[~inside, 0], force[~inside], rtol=1e-9, atol=1e-12)


@settings(max_examples=10, deadline=None)
@given(w=st.floats(1e-3, 0.6), seed=st.integers(0, 1000), family=st.sampled_from(FAMILIES))
def test_the_loads_keep_reciprocity_inside_the_band_too(w, seed, family):
    states = near_zero(count=3, seed=seed)
    slopes = sensitivities(with_play(family, w), states)
    scale = float(slopes[:, 0, 1].abs().max().clamp_min(1e-3))
    torch.testing.assert_close(slopes[:, 0, 1], slopes[:, 1, 0], rtol=1e-7, atol=1e-7 * scale)


def test_the_old_dead_band_broke_reciprocity():
    """φ − clamp(φ, −w, w) holds ∂F/∂φ at zero in the band and leaves ∂M/∂l: no boundary effect. This one has both."""
    states = near_zero(spread=1.0)
    slopes = sensitivities(with_play("continuum", 0.1), states)
    bare = sensitivities(build_model("continuum", TRUTH["continuum"]), states)
    inside = slopes[:, 0, 1].abs() < 1e-9
    assert inside.any()
    assert float(slopes[inside, 1, 0].abs().max()) < 1e-9
    assert float(bare[inside, 1, 0].abs().max()) > 1e-2


@pytest.mark.parametrize("family", FAMILIES)
def test_derivatives_are_those_of_differences_at_zeros_and_ends_alike(family):
    states, w = near_zero(), 0.15
    model = with_play(family, w)
    slopes = sensitivities(model, states)
    with torch.no_grad():
        inside = model(states).loads[:, 1].abs() < 1e-9
        assert 4 <= int(inside.sum()) <= len(states) - 4
        for i, (name, h) in enumerate((("length", 1e-6), ("twist", 1e-6), ("pressure", 1.0))):
            here = getattr(states, name)
            up, down = (model(states.replace(**{name: here + s * h})).loads for s in (1, -1))
            expected = (up - down) / (2 * h)
            torch.testing.assert_close(slopes[:, :, i], expected, rtol=1e-4, atol=1e-5 * float(expected.abs().max()))
    vector = model.vector().detach()

    def loads(v):
        return model(states, model.physical(v)).loads

    forward = torch.func.jacfwd(loads)(vector)
    reverse = torch.func.jacrev(loads)(vector)
    torch.testing.assert_close(forward, reverse, rtol=1e-8, atol=1e-10)
    for column in range(len(vector)):
        step = torch.zeros_like(vector)
        step[column] = 1e-5
        with torch.no_grad():
            slope = (loads(vector + step) - loads(vector - step)) / 2e-5
        torch.testing.assert_close(
            reverse[..., column], slope, rtol=1e-4, atol=1e-5 * max(float(slope.abs().max()), 1e-6)
        )


@pytest.mark.parametrize("family", ["continuum", "linear", "mlp"])
def test_no_play_changes_nothing_to_the_last_bit(family):
    states = States.from_table(visits())
    rest = near_zero().replace(twist=torch.zeros(len(near_zero()), dtype=torch.float64))
    rest = rest.replace(length=rest.reference_length, pressure=0 * rest.pressure)
    for some in (states, rest):
        bare = build_model(family, TRUTH[family])(some)
        assert torch.equal(with_play(family, 0.0)(some).loads, bare.loads)
    # At no effect the derivative is that of turning the way the moment drives: a search can score it.
    slope = torch.func.jacfwd(lambda v: with_play(family, 0.0)(states, v).loads)(with_play(family, 0.0).values())
    assert slope["twist_slack.angle"].isfinite().all()


def test_each_sample_has_its_own_play_and_members_agree_with_rows():
    states = near_zero()
    model = build_model(
        "continuum",
        TRUTH["continuum"] | {"twist_slack.angle[3]": 0.05, "twist_slack.angle[5]": 0.3},
        ["twist_slack"],
        [3, 5],
    )
    for sample, w in ((3, 0.05), (5, 0.3)):
        rows = states[states.sample == sample]
        torch.testing.assert_close(model(rows).loads, with_play("continuum", w)(rows).loads, rtol=1e-10, atol=1e-12)
    vector = model.vector().detach()
    spread = model.chain(states, model.physical(vector.expand(len(states), -1)))
    torch.testing.assert_close(spread.loads, model(states).loads, rtol=1e-9, atol=1e-11)
    together = torch.func.vmap(lambda v: model(states, model.physical(v)).loads)(torch.stack([vector, vector]))
    torch.testing.assert_close(together[1], model(states).loads, rtol=1e-9, atol=1e-9)


def test_a_yielding_mount_carries_what_play_leaves():
    """Inside the band nothing is turned, so a soft shaft changes nothing there; outside it does."""
    states, values = near_zero(), {"twist_compliance.compliance": 0.5}
    with torch.no_grad():
        stiff, soft = (
            with_play("continuum", 0.15)(states),
            with_play("continuum", 0.15, ["twist_compliance"], values)(states),
        )
    inside = stiff.loads[:, 1].abs() < 1e-9
    assert inside.any()
    torch.testing.assert_close(soft.loads[inside], stiff.loads[inside], rtol=1e-8, atol=1e-9)
    assert ((soft.loads - stiff.loads)[~inside, 1].abs() > 1e-5).any()
    slopes = sensitivities(with_play("continuum", 0.15, ["twist_compliance"], values), states)
    torch.testing.assert_close(slopes[:, 0, 1], slopes[:, 1, 0], rtol=1e-6, atol=1e-8)


def test_a_wall_that_gives_way_to_the_pressure_rests_at_the_nearest_zero_or_at_an_end():
    """Pressure makes ∂M/∂φ > 0 here, so moving with the moment raises it: the zero lies the other way."""
    states = near_zero(spread=8.0)
    weak = {"ka": 1e3, "kb": 1e-4, "kc": 0.0}
    bare = build_model("linear", weak)
    w = 0.3
    slope = sensitivities(bare, states)[:, 1, 1]
    unstable = slope > 0
    assert unstable.any()
    grid = states.twist[:, None] + torch.linspace(-w, w, GRID, dtype=torch.float64)
    smallest = moments(bare, states, grid).abs().amin(1)
    with torch.no_grad():
        loads = build_model("linear", weak | {"twist_slack.angle": w}, ["twist_slack"])(states).loads
    assert (loads[unstable, 1].abs() <= smallest[unstable] + 1e-9).all()


@pytest.mark.parametrize("w", [0.02, 0.1, 0.5])
def test_a_pass_with_play_solves_few_more_rows_than_several_without(w):
    """Counted in rows of the bare structure, which does not depend on what else the machine does."""
    table = protocol()
    states = States.from_table(table[table["sample"] == 3])
    for family in FAMILIES:
        model, solved = with_play(family, w), []
        bare = model.bare

        def counting(states, values, bare=bare, solved=solved):
            solved.append(len(states))
            return bare(states, values)

        model.bare = counting
        with torch.no_grad():
            model(states)
        assert sum(solved) < 5 * len(states)
        assert len(solved) <= 12
