"""`train`: from settings to a run's files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lightning as L
import pandas as pd
from rich.console import Console

from freelearn.commands.accuracy import measuring
from freelearn.commands.comparison import compare
from freelearn.commands.device import resolve_device
from freelearn.commands.mistakes import Mistakes
from freelearn.commands.settings import TrainSettings
from freelearn.commands.tables import LoadedTable, load_table, seal
from freelearn.errors import UserError
from freelearn.fit.store import FitStore
from freelearn.inference.misfit import Misfit, misfit
from freelearn.measurements.sets import samples_of
from freelearn.measurements.states import States
from freelearn.models.base import Model
from freelearn.models.build import build_model
from freelearn.models.continuum import CONSTITUENT
from freelearn.models.effects.check import ROWS, check_effects
from freelearn.models.effects.registry import missing_columns
from freelearn.models.own import load_own_code
from freelearn.results.curve import StateCurves, state_curves
from freelearn.results.run import CONSTITUENT_SET, Run, run
from freelearn.results.run_files import check_folder, predictions, training_samples, write_run
from freelearn.results.states import pick_states
from freelearn.threads import one_thread


@dataclass(frozen=True)
class _Task:
    """What is fitted on what."""

    settings: TrainSettings
    loaded: LoadedTable
    samples: list[int]
    constituents: Mapping[str, float]
    device: str

    def build(self, with_effects: bool = True) -> Model:
        """A fresh model."""
        chosen = self.settings
        return build_model(chosen.model.name, chosen.model.values, chosen.effects if with_effects else (), self.samples)


def train(
    settings: TrainSettings,
    folder: Path,
    key: str = "",
    console: Console | None = None,
    command: str = "",
    progress: L.Callback | None = None,
) -> Run:
    """Fits, evaluates and writes a run's files to `folder`. Raises UserError.

    key: digest of all that the results depend on, kept with them. console: where progress and tables are shown; what is
    computed and written does not depend on it. command: the shell command that repeats the run, for the report.
    progress: told of epochs, instead of the console.
    """
    one_thread()
    task = _prepared(settings, folder)
    store = FitStore(settings.fits) if settings.fits else None
    outcome = _run(task, folder, _bar(console, settings, progress), store)
    judged = _judged(task, outcome, folder, store)
    _write(task, outcome, judged, folder, key, command, console)
    return outcome


def _prepared(settings: TrainSettings, folder: Path) -> _Task:
    """Everything that can be wrong before a fit, checked. Raises UserError with all of it."""
    load_own_code()
    mistakes = Mistakes()
    # Names and values before the work of making a table.
    mistakes.check(lambda: build_model(settings.model.name, settings.model.values, settings.effects))
    constituents = mistakes.check(lambda: _constituents(settings.constituent))
    device = mistakes.check(lambda: resolve_device(settings.device))
    mistakes.check(lambda: check_folder(folder))
    mistakes.tell()
    assert constituents is not None
    assert device is not None
    loaded = load_table(settings.data)
    seal(settings.data, folder)
    sample = loaded.table["sample"].to_numpy()
    fitted = settings.train != CONSTITUENT_SET
    samples = mistakes.check(lambda: [int(n) for n in samples_of(settings.train, sample)] if fitted else [])
    if settings.test != "every":
        mistakes.check(lambda: samples_of(settings.test, sample))
    mistakes.tell()
    task = _Task(settings, loaded, samples or [], constituents, device)
    model = task.build()
    if lacking := missing_columns(model.effects, loaded.table.columns):
        raise UserError(lacking)
    check_effects(model.effects, model.values(), States.from_table(loaded.table[:ROWS]))
    return task


def _run(
    task: _Task,
    folder: Path | None,
    progress: L.Callback | None,
    store: FitStore | None,
    with_effects: bool = True,
    by_states: bool | None = None,
) -> Run:
    """One model, fitted and evaluated as the settings say; by_states: instead of the settings' split."""
    settings = task.settings
    split = settings.split
    return run(
        task.build(with_effects),
        task.loaded.table,
        settings.train,
        settings.test,
        settings.fit,
        settings.seed,
        by_states=split.by_states if by_states is None else by_states,
        shares=(split.train, split.validation),
        folder=folder,
        progress=progress,
        store=store,
        constituents=task.constituents,
        device=task.device,
    )


@dataclass(frozen=True)
class _Judged:
    """What a run's residuals say. comparison: E of each test set {without, with} effects, None without effects. misfit:
    where it fails; None with too few rows. notes: on how accurate the measuring was, where that is estimated."""

    comparison: dict[str, dict[str, float]] | None
    misfit: Misfit | None
    notes: list[str]


def _judged(task: _Task, outcome: Run, folder: Path, store: FitStore | None) -> _Judged:
    settings, comparison = task.settings, None
    if settings.effects and settings.fit and settings.train != CONSTITUENT_SET:

        def one(with_effects: bool, inside: Path) -> Run:
            return _run(task, inside, None, store, with_effects, by_states=True)

        comparison = compare(one, folder)
    own = training_samples(outcome, predictions(outcome))
    measured = measuring(outcome.model, own, settings.data.accuracy)
    if measured is None:
        return _Judged(comparison, None, [])
    return _Judged(comparison, misfit(outcome.model, own, measured.accuracy), measured.notes)


def _about(task: _Task, judged: _Judged, key: str) -> dict[str, Any]:
    """What results.json holds beside the outcome itself."""
    settings, split = task.settings, task.settings.split
    about: dict[str, Any] = {"seed": settings.seed, "split": split.name}
    about |= {"shares": {"train": split.train, "validation": split.validation}, "device": task.device}
    about |= {"data": task.loaded.provenance.plain(), "key": key}
    if judged.comparison:
        about["comparison"] = judged.comparison
    if judged.misfit:
        about["noise_floor"] = judged.misfit.noise_floor
        about["failures"] = [failure.numbers() for failure in judged.misfit.failures]
    if judged.notes:
        about["notes"] = judged.notes
    return about


def _write(
    task: _Task, outcome: Run, judged: _Judged, folder: Path, key: str, command: str, console: Console | None
) -> None:
    """The run's files, and what the terminal shows of it."""
    simulated, about = task.loaded.provenance.simulated, _about(task, judged, key)
    predicted = predictions(outcome)
    # TensorBoard's and the report's libraries: not before there are results.
    from freelearn.render.html.run import report_run
    from freelearn.render.tensorboard.run import log_run

    log_run(outcome, folder)
    own: pd.DataFrame | None = None
    shown: list[StateCurves] = []
    if task.settings.figures:
        # matplotlib costs a second to import: only when there is something to draw.
        from freelearn.render.tensorboard.figures import log_figures

        own = training_samples(outcome, predicted)
        shown = state_curves({outcome.model.name: outcome.model}, own, pick_states(own))
        log_figures(outcome, own, shown, folder, simulated)
    report_run(outcome, folder, about, command, own, shown)
    write_run(outcome, predicted, folder, about)
    if console:
        from freelearn.render.terminal.run import show_run

        warnings = [*task.loaded.warnings, *judged.notes]
        show_run(console, outcome, folder, warnings, simulated, judged.comparison, judged.misfit)


def _bar(console: Console | None, settings: TrainSettings, progress: L.Callback | None) -> L.Callback | None:
    if progress or not console or not settings.fit:
        return progress
    from freelearn.render.terminal.run import FitProgress

    return FitProgress(console, settings.fit.max_epochs)


def _constituents(path: Path | None) -> Mapping[str, float]:
    """Values of train=constituent: the paper's, or those of a specimen.json. Raises UserError."""
    if path is None:
        return CONSTITUENT
    from freelearn.results.specimen import load_parameters

    return CONSTITUENT | load_parameters(path)
