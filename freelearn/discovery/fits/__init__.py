"""Whitened fits, and what is left of rows that they did not see."""
