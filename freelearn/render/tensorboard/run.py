"""A run's numbers in TensorBoard: errors, and the hyperparameter table. Needs no matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from torch.utils.tensorboard import SummaryWriter
from torch.utils.tensorboard.summary import hparams

from freelearn.results.run import Run


def log_run(run: Run, folder: Path) -> None:
    """Writes errors by test set and hyperparameters; of a reused fit also the errors by iteration."""
    with SummaryWriter(str(folder)) as writer:
        if run.reused:
            for epoch, train, validation in run.history:
                writer.add_scalar("error/train", train, epoch)
                if run.model.needs_validation:
                    writer.add_scalar("error/validation", validation, epoch)
        for name, error in run.errors.items():
            writer.add_scalar(f"test/{name}", error.E, 0)
        settings = {
            "model": run.model.name,
            "train": run.train,
            "fit": run.method,
            "effects": ",".join(e.name for e in run.model.effects),
        }
        metrics = {f"test/{name}": e.E for name, e in run.errors.items()}
        # add_hparams would open a second event file in a folder of its own.
        file = writer._get_file_writer()
        # Nor is it declared with types.
        make: Any = hparams
        for summary in make(settings, metrics):
            file.add_summary(summary)
