"""Names, order, columns, samples and users' own effects."""

import inspect
from pathlib import Path

import pytest
import torch

from freelearn.common.errors import UserError
from freelearn.data.states import States
from freelearn.physics import effects as library
from freelearn.physics.chain.effect import PORTS
from freelearn.physics.chain.parameters import Parameters, parameter
from freelearn.physics.chain.ports import EnergyEffect
from freelearn.physics.effects.effect_check import check_effects
from freelearn.physics.effects.registry import EFFECTS, make_effects, missing_columns, register
from freelearn.physics.models.build import build_model, load_model, save_checkpoint
from freelearn.testing.effects import TRUTH
from freelearn.testing.small_tables import visits

NAMES = [
    "second_invariant",
    "second_invariant_log",
    "wall_stiffening",
    "limited_extensibility",
    "fiber_stiffening",
    "fiber_tension_only",
    "fiber_dispersion",
    "bladder_stiffness",
    "fiber_misalignment",
    "wall_thickness",
    "end_clamps",
    "end_taper",
    "length_offset",
    "twist_offset",
    "twist_slack",
    "length_compliance",
    "twist_compliance",
    "pressure_offset",
    "pressure_gain",
    "own_pressure_gain",
    "pressure_hysteresis",
    "threshold_pressure",
    "contact_friction",
    "friction_hysteresis",
    "motion_friction",
    "relaxation",
    "stress_softening",
    "force_offset",
    "moment_offset",
    "force_gain",
    "moment_gain",
    "own_force_gain",
    "own_moment_gain",
    "sensor_crosstalk",
    "sensor_drift",
]
PER_SAMPLE = {
    "contact_friction",
    "friction_hysteresis",
    "motion_friction",
    "length_offset",
    "twist_offset",
    "twist_slack",
    "fiber_misalignment",
    "wall_thickness",
    "wall_modulus",
    "fiber_modulus",
    "pressure_offset",
    "force_offset",
    "moment_offset",
    "own_force_gain",
    "own_moment_gain",
    "own_pressure_gain",
}


def test_the_library_is_complete_and_says_when_to_suspect_what():
    assert [name for name in EFFECTS if name in NAMES] == NAMES
    for name, kind in EFFECTS.items():
        assert kind.name == name
        assert kind.suspect
        assert kind.source
        assert {p.per_sample for p in kind.declared_parameters()} == {name in PER_SAMPLE}


def test_an_unknown_name_gets_the_nearest_one_and_a_misfit_the_models_that_fit():
    with pytest.raises(UserError, match=r"'twist_ofset'.*Did you mean 'twist_offset'"):
        make_effects(["twist_ofset"], "continuum")
    with pytest.raises(UserError, match=r"'wall_stiffening' cannot join model 'linear'.*continuum"):
        make_effects(["wall_stiffening"], "linear")
    with pytest.raises(UserError, match="named twice"):
        make_effects(["end_clamps", "end_clamps"], "linear")


def test_the_order_of_the_names_does_not_matter():
    assert [e.name for e in make_effects(NAMES[::-1], "continuum")] == NAMES


def test_a_missing_column_is_named():
    effects = make_effects(["force_offset", "relaxation"], "linear")
    assert missing_columns(effects, ["sample", "time_s"]) is None
    assert "relaxation" in missing_columns(effects, ["sample"])
    assert "time_s" in missing_columns(effects, ["sample"])


# --- one value per sample -------------------------------------------------------------------------------------


def test_several_samples_have_a_value_each_and_one_alone_has_no_number():
    effects = ["twist_offset", "pressure_gain"]
    assert list(build_model("mlp", effects=effects, samples=[3, 5, 3]).declared) == [
        "twist_offset.angle[3]",
        "twist_offset.angle[5]",
        "pressure_gain.gain",
    ]
    for samples in ([3], [3, 3], [], None):
        assert "twist_offset.angle" in build_model("mlp", effects=effects, samples=samples).declared


def test_a_row_takes_its_samples_value_and_an_unknown_sample_the_mean():
    states = States.from_table(visits(samples=(3, 5, 7)))
    several = build_model("continuum", TRUTH["continuum"], ["twist_offset"], samples=[3, 5])
    several.set_values({"twist_offset.angle[3]": 0.1, "twist_offset.angle[5]": 0.3})
    for sample, angle in ((3, 0.1), (5, 0.3), (7, 0.2)):
        rows = states[states.sample == sample]
        one = build_model("continuum", TRUTH["continuum"] | {"twist_offset.angle": angle}, ["twist_offset"])
        torch.testing.assert_close(several(rows).loads, one(rows).loads, rtol=1e-12, atol=1e-12)
    # One set of values for each row, as the Jacobian of a fit has them.
    vector = several.vector().detach()
    spread = several.chain(states, several.physical(vector.expand(len(states), -1)))
    torch.testing.assert_close(spread.loads, several(states).loads, rtol=1e-12, atol=1e-12)
    together = torch.func.vmap(lambda v: several(states, several.physical(v)).loads)(torch.stack([vector, vector]))
    torch.testing.assert_close(together[1], several(states).loads, rtol=1e-9, atol=1e-9)


def test_a_checkpoint_remembers_the_samples(tmp_path):
    names = ["length_offset", "force_gain"]
    model = build_model("linear", TRUTH["linear"], names, samples=[3, 5])
    model.set_values({"length_offset.length[5]": 2e-3, "force_gain.gain": 0.1})
    save_checkpoint(model, tmp_path / "checkpoint.ckpt")
    again = load_model(tmp_path / "checkpoint.ckpt")
    assert again.scalars() == model.scalars()
    states = States.from_table(visits())
    assert torch.equal(again(states).loads, model(states).loads)


@pytest.mark.parametrize("family", ["continuum", "linear", "mlp"])
def test_every_effect_of_the_library_passes_the_check(family):
    names = [name for name, effect in EFFECTS.items() if family in effect.families()]
    model = build_model(family, {}, names, [3, 5])
    for bed in ("kinematic", "isometric"):
        told = [effect for effect in model.effects if not effect.untold(bed)]
        check_effects(told, model.values(), States.from_table(visits().assign(bed=bed)))


def test_the_parameters_of_an_energy_cannot_differ_between_samples():
    class Odd(Parameters):
        a: torch.Tensor = parameter("a", "Pa", start=0.0, none=0.0, scale=1.0, per_sample=True)

    class OddEnergy(EnergyEffect[Odd]):
        name = "odd"
        parameter_class = Odd
        depends_on = ("i1",)

        def psi(self, *invariants, p, material):
            return p.a * invariants[0]

    with pytest.raises(TypeError, match="shared"):
        register(OddEnergy)


def test_a_new_module_of_the_library_needs_no_list():
    """Every module in a port's folder is found, in the order of port, place and name; each is in the right folder."""
    folder = Path(library.__path__[0])
    modules = {path for path in folder.glob("*/*.py") if path.stem != "__init__"}
    assert {Path(inspect.getfile(kind)) for kind in EFFECTS.values()} == modules
    assert all(Path(inspect.getfile(kind)).parent.name == kind.port for kind in EFFECTS.values())
    ranked = [(PORTS.index(kind.port), kind.place, name) for name, kind in EFFECTS.items()]
    assert ranked == sorted(ranked)


def test_a_drift_without_times_says_what_it_assumes():
    kind = EFFECTS["sensor_drift"]
    (sentence,) = kind.assumptions(["sample", "force_n"])
    assert "no time_s" in sentence
    assert "20 s" in sentence
    assert kind.assumptions(["sample", "time_s"]) == []
    assert [name for name, effect in EFFECTS.items() if effect.assumptions([])] == ["sensor_drift"]


def test_parameters_are_tensors_by_name_and_read_only():
    p = EFFECTS["force_offset"]().own({"force_offset.force": torch.tensor(2.0)})
    assert float(p.force) == 2.0
    with pytest.raises(AttributeError, match="read only"):
        p.force = torch.tensor(3.0)
    with pytest.raises(TypeError, match="takes force, not moment"):
        type(p)(moment=torch.tensor(1.0))
    with pytest.raises(TypeError, match="'detach' cannot be the name"):
        type("Bad", (Parameters,), {"detach": parameter("d", "1", start=0.0)})
