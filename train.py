"""Fit one model on one training set and evaluate it: python train.py model=continuum train=sample3."""

import sys
from pathlib import Path

import hydra
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig


@hydra.main(version_base="1.3", config_path="conf", config_name="train")
def main(config: DictConfig) -> None:
    from freelearn.errors import UserError
    from freelearn.train import train

    try:
        train(config, Path(HydraConfig.get().runtime.output_dir))
    except UserError as mistake:
        sys.exit(f"error: {mistake}")
    except KeyboardInterrupt:
        sys.exit("error: interrupted before the run was complete; its folder holds no results.json.")


if __name__ == "__main__":
    main()
