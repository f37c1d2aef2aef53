"""Two looks at the residuals that need no candidate. Each speaks only where it can tell."""

from __future__ import annotations

from dataclasses import dataclass

# Chance at which a screen speaks. Its false statements are counted by experiments/hidden_effects: at most 2 %.
ALPHA = 0.004


@dataclass(frozen=True)
class Screen:
    """shows: whether what it looks for shows; None where the rows cannot tell, and then p_value is None too. p_value:
    chance that noise alone would look like this. says: in words. at_most: force [N] and moment [N·m] that a denial
    leaves possible, with 99 % confidence; None where it puts no figure on it."""

    name: str
    shows: bool | None
    p_value: float | None
    says: str
    at_most: tuple[float, float] | None = None
