"""Where a command computes."""

from __future__ import annotations

import torch

from freelearn.errors import UserError


def resolve_device(name: str) -> str:
    """cpu or cuda, from cpu, cuda or auto. Raises UserError where there is no such device."""
    there = torch.cuda.is_available()
    if name == "auto":
        return "cuda" if there else "cpu"
    if name == "cuda" and not there:
        raise UserError("device=cuda: PyTorch finds no CUDA device here; choose device=cpu, or device=auto.")
    return name
