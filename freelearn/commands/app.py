"""train and discover as Hydra applications: a composed configuration becomes checked settings, then a run."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf

from freelearn.commands.command_line import command_line, program
from freelearn.commands.configuration import CONF, offer_own_models
from freelearn.commands.parse import parse
from freelearn.commands.settings import DiscoverSettings, TrainSettings
from freelearn.errors import UserError


def train_app() -> None:
    """`train`, from the words of the command line."""
    _run(_train, "train")


def discover_app() -> None:
    """`discover`, from the words of the command line."""
    _run(_discover, "discover")


def _run(task: Callable[[DictConfig], float | None], name: str) -> None:
    try:
        offer_own_models()
    except UserError as mistake:
        sys.exit(f"error: {mistake}")
    hydra.main(version_base="1.3", config_path=str(CONF), config_name=name)(task)()


def _train(config: DictConfig) -> float | None:
    chosen = HydraConfig.get()
    folder = Path(chosen.runtime.output_dir)
    command = command_line([*program("train")], chosen.overrides.task)
    several = chosen.mode == RunMode.MULTIRUN
    try:
        content: Any = OmegaConf.to_container(config, resolve=True)
        if several:
            from freelearn.commands.job import sweep_job

            return sweep_job(content, chosen.job.num, folder, command)
        settings = parse(TrainSettings, content)
        # After the settings are checked: torch and Lightning take seconds to import.
        from rich.console import Console

        from freelearn.commands.train import train

        train(settings, folder, console=Console(), command=command)
    except UserError as mistake:
        _leave_nothing(folder)
        sys.exit(f"error: {mistake}")
    except KeyboardInterrupt:
        if several:
            sys.exit(f"error: interrupted; the same command with hydra.sweep.dir={folder.parent} goes on from here.")
        sys.exit("error: interrupted before the run was complete; its folder holds no results.json.")
    return None


def _discover(config: DictConfig) -> None:
    chosen = HydraConfig.get()
    folder = Path(chosen.runtime.output_dir)
    try:
        content: Any = OmegaConf.to_container(config, resolve=True)
        settings = parse(DiscoverSettings, content)
        # After the settings are checked, as above.
        from rich.console import Console

        from freelearn.commands.discover import discover

        command = command_line([*program("discover")], chosen.overrides.task)
        discover(settings, folder, Console(), command)
    except UserError as mistake:
        _leave_nothing(folder)
        sys.exit(f"error: {mistake}")
    except KeyboardInterrupt:
        sys.exit("error: interrupted; the same command with hydra.run.dir=… of this run goes on from the last step.")


def _leave_nothing(folder: Path) -> None:
    """Removes the folder of a run that ended before it began: only what Hydra itself wrote there, and empty folders."""
    if {path.name for path in folder.glob("*")} - {".hydra"}:
        return
    for path in (folder / ".hydra").glob("*.yaml"):
        path.unlink()
    for empty in (folder / ".hydra", folder, folder.parent):
        try:
            empty.rmdir()
        except OSError:
            return  # not empty, or not ours to remove
