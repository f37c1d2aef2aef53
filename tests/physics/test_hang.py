"""Where an actuator comes to rest under a dead load: there and back again, root finders, derivatives, lost rows."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from braided import BraidedMuscle
from braids import random_tubes, tensor, textbook_rows, tubes
from scipy.optimize import root

from freelearn.data.beds import DEAD_LOAD, KINEMATIC, MM
from freelearn.data.rows import Readings, Rows
from freelearn.data.states import States
from freelearn.data.warm_start import Near
from freelearn.discovery.noise.noise import sensitivities
from freelearn.physics.chain.dead_load import PLACE
from freelearn.physics.chain.ports import MountEffect
from freelearn.physics.chain.prediction import Status
from freelearn.physics.effects.boundary.compliances import AxialSpring
from freelearn.physics.effects.registry import make_effects
from freelearn.physics.models.build import build_model
from freelearn.physics.models.continuum import Continuum
from freelearn.testing.contract_checks import members_are_alone, parameter_derivatives
from freelearn.testing.small_tables import random_table

VALUES = {
    "continuum": {"C1": 8e5, "C2": 2e7},
    "linear": {"ka": 2e3, "kb": 0.1, "kc": 1.0},
    "continuum_inextensible": {"C1": 8e5},
}
EFFECTS = {
    "length_offset": {"length": 1e-3},
    "twist_offset": {"angle": 0.05},
    "force_offset": {"force": 1.0},
    "moment_offset": {"moment": 0.02},
    "force_gain": {"gain": 0.05},
    "length_compliance": {"compliance": 5e-5},
    "twist_compliance": {"compliance": 0.5},
    "pressure_gain": {"gain": 0.05},
    "friction_hysteresis": {"force": 0.5, "moment": 0.01},
    "sensor_crosstalk": {"moment_into_force": 1.0, "force_into_moment": 3e-4},
    "end_clamps": {"clamp_length": 2e-3},
    "wall_stiffening": {"C20": 1e5},
}


def made(name: str = "continuum", effects: tuple[str, ...] = ()):
    sizes = {f"{effect}.{p}": value for effect in effects for p, value in EFFECTS[effect].items()}
    return build_model(name, VALUES[name] | sizes, list(effects))


def stable(model, states: States) -> torch.Tensor:
    """Rows with an answer and a positive stiffness −∂(F, M)/∂(l, φ), (N,) bool."""
    k = -sensitivities(model, states)[:, :, :2]
    answered = model(states).status == Status.OK
    return answered & (k[:, 0, 0] * k[:, 1, 1] > k[:, 0, 1] * k[:, 1, 0]) & (k[:, 0, 0] + k[:, 1, 1] > 0)


def hung(model, states: States) -> States:
    """The loads of kinematic states, as a dead load that is to find these states from the reference state."""
    with torch.no_grad():
        force, moment = model(states).loads.unbind(-1)
    rest = {"length": states.reference_length, "twist": torch.zeros_like(states.twist)}
    return replace(states, bed=DEAD_LOAD, force=force, moment=moment, **rest)


def place(states: States) -> torch.Tensor:
    return torch.stack([states.length - states.reference_length, states.twist], -1)


def there_and_back(model, states: States) -> tuple[torch.Tensor, torch.Tensor]:
    """How far from its place every stable row comes to rest (in reference lengths, rad), and whether it does."""
    states = states[stable(model, states)]
    with torch.no_grad():
        found, status = model(hung(model, states))
    assert found.isfinite().all()
    size = torch.stack([states.reference_length, torch.ones_like(states.length)], -1)
    return ((found - place(states)) / size).abs().amax(-1), status == Status.OK


@pytest.mark.parametrize("name", VALUES)
def test_what_hangs_at_a_states_loads_comes_to_rest_there(name):
    """A few rows in a hundred are on the verge of giving way: the way from the reference state may lead past them."""
    for states in (States.from_table(random_table(150, 1)), random_tubes(150, 3, blank=0.3)):
        distance, found = there_and_back(made(name), states)
        assert len(found) > 60
        assert found.double().mean() > 0.97
        assert distance[found].max() < 1e-8


def test_several_turns_are_no_obstacle():
    """Up to ±10 rad: tubes of silicone are twisted that far. Some near-unstable rows may be out of reach."""
    turn = np.linspace(-600, 600, 80)[np.random.default_rng(0).permutation(80)]
    states = tubes(np.linspace(20, 75, 80), np.nan, np.linspace(-8, 8, 80), turn, 40.0)
    distance, found = there_and_back(made(), states)
    assert len(found) > 40
    assert found.double().mean() > 0.95
    assert distance[found].max() < 1e-8


@pytest.mark.parametrize("name", EFFECTS)
def test_the_chain_is_inverted_with_its_effects(name):
    states = States.from_table(random_table(60, 5))
    states = states.replace(direction=tensor(np.random.default_rng(0).choice([-1.0, 0.0, 1.0], 60)))
    distance, found = there_and_back(made(effects=(name,)), states)
    assert found.double().mean() > 0.97
    assert distance[found].max() < 1e-8


def test_play_in_twist_is_taken_up_under_a_dead_load():
    model = build_model("continuum", VALUES["continuum"] | {"twist_slack.angle": 0.1}, ["twist_slack"])
    distance, found = there_and_back(model, States.from_table(random_table(60, 5)))
    assert found.double().mean() > 0.97
    assert distance[found].max() < 1e-8


class Belt(MountEffect[AxialSpring]):
    """l = l read + c F (1 + 4 (l/L − 1)): a mount that gives the more the farther out it stands."""

    name = "belt"
    parameter_class = AxialSpring

    def impose(self, states: States, loads: torch.Tensor, p: AxialSpring) -> States:
        farther = 1 + 4 * (states.length / states.reference_length - 1)
        return states.replace(length=states.length + p.compliance * loads[..., 0] * farther)


def on_a_belt() -> Continuum:
    """A cell that reads a tenth too much hangs on the belt, too."""
    gained = make_effects(["force_gain"], "continuum")
    model = Continuum(effects=[Belt(), *gained])
    model.set_values(VALUES["continuum"] | {"belt.compliance": 2e-4, "force_gain.gain": 0.1})
    return model


def test_a_mount_that_gives_otherwise_at_each_place_is_inverted():
    model, states = on_a_belt(), States.from_table(random_table(60, 5))
    distance, found = there_and_back(model, states)
    assert found.double().mean() > 0.97
    assert distance[found].max() < 1e-8
    states = hung(model, states[stable(model, states)])
    states = states[model(states).status == Status.OK]
    parameter_derivatives(model, states, {"C1": 1e-4, "C2": 1e-4, "belt.compliance": 2e-7, "force_gain.gain": 1e-4})


def test_two_steps_from_where_a_mount_was_seen_are_right_to_second_order():
    model, states = on_a_belt(), States.from_table(random_table(60, 5))
    states = hung(model, states[stable(model, states)])
    with torch.no_grad():
        rest, status = model(states)
        states, rest = states[status == Status.OK], rest[status == Status.OK]
        errors = []
        for size in (4e-3, 1e-3):
            seen = rest + size * torch.stack([states.reference_length, torch.ones_like(states.length)], -1)
            seen = seen + torch.stack([states.reference_length, 0 * states.twist], -1)
            near = states.replace(near=Near({PLACE: seen}))
            off = (model(near).loads - rest) / size
            errors.append(float((off.abs() / torch.stack([states.reference_length, 0 * rest[:, 1] + 1], -1)).median()))
    assert errors[0] < 1e-3
    # As a share of what was missed: what is left of it goes with its square.
    assert errors[1] < errors[0] / 3


def test_a_force_offset_is_an_error_of_the_hung_weight():
    states = hung(made(), States.from_table(random_table(40, 6)))
    with torch.no_grad():
        heavier = made()(states.replace(force=states.force - 1.0))
        offset = made(effects=("force_offset",))(states)
    both = (heavier.status == Status.OK) & (offset.status == Status.OK)
    assert both.sum() > 30
    torch.testing.assert_close(offset.loads[both], heavier.loads[both], rtol=0, atol=1e-9)


def test_a_root_finder_on_the_textbook_comes_to_rest_at_the_same_place():
    states = tubes([36, 62, -40, 30], [np.nan, np.nan, np.nan, -30], 0.0, 0.0, [60, 40, 50, 70], bed=DEAD_LOAD)
    states = states.replace(force=tensor([3.0, -2.0, 5.0, -20.0]), moment=tensor([0.02, -0.01, 0.0, 0.015]))
    with torch.no_grad():
        found, status = made()(states)
    assert (status == Status.OK).all()
    for i in range(len(states)):
        row = replace(states[slice(i, i + 1)], bed=KINEMATIC)
        load = np.array([float(row.force), float(row.moment)])

        def excess(q, row=row, load=load):
            at = row.replace(length=row.reference_length + float(q[0]), twist=row.twist + float(q[1]))
            return (textbook_rows(at, **VALUES["continuum"])[0, :2] - load) / [1.0, 0.1]

        answer = root(excess, [0.0, 0.0], tol=1e-11)
        assert answer.success
        np.testing.assert_allclose(found[i].numpy(), answer.x, rtol=1e-6, atol=1e-9)


def test_without_pressure_the_linear_model_is_its_compliance():
    """q = −K⁻¹ (F, M)."""
    states = States.from_table(random_table(50, 2))
    generator = np.random.default_rng(3)
    load = generator.normal(size=(50, 2)) * [5.0, 0.1]
    states = replace(states, bed=DEAD_LOAD, length=states.reference_length, twist=0 * states.twist)
    states = states.replace(pressure=0 * states.pressure, force=tensor(load[:, 0]), moment=tensor(load[:, 1]))
    k = VALUES["linear"]
    expected = -load @ np.linalg.inv([[k["ka"], k["kc"]], [k["kc"], k["kb"]]])
    with torch.no_grad():
        np.testing.assert_allclose(made("linear")(states).loads.numpy(), expected, rtol=1e-9, atol=1e-12)


def test_a_model_of_ones_own_hangs_too():
    """Its braid pulls with P (b − a λ²) and is held by springs: M = −k_t φ says the twist at once."""
    states = tubes(30.0, np.nan, 0.0, 0.0, [0, 30, 60], bed=DEAD_LOAD)
    states = states.replace(force=tensor([-2.0, -5.0, -10.0]), moment=tensor([0.01, -0.02, 0.03]))
    model = BraidedMuscle(k=3e3, k_t=0.2)
    with torch.no_grad():
        found, status = model(states)
        at = replace(states, bed=KINEMATIC, length=states.reference_length + found[:, 0], twist=found[:, 1])
        loads = model(at).loads
    assert (status == Status.OK).all()
    np.testing.assert_allclose(found[:, 1].numpy(), -states.moment.numpy() / 0.2, rtol=1e-9)
    np.testing.assert_allclose(loads[:, 0].numpy(), states.force.numpy(), rtol=1e-9)


def resting(effects: tuple[str, ...] = (), count: int = 40):
    """A model and dead loads under which all rows find a place."""
    model = made(effects=effects)
    states = States.from_table(random_table(count, 7))
    states = hung(model, states[stable(model, states)])
    return model, states[model(states).status == Status.OK]


@pytest.mark.parametrize("effects", [(), ("length_offset", "pressure_gain"), ("length_compliance",)])
def test_derivatives_by_parameters(effects):
    """Forward, reverse, and by differences."""
    model, states = resting(effects)
    steps = {"C1": 1e-4, "C2": 1e-4} | {f"{n}.{p}": 1e-3 * v for n in effects for p, v in EFFECTS[n].items()}
    parameter_derivatives(model, states, steps)


def test_derivatives_by_what_is_imposed_are_those_of_the_implicit_function_theorem():
    """∂q/∂(F, M) = (∂τ/∂q)⁻¹ and ∂q/∂P = −(∂τ/∂q)⁻¹ ∂τ/∂P with the derivatives of the kinematic bed."""
    model, states = resting()
    with torch.no_grad():
        q = model(states).loads
    at = replace(states, bed=KINEMATIC, length=states.reference_length + q[:, 0], twist=q[:, 1])
    tau = sensitivities(model, at)
    inverse = torch.linalg.inv(tau[:, :, :2])
    expected = torch.cat([inverse, -inverse @ tau[:, :, 2:]], dim=2)
    slopes = sensitivities(model, states)
    for i in range(3):
        torch.testing.assert_close(slopes[:, :, i], expected[:, :, i], rtol=1e-6, atol=1e-12)


def test_derivatives_by_what_is_imposed_are_those_of_differences():
    """On rows away from the verge of giving way, where the place bends within a step."""
    model, states = resting()
    slopes = sensitivities(model, states)
    for i, (name, step) in enumerate((("force", 1e-4), ("moment", 1e-6), ("pressure", 1.0))):
        here = getattr(states, name)
        with torch.no_grad():
            up, down = (model(states.replace(**{name: here + s * step})).loads for s in (1, -1))
        expected = (up - down) / (2 * step)
        soft = expected.abs().amax(-1) > 10 * expected.abs().amax(-1).median()
        scale = expected[~soft].abs().amax(0)
        assert ((slopes[:, :, i] - expected)[~soft].abs() / scale).max() < 1e-5


def test_a_batch_is_its_rows():
    model, states = resting()
    with torch.no_grad():
        whole = model(states)
        rows = torch.cat([model(states[slice(i, i + 1)]).loads for i in range(len(states))])
    torch.testing.assert_close(whole.loads, rows, rtol=0, atol=1e-10)
    members_are_alone(model, states[slice(0, 12)])


def test_rows_that_nothing_holds_are_marked_and_finite():
    """A thrust beyond what the tube bears; a pressure that no wall holds; an unstable place is not returned."""
    states = tubes(36.0, np.nan, 0.0, 0.0, [70, 70, 5000, 20], bed=DEAD_LOAD)
    states = states.replace(force=tensor([1e5, 0.0, 0.0, 1.0]), moment=tensor([0.0, 1e4, 0.0, 0.0]))
    for name in VALUES:
        model = made(name)
        vector = model.vector().detach().requires_grad_()
        found, status = model(states, model.physical(vector))
        lost = Status.NO_EQUILIBRIUM
        assert status[:2].tolist() == [lost, lost]
        assert status[3] == Status.OK
        assert found.isfinite().all()
        found.sum().backward()
        assert vector.grad.isfinite().all()
    assert made()(states).status[2] == Status.NO_EQUILIBRIUM


def test_what_was_unstable_is_never_found():
    """Rows that push harder the longer they get: whatever is found instead carries the load and is stable."""
    model = build_model("linear", {"ka": 50.0, "kb": 0.01, "kc": 0.0})
    states = States.from_table(random_table(200, 8))
    states = states[~stable(model, states) & (model(states).status == Status.OK)]
    assert len(states) > 20
    load = hung(model, states)
    with torch.no_grad():
        found, status = model(load)
    ok = status == Status.OK
    at = replace(load, bed=KINEMATIC, length=load.reference_length + found[:, 0], twist=found[:, 1])[ok]
    assert stable(model, at).all()
    np.testing.assert_allclose(model(at).loads[:, 0].detach(), load.force[ok], atol=1e-6)
    assert ((found - place(states)).abs().amax(-1)[ok] > 1e-6).all()


def test_an_unstable_place_is_not_returned_even_where_the_search_begins():
    """The load of the reference state itself, under a pressure at which a soft wall gives way."""
    model = build_model("linear", {"ka": 50.0, "kb": 0.01, "kc": 0.0})
    states = tubes(np.linspace(20, 70, 12), np.nan, 0.0, 0.0, 70.0)
    states = states[~stable(model, states)]
    assert len(states) > 3
    with torch.no_grad():
        found, status = model(hung(model, states))
    still = found.abs().amax(-1) < 1e-6
    assert (status[still] == Status.NO_EQUILIBRIUM).all()
    assert found.isfinite().all()


def test_the_rows_of_a_dead_load_know_a_kinematic_bed_to_start_from():
    states = hung(made(), States.from_table(random_table(5, 9)))
    measured = Readings(tensor(np.ones(10) * MM).reshape(5, 2), torch.ones(5, 2, dtype=torch.bool), torch.zeros(5) > 1)
    again = Rows(states, measured, np.arange(5)).as_loads
    assert again.states.bed is KINEMATIC
    torch.testing.assert_close(again.states.length - again.states.reference_length, measured.value[:, 0])
    torch.testing.assert_close(again.loads, torch.stack([states.force, states.moment], -1))
