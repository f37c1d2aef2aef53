"""Blanks filled in by a fitted model, every solution with its band."""
