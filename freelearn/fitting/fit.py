"""Fitting a model to training rows: starts, the run by Lightning, and the rows that have to stay out."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import lightning as L
import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.rows import Rows
from freelearn.fitting.algorithm import Algorithm, GradientEpochs, LevenbergMarquardtEpochs
from freelearn.fitting.finish import finish
from freelearn.fitting.options import LEVENBERG_MARQUARDT, FitOptions, Option
from freelearn.fitting.problem import Problem, Pull, pulled
from freelearn.fitting.starts import starts, with_delay
from freelearn.fitting.store import FitOutcome
from freelearn.fitting.training import FitData, Fitting, run
from freelearn.physics.chain.history import settled_flicker
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status

# Most rounds in which the rows of the loss may change.
ROUNDS = 8
# Rounds of them before which a log's flicker is told anew: from where a fit starts, and from where it came to.
FLICKERS = 2


def fit(
    model: Model,
    train: Rows,
    validation: Rows,
    options: FitOptions,
    seed: int,
    folder: Path | None = None,
    progress: L.Callback | None = None,
    device: str = "cpu",
) -> FitOutcome:
    """Fits `model` in place, on a device (cpu or cuda). Raises UserError when there are too few rows.

    folder: where TensorBoard's curves go. progress: a callback that follows Fitting.history.

    The first round takes all rows; one that has no answer (no equilibrium, singular, overstretched) counts with the
    finite loads that the model puts there. Rows without an answer at the solution then leave the loss, and the fit
    goes on with the rest, until the set agrees with itself. If leaving them out drives further rows out, the first
    round's fit stands: otherwise a model could lower its loss by explaining less. What a user knows of
    parameters beforehand enters last, weighed by that fit's residuals.
    """
    generator = torch.Generator().manual_seed(seed)
    if pulled(model) and options.name != LEVENBERG_MARQUARDT:
        raise UserError(f"What is known of parameters is heeded by fit={LEVENBERG_MARQUARDT} alone: choose that.")
    initial = model.vector().detach().clone()
    kept, kept_validation = (torch.ones(len(rows), dtype=torch.bool) for rows in (train, validation))
    _check_count(model, len(train), len(train))
    model.prepare(train)
    places = starts(model, train, options.restarts if model.needs_restarts else 1, generator)
    places = torch.stack([with_delay(model, train, place) for place in places])
    history: list[tuple[int, float, float]] = []
    settled, ended = None, (False, "")
    for turn in range(ROUNDS):
        if turn < FLICKERS:
            train, validation = (_settled(model, rows) for rows in (train, validation))
        make = partial(_algorithm, starts=places, options=options, generator=generator)
        module = Fitting(model, make, options.max_epochs, options.patience, options.race)
        data = FitData(_some(train, kept), _some(validation, kept_validation))
        run(module, data, folder, progress, device)
        data.release()
        offset = history[-1][0] + 1 if history else 0
        history += [(epoch + offset, error, watched) for epoch, error, watched in module.history]
        now, now_validation = _ok(model, train), _ok(model, validation)
        if settled is not None and bool((kept & ~now).any()):
            # Leaving rows out drove others out: it rewards a model that explains less. The fit before stands.
            model.set_vector(settled)
            module.converged, module.message = ended
            kept, kept_validation = torch.ones_like(kept), torch.ones_like(kept_validation)
            break
        same = torch.equal(now, kept) and torch.equal(now_validation, kept_validation)
        if same and (turn >= FLICKERS - 1 or not model.remembers(train.states)):
            break
        settled, ended = model.vector().detach().clone(), (module.converged, module.message)
        places = settled[None]
        kept, kept_validation = now, now_validation
        _check_count(model, int(kept.sum()), len(train))
    if pulled(model):
        # The rows that have an answer are settled by then.
        module.converged, module.message = _pulled(
            model, _some(train, kept), _some(validation, kept_validation), options, history
        )
    finish(model, _some(train, kept))
    return FitOutcome(kept.numpy(), initial, history, module.message, module.converged)


def _pulled(
    model: Model, train: Rows, validation: Rows, options: FitOptions, history: list[tuple[int, float, float]]
) -> tuple[bool, str]:
    """Goes on from the least sum of squares with what is known beforehand; whether that came to its end, and how."""
    here = model.vector().detach().clone()
    pull = Pull.from_problem(Problem(model, train), here)

    def make(problem: Problem) -> Algorithm:
        return LevenbergMarquardtEpochs(problem, here[None], options.max_epochs, options.tolerance, pull)

    module = Fitting(model, make, options.max_epochs, options.patience)
    run(module, FitData(train, validation))
    history += [(epoch + history[-1][0] + 1, error, watched) for epoch, error, watched in module.history]
    return module.converged, module.message


def _settled(model: Model, rows: Rows) -> Rows:
    """Rows of a log with what its gauges' noise makes of the loads about the model as it is."""
    if not model.remembers(rows.states):
        return rows
    return replace(rows, states=settled_flicker(model, rows.states, model.values()))


def _some(rows: Rows, kept: Tensor) -> Rows:
    return rows if bool(kept.all()) else rows[kept]


def _ok(model: Model, rows: Rows) -> Tensor:
    if not len(rows):
        return torch.ones(0, dtype=torch.bool)
    with torch.no_grad():
        status: Tensor = model(rows.states).status
        return status == Status.OK


def _check_count(model: Model, rows: int, offered: int) -> None:
    parameters = int(model.free.sum())
    if rows < parameters:
        lost = f" ({offered - rows} of {offered} have no valid prediction)" if offered > rows else ""
        raise UserError(
            f"Model {model.name} has {parameters} parameters but the training set has only {rows} usable rows{lost}: "
            "choose a larger training set or a smaller model."
        )


def _algorithm(problem: Problem, starts: Tensor, options: FitOptions, generator: torch.Generator) -> Algorithm:
    starts = starts.to(problem.scale.device)
    if options.name == LEVENBERG_MARQUARDT:
        return LevenbergMarquardtEpochs(problem, starts, options.max_epochs, options.tolerance)
    decay: dict[str, Option] = {"weight_decay": options.weight_decay} if options.weight_decay else {}
    return GradientEpochs(
        options.name,
        problem,
        starts,
        options.max_epochs,
        options.learning_rate,
        options.batch_size,
        decay | dict(options.optimizer),
        generator,
    )
