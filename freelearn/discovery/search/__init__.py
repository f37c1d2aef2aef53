"""Sets of effects, best first, and the answer that they share."""
