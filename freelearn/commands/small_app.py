"""intake, predict and plan as Hydra applications: one task each, which leaves no empty folder behind."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hydra
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf

from freelearn.commands.configuration import CONF
from freelearn.errors import UserError
from freelearn.files import remove_empty

# What a command does with the plain values of its configuration and its folder.
Task = Callable[[Any, Path], None]


def small_app(name: str, task: Task, before: str) -> None:
    """The command of this name, from the words of the command line. before: what an interruption came before."""

    def run(config: DictConfig) -> None:
        folder = Path(HydraConfig.get().runtime.output_dir)
        try:
            task(OmegaConf.to_container(config, resolve=True), folder)
        except UserError as mistake:
            sys.exit(f"error: {mistake}")
        except KeyboardInterrupt:
            sys.exit(f"error: interrupted before {before}.")
        finally:
            # After a mistake, or with files elsewhere, there is nothing in it.
            remove_empty(folder)

    hydra.main(version_base="1.3", config_path=str(CONF), config_name=name)(run)()
