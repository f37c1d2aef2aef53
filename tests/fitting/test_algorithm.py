"""Optimizers by name, how fits end, one trainer for all, and tensors that stay on their device."""

import lightning as L
import numpy as np
import pytest
import torch

from freelearn.common.errors import UserError
from freelearn.data.rows import Rows
from freelearn.fitting.fit import FitOptions, fit
from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.optimizers import make_optimizer, optimizer_names
from freelearn.fitting.problem import Problem
from freelearn.fitting.starts import starts
from freelearn.fitting.training import Fitting, _trainer
from freelearn.physics.models.build import build_model
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.models.linear import Linear
from freelearn.physics.models.mlp import MLP

LM = FitOptions("levenberg_marquardt", max_epochs=300, restarts=1, patience=6)
# What torch.optim offers whose steps mix the numbers of a tensor, or that wants something else than a gradient.
COUPLED = {"lbfgs", "sparseadam", "adafactor", "muon"}


@pytest.fixture
def rows(random_states):
    states = random_states(120)
    with torch.no_grad():
        loads = Linear(ka=1500.0, kb=0.15, kc=4.0)(states).loads
    noise = torch.randn(loads.shape, dtype=loads.dtype, generator=torch.Generator().manual_seed(0))
    return Rows.whole(states, loads + 0.02 * loads.abs().amax(0) * noise, np.arange(120) // 10)


def nothing(rows: Rows) -> Rows:
    return rows[torch.arange(0)]


@pytest.mark.parametrize("name", optimizer_names())
def test_an_optimizer_fits_restarts_side_by_side_or_is_refused(name):
    parameter = torch.ones(2, 3, dtype=torch.float64, requires_grad=True)
    if name in COUPLED:
        with pytest.raises(UserError, match="side by side"):
            make_optimizer(name, parameter, {"lr": 0.1})
    else:
        assert type(make_optimizer(name, parameter, {"lr": 0.1})).__name__.lower() == name


@pytest.mark.parametrize(
    ("name", "settings"),
    [("sgd", {"momentum": 0.9}), ("rmsprop", {"alpha": 0.95}), ("adagrad", {}), ("RAdam", {"betas": (0.9, 0.99)})],
)
def test_any_optimizer_lowers_the_error(name, settings, rows):
    options = FitOptions(name, 20, 2, 20, learning_rate=0.02, batch_size=32, optimizer=settings)
    history = fit(MLP(), rows, nothing(rows), options, seed=0).history
    assert history[-1][1] < 0.8 * history[0][1]


@pytest.mark.parametrize(
    ("name", "settings", "says"),
    [
        ("adm", {}, "Did you mean 'adam'"),
        ("zz", {}, "Choose one of levenberg_marquardt, none"),
        ("sgd", {"beta": 1.0}, "takes no option beta: choose from lr, momentum"),
        ("adam", {"betas": (2.0, 0.9)}, "does not work with"),
    ],
)
def test_mistakes_in_an_optimizer_are_named(name, settings, says, rows):
    with pytest.raises(UserError, match=says):
        fit(Linear(), rows, nothing(rows), FitOptions(name, 5, 1, 5, optimizer=settings), seed=0)


def test_a_fit_says_whether_it_converged(rows):
    done = fit(Linear(), rows, nothing(rows), LM, seed=0)
    assert done.converged
    assert done.message.startswith("Converged")
    tube = Rows.whole(rows.states, Continuum(1e6, 2e7)(rows.states).loads.detach(), rows.state)
    short = fit(Continuum(), tube, nothing(rows), FitOptions("levenberg_marquardt", 2, 1, 6), seed=0)
    assert not short.converged
    assert "iteration limit" in short.message
    early = fit(MLP(), tube[torch.arange(90)], tube[torch.arange(90, 120)], LM, seed=0)
    assert early.converged
    assert early.message == "Stopped early: no clearly better validation error in 6 epochs."


def test_the_message_is_that_of_the_member_that_is_kept(monkeypatch):
    """Of two restarts the second is the better one, and the first ran into its limit."""

    class Two:
        epochs = 0
        vectors = torch.tensor([[1.0], [2.0]], dtype=torch.float64)
        losses = torch.tensor([4.0, 1.0], dtype=torch.float64)
        finished = torch.tensor([True, True])

        def ended(self, member):
            return member == 1, f"member {member}"

    module = Fitting(Linear(), lambda problem: Two(), 10, 5)
    module.problem = module.validation = None
    module._error = lambda losses, problem: losses
    module.best = Two.vectors.clone()
    module.best_error = torch.full((2,), torch.inf, dtype=torch.float64)
    module.__dict__["_trainer"] = None
    monkeypatch.setattr(Fitting, "logger", None)
    assert module._look(Two())
    assert (module.converged, module.message) == (True, "member 1")


def test_one_trainer_serves_every_fit_and_keeps_nothing_of_them(rows):
    class Counts(L.Callback):
        batches = 0

        def on_train_batch_end(self, *_):
            self.batches += 1

    counts = Counts()
    first = fit(Linear(), rows, nothing(rows), LM, seed=0, progress=counts)
    seen = counts.batches
    assert seen >= 1
    trainer = _trainer("cpu")
    again = fit(Linear(), rows, nothing(rows), LM, seed=0)
    assert _trainer("cpu") is trainer
    assert counts.batches == seen
    # Where a tensor lies in memory decides the order of a sum, and so its last bit.
    np.testing.assert_allclose(again.history, first.history, rtol=1e-12)


def test_a_trainer_that_broke_off_is_not_used_again(rows):
    class Breaks(L.Callback):
        def on_train_batch_end(self, *_):
            raise KeyboardInterrupt

    trainer = _trainer("cpu")
    with pytest.raises(KeyboardInterrupt):
        fit(Linear(), rows, nothing(rows), LM, seed=0, progress=Breaks())
    assert _trainer("cpu") is not trainer
    assert fit(Linear(), rows, nothing(rows), LM, seed=0).converged


CASES = [("continuum", []), ("linear", []), ("mlp", []), ("continuum", ["fiber_tension_only", "force_offset"])]


@pytest.mark.parametrize(("name", "effects"), CASES)
def test_a_fit_makes_no_tensor_where_the_model_is_not(name, effects, rows):
    """With a default device of another kind, every tensor made without saying where would end there and not fit."""
    model = build_model(name, {}, effects)
    model.prepare(rows)
    start = starts(model, rows, 2 if name == "mlp" else 1, torch.Generator().manual_seed(0))
    bounds = model.raw_bounds()
    with torch.device("meta"):
        problem = Problem(model, rows)
        solver = LevenbergMarquardt(
            problem.residuals, problem.jacobians, lower=bounds[0], upper=bounds[1], batched=True, max_iterations=3
        )
        state = solver.init(start)
        while state.running:
            state = solver.step(state)
        assert state.x.device.type == "cpu"
        assert state.loss.isfinite().all()


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU in this machine")
@pytest.mark.parametrize("name", ["continuum", "linear", "mlp"])
def test_a_fit_on_the_gpu_is_that_on_the_cpu(name, rows):
    validation = rows[torch.arange(100, 120)] if name == "mlp" else nothing(rows)
    fitted = {}
    for device in ("cpu", "cuda"):
        model = build_model(name)
        fit(model, rows[torch.arange(100)], validation, LM, seed=0, device=device)
        assert model.vector().device.type == "cpu"
        with torch.no_grad():
            fitted[device] = model(rows.states).loads
    torch.testing.assert_close(fitted["cuda"], fitted["cpu"], rtol=1e-4, atol=1e-4)
