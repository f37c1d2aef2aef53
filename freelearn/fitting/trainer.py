"""Lightning's trainer, made once and lent to one fit after another."""

from __future__ import annotations

import logging
import warnings
from functools import lru_cache
from pathlib import Path

import lightning as L
from lightning.pytorch.loggers import TensorBoardLogger


def run(
    module: L.LightningModule,
    data: L.LightningDataModule,
    folder: Path | None = None,
    progress: L.Callback | None = None,
    device: str = "cpu",
) -> None:
    """Trains the module until it says stop. folder: of TensorBoard's curves. device: cpu or cuda.

    Raises KeyboardInterrupt when the user stops it.
    """
    trainer = _trainer(device)
    # What other packages add to every trainer stays.
    callbacks: list[L.Callback] = trainer.callbacks  # type: ignore[attr-defined]
    trainer.loggers = [TensorBoardLogger(folder, name="", version="")] if folder else []
    trainer.callbacks = [*callbacks, progress] if progress else callbacks  # type: ignore[attr-defined]
    try:
        with warnings.catch_warnings():
            # One batch of everything needs no loader workers; Lightning advises them at every fit.
            warnings.simplefilter("ignore")
            trainer.fit(module, datamodule=data)
    except BaseException as error:
        # A trainer that was interrupted is not used again.
        _trainer.cache_clear()
        if isinstance(error, SystemExit):
            # What Lightning makes of Ctrl-C; callers expect the usual.
            raise KeyboardInterrupt from None
        raise
    finally:
        trainer.loggers = []
        trainer.callbacks = callbacks  # type: ignore[attr-defined]


@lru_cache
def _trainer(device: str) -> L.Trainer:
    """Making one takes longer than a small fit."""
    # Lightning announces devices and tips at every start; the table at the end says what users need.
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    return L.Trainer(
        max_epochs=-1,
        accelerator="gpu" if device == "cuda" else device,
        devices=1,
        logger=False,
        enable_checkpointing=False,
        enable_model_summary=False,
        enable_progress_bar=False,
        log_every_n_steps=1,
    )
