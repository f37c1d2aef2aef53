"""The epochs of a fit as Lightning makes them, told to whoever looks on, and as a bar in the terminal."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import lightning as L
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn


class Epochs(L.Callback):
    """told: called after each epoch with how many there were, the training error and the validation error."""

    def __init__(self, told: Callable[[int, float, float], None]) -> None:
        self.told = told

    def on_train_batch_end(self, trainer: L.Trainer, pl_module: Any, *_: Any) -> None:
        """Lightning's hook: the latest entry of the fit's history."""
        self.told(*pl_module.history[-1])


class FitProgress(Epochs):
    """A bar of epochs with the present errors; silent where the output is not a terminal."""

    def __init__(self, console: Console, max_epochs: int) -> None:
        super().__init__(self._show)
        self.max_epochs = max_epochs
        columns = (TextColumn("fitting"), BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
        self.bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)

    def on_fit_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Lightning's hook: shows the bar."""
        self.bar.start()
        self.task = self.bar.add_task("", total=self.max_epochs)

    def _show(self, epoch: int, train: float, validation: float) -> None:
        text = f"epoch {epoch}  E train {100 * train:.3f} %"
        # Without validation rows a fit's history repeats the training error.
        if validation != train:
            text += f"  validation {100 * validation:.3f} %"
        self.bar.update(self.task, completed=epoch, description=text)

    def teardown(self, trainer: L.Trainer, pl_module: L.LightningModule, stage: str) -> None:
        """Lightning's hook: takes the bar away."""
        self.bar.stop()

    def on_exception(self, trainer: L.Trainer, pl_module: L.LightningModule, exception: BaseException) -> None:
        """Lightning's hook: takes the bar away."""
        self.bar.stop()
