"""Several actuators on one end block: their loads add, each has what is its own, and nothing depends on their order."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch

from freelearn.data.beds import BED, DEAD_LOAD, KPA
from freelearn.data.columns import with_members
from freelearn.data.states import States
from freelearn.discovery.noise.noise import sensitivities
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model, load_model, save_checkpoint
from freelearn.testing.contract_checks import batch_is_rows, members_are_alone, parameter_derivatives

HEADER = ["member", "gamma_deg", "gamma2_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"]
# Two helices of either hand and a braid, of different lengths.
DESIGNS = [
    (1, 36.0, np.nan, 98.42, 4.77, 6.74),
    (2, -40.0, np.nan, 90.48, 4.77, 6.13),
    (3, 30.0, -30.0, 110.0, 5.2, 6.9),
]
VALUES = {"continuum": {"C1": 8e5, "C2": 2e7}, "linear": {"ka": 2e3, "kb": 0.1, "kc": 1.0}}


def table_of(count: int = 20, seed: int = 0, samples: int = 1) -> pd.DataFrame:
    generator = np.random.default_rng(seed)
    pressures = {f"pressure_{n}_kpa": generator.uniform(0, 70, count) for n in (1, 2, 3)}
    return pd.DataFrame(
        {
            "sample": 1 + np.arange(count) * samples // count,
            "step": 0,
            "elongation_mm": generator.uniform(-4, 4, count),
            "twist_deg": generator.uniform(-60, 60, count),
            **pressures,
            "force_n": 0.0,
            "moment_nmm": 0.0,
            "buckled": 0,
        }
    )


def block(table: pd.DataFrame, designs=DESIGNS) -> States:
    return States.from_table(with_members(table, pd.DataFrame(designs, columns=HEADER)))


def alone(table: pd.DataFrame, design) -> States:
    """The same rows of one member, as a table of its own would give it."""
    own = dict(zip(HEADER[1:], design[1:], strict=True)) | {"pressure_kpa": table[f"pressure_{design[0]}_kpa"]}
    return States.from_table(table.drop(columns=[c for c in table if c.startswith("pressure_")]).assign(**own))


def made(name, effects=(), values=None, members=3, samples=None):
    return build_model(name, VALUES[name] | (values or {}), list(effects), samples, members)


def loads(model, states):
    with torch.no_grad():
        return model(states).loads


@pytest.mark.parametrize("name", VALUES)
def test_the_loads_of_three_runs_add_up(name):
    table, model = table_of(), made(name)
    parts = sum(loads(build_model(name, VALUES[name]), alone(table, design)) for design in DESIGNS)
    torch.testing.assert_close(loads(model, block(table)), parts, rtol=1e-12, atol=1e-12)


def test_what_is_each_members_own_has_a_parameter_for_each():
    """Per member what was built or plumbed; one for what the block and its load cell have."""
    effects = ["fiber_misalignment", "pressure_gain", "force_offset", "length_compliance", "wall_stiffening"]
    labels = set(made("continuum", effects).declared)
    for name in ("fiber_misalignment.angle", "pressure_gain.gain"):
        assert {f"{name}[{n}]" for n in (1, 2, 3)} <= labels
        assert name not in labels
    assert {"force_offset.force", "length_compliance.compliance", "wall_stiffening.C20", "C1", "C2"} <= labels


@pytest.mark.parametrize(
    ("effect", "parameter", "size"),
    [
        ("pressure_gain", "gain", 0.1),
        ("fiber_misalignment", "angle", 0.03),
        ("wall_thickness", "outer_radius", 1e-4),
        ("off_axis", "squared_distance", 9e-4),
    ],
)
def test_a_members_effect_is_that_members_alone(effect, parameter, size):
    """As if that one actuator, run alone, had it."""
    table = table_of()
    for design in DESIGNS:
        number = design[0]
        changed = loads(made("continuum", [effect], {f"{effect}.{parameter}[{number}]": size}), block(table))
        single = build_model("continuum", VALUES["continuum"] | {f"{effect}.{parameter}": size}, [effect])
        plain = build_model("continuum", VALUES["continuum"])
        own = alone(table, design)
        expected = loads(made("continuum"), block(table)) + loads(single, own) - loads(plain, own)
        torch.testing.assert_close(changed, expected, rtol=1e-11, atol=1e-11)


def test_each_member_stands_beside_the_axis_where_it_stands():
    """Three at one distance push the block round three times as hard as one of them: a mere force at a lever."""
    table, number = table_of(), 4e-4
    labels = [f"off_axis.squared_distance[{n}]" for n in (1, 2, 3)]
    assert set(labels) <= set(made("linear", ["off_axis"]).declared)
    plain = loads(made("linear"), block(table))
    each = [loads(made("linear", ["off_axis"], {label: number}), block(table)) - plain for label in labels]
    every = loads(made("linear", ["off_axis"], dict.fromkeys(labels, number)), block(table)) - plain
    torch.testing.assert_close(sum(each[1:], start=each[0]), every, rtol=1e-10, atol=1e-10)
    assert all(bool((change.abs().amax(0) > 1e-3).all()) for change in each)


def test_members_move_with_their_block_and_each_lags_behind():
    """side_by_side knows every member's move: the block's. The block lags as its members do, run alone."""
    table = table_of()
    states = block(table)
    assert float(states.moved_twist.abs().max()) > 0.1
    each = states.side_by_side()
    for name in ("moved_length", "moved_twist", "dwell", "clock"):
        assert torch.equal(getattr(each, name), getattr(states, name).repeat(3))
    lag = {"viscoelasticity.share": 0.3, "viscoelasticity.time": 60.0}
    single = build_model("continuum", VALUES["continuum"] | lag, ["viscoelasticity"])
    expected = sum(loads(single, alone(table, design)) for design in DESIGNS)
    found = loads(made("continuum", ["viscoelasticity"], lag), states)
    torch.testing.assert_close(found, expected, rtol=1e-11, atol=1e-11)
    assert float((found - loads(made("continuum"), states)).abs().max()) > 1


def test_what_the_block_has_counts_once():
    table = table_of()
    plain = loads(made("continuum"), block(table))
    shifted = loads(made("continuum", ["force_offset"], {"force_offset.force": 2.0}), block(table))
    torch.testing.assert_close(shifted - plain, torch.tensor([2.0, 0.0]).double().expand(20, 2), rtol=0, atol=1e-12)


def test_a_spring_under_the_block_yields_to_the_sum():
    """τ(q + S τ) = τ: the spring's travel is that of all loads together."""
    states, soft = block(table_of()), 2e-5
    model = made("linear", ["length_compliance"], {"length_compliance.compliance": soft})
    shown = loads(model, states)
    moved = states.replace(length=states.length + soft * shown[:, 0])
    torch.testing.assert_close(loads(made("linear"), moved), shown, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", VALUES)
def test_the_order_of_two_members_is_nothing(name):
    table = table_of()
    swapped = table.rename(columns={"pressure_1_kpa": "pressure_2_kpa", "pressure_2_kpa": "pressure_1_kpa"})
    others = [(1, *DESIGNS[1][1:]), (2, *DESIGNS[0][1:]), DESIGNS[2]]
    here = made(name, ["pressure_gain"], {"pressure_gain.gain[1]": 0.1})
    there = made(name, ["pressure_gain"], {"pressure_gain.gain[2]": 0.1})
    torch.testing.assert_close(loads(here, block(table)), loads(there, block(swapped, others)), rtol=1e-11, atol=1e-11)


def test_one_member_without_answer_marks_the_row():
    table = table_of(4)
    table.loc[1, "pressure_2_kpa"] = 5e3
    weak = build_model("continuum", {"C1": 1e5, "C2": 1e6}, [], None, 3)
    with torch.no_grad():
        found, status = weak(block(table))
    assert status[1] == Status.NO_EQUILIBRIUM
    assert found.isfinite().all()


@pytest.mark.parametrize("name", [*VALUES, "mlp"])
def test_a_checkpoint_brings_the_members_back(name, tmp_path):
    effects = [] if name == "mlp" else ["pressure_gain", "fiber_misalignment"]
    effects = ["pressure_gain"] if name == "linear" else effects
    model = build_model(name, {}, effects, [1, 2], 3)
    model.set_values({label: 0.01 * i for i, label in enumerate(model.declared) if "[" in label})
    save_checkpoint(model, tmp_path / "checkpoint.ckpt")
    again = load_model(tmp_path / "checkpoint.ckpt")
    assert again.labels() == model.labels()
    states = block(table_of(samples=2))
    assert torch.equal(loads(again, states), loads(model, states))


def test_several_samples_of_blocks_share_their_members():
    """The samples of an end block are runs of the same actuators: a member's effect is one, whatever the sample."""
    model = made("continuum", ["pressure_gain", "force_offset"], samples=[1, 2])
    assert {f"pressure_gain.gain[{n}]" for n in (1, 2, 3)} <= set(model.declared)
    states = block(table_of(samples=2))
    with torch.no_grad():
        assert model(states).loads.isfinite().all()
    assert states.sample.unique().tolist() == [1, 2]


def test_derivatives_by_parameters_and_by_each_pressure():
    table = table_of(12)
    states, model = block(table), made("continuum", ["pressure_gain"], {"pressure_gain.gain[2]": 0.05})
    parameter_derivatives(model, states, {"C1": 1e-4, "C2": 1e-4, "pressure_gain.gain[3]": 1e-4})
    slopes = sensitivities(model, states)
    assert slopes.shape == (12, 2, 5)
    for n in (1, 2, 3):
        name = f"pressure_{n}_kpa"
        up, down = (loads(model, block(table.assign(**{name: table[name] + s * 1e-3}))) for s in (1, -1))
        slope = (up - down) / (2e-3 * KPA)
        assert ((slopes[:, :, 1 + n] - slope).abs() / slope.abs().amax(0)).max() < 1e-6


def test_a_batch_is_its_rows_and_several_vectors_are_one_after_the_other():
    states, model = block(table_of(16)), made("continuum", ["pressure_gain"])
    batch_is_rows(model, states)
    members_are_alone(model, states)


def test_a_block_hangs_where_its_members_together_carry_the_load():
    table = table_of(12, seed=3)
    model = made("continuum")
    force, moment = loads(model, block(table)).unbind(-1)
    table = table.assign(**{BED: "dead_load"}, force_n=force.numpy(), moment_nmm=1e3 * moment.numpy())
    states = block(table)
    assert states.bed is DEAD_LOAD
    with torch.no_grad():
        found, status = model(states)
    assert (status == Status.OK).all()
    expected = np.stack([table["elongation_mm"] * 1e-3, np.deg2rad(table["twist_deg"])], 1)
    np.testing.assert_allclose(found.numpy(), expected, atol=1e-8)


def test_the_members_pressures_are_the_inputs():
    states = block(table_of(5))
    inputs = states.inputs()
    assert len(inputs) == 5
    doubled = states.with_inputs([*inputs[:2], *(2 * p for p in inputs[2:])])
    for before, after in zip(states.members, doubled.members, strict=True):
        torch.testing.assert_close(after.pressure, 2 * before.pressure)
    torch.testing.assert_close(doubled.pressure, 2 * states.pressure)
    names = [name for name, _ in states.tensors()]
    assert len(names) == len(set(names))
    assert replace(states).members == states.members
