"""train and discover as Hydra applications: a composed configuration becomes checked settings, then a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig

from freelearn.api.settings.configuration import offer_own_models
from freelearn.api.settings.parse import parse
from freelearn.api.settings.settings import DiscoverSettings, TrainSettings
from freelearn.cli.command_line import command_line, exit_on_user_error, program, resumed
from freelearn.cli.hold import leave_nothing
from freelearn.cli.hydra_app import hydra_app, values_of
from freelearn.common.errors import UserError

# In a terminal, within a second of the command.
LOADING = "loading torch and Lightning…"


def train_app() -> None:
    """`train`, from the words of the command line."""
    _run(_train, "train")


def discover_app() -> None:
    """`discover`, from the words of the command line."""
    _run(_discover, "discover")


def _run(task: Callable[[DictConfig], float | None], name: str) -> None:
    with exit_on_user_error("interrupted before it began."):
        offer_own_models()
    hydra_app(name, task)


def _train(config: DictConfig) -> float | None:
    chosen = HydraConfig.get()
    folder = Path(chosen.runtime.output_dir)
    command = command_line([*program("train")], chosen.overrides.task)
    if chosen.mode == RunMode.MULTIRUN:
        again = resumed("hydra.sweep.dir", folder.parent)
        with exit_on_user_error(f"interrupted; {again}.", folder):
            from freelearn.cli.sweep_job import sweep_job

            return sweep_job(values_of(config), chosen.job.num, folder, command)
    none = "interrupted before the run was complete; its folder holds no results.json."
    with exit_on_user_error(none, folder), _nothing(folder):
        settings = parse(TrainSettings, values_of(config))
        # After the settings are checked: torch and Lightning take seconds to import.
        from rich.console import Console

        from freelearn.report.terminal.long_work import LongWork

        console = Console()
        with LongWork(console, LOADING):
            from freelearn.api.tasks.train_task import train

        train(settings, folder, console=console, command=command)
    return None


def _discover(config: DictConfig) -> None:
    chosen = HydraConfig.get()
    folder = Path(chosen.runtime.output_dir)
    with exit_on_user_error(f"interrupted; {resumed('hydra.run.dir', folder)}.", folder), _nothing(folder):
        settings = parse(DiscoverSettings, values_of(config))
        # After the settings are checked, as above.
        from rich.console import Console

        from freelearn.report.terminal.long_work import LongWork

        console = Console()
        with LongWork(console, LOADING):
            from freelearn.api.tasks.discover_task import discover

        command = command_line([*program("discover")], chosen.overrides.task)
        discover(settings, folder, console, command)


@contextmanager
def _nothing(folder: Path) -> Iterator[None]:
    """Leaves no folder of a run that ended by a mistake before it began."""
    try:
        yield
    except (UserError, OSError):
        leave_nothing(folder)
        raise
