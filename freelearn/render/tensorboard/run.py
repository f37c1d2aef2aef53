"""A run's numbers in TensorBoard: errors, and the hyperparameter table. Needs no matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from torch.utils.tensorboard.summary import hparams

from freelearn.render.events import event_file
from freelearn.results.origin import Origin
from freelearn.results.run import Run
from freelearn.results.run_scores import scores
from freelearn.results.story import run_story


def log_run(run: Run, folder: Path, origin: Origin | None = None) -> None:
    """Writes errors by test set, hyperparameters and the run's story, after what the fit wrote; of a reused fit also
    the errors by iteration. What an earlier run left in the folder is replaced. origin: None for a part of a run, which
    has no story of its own."""
    wrote = bool(run.history) and not run.reused
    with event_file(folder, go_on=wrote) as writer:
        if run.reused:
            for epoch, train, validation in run.history:
                writer.add_scalar("error/train", train, epoch)
                if run.model.needs_validation:
                    writer.add_scalar("error/validation", validation, epoch)
        for name, error in run.errors.items():
            writer.add_scalar(f"test/{name}", error.E, 0)
        settings: dict[str, str | int] = {
            "model": run.model.name,
            "train": run.train,
            "fit": run.method,
            "effects": ",".join(e.name for e in run.model.effects),
        }
        known = {f"error/{name}": value for name, value in scores(run)._asdict().items() if value is not None}
        metrics = {f"test/{name}": e.E for name, e in run.errors.items()} | known
        if origin:
            settings |= {"seed": origin.seed, "split": origin.split}
            writer.add_text("story", run_story(run, origin))
        for name, value in known.items():
            writer.add_scalar(name, value, 0)
        # add_hparams would open a second event file in a folder of its own.
        file = writer._get_file_writer()
        # Nor is it declared with types.
        make: Any = hparams
        for summary in make(settings, metrics):
            file.add_summary(summary)
