"""Effects and models of a user's own: registered, checked, fitted, kept, and taken up by the search."""

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import ROOT

from freelearn.common.errors import UserError
from freelearn.data.accuracy import Accuracy
from freelearn.data.rows import Rows
from freelearn.data.states import States, kinematic_state
from freelearn.discovery.fits.prepare import Question
from freelearn.discovery.search.search import search
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem
from freelearn.fitting.starts import starts
from freelearn.fitting.uncertainty import uncertainty
from freelearn.physics.chain.prediction import Status
from freelearn.physics.effects.effect_check import check_effects
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models import own_files as own
from freelearn.physics.models.build import MODELS, build_model, check_model, load_model, save_checkpoint
from freelearn.physics.models.own_files import load_own, load_own_code, own_files
from freelearn.testing.contract_checks import reciprocal
from freelearn.testing.effects import TRUTH, EffectContract, labels_of
from freelearn.testing.small_tables import visits

BRAID = ROOT / "tests/support/braided.py"
LM = FitOptions("levenberg_marquardt", max_epochs=200, restarts=1, patience=6)
VALUES = {"k": 4e3, "k_t": 0.3}

EFFECT = """
from torch import Tensor
from freelearn.own import BoundaryEffect, Parameters, parameter

class Loss(Parameters):
    share: Tensor = parameter("s", "1", start=0.0, lower=0.0, upper=1.0, none=0.0, scale=0.1)

class Leak(BoundaryEffect[Loss]):
    name = "leak"
    parameter_class = Loss

    def impose(self, states, p):
        return states.replace(pressure=states.pressure * (1 - p.share))
"""

BASELESS = EFFECT.replace("BoundaryEffect, ", "").replace("BoundaryEffect", "Effect")
BASELESS = BASELESS.replace("from torch", "from freelearn.physics.chain.effect import Effect\nfrom torch")


@pytest.fixture(autouse=True)
def own_code(monkeypatch):
    """Leaves the library as it was."""
    monkeypatch.setattr(own, "_READ", {})
    effects, models = set(EFFECTS), set(MODELS)
    yield
    for name in set(EFFECTS) - effects:
        del EFFECTS[name]
    for name in set(MODELS) - models:
        del MODELS[name]


def written(tmp_path: Path, content: str) -> str:
    (tmp_path / "mine.py").write_text(content)
    return str(tmp_path / "mine.py")


def rows_of(model, noise=0.0, count=12):
    table = visits(count=count)
    states = States.from_table(table)
    generator = torch.Generator().manual_seed(1)
    with torch.no_grad():
        loads = model(states).loads
    loads = loads + noise * torch.tensor([1.0, 0.02]) * torch.randn(loads.shape, generator=generator).double()
    return Rows.whole(states, loads, kinematic_state(table))


# --- effects --------------------------------------------------------------------------------------------------


def test_an_effect_of_the_users_own_joins_like_any_other(tmp_path):
    path = written(tmp_path, EFFECT)
    assert load_own([path]) == ["leak"]
    assert load_own([path]) == ["leak"]
    states = States.from_table(visits())
    model = build_model("continuum", TRUTH["continuum"] | labels_of("leak", "scale"), ["leak"])
    other = build_model("continuum", TRUTH["continuum"] | {"pressure_gain.gain": -0.1}, ["pressure_gain"])
    torch.testing.assert_close(model(states).loads, other(states).loads)


GEAR = """
import torch
from torch import Tensor
from freelearn.own import BoundaryEffect, Parameters, parameter

class Ratio(Parameters):
    slip: Tensor = parameter("s", "1", start=0.0, lower=-0.5, upper=0.5, none=0.0, scale=0.1)

class Gear(BoundaryEffect[Ratio]):
    name = "gear"
    suspect = "Twist and moment are off by the same share."
    parameter_class = Ratio

    def impose(self, states, p):
        return states.replace(twist=states.twist * (1 - p.slip))

    def hand_on(self, loads, states, p):
        return torch.stack([loads[..., 0], loads[..., 1] * (1 - p.slip)], dim=-1)
"""


def test_a_gear_of_the_users_own_turns_the_actuator_less_and_the_block_less_hard(tmp_path):
    """What `impose` takes of the twist, `hand_on` takes of the moment: the same work, and behind another's offset."""
    load_own([written(tmp_path, GEAR)])
    states = States.from_table(visits())
    values = TRUTH["continuum"] | {"gear.slip": 0.2, "twist_offset.angle": 0.3}
    model, bare = (
        build_model("continuum", values, ["gear", "twist_offset"]),
        build_model("continuum", TRUTH["continuum"]),
    )
    turned = states.replace(twist=0.8 * (states.twist + 0.3))
    expected = bare(turned).loads * torch.tensor([1.0, 0.8], dtype=torch.float64)
    torch.testing.assert_close(model(states).loads, expected)
    reciprocal(model, states)
    model.effects[-1].hand_on = lambda loads, states, p: loads
    assert model.effects[-1].name == "gear"
    with pytest.raises(AssertionError):
        reciprocal(model, states)
    made = EFFECTS["gear"]
    contract = type("Contract", (EffectContract,), {"effect": made, "family": "continuum"})()
    for check in [name for name in dir(contract) if name.startswith("test_")]:
        getattr(contract, check)()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (EFFECT.replace('"leak"', '"end_clamps"'), "'end_clamps' is taken"),
        (EFFECT.replace("def impose", "def impoze"), "Leak .* must write the method impose of BoundaryEffect"),
        (BASELESS, "derive from exactly one of"),
        (EFFECT + "\n    def sense(self, loads, states, p):\n        return loads\n", "writes impose and sense"),
        (EFFECT.replace("scale=0.1", "scale=float('nan')"), "'share' must be finite"),
        (EFFECT.replace("start=0.0", "start=2.0"), "'share' must lie within its bounds"),
        (
            EFFECT.replace("scale=0.1", "scale=0.1, prior=Prior(0.0, 0.0)").replace(
                "from torch", "from freelearn.own import Prior\nfrom torch"
            ),
            "the prior of its parameter 'share' needs a finite middle",
        ),
        (
            EFFECT.replace("none=0.0, ", "").replace('"leak"', '"leak"\n    compares = True'),
            "'share' needs a value without effect",
        ),
        (
            EFFECT.replace("parameter_class", "parameters"),
            r"derives from BoundaryEffect\[Loss\]: write parameter_class = Loss",
        ),
        ("x = 1\n", "holds no effect and no model"),
        ("import nowhere_at_all\n", "does not run .*nowhere_at_all"),
        ("def f(:\n", "does not run .*SyntaxError"),
    ],
)
def test_what_is_wrong_with_an_own_effect_is_said_in_one_sentence(content, message, tmp_path):
    before = list(EFFECTS)
    with pytest.raises(UserError, match=message) as raised:
        load_own([written(tmp_path, content)])
    assert "\n" not in str(raised.value)
    assert list(EFFECTS) == before


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
    load_own(
        [written(tmp_path, EFFECT.replace("return states.replace(pressure=states.pressure * (1 - p.share))", body))]
    )
    model = build_model("continuum", {}, ["leak"])
    with pytest.raises(UserError, match=message) as raised:
        check_effects(model.effects, model.values(), States.from_table(visits()))
    assert "'leak'" in str(raised.value)


@pytest.mark.parametrize(
    ("base", "method", "message"),
    [
        ("WallEffect", "def soften(self, states, p):\n        return 0 * states.dwell", "factors greater than zero"),
        ("PlayEffect", "def play(self, states, p):\n        return p.share - 1.0", "widths of zero or more"),
    ],
)
def test_factors_and_widths_have_their_range(base, method, message, tmp_path):
    head = EFFECT.split("    def impose")[0].replace("BoundaryEffect", base)
    load_own([written(tmp_path, head + "    " + method + "\n")])
    model = build_model("linear", {}, ["leak"])
    with pytest.raises(UserError, match=message):
        check_effects(model.effects, model.values(), States.from_table(visits()))


def test_a_file_that_is_not_there_is_said(tmp_path):
    with pytest.raises(UserError, match=r"none\.py is not a Python file"):
        load_own([str(tmp_path / "none.py")])


# --- models ---------------------------------------------------------------------------------------------------


def test_both_variables_are_read_and_either_may_hold_both(tmp_path, monkeypatch):
    both = written(tmp_path, BRAID.read_text().replace('"braided"', '"mine"') + EFFECT)
    monkeypatch.setenv("FREELEARN_EFFECTS", both)
    monkeypatch.setenv("FREELEARN_MODELS", os.pathsep.join([str(BRAID), both]))
    assert own_files() == [Path(both).resolve(), BRAID.resolve()]
    assert "braided" not in MODELS
    assert load_own_code() == ["leak", "mine", "braided"]
    assert build_model("braided", VALUES, ["leak"]).scalars() == pytest.approx(VALUES | {"leak.share": 0.0})
    monkeypatch.delenv("FREELEARN_EFFECTS")
    monkeypatch.delenv("FREELEARN_MODELS")
    assert own_files() == []
    assert load_own_code() == []


def test_a_model_of_the_users_own_is_fitted_whatever_its_start():
    load_own([str(BRAID)])
    rows = rows_of(build_model("braided", VALUES), noise=0.01)
    for start in ({"k": 1e3, "k_t": 0.1}, {"k": 3e-2, "k_t": 50.0}):
        model = build_model("braided", start)
        fit(model, rows, rows[torch.arange(0)], LM, seed=0)
        errors = uncertainty(Problem(model, rows))
        for name, value, error in zip(errors.names, errors.values, errors.stderr, strict=True):
            assert 0 < error < 0.01 * VALUES[name]
            assert abs(value - VALUES[name]) < 4 * error
    # Its own values and a grid of both logarithms, the best place first.
    places = starts(model, rows, 100, torch.Generator())
    assert places.shape == (50, 2)
    losses = [float(Problem(model, rows).residual(place).square().sum()) for place in places]
    assert losses[0] == min(losses)


def test_a_model_takes_the_effects_that_its_family_can():
    load_own([str(BRAID)])
    able = [name for name, effect in EFFECTS.items() if "own" in effect.families()]
    assert {EFFECTS[name].port for name in able} == {"geometry", "boundary", "dissipation", "history", "measurement"}
    model = build_model("braided", VALUES, able, [3, 5])
    check_model(model, States.from_table(visits()))
    assert model(States.from_table(visits())).loads.isfinite().all()
    with pytest.raises(UserError, match="'wall_stiffening' cannot join model 'braided'"):
        build_model("braided", effects=["wall_stiffening"])


def test_a_checkpoint_needs_the_file_named_again(tmp_path):
    load_own([str(BRAID)])
    model = build_model("braided", VALUES | {"force_gain.gain": 0.1}, ["force_gain"])
    save_checkpoint(model, tmp_path / "checkpoint.ckpt")
    again = load_model(tmp_path / "checkpoint.ckpt")
    states = States.from_table(visits())
    assert torch.equal(again(states).loads, model(states).loads)
    del MODELS["braided"]
    with pytest.raises(UserError, match=r"Unknown model 'braided'.*FREELEARN_MODELS"):
        load_model(tmp_path / "checkpoint.ckpt")


def test_the_search_finds_what_such_a_model_lacks():
    load_own([str(BRAID)])
    accuracy = Accuracy(1e-6, 1e-5, 10.0, 0.05, 1e-3)
    truth = build_model("braided", VALUES | {"pressure_offset.pressure": 4e3}, ["pressure_offset"])
    rows = rows_of(truth, noise=0.05, count=25)
    names = ["force_offset", "pressure_offset", "twist_offset", "relaxation"]
    found = search(Question(lambda effects: build_model("braided", effects=effects), names, rows, accuracy, 0))
    assert found.effects == ["pressure_offset"]


HEAD = BRAID.read_text().split("    def structure")[0]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (HEAD.replace('"braided"', '"linear"') + "    structure = None\n", "'linear' is taken"),
        (BRAID.read_text().replace("parameter_class = ", "taken = "), r"Model\[Braid\]: write parameter_class = Braid"),
        (HEAD, "BraidedMuscle .* is not a model: it must write the method structure"),
        (BRAID.read_text().replace('"braided"', '"my muscle"'), "'my muscle' is not a word"),
        (BRAID.read_text().replace("start=1e3", "start=-1e3"), "start of its parameter 'k' must lie within its bounds"),
        (HEAD + "    family = 'muscle'\n    structure = None\n", "its family 'muscle' is none of continuum"),
    ],
)
def test_what_is_wrong_with_an_own_model_is_said_in_one_sentence(content, message, tmp_path):
    before = list(MODELS)
    with pytest.raises(UserError, match=message) as raised:
        load_own([written(tmp_path, content)])
    assert "\n" not in str(raised.value)
    assert list(MODELS) == before


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("return -p.k * states.twist", r"shape \(8, 2\).*not of shape \(8,\).*columns"),
        ("return 3.0", "must return loads as a tensor, or a Prediction, not float"),
        ("return columns(states.length, p.k * states.twist).float()", "float64, not float32"),
        ("return columns(states.length, states.twist * p.k.detach())", "does not depend on its parameters"),
        ("return columns(states.length, p.k / (0 * states.twist))", "not finite at ordinary states"),
        ("return columns(states.lenght, states.twist)", "its structure failed with AttributeError: .*lenght"),
    ],
)
def test_an_own_model_that_returns_nonsense_is_told_before_the_fit(body, message, tmp_path):
    load_own([written(tmp_path, HEAD + f"    def structure(self, states, p):\n        {body}\n")])
    with pytest.raises(UserError, match=message) as raised:
        check_model(build_model("braided"), States.from_table(visits()))
    assert "'braided'" in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("said", ["loads", "Prediction(loads, torch.zeros(len(states), dtype=torch.uint8))"])
def test_rows_without_an_answer_are_marked_and_break_no_derivative(said, tmp_path):
    """√ of what is negative past 1 % of stretch: NaN in the loads and in every derivative of the row."""
    body = (
        "        stretch = states.length / states.reference_length - 1\n"
        "        loads = columns(-p.k * torch.sqrt(0.01 - stretch) * stretch, -p.k_t * states.twist)\n"
        f"        return {said}\n"
    )
    imports = "from freelearn.own import Prediction\n"
    path = written(tmp_path, imports + HEAD + "    def structure(self, states, p):\n" + body)
    load_own([path])
    states = States.from_table(visits(count=8))
    lost = states.length / states.reference_length - 1 > 0.01
    assert lost.any()
    assert (~lost).any()
    model = build_model("braided", VALUES)
    loads, status = model(states)
    assert torch.equal(status == Status.NO_EQUILIBRIUM, lost)
    assert loads.isfinite().all()
    problem = Problem(model, Rows.whole(states, torch.ones(len(states), 2).double(), np.arange(len(states))))
    vector = model.vector().detach()
    jacobian = problem.jacobians(vector[None])[0]
    assert jacobian.isfinite().all()
    torch.testing.assert_close(torch.func.jacfwd(problem.residual)(vector), jacobian)
    together = problem.residuals(torch.stack([vector, vector]))
    torch.testing.assert_close(together[0], problem.residual(vector))


WALL = """
from torch import Tensor
from freelearn.own import Continuum, Material, NeoHookean, parameter

class Coated(Material):
    C3: Tensor = parameter("C₃", "Pa", start=1e5, lower=0.0, log=True)

class CoatedTube(Continuum):
    name = "coated"
    parameter_class = Coated

    def base_energy(self, p):
        return [*super().base_energy(p), NeoHookean(p.C3)]
"""


def test_a_wall_of_ones_own_derives_from_the_continuum_and_takes_energies_too(tmp_path):
    """C1 and C3 add up, so the loads are those of the paper's wall with their sum; fits must not take a short cut."""
    load_own([written(tmp_path, WALL)])
    states = States.from_table(visits())
    coated = build_model("coated", {"C1": 7e5, "C2": 4e7, "C3": 3e5}, ["wall_stiffening"])
    check_model(coated, states)
    plain = build_model("continuum", TRUTH["continuum"], ["wall_stiffening"])
    torch.testing.assert_close(coated(states).loads, plain(states).loads, rtol=1e-9, atol=1e-10)
    rows = rows_of(build_model("continuum", TRUTH["continuum"]))
    model = build_model("coated", {"C3": 3e5})
    jacobian = Problem(model, rows).jacobians(model.vector().detach()[None])[0]
    assert jacobian.shape == (2 * len(rows), 3)
    assert float(jacobian[:, 2].abs().max()) > 0


BEFORE = sorted((ROOT / "tests/physics/written_before").glob("proposed_*.txt"))


@pytest.mark.parametrize("path", BEFORE, ids=lambda path: path.stem)
def test_a_file_that_imports_from_where_modules_were_is_read(path, tmp_path):
    """Effects that searches wrote before freelearn.own was there."""
    assert "from freelearn.models.ports" in path.read_text()
    (name,) = load_own([written(tmp_path, path.read_text())])
    states = States.from_table(visits())
    without = build_model("continuum", TRUTH["continuum"])(states).loads
    model = build_model("continuum", TRUTH["continuum"] | {f"{name}.amount": 0.0}, [name])
    assert torch.equal(model(states).loads, without)
    model = build_model("continuum", TRUTH["continuum"], [name])
    assert not torch.allclose(model(states).loads, without)
    check_effects(model.effects, model.values(), states)


def test_every_module_that_files_imported_from_is_found():
    for new in own.MOVED.values():
        assert importlib.util.find_spec(f"freelearn.{new}"), new
