"""Where a model fails and which effect is missing: python discover.py model=continuum data=csv data.path=mine.csv."""

import sys
from pathlib import Path
from typing import Any

import hydra
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf


@hydra.main(version_base="1.3", config_path="conf", config_name="discover")
def main(config: DictConfig) -> None:
    from rich.console import Console

    from freelearn.commands.command_line import command_line
    from freelearn.commands.discover import discover
    from freelearn.errors import UserError

    try:
        settings: Any = OmegaConf.to_container(config, resolve=True)
        command = command_line(["discover.py"], HydraConfig.get().overrides.task)
        discover(settings, Path(HydraConfig.get().runtime.output_dir), Console(), command)
    except UserError as mistake:
        sys.exit(f"error: {mistake}")
    except KeyboardInterrupt:
        sys.exit("error: interrupted; the same command with hydra.run.dir=… of this run goes on from the last step.")


if __name__ == "__main__":
    main()
