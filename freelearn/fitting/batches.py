"""The rows of a fit, as Lightning wants them."""

from __future__ import annotations

import lightning as L
import torch
from torch.utils.data import DataLoader

from freelearn.measurements.rows import Rows

# All training rows and all validation rows.
Batch = tuple[Rows, Rows]


class FitData(L.LightningDataModule):
    """One batch an epoch: every training row and every validation row. The sets are small; algorithms cut their own."""

    def __init__(self, train: Rows, validation: Rows) -> None:
        super().__init__()
        self.batches: list[Batch] = [(train, validation)]

    def train_dataloader(self) -> DataLoader[Batch]:
        """The one batch."""
        # batch_size=None hands the tuple through as it is, without collating rows one by one.
        return DataLoader(self.batches, batch_size=None)  # type: ignore[arg-type]

    def release(self) -> None:
        """Lets the rows go: the trainer, which is kept, holds what it was given."""
        self.batches.clear()

    def transfer_batch_to_device(self, batch: Batch, device: torch.device, dataloader_idx: int) -> Batch:
        """The rows where the model is."""
        train, validation = batch
        return train.to(device), validation.to(device)
