"""Names, order, columns, samples and users' own effects."""

import dataclasses

import pytest
import torch

from freelearn.errors import UserError
from freelearn.measurements.states import States
from freelearn.models.build import build_model, load_model, save_checkpoint
from freelearn.models.effects import registry
from freelearn.models.effects.check import check_effects
from freelearn.models.effects.registry import EFFECTS, load_own, make_effects, missing_columns, register
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect
from freelearn.testing.effects import TRUTH, labels_of, visits

NAMES = [
    "second_invariant",
    "wall_stiffening",
    "limited_extensibility",
    "fiber_stiffening",
    "fiber_tension_only",
    "fiber_dispersion",
    "fiber_misalignment",
    "wall_thickness",
    "end_clamps",
    "length_offset",
    "twist_offset",
    "twist_slack",
    "length_compliance",
    "twist_compliance",
    "pressure_offset",
    "pressure_gain",
    "friction_hysteresis",
    "relaxation",
    "stress_softening",
    "force_offset",
    "moment_offset",
    "force_gain",
    "moment_gain",
    "sensor_crosstalk",
    "sensor_drift",
]
PER_SAMPLE = {
    "friction_hysteresis",
    "length_offset",
    "twist_offset",
    "twist_slack",
    "fiber_misalignment",
    "wall_thickness",
}

OWN = """
from freelearn.models.ports import Effect
from freelearn.models.parameter import Parameter

class Leak(Effect):
    name = "leak"
    parameters = (Parameter("share", "s", "1", start=0.0, lower=0.0, upper=1.0, none=0.0, scale=0.1),)

    def impose(self, states, p):
        return states.replace(pressure=states.pressure * (1 - p.share))
"""


@pytest.fixture
def own_effects(monkeypatch):
    """Leaves the library as it was."""
    monkeypatch.setattr(registry, "_OWN", {})
    before = dict(EFFECTS)
    yield
    for name in set(EFFECTS) - set(before):
        del EFFECTS[name]


def test_the_library_is_complete_and_says_when_to_suspect_what():
    assert list(EFFECTS) == NAMES
    for name, kind in EFFECTS.items():
        assert kind.name == name
        assert kind.suspect
        assert kind.source
        assert {p.per_sample for p in kind.parameters} == {name in PER_SAMPLE}


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


# --- a user's own ---------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("own_effects")
def test_an_effect_of_the_users_own_joins_like_any_other(tmp_path):
    (tmp_path / "mine.py").write_text(OWN)
    assert load_own([str(tmp_path / "mine.py")]) == ["leak"]
    assert load_own([str(tmp_path / "mine.py")]) == ["leak"]
    states = States.from_table(visits())
    model = build_model("continuum", TRUTH["continuum"] | labels_of("leak", "scale"), ["leak"])
    other = build_model("continuum", TRUTH["continuum"] | {"pressure_gain.gain": -0.1}, ["pressure_gain"])
    torch.testing.assert_close(model(states).loads, other(states).loads)


@pytest.mark.usefixtures("own_effects")
@pytest.mark.parametrize(
    ("content", "message"),
    [
        (OWN.replace('"leak"', '"end_clamps"'), "'end_clamps' is taken"),
        (OWN.replace("impose", "impoze"), r"Leak .* exactly one of impose.* overrides none"),
        (OWN + "\n    def sense(self, loads, states, p):\n        return loads\n", "overrides impose, sense"),
        (OWN.replace("scale=0.1", "scale=float('nan')"), "'share' must be finite"),
        (OWN.replace("start=0.0", "start=2.0"), "'share' must lie within its bounds"),
        ("x = 1\n", "holds no effect"),
        ("import nowhere_at_all\n", "does not run .*nowhere_at_all"),
        ("def f(:\n", "does not run .*SyntaxError"),
    ],
)
def test_what_is_wrong_with_an_own_effect_is_said_in_one_sentence(content, message, tmp_path):
    (tmp_path / "mine.py").write_text(content)
    before = list(EFFECTS)
    with pytest.raises(UserError, match=message) as raised:
        load_own([str(tmp_path / "mine.py")])
    assert "\n" not in str(raised.value)
    assert list(EFFECTS) == before


@pytest.mark.usefixtures("own_effects")
@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("return states.pressure", "failed with TypeError: it returns Tensor and not States"),
        ("return states.replace(pressure=states.pressure[:3])", r"pressure of shape \(8,\), not shape \(3,\)"),
        ("return states.replace(pressure=states.pressure * float('nan'))", "a pressure that are not finite"),
        ("return states.replace(pressure=None)", r"pressure of shape \(8,\), not NoneType"),
        ("raise KeyError('share')", "its impose failed with KeyError: 'share'"),
    ],
)
def test_an_own_effect_that_returns_nonsense_is_told_before_the_fit(body, message, tmp_path):
    (tmp_path / "mine.py").write_text(
        OWN.replace("return states.replace(pressure=states.pressure * (1 - p.share))", body)
    )
    load_own([str(tmp_path / "mine.py")])
    model = build_model("continuum", {}, ["leak"])
    with pytest.raises(UserError, match=message) as raised:
        check_effects(model.effects, model.values(), States.from_table(visits()))
    assert "'leak'" in str(raised.value)


@pytest.mark.parametrize("family", ["continuum", "linear", "mlp"])
def test_every_effect_of_the_library_passes_the_check(family):
    names = [name for name, effect in EFFECTS.items() if family in effect.models]
    model = build_model(family, {}, names, [3, 5])
    check_effects(model.effects, model.values(), States.from_table(visits()))


def test_a_file_that_is_not_there_is_said(tmp_path):
    with pytest.raises(UserError, match=r"none\.py is not a Python file"):
        load_own([str(tmp_path / "none.py")])


def test_the_parameters_of_an_energy_cannot_differ_between_samples():
    p = dataclasses.replace(Parameter("a", "a", "Pa", start=0.0, none=0.0, scale=1.0), per_sample=True)

    def psi(self, *invariants, p, material):
        return p.a * invariants[0]

    kind = type("Odd", (Effect,), {"name": "odd", "parameters": (p,), "depends_on": ("i1",), "psi": psi})
    with pytest.raises(TypeError, match="shared"):
        register(kind)
