"""How a laboratory of the plans measures: drawn at random."""

from __future__ import annotations

import numpy as np

from freelearn.testing.reference.laboratory import KINDS

NORMAL_SHARE, SLIPPED_SHARE, ODD_SHARE = 0.5, 2 / 3, 0.2


def settings(protocol: str, generator: np.random.Generator) -> dict:
    """Arguments of Laboratory that are not its own; all JSON."""
    chosen: dict = {"order": "sorted"} if protocol == "sorted" else {}
    if protocol == "short":
        chosen |= {"states": int(generator.integers(6, 41)), "pressures": int(generator.integers(3, 9)), "falling": 0}
    tails, slipped, growth, misstated = (generator.random() for _ in range(4))
    if tails > NORMAL_SHARE:
        chosen["tails"] = 4.0
    if slipped < SLIPPED_SHARE:
        chosen["slipped"] = float(generator.choice([0.002, 0.01, 0.01, 0.03]))
        if generator.random() < ODD_SHARE:
            chosen["kinds"] = list(KINDS)
    if growth < ODD_SHARE:
        chosen["growth"] = float(generator.uniform(1, 2))
    if misstated < ODD_SHARE:
        chosen["misstated"] = float(generator.choice([1 / 3, 3.0]))
    return chosen
