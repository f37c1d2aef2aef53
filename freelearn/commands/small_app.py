"""intake, predict and plan as Hydra applications: one task each, which leaves no empty folder behind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from freelearn.commands.ending import one_sentence
from freelearn.commands.hydra_app import hydra_app, values_of
from freelearn.errors import UserError
from freelearn.files import remove_empty

# What a command does with the plain values of its configuration and its folder.
Task = Callable[[Any, Path], None]


def small_app(name: str, task: Task, before: str) -> None:
    """The command of this name, from the words of the command line. before: what an interruption came before."""

    def run(config: DictConfig) -> None:
        folder = Path(HydraConfig.get().runtime.output_dir)
        try:
            with one_sentence(f"interrupted before {before}.", folder):
                content = values_of(config)
                _refuse_missing_run(content)
                task(content, folder)
        finally:
            # After a mistake, or with files elsewhere, there is nothing in it.
            remove_empty(folder)

    hydra_app(name, run)


def _refuse_missing_run(content: Any) -> None:
    """A mistyped folder is told before torch is loaded, which takes seconds. Raises UserError."""
    run = content.get("run") if isinstance(content, dict) else None
    if run and run != "???" and not Path(str(run)).is_dir():
        raise UserError(f"No folder at {run}: give that of a run of train or discover, run=FOLDER.")
