"""Relaxation and stress softening act on the wall's stresses: what the fluid does stays."""

import pytest
import torch

from freelearn.data.states import States
from freelearn.physics.mechanics.energy import EnergySum, NeoHookean, StandardFiber
from freelearn.physics.mechanics.equilibrium import inflate, loads_at
from freelearn.physics.models.build import build_model
from freelearn.testing.effects import TRUTH, labels_of
from freelearn.testing.small_tables import visits

WALL = ["relaxation", "stress_softening"]


def factor(states: States, effect: str) -> torch.Tensor:
    """The share of the stresses that is left at the effect's scale, written out again."""
    if effect == "relaxation":
        return 1 - 0.1 * (1 - torch.exp(-states.dwell / 60.0))
    return 1 - 0.1 * torch.tanh((states.past_severity - states.severity) / 1e-2)


@pytest.mark.parametrize("effect", WALL)
def test_a_tube_of_scaled_moduli_is_what_a_softer_wall_is(effect):
    """Both moduli s times as large, row by row, and the pressure as it was."""
    states = States.from_table(visits())
    s = factor(states, effect)
    assert float(s.min()) < 0.95
    energy = EnergySum([NeoHookean(1e6 * s), StandardFiber(4e7 * s)])
    inflated = inflate(states, energy)
    assert inflated.balanced.all()
    model = build_model("continuum", TRUTH["continuum"] | labels_of(effect, "scale"), [effect])
    torch.testing.assert_close(model(states).loads, loads_at(inflated), rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("effect", WALL)
def test_the_linear_models_thrust_is_untouched(effect):
    """τ = J_Vᵀ P − s K q: only the stiffness is softened."""
    states = States.from_table(visits())
    s = factor(states, effect)[:, None]
    fluid = build_model("linear", {"ka": 1e-9, "kb": 1e-12, "kc": 0.0})(states).loads
    whole = build_model("linear", TRUTH["linear"])(states).loads
    model = build_model("linear", TRUTH["linear"] | labels_of(effect, "scale"), [effect])
    torch.testing.assert_close(model(states).loads, fluid + s * (whole - fluid), rtol=1e-9, atol=1e-7)
    # Where the wall carries nothing, nothing is lost: the old form scaled this thrust too.
    rest = states.replace(length=states.reference_length, twist=0 * states.twist)
    at_rest = build_model("linear", TRUTH["linear"])(rest).loads
    torch.testing.assert_close(model(rest).loads, at_rest, rtol=1e-12, atol=1e-12)
    assert float(at_rest.detach().abs().max()) > 0.1


def test_an_inextensible_fibers_tension_follows_from_the_softer_wall():
    states = States.from_table(visits())
    s = factor(states, "relaxation")
    model = build_model("continuum_inextensible", {"C1": 1e6} | labels_of("relaxation", "scale"), ["relaxation"])
    row = 3
    softer = build_model("continuum_inextensible", {"C1": 1e6 * float(s[row])})
    one = slice(row, row + 1)
    torch.testing.assert_close(model(states).loads[one], softer(states[one]).loads, rtol=1e-9, atol=1e-10)


def test_a_softer_wall_balloons_earlier():
    states = States.from_table(visits(samples=(1,)))
    weak = {"C1": 3e5, "C2": 1e6}
    before = build_model("continuum", weak)(states).status
    after = build_model("continuum", weak | {"relaxation.share": 0.6, "relaxation.time": 10.0}, ["relaxation"])(
        states
    ).status
    assert int((after == 1).sum()) > int((before == 1).sum())


def test_friction_is_not_softened():
    states = States.from_table(visits())
    values = labels_of("relaxation", "scale")
    rough = {"friction_hysteresis.force": 2.0, "friction_hysteresis.moment": 1e-2}
    soft = build_model("linear", TRUTH["linear"] | values, ["relaxation"])(states).loads
    both = build_model("linear", TRUTH["linear"] | values | rough, ["relaxation", "friction_hysteresis"])(states).loads
    expected = soft - states.direction[:, None] * torch.tensor([2.0, 1e-2], dtype=torch.float64)
    torch.testing.assert_close(both, expected)
    assert bool(both.isfinite().all())
