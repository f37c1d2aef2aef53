"""`train`: from settings to a run's files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd
from rich.console import Console

from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.fit_and_score import Progress, can_hold_out, compare, run
from freelearn.api.tasks.loaded_table import LoadedTable, load_table, seal
from freelearn.api.tasks.preparation import (
    Mistakes,
    check_numbers,
    known_model,
    known_of,
    measuring,
    own_values,
    resolve_device,
)
from freelearn.common.cores import configure_runtime, give_back
from freelearn.common.errors import UserError
from freelearn.common.progress import watched
from freelearn.data.columns import members_in
from freelearn.data.logs import is_log
from freelearn.data.sets import CONSTITUENT_SET, samples_of
from freelearn.data.states import States
from freelearn.discovery.residuals.failures import misfit
from freelearn.discovery.search.testable import assumptions
from freelearn.fitting.options import NORMAL
from freelearn.fitting.profiles import ProgressCallback
from freelearn.fitting.store import FitStore
from freelearn.physics.chain.known_parameters import Known
from freelearn.physics.chain.model import Model
from freelearn.physics.effects.effect_check import ROWS, check_effects
from freelearn.physics.effects.registry import missing_columns
from freelearn.physics.models.build import build_model, check_model
from freelearn.physics.models.continuum import CONSTITUENT
from freelearn.physics.models.own_files import load_own_code
from freelearn.queries.curves.log_spectra import Spectrum, log_spectra
from freelearn.queries.curves.model_curves import StateCurves
from freelearn.queries.curves.run_curves import run_curves
from freelearn.records.provenance import Origin
from freelearn.records.run import Run
from freelearn.records.run_files import begin_results, check_folder, predictions, training_samples, write_run
from freelearn.report.terminal.long_work import LongWork, ProfileProgress

if TYPE_CHECKING:
    from lightning import Callback


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
        members = len(members_in(self.loaded.table.columns)) if chosen.per_sample else 0
        effects = chosen.effects if with_effects else ()
        samples = self.samples if chosen.per_sample else []
        return build_model(chosen.model.name, own_values(chosen), effects, samples, members, self.known)

    @cached_property
    def known(self) -> Known:
        """What is known of the parameters beforehand."""
        return known_of(self.settings)


def train(
    settings: TrainSettings,
    folder: Path,
    key: str = "",
    console: Console | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> Run:
    """Fits, evaluates and writes a run's files to `folder`. Raises UserError.

    key: digest of all that the results depend on, kept with them. console: where progress and tables are shown; what is
    computed and written does not depend on it. command: the shell command that repeats the run, for the report.
    progress: makes what is told of epochs, instead of the console.
    """
    configure_runtime()
    with _saying(console, "reading the table…"):
        task = _prepared(settings, folder)
    store = FitStore(settings.fits) if settings.fits else None
    give_back()
    with ProfileProgress(console) as told:
        outcome = _run(task, folder, _bar(console, settings, progress), store, told=told)
    give_back()
    with _saying(console, "evaluating…"):
        predicted = predictions(outcome)
        own = training_samples(outcome, predicted)
        outcome, notes = _judged(task, outcome, own, folder, store)
    if store and store.unkept:
        notes.append(f"the fit could not be kept for other runs: {store.unkept.rstrip('.')}")
    _write(task, outcome, predicted, own, folder, _origin(task, notes, key), command, console)
    return outcome


@contextmanager
def _saying(console: Console | None, what: str) -> Iterator[None]:
    """Shows what is done, and how far it is where that takes long; nothing where the output is not a terminal."""
    with LongWork(console, what) as shown, watched(shown):
        yield


def _prepared(settings: TrainSettings, folder: Path) -> _Task:
    """Everything that can be wrong before a fit, checked. Raises UserError with all of it."""
    load_own_code()
    mistakes = Mistakes()
    # Names and values before the work of making a table.
    mistakes.check(lambda: known_model(settings))
    constituents = mistakes.check(lambda: _constituents(settings.constituent, settings.effects))
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
    check_numbers(task.known, model)
    if lacking := missing_columns(model.effects, loaded.table.columns):
        raise UserError(lacking)
    few = States.from_table(loaded.table[:ROWS])
    check_model(model, few)
    check_effects(model.effects, model.values(), few)
    return task


def _run(
    task: _Task,
    folder: Path | None,
    progress: Progress | None,
    store: FitStore | None,
    with_effects: bool = True,
    by_states: bool | None = None,
    told: ProgressCallback | None = None,
) -> Run:
    """One model, fitted and evaluated as the settings say. by_states: instead of the settings' split, for errors."""
    settings = task.settings
    split, fit = settings.split, settings.fit
    if fit and by_states is not None:
        # Of a comparison nobody sees the intervals.
        fit = replace(fit, intervals=NORMAL)
    return run(
        task.build(with_effects),
        task.loaded.table,
        settings.train,
        settings.test,
        fit,
        settings.seed,
        by_states=split.by_states if by_states is None else by_states,
        shares=(split.train, split.validation),
        folder=folder,
        progress=progress,
        store=store,
        constituents=task.constituents,
        device=task.device,
        told=told,
    )


def _judged(
    task: _Task, outcome: Run, own: pd.DataFrame, folder: Path, store: FitStore | None
) -> tuple[Run, list[str]]:
    """The run with what its residuals say, and notes on what was estimated or assumed.

    own: predictions of the samples that were fitted.
    """
    settings = task.settings
    notes = assumptions(settings.effects, task.loaded.table.columns)
    if settings.effects and settings.fit and settings.train != CONSTITUENT_SET:

        def one(with_effects: bool, inside: Path) -> Run:
            return _run(task, inside, None, store, with_effects, by_states=True)

        tested = settings.train if settings.test == "every" else settings.test
        shares = (settings.split.train, settings.split.validation)
        if can_hold_out(task.loaded.table, tested, settings.seed, shares):
            outcome = replace(outcome, comparison=compare(one, folder))
        else:
            notes.append("errors without and with the effects are not compared: no kinematic state can be held out")
    measured = measuring(outcome.model, own, settings.data.accuracy)
    if measured is None:
        return outcome, notes
    judged = replace(outcome, misfit=misfit(outcome.model, own, measured.accuracy), accuracy=measured.accuracy)
    return judged, [*measured.notes, *notes]


def _origin(task: _Task, notes: list[str], key: str) -> Origin:
    settings, split = task.settings, task.settings.split
    shares = (split.train, split.validation)
    return Origin(task.loaded.provenance, settings.seed, split.name, shares, task.device, key, tuple(notes))


def _write(
    task: _Task,
    outcome: Run,
    predicted: pd.DataFrame,
    own: pd.DataFrame,
    folder: Path,
    origin: Origin,
    command: str,
    console: Console | None,
) -> None:
    """The run's files, and what the terminal shows of it."""
    # TensorBoard's and the report's libraries: not before there are results.
    from freelearn.report.html.run_report import report_run
    from freelearn.report.tensorboard_log import log_run

    give_back()
    with _saying(console, "drawing and writing…"):
        begin_results(folder)
        log_run(outcome, folder, origin)
        shown: list[StateCurves] = []
        spectra: list[Spectrum] = []
        if task.settings.figures:
            # matplotlib costs a second to import: only when there is something to draw.
            from freelearn.report.plots.tensorboard_figures import log_figures

            shown = run_curves(outcome, own, task.settings.bands, task.settings.split.by_states)
            if is_log(own):
                spectra = log_spectra(outcome.model, own, outcome.accuracy)
            log_figures(outcome, own, shown, folder, origin.provenance.simulated, spectra)
        report_run(outcome, folder, origin, command, own if task.settings.figures else None, shown, spectra)
        write_run(outcome, predicted, folder, origin)
    if console:
        from freelearn.report.terminal.printed_run import show_run

        show_run(console, outcome, folder, [*task.loaded.warnings, *origin.notes], origin)


def _bar(console: Console | None, settings: TrainSettings, progress: Progress | None) -> Progress | None:
    if progress or not console or not settings.fit:
        return progress
    epochs = settings.fit.max_epochs

    def bar() -> Callback:
        # A callback of Lightning's, which is imported by then.
        from freelearn.report.terminal.fit_progress import FitProgress

        return FitProgress(console, epochs)

    return bar


def _constituents(path: Path | None, effects: Sequence[str]) -> Mapping[str, float]:
    """Values of train=constituent: the paper's, or those of a specimen.json. Raises UserError."""
    if path is None:
        return CONSTITUENT
    from freelearn.records.specimen_record import load_parameters

    parameters = load_parameters(path)
    lacking = sorted({name.split(".")[0] for name in parameters if "." in name} - set(effects))
    if lacking:
        raise UserError(
            f"{path} holds constants of {', '.join(lacking)}, which the model lacks: "
            f"add effects=[{','.join([*effects, *lacking])}]."
        )
    return CONSTITUENT | parameters
