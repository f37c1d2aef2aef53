"""The hybrid model: what it learns, what it must not touch, and what its remainder keeps."""

import json

import numpy as np
import pandas as pd
import pytest
import torch
from small_runs import make_csv, run

from freelearn.common.errors import UserError
from freelearn.data.beds import BEDS
from freelearn.data.error import set_error
from freelearn.data.rows import Readings, Rows
from freelearn.data.states import States, kinematic_state
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.physics.chain.prediction import Status
from freelearn.physics.models.build import build_model, load_model, save_checkpoint
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.models.hybrid import Hybrid
from freelearn.testing.contract_checks import reciprocal
from freelearn.testing.effects import TRUTH
from freelearn.testing.models import ModelContract
from freelearn.testing.small_tables import visits

LM = FitOptions("levenberg_marquardt", max_epochs=300, restarts=1, patience=6)
STIFF = {
    "fiber_tension_only.share": 0.7,
    "twist_offset.angle": 0.15,
    "friction_hysteresis.force": 2.0,
    "friction_hysteresis.moment": 0.05,
}
NOISE = torch.tensor([0.03, 6e-4], dtype=torch.float64)


def rows_of(values: dict[str, float], samples: tuple[int, ...] = (3,), count: int = 90, seed: int = 1) -> Rows:
    """Rows of a continuum tube with effects, with the paper's noise."""
    table = visits(count, seed, samples)
    truth = build_model("continuum", TRUTH["continuum"] | values, sorted({name.split(".")[0] for name in values}))
    states = States.from_table(table)
    with torch.no_grad():
        loads, status = truth(states)
    generator = torch.Generator().manual_seed(seed)
    loads = loads + NOISE * torch.randn(loads.shape, dtype=torch.float64, generator=generator)
    rows = Rows.whole(states, loads, kinematic_state(table))
    return rows[torch.nonzero(status == Status.OK)[:, 0]]


def fitted(rows: Rows, name: str = "hybrid", effects: tuple[str, ...] = ()):
    model = build_model(name, effects=effects)
    fit(model, rows, rows[torch.zeros(0, dtype=torch.int64)], LM, seed=0)
    return model


def error(model, rows: Rows) -> float:
    with torch.no_grad():
        loads, status = model(rows.states)
    return set_error(rows, loads, status == Status.OK).E


@pytest.fixture(scope="module")
def learned() -> Hybrid:
    return fitted(rows_of(STIFF, (3, 5)))


class TestHybrid(ModelContract):
    model = Hybrid
    values = TRUTH["continuum"]


class TestLearned(TestHybrid):
    """The contract of a model that has learned something, at the designs it learned from."""

    @pytest.fixture(autouse=True)
    def _remainder(self, learned):
        self.remainder = {name: getattr(learned, name) for name, _ in learned.named_buffers()}

    def build(self, effects=(), values=None):
        model = super().build(effects, values)
        model.take(self.remainder)
        return model

    def test_the_physics_does_not_depend_on_the_units(self):
        """What was learned is in SI."""


def test_it_learns_what_the_continuum_leaves(learned):
    for sample in (3, 5):
        unseen = rows_of(STIFF, (sample,), seed=2)
        assert error(learned, unseen) < 0.2 * error(fitted(rows_of(STIFF, (3, 5)), "continuum"), unseen)


def test_its_parameters_are_those_of_the_continuum(learned):
    rows = rows_of(STIFF, (3, 5))
    reference = fitted(rows, "continuum")
    assert torch.equal(learned.vector(), reference.vector())
    # Fitted once more, it forgets what it had learned.
    again = build_model("hybrid")
    again.load_state_dict(learned.state())
    fit(again, rows, rows[torch.zeros(0, dtype=torch.int64)], LM, seed=0)
    torch.testing.assert_close(again.amplitude, learned.amplitude)


def test_the_same_rows_teach_the_same_to_the_last_bit(learned):
    again = fitted(rows_of(STIFF, (3, 5)))
    for name, buffer in learned.named_buffers():
        assert torch.equal(buffer, getattr(again, name)), name


def test_its_potential_keeps_reciprocity_inside_its_data_and_where_it_ends(learned):
    conservative = build_model("hybrid")
    conservative.load_state_dict(learned.state())
    conservative.sensors.zero_()
    states = States.from_table(visits(20))
    reciprocal(conservative, states)
    for reach in (1.3, 1.8, 4.0, 7.0):
        states = learned_box(conservative, reach)
        length, twist = (getattr(states, n).clone().requires_grad_() for n in ("length", "twist"))
        loads = conservative.potential_loads(states.replace(length=length, twist=twist))
        (by_twist,) = torch.autograd.grad(loads[:, 0].sum(), twist, retain_graph=True)
        (by_length,) = torch.autograd.grad(loads[:, 1].sum(), length)
        torch.testing.assert_close(by_twist, by_length, rtol=1e-9, atol=1e-9 * float(by_twist.abs().max()) + 1e-12)


def learned_box(model: Hybrid, reach: float) -> States:
    """States of sample 3 all around the box of its data, this many of its halves from the middle."""
    one = States.from_table(visits(20, samples=(3,)))
    z = torch.randn(len(one), 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    z = reach * z / z.abs().amax(-1, keepdim=True)
    stretch, shear = (model.middle[0, :2] + z * model.extent[0, :2]).unbind(-1)
    radius = (one.inner_radius + one.outer_radius) / 2
    return one.replace(length=one.reference_length * (1 + stretch), twist=shear * one.reference_length / radius)


def test_what_is_added_ends_exactly(learned):
    bare = build_model("continuum", learned.scalars())
    with torch.no_grad():
        far = learned_box(learned, 8.01)
        assert torch.equal(learned(far).loads, bare(far).loads)
        one = States.from_table(visits(20, samples=(3,)))
        pressed = one.replace(pressure=one.pressure + 3e5)
        assert torch.equal(learned(pressed).loads, bare(pressed).loads)
        wide = one.replace(inner_radius=2.1 * one.inner_radius, outer_radius=2.1 * one.outer_radius)
        assert torch.equal(learned(wide).loads, bare(wide).loads)


def test_it_grows_nowhere_out_of_proportion(learned):
    inside = learned.potential_loads(learned_box(learned, 0.9)).abs().amax(0)
    for reach in (1.1, 1.5, 2.5, 4.0, 6.0):
        assert bool((learned.potential_loads(learned_box(learned, reach)).abs().amax(0) < 2 * inside).all())


def test_hysteresis_is_carried_to_a_like_design_and_the_potential_is_not():
    model, other = fitted(rows_of(STIFF)), rows_of(STIFF, (4,), seed=2)
    continuum = build_model("continuum", model.scalars())
    assert error(model, other) < 0.97 * error(continuum, other)
    held = other[other.states.direction == 0]
    assert torch.equal(model(held.states).loads, continuum(held.states).loads)


def test_without_hysteresis_another_design_is_the_continuums():
    smooth = {name: value for name, value in STIFF.items() if "friction" not in name}
    model, other = fitted(rows_of(smooth)), rows_of(smooth, (4,), seed=2)
    continuum = build_model("continuum", model.scalars())
    assert error(model, other) == pytest.approx(error(continuum, other), rel=2e-3)
    assert error(model, rows_of(smooth, seed=2)) < 0.3 * error(continuum, rows_of(smooth, seed=2))


def test_rows_of_rising_pressure_alone_tell_nothing_of_hysteresis():
    rows = rows_of(STIFF)
    model = fitted(rows[rows.states.direction >= 0])
    assert not model.rubbed.any()


def test_where_nothing_is_missing_next_to_nothing_is_added():
    rows, unseen = rows_of({}), rows_of({}, seed=2)
    assert error(fitted(rows), unseen) < 1.1 * error(fitted(rows, "continuum"), unseen)


def test_gains_and_cross_talk_of_the_sensors_are_learned_beside_the_potential():
    values = {"force_gain.gain": -0.1, "sensor_crosstalk.moment_into_force": 4.0}
    rows, unseen = rows_of(values), rows_of(values, seed=2)
    assert error(fitted(rows), unseen) < 0.1 * error(fitted(rows, "continuum"), unseen)


def test_readings_that_slipped_do_not_spoil_it():
    rows, unseen = rows_of(STIFF), rows_of(STIFF, seed=2)
    loads = rows.loads.clone()
    loads[::40] = -loads[::40]
    slipped = Rows.whole(rows.states, loads, rows.state)
    assert error(fitted(slipped), unseen) < 2 * error(fitted(rows), unseen)


def test_an_effect_takes_its_own_part_and_the_remainder_the_rest():
    rows = rows_of(STIFF)
    model = fitted(rows, effects=("friction_hysteresis", "end_clamps"))
    assert float(model.scalars()["friction_hysteresis.moment"]) == pytest.approx(0.05, rel=0.3)
    # What the effect, fitted where more is missing, takes too much is given back.
    alone = float(fitted(rows).rubbed[0, 1])
    assert float(model.rubbed[0, 1]) + model.scalars()["friction_hysteresis.moment"] == pytest.approx(alone, rel=0.1)
    assert error(model, rows_of(STIFF, seed=2)) < 1.5 * error(fitted(rows), rows_of(STIFF, seed=2))


def test_a_bed_that_measures_force_alone_teaches_it():
    rows = rows_of(STIFF)
    readings = rows.readings
    present = readings.present & torch.tensor([True, False])
    forces = Rows(rows.states, Readings(torch.where(present, readings.value, 0.0), present, readings.slack), rows.state)
    model, reference = fitted(forces), fitted(forces, "continuum")
    missed = [float((m(rows.states).loads - rows.loads)[:, 0].detach().square().mean()) for m in (model, reference)]
    assert missed[0] < 0.1 * missed[1]


@pytest.mark.parametrize("bed", ["dead_load", "inflation"])
def test_other_beds_are_refused_in_one_sentence(bed):
    rows = rows_of({}, count=5)
    hung = Rows(rows.states.replace(bed=BEDS[bed]), rows.readings, rows.state)
    with pytest.raises(UserError, match=f"the bed {bed} does not tell: use model=continuum"):
        Hybrid().prepare(hung)


def test_a_checkpoint_brings_the_remainder_back(learned, tmp_path):
    save_checkpoint(learned, tmp_path / "c.ckpt")
    again = load_model(tmp_path / "c.ckpt")
    states = States.from_table(visits(samples=(2, 3, 4, 5)))
    assert torch.equal(again(states).loads, learned(states).loads)


def test_a_run_of_it_is_kept_and_found_again(tmp_path):
    make_csv(tmp_path / "table.csv", rows=2400)
    words = (
        "model=hybrid",
        "train=all",
        "data=csv",
        f"data.path={tmp_path / 'table.csv'}",
        f"fits={tmp_path / 'fits'}",
    )
    first, second = (run(tmp_path / name, *words) for name in ("first", "second"))
    assert not first.reused
    assert second.reused
    tables = [pd.read_csv(tmp_path / name / "predictions.csv") for name in ("first", "second")]
    pd.testing.assert_frame_equal(*tables)
    results = json.loads((tmp_path / "first" / "results.json").read_text())
    assert set(results["parameters"]) == {"C1", "C2"}
    loads = load_model(tmp_path / "first" / "checkpoint.ckpt")(States.from_table(tables[0])).loads
    np.testing.assert_allclose(loads[:, 0].detach(), tables[0]["force_pred_n"], rtol=1e-6, atol=1e-9)


def test_it_is_a_continuum_before_a_fit(random_states):
    states = random_states(50)
    values = TRUTH["continuum"]
    assert torch.equal(build_model("hybrid", values)(states).loads, Continuum(**values)(states).loads)
