"""How alike the effects' traces are in these data."""

from __future__ import annotations

import numpy as np
import pandas as pd

# Effects more alike than this can hardly be told apart.
TWINS = 0.95


def likeness_table(names: list[str], cosine: np.ndarray) -> pd.DataFrame:
    """Largest cosine between the traces of each two effects after refitting, 1 for twins: column `effect`, and one for
    each effect that left a trace. cosine: (k, k), of the k effects named."""
    table = pd.DataFrame(cosine, columns=names)
    table.insert(0, "effect", names)
    return table
