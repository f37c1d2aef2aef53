"""Fit one model on one training set and evaluate it: python train.py model=continuum train=sample3."""

import sys
from pathlib import Path
from typing import Any

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf


@hydra.main(version_base="1.3", config_path="conf", config_name="train")
def main(config: DictConfig) -> float | None:
    from rich.console import Console

    from freelearn.commands.command_line import command_line
    from freelearn.commands.train import train
    from freelearn.errors import UserError

    hydra_config = HydraConfig.get()
    folder = Path(hydra_config.runtime.output_dir)
    try:
        command = command_line(["train.py"], hydra_config.overrides.task)
        settings: Any = OmegaConf.to_container(config, resolve=True)
        if hydra_config.mode == RunMode.MULTIRUN:
            from freelearn.commands.job import sweep_job

            return sweep_job(settings, hydra_config.job.num, folder, command)
        train(settings, folder, console=Console(), command=command)
    except UserError as mistake:
        sys.exit(f"error: {mistake}")
    except KeyboardInterrupt:
        if hydra_config.mode == RunMode.MULTIRUN:
            sys.exit(f"error: interrupted; the same command with hydra.sweep.dir={folder.parent} goes on from here.")
        sys.exit("error: interrupted before the run was complete; its folder holds no results.json.")
    return None


if __name__ == "__main__":
    main()
