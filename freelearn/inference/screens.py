"""Two looks at the residuals that need no candidate. Each speaks only where it can tell."""

from __future__ import annotations

from dataclasses import dataclass

# Chance at which a screen speaks. Its false statements are counted by experiments/hidden_effects: at most 2 %.
ALPHA = 0.004


@dataclass(frozen=True)
class Screen:
    """p_value: chance that noise alone would look like this; None where the rows cannot tell. says: in words."""

    name: str
    p_value: float | None
    says: str
