"""How alike the effects' traces are in these data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
import torch

from freelearn.inference.score import EffectScore

# Effects more alike than this can hardly be told apart.
TWINS = 0.95


def likeness_table(scores: Sequence[EffectScore]) -> pd.DataFrame:
    """Largest cosine between the traces of each two effects after refitting, 1 for twins: column `effect`, and one for
    each effect that left a trace."""
    shown = [(s.effect, s.signature) for s in scores if s.signature is not None]
    spans = [torch.linalg.qr(signature).Q for _, signature in shown]
    cosine = np.array([[float(torch.linalg.matrix_norm(a.T @ b, 2)) for b in spans] for a in spans])
    names = [name for name, _ in shown]
    table = pd.DataFrame(cosine.reshape(len(names), len(names)).clip(0, 1), columns=names)
    table.insert(0, "effect", names)
    return table
