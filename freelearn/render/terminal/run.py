"""What a run shows in the terminal: progress while it fits, a short table at the end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import lightning as L
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from freelearn.results.fit_report import INTERVAL, effect_notes, notes
from freelearn.results.run import Run
from freelearn.results.run_files import counts

if TYPE_CHECKING:
    from freelearn.inference.misfit import Misfit

MOST_FAILURES = 3


class FitProgress(L.Callback):
    """A bar of epochs with the present errors; silent where the output is not a terminal."""

    def __init__(self, console: Console, max_epochs: int) -> None:
        self.max_epochs = max_epochs
        columns = (TextColumn("fitting"), BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
        self.bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)

    def on_fit_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        self.bar.start()
        self.task = self.bar.add_task("", total=self.max_epochs)

    def on_train_batch_end(self, trainer: L.Trainer, pl_module: Any, *_: Any) -> None:
        epoch, train, held_out = pl_module.history[-1]
        text = f"epoch {epoch}  E train {100 * train:.3f} %"
        if pl_module.validation:
            text += f"  validation {100 * held_out:.3f} %"
        self.bar.update(self.task, completed=epoch, description=text)

    def teardown(self, trainer: L.Trainer, pl_module: L.LightningModule, stage: str) -> None:
        self.bar.stop()

    def on_exception(self, trainer: L.Trainer, pl_module: L.LightningModule, exception: BaseException) -> None:
        self.bar.stop()


def show_run(
    console: Console,
    run: Run,
    folder: Path,
    warnings: Sequence[str],
    simulated: bool,
    comparison: dict[str, dict[str, float]] | None = None,
    misfit: Misfit | None = None,
) -> None:
    """Errors by test set, parameters with 95 % intervals, what to know, and where the files are.

    comparison: E of each test set {without, with} effects, whole kinematic states held out. misfit: where it fails.
    """
    source = "simulated data" if simulated else "measured data"
    fitted = f"fitted on {run.train} by {run.method}" if run.uncertainty else f"not fitted ({run.train})"
    errors = Table(title=f"{run.model.name}, {fitted} ({source})", title_justify="left")
    for heading in ("test set", "E %", "force %", "moment %", "rows"):
        errors.add_column(heading, justify="left" if heading == "test set" else "right")
    for name, e in run.errors.items():
        label = f"{name} *" if name == run.train else name
        cells = [f"{100 * x:.2f}" if math.isfinite(x) else "–" for x in (e.E, e.E_force, e.E_moment)]
        errors.add_row(label, *cells, str(e.n))
    console.print(errors)
    if comparison:
        console.print(_comparison_table(comparison))
    if run.model.declared:
        console.print(_parameter_table(run))
    else:
        console.print(f"{len(run.model.vector())} weights and biases (in fit_report.txt)")
    if misfit:
        floor = (
            f"A perfect model would have E = {100 * misfit.noise_floor:.2f} % on {run.train}: the measuring's noise."
        )
        console.print(floor, highlight=False, soft_wrap=True)
        console.print("Where this one fails, worst first:", highlight=False)
        for failure in misfit.failures[:MOST_FAILURES]:
            console.print(f"  · {failure.sentence()}", markup=False, highlight=False)
    for note in [*_count_notes(run), *_fit_notes(run), *warnings]:
        console.print(f"! {note}", markup=False, highlight=False)
    # Printed plainly: a wrapped or coloured path cannot be copied.
    console.print(f"files: {folder}", markup=False, highlight=False, soft_wrap=True)


def _fit_notes(run: Run) -> list[str]:
    return [*notes(run.model, run.start), *effect_notes(run.model, run.uncertainty)] if run.uncertainty else []


def _comparison_table(comparison: dict[str, dict[str, float]]) -> Table:
    table = Table(title="whole kinematic states held out", title_justify="left")
    for heading in ("test set", "E without %", "E with effects %", "ratio"):
        table.add_column(heading, justify="left" if heading == "test set" else "right")
    for name, pair in comparison.items():
        without, together = pair["without"], pair["with"]
        ratio = f"{together / without:.2f}" if without > 0 else "–"
        table.add_row(name, f"{100 * without:.2f}", f"{100 * together:.2f}", ratio)
    return table


def _parameter_table(run: Run) -> Table:
    table = Table()
    for heading in ("parameter", "value", "± stderr", "95 % from", "to", "unit"):
        table.add_column(heading, justify="left" if heading in ("parameter", "unit") else "right", overflow="fold")
    error = dict(zip(run.uncertainty.names, run.uncertainty.stderr, strict=True)) if run.uncertainty else {}
    for name, value in run.model.scalars().items():
        e = error.get(name, math.nan)
        known = math.isfinite(e)
        low, high = (f"{value + side * INTERVAL * e:.4g}" if known else "–" for side in (-1, 1))
        unit = run.model.declared[name].unit
        table.add_row(name, f"{value:.5g}", f"{e:.2g}" if known else "–", low, high, unit)
    return table


def _count_notes(run: Run) -> list[str]:
    number = counts(run)
    rows = number.pop("rows")
    number.pop("used")
    meaning = {
        "buckled": "buckled",
        "no_equilibrium": "without an equilibrium (the model's tube balloons)",
        "singular": "at the linear model's singularity (fibres along the axis)",
        "overstretched": "longer than an inextensible fibre allows",
    }
    parts = [f"{n} {meaning[key]}" for key, n in number.items() if n]
    return [f"{rows} rows, neither fitted nor scored: {'; '.join(parts)}."] if parts else []
