"""A run's numbers in TensorBoard: errors, and the hyperparameter table. Needs no matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from torch.utils.tensorboard.summary import hparams

from freelearn.render.events import FITTED, event_file
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
                writer.add_scalar("error_percent/train", 100 * train, epoch)
                if run.model.needs_validation:
                    writer.add_scalar("error_percent/validation", 100 * validation, epoch)
        for name, error in run.errors.items():
            writer.add_scalar(f"test_error_percent/{name}", 100 * error.E, 0)
        # No more than five: TensorBoard's table hides what comes after these until it is ticked.
        settings: dict[str, str | int] = {
            "model": run.model.name,
            "train": run.train,
            "effects": ",".join(e.name for e in run.model.effects) or "none",
            "fit": run.method,
        }
        known = scores(run)._asdict().items()
        metrics = {f"error_percent/{name}": 100 * value for name, value in known if value is not None}
        if origin:
            settings["fit"] = f"{run.method}, split by {origin.split}"
            settings["seed"] = origin.seed
            writer.add_text("story", run_story(run, origin))
        writer.add_custom_scalars(FITTED)
        for name, value in metrics.items():
            writer.add_scalar(name, value, 0)
        # add_hparams would open a second event file in a folder of its own.
        file = writer._get_file_writer()
        # Nor is it declared with types.
        make: Any = hparams
        for summary in make(settings, metrics):
            file.add_summary(summary)
