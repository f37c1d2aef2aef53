"""Fixed, bounded and known parameters of a model."""

import math

import pytest
import torch

from freelearn.common.errors import UserError
from freelearn.physics.chain.known_parameters import Known
from freelearn.physics.chain.parameters import Prior
from freelearn.physics.chain.priors import raw_prior
from freelearn.physics.models.build import build_model, load_model, save_checkpoint
from freelearn.physics.models.stated_knowledge import stated


def test_a_fixed_parameter_is_a_constant_of_the_model(random_states):
    known = Known(starts={"end_clamps.clamp_length": 4e-3}, fixed=("C2", "end_clamps.clamp_length"))
    model = build_model("continuum", {"C2": 3e7}, ["end_clamps"], known=known)
    assert model.free.tolist() == [True, False, False]
    assert model.scalars() == pytest.approx({"C1": 1e5, "C2": 3e7, "end_clamps.clamp_length": 4e-3})
    moved = model.vector().detach() + torch.tensor([0.0, 1.0, 1.0], dtype=torch.float64)
    assert {name: float(v) for name, v in model.physical(moved).items() if name != "C1"} == {
        "C2": 3e7, "end_clamps.clamp_length": 4e-3,
    }  # fmt: skip
    states = random_states(5)
    slope = torch.func.jacfwd(lambda v: model(states, model.physical(v)).loads)(model.vector().detach())
    assert bool((slope[..., 1:] == 0).all())
    assert bool((slope[..., 0] != 0).any())


def test_bounds_are_those_of_the_raw_vector_and_draw_the_value_in():
    model = build_model("continuum", known=Known(bounds={"C1": (2e5, 1e6)}))
    assert model.scalars()["C1"] == pytest.approx(2e5)
    low, high = (bound[0].exp() for bound in model.raw_bounds())
    assert (float(low), float(high)) == pytest.approx((2e5, 1e6))


def test_a_prior_takes_the_place_of_the_declared_one_and_none_is_left_of_what_is_fixed():
    known = Known(priors={"C1": Prior(1.2e6, 0.1)}, fixed=("C2",))
    prior = raw_prior(build_model("continuum", known=known), {})
    assert float(prior.middle[0]) == pytest.approx(math.log(1.2e6))
    assert prior.covariance.diagonal().tolist() == pytest.approx([0.01, math.inf])
    assert raw_prior(build_model("continuum", known=Known(flat=True)), {}).covariance[0, 0] > 100**2


def test_one_sample_alone_may_be_held():
    known = Known(starts={"twist_offset.angle[6]": 0.1}, fixed=("twist_offset.angle[6]",))
    model = build_model("continuum", {}, ["twist_offset"], [3, 6], known=known)
    assert model.free.tolist() == [True, True, True, False]
    assert model.beforehand() == {"twist_offset.angle[6]": "fixed"}


def test_a_checkpoint_keeps_what_was_known(tmp_path):
    known = stated(
        "continuum", values={"C1": 1.2e6, "C2": 3e7}, errors={"C1": 2e5}, fix=["C2"], bounds={"C1": (1e5, 2e6)}
    )
    model = build_model("continuum", {"C1": 1.2e6, "C2": 3e7}, known=known)
    model.set_values({"C1": 9e5})
    save_checkpoint(model, tmp_path / "model.ckpt")
    again = load_model(tmp_path / "model.ckpt")
    assert again.scalars() == model.scalars()
    assert again.known == model.known
    assert again.beforehand() == {"C1": "1.2e+06 ± 2e+05, 1e+05 … 2e+06", "C2": "fixed"}


def test_what_is_not_known_changes_nothing():
    model = build_model("continuum", known=Known())
    assert model.known.nothing
    assert "known" not in model.description()


MISTAKES = {
    "Did you mean 'ecoflex_00_30'": {"of": "ecoflex_30"},
    "Unknown parameter of model continuum: 'C3'": {"fix": ["C3"]},
    "Did you mean 'end_clamps'": {"fix": ["end_clamp.clamp_length"]},
    "Did you mean 'end_clamps.clamp_length'": {"bounds": {"end_clamps.clamp": (0.0, 1e-3)}},
    "but not its value: add +model.end_clamps.clamp_length=": {
        "fix": ["end_clamps.clamp_length"], "effects": ["end_clamps"],
    },
    "which says that it is there: add end_clamps": {
        "fix": ["end_clamps.clamp_length"], "values": {"end_clamps.clamp_length": 1e-3},
    },
    "say that it is there: add end_clamps": {"bounds": {"end_clamps.clamp_length": (1e-3, 2e-3)}},
    "the model has no end_clamps": {"values": {"end_clamps.clamp_length": 1e-3}, "tried": False},
    "give the lower one first": {"bounds": {"C1": (1e6, 1e5)}},
    "model.C1 = 2e+06 is outside bounds.C1 = [100000, 1e+06]": {"values": {"C1": 2e6}, "bounds": {"C1": (1e5, 1e6)}},
    "C1 is fixed and has an error": {"values": {"C1": 2e6}, "errors": {"C1": 1e5}, "fix": ["C1"]},
    "the error must be more than zero": {"values": {"C1": 2e6}, "errors": {"C1": 0.0}},
    "model.C1 and material both": {"values": {"C1": 2e6}, "of": "latex"},
    "material both say": {"values": {"C1": 2e6}, "errors": {"C1": 1e5}, "of": "latex"},
    "and its bounds are 1000 … 10000": {"bounds": {"C1": (1e3, 1e4)}, "of": "latex"},
    "are outside what it may be": {"bounds": {"C1": (-3.0, -2.0)}},
    "material gives C1": {"model": "linear", "of": "latex"},
    "ka of model linear cannot be fixed": {"model": "linear", "fix": ["ka"]},
    "Model mlp has no physical parameter": {"model": "mlp", "fix": ["C1"]},
}  # fmt: skip


@pytest.mark.parametrize("said", MISTAKES)
def test_a_contradiction_is_one_sentence(said):
    given = {"model": "continuum", "effects": []} | MISTAKES[said]
    with pytest.raises(UserError) as told:
        build_model(given["model"], {}, given["effects"], known=stated(**given))
    assert said in str(told.value)
    assert "\n" not in str(told.value)
