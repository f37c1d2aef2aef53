"""A command as a Hydra application: what Hydra itself refuses is one sentence too, and its words execute nothing."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any

import hydra
from hydra._internal.utils import get_args_parser
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from freelearn.api.settings.configuration import mistyped, uncomposed
from freelearn.api.settings.settings import quoted
from freelearn.cli.command_line import exit_on_user_error
from freelearn.cli.hold import leave_nothing
from freelearn.common.errors import UserError
from freelearn.common.files import remove_empty
from freelearn.common.package import CONF

# Options of Hydra's that take configurations from elsewhere, the last one as a pickle: these may name code to execute.
ELSEWHERE = ("config_path", "config_name", "config_dir", "experimental_rerun")
# What may be set of Hydra itself. Its callbacks, logging, search path and environment name code to execute.
OPEN = (
    "hydra.run", "hydra.sweep", "hydra.sweeper", "hydra.launcher", "hydra.mode", "hydra.verbose",
    "hydra.output_subdir", "hydra.job.name", "hydra.job.num", "hydra.job.id",
)  # fmt: skip


def hydra_app(name: str, task: Callable[[DictConfig], float | None]) -> None:
    """Composes the configuration file of this name with the words of the command line, and does the task with it."""
    begun: list[bool] = []

    @wraps(task)
    def begin(config: DictConfig) -> float | None:
        begun.append(True)
        try:
            return task(config)
        except OmegaConfBaseException as mistake:
            # A value that cannot be resolved; here, because Hydra would put a line of its own before it.
            sys.exit(f"error: {str(mistake).strip()}")

    # Hydra then raises what it would else print with a traceback.
    os.environ["HYDRA_FULL_ERROR"] = "1"
    with exit_on_user_error("interrupted before it began."):
        options, _ = get_args_parser().parse_known_args()
        if options.help:
            from rich.console import Console

            from freelearn.cli.command_help import show_help

            return show_help(name, Console())
        for option in ELSEWHERE:
            if getattr(options, option) is not None:
                shown = option.replace("_", "-")
                raise UserError(f"--{shown} is not possible, for what it reads could execute code: write name=value.")
        check_words(options.overrides)
        sys.argv[1:] = [quoted(word) for word in sys.argv[1:]]
        try:
            hydra.main(version_base="1.3", config_path=str(CONF), config_name=name)(begin)()
        except (HydraException, OmegaConfBaseException) as mistake:
            if (wrong := mistyped(name, mistake)) is not None:
                raise wrong from None
            cause = mistake.__cause__
            reasons = [mistake, *([cause] if isinstance(cause, OmegaConfBaseException) else [])]
            raise UserError("\n".join(str(reason).strip() for reason in reasons)) from None
        except (ValueError, RecursionError) as mistake:
            if begun:
                raise
            raise UserError(uncomposed(mistake)) from None
        except OSError:
            leave_nothing()
            raise


def values_of(config: DictConfig) -> Any:
    """A composed configuration as plain values. Raises UserError where a ${…} in it names nothing.

    Those of the configuration library read settings, environment variables and the time, and execute nothing.
    """
    try:
        return OmegaConf.to_container(config, resolve=True)
    except OmegaConfBaseException as mistake:
        raise UserError(str(mistake).strip()) from None


def check_words(words: Sequence[str]) -> None:
    """Refuses overrides that could have Hydra execute something. Raises UserError.

    >>> check_words(["model=linear", "hydra.run.dir=there", "hydra/launcher=joblib"])
    """
    for word in words:
        try:
            word.encode()
        except UnicodeError:
            raise UserError(f"{word!a} is not UTF-8 text: choose another name.") from None
        name = word.split("=")[0].strip().lstrip("+~").replace("/", ".").split("@")[0]
        of_hydra = name.split(".")[0] == "hydra"
        if of_hydra and ("_target_" in word or not any(f"{name}.".startswith(f"{known}.") for known in OPEN)):
            raise UserError(f"{word.split('=')[0]} is not possible: it could execute code. Leave it out.")


# intake, predict and plan as Hydra applications: one task each, which leaves no empty folder behind.

# What a command does with the plain values of its configuration and its folder.
Task = Callable[[Any, Path], None]


def small_app(name: str, task: Task, before: str) -> None:
    """The command of this name, from the words of the command line. before: what an interruption came before."""

    def run(config: DictConfig) -> None:
        folder = Path(HydraConfig.get().runtime.output_dir)
        try:
            with exit_on_user_error(f"interrupted before {before}.", folder):
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
